"""Expressions over whole columns of numbers, truth values or text."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from adeye.spec.grammar import COMPARISONS, POPS, Step

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

Value = str | float | NDArray[Any]
"""A column or a scalar; numpy broadcasts between them."""

_Floats = NDArray[np.float64]


def evaluated(steps: Sequence[Step], columns: Mapping[str, Value]) -> Any:
    """Evaluate the steps of an expression; NaN counts as in ``adeye.kernel.postfix``.

    Args:
        steps: The expression.
        columns: Scalars, text or (N,) columns of all its names.

    Returns:
        A bool, float or str where everything is scalar, else an (N,) array.

    Raises:
        TypeError: Text stands where a number must, or the other way round.
        ValueError: Columns differ in length.
    """
    stack: list[Any] = []
    with np.errstate(all="ignore"):
        for step in steps:
            count = POPS[step.word]
            if step.word == "number":
                stack.append(step.number)
            elif step.word == "text":
                stack.append(step.text)
            elif step.word == "name":
                stack.append(_column(columns[step.text]))
            elif step.word == "member":
                item, found = stack.pop(), stack.pop()
                stack.append(_truth(found) | _compared("==", stack[-1], item))
            elif step.word == "found":
                found = stack.pop()
                stack[-1] = found
            else:
                operands = stack[-count:]
                del stack[-count:]
                stack.append(_applied(step.word, operands))
    result = np.asarray(stack[0])
    return result if result.ndim else result.item()


def may_hold(steps: Sequence[Step], columns: Mapping[str, Value]) -> NDArray[np.bool_]:
    """Tell where a condition can hold, whatever the names are of which nothing is known.

    Args:
        steps: The condition, without text.
        columns: Scalars or arrays, broadcast together, of the names that are known.
    """
    # Each value with where it is certain; what is not certain has any value.
    stack: list[tuple[Any, Any]] = []
    with np.errstate(all="ignore"):
        for step in steps:
            count = POPS[step.word]
            if step.word == "number":
                stack.append((step.number, True))
            elif step.word == "name":
                stack.append((columns.get(step.text, 0.0), step.text in columns))
            elif step.word == "found":
                stack[-2:] = [stack[-1]]
            elif step.word == "member":
                item, found = stack.pop(), stack.pop()
                stack.append(_joined("or", [found, _certain("==", [stack[-1], item])]))
            else:
                operands = stack[-count:]
                del stack[-count:]
                join = _joined if step.word in {"and", "or", "if_"} else _certain
                stack.append(join(step.word, operands))
    value, is_known = stack[0]
    return np.asarray(_truth(value) | ~np.asarray(is_known))


def _certain(word: str, operands: Sequence[tuple[Any, Any]]) -> tuple[Any, Any]:
    values, known = zip(*operands, strict=True)
    certain: Any = np.True_
    for is_known in known:
        certain = certain & is_known
    return _applied(word, values), certain


def _joined(word: str, operands: Sequence[tuple[Any, Any]]) -> tuple[Any, Any]:
    """Apply what may be certain although an operand is not."""
    (left, is_left), (right, is_right), *rest = operands
    value, certain = _certain(word, operands)
    if word == "if_":
        chosen = np.where(_truth(left), is_right, rest[0][1])
        return value, np.asarray(is_left) & chosen
    # One that is false decides a conjunction, one that is true a disjunction.
    decides = word == "or"
    sure = (is_left & (_truth(left) == decides)) | (is_right & (_truth(right) == decides))
    return np.where(sure, decides, value), certain | sure


def _applied(word: str, operands: Sequence[Any]) -> Any:
    if word in COMPARISONS:
        return _compared(word, operands[0], operands[1])
    if word in {"and", "or"}:
        left, right = _truth(operands[0]), _truth(operands[1])
        return left & right if word == "and" else left | right
    if word == "if_":
        return _chosen(operands[0], operands[1], operands[2])
    return _NUMERIC[word](*(_numbers(operand) for operand in operands))


def _column(value: Value) -> Any:
    """Take lists and integers, too; numbers become floats, so that nothing wraps around."""
    if isinstance(value, str):
        return value
    column = np.asarray(value)
    return column.astype(np.float64) if column.dtype.kind in "iu" else column


def _is_text(value: Any) -> bool:
    return isinstance(value, str) or np.asarray(value).dtype.kind in "UTO"


def _numbers(value: Any) -> _Floats:
    column = np.asarray(value)
    if column.dtype.kind not in "biuf":
        msg = f"{column.dtype} is not a number"
        raise TypeError(msg)
    return column.astype(np.float64, copy=False)


def _truth(value: Any) -> NDArray[np.bool_]:
    numbers = _numbers(value)
    return (numbers > 0.0) | (numbers < 0.0)


def _compared(word: str, left: Any, right: Any) -> Any:
    if _is_text(left) != _is_text(right):
        msg = "text is compared with a number"
        raise TypeError(msg)
    if _is_text(left):
        return _COMPARISONS[word](np.asarray(left), np.asarray(right))
    left, right = _numbers(left), _numbers(right)
    if word == "!=":
        # Not `!=`, which holds for NaN.
        return (left < right) | (left > right)
    return _COMPARISONS[word](left, right)


def _chosen(condition: Any, left: Any, right: Any) -> Any:
    known = _numbers(condition)
    if _is_text(left) and _is_text(right) and not np.isnan(known).any():
        return np.where(_truth(known), left, right)
    chosen = np.where(_truth(known), _numbers(left), _numbers(right))
    return np.where(np.isnan(known), np.nan, chosen)


def _smaller(left: _Floats, right: _Floats) -> _Floats:
    return np.where((left <= right) | np.isnan(left), left, right)


def _greater(left: _Floats, right: _Floats) -> _Floats:
    return np.where((left >= right) | np.isnan(left), left, right)


def _by_column(word: str, values: _Floats) -> _Floats:
    # The functions of NumPy differ in their last bit between processors; these do not.
    from adeye.kernel.postfix import FUNCTION_CODES, unary_column

    return unary_column(FUNCTION_CODES[word], values.ravel()).reshape(values.shape)


def _raised(bases: _Floats, exponents: _Floats) -> _Floats:
    from adeye.kernel.postfix import power_column

    left, right = np.broadcast_arrays(bases, exponents)
    return power_column(left.ravel(), right.ravel()).reshape(left.shape)


_COMPARISONS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "==": np.equal,
    "!=": np.not_equal,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}
_NUMERIC: Final[dict[str, Callable[..., Any]]] = {
    **{word: partial(_by_column, word) for word in ("sin", "cos", "exp", "log")},
    "not": lambda values: values == 0.0,
    "**": _raised,
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "negative": np.negative,
    "abs": np.abs,
    "min": _smaller,
    "max": _greater,
    "sqrt": np.sqrt,
    "floor": np.floor,
    "ceil": np.ceil,
    "clip": lambda values, low, high: _smaller(_greater(values, low), high),
}
