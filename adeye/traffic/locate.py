"""Find the ego and the objects of a batch on the road."""

from __future__ import annotations

import math

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import lane_center, lane_of, local
from adeye.signals import (
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_LANE,
    PLACE_OFFSET,
    PLACE_S,
    Bools,
    Floats,
)


@inlined
def locate(
    segments: Floats, lane_width: float, lanes: int, x: float, y: float, place: Floats
) -> None:
    """Write the place of a point on the road.

    Args:
        segments: (K, 5) reference line.
        lane_width: [m].
        lanes: Number of lanes.
        x: [m].
        y: [m].
        place: (6,) out, see ``signals.PLACE_COLUMNS``; off the lanes the lane is -1 and the offset
            counts from the nearest one. All NaN if the point is, but for the lane.
    """
    s, d, heading, curvature = local(segments, x, y)
    place[PLACE_S], place[PLACE_D] = s, d
    place[PLACE_HEADING], place[PLACE_CURVATURE] = heading, curvature
    place[PLACE_LANE] = lane_of(d, lane_width, lanes)
    if math.isnan(d):
        place[PLACE_OFFSET] = math.nan
    else:
        nearest = min(max(math.floor(d / lane_width), 0), lanes - 1)
        place[PLACE_OFFSET] = d - lane_center(int(nearest), lane_width)


@compiled
def locate_all(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    running: Bools,
    ego: Floats,
    objects: Floats,
    segments: Floats,
    lane_width: Floats,
    lanes: int,
    ego_place: Floats,
    object_places: Floats,
) -> None:
    """Write the places of ego and objects of all runs that have not ended.

    Args:
        running: (B,).
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        segments: (B, K, 5) reference lines.
        lane_width: (B,) [m].
        lanes: Number of lanes.
        ego_place: (B, 6) out.
        object_places: (B, M, 6) out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        road, width = segments[run], lane_width[run]
        locate(road, width, lanes, ego[run, 0], ego[run, 1], ego_place[run])
        for thing in range(objects.shape[1]):
            x, y = objects[run, thing, 0], objects[run, thing, 1]
            locate(road, width, lanes, x, y, object_places[run, thing])
