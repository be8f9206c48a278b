"""The fan of candidates: lateral paths along the road, and speed profiles along them.

A path gives the lateral place over the way along the road, so it can be driven at any speed, also
to standstill. A profile gives way and speed over time. Every profile can be driven on every path.
Path: Werling, Ziegler, Kammel, Thrun (2010), "Optimal trajectory generation for dynamic street
scenarios in a Frenet frame", section IV, with the way as argument, as there for low speeds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from adeye.kernel.jit import inlined
from adeye.kernel.profiles import PEAK

if TYPE_CHECKING:
    from adeye.signals import Floats

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
