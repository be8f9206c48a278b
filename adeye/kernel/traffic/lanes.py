"""Lanes as rows of numbers: straight, circular, sine and polyline, and places beside their centre.

A lane is a row (LANE_WIDTH,). A place is (s, lateral): s [m] along its centre from its start, and
how far to the left of the centre [m]. What does not fit into a row stands in ``curves``, the points
of all polylines of a network. Networks of straight and circular lanes pass None for it; the
compiler then leaves the other kinds out.

Source:
    Formulas and their order are those of highway-env 1.12 (``road/lane.py``), with y to the left.

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

# --- The lateral shape of sine lanes and the points of polyline lanes -----------------------------

Floats = NDArray[np.float64]

KNOT_S, KNOT_X, KNOT_Y, ALONG_X, ALONG_Y, KNOT_HEADING = range(6)
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
        dx = x - points[number, KNOT_X]
        dy = y - points[number, KNOT_Y]
        ahead = points[number, ALONG_X] * dx + points[number, ALONG_Y] * dy
        if ahead >= 0.0:
            lateral = points[number, ALONG_X] * dy - points[number, ALONG_Y] * dx
            return points[number, KNOT_S] + ahead, lateral
    dx = x - points[0, KNOT_X]
    dy = y - points[0, KNOT_Y]
    ahead = points[0, ALONG_X] * dx + points[0, ALONG_Y] * dy
    return ahead, points[0, ALONG_X] * dy - points[0, ALONG_Y] * dx


@inlined
def polyline_heading(points: Floats, s: float) -> float:
    """Return the direction of the piece at a place along a polyline [rad]."""
    last = points.shape[0] - 1
    if not s > 0.0:
        return points[0, KNOT_HEADING]
    if s >= last:
        return points[last, KNOT_HEADING]
    return points[int(s), KNOT_HEADING]


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
    while k < knots.shape[0] - 2 and s >= knots[k + 1, KNOT_S]:
        k += 1
    span = knots[k + 1, KNOT_S] - knots[k, KNOT_S]
    share = (s - knots[k, KNOT_S]) / span
    x = knots[k, KNOT_X] + (knots[k + 1, KNOT_X] - knots[k, KNOT_X]) * share
    y = knots[k, KNOT_Y] + (knots[k + 1, KNOT_Y] - knots[k, KNOT_Y]) * share
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
        knots_out[k, KNOT_S], knots_out[k, KNOT_X], knots_out[k, KNOT_Y] = (
            s,
            knots[k, 0],
            knots[k, 1],
        )
    count = points_out.shape[0]
    points_out[:] = 0.0
    for k in range(count):
        points_out[k, KNOT_S] = k
        points_out[k, KNOT_X], points_out[k, KNOT_Y] = polyline_point(
            points_out, knots_out, float(k), 0.0
        )
    for k in range(count):
        # The last point looks the way of the one before.
        j = min(k, count - 2)
        dx = points_out[j + 1, KNOT_X] - points_out[j, KNOT_X]
        dy = points_out[j + 1, KNOT_Y] - points_out[j, KNOT_Y]
        size = math.sqrt(dx * dx + dy * dy)
        points_out[k, ALONG_X], points_out[k, ALONG_Y] = dx / size, dy / size
        points_out[k, KNOT_HEADING] = atan2(points_out[k, ALONG_Y], points_out[k, ALONG_X])
    return s


# --- Lanes as rows of numbers: straight, circular, sine and polyline, and places beside their
# centre.

# Columns of a lane. X and Y are its start, of an arc the centre of its circle.
(
    KIND,
    LANE_X,
    LANE_Y,
    LANE_HEADING,
    LANE_COSINE,
    LANE_SINUS,
    LANE_LENGTH,
    WIDTH,
    LIMIT,
    FORBIDDEN,
    RADIUS,
    PHASE,
    TURN,
    AMPLITUDE,
    PULSATION,
    FIRST_POINT,
    POINTS,
    FIRST_KNOT,
    KNOTS,
    LEAST_X,
    MOST_X,
    LEAST_Y,
    MOST_Y,
    ALONGSIDE,
) = range(24)
LANE_WIDTH: Final = 24
"""Columns of a lane. ``LIMIT`` is its speed limit [m/s], inf for none; ``TURN`` of an arc is 1 to
the left and -1 to the right; four are a box around the centre line, for quick looks; the last says
that all lanes are side by side on one straight road, see ``network.mark_alongside``."""

STRAIGHT, ARC, SINE, POLYLINE = 0.0, 1.0, 2.0, 3.0

OVERHANG: Final = 5.0
"""How far before its start and past its end something still counts as on a lane [m]."""


@inlined
def wrapped(angle: float) -> float:
    """Return the same direction in [-pi, pi) [rad], rounded as ``(angle + pi) % (2 pi) - pi``."""
    turned = angle + math.pi
    if not 0.0 <= turned < 2.0 * math.pi:
        turned %= 2.0 * math.pi
    return turned - math.pi


@inlined
def _arc_local(
    dx: float, dy: float, radius: float, phase: float, turn: float
) -> tuple[float, float]:
    """Return the place beside an arc of a point given from the centre of its circle."""
    phi = phase + wrapped(atan2(dy, dx) - phase)
    return turn * (phi - phase) * radius, turn * (radius - math.sqrt(dx * dx + dy * dy))


@inlined
def straight_local(lanes: Floats, lane: int, x: float, y: float) -> tuple[float, float]:
    """Return the place (s, lateral) of a point beside the straight line of a lane's row [m]."""
    dx = x - lanes[lane, LANE_X]
    dy = y - lanes[lane, LANE_Y]
    s = dx * lanes[lane, LANE_COSINE] + dy * lanes[lane, LANE_SINUS]
    return s, dy * lanes[lane, LANE_COSINE] - dx * lanes[lane, LANE_SINUS]


