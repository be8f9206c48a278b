"""What of oriented boxes can be seen from a point in plan view, and what others hide of them."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import allocating, inlined
from adeye.kernel.sight import (
    DISTANCE,
    DX,
    DY,
    HALF,
    INSIDE,
    LEFT_X,
    LEFT_Y,
    OUTLINE_WIDTH,
    RIGHT_X,
    RIGHT_Y,
    bearings,
    find_shape,
    outline,
    way_to,
)

__all__ = ["visible_fraction", "visible_share"]

Floats = NDArray[np.float64]


@allocating
def visible_fraction(
    sensor_x: float, sensor_y: float, target: int, objects: Floats, sizes: Floats
) -> float:
    """Return the share of the target's angular extent that no nearer box covers, in plan view.

    Exact for boxes that do not overlap each other: a line parts two of them, so one is the nearer
    on every ray that meets both. Of two that overlap, the one nearer on the middle ray covers.

    Args:
        sensor_x: [m].
        sensor_y: [m].
        target: Row of the object that is looked at.
        objects: (M, >= 3) x [m], y [m], heading [rad] of every object; all others can cover it.
        sizes: (M, >= 2) length [m], width [m].

    Returns:
        Share in [0, 1]: 1 from inside the target, 0 from inside another box, NaN with a NaN.
    """
    looks = np.empty((objects.shape[0], OUTLINE_WIDTH))
    for thing in range(objects.shape[0]):
        outline(sensor_x, sensor_y, objects[thing], sizes[thing], looks[thing])
    distance = looks[target, DISTANCE]
    ahead_x, ahead_y = 1.0, 0.0
    if distance > 0.0:
        ahead_x, ahead_y = looks[target, DX] / distance, looks[target, DY] / distance
    pieces = np.empty((objects.shape[0], 2))
    return visible_share(target, ahead_x, ahead_y, sizes, looks, pieces)


@inlined
def visible_share(
    target: int,
    ahead_x: float,
    ahead_y: float,
    sizes: Floats,
    looks: Floats,
    pieces: Floats,
) -> float:
    """Return what ``visible_fraction`` does, of boxes that are in sight.

    Args:
        target: Row of the object that is looked at; its shape is known.
        ahead_x: Unit vector that bearings count from.
        ahead_y: Of the same.
        sizes: (M, >= 2) length [m], width [m] of every object.
        looks: (M, OUTLINE_WIDTH) of every object that may cover it, see ``sight``; shapes that
            are not known yet are found.
        pieces: (M, 2) scratch.
    """
    mine = looks[target]
    if mine[INSIDE] > 0.0:
        return 1.0
    if not mine[RIGHT_X] * mine[LEFT_Y] - mine[RIGHT_Y] * mine[LEFT_X] > 0.0:
        return math.nan
    limit = mine[DISTANCE] + mine[HALF]
    count = 0
    for other in range(looks.shape[0]):
        look = looks[other]
        if (other == target) | (look[DISTANCE] > limit + look[HALF]):
            continue
        find_shape(sizes[other], look)
        start, end = _cover(ahead_x, ahead_y, mine, look, sizes[target], sizes[other])
        if not start > -math.inf:
            return 0.0 if start < end else math.nan
        if start < end:
            pieces[count, 0] = start
            pieces[count, 1] = end
            count += 1
    if count == 0:
        return 1.0
    right, left = bearings(ahead_x, ahead_y, mine)
    return _uncovered(right, left, pieces, count) / (left - right)


@inlined
def _cover(
    ahead_x: float,
    ahead_y: float,
    mine: Floats,
    other: Floats,
    size: Floats,
    other_size: Floats,
) -> tuple[float, float]:
    """Return the bearings between which a box hides another [rad].

    The second is not above the first where it hides nothing; they are infinite where it hides all,
    and NaN with a NaN.
    """
    if other[INSIDE] > 0.0:
        return -math.inf, math.inf
    meeting = _meeting(mine, other)
    if meeting == _APART:
        return 0.0, 0.0
    if meeting == _WHOLE and other[DISTANCE] + other[HALF] < mine[DISTANCE] - mine[HALF]:
        return -math.inf, math.inf
    right, left = bearings(ahead_x, ahead_y, mine)
    start, end = bearings(ahead_x, ahead_y, other)
    if not start <= end:
        return math.nan, math.nan
    start, end = _common(start, end, right, left)
    middle = 0.5 * (start + end)
    if start < end and _is_nearer(ahead_x, ahead_y, middle, other, mine, other_size, size):
        return start, end
    return 0.0, 0.0


_APART: Final = 0
_PART: Final = 1
_WHOLE: Final = 2


@inlined
def _meeting(mine: Floats, other: Floats) -> int:
    """Tell how much of a box may lie behind another: nothing (_APART), all (_WHOLE), or _PART.

    No angle is needed where both span less than a quarter of a turn: then their edges lie less than
    half a turn apart if they meet, and the signs of cross products order them. Otherwise, and with
    a NaN, it is _PART.
    """
    right_x, right_y, left_x, left_y = mine[RIGHT_X], mine[RIGHT_Y], mine[LEFT_X], mine[LEFT_Y]
    from_x, from_y, to_x, to_y = other[RIGHT_X], other[RIGHT_Y], other[LEFT_X], other[LEFT_Y]
    is_narrow = (right_x * left_x + right_y * left_y > 0.0) & (from_x * to_x + from_y * to_y > 0.0)
    is_left = from_x * left_y - from_y * left_x <= 0.0
    is_right = right_x * to_y - right_y * to_x <= 0.0
    if is_narrow & (is_left | is_right):
        return _APART
    begins_before = from_x * right_y - from_y * right_x >= 0.0
    ends_behind = left_x * to_y - left_y * to_x >= 0.0
    return _WHOLE if is_narrow & begins_before & ends_behind else _PART


@inlined
def _is_nearer(
    ahead_x: float,
    ahead_y: float,
    bearing: float,
    other: Floats,
    target: Floats,
    size: Floats,
    target_size: Floats,
) -> bool:
    """Tell whether a ray at a bearing [rad] meets the other box before the target."""
    # Circles around both decide most cases.
    if other[DISTANCE] + other[HALF] < target[DISTANCE] - target[HALF]:
        return True
    if other[DISTANCE] - other[HALF] > target[DISTANCE] + target[HALF]:
        return False
    s, c = sin_cos(bearing)
    x, y = ahead_x * c - ahead_y * s, ahead_x * s + ahead_y * c
    return way_to(x, y, other, size) < way_to(x, y, target, target_size)


@inlined
def _common(start: float, end: float, right: float, left: float) -> tuple[float, float]:
    """Return the common part of two bearing intervals, the first also a turn further on.

    Both span less than half a turn, so only one of its places can meet the second.
    """
    if start > left:
        start -= 2.0 * math.pi
        end -= 2.0 * math.pi
    elif end < right:
        start += 2.0 * math.pi
        end += 2.0 * math.pi
    return max(start, right), min(end, left)


@inlined
def _uncovered(right: float, left: float, pieces: Floats, count: int) -> float:
    """Return the length of [right, left] outside of every piece; sorts the first pieces."""
    for k in range(1, count):
        start, end = pieces[k, 0], pieces[k, 1]
        place = k
        while place > 0 and pieces[place - 1, 0] > start:
            pieces[place, 0] = pieces[place - 1, 0]
            pieces[place, 1] = pieces[place - 1, 1]
            place -= 1
        pieces[place, 0] = start
        pieces[place, 1] = end
    seen = 0.0
    edge = right
    for k in range(count):
        if pieces[k, 0] > edge:
            seen += pieces[k, 0] - edge
        edge = max(edge, pieces[k, 1])
    if left > edge:
        seen += left - edge
    return seen
