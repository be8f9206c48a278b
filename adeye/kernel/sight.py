"""How oriented boxes look from a point in plan view: distance, corners, bearings, rays."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.boxes import Box, Vector, narrow
from adeye.kernel.elementary import atan2, sin_cos, sin_cos_of_any
from adeye.kernel.jit import allocating, compiled, inlined

# --- How oriented boxes look from a point in plan view: distance, corners, bearings, rays ---------

Floats = NDArray[np.float64]


@compiled
def ray_box_distance(origin: Vector, direction: Vector, box: Box) -> float:
    """Return how far a ray travels to a box [m]: 0 from inside, infinity past it, NaN with a NaN.

    Args:
        origin: x and y [m].
        direction: Unit vector.
        box: The box.
    """
    box_x, box_y, heading, length, width = box
    s, c = sin_cos(heading)
    dx = origin[0] - box_x
    dy = origin[1] - box_y
    return _ray(
        dx * c + dy * s,
        dy * c - dx * s,
        direction[0] * c + direction[1] * s,
        direction[1] * c - direction[0] * s,
        length,
        width,
    )


@inlined
def _ray(
    along: float, across: float, forward: float, sideways: float, length: float, width: float
) -> float:
    """Return how far a ray travels to a box, both given in the frame of the box [m]."""
    if math.isnan(along + across + forward + sideways + length + width):
        return math.nan
    near, far = narrow(along, forward, 0.5 * length, 0.0, math.inf)
    near, far = narrow(across, sideways, 0.5 * width, near, far)
    return near if near <= far else math.inf


@inlined
def _corners(
    dx: float,
    dy: float,
    along: float,
    across: float,
    c: float,
    s: float,
    half_length: float,
    half_width: float,
) -> tuple[float, float, float, float]:
    """Return the rightmost and the leftmost corner (x, y) of a box from the origin [m].

    Which ones these are hangs on the sides of the box that the origin is on; from inside they mean
    nothing.

    Args:
        dx: Centre [m].
        dy: Centre [m].
        along: Centre along the axis of the box [m].
        across: Centre to the left of that axis [m].
        c: Cosine of the heading of the box.
        s: Sine of it.
        half_length: [m].
        half_width: [m].
    """
    # Selections without a jump: from object to object it is another side.
    is_behind, is_right = along < -half_length, across < -half_width
    right_u = half_length if across > (-half_width if is_behind else half_width) else -half_length
    right_v = half_width if along < (half_length if is_right else -half_length) else -half_width
    left_u = half_length if across < (half_width if is_behind else -half_width) else -half_length
    left_v = half_width if along > (-half_length if is_right else half_length) else -half_width
    right_x = dx + right_u * c - right_v * s
    right_y = dy + right_u * s + right_v * c
    left_x = dx + left_u * c - left_v * s
    left_y = dy + left_u * s + left_v * c
    return right_x, right_y, left_x, left_y


# Columns of how a box looks from a sensor.
(
    DX,  # its centre from the sensor, in the map [m]
    DY,
    HEADING,  # in the map [rad]
    DISTANCE,  # of its centre [m]
    HALF,  # radius of a circle around it [m]
    COSINE,  # of the heading
    SINE,
    NEAREST,  # distance of its nearest point, 0 from inside [m]
    INSIDE,  # 1 where the sensor is in it, NaN before its shape is asked for
    RIGHT_X,  # its rightmost corner from the sensor [m]
    RIGHT_Y,
    LEFT_X,  # its leftmost corner from the sensor [m]
    LEFT_Y,
    RIGHT,  # bearing of its right edge in (-pi, pi] [rad], NaN before it is asked for
    LEFT,  # of its left edge, in [right, right + pi) [rad]
) = range(15)
OUTLINE_WIDTH: Final = 15

_CHORD: Final = math.sqrt(2.0) - 1.0
"""Slope of the chord of sqrt(1 + x²) between 0 and 1, which lies above it."""

# Rows of the extents of many boxes.
HALF_LENGTH, HALF_WIDTH, RADIUS = range(3)


@inlined
def _radius(half_length: float, half_width: float) -> float:
    """Return a radius of a circle around a box [m], at most a twelfth too large; without a root."""
    return max(half_length, half_width) + _CHORD * min(half_length, half_width)


@inlined
def _nearest(along: float, across: float, half_length: float, half_width: float) -> float:
    """Return the distance of a box's nearest point [m], from its centre in its own frame."""
    ahead, beside = abs(along) - half_length, abs(across) - half_width
    ahead, beside = (0.0 if ahead < 0.0 else ahead), (0.0 if beside < 0.0 else beside)
    return math.sqrt(ahead * ahead + beside * beside)


@inlined
def sight(sensor_x: float, sensor_y: float, box: Floats, size: Floats, out: Floats) -> None:
    """Find where a box is from a sensor; its shape is left for ``find_shape``.

    Args:
        sensor_x: [m].
        sensor_y: [m].
        box: (>= 3,) x [m], y [m], heading [rad].
        size: (>= 2,) length [m], width [m].
        out: (OUTLINE_WIDTH,) out.
    """
    dx, dy = box[0] - sensor_x, box[1] - sensor_y
    out[DX], out[DY], out[HEADING] = dx, dy, box[2]
    out[DISTANCE] = math.sqrt(dx * dx + dy * dy)
    out[HALF] = _radius(0.5 * size[0], 0.5 * size[1])
    out[INSIDE] = math.nan