@inlined
def lane_local(
    lanes: Floats, lane: int, curves: Floats | None, x: float, y: float
) -> tuple[float, float]:
    """Return the place (s, lateral) of a point beside a lane [m].

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        curves: (P, CURVE_WIDTH) points of the polylines, None without any.
        x: [m].
        y: [m].
    """
    dx = x - lanes[lane, LANE_X]
    dy = y - lanes[lane, LANE_Y]
    s = dx * lanes[lane, LANE_COSINE] + dy * lanes[lane, LANE_SINUS]
    lateral = dy * lanes[lane, LANE_COSINE] - dx * lanes[lane, LANE_SINUS]
    if lanes[lane, KIND] == ARC:
        s, lateral = _arc_local(dx, dy, lanes[lane, RADIUS], lanes[lane, PHASE], lanes[lane, TURN])
    if curves is not None:
        if lanes[lane, KIND] == POLYLINE:
            first = int(lanes[lane, FIRST_POINT])
            s, lateral = polyline_local(curves[first : first + int(lanes[lane, POINTS])], x, y)
        elif lanes[lane, KIND] == SINE:
            lateral -= sine_offset(
                s, lanes[lane, AMPLITUDE], lanes[lane, PULSATION], lanes[lane, PHASE]
            )
    return s, lateral


@inlined
def lane_heading(lanes: Floats, lane: int, curves: Floats | None, s: float) -> float:
    """Return the direction of a lane at a place along it [rad], not wrapped.

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        curves: As for ``lane_local``.
        s: [m].
    """
    heading = lanes[lane, LANE_HEADING]
    if lanes[lane, KIND] == ARC:
        turn = lanes[lane, TURN]
        heading = turn * s / lanes[lane, RADIUS] + lanes[lane, PHASE] + math.pi / 2.0 * turn
    if curves is not None:
        if lanes[lane, KIND] == POLYLINE:
            first = int(lanes[lane, FIRST_POINT])
            heading = polyline_heading(curves[first : first + int(lanes[lane, POINTS])], s)
        elif lanes[lane, KIND] == SINE:
            heading += sine_heading(
                s, lanes[lane, AMPLITUDE], lanes[lane, PULSATION], lanes[lane, PHASE]
            )
    return heading


