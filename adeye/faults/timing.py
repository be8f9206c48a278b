"""Faults of when samples come: frozen, late, lost, or with a wrong stamp."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.faults.draws import Draws
from adeye.faults.injectors import DropOut
from adeye.faults.lists import column, widened

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import Bools, Floats, Measurement

TOLERANCE: Final = 1e-9
"""Slack of comparisons of times [s]: multiples of the step are not exact."""

ENTER_DRAW, LOSS_DRAW = 0, 1
"""Draws of a sample that may be lost: whether a burst begins or ends, whether it is lost alone."""

JITTER_DRAW: Final = 0


class PowerLoss:
    """A sensor delivers nothing while it has no power and while it comes up again.

    It has memory: the fault is felt for ``restart`` after its end.
    """

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._drop_out = DropOut(context)
        self._restart: Floats = column(context, "restart")[:, 0]
        self._step = context.step
        self._until: Floats = np.full(len(self._restart), -np.inf)

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with the fault in the active runs, and in those that come up."""
        self._until[moment.active] = moment.time + self._step
        down = moment.active | (moment.time < self._until + self._restart - TOLERANCE)
        return self._drop_out.apply(measurement, replace(moment, active=down))


class Freeze:
    """What was said last is said again with new stamps; without a sample nothing is frozen."""

    def __init__(self, _context: InjectorContext) -> None:
        self._last: Measurement | None = None

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with the content of an earlier one in the active runs."""
        if self._last is None:
            self._last = measurement
        held = moment.active & (self._last.stamp >= 0.0)
        self._last = overlaid(measurement, self._last, held)
        return self._last


class Stale:
    """The last sample stays with its stamp, and the sensor is said to be alive."""

    def __init__(self, _context: InjectorContext) -> None:
        self._last: Measurement | None = None

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with an earlier one in the active runs."""
        if self._last is None:
            self._last = nothing_of(measurement)
        self._last = held_back(measurement, self._last, moment.active)
        return self._last


class StaleStamp:
    """Samples are new, but their stamp is that of the last one before."""

    def __init__(self, _context: InjectorContext) -> None:
        self._last: Floats | None = None

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with an earlier stamp in the active runs."""
        last = measurement.stamp if self._last is None else self._last
        held = moment.active & (last >= 0.0)
        self._last = np.where(held, last, measurement.stamp)
        return replace(measurement, stamp=self._last.copy()) if held.any() else measurement


class ClockDrift:
    """Stamps are wrong by an offset and by what has come together since the onset.

    A stamp of what was measured is never below 0. Who has used a stamp of the future takes no
    sample before that time, also after the fault.
    """

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._offset: Floats = column(context, "offset")[:, 0]
        self._rate: Floats = column(context, "rate")[:, 0]

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with another stamp in the active runs."""
        gone = self._offset + self._rate * sample_age(measurement, moment)
        wrong = moment.active & (measurement.stamp >= 0.0) & (gone != 0.0)
        if not wrong.any():
            return measurement
        stamp = measurement.stamp.copy()
        stamp[wrong] = np.maximum(stamp[wrong] + gone[wrong], 0.0)
        return replace(measurement, stamp=stamp)


