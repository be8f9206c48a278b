"""What lies across a road at a place: lanes either way, shoulders and other strips.

A road is cut into slabs along its line, (S, 4): where a slab begins [m], its first strip, how many
it has, and how many of these are lanes of the ego's way. Strips (J, 8) stand from right to left:
kind, way (1 as the ego's, -1 opposite, 0 neither), speed limit [m/s], number of the lane from the
right among those of the ego's way or -1, and d of its right and its left edge where the slab
begins [m], each with its slope. A road whose lanes go one way all along has neither.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled, inlined

Floats = NDArray[np.float64]

SLAB_BEGIN, SLAB_FIRST, SLAB_STRIPS, SLAB_LANES = range(4)
SLAB_WIDTH: Final = 4
(
    STRIP_KIND,
    STRIP_WAY,
    STRIP_LIMIT,
    STRIP_LANE,
    STRIP_RIGHT,
    STRIP_RIGHT_SLOPE,
    STRIP_LEFT,
    STRIP_LEFT_SLOPE,
) = range(8)
STRIP_WIDTH: Final = 8

# What lies ahead of a strip in its lane: where that ends, where there is no more room to drive [m],
# how many lanes aside the nearest one is that goes on, and whether it is too narrow until then.
LANE_END, LANE_ROOM, LANE_ASIDE, LANE_NARROW = range(4)
ENDS_WIDTH: Final = 4
# Of a slab: the limit of all its lanes of the ego's way [m/s], NaN if they differ; the next slab
# with another.
LIMIT_ALL, LIMIT_NEXT = range(2)
LIMITS_WIDTH: Final = 2

KINDS: Final = ("driving", "shoulder", "parking", "cycling", "walking", "other")
"""What a strip is for."""
DRIVING, SHOULDER, PARKING, CYCLING, WALKING, OTHER = range(6)

OWN, OPPOSITE = 1.0, -1.0

LEAST_LANE: Final = 2.0
"""Narrower, a lane that begins or ends is none yet, or none any more [m]; so for drivers on rails.
Our choice."""

LEAST_TO_DRIVE: Final = 2.5
"""A lane that becomes narrower than that before it ends is driven no further [m]. Our choice."""

NO_SLABS: Final = np.zeros((0, SLAB_WIDTH))
NO_STRIPS: Final = np.zeros((0, STRIP_WIDTH))
NO_ENDS: Final = np.zeros((0, ENDS_WIDTH))
NO_LIMITS: Final = np.zeros((0, LIMITS_WIDTH))
"""Those of a road without."""


@inlined
def slab_at(slabs: Floats, s: float) -> int:
    """Return the slab at a place; the first before the road, the last behind it."""
    low, high = 0, slabs.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if slabs[middle, SLAB_BEGIN] <= s:
            low = middle
        else:
            high = middle
    return low


@inlined
def _ends(slabs: Floats, strips: Floats, s: float, row: int, slab: int) -> tuple[float, float]:
    """Return d of the right and the left edge of a strip of a slab [m]."""
    beyond = max(0.0, s - slabs[slab, SLAB_BEGIN])
    strip = strips[row]
    return (
        strip[STRIP_RIGHT] + strip[STRIP_RIGHT_SLOPE] * beyond,
        strip[STRIP_LEFT] + strip[STRIP_LEFT_SLOPE] * beyond,
    )


@compiled
def lanes_at(slabs: Floats, s: float) -> int:
    """Return how many lanes of the ego's way there are at a place."""
    return int(slabs[slab_at(slabs, s), SLAB_LANES])


@compiled
def lane_ends(slabs: Floats, strips: Floats, s: float, lane: int) -> tuple[float, float]:
    """Return d of the right and the left edge of a lane of the ego's way [m].

    Of a lane that is not there: of one beside the outermost that is, as wide as that.

    Args:
        slabs: (S, 4), see the module.
        strips: (J, 8).
        s: Along the line [m].
        lane: Its number from the right.
    """
    slab = slab_at(slabs, s)
    first = int(slabs[slab, SLAB_FIRST])
    right = left = math.nan
    for row in range(first, first + int(slabs[slab, SLAB_STRIPS])):
        number = int(strips[row, STRIP_LANE])
        if number < 0:
            continue
        right, left = _ends(slabs, strips, s, row, slab)
        if number >= lane:
            if lane < 0:
                return right + lane * (left - right), left + lane * (left - right)
            return right, left
    over = lane + 1 - int(slabs[slab, SLAB_LANES])
    return right + over * (left - right), left + over * (left - right)


@compiled
def strip_at(slabs: Floats, strips: Floats, s: float, d: float) -> int:
    """Return the row of the strip at a place, an edge belonging to the left one; -1 off all."""
    slab = slab_at(slabs, s)
    first = int(slabs[slab, SLAB_FIRST])
    for row in range(first, first + int(slabs[slab, SLAB_STRIPS])):
        right, left = _ends(slabs, strips, s, row, slab)
        if right <= d < left:
            return row
    return -1


