"""A stack machine for expressions over one run's variables; truth is 1.0 and 0.0.

What is undefined is never true: a comparison with NaN is false, ``and``, ``or`` and ``not`` take
NaN as false, and every number that is computed from NaN is NaN. Comparisons are those of
``kernel.relation``, so the size of what a number was made of goes along with it.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import cos, exp, log, power, sin
from adeye.kernel.jit import allocating, compiled, inlined
from adeye.kernel.relation import compares, settled

MAX_STACK: Final = 128
"""Most values that a program may hold at once; who makes a program has to keep to it."""

PUSH_NUMBER, PUSH_VARIABLE = 0, 1
OPERATOR_CODES: Final = {
    "+": 2,
    "-": 3,
    "*": 4,
    "/": 5,
    "**": 6,
    "==": 7,
    "!=": 8,
    "<": 9,
    "<=": 10,
    ">": 11,
    ">=": 12,
    "and": 13,
    "or": 14,
    "not": 15,
    "negative": 16,
    # Value, found, item -> value, found or value == item; then value, found -> found.
    "member": 29,
    "found": 30,
}
FUNCTION_CODES: Final = {
    "abs": 17,
    "min": 18,
    "max": 19,
    "sqrt": 20,
    "floor": 21,
    "ceil": 22,
    "sin": 23,
    "cos": 24,
    "exp": 25,
    "log": 26,
    "clip": 27,
    "if_": 28,
}
"""Operation codes; the numbers stand in ``run_program`` as well."""


class Programs(NamedTuple):
    """Postfix programs of different lengths.

    Attributes:
        ops: (P, L) operation codes, see ``run_program``.
        args: (P, L) their arguments.
        lengths: (P,) how many of them belong to each program.
    """

    ops: NDArray[np.int64]
    args: NDArray[np.float64]
    lengths: NDArray[np.int64]


@inlined
def is_satisfied(programs: Programs, number: int, variables: NDArray[np.float64]) -> bool:
    """Tell whether a program gives a number other than zero; an undefined one gives none.

    Args:
        programs: All of them.
        number: Which one.
        variables: (V,) values of the names.
    """
    length = programs.lengths[number]
    value = run_program(programs.ops[number, :length], programs.args[number, :length], variables)
    # NaN compares false.
    return value > 0.0 or value < 0.0


@allocating
def run_program(  # noqa: C901 - one branch for each number of operands
    ops: NDArray[np.int64], args: NDArray[np.float64], variables: NDArray[np.float64]
) -> float:
    """Evaluate a postfix program.

    Args:
        ops: Operation codes of a program that needs at most ``MAX_STACK`` values at once.
        args: The number of a PUSH_NUMBER, the position of a PUSH_VARIABLE, else unused.
        variables: (V,) values of the names.

    Returns:
        The value left on the stack. A comparison with NaN is false, a division by zero or a root
        or logarithm outside its domain gives NaN or an infinity, never an exception.
    """
    stack = np.empty(MAX_STACK)
    sizes = np.empty(MAX_STACK)
    top = -1
    for at in range(ops.shape[0]):
        op = ops[at]
        if op <= 1:
            top += 1
            stack[top] = args[at] if op == 0 else variables[int(args[at])]
            sizes[top] = abs(stack[top])
        elif op <= 14 or op in (18, 19):
            top -= 1
            left, right = float(stack[top]), float(stack[top + 1])
            one, other = float(sizes[top]), float(sizes[top + 1])
            if op == 5:
                right = settled(op, right, other)
            else:
                left = settled(op, left, one)
            stack[top] = _binary(op, left, right, max(one, other))
            sizes[top] = _size(op, stack[top], left, right, one, other)
        elif op in (27, 28):
            top -= 2
            first, second, third = stack[top], stack[top + 1], stack[top + 2]
            stack[top] = _ternary(op, float(first), float(second), float(third))
            if op == 28:
                sizes[top] = sizes[top + 1] if first != 0.0 else sizes[top + 2]
            elif stack[top] != first:
                sizes[top] = sizes[top + 1] if stack[top] == second else sizes[top + 2]
        elif op == 29:
            top -= 1
            size = max(float(sizes[top - 1]), float(sizes[top + 1]))
            if compares(7, float(stack[top - 1]), float(stack[top + 1]), size):
                stack[top] = 1.0
        elif op == 30:
            top -= 1
            stack[top] = stack[top + 1]
            sizes[top] = abs(stack[top])
        else:
            size = float(sizes[top])
            inner = settled(op, float(stack[top]), size)
            stack[top] = unary(op, inner)
            sizes[top] = _unary_size(op, stack[top], inner, size)
    return float(stack[top])


@allocating
def unary_column(op: int, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Apply an operation of one operand to every value of a column (N,)."""
    results = np.empty(values.shape[0])
    for row in range(values.shape[0]):
        results[row] = unary(op, float(values[row]))
    return results


