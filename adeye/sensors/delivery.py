"""When a sensor samples and when the sample is delivered: rate and latency in whole ticks."""

from __future__ import annotations

from collections import deque

import numpy as np

from adeye.kernel.jit import inlined
from adeye.signals import (
    DETECTION_COLUMNS,
    Bools,
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


def sample_at(time: float, runs: int, objects: int) -> Measurement:
    """Return a sample of detections that were made at a time [s]; what it detects is to be written.

    Every element of mask, detections and source is to be, those of runs that have ended too.
    """
    return Measurement(
        stamp=np.full(runs, time),
        fresh=np.zeros(runs, dtype=np.bool_),
        alive=np.ones(runs, dtype=np.bool_),
        mask=np.empty((runs, objects), dtype=np.bool_),
        detections=np.empty((runs, objects, len(DETECTION_COLUMNS))),
        source=np.empty((runs, objects), dtype=np.int64),
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
def insert(order: Ints, places: Floats, count: int, thing: int, distance: float) -> None:
    """Insert an object into the list of those detected, by increasing distance.

    Args:
        order: (M,) objects in order, in and out.
        places: (M, >= 2) x and y of each one's detection in the vehicle frame [m].
        count: How many are in the list.
        thing: Who is inserted.
        distance: Its squared distance [m²].
    """
    row = count
    while row > 0:
        x, y = places[order[row - 1], 0], places[order[row - 1], 1]
        if x * x + y * y <= distance:
            break
        order[row] = order[row - 1]
        row -= 1
    order[row] = thing


@inlined
def clear(mask: Bools, detections: Floats, source: Ints, first: int) -> None:
    """Empty the rows of a run's detections from one on.

    Args:
        mask: (M,) out.
        detections: (M, 7) out.
        source: (M,) out.
        first: The first row to empty.
    """
    for row in range(first, mask.shape[0]):
        mask[row] = False
        source[row] = -1
        for column in range(detections.shape[1]):
            detections[row, column] = 0.0
