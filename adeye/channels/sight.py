"""What a channel sees, laid out once for its compiled step: samples of all linked sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.channels.tracking import SENSOR_KINDS
from adeye.signals import DETECTION_COLUMNS, ESTIMATE_COLUMNS, Bools, Floats, Ints, Measurement

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.ports import ChannelContext


class Sight:
    """Copies the newest samples of the linked sensors into arrays of one fixed layout.

    Attributes:
        kinds: (S,) index into ``SENSOR_KINDS``.
        mounts: (B, S, 2) x, y of the sensors in the vehicle frame [m].
        stamps: (B, S) time of the newest sample [s], -1 before the first.
        masks: (B, S, M) which detections are there.
        detections: (B, S, M, 7).
        estimate: (B, 13) of the first linked sensor that gives one.
        estimate_stamp: (B,) its time [s]; -1 without such a sensor.
        is_degraded: (B,) whether a linked sensor does not deliver.
        places: (M, 2) scratch of the step.
        owner: (M,) scratch of the step.
    """

    def __init__(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Gives the linked sensors, their kinds and mounts.
        """
        self._ids = tuple(link for link in context.links if link in context.sensors)
        runs, sensors = context.runs, len(self._ids)
        known = {kind: index for index, kind in enumerate(SENSOR_KINDS)}
        self.kinds: Ints = np.array(
            [known.get(context.sensors[name], known["camera"]) for name in self._ids],
            dtype=np.int64,
        )
        self.mounts: Floats = np.zeros((runs, sensors, 2))
        for index, name in enumerate(self._ids):
            if name in context.mounts:
                self.mounts[:, index] = context.mounts[name][:, :2]
        self.stamps: Floats = np.full((runs, sensors), -1.0)
        self.masks: Bools = np.zeros((runs, sensors, 0), dtype=np.bool_)
        self.detections: Floats = np.zeros((runs, sensors, 0, len(DETECTION_COLUMNS)))
        self.places: Floats = np.zeros((0, 2))
        self.owner: Ints = np.zeros(0, dtype=np.int64)
        self.estimate: Floats = np.zeros((runs, len(ESTIMATE_COLUMNS)))
        self.estimate_stamp: Floats = np.full(runs, -1.0)
        self.is_degraded: Bools = np.zeros(runs, dtype=np.bool_)

    def take(self, measurements: Mapping[str, Measurement]) -> None:
        """Copy the measurements of a tick.

        Args:
            measurements: By sensor id.
        """
        size = max((measurements[name].mask.shape[1] for name in self._ids), default=0)
        if size > self.masks.shape[2]:
            runs, sensors = self.stamps.shape
            self.masks = np.zeros((runs, sensors, size), dtype=np.bool_)
            self.places, self.owner = np.zeros((size, 2)), np.zeros(size, dtype=np.int64)
            self.detections = np.zeros((runs, sensors, size, len(DETECTION_COLUMNS)))
        self.is_degraded[:] = False
        has_estimate = False
        for index, name in enumerate(self._ids):
            item = measurements[name]
            count = item.mask.shape[1]
            self.stamps[:, index] = item.stamp
            self.masks[:, index, :count] = item.mask
            self.masks[:, index, count:] = False
            self.detections[:, index, :count] = item.detections
            self.is_degraded |= ~item.alive
            if item.estimate is not None and not has_estimate:
                has_estimate = True
                self.estimate[:] = item.estimate
                self.estimate_stamp[:] = item.stamp
