"""Rows that faults of sensors change: points, lists of detections, where a signal is in them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye import signals
from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.road import Grounds, ground_of
from adeye.signals import Bools, Floats, Measurement, RoadMap
from adeye.simulate.traffic.stage import locate
from adeye.spec.sensor_faults import SIGNALS

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.signals import Ints
    from adeye.simulate.faults.injector import InjectorContext

# --- Turning and locating whole arrays, with the same bits on every processor ---------------------

FARTHEST: Final = 1e7
"""Coordinates beyond which nothing is on a road [m]; further out its lane does not fit a number."""


def bearing_of(x: Floats, y: Floats) -> Floats:
    """Return the bearing of each vector (B, M) [rad]; NaN of one that is not finite."""
    bearings: Floats = np.empty(x.shape)
    _fill_bearings(np.ascontiguousarray(x), np.ascontiguousarray(y), bearings)
    return bearings


def turned(x: Floats, y: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Return vectors (B, M) turned counter-clockwise by angles (B, M) [rad]."""
    turned_x, turned_y = np.array(x), np.array(y)
    _turn(turned_x, turned_y, np.ascontiguousarray(np.broadcast_to(angle, x.shape)))
    return turned_x, turned_y


def relocate(road: RoadMap, runs: Bools, estimate: Floats) -> None:
    """Write where on the road the places of estimates (B, 13) are, in some runs.

    What is not finite, or beyond ``FARTHEST``, is nowhere: NaN.
    """
    _relocate(_grounds_of(road), runs, estimate)


# Those of a batch are asked for at every tick.
_grounds_of = lru_cache(maxsize=2)(RoadMap.grounds)


@compiled
def shift_points(points: Floats, runs: Bools, yaw: Floats, x: Floats, y: Floats) -> None:
    """Move the returns of lidars as a turned and shifted sensor sees them.

    Args:
        points: (B, P, 3) in and out.
        runs: (B,) in which.
        yaw: (B, 1) how far the sensor is turned to the left [rad].
        x: (B, 1) how far it is ahead of its place [m].
        y: (B, 1) how far to the left [m].
    """
    for run in range(points.shape[0]):
        if not runs[run]:
            continue
        for beam in range(points.shape[1]):
            point = points[run, beam]
            if not point[signals.POINT_RANGE] > 0.0:
                continue
            if x[run, 0] != 0.0 or y[run, 0] != 0.0:
                s, c = sin_cos(point[signals.POINT_BEARING])
                rise, level = sin_cos(point[signals.POINT_ELEVATION])
                height = point[signals.POINT_RANGE] * rise
                along = point[signals.POINT_RANGE] * level * c - x[run, 0]
                across = point[signals.POINT_RANGE] * level * s - y[run, 0]
                way = math.sqrt(along * along + across * across)
                point[signals.POINT_RANGE] = math.sqrt(way * way + height * height)
                point[signals.POINT_BEARING] = atan2(across, along)
                point[signals.POINT_ELEVATION] = atan2(height, way)
            point[signals.POINT_BEARING] -= yaw[run, 0]


@compiled
def _fill_bearings(x: Floats, y: Floats, bearings: Floats) -> None:
    for run in range(x.shape[0]):
        for row in range(x.shape[1]):
            if math.isfinite(x[run, row]) and math.isfinite(y[run, row]):
                bearings[run, row] = atan2(y[run, row], x[run, row])
            else:
                bearings[run, row] = math.nan


@compiled
def _turn(x: Floats, y: Floats, angle: Floats) -> None:
    for run in range(x.shape[0]):
        for row in range(x.shape[1]):
            s, c = sin_cos(angle[run, row])
            along, across = x[run, row], y[run, row]
            x[run, row], y[run, row] = c * along - s * across, s * along + c * across


@compiled
def _relocate(grounds: Grounds, runs: Bools, estimate: Floats) -> None:
    for run in range(estimate.shape[0]):
        if not runs[run]:
            continue
        x, y = estimate[run, signals.EGO_X], estimate[run, signals.EGO_Y]
        place = estimate[run, signals.ESTIMATE_PLACE :]
        if abs(x) <= FARTHEST and abs(y) <= FARTHEST:
            locate(ground_of(grounds, run), x, y, place)
        else:
            place[:] = math.nan
            place[signals.PLACE_LANE] = -1.0


# --- Lists of detections as faults change them: still packed, and in order of distance ------------


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
    x, y = rows[:, :, signals.DETECTION_X], rows[:, :, signals.DETECTION_Y]
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
        return detections[:, :, signals.DETECTION_X] - self.x, detections[
            :, :, signals.DETECTION_Y
        ] - self.y

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


# --- Where a signal is in a measurement: how it is read, and written back so that all else fits ---

_NEVER_NEGATIVE: Final = ("range", "length", "width", "ego_speed")


@dataclass(frozen=True, slots=True)
class Place:
    """The values of a signal in the newest sample.

    Attributes:
        values: (B, K).
        there: (B, K) which of them mean something.
        indices: (B, K) what each draws by.
        least: The least value that there can be; None if there is none.
        write: Returns the measurement with new values (B, K) where they changed (B, K).
    """

    values: Floats
    there: Bools
    indices: Ints
    least: float | None
    write: Callable[[Measurement, Floats, Bools, RoadMap], Measurement]


