"""Faults of the list of objects that a sensor reports: missed, false, split, of another class."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.faults.draws import Draws
from adeye.faults.lists import Seat, column, indices_of, is_within, widened, with_rows, without
from adeye.kernel.elementary import sin_cos
from adeye.kernel.motion import point_velocity
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    EGO_YAW_RATE,
    OBJECT_CLASSES,
)
from adeye.spec.faults.sensing import delivered

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import Bools, Floats, Measurement


class _Chosen:
    """Chooses objects of a list by class and by a draw for each object and sample."""

    def __init__(self, context: InjectorContext) -> None:
        spec: Any = context.specs[0]
        self._draws = Draws(context)
        self._probability = column(context, "probability")
        self._wanted = np.ones(len(OBJECT_CLASSES) + 1, dtype=np.bool_)
        if spec.classes is not None:
            self._wanted[:] = False
            self._wanted[[OBJECT_CLASSES.index(name) for name in spec.classes]] = True
        self._classes = context.scene.object_classes

    def of(self, measurement: Measurement, active: Bools) -> Bools:
        """Return which detections (B, M) are chosen in the active runs; call it at every tick."""
        self._draws.count(measurement)
        if not active.any():
            return np.zeros(measurement.mask.shape, dtype=np.bool_)
        source = measurement.source
        seen = measurement.detections[:, :, DETECTION_CLASS].astype(np.int64)
        # The class of the object; of a false detection what the sensor takes it for.
        classes = np.where(source >= 0, self._classes[np.maximum(source, 0)], seen)
        indices = indices_of(measurement, len(self._classes))
        is_drawn = self._draws.uniforms(indices) < self._probability
        chosen = measurement.mask & active[:, None] & self._wanted[classes] & is_drawn
        return np.asarray(chosen)


class Miss:
    """Objects that are there are not reported."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._chosen = _Chosen(context)
        self._seat = Seat(context)
        self._beyond = column(context, "beyond")
        self._right, self._left = column(context, "right"), column(context, "left")
        self._is_all = (self._left - self._right) >= 2.0 * np.pi

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement without what is missed in the active runs."""
        lost = self._chosen.of(measurement, moment.active)
        if not lost.any():
            return measurement
        rows = measurement.detections
        lost &= self._seat.distances(rows) >= self._beyond
        lost &= self._is_all | is_within(self._seat.bearings(rows), self._right, self._left)
        return without(measurement, lost)


class Misclassify:
    """Objects are taken for some of another class."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        spec: Any = context.specs[0]
        self._chosen = _Chosen(context)
        self._class = float(OBJECT_CLASSES.index(spec.taken_for))

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with another class of what is chosen in the active runs."""
        chosen = self._chosen.of(measurement, moment.active)
        if not chosen.any():
            return measurement
        rows = measurement.detections.copy()
        rows[chosen, DETECTION_CLASS] = self._class
        return replace(measurement, detections=rows)


class Split:
    """An object is reported as two, side by side; only one of them is known to be it.

    What has no width is not split. The list gets as many rows more as it needs.
    """

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._chosen = _Chosen(context)

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with two detections for each chosen in the active runs."""
        chosen = self._chosen.of(measurement, moment.active)
        chosen &= measurement.detections[:, :, DETECTION_WIDTH] > 0.0
        if not chosen.any():
            return measurement
        size = chosen.shape[1]
        mask, rows, source = widened(measurement, size)
        mask[:, size:] = chosen
        rows[:, size:][chosen] = measurement.detections[chosen]
        for half, side in ((slice(0, size), -1.0), (slice(size, None), 1.0)):
            part = rows[:, half]
            width = part[chosen, DETECTION_WIDTH]
            part[chosen, DETECTION_Y] += 0.25 * side * width
            part[chosen, DETECTION_WIDTH] = 0.5 * width
        return with_rows(measurement, mask, rows, source, np.any(chosen, axis=1))


