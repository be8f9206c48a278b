"""The one safe expression language: formulas over parameters, relations, triggers.

Numbers with units, names with dots, text, arithmetic, comparison, ``and or not in``, a fixed list
of functions; evaluated over whole columns, or compiled to a postfix program for one run's
variables. Python's ``eval`` is never involved.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.errors import ExpressionError, suggest
from adeye.kernel import postfix
from adeye.kernel.relation import differences, settled_numbers
from adeye.spec.grammar import COMPARISONS, PLAIN, POPS, Exponents, Step, read_steps
from adeye.units import Dimension, shown

# --- Expressions over whole columns of numbers, truth values or text ------------------------------

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
        apart = differences(_numbers(values[0]), _numbers(values[1]), size)
        # `!=` alone holds for NaN.
        return _COMPARED[word](apart, 0.0) & ~np.isnan(apart)
    if word in {"and", "or"}:
        left, right = _truth(values[0]), _truth(values[1])
        return left & right if word == "and" else left | right
    if word == "if_":
        return _chosen(values[0], values[1], values[2])
    return _NUMERIC[word](*(_numbers(value) for value in values))


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
        raise TypeError(f"{column.dtype} is not a number")
    return column.astype(np.float64, copy=False)


def _truth(value: Any) -> NDArray[np.bool_]:
    numbers = _numbers(value)
    return (numbers > 0.0) | (numbers < 0.0)


def _compared_texts(word: str, left: Any, right: Any) -> Any:
    if _is_text(left) != _is_text(right):
        raise TypeError("text is compared with a number")
    return _COMPARED[word](np.asarray(left), np.asarray(right))


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
    return postfix.unary_column(postfix.FUNCTION_CODES[word], values.ravel()).reshape(values.shape)


def _raised(bases: _Floats, exponents: _Floats) -> _Floats:
    left, right = np.broadcast_arrays(bases, exponents)
    return postfix.power_column(left.ravel(), right.ravel()).reshape(left.shape)


_JUMPS: Final = {"/": 1, "**": 0, "sqrt": 0, "log": 0, "floor": 0, "ceil": 0}
"""Which operand these jump or end at, at 0 or at whole numbers."""
_COMPARED: Final[dict[str, Callable[[Any, Any], Any]]] = {
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


# --- What an expression measures, from the dimensions of the names that it uses -------------------

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
            stack.append(_operand_dimension(step, dims))
            continue
        if step.word == "member":
            # The value stays below what was found so far.
            _same((stack[-3], stack.pop()), text)
            continue
        operands = stack[-POPS[step.word] :]
        del stack[-POPS[step.word] :]
        stack.append(_applied_dimension(step.word, operands, text))
    return _dimension(stack[0].exponents, text)


def _operand_dimension(step: Step, dims: Mapping[str, Dimension | None]) -> _Measured:
    if step.word == "number":
        return _Measured(step.exponents, step.number)
    dimension = dims.get(step.text) if step.word == "name" else None
    return _Measured(dimension.exponents if dimension is not None else None)


def _applied_dimension(word: str, operands: Sequence[_Measured], text: str) -> _Measured:
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


# --- The one safe expression language: formulas over parameters, relations, triggers --------------

_TRUTHS = frozenset({*COMPARISONS, "found", "and", "or", "not"})
_CODES = {
    **postfix.OPERATOR_CODES,
    **postfix.FUNCTION_CODES,
    "number": postfix.PUSH_NUMBER,
    "name": postfix.PUSH_VARIABLE,
}


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """A postfix program over one run's variables, see ``adeye.kernel.postfix``.

    Attributes:
        ops: (L,) operation codes.
        args: (L,) their arguments.
        stack: Most values that it holds at once.
    """

    ops: NDArray[np.int64]
    args: NDArray[np.float64]
    stack: int


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression; equal text is an equal expression.

    Attributes:
        text: As written.
        steps: What it computes, in postfix order.
    """

    text: str
    steps: tuple[Step, ...] = field(compare=False, repr=False)

    @property
    def names(self) -> frozenset[str]:
        """Every name that it uses."""
        return frozenset(step.text for step in self.steps if step.word == "name")

    def parts_of(self, known: Collection[str]) -> list[Expression]:
        """List the largest parts of it that use names out of some only; itself, if it does.

        >>> [item.text for item in parse("gap + 0 m * delay <= 3 m").parts_of({"delay"})]
        ['part of gap + 0 m * delay <= 3 m', 'part of gap + 0 m * delay <= 3 m']
        """
        if self.names <= set(known):
            return [self]
        text = f"part of {self.text}"
        if any(item.word == "member" for item in self.steps):
            # A step of it looks at the value below its operands: names are the parts.
            own = (item for item in self.steps if item.word == "name" and item.text in known)
            return [Expression(text, (item,)) for item in own]
        found: list[Expression] = []
        # Where each operand begins, and whether it uses no other name.
        stack: list[tuple[int, bool]] = []
        for at, step in enumerate(self.steps):
            count = POPS[step.word]
            operands = stack[len(stack) - count :]
            del stack[len(stack) - count :]
            is_own = all(item for _, item in operands)
            is_own &= step.word != "name" or step.text in known
            if operands and not is_own:
                ends = [*(begin for begin, _ in operands[1:]), at]
                found += [
                    Expression(text, self.steps[begin:end])
                    for (begin, whole), end in zip(operands, ends, strict=True)
                    if whole
                ]
            stack.append((operands[0][0] if operands else at, is_own))
        return found

    @property
    def is_constant(self) -> bool:
        """Whether it uses no name."""
        return not self.names

    @property
    def is_truth(self) -> bool:
        """Whether it is true or false: comparisons, memberships, ``x.begun``, their joints."""
        last = self.steps[-1]
        if self.text.strip() in {"true", "false"}:
            return True
        is_event = last.word == "name" and last.text.endswith((".begun", ".ended"))
        return last.word in _TRUTHS or is_event

    def evaluate(self, columns: Mapping[str, Value]) -> Any:
        """Evaluate over whole columns.

        Args:
            columns: Scalars, text or (N,) columns by name.

        Returns:
            A bool, float or str where all columns that it uses are scalar, else an (N,) array.

        Raises:
            ExpressionError: A name is unknown, text meets a number, a result is not finite, or a
                truth hangs on a number that is not.
        """
        first = self.steps[0]
        if len(self.steps) == 1 and first.word == "number" and np.isfinite(first.number):
            return first.number
        self._require(columns)
        try:
            result, defined = told(self.steps, columns)
        except TypeError as error:
            raise self._error("mixes text and numbers") from error
        except ValueError as error:
            raise self._error("joins columns of different length") from error
        values = np.asarray(result)
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise self._error("is not finite for some values")
        if self.is_truth and not np.all(defined):
            raise self._error(
                f"divides by zero or is not finite{self._place(columns, defined)}",
                "Guard it, as in 'b == 0 or a / b < 2'.",
            )
        return result

    def fulfilled(self, columns: Mapping[str, Value]) -> Any:
        """Tell where a condition is defined and holds; as ``evaluate`` for a condition."""
        result, defined = told(self.steps, columns)
        return np.asarray(result, dtype=bool) & np.asarray(defined)

    def _place(self, columns: Mapping[str, Value], defined: Any) -> str:
        """Name the first point at which the expression is not defined."""
        at = int(np.argmin(np.atleast_1d(defined)))
        words = []
        for name in sorted(self.names):
            column = np.asarray(columns[name])
            value = column.item() if column.ndim == 0 else column[at].item()
            words.append(f"{name} = {value if isinstance(value, str) else format(value, 'g')}")
        return f" where {' and '.join(words)} in SI" if words else ""

    def dimension(self, dims: Mapping[str, Dimension | None]) -> Dimension | None:
        """Infer what it measures; None if that is open (a bare 0, or names of open dimension).

        Args:
            dims: Dimension of each name; None, or no entry, for one that fits anything.

        Raises:
            ExpressionError: Lengths are added to speeds, or the like.
        """
        return measured(self.steps, dims, self.text)

    def _require(self, known: Iterable[str]) -> None:
        names = sorted(known)
        for name in sorted(self.names.difference(names)):
            raise self._error(
                f"uses {shown(name)}, which does not exist here", suggest(name, names)
            )

    def _error(self, what: str, remedy: str = "") -> ExpressionError:
        return ExpressionError(f"{shown(self.text)} {what}", remedy=remedy)


