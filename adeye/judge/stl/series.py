"""What a formula reads: the samples of one signal for B runs, with their status.

A term carries its scale and its caps through sums (the largest) and products (the product), so
that a predicate of several signals is measured in their common unit. A constant factor is no scale;
what all signals of a predicate are multiplied by is divided out, so that both sides of it may be
multiplied by a constant. "No conflict" (+inf) passes
through arithmetic; where it makes a comparison infinite, the cap is the margin.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Literal, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from adeye.judge.stl import syntax
from adeye.signals import SignalType

# --- What a formula reads: the samples of one signal for B runs, with their status ----------------

Kind = Literal["number", "boolean", "enumeration"]


class SampleStatus(IntEnum):
    """What one sample of a series is.

    NOT_APPLICABLE has no value and is unknown: it decides nothing, so a formula that depends on it
    is never satisfied and never violated. ERROR makes the run's verdict ERROR.
    """

    VALUE = 0
    NO_CONFLICT = 1
    NOT_APPLICABLE = 2
    ERROR = 3


class SignalEntry(Protocol):
    """What the signal dictionary says about a name."""

    @property
    def unit(self) -> str:
        """SI unit; ``1`` or empty for none."""

    @property
    def scale(self) -> float:
        """Size of one unit of robustness in the signal's own unit."""

    @property
    def kind(self) -> str:
        """``number``, ``boolean`` or ``enumeration``."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Words of an enumeration, by code."""

    @property
    def slack(self) -> float:
        """Differences up to it are none: of times; else 0."""


@dataclass(frozen=True, slots=True)
class Series:
    """The samples of one signal.

    Attributes:
        values: (B, T): numbers in SI, truth values, or codes into ``labels``.
        scale: Size of one unit of robustness [unit], > 0.
        unit: SI unit; ``1`` or empty for none.
        kind: ``number``, ``boolean`` or ``enumeration``.
        labels: Words of an enumeration, by code.
        status: (B, T) ``SampleStatus``; None: every sample is a value, and +inf is "no conflict"
            where a ``cap`` is declared.
        cap: Margin that "no conflict" counts with [unit], > 0; None: the signal declares none.
        actor: (B, T) index of the actor that each sample is about, -1 for none.
        slack: Differences up to it are none [unit]: of times, which are rounded; else 0.
        is_scaled: Whether robustness is divided by scales at all; not where nobody declared one.
    """

    values: NDArray[Any]
    scale: float
    unit: str
    kind: Kind
    labels: tuple[str, ...] = ()
    status: NDArray[np.int8] | None = None
    cap: float | None = None
    actor: NDArray[np.integer[Any]] | None = None
    slack: float = 0.0
    is_scaled: bool = True

    def __post_init__(self) -> None:
        for name, size in (("scale", self.scale), ("cap", self.cap)):
            if size is not None and not (math.isfinite(size) and size > 0.0):
                msg = f"{name} of a series is {size}; it must be finite and above 0"
                raise ValueError(msg)
        if self.values.ndim != 2:
            msg = f"values of a series have shape {self.values.shape}, not (B, T)"
            raise ValueError(msg)
        for part in (self.status, self.actor):
            if part is not None and part.shape != self.values.shape:
                msg = f"shape {part.shape} differs from the values' {self.values.shape}"
                raise ValueError(msg)


def declared_series(
    declared: SignalType,
    values: NDArray[Any],
    status: NDArray[np.int8],
    actor: NDArray[np.integer[Any]] | None = None,
) -> Series:
    """Make a series of samples (B, T) of what is declared of their signal."""
    return Series(
        values,
        declared.scale,
        declared.unit,
        cast("Kind", declared.kind),
        declared.labels,
        status=status,
        cap=declared.cap,
        actor=actor,
        slack=declared.slack,
    )


class SignalSource(Protocol):
    """Where the signals of a batch come from, for example a trace with its metrics."""

    def series(self, name: str) -> Series:
        """Give the series of a signal.

        Raises:
            KeyError: The source has no such signal.
        """


# --- Scale, cap and unit of terms and predicates: what is known of them before any sample ---------

