"""Lines of arcs: what a vehicle on rails follows, within a centimetre of a lane's centre line.

Pairs of arcs that meet place and heading at both ends, each as long as it may be. A step of
curvature between arcs would be felt, so each also carries the line's own curvature at its ends, to
be read linearly between.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.maps.alignment import (
    BEFORE,
    BEHIND,
    CURVATURE,
    HEADING,
    X,
    Y,
    next_row,
    place_beside,
    row_at,
)
from adeye.maps.lanes import LaidRoad, Strip

Floats = NDArray[np.float64]

TOLERANCE: Final = 0.01
"""How far a line of arcs may be from the lane's centre line [m]."""

#: Columns of an arc: point, cosine and sine of the heading and heading of its start, its place in
#: the lane, length, curvature, and the centre line's own curvature at its start and end.
ARC_WIDTH: Final = 10
START_X, START_Y, COSINE, SINE, ARC_HEADING, AT, LENGTH, BEND, FIRST_BEND, LAST_BEND = range(10)

# What counts as smooth where pieces or rows meet: [m], [rad], [1/m].
_SMOOTH = (1e-6, 1e-6, 1e-5)
# One arc is enough if it meets the heading at its end this well [rad]; less is straight [1/m].
_SAME_HEADING = 1e-10
_STRAIGHT = 1e-12
# The largest error is between the places that are looked at.
_MARGIN = 0.97
_SPACING, _LEAST_LOOKS = 2.5, 24
_SHORTEST = 0.1
_CLOSER = 7


class Course(NamedTuple):
    """A centre line in the direction in which it is driven.

    Attributes:
        pieces: (G, 15), see ``adeye.maps.alignment``.
        center: (M, 5).
        scratch: (``SCRATCH``,).
        start: Where it begins on the road [m].
        end: Where it ends; less than ``start`` if it is driven against s [m].
    """

    pieces: Floats
    center: Floats
    scratch: Floats
    start: float
    end: float


Pose = tuple[float, float, float]
"""x [m], y [m] and heading [rad]."""

Arc = tuple[float, float]
"""Curvature [1/m] and length [m]."""


@inlined
def _seen(course: Course, u: float, side: int) -> tuple[float, float, float, float]:
    """Return x, y, heading and curvature where one has come u [m] of the road."""
    if course.end >= course.start:
        s = course.start + u
        place = place_beside(course.pieces, course.center, s, side, course.scratch)
        return place[X], place[Y], place[HEADING], place[CURVATURE]
    s = course.start - u
    place = place_beside(course.pieces, course.center, s, 1 - side, course.scratch)
    return place[X], place[Y], wrap_to_pi(place[HEADING] + math.pi), -place[CURVATURE]


@inlined
def _next_knot(course: Course, u: float) -> float:
    """Return where the next piece or row of the line begins, or the line ends [m]."""
    whole = abs(course.end - course.start)
    if course.end >= course.start:
        s = course.start + u
        knot = min(next_row(course.pieces, s), next_row(course.center, s)) - course.start
        return min(knot, whole) if knot > u else whole
    s = course.start - u
    piece = row_at(course.pieces, s, BEFORE)
    row = row_at(course.center, s, BEFORE)
    knot = whole
    if piece >= 0:
        knot = min(knot, course.start - course.pieces[piece, 0])
    if row >= 0:
        knot = min(knot, course.start - course.center[row, 0])
    return knot if knot > u else whole


@compiled
def _edge(course: Course, u: float) -> float:
    """Return where the line next stops being smooth, or ends [m]."""
    whole = abs(course.end - course.start)
    knot = _next_knot(course, u)
    while knot < whole:
        x, y, heading, bend = _seen(course, knot, BEFORE)
        x2, y2, heading2, bend2 = _seen(course, knot, BEHIND)
        if (
            abs(x2 - x) + abs(y2 - y) > _SMOOTH[0]
            or abs(wrap_to_pi(heading2 - heading)) > _SMOOTH[1]
            or abs(bend2 - bend) > _SMOOTH[2]
        ):
            return knot
        knot = _next_knot(course, knot)
    return whole


