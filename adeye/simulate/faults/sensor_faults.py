"""What faults do to sensors: to their bodies, numbers, lists of objects and timing."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals
from adeye.kernel.elementary import sin_cos
from adeye.signals import Bools, Floats, Measurement
from adeye.simulate.faults.injector import Draws, DropOut, nothing_yet
from adeye.simulate.faults.rows import (
    Place,
    Seat,
    column,
    indices_of,
    is_within,
    place_of,
    sensor_column,
    shift_points,
    turned,
    widened,
    with_rows,
    without,
    without_points,
    write_estimate,
    write_values,
)
from adeye.simulate.sensors import imaging
from adeye.simulate.sensors.sampling import velocity_at
from adeye.spec.sensor_faults import delivered

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from adeye.signals import Ints
    from adeye.simulate.faults.injector import InjectorContext, Moment

# --- Faults of a sensor's body: blind in a sector, short of sight, turned, shifted; and of pixels -


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
            bearings = measurement.points[:, :, signals.POINT_BEARING]
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
            ranges = measurement.points[:, :, signals.POINT_RANGE]
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
        rows[:, :, signals.DETECTION_X] = np.where(
            moved, seat.x + x, rows[:, :, signals.DETECTION_X]
        )
        rows[:, :, signals.DETECTION_Y] = np.where(
            moved, seat.y + y, rows[:, :, signals.DETECTION_Y]
        )
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
            columns = {"x": signals.EGO_X, "y": signals.EGO_Y, "heading": signals.EGO_HEADING}
            array = measurement.estimate
        elif measurement.values is not None:
            columns = {"x": signals.GNSS_X, "y": signals.GNSS_Y}
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
        self._patches: Floats = np.zeros((len(specs), 1, imaging.PATCH_WIDTH))
        for row, spec, camera in zip(self._patches[:, 0], specs, cameras, strict=True):
            first, top = getattr(spec, "column", 0), getattr(spec, "row", 0)
            row[imaging.PATCH_FIRST], row[imaging.PATCH_TOP] = first, top
            row[imaging.PATCH_STOP] = first + getattr(spec, "columns", camera.columns)
            row[imaging.PATCH_BOTTOM] = top + getattr(spec, "rows", camera.rows)
            row[imaging.PATCH_TRANSMISSION] = getattr(spec, "transmission", 1.0)
            row[imaging.PATCH_VARIANCE] = getattr(spec, "noise", 0.0) ** 2
            if row[imaging.PATCH_TRANSMISSION] == 1.0 and row[imaging.PATCH_VARIANCE] == 0.0:
                row[:] = 0.0

    def patches(self, moment: Moment) -> Floats | None:
        """Return the patches (B, 1, PATCH_WIDTH) on the image, empty in runs without the fault.

        None if there are none in any run.
        """
        there = moment.active & (self._patches[:, 0, imaging.PATCH_STOP] > 0.0)
        if not there.any():
            return None
        return np.where(there[:, None, None], self._patches, 0.0)


# --- Faults of when samples come: frozen, late, lost, or with a wrong stamp -----------------------

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
            self._last = nothing_yet(measurement)
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
            self._last = nothing_yet(measurement)
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
            self._last = nothing_yet(measurement)
        self._last = held_back(measurement, self._last, self._lost)
        return self._last


def sample_age(measurement: Measurement, moment: Moment) -> Floats:
    """Return how long after the first onset each newest sample was made (B,) [s], at least 0."""
    age: Floats = np.maximum(0.0, moment.age - (moment.time - measurement.stamp))
    return age


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


# --- Faults of a number that a sensor measures: what becomes of it, sample by sample --------------

Change = Any
"""What makes new values (B, K) of values (B, K), their draw indices and the moment."""


class NumberFault:
    """Changes one signal of the newest sample; what it does not change keeps every bit."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        first: Any = context.specs[0]
        self._signal: str = first.signal
        self._draws = Draws(context)
        self._change = CHANGES[first.model](context, self._draws)
        self._road = context.scene.road
        self._objects = len(context.scene.object_ids)
        self._seat = Seat(context)

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with another value in the active runs."""
        self._draws.count(measurement)
        active = moment.active & (measurement.stamp >= 0.0)
        if not active.any():
            return measurement
        place: Place = place_of(measurement, self._signal, self._seat, self._objects)
        values = np.ascontiguousarray(place.values)
        age = sample_age(measurement, moment)[:, None]
        with np.errstate(all="ignore"):
            new = np.ascontiguousarray(self._change(values, place.indices, age))
            if place.least is not None:
                new = np.maximum(new, place.least)
        differs = new.view(np.int64) != values.view(np.int64)
        changed = place.there & active[:, None] & differs
        if not changed.any():
            return measurement
        return place.write(measurement, new, changed, self._road)


def _bias(context: InjectorContext, _draws: Draws) -> Change:
    size = column(context, "size")
    return lambda values, _indices, _age: _added(values, size)


def _scale(context: InjectorContext, _draws: Draws) -> Change:
    factor = column(context, "factor")
    return lambda values, _indices, _age: values * factor


def _drift(context: InjectorContext, _draws: Draws) -> Change:
    rate = column(context, "size") / column(context, "over")
    return lambda values, _indices, age: _added(values, rate * age)


def _noise(context: InjectorContext, draws: Draws) -> Change:
    size = column(context, "size")
    return lambda values, indices, _age: _added(values, size * draws.normals(indices))


def _quantise(context: InjectorContext, _draws: Draws) -> Change:
    size = column(context, "size")
    return lambda values, _indices, _age: np.where(
        size > 0.0, np.floor(values / size + 0.5) * size, values
    )


def _stuck_at(context: InjectorContext, _draws: Draws) -> Change:
    value = column(context, "value")
    return lambda values, _indices, _age: np.broadcast_to(value, values.shape)


def _spike(context: InjectorContext, draws: Draws) -> Change:
    size, probability = column(context, "size"), column(context, "probability")

    def change(values: Floats, indices: Ints, _age: Floats) -> Floats:
        return np.where(draws.uniforms(indices) < probability, _added(values, size), values)

    return change


def _bit_flip(context: InjectorContext, _draws: Draws) -> Change:
    specs: Any = context.specs
    bits = np.array([[1 << spec.bit] for spec in specs], dtype=np.uint64)
    return lambda values, _indices, _age: (values.view(np.uint64) ^ bits).view(np.float64)


def _added(values: Floats, size: Floats) -> Floats:
    # What is added nothing to keeps its sign, should it be a zero.
    return np.where(size == 0.0, values, values + size)


CHANGES: Final[Mapping[str, Callable[[InjectorContext, Draws], Change]]] = {
    "bias": _bias,
    "scale": _scale,
    "drift": _drift,
    "noise": _noise,
    "quantise": _quantise,
    "stuck_at": _stuck_at,
    "spike": _spike,
    "bit_flip": _bit_flip,
}


# --- Faults of the list of objects that a sensor reports: missed, false, split, of another class --


class _Chosen:
    """Chooses objects of a list by class and by a draw for each object and sample."""

    def __init__(self, context: InjectorContext) -> None:
        spec: Any = context.specs[0]
        self._draws = Draws(context)
        self._probability = column(context, "probability")
        self._wanted = np.ones(len(signals.OBJECT_CLASSES) + 1, dtype=np.bool_)
        if spec.classes is not None:
            self._wanted[:] = False
            self._wanted[[signals.OBJECT_CLASSES.index(name) for name in spec.classes]] = True
        self._classes = context.scene.object_classes

    def of(self, measurement: Measurement, active: Bools) -> Bools:
        """Return which detections (B, M) are chosen in the active runs; call it at every tick."""
        self._draws.count(measurement)
        if not active.any():
            return np.zeros(measurement.mask.shape, dtype=np.bool_)
        source = measurement.source
        seen = measurement.detections[:, :, signals.DETECTION_CLASS].astype(np.int64)
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
        self._class = float(signals.OBJECT_CLASSES.index(spec.taken_for))

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with another class of what is chosen in the active runs."""
        chosen = self._chosen.of(measurement, moment.active)
        if not chosen.any():
            return measurement
        rows = measurement.detections.copy()
        rows[chosen, signals.DETECTION_CLASS] = self._class
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
        chosen &= measurement.detections[:, :, signals.DETECTION_WIDTH] > 0.0
        if not chosen.any():
            return measurement
        size = chosen.shape[1]
        mask, rows, source = widened(measurement, size)
        mask[:, size:] = chosen
        rows[:, size:][chosen] = measurement.detections[chosen]
        for half, side in ((slice(0, size), -1.0), (slice(size, None), 1.0)):
            part = rows[:, half]
            width = part[chosen, signals.DETECTION_WIDTH]
            part[chosen, signals.DETECTION_Y] += 0.25 * side * width
            part[chosen, signals.DETECTION_WIDTH] = 0.5 * width
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
        self._row[:, signals.DETECTION_LENGTH] = column(context, "length")[:, 0]
        self._row[:, signals.DETECTION_WIDTH] = column(context, "width")[:, 0]
        known = delivered(context.architectures[0].sensors[spec.target_id])
        is_named = "classes" in known
        self._row[:, signals.DETECTION_CLASS] = (
            signals.OBJECT_CLASSES.index(spec.taken_for) if is_named else -1
        )
        self._row[:, signals.DETECTION_HAS_RANGE_RATE] = 1.0 if "range rates" in known else 0.0
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
        x, y, heading = moment.ego[run, [signals.EGO_X, signals.EGO_Y, signals.EGO_HEADING]]
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
        heading = ego[signals.EGO_HEADING] - late * ego[signals.EGO_YAW_RATE]
        sine, cosine = sin_cos(heading)
        course_sine, course_cosine = sin_cos(course)
        now_sine, now_cosine = sin_cos(ego[signals.EGO_HEADING])
        mid_sine, mid_cosine = sin_cos(
            ego[signals.EGO_HEADING] - 0.5 * late * ego[signals.EGO_YAW_RATE]
        )
        # Back along the way of the rear axle, around which the box centre swings.
        way, rear = ego[signals.EGO_SPEED] * late, self._rear[run]
        ego_x = ego[signals.EGO_X] - way * mid_cosine - rear * (now_cosine - cosine)
        ego_y = ego[signals.EGO_Y] - way * mid_sine - rear * (now_sine - sine)
        forward, aside = velocity_at(ego, rear, 0.0)
        speed = self._speed[run]
        gone = speed * (moment.time - late - begin)
        dx = x + gone * course_cosine - ego_x
        dy = y + gone * course_sine - ego_y
        row[signals.DETECTION_X] = cosine * dx + sine * dy
        row[signals.DETECTION_Y] = -sine * dx + cosine * dy
        distance = np.sqrt(dx * dx + dy * dy)
        closing = dx * (speed * course_cosine - (forward * cosine - aside * sine))
        closing += dy * (speed * course_sine - (forward * sine + aside * cosine))
        has_rate = row[signals.DETECTION_HAS_RANGE_RATE] > 0.0 and distance > 0.0
        row[signals.DETECTION_RANGE_RATE] = closing / distance if has_rate else 0.0
