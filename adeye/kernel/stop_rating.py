"""How safe a place is to stand in: an ordinal scale, cell by cell.

The worst cell under a body counts. The planner of safe stops, the evaluation of a trace and the
picture of the grid map all call these functions, so they cannot disagree.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.refuges import refuge_depth
from adeye.kernel.road import lane_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

SCALE: Final = (
    "refuge or parking place",
    "hard shoulder",
    "free verge",
    "slow lane with sight distance",
    "slow lane",
    "fast lane",
    "curve, crest, tunnel, bridge, ramp or junction",
    "obstructing",
    "contact",
)
"""The scale in words, from the safest place to contact. Our choice."""

CONTACT: Final = 8.0
"""Rating of a place that is occupied."""

# Kinds of places that a road of this kind has, in the order of the table of rules.
(
    RULE_REFUGE,
    RULE_SHOULDER,
    RULE_VERGE,
    RULE_SLOW_LANE_IN_SIGHT,
    RULE_SLOW_LANE,
    RULE_FAST_LANE,
    RULE_CURVE,
    RULE_OFF_ROAD,
) = range(8)
RULES: Final = 8

RULE_NAMES: Final = (
    "refuge",
    "hard_shoulder",
    "verge",
    "slow_lane_in_sight",
    "slow_lane",
    "fast_lane",
    "curve",
    "off_road",
)
"""Names of these kinds."""

DEFAULT_RULES: Final = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
"""What each is rated. Ground beside lanes and shoulder of which the map says nothing is not taken
for a free verge."""

CELL: Final = 0.5
"""Largest edge of a cell [m]."""

_CALM: Final = (1.0, 4.0)
_BRISK: Final = (0.5, 5.0)
"""Reaction time [s] and deceleration [m/s²] of who comes from behind: one who need not hurry, one
who must. Our choice."""


@inlined
def stopping_distance(speed: float, reaction: float, deceleration: float) -> float:
    """Return the way from seeing something to standstill [m]."""
    return speed * reaction + speed * speed / (2.0 * deceleration)


@inlined
def sight_distance(curvature: float, inside: float) -> float:
    """Return how far a driver sees along a curve if the view ends at the inner edge of the road.

    Args:
        curvature: Of the driver's line [1/m].
        inside: From this line to the edge on the inside of the curve [m].

    Returns:
        Along the line [m], infinity on a straight.

    Source:
        AASHTO (2018), "A Policy on Geometric Design of Highways and Streets", horizontal sightline
        offset, for small angles: offset = distance² / (8 radius).
    """
    bend = abs(curvature)
    return math.sqrt(8.0 * max(0.0, inside) / bend) if bend > 0.0 else math.inf


@inlined
def curvature_at(segments: Floats, s: float) -> float:
    """Return the curvature of a reference line [1/m].

    Args:
        segments: (K, 5), see ``kernel.road``.
        s: Along it [m].
    """
    last = segments.shape[0] - 1
    k = 0
    while k < last and s > segments[k, 3]:
        s -= segments[k, 3]
        k += 1
    return float(segments[k, 4])


@inlined
def place_kind(
    curvature: float,
    d: float,
    lane_width: float,
    lanes: int,
    shoulder: float,
    depth: float,
    verge: float,
    speed_limit: float,
) -> int:
    """Return what kind of place a cell is, an index into the rules.

    Args:
        curvature: Of the reference line there [1/m].
        d: From the right edge to the left [m].
        lane_width: [m].
        lanes: How many there are.
        shoulder: Width beside the right edge [m].
        depth: How far a refuge reaches beyond the shoulder there [m].
        verge: Width of free ground beside the shoulder [m].
        speed_limit: Of who comes from behind [m/s].
    """
    if not -shoulder - max(depth, verge) <= d <= lanes * lane_width:
        return RULE_OFF_ROAD
    if d < -shoulder:
        return RULE_REFUGE if d >= -shoulder - depth else RULE_VERGE
    if d < 0.0:
        return RULE_SHOULDER
    return _lane_kind(curvature, d, lane_width, lanes, shoulder, speed_limit)


@inlined
def _lane_kind(
    curvature: float, d: float, lane_width: float, lanes: int, shoulder: float, speed_limit: float
) -> int:
    """Return what kind of place a cell in a lane is; see ``place_kind``."""
    lane = max(0, lane_of(d, lane_width, lanes))
    middle = (lane + 0.5) * lane_width
    inside = lanes * lane_width - middle if curvature > 0.0 else middle + shoulder
    sight = sight_distance(curvature, inside)
    if sight < stopping_distance(speed_limit, _BRISK[0], _BRISK[1]):
        return RULE_CURVE
    if lane > 0:
        return RULE_FAST_LANE
    if sight < stopping_distance(speed_limit, _CALM[0], _CALM[1]):
        return RULE_SLOW_LANE
    return RULE_SLOW_LANE_IN_SIGHT


@compiled
def rate_footprint(
    rules: Floats,
    segments: Floats,
    refuges: Floats,
    s: float,
    d: float,
    slope: float,
    length: float,
    width: float,
    lane_width: float,
    lanes: int,
    shoulder: float,
    verge: float,
    speed_limit: float,
) -> float:
    """Return the rating of standing somewhere: that of the worst cell under the body.

    Road coordinates are taken as straight over the length of the body.

    Args:
        rules: (RULES,) rating of each kind of place.
        segments: (K, 5) reference line of the road.
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
        s: Of the centre of the body along the road [m].
        d: From the right edge to the left [m].
        slope: Tangent of the heading against the road's.
        length: Of the body [m].
        width: [m].
        lane_width: [m].
        lanes: How many there are.
        shoulder: Width beside the right edge [m].
        verge: Width of free ground beside the shoulder [m].
        speed_limit: [m/s].
    """
    along, across = math.ceil(length / CELL), math.ceil(width / CELL)
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    sine = slope * cosine
    worst = 0.0
    for i in range(along + 1):
        x = length * (i / along - 0.5)
        for j in range(across + 1):
            y = width * (j / across - 0.5)
            place = s + cosine * x - sine * y
            kind = place_kind(
                curvature_at(segments, place),
                d + sine * x + cosine * y,
                lane_width,
                lanes,
                shoulder,
                refuge_depth(refuges, place),
                verge,
                speed_limit,
            )
            worst = max(worst, rules[kind])
    return worst
