"""What a channel sees, laid out for its compiled step: the samples of all linked sensors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.channels.accuracy import assumed_accuracy
from adeye.channels.localisation import Localiser
from adeye.signals import (
    DETECTION_COLUMNS,
    ESTIMATE_COLUMNS,
    IMU_COLUMNS,
    Bools,
    Floats,
    Ints,
    Measurement,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.ports import ChannelContext

LEAST_SLOTS: Final = 4
"""Sensors that there is room for at least. A step is compiled for a number of slots, which is this
or the next power of two, so that a further sensor seldom costs a compilation."""

_BLIND: Final = frozenset({"localisation", "gnss", "imu"})

_FLOAT: Final = np.dtype(np.float64)
_BOOL: Final = np.dtype(np.bool_)


class Sight:
    """Shows the newest samples of the linked sensors, where they lie: nothing is copied.

    They are looked at during the tick only, because a sensor may write to its arrays at the next.

    Attributes:
        accuracy: (B, S, ACCURACY_WIDTH) what is assumed of the sensors that may detect something.
        mounts: (B, S, 2) x, y of these sensors in the vehicle frame [m].
        stamps: Time of the newest sample (B,) [s], -1 before the first; by sensor, and so are the
            next two. The slots beyond the S sensors are not to be read.
        masks: Which detections are there (B, M); M may differ.
        detections: (B, M, 7).
        alive: Whether each linked sensor delivers (B,), also one that detects nothing; true in the
            slots beyond.
        estimate: (B, 13) of the first linked sensor that gives one; without such a sensor, what the
            channel makes of its satellite receiver and inertial unit.
        estimate_stamp: (B,) its time [s]; -1 without any of them.
        places: (M, 2) scratch of the step, for the longest M.
        owner: (M,) scratch of the step.
    """

    def __init__(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Gives the linked sensors, their kinds, data sheets and mounts.
        """
        self._ids = tuple(link for link in context.links if link in context.sensors)
        # What knows the ego only has never seen anything, so nobody need look.
        self._seeing = tuple(name for name in self._ids if context.sensors[name] not in _BLIND)
        runs, sensors = context.runs, len(self._seeing)
        self.accuracy: Floats = assumed_accuracy(context, self._seeing)
        self.mounts: Floats = np.zeros((runs, sensors, 2))
        for index, name in enumerate(self._seeing):
            if name in context.mounts:
                self.mounts[:, index] = context.mounts[name][:, :2]
        self._slots = LEAST_SLOTS
        while self._slots < len(self._ids):
            self._slots *= 2
        self._nothing = (
            np.full(runs, -1.0),
            np.zeros((runs, 0), dtype=np.bool_),
            np.zeros((runs, 0, len(DETECTION_COLUMNS))),
        )
        self._all_alive: Bools = np.ones(runs, dtype=np.bool_)
        self.stamps: tuple[Floats, ...] = ()
        self.masks: tuple[Bools, ...] = ()
        self.detections: tuple[Floats, ...] = ()
        self.alive: tuple[Bools, ...] = ()
        self.places: Floats = np.zeros((0, 2))
        self.owner: Ints = np.zeros(0, dtype=np.int64)
        self.estimate: Floats = np.zeros((runs, len(ESTIMATE_COLUMNS)))
        self.estimate_stamp: Floats = np.full(runs, -1.0)
        self.localiser = Localiser.of(context)
        self._no_motion: Floats = np.zeros((runs, len(IMU_COLUMNS)))

    def take(self, measurements: Mapping[str, Measurement], time: float = math.nan) -> None:
        """Look at the measurements of a tick.

        Args:
            measurements: By sensor id.
            time: Of the tick [s]; a channel with a receiver and no inertial unit needs it.
        """
        stamp, mask, detections = self._nothing
        seen = [measurements[name] for name in self._seeing]
        spare = self._slots - len(seen)
        self.stamps = (*(_plain(item.stamp, _FLOAT) for item in seen), *[stamp] * spare)
        self.masks = (*(_plain(item.mask, _BOOL) for item in seen), *[mask] * spare)
        self.detections = (
            *(_plain(item.detections, _FLOAT) for item in seen),
            *[detections] * spare,
        )
        items = [measurements[name] for name in self._ids]
        self.alive = (
            *(_plain(item.alive, _BOOL) for item in items),
            *[self._all_alive] * (self._slots - len(items)),
        )
        size = max(rows.shape[1] for rows in self.masks)
        if size > self.owner.shape[0]:
            self.places, self.owner = np.zeros((size, 2)), np.zeros(size, dtype=np.int64)
        for item in items:
            if item.estimate is not None:
                self.estimate = _plain(item.estimate, _FLOAT)
                self.estimate_stamp = _plain(item.stamp, _FLOAT)
                return
        if self.localiser is not None:
            self._localise(self.localiser, measurements, time)

    def _localise(
        self, localiser: Localiser, measurements: Mapping[str, Measurement], time: float
    ) -> None:
        fix = measurements[localiser.gnss]
        if localiser.imu is None:
            sample, stamp = self._no_motion, np.full(self._no_motion.shape[0], time)
        else:
            unit = measurements[localiser.imu]
            sample, stamp = _plain(unit.values, _FLOAT), _plain(unit.stamp, _FLOAT)
        localiser.update(_plain(fix.values, _FLOAT), _plain(fix.stamp, _FLOAT), sample, stamp)
        self.estimate, self.estimate_stamp = localiser.estimate, localiser.stamp


def _plain(array: Any, kind: Any) -> Any:
    """Return an array of the one type that steps are compiled for, itself if it is one."""
    if array.dtype is kind and array.flags.carray:
        return array
    return np.array(array, dtype=kind, order="C")
