"""A parametric road: a reference line of straight and circular segments, and places beside it.

A road is an array (K, 5) with one row per segment, driven in order: x [m], y [m] and heading [rad]
of its start, length [m], curvature [1/m] (positive turns left). The reference line is the right
edge of lane 0. A place is (s, d): s [m] along the line, d [m] to the left of it, so the centre of
lane i is at ``d = (i + 0.5) * lane_width``. Before its start the first segment goes on backwards,
past its end the last one goes on.

Whatever asks whether a place is on the road calls these functions: the stop library, the ratings,
the evaluation of a trace and its pictures.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.kernel import strips
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import allocating, compiled, inlined
from adeye.kernel.strips import NO_ENDS, NO_LIMITS

if TYPE_CHECKING:
    Bools = NDArray[np.bool_]

# --- A parametric road: a reference line of straight and circular segments, and places beside it --

Floats = NDArray[np.float64]

MANY: Final = 8
"""With more segments than that, those that are far from a point are passed over. Whoever fills
lines up to one length takes care that this does not hang on their neighbours."""

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


# Columns of what is known of a segment of a line of many: how long the line is before it [m], sine
# and cosine of its heading, how near to its start [m] a point is that no part of the line comes
# nearer to but this segment and two on either side, and the largest curvature of these [1/m].
GUIDE_S, GUIDE_SINE, GUIDE_COSINE, GUIDE_NEAR, GUIDE_BEND = range(5)
GUIDE_WIDTH: Final = 5
NO_GUIDE: Final = np.zeros((0, GUIDE_WIDTH))
_BESIDE: Final = 2
_TURNED: Final = 1.5
"""[rad]."""
_WITHIN: Final = 0.9
"""Of the radius."""


@compiled
def lay_guide(segments: Floats, guide: Floats) -> None:
    """Write what finds places on a line of many segments sooner, and changes none.

    Args:
        segments: (K, 5), see the module.
        guide: (K, GUIDE_WIDTH) out.
    """
    before, last = 0.0, segments.shape[0] - 1
    end_x, end_y, _ = position(segments[last:], segments[last, 3], 0.0)
    for k in range(last + 1):
        guide[k, GUIDE_S] = before
        before += segments[k, 3]
        guide[k, GUIDE_SINE], guide[k, GUIDE_COSINE] = sin_cos(segments[k, 2])
        x, y, apart, turn, bend = segments[k, 0], segments[k, 1], math.inf, 0.0, 0.0
        for other in range(last + 1):
            if abs(other - k) <= _BESIDE:
                turn += abs(segments[other, 3] * segments[other, 4])
                bend = max(bend, abs(segments[other, 4]))
                continue
            to_x = segments[other + 1, 0] if other < last else end_x
            to_y = segments[other + 1, 1] if other < last else end_y
            begin = _distance(segments[other, 0] - x, segments[other, 1] - y)
            apart = min(apart, _least(begin, _distance(to_x - x, to_y - y), segments[other, 3]))
        # Who is at less than half the way to all others is farther from them; a millimetre amply
        # covers the rounding. Where the line turns round in between, walking along it may mislead.
        guide[k, GUIDE_NEAR] = 0.5 * apart - 1e-3 if turn < _TURNED else -1.0
        guide[k, GUIDE_BEND] = bend


@inlined
def _distance(dx: float, dy: float) -> float:
    return math.sqrt(dx * dx + dy * dy)


@inlined
def _least(begin: float, end: float, length: float) -> float:
    """Return how near a segment comes at least, of the distances of its ends: by here is no way."""
    return 0.5 * (begin + end - length)


@inlined
def _aim(segments: Floats, guide: Floats, k: int) -> tuple[float, float]:
    """Return sine and cosine of the heading that a segment begins with."""
    if guide.shape[0]:
        return guide[k, GUIDE_SINE], guide[k, GUIDE_COSINE]
    return sin_cos(segments[k, 2])


@inlined
def _is_near(segments: Floats, guide: Floats, near: int, x: float, y: float) -> bool:
    """Tell whether only segments around a guessed one come into question for a point."""
    if not guide.shape[0]:
        return False
    dx, dy, reach = x - segments[near, 0], y - segments[near, 1], guide[near, GUIDE_NEAR]
    return bool(reach > 0.0 and dx * dx + dy * dy < reach * reach)


@inlined
def _walk(segments: Floats, guide: Floats, k: int, x: float, y: float) -> int:
    """Go on while a point is past the normal at a segment's end, back while before its start."""
    last = segments.shape[0] - 1
    while k > 0:
        sine, cosine = _aim(segments, guide, k)
        if (x - segments[k, 0]) * cosine + (y - segments[k, 1]) * sine >= 0.0:
            break
        k -= 1
    while k < last:
        sine, cosine = _aim(segments, guide, k + 1)
        if (x - segments[k + 1, 0]) * cosine + (y - segments[k + 1, 1]) * sine < 0.0:
            break
        k += 1
    return k