class Ghost:
    """An object is reported that is not there; the list gets a row more.

    It has its place in the map from the tick of the onset. A sample shows it from where the ego was
    when that was made, going back from the present pose at the present speed and yaw rate.
    """

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        spec: Any = context.specs[0]
        self._x, self._y = column(context, "x")[:, 0], column(context, "y")[:, 0]
        self._speed = column(context, "speed")[:, 0]
        self._rear = [0.5 * item.vehicle.wheelbase for item in context.architectures]
        runs = len(self._x)
        self._row: Floats = np.zeros((runs, 7))
        self._row[:, DETECTION_LENGTH] = column(context, "length")[:, 0]
        self._row[:, DETECTION_WIDTH] = column(context, "width")[:, 0]
        known = delivered(context.architectures[0].sensors[spec.target_id])
        is_named = "classes" in known
        self._row[:, DETECTION_CLASS] = OBJECT_CLASSES.index(spec.taken_for) if is_named else -1
        self._row[:, DETECTION_HAS_RANGE_RATE] = 1.0 if "range rates" in known else 0.0
        self._begin: Floats = np.full((runs, 4), np.nan)
        self._was_active: Bools = np.zeros(runs, dtype=np.bool_)

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with a detection more in the active runs."""
        active = moment.active
        new = active & ~self._was_active
        self._was_active = active
        if not active.any():
            return measurement
        for run in np.flatnonzero(new).tolist():
            self._appear(run, moment)
        for run in np.flatnonzero(active & (new | measurement.fresh)).tolist():
            self._see(run, measurement.stamp[run], moment)
        shown = active & (measurement.stamp >= 0.0) & measurement.alive
        if not shown.any():
            return measurement
        mask, rows, source = widened(measurement, 1)
        mask[:, -1], rows[shown, -1] = shown, self._row[shown]
        return with_rows(measurement, mask, rows, source, shown)

    def _appear(self, run: int, moment: Moment) -> None:
        x, y, heading = moment.ego[run, [EGO_X, EGO_Y, EGO_HEADING]]
        sine, cosine = sin_cos(heading)
        self._begin[run] = (
            x + cosine * self._x[run] - sine * self._y[run],
            y + sine * self._x[run] + cosine * self._y[run],
            heading,
            moment.time,
        )

    def _see(self, run: int, stamp: float, moment: Moment) -> None:
        ego, row = moment.ego[run], self._row[run]
        x, y, course, begin = self._begin[run]
        late = moment.time - max(stamp, 0.0)
        heading = ego[EGO_HEADING] - late * ego[EGO_YAW_RATE]
        sine, cosine = sin_cos(heading)
        course_sine, course_cosine = sin_cos(course)
        now_sine, now_cosine = sin_cos(ego[EGO_HEADING])
        mid_sine, mid_cosine = sin_cos(ego[EGO_HEADING] - 0.5 * late * ego[EGO_YAW_RATE])
        # Back along the way of the rear axle, around which the box centre swings.
        way, rear = ego[EGO_SPEED] * late, self._rear[run]
        ego_x = ego[EGO_X] - way * mid_cosine - rear * (now_cosine - cosine)
        ego_y = ego[EGO_Y] - way * mid_sine - rear * (now_sine - sine)
        forward, aside = point_velocity(ego[EGO_SPEED], ego[EGO_YAW_RATE], rear, 0.0)
        speed = self._speed[run]
        gone = speed * (moment.time - late - begin)
        dx = x + gone * course_cosine - ego_x
        dy = y + gone * course_sine - ego_y
        row[DETECTION_X] = cosine * dx + sine * dy
        row[DETECTION_Y] = -sine * dx + cosine * dy
        distance = np.sqrt(dx * dx + dy * dy)
        closing = dx * (speed * course_cosine - (forward * cosine - aside * sine))
        closing += dy * (speed * course_sine - (forward * sine + aside * cosine))
        has_rate = row[DETECTION_HAS_RANGE_RATE] > 0.0 and distance > 0.0
        row[DETECTION_RANGE_RATE] = closing / distance if has_rate else 0.0
