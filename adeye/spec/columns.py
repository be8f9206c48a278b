"""Expressions over whole columns of numbers, truth values or text."""

from __future__ import annotations

from dataclasses import dataclass, replace
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


@dataclass(frozen=True, slots=True)
class _Operand:
    """A column on the stack.

    Attributes:
        value: Numbers, truth values or text.
        size: Size of what numbers were made of, see ``adeye.kernel.relation``.
        defined: Where it is known although a number may not be finite: of truth values, where they
            do not hang on one that is not.
        known: Where it is certain, of which ``may_hold`` makes use.
    """

    value: Any
    size: Any
    defined: Any = True
    known: Any = True


def evaluated(steps: Sequence[Step], columns: Mapping[str, Value]) -> Any:
    """Evaluate the steps of an expression, as ``told``, and leave out where it is defined."""
    return told(steps, columns)[0]


def told(steps: Sequence[Step], columns: Mapping[str, Value]) -> tuple[Any, Any]:
    """Evaluate the steps of an expression; NaN counts as in ``adeye.kernel.postfix``.

    Args:
        steps: The expression.
        columns: Scalars, text or (N,) columns of all its names.

    Returns:
        A bool, float or str where everything is scalar, else an (N,) array; and where it is
        defined: a truth is not if it hangs on the comparison of a number that is not finite.

    Raises:
        TypeError: Text stands where a number must, or the other way round.
        ValueError: Columns differ in length.
    """
    found = _run(steps, lambda name: _operand(_column(columns[name])))
    result = np.asarray(found.value)
    return (result if result.ndim else result.item()), found.defined


def may_hold(steps: Sequence[Step], columns: Mapping[str, Value]) -> NDArray[np.bool_]:
    """Tell where a condition can hold, whatever the names are of which nothing is known.

    Args:
        steps: The condition, without text.
        columns: Scalars or arrays, broadcast together, of the names that are known.
    """
    # What is not certain has any value.
    found = _run(
        steps, lambda name: replace(_operand(columns.get(name, 0.0)), known=name in columns)
    )
    return np.asarray(_truth(found.value) | ~np.asarray(found.known))


def _run(steps: Sequence[Step], named: Callable[[str], _Operand]) -> _Operand:
    stack: list[_Operand] = []
    with np.errstate(all="ignore"):
        for step in steps:
            count = POPS[step.word]
            if step.word == "number":
                stack.append(_operand(step.number))
            elif step.word == "text":
                stack.append(_Operand(step.text, 0.0))
            elif step.word == "name":
                stack.append(named(step.text))
            elif step.word == "member":
                item, found = stack.pop(), stack.pop()
                stack.append(_joined("or", [found, _certain("==", [stack[-1], item])]))
            elif step.word == "found":
                stack[-2:] = [stack[-1]]
            else:
                operands = stack[-count:]
                del stack[-count:]
                join = _joined if step.word in {"and", "or", "if_"} else _certain
                stack.append(join(step.word, operands))
    return stack[0]


def _operand(value: Any) -> _Operand:
    return _Operand(value, 0.0 if _is_text(value) else np.abs(_numbers(value)))


def _certain(word: str, operands: Sequence[_Operand]) -> _Operand:
    if word in _JUMPS:
        at = _JUMPS[word]
        operands = [*operands[:at], _settled(word, operands[at]), *operands[at + 1 :]]
    value = _applied(word, operands)
    known, defined = operands[0].known, operands[0].defined
    for item in operands[1:]:
        known, defined = known & np.asarray(item.known), defined & np.asarray(item.defined)
    if word in COMPARISONS and not _is_text(operands[0].value):
        for item in operands:
            defined = defined & np.isfinite(_numbers(item.value)) & np.isfinite(item.size)
    return _Operand(value, _size(word, value, operands), defined, known)


def _joined(word: str, operands: Sequence[_Operand]) -> _Operand:
    """Apply what may be certain, or defined, although an operand is not."""
    found = _certain(word, operands)
    left, right = operands[:2]
    if word == "if_":
        is_first, other = _truth(left.value), operands[2]
        known = np.asarray(left.known) & np.where(is_first, right.known, other.known)
        defined = np.asarray(left.defined) & np.where(is_first, right.defined, other.defined)
        return replace(found, known=known, defined=defined)
    # One that is false decides a conjunction, one that is true a disjunction.
    decides = word == "or"
    ends = [(_truth(item.value) == decides, item) for item in (left, right)]
    sure, clear = (
        (ends[0][0] & getattr(left, what)) | (ends[1][0] & getattr(right, what))
        for what in ("known", "defined")
    )
    value = np.where(sure, decides, found.value)
    return replace(found, value=value, known=found.known | sure, defined=found.defined | clear)


