"""Where a signal is in a measurement: how it is read, and written back so that all else fits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.faults.lists import Seat, indices_of, with_rows
from adeye.faults.places import relocate, turned
from adeye.signals import (
    DETECTION_HAS_RANGE_RATE,
    DETECTION_X,
    DETECTION_Y,
    EGO_X,
    EGO_Y,
    POINT_BEARING,
    POINT_RANGE,
)
from adeye.spec.faults.sensing import SIGNALS

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.signals import Bools, Floats, Ints, Measurement, RoadMap

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
    column = POINT_RANGE if signal == "range" else POINT_BEARING
    beams = np.arange(points.shape[1])

    def write(given: Measurement, new: Floats, changed: Bools, _road: RoadMap) -> Measurement:
        moved = points.copy()
        moved[:, :, column] = np.where(changed, new, points[:, :, column])
        # A range of 0 says that nothing came back.
        return without_points(
            replace(given, points=moved), changed & (moved[:, :, POINT_RANGE] == 0.0)
        )

    return Place(
        points[:, :, column],
        points[:, :, POINT_RANGE] > 0.0,
        np.broadcast_to(beams, points.shape[:2]),
        least,
        write,
    )


def without_points(measurement: Measurement, lost: Bools) -> Measurement:
    """Return a measurement without the returns of some beams (B, P); itself if none is lost."""
    if measurement.points is None or measurement.hits is None:
        return measurement
    lost = lost & ((measurement.points[:, :, POINT_RANGE] != 0.0) | (measurement.hits >= 0))
    if not lost.any():
        return measurement
    points, hits = measurement.points.copy(), measurement.hits.copy()
    points[lost, POINT_RANGE] = 0.0
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
        there = there & (rows[:, :, DETECTION_HAS_RANGE_RATE] > 0.0)

    def write(given: Measurement, new: Floats, changed: Bools, _road: RoadMap) -> Measurement:
        moved = rows.copy()
        if signal in ("range", "bearing"):
            dx, dy = seat.away(rows)
            with np.errstate(all="ignore"):
                x, y = _polar(signal, dx, dy, values, new)
            moved[:, :, DETECTION_X] = np.where(changed, seat.x + x, rows[:, :, DETECTION_X])
            moved[:, :, DETECTION_Y] = np.where(changed, seat.y + y, rows[:, :, DETECTION_Y])
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
        if column in (EGO_X, EGO_Y):
            moved |= changed[:, 0]
    relocate(road, moved, estimate)
    return replace(measurement, estimate=estimate)
