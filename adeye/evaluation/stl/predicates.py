"""Robustness of predicates: terms over whole series, compared and divided by their scale.

"No conflict" (+inf) passes through arithmetic; where it makes a comparison infinite, the declared
cap is the margin. A term carries its scale and its cap through sums (the largest) and products
(the product), so that a predicate of several signals is measured in their common unit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.evaluation.stl.series import Series, read_samples
from adeye.evaluation.stl.syntax import (
    Arithmetic,
    Comparison,
    Constant,
    Equality,
    Predicate,
    Signal,
    Term,
    label_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from adeye.signals import Bools, Floats

TRUTH_MARGIN = 1.0
"""Robustness of a truth value or an equality of labels: plus or minus one scale."""


@dataclass(frozen=True, slots=True)
class Operand:
    """A term over B runs.

    Attributes:
        values: (B, T) [SI], +inf or -inf where "no conflict" made it so.
        is_unknown: (B, T) whether a sample that it reads is not applicable.
        is_error: (B, T) whether it has no value for another reason.
        scale: Size of one unit of robustness; of a constant, its magnitude.
        is_constant: Whether it reads no signal.
        caps: Margin that counts for +inf and for -inf; None where it cannot become that.
    """

    values: Floats
    is_unknown: Bools
    is_error: Bools
    scale: float
    is_constant: bool = True
    caps: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True, slots=True)
class Margins:
    """A predicate over B runs; robustness and truth are arbitrary where unknown or an error.

    Attributes:
        robustness: (B, T) margin divided by the scale.
        is_true: (B, T).
        is_unknown: (B, T).
        is_error: (B, T).
        margin: (B, T) margin in the predicate's own unit.
    """

    robustness: Floats
    is_true: Bools
    is_unknown: Bools
    is_error: Bools
    margin: Floats


def predicate_margins(
    predicate: Predicate, inputs: Mapping[str, Series], shape: tuple[int, int]
) -> Margins:
    """Measure a predicate at every row.

    Args:
        predicate: The predicate; its names and dimensions have been checked.
        inputs: Series by name.
        shape: (B, T).

    Returns:
        Its margins, arrays (B, T).
    """
    if isinstance(predicate, Comparison):
        return _comparison(predicate, inputs, shape)
    if isinstance(predicate, Equality):
        return _equality(predicate, inputs, shape)
    samples = read_samples(inputs[predicate.name])
    return _truth(samples.values == 1.0, samples.is_unknown, samples.is_error)


def term_values(term: Term, inputs: Mapping[str, Series], shape: tuple[int, int]) -> Operand:
    """Calculate a term at every row; arrays (B, T)."""
    if isinstance(term, Constant):
        nothing = np.zeros(shape, dtype=bool)
        return Operand(np.full(shape, term.value), nothing, nothing, abs(term.value))
    if isinstance(term, Arithmetic):
        operands = [term_values(operand, inputs, shape) for operand in term.operands]
        with np.errstate(all="ignore"):
            return _apply(term.operator, operands)
    series, samples = inputs[term.name], read_samples(inputs[term.name])
    return Operand(
        samples.values,
        samples.is_unknown,
        samples.is_error,
        series.scale,
        is_constant=False,
        caps=(series.cap, None),
    )


def _largest(first: float | None, second: float | None) -> float | None:
    return max((cap for cap in (first, second) if cap is not None), default=None)


def _opposite(operand: Operand) -> Operand:
    return Operand(
        -operand.values,
        operand.is_unknown,
        operand.is_error,
        operand.scale,
        operand.is_constant,
        (operand.caps[1], operand.caps[0]),
    )


def _apply(operator: str, operands: list[Operand]) -> Operand:
    if operator == "negate":
        return _opposite(operands[0])
    if operator == "abs":
        only = operands[0]
        caps = (_largest(*only.caps), None)
        return Operand(
            np.abs(only.values), only.is_unknown, only.is_error, only.scale, only.is_constant, caps
        )
    result = operands[0]
    for operand in operands[1:]:
        if operator == "-":
            result = _linear(np.add, result, _opposite(operand))
        elif operator in _LINEAR:
            result = _linear(_LINEAR[operator], result, operand)
        else:
            result = _scaled(operator, result, operand)
    return result


_LINEAR: dict[str, Callable[[Floats, Floats], Any]] = {
    "+": np.add,
    "min": np.minimum,
    "max": np.maximum,
}


def _linear(operation: Callable[[Floats, Floats], Any], left: Operand, right: Operand) -> Operand:
    """Combine two terms of one dimension; a constant has no say in the scale."""
    scales = [part.scale for part in (left, right) if not part.is_constant]
    caps = (_largest(left.caps[0], right.caps[0]), _largest(left.caps[1], right.caps[1]))
    values = operation(left.values, right.values)
    scale = max(scales, default=abs(float(values.flat[0])) if values.size else 1.0)
    return _checked(values, left, right, scale, caps)


def _scaled(operator: str, left: Operand, right: Operand) -> Operand:
    """Multiply or divide two terms."""
    factor = right.scale if operator == "*" else _inverse(right.scale)
    caps = [cap * factor for cap in left.caps if cap is not None]
    if operator == "*":
        values = left.values * right.values
        caps += [cap * left.scale for cap in right.caps if cap is not None]
    else:
        values = np.where(right.values == 0.0, np.nan, left.values / right.values)
    # The sign of a product is not known in advance: it may become +inf and -inf.
    cap = max((cap for cap in caps if cap > 0.0), default=None)
    return _checked(values, left, right, left.scale * factor, (cap, cap))


def _inverse(scale: float) -> float:
    return 1.0 / scale if scale > 0.0 else 0.0


def _checked(
    values: Floats,
    left: Operand,
    right: Operand,
    scale: float,
    caps: tuple[float | None, float | None],
) -> Operand:
    """Make an error of every result that is no number, or infinite without an infinite operand."""
    is_unknown = left.is_unknown | right.is_unknown
    was_infinite = np.isinf(left.values) | np.isinf(right.values)
    is_error = np.isnan(values) | (np.isinf(values) & ~was_infinite)
    is_error = left.is_error | right.is_error | (is_error & ~is_unknown)
    values = np.where(is_error | is_unknown, 0.0, values)
    is_constant = left.is_constant and right.is_constant
    return Operand(values, is_unknown, is_error, scale, is_constant, caps)


def _comparison(
    predicate: Comparison, inputs: Mapping[str, Series], shape: tuple[int, int]
) -> Margins:
    left = term_values(predicate.left, inputs, shape)
    right = term_values(predicate.right, inputs, shape)
    greater, lesser = (left, right) if predicate.operator in {">", ">="} else (right, left)
    is_strict = predicate.operator in {">", "<"}
    with np.errstate(all="ignore"):
        difference = _linear(np.add, greater, _opposite(lesser))
    is_true = greater.values > lesser.values
    if not is_strict:
        is_true |= greater.values == lesser.values
    margin = np.clip(difference.values, *_limits(difference))
    is_error = difference.is_error | ~np.isfinite(margin)
    scale = difference.scale if difference.scale > 0.0 else 1.0
    return Margins(margin / scale, is_true, difference.is_unknown, is_error, margin)


def _limits(difference: Operand) -> tuple[float, float]:
    upper, lower = difference.caps
    return (-np.inf if lower is None else -lower, np.inf if upper is None else upper)


def _equality(predicate: Equality, inputs: Mapping[str, Series], shape: tuple[int, int]) -> Margins:
    label = label_of(predicate)
    if isinstance(predicate.left, Signal) and inputs[predicate.left.name].kind != "number":
        left_series = inputs[predicate.left.name]
        left = read_samples(left_series)
        if label is not None:
            code = float(_code(left_series, label))
            is_equal = left.values == code
            is_unknown, is_error = left.is_unknown, left.is_error
        else:
            right = read_samples(inputs[_name(predicate.right)])
            is_equal = left.values == right.values
            is_unknown = left.is_unknown | right.is_unknown
            is_error = left.is_error | right.is_error
        return _truth(is_equal != predicate.is_negated, is_unknown, is_error)
    return _numeric_equality(predicate, inputs, shape)


def _numeric_equality(
    predicate: Equality, inputs: Mapping[str, Series], shape: tuple[int, int]
) -> Margins:
    left = term_values(predicate.left, inputs, shape)
    right = term_values(predicate.right, inputs, shape)
    with np.errstate(all="ignore"):
        difference = _linear(np.add, left, _opposite(right))
    is_error = difference.is_error | ~np.isfinite(difference.values)
    distance = np.abs(difference.values)
    margin = distance if predicate.is_negated else -distance
    is_true = (distance == 0.0) != predicate.is_negated
    scale = difference.scale if difference.scale > 0.0 else 1.0
    return Margins(margin / scale, is_true, difference.is_unknown, is_error, margin)


def _name(term: Term) -> str:
    if not isinstance(term, Signal):
        msg = f"{term!r} is not the name of a signal"
        raise TypeError(msg)
    return term.name


def _code(series: Series, label: str) -> int:
    words = ("false", "true") if series.kind == "boolean" else series.labels
    return words.index(label)


def _truth(is_true: Bools, is_unknown: Bools, is_error: Bools) -> Margins:
    margin = np.where(is_true, TRUTH_MARGIN, -TRUTH_MARGIN)
    return Margins(margin, is_true, is_unknown, is_error, margin)
