"""A parametric road: a reference line of straight and circular segments, and places beside it.

A road is an array (K, 5) with one row per segment, driven in order: x [m], y [m] and heading [rad]
of its start, length [m], curvature [1/m] (positive turns left). The reference line is the right
edge of lane 0. A place is (s, d): s [m] along the line, d [m] to the left of it, so the centre of
lane i is at ``d = (i + 0.5) * lane_width``. Before its start the first segment goes on backwards,
past its end the last one goes on.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.geometry import wrap_to_pi
from adeye.kernel.jit import compiled, inlined

__all__ = [
    "lane_center",
    "lane_of",
    "lane_way",
    "local",
    "offset_curvature",
    "position",
    "road_length",
]

Floats = NDArray[np.float64]

#: Curvature [1/m] below which a segment counts as straight; it bends by 5e-10 m over 1 km.
STRAIGHTEST = 1e-15


@compiled
def road_length(segments: Floats) -> float:
    """Return the length of the reference line [m].

    Args:
        segments: (K, 5), see the module.
    """
    length = 0.0
    for k in range(segments.shape[0]):
        length += segments[k, 3]
    return length


@inlined
def position(segments: Floats, s: float, d: float) -> tuple[float, float, float]:
    """Return the point at a place on the road and the road's heading there.

    Args:
        segments: (K, 5), K >= 1, see the module.
        s: Along the reference line [m], any number.
        d: To the left of it [m].

    Returns:
        x [m], y [m], heading in (-pi, pi] [rad].
    """
    last = segments.shape[0] - 1
    k = 0
    while k < last and s > segments[k, 3]:
        s -= segments[k, 3]
        k += 1
    heading = segments[k, 2]
    curvature = segments[k, 4]
    half_turn = 0.5 * curvature * s
    chord = s
    if abs(curvature) > STRAIGHTEST:
        chord = 2.0 * sin_cos(half_turn)[0] / curvature
    # The chord of an arc points half-way between the headings of its ends.
    sine, cosine = sin_cos(wrap_to_pi(heading + half_turn))
    x = segments[k, 0] + chord * cosine
    y = segments[k, 1] + chord * sine
    heading = wrap_to_pi(heading + 2.0 * half_turn)
    sine, cosine = sin_cos(heading)
    return x - d * sine, y + d * cosine, heading


@inlined
def _project(along: float, across: float, length: float, curvature: float) -> tuple[float, float]:
    """Return (s, d) of a point given in the frame of a segment's start, without bounds on s."""
    if abs(curvature) <= STRAIGHTEST:
        return along, across
    bend = abs(curvature)
    radius = 1.0 / bend
    # Mirrored, if need be, so that the centre of the circle lies to the left.
    left = across if curvature > 0.0 else -across
    to_center = radius - left
    # A full turn is ambiguous: take the one around the middle of the segment.
    middle = 0.5 * bend * length
    angle = middle + wrap_to_pi(atan2(along, to_center) - middle)
    distance = math.sqrt(along * along + to_center * to_center)
    # The radius minus the distance, without the cancellation on wide curves.
    inward = (left * (radius + to_center) - along * along) / (radius + distance)
    return angle * radius, inward if curvature > 0.0 else -inward


@inlined
def local(segments: Floats, x: float, y: float) -> tuple[float, float, float, float]:
    """Return the place of a point on the road: the nearest on the reference line.

    Args:
        segments: (K, 5), K >= 1, see the module.
        x: [m].
        y: [m].

    Returns:
        s [m], d [m], heading of the road there in (-pi, pi] [rad], its curvature [1/m]. All NaN if
        the point is. Unique for points nearer to the line than its radius, on arcs of less than a
        full turn.
    """
    if math.isnan(x + y):
        return math.nan, math.nan, math.nan, math.nan
    last = segments.shape[0] - 1
    nearest = math.inf
    best_s = best_d = best_heading = best_curvature = math.nan
    before = 0.0
    for k in range(last + 1):
        heading, length, curvature = segments[k, 2], segments[k, 3], segments[k, 4]
        sine, cosine = sin_cos(heading)
        dx = x - segments[k, 0]
        dy = y - segments[k, 1]
        s, d = _project(dx * cosine + dy * sine, dy * cosine - dx * sine, length, curvature)
        overshoot = 0.0
        if s < 0.0 and k > 0:
            overshoot = -s
        elif s > length and k < last:
            overshoot = s - length
        distance = d * d + overshoot * overshoot
        if distance < nearest:
            nearest = distance
            best_s = before + s
            best_d = d
            best_heading = heading + curvature * s
            best_curvature = curvature
        before += length
    return best_s, best_d, wrap_to_pi(best_heading), best_curvature


@inlined
def offset_curvature(curvature: float, d: float) -> float:
    """Return the curvature [1/m] of the line that runs beside a reference line.

    Args:
        curvature: Of the reference line [1/m].
        d: Distance to the left of it [m], less than the radius of a left curve.

    Returns:
        ``curvature / (1 - curvature d)``; NaN on and beyond the centre of the curve.
    """
    scale = 1.0 - curvature * d
    return curvature / scale if scale > 0.0 else math.nan


@compiled
def lane_way(s: float, heading: float, d: float, other_s: float, other_heading: float) -> float:
    """Return the way to another place along the lane that a vehicle drives [m], < 0 behind it.

    The line keeps the vehicle's distance d to the reference line. Where that turns by an angle, the
    line is shorter by d times it, whatever the arcs, so that the way is exact with straights and
    bends between; on a straight it is the difference of s to the last bit. At the centre of a bend
    no way is left.

    Args:
        s: Of the vehicle along the reference line [m].
        heading: Of the road there [rad].
        d: Of the vehicle, to the left of the reference line [m].
        other_s: Of the other place [m].
        other_heading: Of the road there [rad]; turned by less than a half turn.
    """
    along = other_s - s
    if other_heading == heading:
        return along
    way = along - d * wrap_to_pi(other_heading - heading)
    return math.copysign(0.0, along) if way * along < 0.0 else way


@inlined
def lane_center(lane: int, lane_width: float) -> float:
    """Return d of a lane's centre [m]; lane 0 is the rightmost."""
    return (lane + 0.5) * lane_width


@inlined
def lane_of(d: float, lane_width: float, lanes: int) -> int:
    """Return the lane that a point is in, 0 at the right; -1 off the lanes or for NaN.

    Args:
        d: To the left of the right edge [m]; an edge between two lanes belongs to the left one.
        lane_width: > 0 [m].
        lanes: How many there are.
    """
    if not 0.0 <= d < lanes * lane_width:
        return -1
    lane = int(d / lane_width)
    # The division may round up to the far edge.
    return lane if lane < lanes else lanes - 1
