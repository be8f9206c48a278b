"""When a sensor samples and when the sample is delivered: rate and latency in whole ticks."""

from __future__ import annotations

from collections import deque

import numpy as np

from adeye.kernel.jit import inlined
from adeye.signals import (
    DETECTION_COLUMNS,
    DETECTION_X,
    DETECTION_Y,
    Floats,
    Ints,
    Measurement,
)


def no_measurement(runs: int, objects: int, *, with_estimate: bool) -> Measurement:
    """Return what a sensor delivers before its first sample arrives."""
    estimate: Floats | None = np.zeros((runs, 13)) if with_estimate else None
    return Measurement(
        stamp=np.full(runs, -1.0),
        fresh=np.zeros(runs, dtype=np.bool_),
        alive=np.ones(runs, dtype=np.bool_),
        mask=np.zeros((runs, objects), dtype=np.bool_),
        detections=np.zeros((runs, objects, len(DETECTION_COLUMNS))),
        source=np.full((runs, objects), -1, dtype=np.int64),
        estimate=estimate,
    )


class Delivery:
    """Holds samples until their latency has passed; the newest delivered one stays."""

    def __init__(self, every: int, latency: int, first: Measurement) -> None:
        """Prepare for a batch.

        Args:
            every: Ticks between two samples.
            latency: Ticks from sample to delivery.
            first: What is delivered before the first sample arrives.
        """
        self._every = every
        self._latency = latency
        self._waiting: deque[tuple[int, Measurement]] = deque()
        self._newest = first

    def is_due(self, tick: int) -> bool:
        """Tell whether the sensor samples at a tick."""
        return tick % self._every == 0

    def push(self, tick: int, sample: Measurement) -> None:
        """Take a sample made at a tick."""
        self._waiting.append((tick + self._latency, sample))

    def newest(self, tick: int) -> Measurement:
        """Return the newest sample delivered by a tick; ``fresh`` if it came at this one."""
        fresh = False
        while self._waiting and self._waiting[0][0] <= tick:
            self._newest = self._waiting.popleft()[1]
            fresh = True
        self._newest.fresh[:] = fresh
        return self._newest


@inlined
def make_room(detections: Floats, source: Ints, count: int, distance: float) -> int:
    """Move farther detections one row down and return the row that is free for a new one.

    Args:
        detections: (M, 7), packed by increasing distance.
        source: (M,) object behind each.
        count: How many are there.
        distance: Squared distance of the new one [m²].
    """
    row = count
    while row > 0:
        x, y = detections[row - 1, DETECTION_X], detections[row - 1, DETECTION_Y]
        if x * x + y * y <= distance:
            break
        for column in range(detections.shape[1]):
            detections[row, column] = detections[row - 1, column]
        source[row] = source[row - 1]
        row -= 1
    return row
