"""What a formula reads: the samples of one signal for B runs, with their status."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Literal, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


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


class SignalSource(Protocol):
    """Where the signals of a batch come from, for example a trace with its metrics."""

    def series(self, name: str) -> Series:
        """Give the series of a signal.

        Raises:
            KeyError: The source has no such signal.
        """
