"""Lists of detections as faults change them: still packed, and in order of distance."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from adeye.faults.places import bearing_of
from adeye.signals import DETECTION_X, DETECTION_Y

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext
    from adeye.signals import Bools, Floats, Ints, Measurement


def column(context: InjectorContext, name: str) -> Floats:
    """Return a parameter of the fault (B, 1)."""
    return np.array([[float(getattr(spec, name))] for spec in context.specs])


def sensor_column(context: InjectorContext, name: str) -> Floats:
    """Return a number (B, 1) of the target's record or its mount (``mount.x``); 0 for none."""
    part, _, field = name.rpartition(".")
    values = []
    for fault, architecture in zip(context.specs, context.architectures, strict=True):
        record = architecture.sensors[fault.target_id]
        owner = getattr(record, part, None) if part else record
        values.append([float(getattr(owner, field, 0.0))])
    return np.array(values).reshape(len(context.specs), 1)


def indices_of(measurement: Measurement, objects: int) -> Ints:
    """Return what each row (B, M) of a list draws by: its object, so its place does not count."""
    rows = np.arange(measurement.source.shape[1])
    return np.where(measurement.source >= 0, measurement.source, objects + rows)


def with_rows(
    measurement: Measurement, mask: Bools, detections: Floats, source: Ints, runs: Bools
) -> Measurement:
    """Return a measurement with another list, in some runs put in order.

    Args:
        measurement: Of which all else is kept.
        mask: (B, M) which rows are there.
        detections: (B, M, 7); altered.
        source: (B, M); altered.
        runs: (B,) whose list may be out of order, or have rows that are not there any more.
    """
    rows, there = detections[runs], mask[runs]
    x, y = rows[:, :, DETECTION_X], rows[:, :, DETECTION_Y]
    with np.errstate(all="ignore"):
        distance = x * x + y * y
    order = np.lexsort((distance, ~there), axis=-1)
    there = np.take_along_axis(there, order, axis=1)
    detections[runs] = np.where(
        there[:, :, None], np.take_along_axis(rows, order[:, :, None], axis=1), 0.0
    )
    source[runs] = np.where(there, np.take_along_axis(source[runs], order, axis=1), -1)
    mask = mask.copy()
    mask[runs] = there
    return replace(measurement, mask=mask, detections=detections, source=source)


def without(measurement: Measurement, lost: Bools) -> Measurement:
    """Return a measurement without some detections (B, M); itself if none is lost."""
    lost = lost & measurement.mask
    if not lost.any():
        return measurement
    return with_rows(
        measurement,
        measurement.mask & ~lost,
        measurement.detections.copy(),
        measurement.source.copy(),
        np.any(lost, axis=1),
    )


def widened(measurement: Measurement, room: int) -> tuple[Bools, Floats, Ints]:
    """Return copies of mask, detections and source with so many empty rows more."""
    mask, detections, source = measurement.mask, measurement.detections, measurement.source
    runs = mask.shape[0]
    return (
        np.concatenate((mask, np.zeros((runs, room), dtype=np.bool_)), axis=1),
        np.concatenate((detections, np.zeros((runs, room, detections.shape[2]))), axis=1),
        np.concatenate((source, np.full((runs, room), -1, dtype=np.int64)), axis=1),
    )


class Seat:
    """Where the sensor is that a fault is about, as its list of detections is seen from there.

    Attributes:
        x: (B, 1) in the vehicle frame [m].
        y: (B, 1) [m].
    """

    def __init__(self, context: InjectorContext) -> None:
        """Look up the mount; the origin for what has none."""
        self.x = sensor_column(context, "mount.x")
        self.y = sensor_column(context, "mount.y")

    def away(self, detections: Floats) -> tuple[Floats, Floats]:
        """Return how far along x and y each detection is from the sensor (B, M) [m]."""
        return detections[:, :, DETECTION_X] - self.x, detections[:, :, DETECTION_Y] - self.y

    def distances(self, detections: Floats) -> Floats:
        """Return the distance of each detection from the sensor (B, M) [m]."""
        dx, dy = self.away(detections)
        with np.errstate(all="ignore"):
            return np.sqrt(dx * dx + dy * dy)

    def bearings(self, detections: Floats) -> Floats:
        """Return the bearing of each detection (B, M) [rad], counted from the vehicle's x axis."""
        return bearing_of(*self.away(detections))


def is_within(bearings: Floats, right: Floats, left: Floats) -> Bools:
    """Tell which bearings are in a sector that goes from one bearing on to the left to another.

    Args:
        bearings: (B, M) [rad].
        right: (B, 1) [rad].
        left: (B, 1) [rad]; the same as ``right`` for no sector.
    """
    turn = 2.0 * np.pi
    size = left - right
    size = np.where(size < 0.0, size + turn, size)
    with np.errstate(all="ignore"):
        off = bearings - right
        off -= turn * np.floor(off / turn)
    return np.asarray(off < size)