@inlined
def _beside(segments: Floats, guide: Floats, k: int, x: float, y: float) -> tuple[float, float]:
    """Return (s, d) of a point, s from the start of a segment."""
    sine, cosine = _aim(segments, guide, k)
    dx, dy = x - segments[k, 0], y - segments[k, 1]
    length, curvature = segments[k, 3], segments[k, 4]
    return _project(dx * cosine + dy * sine, dy * cosine - dx * sine, length, curvature)


@compiled
def _nearer(segments: Floats, guide: Floats, k: int, x: float, y: float, d: float) -> int:
    """Return the segment that is nearest to a point where one is nearer than d [m], else k.

    A long segment may pass by far from where it begins, as the other way of a hairpin does.
    """
    nearest, last, found = abs(d), segments.shape[0] - 1, k
    for row in range(last + 1):
        dx, dy, length = x - segments[row, 0], y - segments[row, 1], segments[row, 3]
        reach, square = nearest + length, dx * dx + dy * dy
        if row == k or square >= reach * reach:
            continue
        begin = end = math.sqrt(square)
        if row < last:
            end = _distance(x - segments[row + 1, 0], y - segments[row + 1, 1])
            if _least(begin, end, length) >= nearest:
                continue
        s, aside = _beside(segments, guide, row, x, y)
        distance = abs(aside)
        if s < 0.0:
            distance = begin
        elif s > length:
            # Where the line goes on behind its end nobody is looked for from elsewhere.
            distance = end if row < last else math.inf
        if distance < nearest - 1e-9:
            found, nearest = row, distance
    return found


@compiled
def _local_of_many(
    segments: Floats, guide: Floats, near: int, x: float, y: float
) -> tuple[float, float, float, float, int]:
    """Do what ``local`` does where there are many segments, and look closely at few of them.

    From the segment that begins nearest it goes to the one between whose normals the point is.
    Neighbours share these, so that s and d have no step there. Right for points nearer to the line
    than its radius. The guide is that of the line or has no rows; last comes the segment that the
    point is beside.
    """
    is_near = _is_near(segments, guide, near, x, y)
    low = max(0, near - _BESIDE) if is_near else 0
    high = min(segments.shape[0], near + _BESIDE + 1) if is_near else segments.shape[0]
    k, nearest = 0, math.inf
    for row in range(low, high):
        dx, dy = x - segments[row, 0], y - segments[row, 1]
        distance = dx * dx + dy * dy
        if distance < nearest:
            k, nearest = row, distance
    k = _walk(segments, guide, k, x, y)
    s, d = _beside(segments, guide, k, x, y)
    # Beyond the centre of a bend walking along it may mislead, too.
    is_near = is_near and abs(d) * guide[near, GUIDE_BEND] < _WITHIN
    if not is_near and _is_near(segments, guide, k, x, y):
        is_near = abs(d) * guide[k, GUIDE_BEND] < _WITHIN
    other = k if is_near else _nearer(segments, guide, k, x, y, d)
    if other != k:
        k = other
        s, d = _beside(segments, guide, k, x, y)
    before, curvature = 0.0, float(segments[k, 4])
    if guide.shape[0]:
        before = guide[k, GUIDE_S]
    else:
        for row in range(k):
            before += segments[row, 3]
    return before + s, d, wrap_to_pi(segments[k, 2] + curvature * s), curvature, k


