"""The fan of candidates: lateral paths along the road, and speed profiles along them.

A path gives the lateral place over the way along the road, so it can be driven at any speed, also
to standstill. A profile gives way and speed over time. Every profile can be driven on every path.
Path: Werling, Ziegler, Kammel, Thrun (2010), "Optimal trajectory generation for dynamic street
scenarios in a Frenet frame", section IV, with the way as argument, as there for low speeds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_LANE,
    PATH_LENGTH,
    PATH_START,
    PATH_TARGET,
    PEAK,
    at_path,
    lay_path,
)
from adeye.kernel.road import lane_center
from adeye.simulate.channels.driving import lane_at
from adeye.simulate.channels.perception.pose import POSE_ALIGN, POSE_D, POSE_S, POSE_SPEED

if TYPE_CHECKING:
    from adeye.signals import Floats

# --- The fan of candidates: lateral paths along the road, and speed profiles along them -----------

# Lateral paths. Every one may be missing, except the first.
(
    KEEP,  # centre of the lane
    NUDGE_LEFT,  # a little beside it
    NUDGE_RIGHT,
    CHANGE_LEFT,  # lane to the left, without haste
    DODGE_LEFT,  # the same, as quickly as the assumed limits allow
    CHANGE_RIGHT,  # lane to the right, or the shoulder beside the rightmost
    DODGE_RIGHT,
) = range(7)
PATHS: Final = 7

PROFILES: Final = 7
"""Speed profiles, from the emergency deceleration to the largest acceleration."""

CANDIDATES: Final = PATHS * PROFILES

# Columns of the level of a profile.
(
    LEVEL_WANTED,  # acceleration that it leads to [m/s²]
    LEVEL_COST,  # what it costs on any path
) = range(2)
LEVEL_ROW: Final = 2

_SHARE: Final = 0.85
"""Share of the largest lateral acceleration that a quick path is laid out for. Our choice."""

_SETTLING: Final = 2.0
"""Least time of a path within the lane [s]. Our choice."""


@inlined
def set_accelerations(record: Any, levels: Floats) -> None:
    """Write the accelerations that the profiles lead to, in rising order.

    Args:
        record: Has ``comfort_deceleration``, ``emergency_deceleration`` and ``max_acceleration``.
        levels: (PROFILES + 1, LEVEL_ROW) out, but for the last row.
    """
    comfort, largest = record["comfort_deceleration"], record["max_acceleration"]
    emergency = max(comfort, record["emergency_deceleration"])
    levels[0, LEVEL_WANTED] = -emergency
    levels[1, LEVEL_WANTED] = -0.5 * (comfort + emergency)
    levels[2, LEVEL_WANTED] = -comfort
    levels[3, LEVEL_WANTED] = -0.4 * comfort
    levels[4, LEVEL_WANTED] = 0.0
    levels[5, LEVEL_WANTED] = 0.5 * largest
    levels[6, LEVEL_WANTED] = largest


@inlined
def quick_length(record: Any, speed: float, height: float) -> float:
    """Return the length of the shortest path that the assumed limits allow [m].

    Args:
        record: Has ``max_lateral_acceleration`` and ``max_curvature``.
        speed: [m/s].
        height: How far aside it leads [m].
    """
    largest = _SHARE * record["max_lateral_acceleration"]
    bend = _SHARE * record["max_curvature"]
    wide = PEAK * abs(height)
    return max(speed * math.sqrt(wide / largest), math.sqrt(wide / bend))


@inlined
def inside_length(record: Any, speed: float, height: float) -> float:
    """Return the length of a path within the lane, which has time [m]."""
    return max(_SETTLING * speed, quick_length(record, speed, height))


@inlined
def calm_length(record: Any, speed: float, height: float) -> float:
    """Return the length of a lane change without haste [m]."""
    return float(max(record["lane_change_time"] * speed, quick_length(record, speed, height)))


# --- The lateral paths of the fan at one tick, and what their targets cost ------------------------

# Columns of what the planner remembers.
(
    MEMORY_LANE,  # centre of the lane that it drives in or changes to [m], NaN before it drives
    MEMORY_WANTED,  # acceleration that it chose [m/s²]
    MEMORY_COMMAND,  # acceleration that it commanded on the way there [m/s²]
) = range(3)
MEMORY_WIDTH: Final = 3

LOST: Final = 0.6
"""Lateral distance from its own path from which the planner begins anew [m]: somebody else has
driven. Our choice."""

_ONE_PLACE: Final = 0.01
"""Lateral places nearer than this are one target [m]."""


@inlined
def start_of_paths(
    record: Any, pose: Floats, memory: Floats, path: Floats
) -> tuple[float, float, float]:
    """Return the lateral state that the paths begin with: that of the path being driven.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        memory: (MEMORY_WIDTH,) in and out.
        path: (PATH_ROW,) that is being driven.

    Returns:
        Lateral place [m], slope and bend [1/m].
    """
    if not np.isnan(memory[MEMORY_LANE]):
        d, slope, bend = at_path(path, pose[POSE_S] - path[PATH_START])
        if abs(d - pose[POSE_D]) < LOST:
            return d, slope, bend
    lane = lane_at(pose[POSE_D], record["lane_width"], int(record["lanes"]))
    memory[MEMORY_LANE] = lane_center(lane, record["lane_width"])
    # No target is this one, so no path counts as gone on with.
    path[PATH_TARGET] = math.nan
    return pose[POSE_D], sin_cos(pose[POSE_ALIGN])[0], 0.0


@compiled
def lay_paths(
    record: Any,
    pose: Floats,
    memory: Floats,
    driven: Floats,
    paths: Floats,
) -> None:
    """Lay the lateral paths of the fan.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        memory: (MEMORY_WIDTH,) in and out.
        driven: (PATH_ROW,) path that is being driven.
        paths: (PATHS, PATH_ROW) out.
    """
    d, slope, bend = start_of_paths(record, pose, memory, driven)
    center = memory[MEMORY_LANE]
    width = record["lane_width"]
    room = 0.5 * (width - record["width"])
    nudge = min(record["nudge"], max(0.0, room))
    for row in range(PATHS):
        target, lane = center, center
        if row == NUDGE_LEFT:
            target = center + nudge
        elif row == NUDGE_RIGHT:
            target = center - nudge
        elif row in (CHANGE_LEFT, DODGE_LEFT):
            target = lane = center + width
        elif row in (CHANGE_RIGHT, DODGE_RIGHT):
            target = lane = center - width
        if target < 0.0:
            # Beside the rightmost lane: the middle of the shoulder.
            target, lane = -0.5 * record["shoulder"], math.nan
        paths[row, PATH_EXISTS] = 1.0 if _is_on_road(record, row, target, d) else 0.0
        paths[row, PATH_LANE] = lane
        length = _length(record, row, pose[POSE_SPEED], target - d)
        if abs(target - driven[PATH_TARGET]) < _ONE_PLACE:
            # What has been begun is finished as it was begun.
            left = driven[PATH_START] + driven[PATH_LENGTH] - pose[POSE_S]
            length = min(length, left)
        lay_path(paths[row], pose[POSE_S], d, slope, bend, target, length)


@inlined
def _is_on_road(record: Any, row: int, target: float, d: float) -> bool:
    """Tell whether a target can be had: on lanes or shoulder, and no more than a lane away."""
    if row == KEEP:
        return True
    half = 0.5 * record["width"]
    if row in (NUDGE_LEFT, NUDGE_RIGHT) and record["nudge"] <= 0.0:
        return False
    if target < 0.0 and record["shoulder"] < record["width"]:
        return False
    highest = record["lanes"] * record["lane_width"] - half
    return bool(target <= highest and abs(target - d) <= 1.6 * record["lane_width"])


@inlined
def _length(record: Any, row: int, speed: float, height: float) -> float:
    if row in (DODGE_LEFT, DODGE_RIGHT):
        return quick_length(record, speed, height)
    if row in (CHANGE_LEFT, CHANGE_RIGHT):
        return calm_length(record, speed, height)
    return inside_length(record, speed, height)


@compiled
def path_cost(record: Any, path: Floats, row: int, memory: Floats, driven: Floats) -> float:
    """Return what the target of a path costs at any speed.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        path: (PATH_ROW,).
        row: Which path of the fan it is.
        memory: (MEMORY_WIDTH,).
        driven: (PATH_ROW,) path that is being driven.
    """
    cost = 0.0
    if np.isnan(path[PATH_LANE]):
        cost += record["weight_shoulder"]
    else:
        beside = path[PATH_TARGET] - path[PATH_LANE]
        cost += record["weight_offset"] * beside * beside
        if abs(path[PATH_LANE] - memory[MEMORY_LANE]) > _ONE_PLACE:
            cost += record["weight_lane_change"]
    is_kept = abs(path[PATH_TARGET] - driven[PATH_TARGET]) < _ONE_PLACE
    if not is_kept and row != KEEP:
        cost += record["weight_change"]
    return float(cost)