Caps = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class Scale:
    """What is known of a term beforehand.

    Attributes:
        size: Size of one unit of robustness; 1 of a constant.
        value: Of a constant; None of what reads a signal.
        caps: Margin that counts for +inf and for -inf; None where the term cannot become that.
        factor: Least constant that a signal of it is multiplied by.
    """

    size: float
    value: float | None = None
    caps: Caps = (None, None)
    factor: float = 1.0

    @property
    def opposite(self) -> Scale:
        """Of the negated term."""
        value = None if self.value is None else -self.value
        return Scale(self.size, value, (self.caps[1], self.caps[0]), self.factor)

    @property
    def magnitude(self) -> Scale:
        """Of the absolute value of the term."""
        value = None if self.value is None else abs(self.value)
        return Scale(self.size, value, (_largest(*self.caps), None), self.factor)

    @property
    def divisor(self) -> float:
        """What robustness is divided by."""
        found = self.size * self.factor
        return found if found > 0.0 else 1.0


def combined(operator: str, left: Scale, right: Scale) -> Scale:
    """Give the scale of two terms combined by ``+``, ``-``, ``min``, ``max``, ``*`` or ``/``.

    In a sum a constant has no say in the scale.
    """
    if operator == "-":
        return combined("+", left, right.opposite)
    value = _constant(operator, left.value, right.value)
    if operator in {"*", "/"}:
        return _product(operator, left, right, value)
    signals = [part for part in (left, right) if part.value is None]
    size = max((part.size for part in signals), default=1.0)
    factor = min((part.factor for part in signals), default=1.0)
    caps = (_largest(left.caps[0], right.caps[0]), _largest(left.caps[1], right.caps[1]))
    return Scale(size, value, caps, factor)


def _product(operator: str, left: Scale, right: Scale, value: float | None) -> Scale:
    before, by = (
        (part.size, part.factor) if part.value is None else (1.0, abs(part.value))
        for part in (left, right)
    )
    if operator == "/":
        by = (1.0 / by[0], 1.0 / by[1] if by[1] > 0.0 else 0.0)
    sizes = [cap * (by[0] * by[1]) for cap in left.caps if cap is not None]
    if operator == "*":
        sizes += [cap * (before[0] * before[1]) for cap in right.caps if cap is not None]
    # The sign of a product is not known in advance: it may become +inf and -inf.
    cap = max((cap for cap in sizes if cap > 0.0), default=None)
    return Scale(before[0] * by[0], value, (cap, cap), before[1] * by[1])


def _largest(first: float | None, second: float | None) -> float | None:
    return max((cap for cap in (first, second) if cap is not None), default=None)


def _constant(operator: str, left: float | None, right: float | None) -> float | None:
    if left is None or right is None:
        return None
    first, second = np.float64(left), np.float64(right)
    with np.errstate(all="ignore"):
        if operator == "+":
            return float(first + second)
        if operator in {"min", "max"}:
            return float(min(first, second) if operator == "min" else max(first, second))
        if operator == "*":
            return float(first * second)
        return float(first / second) if second != 0.0 else float("nan")


def label_code(series: Series, label: str) -> int:
    """Give the code of a label of a signal."""
    words = ("false", "true") if series.kind == "boolean" else series.labels
    return words.index(label)


def unit_of(node: syntax.Predicate, inputs: Mapping[str, Series]) -> str:
    """Give the unit in which both sides are compared; of a product of signals, it is SI."""
    if isinstance(node, syntax.Comparison | syntax.Equality):
        for side in (node.left, node.right):
            unit = _term_unit(side, inputs)
            if unit is not None:
                return unit
        return "SI"
    return inputs[node.name].unit


def _term_unit(term: syntax.Term, inputs: Mapping[str, Series]) -> str | None:
    """Give the unit of a term that its operations leave as it is; None where they do not."""
    if isinstance(term, syntax.Signal):
        return inputs[term.name].unit if term.name in inputs else None
    if isinstance(term, syntax.Arithmetic):
        operands = list(term.operands)
        if term.operator in {"*", "/"}:
            # A plain number leaves the unit as it is, unless it is what is divided.
            of = operands[:1] if term.operator == "/" else operands
            if sum(not _is_plain(operand) for operand in operands) > 1 or all(map(_is_plain, of)):
                return None
        for operand in operands:
            unit = _term_unit(operand, inputs)
            if unit is not None:
                return unit
    return None


def _is_plain(term: syntax.Term) -> bool:
    """Tell whether a term is made of numbers without unit only."""
    if isinstance(term, syntax.Constant):
        return not any(term.exponents)
    return isinstance(term, syntax.Arithmetic) and all(map(_is_plain, term.operands))