@inlined
def local_near(
    segments: Floats, guide: Floats, near: int, x: float, y: float
) -> tuple[float, float, float, float, int]:
    """Do what ``local`` does, for one who knows about where the point is.

    Args:
        segments: (K, 5), K >= 1, see the module.
        guide: (K, GUIDE_WIDTH) of a line of many segments, see ``lay_guide``; else without rows.
        near: Segment that the point was beside; a wrong one costs time.
        x: [m].
        y: [m].

    Returns:
        What ``local`` does, to the bit, and the segment that the point is beside.
    """
    if guide.shape[0] and not math.isnan(x + y):
        return _local_of_many(segments, guide, near, x, y)
    s, d, heading, curvature = local(segments, x, y)
    return s, d, heading, curvature, near


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
    if last >= MANY:
        return _local_of_many(segments, segments[:0], 0, x, y)[:4]
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
def curvature_at(segments: Floats, s: float) -> float:
    """Return the curvature of a reference line [1/m].

    Args:
        segments: (K, 5), see the module.
        s: Along it [m].
    """
    last = segments.shape[0] - 1
    k = 0
    while k < last and s > segments[k, 3]:
        s -= segments[k, 3]
        k += 1
    return float(segments[k, 4])


# --- What lies across a road: whoever asks where lanes and edges are asks these functions ---------
#
# They take the place along the road, although only the right edge of a parametric one depends on
# it, so that nobody who asks relies on lanes that go on for ever.


class Ground(NamedTuple):
    """The road of one run with what lies beside it.

    Attributes:
        segments: (K, 5) reference line of the road.
        refuges: (R, 5) parking bays and rest areas, see ``signals.REFUGE_COLUMNS``.
        lane_width: [m].
        lanes: How many there are.
        shoulder: Width beside the right edge [m].
        verge: Width of free ground beside the shoulder [m].
        speed_limit: [m/s].
        slabs: (S, 4), see ``kernel.strips``; none where all lanes go one way all along. Lanes,
            shoulder and limits are else those of the strips.
        strips: (J, 8).
        ends: (J, 4), see ``strips.look_ahead``.
        limits: (S, 2).
        guide: (K, GUIDE_WIDTH), see ``lay_guide``; none where there are few segments.
    """

    segments: Floats
    refuges: Floats
    lane_width: float
    lanes: int
    shoulder: float
    verge: float
    speed_limit: float
    slabs: Floats = strips.NO_SLABS
    strips: Floats = strips.NO_STRIPS
    ends: Floats = NO_ENDS
    limits: Floats = NO_LIMITS
    guide: Floats = NO_GUIDE


class Grounds(NamedTuple):
    """The roads of B runs: the fields of ``Ground`` with a leading axis, but for the lanes."""

    segments: Floats
    refuges: Floats
    lane_width: Floats
    lanes: int
    shoulder: Floats
    verge: Floats
    speed_limit: Floats
    slabs: Floats
    strips: Floats
    ends: Floats
    limits: Floats
    guide: Floats


@inlined
def ground_of(grounds: Grounds, run: int) -> Ground:
    """Return the road of one run."""
    return Ground(
        grounds.segments[run],
        grounds.refuges[run],
        grounds.lane_width[run],
        grounds.lanes,
        grounds.shoulder[run],
        grounds.verge[run],
        grounds.speed_limit[run],
        grounds.slabs[run],
        grounds.strips[run],
        grounds.ends[run],
        grounds.limits[run],
        grounds.guide[run],
    )


