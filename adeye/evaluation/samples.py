"""Samples of a series with their status: what a value of a conflict stands for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.evaluation.conflict import DRAC, REQUIRED
from adeye.evaluation.stl.series import SampleStatus
from adeye.kernel.jit import compiled, inlined

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Floats, Ints

    Shorts = NDArray[np.int16]

__all__ = [
    "Samples",
    "Statuses",
    "fill_statuses",
    "is_demand",
    "mark_errors",
    "mark_undecided",
    "status_of",
]

Statuses = np.ndarray[tuple[int, ...], np.dtype[np.int8]]

_VALUE: Final = int(SampleStatus.VALUE)
_FREE: Final = int(SampleStatus.NO_CONFLICT)
_NOT_APPLICABLE: Final = int(SampleStatus.NOT_APPLICABLE)
_ERROR: Final = int(SampleStatus.ERROR)


@dataclass(frozen=True, slots=True)
class Samples:
    """A series of B runs with what is known about each sample.

    Attributes:
        values: (B, T) [unit of the series]; arbitrary where the status is not VALUE.
        status: (B, T) ``SampleStatus``.
        actor: (B, T) object of the worst case, -1 for none.
    """

    values: Floats
    status: Statuses
    actor: NDArray[np.integer[Any]]


def is_demand(column: int) -> bool:
    """Tell whether a quantity of ``conflict`` is a deceleration, worse when larger."""
    return column in {DRAC, REQUIRED}


@inlined
def status_of(value: float, actor: int, touched: int, demands: bool) -> int:  # noqa: FBT001
    """Tell what a value of a conflict stands for.

    Args:
        value: +inf for no conflict; of a deceleration: for one that nothing can reach.
        actor: Object of the worst case, -1 for none.
        touched: Object that the ego touches, -1 for none.
        demands: Whether it is a deceleration.
    """
    status = _VALUE
    if not math.isfinite(value):
        status = _ERROR
        if value == math.inf and not demands:
            status = _FREE
        elif value == math.inf and touched >= 0:
            # No deceleration undoes a contact.
            status = _NOT_APPLICABLE
        elif value == math.inf and actor < 0:
            status = _FREE
    elif demands and actor < 0:
        status = _FREE
    return status


@compiled
def fill_statuses(
    length: Ints,
    values: Floats,
    actors: Shorts,
    contact: Shorts,
    demands: bool,  # noqa: FBT001 - compiled
    status: Statuses,
) -> None:
    """Tell what each value (B, T) of a conflict stands for, within its run."""
    for run in range(values.shape[0]):
        for row in range(length[run]):
            status[run, row] = status_of(
                values[run, row], actors[run, row], contact[run, row], demands
            )
        for row in range(length[run], values.shape[1]):
            status[run, row] = _FREE if demands else _VALUE


@compiled
def mark_errors(numbers: Floats, status: Statuses) -> None:
    """Make an error of each sample (B, T) whose number is not finite."""
    for run in range(numbers.shape[0]):
        for row in range(numbers.shape[1]):
            if not math.isfinite(numbers[run, row]):
                status[run, row] = _ERROR


@compiled
def mark_undecided(length: Ints, status: Statuses) -> None:
    """Say that a sample (B, T) does not apply from the last row of its run on."""
    for run in range(length.shape[0]):
        for row in range(length[run] - 1, status.shape[1]):
            status[run, row] = _NOT_APPLICABLE