@inlined
def find_shape(size: Floats, look: Floats) -> None:
    """Find the corners that a box shows to a sensor, once.

    Args:
        size: (>= 2,) length [m], width [m].
        look: (OUTLINE_WIDTH,) in and out, see ``sight``.
    """
    if not math.isnan(look[INSIDE]):
        return
    s, c = sin_cos(look[HEADING])
    dx, dy, half_length, half_width = look[DX], look[DY], 0.5 * size[0], 0.5 * size[1]
    along, across = dx * c + dy * s, dy * c - dx * s
    look[COSINE], look[SINE] = c, s
    look[NEAREST] = _nearest(along, across, half_length, half_width)
    look[INSIDE] = 1.0 if abs(along) <= half_length and abs(across) <= half_width else 0.0
    look[RIGHT_X], look[RIGHT_Y], look[LEFT_X], look[LEFT_Y] = _corners(
        dx, dy, along, across, c, s, half_length, half_width
    )
    look[RIGHT] = look[LEFT] = math.nan


@inlined
def outline(sensor_x: float, sensor_y: float, box: Floats, size: Floats, out: Floats) -> None:
    """Find how a box looks from a sensor: ``sight`` and ``find_shape``."""
    sight(sensor_x, sensor_y, box, size, out)
    find_shape(size, out)


@compiled
def fill_extents(sizes: Floats, extents: Floats) -> None:
    """Prepare the extents of boxes for ``outlines``.

    Args:
        sizes: (B, M, >= 2) length [m], width [m].
        extents: (3, B * M) HALF_LENGTH, HALF_WIDTH, RADIUS [m]; out.
    """
    for run in range(sizes.shape[0]):
        for thing in range(sizes.shape[1]):
            place = run * sizes.shape[1] + thing
            half_length, half_width = 0.5 * sizes[run, thing, 0], 0.5 * sizes[run, thing, 1]
            extents[HALF_LENGTH, place], extents[HALF_WIDTH, place] = half_length, half_width
            extents[RADIUS, place] = _radius(half_length, half_width)


@compiled
def outlines(count: int, first: int, extents: Floats, looks: Floats) -> None:
    """Do for many boxes what ``outline`` does for one: the same bits, several boxes at a time.

    Args:
        count: N, how many.
        first: Column of the first one in the extents.
        extents: (3, >= first + N), see ``fill_extents``.
        looks: (OUTLINE_WIDTH, >= N) in and out, a column for each box; DX, DY and HEADING are
            there.
    """
    radii = extents[RADIUS, first:]
    for place in range(count):
        dx, dy = looks[DX, place], looks[DY, place]
        looks[DISTANCE, place] = math.sqrt(dx * dx + dy * dy)
        looks[HALF, place] = radii[place]
        looks[SINE, place], looks[COSINE, place] = sin_cos_of_any(looks[HEADING, place])
        looks[RIGHT, place] = looks[LEFT, place] = math.nan
    # A loop of its own: with too many rows in one, the compiler gives up telling them apart.
    half_lengths, half_widths = extents[HALF_LENGTH, first:], extents[HALF_WIDTH, first:]
    for place in range(count):
        dx, dy, c, s = looks[DX, place], looks[DY, place], looks[COSINE, place], looks[SINE, place]
        half_length, half_width = half_lengths[place], half_widths[place]
        along, across = dx * c + dy * s, dy * c - dx * s
        is_inside = (abs(along) <= half_length) & (abs(across) <= half_width)
        right_x, right_y, left_x, left_y = _corners(
            dx, dy, along, across, c, s, half_length, half_width
        )
        looks[NEAREST, place] = _nearest(along, across, half_length, half_width)
        looks[INSIDE, place] = 1.0 if is_inside else 0.0
        looks[RIGHT_X, place] = right_x
        looks[RIGHT_Y, place] = right_y
        looks[LEFT_X, place] = left_x
        looks[LEFT_Y, place] = left_y


@inlined
def bearings(ahead_x: float, ahead_y: float, look: Floats) -> tuple[float, float]:
    """Return the bearings of a box about the boresight.

    Args:
        ahead_x: Unit vector of the direction that the sensor looks in.
        ahead_y: Of the same.
        look: (OUTLINE_WIDTH,) of the box; its bearings are kept there.

    Returns:
        Bearing of the right edge in (-pi, pi] and of the left edge in [right, right + pi) [rad],
        counter-clockwise. From inside: -pi, pi.
    """
    if look[INSIDE] > 0.0:
        return -math.pi, math.pi
    if math.isnan(look[RIGHT]):
        x, y = look[RIGHT_X], look[RIGHT_Y]
        right = atan2(ahead_x * y - ahead_y * x, ahead_x * x + ahead_y * y)
        x, y = look[LEFT_X], look[LEFT_Y]
        left = atan2(ahead_x * y - ahead_y * x, ahead_x * x + ahead_y * y)
        look[RIGHT] = right
        look[LEFT] = left + 2.0 * math.pi if left < right else left
    return look[RIGHT], look[LEFT]


@inlined
def way_to(direction_x: float, direction_y: float, look: Floats, size: Floats) -> float:
    """Return how far a ray from the sensor travels to a box [m], infinity past it.

    Args:
        direction_x: Unit vector of the ray.
        direction_y: Of the same.
        look: (OUTLINE_WIDTH,) of the box, its shape known.
        size: (>= 2,) length [m], width [m].
    """
    c, s = look[COSINE], look[SINE]
    return _ray(
        -look[DX] * c - look[DY] * s,
        look[DX] * s - look[DY] * c,
        direction_x * c + direction_y * s,
        direction_y * c - direction_x * s,
        size[0],
        size[1],
    )


# --- What of oriented boxes can be seen from a point in plan view, and what others hide of them ---


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