def place_of(measurement: Measurement, signal: str, seat: Seat, objects: int) -> Place:
    """Find a signal in a measurement.

    Args:
        measurement: That has it.
        signal: One of ``SIGNALS``.
        seat: Where the sensor is.
        objects: M, how many objects there are.
    """
    least = 0.0 if signal in _NEVER_NEGATIVE else None
    known = SIGNALS[signal]
    if known.instead == "points" and measurement.points is not None:
        return _of_points(measurement, signal, least)
    if "detections" in known.needs:
        return _of_detections(measurement, signal, (seat, objects), least)
    array = measurement.values if measurement.estimate is None else measurement.estimate
    if array is None:
        msg = f"no {signal} in the measurement of a sensor that is to have it"
        raise TypeError(msg)
    values = array[:, known.column : known.column + 1]
    write = write_values if measurement.estimate is None else write_estimate
    return Place(
        values,
        ~np.isnan(values),
        np.zeros(values.shape, dtype=np.int64),
        least,
        lambda given, new, changed, road: write(given, {known.column: (new, changed)}, road),
    )


def _of_points(measurement: Measurement, signal: str, least: float | None) -> Place:
    points = measurement.points
    if points is None:
        msg = "a lidar delivers points"
        raise TypeError(msg)
    column = signals.POINT_RANGE if signal == "range" else signals.POINT_BEARING
    beams = np.arange(points.shape[1])

    def write(given: Measurement, new: Floats, changed: Bools, _road: RoadMap) -> Measurement:
        moved = points.copy()
        moved[:, :, column] = np.where(changed, new, points[:, :, column])
        # A range of 0 says that nothing came back.
        return without_points(
            replace(given, points=moved), changed & (moved[:, :, signals.POINT_RANGE] == 0.0)
        )

    return Place(
        points[:, :, column],
        points[:, :, signals.POINT_RANGE] > 0.0,
        np.broadcast_to(beams, points.shape[:2]),
        least,
        write,
    )


def without_points(measurement: Measurement, lost: Bools) -> Measurement:
    """Return a measurement without the returns of some beams (B, P); itself if none is lost."""
    if measurement.points is None or measurement.hits is None:
        return measurement
    lost = lost & ((measurement.points[:, :, signals.POINT_RANGE] != 0.0) | (measurement.hits >= 0))
    if not lost.any():
        return measurement
    points, hits = measurement.points.copy(), measurement.hits.copy()
    points[lost, signals.POINT_RANGE] = 0.0
    hits[lost] = -1
    return replace(measurement, points=points, hits=hits)


def _of_detections(
    measurement: Measurement, signal: str, about: tuple[Seat, int], least: float | None
) -> Place:
    seat, objects = about
    rows = measurement.detections
    there = measurement.mask
    if signal == "range":
        values = seat.distances(rows)
    elif signal == "bearing":
        values = seat.bearings(rows)
    else:
        values = rows[:, :, SIGNALS[signal].column]
    if signal == "range_rate":
        there = there & (rows[:, :, signals.DETECTION_HAS_RANGE_RATE] > 0.0)

    def write(given: Measurement, new: Floats, changed: Bools, _road: RoadMap) -> Measurement:
        moved = rows.copy()
        if signal in ("range", "bearing"):
            dx, dy = seat.away(rows)
            with np.errstate(all="ignore"):
                x, y = _polar(signal, dx, dy, values, new)
            moved[:, :, signals.DETECTION_X] = np.where(
                changed, seat.x + x, rows[:, :, signals.DETECTION_X]
            )
            moved[:, :, signals.DETECTION_Y] = np.where(
                changed, seat.y + y, rows[:, :, signals.DETECTION_Y]
            )
        else:
            column = SIGNALS[signal].column
            moved[:, :, column] = np.where(changed, new, rows[:, :, column])
        if signal in ("length", "width", "range_rate"):
            return replace(given, detections=moved)
        return with_rows(given, given.mask, moved, given.source.copy(), np.any(changed, axis=1))

    return Place(values, there, indices_of(measurement, objects), least, write)


def _polar(signal: str, dx: Floats, dy: Floats, old: Floats, new: Floats) -> tuple[Floats, Floats]:
    """Return vectors (B, M) with another range, or another bearing."""
    if signal == "bearing":
        return turned(dx, dy, new - old)
    # What lies on the sensor itself is moved ahead.
    share = np.where(old > 0.0, new / old, 0.0)
    return np.where(old > 0.0, dx * share, new), dy * share


def write_values(
    measurement: Measurement, columns: dict[int, tuple[Floats, Bools]], _road: RoadMap
) -> Measurement:
    """Write columns (B, 1) of what a sensor of the ego's motion gives, where they changed."""
    values = None if measurement.values is None else measurement.values.copy()
    if values is not None:
        for column, (new, changed) in columns.items():
            values[:, column] = np.where(changed[:, 0], new[:, 0], values[:, column])
    return replace(measurement, values=values)


def write_estimate(
    measurement: Measurement, columns: dict[int, tuple[Floats, Bools]], road: RoadMap
) -> Measurement:
    """Write columns (B, 1) of an ego estimate where they changed; its place on the road follows."""
    if measurement.estimate is None:
        return measurement
    estimate = measurement.estimate.copy()
    moved = np.zeros(estimate.shape[0], dtype=np.bool_)
    for column, (new, changed) in columns.items():
        estimate[:, column] = np.where(changed[:, 0], new[:, 0], estimate[:, column])
        if column in (signals.EGO_X, signals.EGO_Y):
            moved |= changed[:, 0]
    relocate(road, moved, estimate)
    return replace(measurement, estimate=estimate)
