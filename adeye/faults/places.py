"""Turning and locating whole arrays, with the same bits on every processor."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import compiled
from adeye.signals import (
    EGO_X,
    EGO_Y,
    ESTIMATE_PLACE,
    PLACE_LANE,
    POINT_BEARING,
    POINT_ELEVATION,
    POINT_RANGE,
    Bools,
    Floats,
    RoadMap,
)
from adeye.traffic.locate import locate

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
    _relocate(road.segments, road.lane_width, road.lanes, runs, estimate)


def shift_points(points: Floats, runs: Bools, yaw: Floats, x: Floats, y: Floats) -> None:
    """Move the returns of lidars as a turned and shifted sensor sees them.

    Args:
        points: (B, P, 3) in and out.
        runs: (B,) in which.
        yaw: (B, 1) how far the sensor is turned to the left [rad].
        x: (B, 1) how far it is ahead of its place [m].
        y: (B, 1) how far to the left [m].
    """
    _shift_points(points, runs, yaw, x, y)


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
def _relocate(
    segments: Floats, lane_width: Floats, lanes: int, runs: Bools, estimate: Floats
) -> None:
    for run in range(estimate.shape[0]):
        if not runs[run]:
            continue
        x, y = estimate[run, EGO_X], estimate[run, EGO_Y]
        place = estimate[run, ESTIMATE_PLACE:]
        if abs(x) <= FARTHEST and abs(y) <= FARTHEST:
            locate(segments[run], lane_width[run], lanes, x, y, place)
        else:
            place[:] = math.nan
            place[PLACE_LANE] = -1.0


@compiled
def _shift_points(points: Floats, runs: Bools, yaw: Floats, x: Floats, y: Floats) -> None:
    for run in range(points.shape[0]):
        if not runs[run]:
            continue
        for beam in range(points.shape[1]):
            point = points[run, beam]
            if not point[POINT_RANGE] > 0.0:
                continue
            if x[run, 0] != 0.0 or y[run, 0] != 0.0:
                s, c = sin_cos(point[POINT_BEARING])
                rise, level = sin_cos(point[POINT_ELEVATION])
                height = point[POINT_RANGE] * rise
                along = point[POINT_RANGE] * level * c - x[run, 0]
                across = point[POINT_RANGE] * level * s - y[run, 0]
                way = math.sqrt(along * along + across * across)
                point[POINT_RANGE] = math.sqrt(way * way + height * height)
                point[POINT_BEARING] = atan2(across, along)
                point[POINT_ELEVATION] = atan2(height, way)
            point[POINT_BEARING] -= yaw[run, 0]
