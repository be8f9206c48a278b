"""What a formula reads: the samples of one signal for B runs, with their status."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats

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
    """

    values: NDArray[Any]
    scale: float
    unit: str
    kind: Kind
    labels: tuple[str, ...] = ()
    status: NDArray[np.int8] | None = None
    cap: float | None = None
    actor: NDArray[np.integer[Any]] | None = None

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

    def run(self, b: int) -> Series:
        """Give the series of run b alone, arrays (1, T)."""
        one = slice(b, b + 1)
        return Series(
            self.values[one],
            self.scale,
            self.unit,
            self.kind,
            self.labels,
            None if self.status is None else self.status[one],
            self.cap,
            None if self.actor is None else self.actor[one],
        )


class SignalSource(Protocol):
    """Where the signals of a batch come from, for example a trace with its metrics."""

    def series(self, name: str) -> Series:
        """Give the series of a signal.

        Raises:
            KeyError: The source has no such signal.
        """


@dataclass(frozen=True, slots=True)
class Samples:
    """A series sorted by status.

    Attributes:
        values: (B, T) float64; +inf for "no conflict", 0 where unknown or an error.
        is_unknown: (B, T) whether the sample is not applicable.
        is_error: (B, T) whether the sample makes its run an ERROR.
    """

    values: Floats
    is_unknown: Bools
    is_error: Bools


def read_samples(series: Series) -> Samples:
    """Sort the samples of a series into values, "no conflict", unknown and errors.

    Everything that is neither finite nor declared is an error: NaN, an infinity without a cap, a
    truth value that is not 0 or 1, a code without a label, a status out of range.
    """
    values = np.array(series.values, dtype=np.float64)
    status = series.status
    if status is None:
        free = np.isposinf(values) if series.cap is not None else np.zeros(values.shape, bool)
        is_unknown = np.zeros(values.shape, dtype=bool)
        is_error = ~np.isfinite(values) & ~free
    else:
        free = status == SampleStatus.NO_CONFLICT
        is_unknown = status == SampleStatus.NOT_APPLICABLE
        is_value = status == SampleStatus.VALUE
        is_error = ~(is_value & np.isfinite(values)) & ~free & ~is_unknown
    if series.cap is None or series.kind != "number":
        is_error |= free
    if series.kind == "boolean":
        is_error |= (values != 0.0) & (values != 1.0) & ~is_unknown
    elif series.kind == "enumeration":
        is_code = (values >= 0.0) & (values < len(series.labels)) & (values == np.floor(values))
        is_error |= ~is_code & ~is_unknown
    values[free] = np.inf
    values[is_unknown | is_error] = 0.0
    return Samples(values, is_unknown, is_error)
