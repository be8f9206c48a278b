"""What an expression measures, from the dimensions of the names that it uses."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from adeye.errors import ExpressionError
from adeye.spec.grammar import COMPARISONS, PLAIN, POPS, Exponents, Step
from adeye.units import Dimension, shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_ANGLE = Dimension.ANGLE.exponents


class _Measured(NamedTuple):
    """What is known of a value on the stack; None is open and fits anything."""

    exponents: Exponents | None
    constant: float | None = None


_TRUTH = _Measured(PLAIN)


def measured(
    steps: Sequence[Step], dims: Mapping[str, Dimension | None], text: str
) -> Dimension | None:
    """Infer what an expression measures; None if that is open.

    Args:
        steps: The expression.
        dims: Dimension of each name; None, or no entry, for one that fits anything.
        text: As written, for messages.

    Raises:
        ExpressionError: Lengths are added to speeds, or the like.
    """
    if len(steps) == 1 and steps[0].word == "name":
        return dims.get(steps[0].text)
    stack: list[_Measured] = []
    for step in steps:
        if POPS[step.word] == 0:
            stack.append(_operand(step, dims))
            continue
        if step.word == "member":
            # The value stays below what was found so far.
            _same((stack[-3], stack.pop()), text)
            continue
        operands = stack[-POPS[step.word] :]
        del stack[-POPS[step.word] :]
        stack.append(_applied(step.word, operands, text))
    return _dimension(stack[0].exponents, text)


def _operand(step: Step, dims: Mapping[str, Dimension | None]) -> _Measured:
    if step.word == "number":
        return _Measured(step.exponents, step.number)
    dimension = dims.get(step.text) if step.word == "name" else None
    return _Measured(dimension.exponents if dimension is not None else None)


def _applied(word: str, operands: Sequence[_Measured], text: str) -> _Measured:
    if word in {"and", "or", "not"}:
        for operand in operands:
            _require_plain(operand, "is taken for true or false", text)
        return _TRUTH
    if word in COMPARISONS:
        _same(operands, text)
        return _TRUTH
    if word == "found":
        return _TRUTH
    if word in {"*", "/"}:
        return _product(operands[0], operands[1], 1 if word == "*" else -1)
    if word == "**":
        return _power(operands[0], operands[1], text)
    return _called(word, operands, text)


def _called(word: str, operands: Sequence[_Measured], text: str) -> _Measured:
    if word == "negative":
        constant = operands[0].constant
        return _Measured(operands[0].exponents, None if constant is None else -constant)
    if word == "if_":
        _require_plain(operands[0], "is taken for true or false", text)
        return _same(operands[1:], text)
    if word == "sqrt":
        return _power(operands[0], _Measured(PLAIN, 0.5), text)
    if word in {"sin", "cos"}:
        if operands[0].exponents != _ANGLE:
            _require_plain(operands[0], f"has no {word}", text)
        return _TRUTH
    if word in {"exp", "log"}:
        _require_plain(operands[0], f"has no {word}", text)
        return _TRUTH
    return _same(operands, text)


def _product(left: _Measured, right: _Measured, sign: int) -> _Measured:
    a, b = left.exponents, right.exponents
    if a is None or b is None:
        return _Measured(a if b == PLAIN else None)
    return _Measured((a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2]))


def _power(base: _Measured, power: _Measured, text: str) -> _Measured:
    _require_plain(power, "is an exponent", text)
    if base.exponents is None or base.exponents == PLAIN:
        return _Measured(base.exponents)
    if power.constant is None or abs(power.constant) > 100.0:
        raise ExpressionError(
            f"{shown(text)} raises {_label(base.exponents)} to a power that is no small number"
        )
    raised = [part * power.constant for part in base.exponents]
    if any(part != int(part) for part in raised):
        raise ExpressionError(
            f"{shown(text)} takes a root of {_label(base.exponents)}, which measures nothing"
        )
    return _Measured((int(raised[0]), int(raised[1]), int(raised[2])))


def _same(operands: Sequence[_Measured], text: str) -> _Measured:
    known = [item.exponents for item in operands if item.exponents is not None]
    for other in known[1:]:
        if other != known[0]:
            raise ExpressionError(
                f"{shown(text)} puts {_label(known[0])} and {_label(other)} together",
                remedy="Check the units.",
            )
    return _Measured(known[0] if known else None)


def _require_plain(operand: _Measured, what: str, text: str) -> None:
    if operand.exponents is not None and operand.exponents != PLAIN:
        raise ExpressionError(
            f"{shown(text)}: {_label(operand.exponents)} {what}", remedy="Check the units."
        )


def _dimension(exponents: Exponents | None, text: str) -> Dimension | None:
    if exponents is None:
        return None
    for dimension in Dimension:
        if dimension.exponents == exponents:
            return dimension
    raise ExpressionError(
        f"{shown(text)} measures length^{exponents[0]} time^{exponents[1]} "
        f"angle^{exponents[2]}, which nothing here does"
    )


def _label(exponents: Exponents) -> str:
    for dimension in Dimension:
        if dimension.exponents == exponents:
            return dimension.label
    return "another dimension"
