"""The one safe expression language: formulas over parameters, relations, triggers.

Numbers with units, names with dots, text, arithmetic, comparison, ``and or not in``, a fixed list
of functions; evaluated over whole columns, or compiled to a postfix program for one run's
variables. Python's ``eval`` is never involved.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.errors import ExpressionError, SourceLocation, suggest
from adeye.kernel.postfix import (
    FUNCTION_CODES,
    MAX_STACK,
    OPERATOR_CODES,
    PUSH_NUMBER,
    PUSH_VARIABLE,
)
from adeye.spec.columns import Value, told
from adeye.spec.dimensions import measured
from adeye.spec.grammar import COMPARISONS, MAX_DEPTH, MAX_LENGTH, POPS, Step, read_steps
from adeye.units import Dimension, shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

__all__ = ["MAX_DEPTH", "MAX_LENGTH", "Expression", "Program", "Value", "parse", "to_program"]

_TRUTHS = frozenset({*COMPARISONS, "found", "and", "or", "not"})
_CODES = {**OPERATOR_CODES, **FUNCTION_CODES, "number": PUSH_NUMBER, "name": PUSH_VARIABLE}


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
        where: Its place, for messages.
    """

    text: str
    steps: tuple[Step, ...] = field(compare=False, repr=False)
    where: SourceLocation | None = field(default=None, compare=False, repr=False)

    @property
    def names(self) -> frozenset[str]:
        """Every name that it uses."""
        return frozenset(step.text for step in self.steps if step.word == "name")

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
        try:
            return measured(self.steps, dims, self.text)
        except ExpressionError as error:
            raise _placed(error, self.where) from error

    def _require(self, known: Iterable[str]) -> None:
        names = sorted(known)
        for name in sorted(self.names.difference(names)):
            raise self._error(
                f"uses {shown(name)}, which does not exist here", suggest(name, names)
            )

    def _error(self, what: str, remedy: str = "") -> ExpressionError:
        return ExpressionError(f"{shown(self.text)} {what}", where=self.where, remedy=remedy)


@lru_cache(maxsize=4096)
def _read(text: str) -> tuple[Step, ...]:
    return read_steps(text)


def _placed(error: ExpressionError, where: SourceLocation | None) -> ExpressionError:
    return ExpressionError(error.message, where=where, remedy=error.remedy)


def parse(text: str, where: SourceLocation | None = None) -> Expression:
    """Read an expression.

    Args:
        text: At most 2,000 characters.
        where: Its place, for messages.

    Raises:
        ExpressionError: It does not follow the grammar; the message has the position.

    >>> parse("2 * gap + 10 m").evaluate({"gap": 5.0})
    20.0
    """
    try:
        return Expression(text, _read(text), where)
    except ExpressionError as error:
        raise _placed(error, where) from error


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
    if highest > MAX_STACK:
        raise expression._error(
            f"holds {highest} values at once, at most {MAX_STACK} can be", "Nest it less."
        )
    return Program(ops, args, highest)