@compiled
def _pose_at(course: Course, u: float, side: int) -> Pose:
    """Return the pose that arcs meet at: half-way between both sides unless the line jumps."""
    x, y, heading, _ = _seen(course, u, BEFORE)
    x2, y2, heading2, _ = _seen(course, u, BEHIND)
    if abs(x2 - x) + abs(y2 - y) > TOLERANCE:
        return (x, y, heading) if side == BEFORE else (x2, y2, heading2)
    turn = wrap_to_pi(heading2 - heading)
    return 0.5 * (x + x2), 0.5 * (y + y2), wrap_to_pi(heading + 0.5 * turn)


@inlined
def _arc_to(start: Pose, x: float, y: float) -> Arc:
    """Return the arc from a pose to a point; of length NaN if it turns by more than half a turn."""
    sine, cosine = sin_cos(start[2])
    dx, dy = x - start[0], y - start[1]
    ahead, aside = dx * cosine + dy * sine, dy * cosine - dx * sine
    chord = math.sqrt(dx * dx + dy * dy)
    if not ahead > 0.0:
        return 0.0, math.nan
    half_turn = atan2(aside, ahead)
    bend = 2.0 * aside / (chord * chord)
    if abs(bend) <= _STRAIGHT:
        return 0.0, chord
    return bend, 2.0 * half_turn / bend


@compiled
def arc_end(start: Pose, arc: Arc) -> Pose:
    """Return the pose at the end of an arc."""
    bend, length = arc
    half_turn = 0.5 * bend * length
    sine, _ = sin_cos(half_turn)
    chord = 2.0 * sine / bend if bend != 0.0 else length
    sine, cosine = sin_cos(start[2] + half_turn)
    return start[0] + chord * cosine, start[1] + chord * sine, start[2] + 2.0 * half_turn


@compiled
def biarc(start: Pose, end: Pose) -> tuple[Arc, Arc]:
    """Return two arcs that lead from a pose to another; of lengths NaN if none do.

    The second has no length where one is enough.

    Source:
        Bolton (1975), "Biarc curves", with legs of equal length.
    """
    one = _arc_to(start, end[0], end[1])
    if abs(wrap_to_pi(start[2] + one[0] * one[1] - end[2])) <= _SAME_HEADING:
        return one, (0.0, 0.0)
    sine, cosine = sin_cos(start[2])
    sine2, cosine2 = sin_cos(end[2])
    half_turn, _ = sin_cos(0.5 * (end[2] - start[2]))
    dx, dy = end[0] - start[0], end[1] - start[1]
    square = dx * dx + dy * dy
    along = dx * (cosine + cosine2) + dy * (sine + sine2)
    divisor = along + math.sqrt(along * along + 4.0 * half_turn * half_turn * square)
    if not (along > 0.0 and divisor > 0.0):
        return (0.0, math.nan), (0.0, math.nan)
    leg = square / divisor
    x = 0.5 * (start[0] + end[0] + leg * (cosine - cosine2))
    y = 0.5 * (start[1] + end[1] + leg * (sine - sine2))
    first = _arc_to(start, x, y)
    joint = x, y, start[2] + first[0] * first[1]
    return first, _arc_to(joint, end[0], end[1])


@inlined
def _distance(start: Pose, bend: float, x: float, y: float) -> float:
    """Return how far a point is from the circle or straight line that an arc is of [m]."""
    sine, cosine = sin_cos(start[2])
    dx, dy = x - start[0], y - start[1]
    aside = dy * cosine - dx * sine
    inward = 2.0 * aside - bend * (dx * dx + dy * dy)
    return abs(inward / (1.0 + math.sqrt(max(0.0, 1.0 - bend * inward))))


@compiled
def _is_near(course: Course, begin: float, end: float, start: Pose, arcs: tuple[Arc, Arc]) -> bool:
    """Tell whether two arcs keep to a part of the line."""
    length = arcs[0][1] + arcs[1][1]
    if not length > 0.0:
        return False
    joint = arc_end(start, arcs[0])
    sine, cosine = sin_cos(joint[2])
    looks = _LEAST_LOOKS + int((end - begin) / _SPACING)
    x0, y0, gone = start[0], start[1], 0.0
    for look in range(1, looks + 1):
        place = _seen(course, begin + (end - begin) * look / looks, BEFORE)
        x, y = place[0], place[1]
        if (x - joint[0]) * cosine + (y - joint[1]) * sine < 0.0:
            error = _distance(start, arcs[0][0], x, y)
        else:
            error = _distance(joint, arcs[1][0], x, y)
        if not error <= _MARGIN * TOLERANCE:
            return False
        gone += math.sqrt((x - x0) ** 2 + (y - y0) ** 2)
        x0, y0 = x, y
    # No loop that the line does not make.
    return abs(length - gone) <= 0.02 * gone + TOLERANCE


