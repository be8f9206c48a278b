"""Faults of a sensor's body: blind in a sector, short of sight, turned, shifted; and of pixels."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.faults.lists import Seat, column, is_within, sensor_column, with_rows, without
from adeye.faults.measured import without_points, write_estimate, write_values
from adeye.faults.places import shift_points, turned
from adeye.sensors.exposure import (
    PATCH_BOTTOM,
    PATCH_FIRST,
    PATCH_STOP,
    PATCH_TOP,
    PATCH_TRANSMISSION,
    PATCH_VARIANCE,
    PATCH_WIDTH,
)
from adeye.signals import (
    DETECTION_X,
    DETECTION_Y,
    EGO_HEADING,
    EGO_X,
    EGO_Y,
    GNSS_X,
    GNSS_Y,
    POINT_BEARING,
    POINT_RANGE,
)

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import Bools, Floats, Measurement


class BlindSector:
    """Nothing is seen between two bearings: no object whose place is there, no return."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._seat = Seat(context)
        self._right, self._left = column(context, "right"), column(context, "left")

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement without what is in the sector in the active runs."""
        active = moment.active[:, None]
        if not active.any():
            return measurement
        if measurement.points is not None:
            bearings = measurement.points[:, :, POINT_BEARING]
            return without_points(measurement, active & self._is_blind(bearings))
        bearings = self._seat.bearings(measurement.detections)
        return without(measurement, active & self._is_blind(bearings))

    def _is_blind(self, bearings: Floats) -> Bools:
        return is_within(bearings, self._right, self._left)


class RangeLoss:
    """Only what is nearer than a share of the specified range is seen."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._seat = Seat(context)
        factor = column(context, "factor")
        # Some sensors see what is larger from further away than is specified.
        self._reach = np.where(factor < 1.0, factor * sensor_column(context, "range"), np.inf)

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement without what is further away in the active runs."""
        active = moment.active[:, None]
        if not active.any():
            return measurement
        if measurement.points is not None:
            ranges = measurement.points[:, :, POINT_RANGE]
            return without_points(measurement, active & (ranges > self._reach))
        distances = self._seat.distances(measurement.detections)
        return without(measurement, active & (distances > self._reach))


class Miscalibration:
    """What is seen lies as much on the other side as the sensor is turned and shifted."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._seat = Seat(context)
        self._yaw = column(context, "yaw")
        self._x, self._y = column(context, "x"), column(context, "y")
        self._is_wrong = ((self._yaw != 0.0) | (self._x != 0.0) | (self._y != 0.0))[:, 0]

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with all that is seen moved in the active runs."""
        wrong = moment.active & self._is_wrong & (measurement.stamp >= 0.0)
        if not wrong.any():
            return measurement
        if measurement.points is not None:
            points = measurement.points.copy()
            shift_points(points, wrong, self._yaw, self._x, self._y)
            return replace(measurement, points=points)
        seat, rows = self._seat, measurement.detections.copy()
        dx, dy = seat.away(rows)
        x, y = turned(dx - self._x, dy - self._y, -self._yaw)
        moved = wrong[:, None] & measurement.mask
        rows[:, :, DETECTION_X] = np.where(moved, seat.x + x, rows[:, :, DETECTION_X])
        rows[:, :, DETECTION_Y] = np.where(moved, seat.y + y, rows[:, :, DETECTION_Y])
        return with_rows(
            measurement, measurement.mask, rows, measurement.source.copy(), moved.any(axis=1)
        )


class Jump:
    """The ego is taken to be somewhere else, along the axes of the map."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._road = context.scene.road
        self._size = {name: column(context, name) for name in ("x", "y", "heading")}

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with another place in the active runs."""
        active = (moment.active & (measurement.stamp >= 0.0))[:, None]
        if not active.any():
            return measurement
        if measurement.estimate is not None:
            columns = {"x": EGO_X, "y": EGO_Y, "heading": EGO_HEADING}
            array = measurement.estimate
        elif measurement.values is not None:
            columns = {"x": GNSS_X, "y": GNSS_Y}
            array = measurement.values
        else:
            return measurement
        changes = {}
        for name, at in columns.items():
            size = self._size[name]
            changes[at] = (array[:, at : at + 1] + size, active & (size != 0.0))
        if not any(changed.any() for _, changed in changes.values()):
            return measurement
        if measurement.estimate is not None:
            return write_estimate(measurement, changes, self._road)
        return write_values(measurement, changes, self._road)


class Pixels:
    """Pixels of a physical camera are dead, dim or noisy: in the image, before anything is found.

    It acts on the frames that are taken while it is present; the latency comes after it.
    """

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        specs: Any = context.specs
        cameras: Any = [item.sensors[specs[0].target_id] for item in context.architectures]
        self._patches: Floats = np.zeros((len(specs), 1, PATCH_WIDTH))
        for row, spec, camera in zip(self._patches[:, 0], specs, cameras, strict=True):
            first, top = getattr(spec, "column", 0), getattr(spec, "row", 0)
            row[PATCH_FIRST], row[PATCH_TOP] = first, top
            row[PATCH_STOP] = first + getattr(spec, "columns", camera.columns)
            row[PATCH_BOTTOM] = top + getattr(spec, "rows", camera.rows)
            row[PATCH_TRANSMISSION] = getattr(spec, "transmission", 1.0)
            row[PATCH_VARIANCE] = getattr(spec, "noise", 0.0) ** 2
            if row[PATCH_TRANSMISSION] == 1.0 and row[PATCH_VARIANCE] == 0.0:
                row[:] = 0.0

    def patches(self, moment: Moment) -> Floats | None:
        """Return the patches (B, 1, PATCH_WIDTH) on the image, empty in runs without the fault.

        None if there are none in any run.
        """
        there = moment.active & (self._patches[:, 0, PATCH_STOP] > 0.0)
        if not there.any():
            return None
        return np.where(there[:, None, None], self._patches, 0.0)