@lru_cache(maxsize=4096)
def _read(text: str) -> tuple[Step, ...]:
    return read_steps(text)


def parse(text: str) -> Expression:
    """Read an expression.

    Args:
        text: At most 2,000 characters.

    Raises:
        ExpressionError: It does not follow the grammar; the message has the position.

    >>> parse("2 * gap + 10 m").evaluate({"gap": 5.0})
    20.0
    """
    return Expression(text, _read(text))


def to_program(expression: Expression, index: Mapping[str, int]) -> Program:
    """Compile an expression to a postfix program for ``adeye.kernel.postfix.run_program``.

    Args:
        expression: Numeric or truth-valued; truth is 1.0 and 0.0.
        index: Position of each name in the variable vector.

    Raises:
        ExpressionError: A name is not in the index, text is used, or too much is nested.
    """
    expression._require(index)
    ops = np.empty(len(expression.steps), dtype=np.int64)
    args = np.zeros(len(expression.steps))
    height = highest = 0
    for at, step in enumerate(expression.steps):
        if step.word == "text":
            raise expression._error("uses text, which is not known during a run")
        ops[at] = _CODES[step.word]
        args[at] = float(index[step.text]) if step.word == "name" else step.number
        height += 1 - POPS[step.word]
        highest = max(highest, height)
    if highest > postfix.MAX_STACK:
        raise expression._error(
            f"holds {highest} values at once, at most {postfix.MAX_STACK} can be", "Nest it less."
        )
    return Program(ops, args, highest)