@compiled
def lane_of(slabs: Floats, strips: Floats, s: float, d: float) -> int:
    """Return the lane of the ego's way that a place is in, from the right; -1 off them."""
    row = strip_at(slabs, strips, s, d)
    return int(strips[row, STRIP_LANE]) if row >= 0 else -1


@inlined
def lane_and_center(slabs: Floats, strips: Floats, s: float, d: float) -> tuple[int, float]:
    """Return ``lane_of`` a place and d of the middle of the strip there [m]; -1 and NaN off all."""
    slab = slab_at(slabs, s)
    first = int(slabs[slab, SLAB_FIRST])
    for row in range(first, first + int(slabs[slab, SLAB_STRIPS])):
        right, left = _ends(slabs, strips, s, row, slab)
        if right <= d < left:
            return int(strips[row, STRIP_LANE]), 0.5 * (right + left)
    return -1, math.nan


@inlined
def _lane_row(slabs: Floats, strips: Floats, slab: int, lane: int) -> int:
    """Return the row of a lane of the ego's way that a slab has."""
    first = int(slabs[slab, SLAB_FIRST])
    for row in range(first, first + int(slabs[slab, SLAB_STRIPS])):
        if strips[row, STRIP_LANE] == lane:
            return row
    return first


@inlined
def _lane_behind(slabs: Floats, strips: Floats, slab: int, lane: int) -> int:
    """Return the lane of the next slab that one goes on in: where its middle is; -1 for none."""
    s = slabs[slab + 1, SLAB_BEGIN]
    right, left = _ends(slabs, strips, s, _lane_row(slabs, strips, slab, lane), slab)
    return lane_of(slabs, strips, s, 0.5 * (right + left))


@compiled
def look_ahead(slabs: Floats, strips: Floats, ends: Floats, limits: Floats) -> None:
    """Write where lanes end and limits change, found once for all who ask at every tick.

    Args:
        slabs: (S, 4), see the module.
        strips: (J, 8).
        ends: (J, ENDS_WIDTH) out, zeros before.
        limits: (S, LIMITS_WIDTH) out.
    """
    for slab in range(slabs.shape[0] - 1, -1, -1):
        first = int(slabs[slab, SLAB_FIRST])
        # Slabs beyond the last are filled up.
        is_last = slab + 1 == slabs.shape[0] or slabs[slab + 1, SLAB_BEGIN] == math.inf
        lowest, highest = math.inf, -math.inf
        for row in range(first, first + int(slabs[slab, SLAB_STRIPS])):
            if strips[row, STRIP_LANE] >= 0.0:
                lowest = min(lowest, strips[row, STRIP_LIMIT])
                highest = max(highest, strips[row, STRIP_LIMIT])
            ends[row, LANE_END] = math.inf
            if not is_last:
                _find_end(slabs, strips, slab, row, ends)
        limits[slab, LIMIT_NEXT] = slab + 1
        limits[slab, LIMIT_ALL] = lowest if lowest >= highest else math.nan
        if not is_last and limits[slab + 1, LIMIT_ALL] == lowest >= highest:
            limits[slab, LIMIT_NEXT] = limits[slab + 1, LIMIT_NEXT]


@inlined
def _find_end(slabs: Floats, strips: Floats, slab: int, row: int, ends: Floats) -> None:
    """Write where the lane of a row ends, known of those of the next slab."""
    begin, end = slabs[slab, SLAB_BEGIN], slabs[slab + 1, SLAB_BEGIN]
    lane = int(strips[row, STRIP_LANE])
    right, left = _ends(slabs, strips, end, row, slab)
    room, is_narrow = end, left - right < LEAST_TO_DRIVE
    if is_narrow:
        slope = strips[row, STRIP_RIGHT_SLOPE] - strips[row, STRIP_LEFT_SLOPE]
        room = max(begin, end - (LEAST_TO_DRIVE - (left - right)) / slope) if slope > 0.0 else begin
    aside, behind = 0, lane_of(slabs, strips, end, 0.5 * (right + left))
    if behind >= 0:
        following = ends[_lane_row(slabs, strips, slab + 1, behind)]
        is_narrow = is_narrow and following[LANE_NARROW] > 0.0
        room = room if is_narrow else following[LANE_ROOM]
        end, aside = following[LANE_END], int(following[LANE_ASIDE])
    else:
        for other in range(int(slabs[slab, SLAB_LANES])):
            is_nearer = aside == 0 or abs(other - lane) < abs(aside)
            if is_nearer and _lane_behind(slabs, strips, slab, other) >= 0:
                aside = other - lane
    ends[row, LANE_END], ends[row, LANE_ROOM], ends[row, LANE_ASIDE] = end, room, aside
    ends[row, LANE_NARROW] = is_narrow