def _settled(word: str, operand: _Operand) -> _Operand:
    """Put an operand on what only the slack parts it from."""
    from adeye.kernel.relation import settled_numbers

    values = settled_numbers(
        _numbers(operand.value), operand.size, is_whole=word in {"floor", "ceil"}
    )
    return replace(operand, value=values)


def _size(word: str, value: Any, operands: Sequence[_Operand]) -> Any:  # noqa: C901, PLR0911 - by operation
    """Give the size of what a result is made of, as ``adeye.kernel.postfix`` does."""
    if _is_text(value):
        return 0.0
    sizes = [item.size for item in operands]
    if word in {"+", "-"}:
        return sizes[0] + sizes[1]
    if word in {"negative", "abs"}:
        return sizes[0]
    if word == "*":
        return sizes[0] * sizes[1]
    if word == "/":
        divisor = np.abs(_numbers(operands[1].value))
        return np.where(divisor == 0.0, np.abs(value), sizes[0] / divisor * (sizes[1] / divisor))
    if word == "**":
        base, exponent = np.abs(_numbers(operands[0].value)), _numbers(operands[1].value)
        inverse = np.abs(value) * _raised(sizes[0] / np.where(base == 0.0, 1.0, base), -exponent)
        inverse = np.where(base == 0.0, np.abs(value), inverse)
        return np.where(exponent > 0.0, _raised(np.asarray(sizes[0]), exponent), inverse)
    if word in {"sin", "cos"}:
        return np.abs(value) + sizes[0]
    if word in {"sqrt", "log"}:
        inner = _numbers(value if word == "sqrt" else operands[0].value)
        return np.abs(value) + np.where(inner > 0.0, sizes[0] / inner, 0.0)
    if word in {"min", "max"}:
        chosen = np.where(value == _numbers(operands[0].value), *sizes)
        return np.where(np.isfinite(sizes[0]) & np.isfinite(sizes[1]), chosen, np.inf)
    if word == "if_":
        return np.where(_truth(operands[0].value), sizes[1], sizes[2])
    if word == "clip":
        rest = np.where(value == _numbers(operands[1].value), sizes[1], sizes[2])
        return np.where(value == _numbers(operands[0].value), sizes[0], rest)
    return np.abs(_numbers(value))


def _applied(word: str, operands: Sequence[_Operand]) -> Any:
    values = [item.value for item in operands]
    if word in COMPARISONS:
        if _is_text(values[0]) or _is_text(values[1]):
            return _compared_texts(word, values[0], values[1])
        size = np.maximum(operands[0].size, operands[1].size)
        return _COMPARISONS[word](_differences(values[0], values[1], size))
    if word in {"and", "or"}:
        left, right = _truth(values[0]), _truth(values[1])
        return left & right if word == "and" else left | right
    if word == "if_":
        return _chosen(values[0], values[1], values[2])
    return _NUMERIC[word](*(_numbers(value) for value in values))


def _differences(left: Any, right: Any, size: Any) -> _Floats:
    from adeye.kernel.relation import differences

    return differences(_numbers(left), _numbers(right), size)


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


def _compared_texts(word: str, left: Any, right: Any) -> Any:
    if _is_text(left) != _is_text(right):
        msg = "text is compared with a number"
        raise TypeError(msg)
    return _TEXTS[word](np.asarray(left), np.asarray(right))


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


_JUMPS: Final = {"/": 1, "**": 0, "sqrt": 0, "log": 0, "floor": 0, "ceil": 0}
"""Which operand these jump or end at, at 0 or at whole numbers."""
_TEXTS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "==": np.equal,
    "!=": np.not_equal,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}
_COMPARISONS: Final[dict[str, Callable[[_Floats], Any]]] = {
    "==": lambda apart: apart == 0.0,
    # Not `!=`, which holds for NaN.
    "!=": lambda apart: (apart < 0.0) | (apart > 0.0),
    "<": lambda apart: apart < 0.0,
    "<=": lambda apart: apart <= 0.0,
    ">": lambda apart: apart > 0.0,
    ">=": lambda apart: apart >= 0.0,
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