@inlined
def place_on(ground: Ground, x: float, y: float) -> tuple[float, float, float, float]:
    """Return the place of a point on a road, see ``local``; of many segments it is found sooner."""
    s, d, heading, curvature, _ = local_near(ground.segments, ground.guide, 0, x, y)
    return s, d, heading, curvature


@inlined
def has_strips(ground: Ground) -> bool:
    """Tell whether lanes and what is beside them are told strip by strip."""
    return ground.slabs.shape[0] > 0


@inlined
def lanes_at(ground: Ground, s: float) -> int:
    """Return how many lanes of the ego's way there are at a place."""
    if has_strips(ground):
        return strips.lanes_at(ground.slabs, s)
    return ground.lanes


@inlined
def lane_width(ground: Ground, s: float, d: float) -> float:
    """Return the width of the lane at a place [m]."""
    if has_strips(ground):
        right, left = strips.lane_ends(ground.slabs, ground.strips, s, lane_at(ground, s, d))
        return left - right
    return ground.lane_width


@inlined
def lane_edge(ground: Ground, s: float, lane: int) -> float:
    """Return d of a lane's right edge [m], of the one behind the last for the left edge."""
    if has_strips(ground):
        return strips.lane_ends(ground.slabs, ground.strips, s, lane)[0]
    return lane * ground.lane_width


@inlined
def lanes_right(ground: Ground, s: float) -> float:
    """Return d of the right edge of the rightmost lane [m]."""
    return lane_edge(ground, s, 0) if has_strips(ground) else 0.0


@inlined
def left_edge(ground: Ground, s: float) -> float:
    """Return d of the left edge of the leftmost lane of the ego's way [m]."""
    return lane_edge(ground, s, lanes_at(ground, s))


@inlined
def far_edge(ground: Ground, s: float) -> float:
    """Return d of the left edge of what carries a vehicle [m], lanes of the other way included."""
    if has_strips(ground):
        return strips.paved_ends(ground.slabs, ground.strips, s)[1]
    return left_edge(ground, s)


@inlined
def lane_center(ground: Ground, s: float, lane: int) -> float:
    """Return d of a lane's centre [m]; lane 0 is the rightmost."""
    if has_strips(ground):
        right, left = strips.lane_ends(ground.slabs, ground.strips, s, lane)
        return 0.5 * (right + left)
    return (lane + 0.5) * ground.lane_width


@inlined
def lane_of(ground: Ground, s: float, d: float) -> int:
    """Return the lane that a point is in, 0 at the right; -1 off the lanes or for NaN.

    Args:
        ground: Where it is.
        s: Along the road [m].
        d: To the left of the right edge [m]; an edge between two lanes belongs to the left one.
    """
    if has_strips(ground):
        return strips.lane_of(ground.slabs, ground.strips, s, d)
    if not 0.0 <= d < left_edge(ground, s):
        return -1
    lane = int(d / ground.lane_width)
    # The division may round up to the far edge.
    return lane if lane < ground.lanes else ground.lanes - 1


@inlined
def lane_at(ground: Ground, s: float, d: float) -> int:
    """Return the lane at a place, the outermost one for places off the lanes."""
    lane = lane_of(ground, s, d)
    if lane >= 0:
        return lane
    return 0 if is_beside(ground, s, d) else lanes_at(ground, s) - 1


@inlined
def lane_and_center(ground: Ground, s: float, d: float) -> tuple[int, float]:
    """Return ``lane_of`` a place, and d of the centre of that or of the nearest lane [m]."""
    lane, center = -1, math.nan
    if has_strips(ground):
        lane, center = strips.lane_and_center(ground.slabs, ground.strips, s, d)
    else:
        lane = lane_of(ground, s, d)
    if lane >= 0 and has_strips(ground):
        return lane, center
    return lane, lane_center(ground, s, lane if lane >= 0 else lane_at(ground, s, d))


@inlined
def center_at(ground: Ground, s: float, d: float) -> float:
    """Return d of the centre of the lane at a place [m], see ``lane_at``."""
    return lane_center(ground, s, lane_at(ground, s, d))