@compiled
def lane_left(
    slabs: Floats, strips: Floats, ends: Floats, s: float, lane: int, far: float
) -> tuple[float, int]:
    """Return how much is left of a lane, and which lane beside it goes on where it ends.

    Args:
        slabs: (S, 4), see the module.
        strips: (J, 8).
        ends: (J, ENDS_WIDTH), see ``look_ahead``.
        s: Along the line [m].
        lane: Of the ego's way, one that is there.
        far: How far ahead is looked [m].

    Returns:
        Way to its end, or to where it is too narrow to drive in [m], infinity for none within
        ``far``; and how many lanes farther to the left, negative to the right, the nearest one is
        that goes on there, 0 for none.
    """
    found = ends[_lane_row(slabs, strips, slab_at(slabs, s), lane)]
    # Before the road its first slab goes on backwards.
    if found[LANE_END] - s <= far:
        return max(0.0, found[LANE_ROOM] - s), int(found[LANE_ASIDE])
    return math.inf, 0


@compiled
def opposite_ends(slabs: Floats, strips: Floats, s: float, lane: int) -> tuple[float, float]:
    """Return d of the right and the left edge of a lane of the other way [m]; NaN if it is not.

    Args:
        slabs: (S, 4), see the module.
        strips: (J, 8).
        s: Along the line [m].
        lane: Its number from the right of who drives there: from the left. Lanes beyond a median
            do not count.
    """
    slab = slab_at(slabs, s)
    first = int(slabs[slab, SLAB_FIRST])
    stop = first + int(slabs[slab, SLAB_STRIPS])
    own = stop - 1
    while own > first and strips[own, STRIP_LANE] < 0.0:
        if strips[own, STRIP_KIND] == OTHER:
            stop = own
        own -= 1
    number = 0
    for row in range(stop - 1, own, -1):
        if strips[row, STRIP_WAY] == OPPOSITE and strips[row, STRIP_KIND] == DRIVING:
            if number == lane:
                return _ends(slabs, strips, s, row, slab)
            number += 1
    return math.nan, math.nan


@compiled
def middle_of_lane(slabs: Floats, strips: Floats, s: float, d: float) -> float:
    """Return d of the middle of the lane, either way, that a place is in [m]; NaN off them."""
    row = strip_at(slabs, strips, s, d)
    if row < 0 or strips[row, STRIP_KIND] != DRIVING:
        return math.nan
    right, left = _ends(slabs, strips, s, row, slab_at(slabs, s))
    return 0.5 * (right + left)


@compiled
def limit_at(slabs: Floats, strips: Floats, s: float, d: float) -> float:
    """Return the speed limit of the lane of the ego's way that is nearest to a place [m/s]."""
    return limit_in(slabs, strips, slab_at(slabs, s), s, d)


@compiled
def limit_in(slabs: Floats, strips: Floats, slab: int, s: float, d: float) -> float:
    """Return the speed limit at a place whose slab is known, see ``limit_at``."""
    first = int(slabs[slab, SLAB_FIRST])
    nearest, limit = math.inf, math.inf
    for row in range(first, first + int(slabs[slab, SLAB_STRIPS])):
        if strips[row, STRIP_LANE] >= 0.0:
            right, left = _ends(slabs, strips, s, row, slab)
            away = max(0.0, right - d, d - left)
            if away < nearest:
                nearest, limit = away, strips[row, STRIP_LIMIT]
    return limit


@compiled
def paved_ends(slabs: Floats, strips: Floats, s: float) -> tuple[float, float]:
    """Return d of the right and the left edge of what carries a vehicle [m].

    Lanes either way, shoulders, parking and cycling strips do, as far as they touch each other.
    """
    slab = slab_at(slabs, s)
    first = int(slabs[slab, SLAB_FIRST])
    low = high = math.nan
    is_own = False
    for row in range(first, first + int(slabs[slab, SLAB_STRIPS])):
        right, left = _ends(slabs, strips, s, row, slab)
        carries = strips[row, STRIP_KIND] <= CYCLING
        if carries and right <= high + 0.05:
            high = left
        elif carries and not is_own:
            low, high = right, left
        elif is_own:
            break
        is_own = is_own or strips[row, STRIP_LANE] >= 0.0
    return low, high


@compiled
def shoulder_ends(slabs: Floats, strips: Floats, s: float) -> tuple[float, float]:
    """Return d of the edges of the shoulder right beside the rightmost lane [m]; equal for none."""
    slab = slab_at(slabs, s)
    first = int(slabs[slab, SLAB_FIRST])
    right = left = math.nan
    for row in range(first, first + int(slabs[slab, SLAB_STRIPS])):
        if strips[row, STRIP_LANE] >= 0.0:
            edge = _ends(slabs, strips, s, row, slab)[0]
            # What does not touch the lane is no shoulder of it.
            return (right, edge) if abs(left - edge) <= 0.05 else (edge, edge)
        if strips[row, STRIP_KIND] == SHOULDER:
            right, left = _ends(slabs, strips, s, row, slab)
        else:
            right = left = math.nan
    return math.nan, math.nan
