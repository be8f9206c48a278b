"""Small made-up contexts and measurements: a road, a car, objects seen without error."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from adeye import signals as columns
from adeye.ports import ChannelContext
from adeye.signals import Floats, Measurement, RoadMap
from adeye.simulate.traffic.stage import locate_all
from adeye.spec.architecture import Vehicle


def passenger_car() -> Vehicle:
    """Return a compact car with brakes and steering of common quickness."""
    return Vehicle.model_validate(
        {
            "length": "4.5 m",
            "width": "1.8 m",
            "height": "1.5 m",
            "wheelbase": "2.7 m",
            "max_acceleration": "3 m/s^2",
            "max_deceleration": "9 m/s^2",
            "max_steering_angle": "35 deg",
            "max_steering_rate": "40 deg/s",
            "acceleration_lag": "0.15 s",
            "steering_lag": "0.1 s",
        }
    )


def straight_road(runs: int = 1, *, lanes: int = 3, curvature: float = 0.0) -> RoadMap:
    """Return one long segment with lanes of 3.5 m, a shoulder and 130 km/h.

    Args:
        runs: B.
        lanes: Number of lanes.
        curvature: Of the reference line [1/m].
    """
    segments = np.zeros((runs, 1, 5))
    segments[:, 0, 3] = 3000.0 if curvature == 0.0 else 0.9 * math.pi / abs(curvature)
    segments[:, 0, 4] = curvature
    return RoadMap(
        segments,
        np.full(runs, 3.5),
        lanes,
        np.full(runs, 2.5),
        np.full(runs, 130.0 / 3.6),
        np.zeros(runs),
        np.zeros((runs, 0, len(columns.REFUGE_COLUMNS))),
        segments[:, 0, 3],
    )


def channel_context(  # noqa: PLR0913 - each is one thing that a test may want to set
    parameters: Any,
    *,
    links: Sequence[str],
    sensors: Mapping[str, str],
    runs: int = 1,
    channel_id: str = "tested",
    road: RoadMap | None = None,
    desired_speed: float | Floats = 30.0,
    step: float = 0.05,
    every: int = 1,
) -> ChannelContext:
    """Return what a channel is built with.

    Args:
        parameters: The parameter record, the same for every run; or a list of B of them.
        links: Ids of what is linked to it.
        sensors: Kind of each linked sensor, by id.
        runs: B.
        channel_id: Its name.
        road: The map; a straight road unless given.
        desired_speed: [m/s], one or (B,).
        step: Master clock [s].
        every: Ticks between two of its ticks.
    """
    listed = parameters if isinstance(parameters, list) else [parameters] * runs
    return ChannelContext(
        channel_id=channel_id,
        parameters=listed,
        links=tuple(links),
        sensors=dict(sensors),
        mounts={},
        vehicles=[passenger_car()] * runs,
        road=road or straight_road(runs),
        desired_speed=np.broadcast_to(np.asarray(desired_speed, dtype=np.float64), (runs,)).copy(),
        step=step,
        period=every * step,
    )


def ego_estimate(road: RoadMap, ego: Floats) -> Floats:
    """Return the ego estimate without error that belongs to ego states.

    Args:
        road: The road of each run.
        ego: (B, 7).

    Returns:
        (B, 13), see ``signals.ESTIMATE_COLUMNS``.
    """
    states = np.array(ego, dtype=np.float64, order="C")
    runs, place = len(states), np.zeros((len(states), len(columns.PLACE_COLUMNS)))
    nobody = np.zeros((runs, 0, len(columns.OBJECT_COLUMNS))), np.zeros((runs, 0, place.shape[1]))
    everyone, near = np.ones(runs, dtype=np.bool_), np.zeros((runs, 1), dtype=np.int64)
    unknown = np.zeros((runs, 0, 6))
    locate_all(everyone, states, nobody[0], road.grounds(), unknown, near, place, nobody[1])
    return np.concatenate([states, place], axis=1)


def pose_measurement(road: RoadMap, ego: Floats, stamp: float) -> Measurement:
    """Return what a localisation without error delivers.

    Args:
        road: The road of each run.
        ego: (B, 7).
        stamp: Time of the sample [s].
    """
    return object_measurement(ego, np.zeros((ego.shape[0], 0, 5)), stamp, road=road)


def object_measurement(  # noqa: PLR0913 - a sensor has that many properties
    ego: Floats,
    objects: Floats,
    stamp: float,
    *,
    road: RoadMap | None = None,
    size: tuple[float, float] = (4.5, 1.8),
    object_class: int = 0,
    sight: float = math.inf,
) -> Measurement:
    """Return what a sensor without error that sees everything within a range delivers.

    Args:
        ego: (B, 7).
        objects: (B, M, 5).
        stamp: Time of the sample [s].
        road: The road of each run, for a sensor that gives an ego estimate as well.
        size: Length and width of every object [m].
        object_class: Of every object.
        sight: Range to an object's centre [m].
    """
    runs, count = objects.shape[:2]
    mask = np.zeros((runs, count), dtype=np.bool_)
    detections = np.zeros((runs, count, len(columns.DETECTION_COLUMNS)))
    source = np.full((runs, count), -1, dtype=np.int64)
    for run in range(runs):
        rows = [_detection(ego[run], item, size, object_class) for item in objects[run]]
        seen = [
            (row, number) for number, row in enumerate(rows) if math.hypot(row[0], row[1]) <= sight
        ]
        seen.sort(key=lambda pair: math.hypot(pair[0][0], pair[0][1]))
        for place, (row, number) in enumerate(seen):
            mask[run, place], detections[run, place], source[run, place] = True, row, number
    return Measurement(
        np.full(runs, stamp),
        np.ones(runs, dtype=np.bool_),
        np.ones(runs, dtype=np.bool_),
        mask,
        detections,
        source,
        None if road is None else ego_estimate(road, ego),
    )


def _detection(
    ego: Floats, item: Floats, size: tuple[float, float], object_class: int
) -> list[float]:
    dx = item[columns.OBJECT_X] - ego[columns.EGO_X]
    dy = item[columns.OBJECT_Y] - ego[columns.EGO_Y]
    cos, sin = math.cos(ego[columns.EGO_HEADING]), math.sin(ego[columns.EGO_HEADING])
    heading, speed = item[columns.OBJECT_HEADING], item[columns.OBJECT_SPEED]
    vx = speed * math.cos(heading) - ego[columns.EGO_SPEED] * cos
    vy = speed * math.sin(heading) - ego[columns.EGO_SPEED] * sin
    distance = math.hypot(dx, dy)
    rate = (vx * dx + vy * dy) / distance if distance > 0.0 else 0.0
    return [
        cos * dx + sin * dy,
        -sin * dx + cos * dy,
        rate,
        1.0,
        size[0],
        size[1],
        float(object_class),
    ]
