"""The lateral shape of sine lanes and the points of polyline lanes.

A polyline is given by its points 1 m apart, rows (CURVE_WIDTH,) of s, x, y, the two components of
the direction to the next point, and its heading; and by the knots that it was drawn through, in
rows of the same form, of which s, x and y count.

Source:
    highway-env 1.12, ``SineLane`` in ``road/lane.py`` and ``road/spline.py``, with y to the left.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan, atan2, cos, sin, sin_cos
from adeye.kernel.jit import compiled, inlined

__all__ = [
    "CURVE_WIDTH",
    "count_points",
    "polyline_heading",
    "polyline_local",
    "polyline_point",
    "sine_heading",
    "sine_offset",
    "write_polyline",
]

Floats = NDArray[np.float64]

S, X, Y, ALONG_X, ALONG_Y, HEADING = range(6)
CURVE_WIDTH: Final = 6


@inlined
def sine_offset(s: float, amplitude: float, pulsation: float, phase: float) -> float:
    """Return how far a sine lane's centre is to the left of its axis [m]."""
    return amplitude * sin(pulsation * s + phase)


@inlined
def sine_heading(s: float, amplitude: float, pulsation: float, phase: float) -> float:
    """Return the direction of a sine lane relative to its axis [rad]."""
    return atan(amplitude * pulsation * cos(pulsation * s + phase))


@compiled
def polyline_local(points: Floats, x: float, y: float) -> tuple[float, float]:
    """Return the place (s, lateral) of a point beside a polyline [m].

    It belongs to the last piece that it is not behind, else to the first.

    Args:
        points: (P, CURVE_WIDTH), P >= 2.
        x: [m].
        y: [m].
    """
    for number in range(points.shape[0] - 1, 0, -1):
        dx = x - points[number, X]
        dy = y - points[number, Y]
        ahead = points[number, ALONG_X] * dx + points[number, ALONG_Y] * dy
        if ahead >= 0.0:
            lateral = points[number, ALONG_X] * dy - points[number, ALONG_Y] * dx
            return points[number, S] + ahead, lateral
    dx = x - points[0, X]
    dy = y - points[0, Y]
    ahead = points[0, ALONG_X] * dx + points[0, ALONG_Y] * dy
    return ahead, points[0, ALONG_X] * dy - points[0, ALONG_Y] * dx


@inlined
def polyline_heading(points: Floats, s: float) -> float:
    """Return the direction of the piece at a place along a polyline [rad]."""
    last = points.shape[0] - 1
    if not s > 0.0:
        return points[0, HEADING]
    if s >= last:
        return points[last, HEADING]
    return points[int(s), HEADING]


@compiled
def polyline_point(points: Floats, knots: Floats, s: float, lateral: float) -> tuple[float, float]:
    """Return the point (x, y) at a place beside a polyline [m]; beyond its ends it goes on.

    Args:
        points: (P, CURVE_WIDTH), P >= 2.
        knots: (Q, CURVE_WIDTH), Q >= 2.
        s: [m].
        lateral: To the left [m].
    """
    k = 0
    while k < knots.shape[0] - 2 and s >= knots[k + 1, S]:
        k += 1
    span = knots[k + 1, S] - knots[k, S]
    share = (s - knots[k, S]) / span
    x = knots[k, X] + (knots[k + 1, X] - knots[k, X]) * share
    y = knots[k, Y] + (knots[k + 1, Y] - knots[k, Y]) * share
    sine, cosine = sin_cos(polyline_heading(points, s))
    return x - sine * lateral, y + cosine * lateral


@compiled
def count_points(knots: Floats) -> int:
    """Return how many points 1 m apart a polyline through knots has.

    Args:
        knots: (Q, 2) x, y.
    """
    length = 0.0
    for k in range(1, knots.shape[0]):
        dx = knots[k, 0] - knots[k - 1, 0]
        dy = knots[k, 1] - knots[k - 1, 1]
        length += math.sqrt(dx * dx + dy * dy)
    return math.floor(length) + 1


@compiled
def write_polyline(knots: Floats, points_out: Floats, knots_out: Floats) -> float:
    """Write the points and knots of a polyline and return its length [m].

    Args:
        knots: (Q, 2) x, y, Q >= 2, no two alike in a row.
        points_out: (``count_points``, CURVE_WIDTH) out, two or more.
        knots_out: (Q, CURVE_WIDTH) out.
    """
    knots_out[:] = 0.0
    s = 0.0
    for k in range(knots.shape[0]):
        if k > 0:
            dx = knots[k, 0] - knots[k - 1, 0]
            dy = knots[k, 1] - knots[k - 1, 1]
            s += math.sqrt(dx * dx + dy * dy)
        knots_out[k, S], knots_out[k, X], knots_out[k, Y] = s, knots[k, 0], knots[k, 1]
    count = points_out.shape[0]
    points_out[:] = 0.0
    for k in range(count):
        points_out[k, S] = k
        points_out[k, X], points_out[k, Y] = polyline_point(points_out, knots_out, float(k), 0.0)
    for k in range(count):
        # The last point looks the way of the one before.
        j = min(k, count - 2)
        dx = points_out[j + 1, X] - points_out[j, X]
        dy = points_out[j + 1, Y] - points_out[j, Y]
        size = math.sqrt(dx * dx + dy * dy)
        points_out[k, ALONG_X], points_out[k, ALONG_Y] = dx / size, dy / size
        points_out[k, HEADING] = atan2(points_out[k, ALONG_Y], points_out[k, ALONG_X])
    return s
