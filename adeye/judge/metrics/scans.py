"""Compiled: find in the rows of each run what a metric is about.

A scan goes over the rows of one run after the other, so that nothing of the size of a batch is
made. What it finds is a row and a status, by its code in ``STATUSES``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.judge.metrics.registry import CODES, column_of
from adeye.judge.series import status_of
from adeye.judge.stl.series import SampleStatus
from adeye.kernel.jit import allocating

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from adeye.judge.series import TraceSeries
    from adeye.ports import MetricColumn
    from adeye.signals import Bools, Bytes, Floats, Ints, Shorts


VALUE: Final = CODES["value"]
NO_CONFLICT: Final = CODES["no_conflict"]
NOT_APPLICABLE: Final = CODES["not_applicable"]
UNDEFINED: Final = CODES["undefined"]
INCOMPLETE: Final = CODES["incomplete"]
ERROR: Final = CODES["error"]

_SAMPLE_VALUE: Final = int(SampleStatus.VALUE)
_SAMPLE_FREE: Final = int(SampleStatus.NO_CONFLICT)
_SAMPLE_ERROR: Final = int(SampleStatus.ERROR)


class Found(NamedTuple):
    """The worst of Q quantities in B runs.

    Attributes:
        values: (Q, B).
        rows: (Q, B).
        actors: (Q, B) object, -1 for none.
        codes: (Q, B) index into ``STATUSES``.
    """

    values: Floats
    rows: Ints
    actors: Ints
    codes: Bytes


def found_column(
    series: TraceSeries, name: str, quantities: int, scan: Callable[[Found], None], quantity: int
) -> MetricColumn:
    """Make a column of one of the quantities that one scan finds for several metrics.

    Args:
        series: Series of the trace.
        name: Of the scan, which is made once.
        quantities: How many it finds.
        scan: Writes them.
        quantity: Which one.
    """

    def read() -> Found:
        shape = (quantities, series.trace.runs)
        rows = np.zeros(shape, dtype=np.int64)
        found = Found(np.zeros(shape), rows, rows.copy(), np.zeros(shape, dtype=np.int8))
        scan(found)
        return found

    values, rows, actors, codes = (part[quantity] for part in series.once(name, read))
    # A least time of infinity was found with nobody to blame: there is no conflict.
    codes = np.where((codes == VALUE) & np.isinf(values), np.int8(NO_CONFLICT), codes)
    return column_of(series, codes, rows, values, actors)


CHANGE, DECELERATION, SIZE = range(3)
"""What ``worst_motion`` makes of a number: change since the row before, its negative, its size."""


@allocating
def first_contacts(length: Ints, contact: Shorts) -> Ints:
    """Find the first row (B,) at which the ego touches something, -1 for none."""
    rows = np.full(length.shape[0], -1, dtype=np.int64)
    for run in range(length.shape[0]):
        for row in range(length[run]):
            if contact[run, row] >= 0:
                rows[run] = row
                break
    return rows


@allocating
def worst_conflicts(
    length: Ints,
    values: Floats,
    actors: Shorts,
    contact: Shorts,
    demands: bool,  # noqa: FBT001 - compiled
) -> tuple[Ints, Bytes]:
    """Find the row with the worst value of a conflict, the earliest among equals.

    Args:
        length: (B,) rows that a run has.
        values: (B, T) of one quantity of ``conflict``.
        actors: (B, T) object of each.
        contact: (B, T) object that the ego touches, -1 for none.
        demands: Whether it is a deceleration: the worst is the largest.

    Returns:
        Rows (B,) and statuses (B,): ``no_conflict`` where no row has a value but one is free of
        conflict, ``undefined`` where there is neither, ``error`` where any row is one.
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    codes = np.full(length.shape[0], UNDEFINED, dtype=np.int8)
    for run in range(length.shape[0]):
        least = math.inf
        is_free = False
        for row in range(length[run]):
            value = values[run, row]
            what = status_of(value, actors[run, row], contact[run, row], demands)
            if what == _SAMPLE_VALUE:
                signed = -value if demands else value
                if signed < least:
                    least = signed
                    rows[run] = row
            elif what == _SAMPLE_FREE:
                is_free = True
            elif what == _SAMPLE_ERROR:
                codes[run] = ERROR
                break
        if codes[run] != ERROR:
            if least < math.inf:
                codes[run] = VALUE
            elif is_free:
                codes[run] = NO_CONFLICT
    return rows, codes