@allocating
def power_column(bases: NDArray[np.float64], exponents: NDArray[np.float64]) -> NDArray[np.float64]:
    """Raise every value of a column (N,) to a power (N,)."""
    results = np.empty(bases.shape[0])
    for row in range(bases.shape[0]):
        results[row] = _raised(float(bases[row]), float(exponents[row]))
    return results


@compiled
def unary(op: int, value: float) -> float:
    """Apply an operation of one operand, by its code."""
    if math.isnan(value):
        return 0.0 if op == 15 else value
    if op >= 23:
        return _elementary(op, value)
    result = value
    if op == 15:
        result = 1.0 if value == 0.0 else 0.0
    elif op == 16:
        result = -value
    elif op == 17:
        result = abs(value)
    elif op == 20:
        result = math.sqrt(value) if value >= 0.0 else math.nan
    elif op == 21:
        # NumPy's, because math.floor returns an integer, of which the compiler has 64 bits.
        result = float(np.floor(value))
    elif op == 22:
        result = float(np.ceil(value))
    return result


@compiled
def _elementary(op: int, value: float) -> float:
    if op == 23:
        return sin(value)
    if op == 24:
        return cos(value)
    if op == 25:
        return exp(value)
    return log(value)


@compiled
def _unary_size(op: int, value: float, inner: float, size: float) -> float:
    """Size of what the result of one operand is made of: as an error of the operand spreads."""
    if op in (16, 17):
        return size
    if op in (23, 24):
        return abs(value) + size
    if op in (20, 26) and inner > 0.0:
        return abs(value) + size / (value if op == 20 else inner)
    return abs(value)


@compiled
def _size(op: int, value: float, left: float, right: float, one: float, other: float) -> float:
    """Size of what the result of two operands is made of, from the sizes of these.

    Adding does not make the errors of the parts smaller, so a sum is as large as its parts.
    """
    if op in (2, 3):
        return one + other
    if op == 4:
        return one * other
    if op == 5 and right != 0.0:
        return one / abs(right) * (other / abs(right))
    if op == 6:
        return _power_size(value, left, right, one)
    if op in (18, 19):
        return one if value == left else other
    return abs(value)


@compiled
def _power_size(value: float, base: float, exponent: float, size: float) -> float:
    """Size of what a power is made of, as of the products and quotients that it stands for."""
    if exponent > 0.0:
        return power(size, exponent)
    if base != 0.0:
        return abs(value) * power(size / abs(base), -exponent)
    return abs(value)


@compiled
def _binary(op: int, left: float, right: float, size: float) -> float:
    if op <= 6:
        return _arithmetic(op, left, right)
    if op <= 12:
        return 1.0 if compares(op, left, right, size) else 0.0
    if op == 13:
        return 1.0 if _is_true(left) and _is_true(right) else 0.0
    if op == 14:
        return 1.0 if _is_true(left) or _is_true(right) else 0.0
    return _smaller(left, right) if op == 18 else _greater(left, right)


@compiled
def _ternary(op: int, first: float, second: float, third: float) -> float:
    if op == 27:
        return _smaller(_greater(first, second), third)
    if math.isnan(first):
        return first
    return second if first != 0.0 else third


@compiled
def _is_true(value: float) -> bool:
    return value > 0.0 or value < 0.0


@compiled
def _smaller(left: float, right: float) -> float:
    """Return the left one of equals, and NaN if either is."""
    return left if left <= right or math.isnan(left) else right


@compiled
def _greater(left: float, right: float) -> float:
    """Return the left one of equals, and NaN if either is."""
    return left if left >= right or math.isnan(left) else right


@compiled
def _arithmetic(op: int, left: float, right: float) -> float:
    if op == 2:
        return left + right
    if op == 3:
        return left - right
    if op == 4:
        return left * right
    return _raised(left, right) if op == 6 else _divided(left, right)


@compiled
def _divided(left: float, right: float) -> float:
    """Divide; the infinities and NaN of IEEE 754 for a zero divisor, where Python raises."""
    if right != 0.0:
        return left / right
    if left == 0.0 or math.isnan(left):
        return math.nan
    return math.copysign(math.inf, left) * math.copysign(1.0, right)


@compiled
def _raised(base: float, exponent: float) -> float:
    """Raise to a power; NaN if either is, and for a negative base with a broken exponent."""
    if math.isnan(base) or math.isnan(exponent):
        return math.nan
    if base >= 0.0 or math.isinf(exponent) or exponent != np.floor(exponent):
        return power(base, exponent)
    size = power(-base, exponent)
    return -size if np.floor(exponent * 0.5) * 2.0 != exponent else size