@compiled
def _longest(course: Course, begin: float, edge: float, start: Pose) -> float:
    """Return how far two arcs from a place may lead [m]."""
    good, bad = begin, edge
    if _is_near(course, begin, edge, start, biarc(start, _pose_at(course, edge, BEFORE))):
        return edge
    closer = 0
    while closer < _CLOSER:
        end = 0.5 * (good + bad)
        if end - begin < _SHORTEST:
            return min(begin + _SHORTEST, edge)
        if _is_near(course, begin, end, start, biarc(start, _pose_at(course, end, BEFORE))):
            good = end
        else:
            bad = end
        closer += good > begin
    return good


@inlined
def _bend_at(course: Course, begin: float, end: float, share: float, joint: Pose) -> float:
    """Return the line's own curvature nearest to where two arcs meet [1/m]."""
    u = begin + share * (end - begin)
    x, y, heading, _ = _seen(course, u, BEHIND)
    sine, cosine = sin_cos(heading)
    u -= (x - joint[0]) * cosine + (y - joint[1]) * sine
    return _seen(course, min(max(u, begin), end), BEHIND)[3]


@inlined
def _note(rows: Floats, n: int, start: Pose, arc: Arc, bends: tuple[float, float]) -> None:
    """Write an arc behind those before it."""
    sine, cosine = sin_cos(start[2])
    rows[n, START_X], rows[n, START_Y], rows[n, ARC_HEADING] = start
    rows[n, COSINE], rows[n, SINE] = cosine, sine
    rows[n, AT] = rows[n - 1, AT] + rows[n - 1, LENGTH] if n > 0 else 0.0
    rows[n, BEND], rows[n, LENGTH] = arc
    rows[n, FIRST_BEND], rows[n, LAST_BEND] = bends


@compiled
def fill_arcs(course: Course, rows: Floats) -> int:
    """Write the arcs along a course and return how many there are; -1 if there is no room.

    Args:
        course: Which.
        rows: (N, 10), filled as far as needed.
    """
    whole = abs(course.end - course.start)
    n = 0
    begin = edge = 0.0
    while begin < whole:
        if n + 2 > rows.shape[0]:
            return -1
        if begin >= edge:
            edge = _edge(course, begin)
        start = _pose_at(course, begin, BEHIND)
        end = _longest(course, begin, edge, start)
        first, second = biarc(start, _pose_at(course, end, BEFORE))
        bend = _seen(course, begin, BEHIND)[3]
        last = _seen(course, end, BEFORE)[3]
        if second[1] > 0.0:
            joint = arc_end(start, first)
            share = first[1] / (first[1] + second[1])
            middle = _bend_at(course, begin, end, share, joint)
            _note(rows, n, start, first, (bend, middle))
            _note(rows, n + 1, joint, second, (middle, last))
            n += 2
        elif first[1] > 0.0:
            _note(rows, n, start, first, (bend, last))
            n += 1
        begin = end
    return n


def lane_arcs(road: LaidRoad, strip: Strip) -> Floats:
    """Return the arcs along a lane's centre line, in the order in which they are driven (N, 10)."""
    ends = (strip.start, strip.end) if strip.way >= 0 else (strip.end, strip.start)
    return course_arcs(Course(road.pieces, strip.center, road.scratch, *ends))


def course_arcs(course: Course) -> Floats:
    """Return the arcs along a course, in the order in which they are driven (N, 10)."""
    room = 64
    while True:
        rows = np.empty((room, ARC_WIDTH))
        count = fill_arcs(course, rows)
        if count >= 0:
            # Of a copy, the room that was not needed is given back.
            return rows[:count].copy()
        room *= 4