@inlined
def lane_left(ground: Ground, s: float, d: float, far: float) -> tuple[float, int]:
    """Return how much is left of the lane at a place [m], and which lane beside it goes on.

    Args:
        ground: Where it is.
        s: Along the road [m].
        d: [m]; off the lanes the outermost one is meant.
        far: How far ahead is looked [m].

    Returns:
        See ``strips.lane_left``; infinity and 0 where no lane ends.
    """
    if has_strips(ground):
        lane = lane_at(ground, s, d)
        return strips.lane_left(ground.slabs, ground.strips, ground.ends, s, lane, far)
    return math.inf, 0


@inlined
def center_beside(ground: Ground, s: float, center: float, side: float) -> float:
    """Return d of the centre of the next lane [m], be there one or not.

    Args:
        ground: Where it is.
        s: Along the road [m].
        center: Of the lane that it is beside [m].
        side: 1 to the left, -1 to the right.
    """
    if has_strips(ground):
        return lane_center(ground, s, lane_at(ground, s, center) + int(side))
    return center + side * lane_width(ground, s, center)


@inlined
def center_ahead(ground: Ground, s: float, d: float, sideways: float) -> float:
    """Return where a vehicle that moves sideways will end: the next lane centre that way [m].

    Args:
        ground: Where it is.
        s: Along the road [m].
        d: [m].
        sideways: Its speed to the left, not 0 [m/s]; beyond the outermost centre it goes on, to
            infinity.
    """
    if has_strips(ground):
        return _next_center(ground, s, d, sideways)
    place = d / ground.lane_width - 0.5
    lane = math.floor(place) + 1.0 if sideways > 0.0 else math.ceil(place) - 1.0
    if lane < 0.0 or lane >= ground.lanes:
        return sideways * math.inf
    return lane_center(ground, s, int(lane))


@compiled
def _next_center(ground: Ground, s: float, d: float, sideways: float) -> float:
    """Return the next lane centre that way, see ``center_ahead``."""
    count = lanes_at(ground, s)
    for turn in range(count):
        center = lane_center(ground, s, turn if sideways > 0.0 else count - 1 - turn)
        if (center > d) if sideways > 0.0 else (center < d):
            return center
    return sideways * math.inf


@inlined
def is_on_lanes(ground: Ground, s: float, d: float) -> bool:
    """Tell whether a place is on a lane of the ego's way or on an outer edge of them."""
    return lanes_right(ground, s) <= d <= left_edge(ground, s)


@inlined
def is_beside(ground: Ground, s: float, d: float) -> bool:
    """Tell whether a place is to the right of all lanes: on the shoulder or farther out."""
    return d < lanes_right(ground, s)


@inlined
def shoulder_width(ground: Ground, s: float) -> float:
    """Return the width of the shoulder [m], 0 for none."""
    if has_strips(ground):
        right, left = strips.shoulder_ends(ground.slabs, ground.strips, s)
        return left - right
    return ground.shoulder


@inlined
def shoulder_middle(ground: Ground, s: float) -> float:
    """Return d of the middle of the shoulder [m]."""
    if has_strips(ground):
        return lanes_right(ground, s) - 0.5 * shoulder_width(ground, s)
    return -0.5 * shoulder_width(ground, s)


@inlined
def limit_at(ground: Ground, s: float, d: float) -> float:
    """Return the speed limit at a place [m/s]."""
    if has_strips(ground):
        return strips.limit_at(ground.slabs, ground.strips, s, d)
    return ground.speed_limit


# --- The right edge of the road: shoulder, free verge, and the parking bays and rest areas in it --

# Columns of a refuge, as `signals.REFUGE_COLUMNS`.
_KIND, _S, _LENGTH, _DEPTH, _TAPER = range(5)

PARKING_BAY, REST_AREA = 0, 1
"""Kinds of refuges, indices into ``signals.REFUGE_KINDS``."""

NO_REFUGE: Final = -1