@inlined
def lane_point(
    lanes: Floats, lane: int, curves: Floats | None, s: float, lateral: float
) -> tuple[float, float]:
    """Return the point (x, y) at a place beside a lane [m].

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        curves: As for ``lane_local``.
        s: [m].
        lateral: To the left of the centre [m].
    """
    if lanes[lane, KIND] == ARC:
        sine, cosine = sin_cos(lanes[lane, TURN] * s / lanes[lane, RADIUS] + lanes[lane, PHASE])
        reach = lanes[lane, RADIUS] - lateral * lanes[lane, TURN]
        return lanes[lane, LANE_X] + reach * cosine, lanes[lane, LANE_Y] + reach * sine
    if curves is not None:
        if lanes[lane, KIND] == POLYLINE:
            first, knot = int(lanes[lane, FIRST_POINT]), int(lanes[lane, FIRST_KNOT])
            return polyline_point(
                curves[first : first + int(lanes[lane, POINTS])],
                curves[knot : knot + int(lanes[lane, KNOTS])],
                s,
                lateral,
            )
        if lanes[lane, KIND] == SINE:
            lateral += sine_offset(
                s, lanes[lane, AMPLITUDE], lanes[lane, PULSATION], lanes[lane, PHASE]
            )
    x = lanes[lane, LANE_X] + s * lanes[lane, LANE_COSINE] - lateral * lanes[lane, LANE_SINUS]
    return x, lanes[lane, LANE_Y] + s * lanes[lane, LANE_SINUS] + lateral * lanes[lane, LANE_COSINE]


@inlined
def is_on_lane(lanes: Floats, lane: int, s: float, lateral: float, margin: float) -> bool:
    """Tell whether a place lies on a lane widened by a margin [m] to either side."""
    return (
        abs(lateral) <= lanes[lane, WIDTH] / 2.0 + margin
        and -OVERHANG <= s < lanes[lane, LANE_LENGTH] + OVERHANG
    )


@inlined
def is_reachable(lanes: Floats, lane: int, s: float, lateral: float) -> bool:
    """Tell whether one may change to a lane from a place beside it."""
    return (
        lanes[lane, FORBIDDEN] == 0.0
        and abs(lateral) <= 2.0 * lanes[lane, WIDTH]
        and 0.0 <= s < lanes[lane, LANE_LENGTH] + OVERHANG
    )


@inlined
def distance_to_lane(lanes: Floats, lane: int, s: float, lateral: float) -> float:
    """Return how far a place is from the centre line, along plus across [m]."""
    return abs(lateral) + max(s - lanes[lane, LANE_LENGTH], 0.0) + max(0.0 - s, 0.0)


@inlined
def least_distance(lanes: Floats, lane: int, x: float, y: float) -> float:
    """Return a distance [m] that a point has at least from a lane; cheap, and often far too low.

    Never above ``distance_to_lane`` of its place, nor above what a place on the lane's margin and
    overhang has, but for rounding.
    """
    dx = max(lanes[lane, LEAST_X] - x, x - lanes[lane, MOST_X])
    return max(dx, lanes[lane, LEAST_Y] - y, y - lanes[lane, MOST_Y])


@compiled
def write_straight(
    lane: Floats, x: float, y: float, heading: float, length: float, width: float, limit: float
) -> None:
    """Write a straight lane.

    Args:
        lane: (LANE_WIDTH,) out.
        x: Of its start [m].
        y: Of its start [m].
        heading: [rad].
        length: [m].
        width: [m].
        limit: Speed limit [m/s], inf for none.
    """
    lane[:] = 0.0
    lane[KIND], lane[LANE_X], lane[LANE_Y], lane[LANE_HEADING] = STRAIGHT, x, y, heading
    lane[LANE_SINUS], lane[LANE_COSINE] = sin_cos(heading)
    lane[LANE_LENGTH], lane[WIDTH], lane[LIMIT] = length, width, limit
    _bound(lane, x, y, x + length * lane[LANE_COSINE], y + length * lane[LANE_SINUS], 0.0)