@allocating
def worst_violations(length: Ints, margins: Floats) -> tuple[Ints, Ints, Bools]:
    """Count the rows with a margin below 0, and find the worst of them.

    Args:
        length: (B,) rows that a run has.
        margins: (B, T); +inf where there is no conflict.

    Returns:
        Rows (B,), the earliest among equals, numbers of violations (B,) and whether any margin is
        no number (B,).
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    counts = np.zeros(length.shape[0], dtype=np.int64)
    is_error = np.zeros(length.shape[0], dtype=np.bool_)
    for run in range(length.shape[0]):
        least = 0.0
        for row in range(length[run]):
            margin = margins[run, row]
            if not margin > -math.inf:
                is_error[run] = True
            elif margin < 0.0:
                counts[run] += 1
                if margin < least:
                    least = margin
                    rows[run] = row
    return rows, counts, is_error


@allocating
def worst_at_standstill(
    length: Ints, gaps: Floats, speeds: Floats, standstill: float
) -> tuple[Ints, Bytes]:
    """Find the row with the least gap while the ego stands.

    Args:
        length: (B,) rows that a run has.
        gaps: (B, T); +inf where there is none [m].
        speeds: (B, T) of the ego [m/s].
        standstill: Speed up to which it stands [m/s].

    Returns:
        Rows (B,), the earliest among equals, and statuses (B,): ``not_applicable`` where the ego
        never stands.
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    codes = np.full(length.shape[0], NOT_APPLICABLE, dtype=np.int8)
    for run in range(length.shape[0]):
        least = math.inf
        for row in range(length[run]):
            speed = speeds[run, row]
            if not math.isfinite(speed):
                codes[run] = ERROR
                break
            if abs(speed) <= standstill:
                gap = gaps[run, row]
                if not gap > -math.inf:
                    codes[run] = ERROR
                    break
                if codes[run] == NOT_APPLICABLE:
                    codes[run] = NO_CONFLICT
                if gap < least:
                    least = gap
                    rows[run] = row
                    codes[run] = VALUE
    return rows, codes


@allocating
def worst_motion(length: Ints, numbers: Floats, what: int) -> tuple[Ints, Floats, Bytes]:
    """Find the row with the largest of what is made of a number of the ego.

    Args:
        length: (B,) rows that a run has.
        numbers: (B, T).
        what: ``SIZE``, ``CHANGE`` for that of a change, which the first row has not, or
            ``DECELERATION``.

    Returns:
        Rows (B,), the earliest among equals, their values (B,) and statuses (B,).
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    most = np.full(length.shape[0], -math.inf)
    codes = np.full(length.shape[0], UNDEFINED, dtype=np.int8)
    for run in range(length.shape[0]):
        for row in range(length[run]):
            number = numbers[run, row]
            value = abs(number)
            if what == DECELERATION:
                value = -number if number < 0.0 else 0.0
            if not math.isfinite(number):
                codes[run] = ERROR
                break
            if value > most[run] and (what != CHANGE or row):
                most[run] = value
                rows[run] = row
                codes[run] = VALUE
    return rows, most, codes


@allocating
def first_faults(length: Ints, active: Bools) -> Ints:
    """Find the first row (B,) at which one of the faults (B, T, F) is present, -1 for none.

    Of the last row nothing is decided.
    """
    rows = np.full(length.shape[0], -1, dtype=np.int64)
    for run in range(length.shape[0]):
        for row in range(length[run] - 1):
            for fault in range(active.shape[2]):
                if active[run, row, fault] and rows[run] < 0:
                    rows[run] = row
            if rows[run] >= 0:
                break
    return rows


@allocating
def safe_from(
    length: Ints,
    speeds: Floats,
    places: Floats,
    contact: Shorts,
    on_road: Bools,
    standstill: float,
) -> Ints:
    """Find the row (B,) from which the ego is in a safe state to the end.

    Args:
        length: (B,) rows that a run has.
        speeds: (B, T) of the ego [m/s].
        places: (B, T) d of the ego [m].
        contact: (B, T) object that the ego touches, -1 for none.
        on_road: (B, T) whether the ego is on the road.
        standstill: Speed up to which it stands [m/s].

    Returns:
        The row, ``length`` if it is not safe at the end; -1 where a number is not finite.
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    for run in range(length.shape[0]):
        for row in range(length[run]):
            speed, d = speeds[run, row], places[run, row]
            if not (math.isfinite(speed) and math.isfinite(d)):
                rows[run] = -1
                break
            if not (abs(speed) <= standstill and on_road[run, row] and contact[run, row] < 0):
                rows[run] = row + 1
    return rows


@allocating
def first_takeovers(length: Ints, onset: Ints, authority: Bytes, default: int) -> Ints:
    """Find the first row (B,) from the onset of a fault at which another channel takes over.

    Rows in which nobody acts are no takeover: the ego coasts there until one does. Neither is it
    one that authority is given back to the channel that acts without a request.

    Args:
        length: (B,) rows that a run has.
        onset: (B,) first row with a fault, -1 for none.
        authority: (B, T) channel that acts, -1 for none.
        default: Channel that acts without a request.

    Returns:
        Rows, -1 for none.
    """
    rows = np.full(length.shape[0], -1, dtype=np.int64)
    for run in range(length.shape[0]):
        if onset[run] < 0:
            continue
        # Nobody is no channel: who acted last counts, at the start the one that acts unasked.
        before = default
        for row in range(onset[run] - 1, -1, -1):
            if authority[run, row] >= 0:
                before = int(authority[run, row])
                break
        for row in range(onset[run], length[run] - 1):
            if authority[run, row] < 0:
                continue
            if before == default != authority[run, row]:
                rows[run] = row
                break
            before = int(authority[run, row])
    return rows


def as_flags(column: NDArray[Any]) -> Bools:
    """Give a column of a trace as truth values, without a copy if it holds them."""
    return np.asarray(column, dtype=np.bool_)