@inlined
def depth_at(refuge: Floats, s: float) -> float:
    """Return how far a refuge reaches beyond the shoulder [m].

    Linear over the tapers, with a step where a taper has no length; 0 before and behind.

    Args:
        refuge: (5,), see ``signals.REFUGE_COLUMNS``.
        s: Along the road [m].
    """
    outside = max(refuge[_S] - s, s - refuge[_S] - refuge[_LENGTH])
    if outside <= 0.0:
        return float(refuge[_DEPTH])
    if outside >= refuge[_TAPER]:
        return 0.0
    return float(refuge[_DEPTH] * (1.0 - outside / refuge[_TAPER]))


@compiled
def refuge_depth(refuges: Floats, s: float) -> float:
    """Return how far the refuge at a place reaches beyond the shoulder [m]; 0 where none is.

    Args:
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
        s: Along the road [m].
    """
    depth = 0.0
    for row in range(refuges.shape[0]):
        depth = max(depth, depth_at(refuges[row], s))
    return depth


@inlined
def right_edge(ground: Ground, s: float) -> float:
    """Return the least d that carries a vehicle [m]: of shoulder, refuge or verge."""
    if has_strips(ground):
        beside = max(refuge_depth(ground.refuges, s), ground.verge)
        return strips.paved_ends(ground.slabs, ground.strips, s)[0] - beside
    return -shoulder_width(ground, s) - max(refuge_depth(ground.refuges, s), ground.verge)


@inlined
def body_edge(ground: Ground, s: float, slope: float, length: float, width: float) -> float:
    """Return the least d of the centre of a body whose corners all keep to the road [m].

    Two corners are enough: tapers make the road wider and narrower, never both within a body.

    Args:
        ground: Where it is.
        s: Of its centre along the road [m].
        slope: Tangent of its heading against the road's.
        length: Of the body [m].
        width: [m].
    """
    tilt, half = 0.5 * length * slope, 0.5 * width
    front = right_edge(ground, s + 0.5 * length)
    rear = right_edge(ground, s - 0.5 * length)
    return max((half - tilt) + front, (half + tilt) + rear)


@inlined
def is_in_refuge(
    ground: Ground, refuge: Floats, s: float, d: float, slope: float, length: float, width: float
) -> bool:
    """Tell whether a body is wholly inside a refuge, beside the shoulder.

    A refuge is convex in road coordinates, so its corners are enough.

    Args:
        ground: Where it is.
        refuge: (5,), see ``signals.REFUGE_COLUMNS``.
        s: Of the centre of the body along the road [m].
        d: From the right edge to the left [m].
        slope: Tangent of its heading against the road's.
        length: Of the body [m].
        width: [m].
    """
    is_inside = True
    for end in (-0.5, 0.5):
        x = end * length
        for side in (-0.5, 0.5):
            y = d + slope * x + side * width + shoulder_width(ground, s)
            is_inside = is_inside and -depth_at(refuge, s + x) - 1e-9 <= y <= 1e-9
    return is_inside


@inlined
def is_on_road(grounds: Grounds, run: int, margin: float, s: float, d: float) -> bool:
    """Tell whether a place of a run is on what carries a vehicle, see ``mark_on_road``."""
    ground = ground_of(grounds, run)
    return right_edge(ground, s) - margin <= d <= far_edge(ground, s) + margin


@inlined
def is_in_any_refuge(
    grounds: Grounds, run: int, size: Floats, s: float, d: float, slope: float
) -> bool:
    """Tell whether a body of a run is wholly inside one of its refuges, see ``mark_in_refuge``."""
    ground = ground_of(grounds, run)
    is_inside = False
    for row in range(ground.refuges.shape[0]):
        is_inside = is_inside or is_in_refuge(
            ground, ground.refuges[row], s, d, slope, size[0], size[1]
        )
    return is_inside