@compiled
def write_arc(
    lane: Floats,
    x: float,
    y: float,
    radius: float,
    phase: float,
    turn: float,
    length: float,
    width: float,
    limit: float,
) -> None:
    """Write a circular lane.

    Args:
        lane: (LANE_WIDTH,) out.
        x: Of the centre [m].
        y: Of the centre [m].
        radius: > 0 [m].
        phase: Direction of its start as seen from the centre [rad].
        turn: 1 to the left, -1 to the right.
        length: [m].
        width: [m].
        limit: Speed limit [m/s], inf for none.
    """
    lane[:] = 0.0
    lane[KIND], lane[LANE_X], lane[LANE_Y], lane[RADIUS] = ARC, x, y, radius
    lane[PHASE], lane[TURN] = phase, turn
    lane[LANE_LENGTH], lane[WIDTH], lane[LIMIT] = length, width, limit
    half = 0.5 * length / radius
    if half >= 0.5 * math.pi:
        _bound(lane, x, y, x, y, radius)
        return
    # An arc of less than a half turn lies within its sagitta of its chord.
    sine, cosine = sin_cos(phase)
    sine_end, cosine_end = sin_cos(phase + turn * length / radius)
    _bound(
        lane,
        x + radius * cosine,
        y + radius * sine,
        x + radius * cosine_end,
        y + radius * sine_end,
        radius * (1.0 - cos(half)),
    )


@compiled
def write_sine(
    lane: Floats,
    amplitude: float,
    pulsation: float,
    phase: float,
) -> None:
    """Turn a straight lane into a sine lane with the same axis.

    Args:
        lane: (LANE_WIDTH,) in and out.
        amplitude: To the left [m].
        pulsation: [rad/m].
        phase: At its start [rad].
    """
    lane[KIND], lane[AMPLITUDE], lane[PULSATION], lane[PHASE] = SINE, amplitude, pulsation, phase
    margin = abs(amplitude)
    lane[LEAST_X] -= margin
    lane[MOST_X] += margin
    lane[LEAST_Y] -= margin
    lane[MOST_Y] += margin


@compiled
def write_polyline_lane(
    lane: Floats,
    first_point: int,
    points: int,
    first_knot: int,
    knots: int,
    length: float,
    width: float,
    limit: float,
) -> None:
    """Write a polyline lane; its points and knots stand in ``curves``.

    Args:
        lane: (LANE_WIDTH,) out.
        first_point: Row of its first point.
        points: Number of points.
        first_knot: Row of its first knot.
        knots: Number of knots.
        length: [m].
        width: [m].
        limit: Speed limit [m/s], inf for none.
    """
    lane[:] = 0.0
    lane[KIND], lane[FIRST_POINT], lane[POINTS] = POLYLINE, first_point, points
    lane[FIRST_KNOT], lane[KNOTS] = first_knot, knots
    lane[LANE_LENGTH], lane[WIDTH], lane[LIMIT] = length, width, limit
    # A piece counts as far as it reaches ahead, so no box bounds the distance.
    lane[LEAST_X] = lane[LEAST_Y] = -math.inf
    lane[MOST_X] = lane[MOST_Y] = math.inf


@inlined
def _bound(lane: Floats, x_1: float, y_1: float, x_2: float, y_2: float, margin: float) -> None:
    """Write the box around two points, larger by a margin on all sides."""
    lane[LEAST_X], lane[MOST_X] = min(x_1, x_2) - margin, max(x_1, x_2) + margin
    lane[LEAST_Y], lane[MOST_Y] = min(y_1, y_2) - margin, max(y_1, y_2) + margin
