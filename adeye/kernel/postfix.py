"""A stack machine for expressions over one run's variables; truth is 1.0 and 0.0."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled

MAX_STACK: Final = 128

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


@compiled
def run_program(
    ops: NDArray[np.int64], args: NDArray[np.float64], variables: NDArray[np.float64]
) -> float:
    """Evaluate a postfix program.

    Args:
        ops: Operation codes.
        args: The number of a PUSH_NUMBER, the position of a PUSH_VARIABLE, else unused.
        variables: (V,) values of the names.

    Returns:
        The value left on the stack. A comparison with NaN is false, a division by zero or a root
        or logarithm outside its domain gives NaN or an infinity, never an exception.
    """
    stack = np.empty(MAX_STACK)
    top = -1
    for at in range(ops.shape[0]):
        op = ops[at]
        if op == 0:
            top += 1
            stack[top] = args[at]
        elif op == 1:
            top += 1
            stack[top] = variables[int(args[at])]
        elif op <= 14:
            top -= 1
            stack[top] = _binary(op, stack[top], stack[top + 1])
        elif op in (18, 19):
            top -= 1
            low = min(stack[top], stack[top + 1])
            high = max(stack[top], stack[top + 1])
            stack[top] = low if op == 18 else high
        elif op == 27:
            top -= 2
            stack[top] = min(max(stack[top], stack[top + 1]), stack[top + 2])
        elif op == 28:
            top -= 2
            stack[top] = stack[top + 1] if stack[top] != 0.0 else stack[top + 2]
        else:
            stack[top] = _unary(op, stack[top])
    return float(stack[top])


@compiled
def _binary(op: int, left: float, right: float) -> float:
    """Apply an operator of two operands."""
    if op <= 6:
        return _arithmetic(op, left, right)
    if op == 13:
        return 1.0 if left != 0.0 and right != 0.0 else 0.0
    if op == 14:
        return 1.0 if left != 0.0 or right != 0.0 else 0.0
    if op == 7:
        held = left == right
    elif op == 8:
        held = left != right
    elif op == 9:
        held = left < right
    elif op == 10:
        held = left <= right
    elif op == 11:
        held = left > right
    else:
        held = left >= right
    if math.isnan(left) or math.isnan(right):
        held = False
    return 1.0 if held else 0.0


@compiled
def _arithmetic(op: int, left: float, right: float) -> float:
    """Apply + - * / or **."""
    if op == 2:
        return left + right
    if op == 3:
        return left - right
    if op == 4:
        return left * right
    if op == 5:
        if right == 0.0:
            return math.nan if left == 0.0 else math.copysign(math.inf, left)
        return left / right
    if left < 0.0 and right != math.floor(right):
        return math.nan
    if left == 0.0 and right < 0.0:
        return math.inf
    return float(left**right)


@compiled
def _unary(op: int, value: float) -> float:
    """Apply an operator or function of one operand."""
    if op == 15:
        return 1.0 if value == 0.0 else 0.0
    if op == 16:
        return -value
    if op == 17:
        return abs(value)
    if op == 20:
        return math.sqrt(value) if value >= 0.0 else math.nan
    if op == 21:
        return float(math.floor(value)) if math.isfinite(value) else value
    if op == 22:
        return float(math.ceil(value)) if math.isfinite(value) else value
    if not math.isfinite(value):
        return math.nan
    if op == 23:
        return math.sin(value)
    if op == 24:
        return math.cos(value)
    if op == 25:
        return math.exp(value) if value < 709.0 else math.inf
    return math.log(value) if value > 0.0 else math.nan