@allocating
def mark_on_road(grounds: Grounds, margin: float, s: Floats, d: Floats) -> Bools:
    """Tell which places (B, T) are on a lane, the shoulder, a refuge or the verge.

    Args:
        grounds: Of B runs.
        margin: How far beyond the edges still counts [m].
        s: (B, T) along the road [m].
        d: (B, T) from the right edge to the left [m]; what is no number is not on the road.
    """
    marks = np.zeros(d.shape, dtype=np.bool_)
    for run in range(d.shape[0]):
        for row in range(d.shape[1]):
            marks[run, row] = is_on_road(grounds, run, margin, s[run, row], d[run, row])
    return marks


@allocating
def mark_in_refuge(grounds: Grounds, size: Floats, s: Floats, d: Floats, align: Floats) -> Bools:
    """Tell at which places (B, T) a body is wholly inside a parking bay or rest area.

    Args:
        grounds: Of B runs.
        size: (B, 3) length and width of the body first [m].
        s: (B, T) of its centre along the road [m].
        d: (B, T) from the right edge to the left [m].
        align: (B, T) its heading against the road's [rad].
    """
    marks = np.zeros(d.shape, dtype=np.bool_)
    for run in range(d.shape[0]):
        for row in range(d.shape[1]):
            sine, cosine = sin_cos(align[run, row])
            marks[run, row] = is_in_any_refuge(
                grounds, run, size[run], s[run, row], d[run, row], sine / cosine
            )
    return marks


# --- What the road asks of who is at a place ------------------------------------------------------

PARTS: Final = (*strips.KINDS, "oncoming", "off")
"""What a place is part of: a lane that is not of the other way is ``driving``."""
ONCOMING, OFF = len(strips.KINDS), len(strips.KINDS) + 1

RULES: Final = ("limit", "part", "wrong_way")
RULE_LIMIT, RULE_PART, RULE_WRONG_WAY = range(3)


@inlined
def part_at(ground: Ground, s: float, d: float) -> int:
    """Return what a place is part of, see ``PARTS``; a bay or rest area is for parking."""
    if has_strips(ground):
        row = strips.strip_at(ground.slabs, ground.strips, s, d)
        if row >= 0:
            kind, way = ground.strips[row, strips.STRIP_KIND], ground.strips[row, strips.STRIP_WAY]
            return ONCOMING if kind == strips.DRIVING and way == strips.OPPOSITE else int(kind)
        edge = strips.paved_ends(ground.slabs, ground.strips, s)[0]
    elif lane_of(ground, s, d) >= 0:
        return strips.DRIVING
    else:
        edge = -ground.shoulder
        if edge <= d < 0.0:
            return strips.SHOULDER
    if edge - refuge_depth(ground.refuges, s) <= d < edge:
        return strips.PARKING
    return strips.OTHER if edge - ground.verge <= d < edge else OFF


@inlined
def _rules_at(
    grounds: Grounds, run: int, s: float, d: float, align: float
) -> tuple[float, int, bool]:
    """Return what ``road_rules`` returns of one place."""
    ground = ground_of(grounds, run)
    part = part_at(ground, s, d)
    against = part == strips.DRIVING and sin_cos(align)[1] < 0.0
    return limit_at(ground, s, d), part, against or part == ONCOMING


@allocating
def road_rules(grounds: Grounds, s: Floats, d: Floats, align: Floats) -> Floats:
    """Return what the road asks of vehicles at places, (B, T, 3) in the order of ``RULES``.

    Wrong way is who is in a lane of the other way, or drives against the ego's way in one of that.

    Args:
        grounds: Of B runs.
        s: (B, T) along the road [m].
        d: (B, T) from the right edge to the left [m].
        align: (B, T) heading against the road's [rad].
    """
    rules = np.zeros((d.shape[0], d.shape[1], len(RULES)))
    for run in range(d.shape[0]):
        for row in range(d.shape[1]):
            limit, part, wrong = _rules_at(grounds, run, s[run, row], d[run, row], align[run, row])
            rules[run, row, RULE_LIMIT], rules[run, row, RULE_PART] = limit, part
            rules[run, row, RULE_WRONG_WAY] = 1.0 if wrong else 0.0
    return rules
