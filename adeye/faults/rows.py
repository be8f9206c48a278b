"""Rows of what flows between the stages: copies, and the rows of one tick in those of another."""

from __future__ import annotations

from collections import deque
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast

import numpy as np

from adeye.signals import NO_CHANNEL, REASON_NONE, SILENT, Authority, ControlCommand, Measurement

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats, Ints

Rows = TypeVar("Rows", Measurement, ControlCommand, Authority, "Floats")


def copied(thing: Rows) -> Rows:
    """Copy the arrays of a thing, so that a later change leaves this one as it was."""
    return cast("Rows", _copied(thing))


def _copied(thing: Any) -> Any:
    if isinstance(thing, Authority):
        return Authority(thing.channel.copy(), thing.reason.copy())
    return thing.copy()


def take_rows(target: Rows, source: Rows, runs: Bools) -> None:
    """Overwrite some rows of a thing with those of another of its kind.

    What the source does not have is empty in the target then: NaN, false, -1.

    Args:
        target: In and out.
        source: Where the rows come from.
        runs: (B,) which.
    """
    if isinstance(target, np.ndarray):
        target[runs] = cast("Any", source)[runs]
        return
    for field in fields(target):
        rows = getattr(target, field.name)
        if not isinstance(rows, np.ndarray):
            continue
        other = getattr(source, field.name)
        rows[runs] = _empty(rows) if other is None else other[runs]


def _empty(rows: NDArray[Any]) -> Any:
    if rows.dtype.kind == "f":
        return np.nan
    return rows.dtype.kind != "b" and -1


_NOTHING: Final[Mapping[str, float]] = {
    "stamp": -1.0,
    "fresh": False,
    "mask": False,
    "source": -1,
    "hits": -1,
    "values": np.nan,
    "status": SILENT,
    "plan": np.nan,
    "tracks": np.nan,
    "candidates": np.nan,
    "candidate_costs": np.nan,
    "chosen": -1,
    "channel": NO_CHANNEL,
    "reason": REASON_NONE,
}
"""What stands in the arrays of a thing before there is one; 0 in the others."""


def nothing_yet(thing: Rows) -> Rows:
    """Return what a thing was before there was any: no sample, no command, no authority."""
    nothing = copied(thing)
    if isinstance(nothing, np.ndarray):
        nothing[:] = 0.0
        return nothing
    for field in fields(nothing):
        rows = getattr(nothing, field.name)
        # A sensor that has not delivered yet is alive all the same, if it is.
        if isinstance(rows, np.ndarray) and field.name != "alive":
            rows[:] = _NOTHING.get(field.name, 0.0)
    return nothing


class Past(Generic[Rows]):
    """What a thing was at the newest ticks."""

    def __init__(self, ticks: int) -> None:
        """Keep so many ticks before the present one."""
        self._kept: deque[Rows] = deque(maxlen=ticks + 1)

    def add(self, thing: Rows) -> None:
        """Keep a copy of what it is at the present tick."""
        self._kept.appendleft(copied(thing))

    def write(self, target: Rows, ago: Ints, runs: Bools) -> None:
        """Overwrite rows of a thing with what they were some ticks ago.

        Args:
            target: In and out.
            ago: (B,) ticks; where there was nothing yet, that is written.
            runs: (B,) which.
        """
        for age in np.unique(ago[runs]):
            has_been = age < len(self._kept)
            source = self._kept[age] if has_been else nothing_yet(target)
            take_rows(target, source, runs & (ago == age))


class Queue(Generic[Rows]):
    """Hands on what was put in some ticks ago, in order, while a fault is there.

    From the onset on, what was handed on last stands until the first thing that was put in since
    then has come through.
    """

    def __init__(self, lags: Ints) -> None:
        """Take the lag of each run (B,) in ticks."""
        self._lags = lags
        self._past: Past[Rows] = Past(int(lags.max(initial=0)))
        self._count = np.zeros(lags.shape, dtype=np.int64)

    def apply(self, thing: Rows, active: Bools) -> tuple[Rows, Bools]:
        """Return what comes out, and where it only stands.

        Args:
            thing: What is put in; returned itself if no run is active.
            active: (B,) where the fault is there.
        """
        self._past.add(thing)
        # How many things have been put in since the onset, with this one.
        self._count = np.where(active, self._count + 1, 0)
        stands = active & (self._count <= self._lags)
        if not active.any():
            return thing, stands
        late = copied(thing)
        self._past.write(late, np.minimum(self._lags, self._count), active)
        return late, stands