class Delay:
    """Samples that come while the fault is present are held up; none overtakes another.

    What has not come when the fault ends is lost: the newest sample is there at once.
    """

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._draws = Draws(context)
        self._delay: Floats = column(context, "by")[:, 0]
        self._jitter: Floats = column(context, "jitter")[:, 0]
        self._waiting: deque[tuple[Floats, Measurement]] = deque()
        self._due: Floats = np.full(len(self._delay), -np.inf)
        self._last: Measurement | None = None

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the newest measurement that has come in each active run."""
        self._draws.count(measurement)
        active = moment.active
        if self._last is None:
            self._last = nothing_of(measurement)
        self._due[~active] = -np.inf
        for due, _ in self._waiting:
            due[~active] = np.inf
        if not active.any():
            self._waiting.clear()
            self._last = measurement
            return measurement
        coming = active & measurement.fresh
        if coming.any():
            late = moment.time + self._delay + self._jitter * self._draws.shares(JITTER_DRAW)
            self._due = np.where(coming, np.maximum(self._due, late), self._due)
            self._waiting.append((np.where(coming, self._due, np.inf), measurement))
        shown = held_back(measurement, self._last, active)
        for due, sample in self._waiting:
            here = due <= moment.time + TOLERANCE
            if here.any():
                shown = _arrived(shown, sample, here)
                due[here] = np.inf
        while self._waiting and np.isinf(self._waiting[0][0]).all():
            self._waiting.popleft()
        self._last = shown
        return shown


class SampleLoss:
    """Samples are lost, and the one before stays; a burst begins and ends with a sample."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._draws = Draws(context)
        self._probability: Floats = column(context, "probability")[:, 0]
        self._enter: Floats = column(context, "enter")[:, 0]
        self._leave: Floats = column(context, "leave")[:, 0]
        runs = len(self._enter)
        self._burst: Bools = np.zeros(runs, dtype=np.bool_)
        self._lost: Bools = np.zeros(runs, dtype=np.bool_)
        self._last: Measurement | None = None

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the newest measurement that was not lost in each active run."""
        self._draws.count(measurement)
        active = moment.active
        self._burst &= active
        self._lost &= active
        coming = active & measurement.fresh
        if coming.any():
            share = self._draws.shares(ENTER_DRAW)
            burst = np.where(self._burst, share >= self._leave, share < self._enter)
            lost = burst | (self._draws.shares(LOSS_DRAW) < self._probability)
            self._burst = np.where(coming, burst, self._burst)
            self._lost = np.where(coming, lost, self._lost)
        if self._last is None:
            self._last = nothing_of(measurement)
        self._last = held_back(measurement, self._last, self._lost)
        return self._last


def sample_age(measurement: Measurement, moment: Moment) -> Floats:
    """Return how long after the first onset each newest sample was made (B,) [s], at least 0."""
    age: Floats = np.maximum(0.0, moment.age - (moment.time - measurement.stamp))
    return age


def nothing_of(measurement: Measurement) -> Measurement:
    """Return what a sensor delivers before its first sample."""
    nothing = measurement.copy()
    nothing.stamp[:] = -1.0
    nothing.fresh[:] = False
    nothing.mask[:] = False
    nothing.detections[:] = 0.0
    nothing.source[:] = -1
    for array, value in (
        (nothing.estimate, 0.0),
        (nothing.points, 0.0),
        (nothing.hits, -1),
        (nothing.values, np.nan),
    ):
        if array is not None:
            array[:] = value
    return nothing


def overlaid(measurement: Measurement, other: Measurement, runs: Bools) -> Measurement:
    """Return a measurement with the content of another in some runs; itself if there are none."""
    if not runs.any():
        return measurement
    size = max(measurement.mask.shape[1], other.mask.shape[1])
    lists = [widened(item, size - item.mask.shape[1]) for item in (other, measurement)]
    changed: dict[str, Any] = {
        name: _chosen(runs, *pair)
        for name, *pair in zip(("mask", "detections", "source"), *lists, strict=True)
    }
    for name in ("estimate", "points", "hits", "values"):
        if getattr(measurement, name) is not None:
            changed[name] = _chosen(runs, getattr(other, name), getattr(measurement, name))
    return replace(measurement, fresh=measurement.fresh.copy(), **changed)


def held_back(measurement: Measurement, other: Measurement, runs: Bools) -> Measurement:
    """Return a measurement with all of another one in some runs, where nothing is new."""
    held = overlaid(measurement, other, runs)
    if held is measurement:
        return held
    stamp = np.where(runs, other.stamp, measurement.stamp)
    return replace(held, stamp=stamp, fresh=measurement.fresh & ~runs)


def _arrived(shown: Measurement, sample: Measurement, runs: Bools) -> Measurement:
    arrived = overlaid(shown, sample, runs)
    stamp = np.where(runs, sample.stamp, shown.stamp)
    return replace(arrived, stamp=stamp, fresh=shown.fresh | runs)


def _chosen(runs: Bools, one: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    return np.where(runs.reshape(-1, *[1] * (one.ndim - 1)), one, other)
