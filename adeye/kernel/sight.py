"""What can be seen from a point in plan view: rays, bearings and occlusion of oriented boxes."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import allocating, compiled, inlined

__all__ = [
    "OUTLINE_WIDTH",
    "bearings",
    "find_shape",
    "nearest_point",
    "outline",
    "ray_box_distance",
    "sight",
    "visible_fraction",
    "visible_share",
]

Floats = NDArray[np.float64]


@inlined
def _cut(start: float, rate: float, half: float, near: float, far: float) -> tuple[float, float]:
    """Cut [near, far] down to the part of a ray with abs(start + rate * t) <= half."""
    if rate == 0.0:
        return (math.inf, -math.inf) if abs(start) > half else (near, far)
    enter = (-half - start) / rate
    leave = (half - start) / rate
    if enter > leave:
        enter, leave = leave, enter
    return (enter if enter > near else near), (leave if leave < far else far)


@compiled
def ray_box_distance(
    x: float,
    y: float,
    direction_x: float,
    direction_y: float,
    box_x: float,
    box_y: float,
    box_heading: float,
    box_length: float,
    box_width: float,
) -> float:
    """Return how far a ray travels to a box [m]: 0 from inside, infinity past it, NaN with a NaN.

    Args:
        x: Origin of the ray [m].
        y: Origin of the ray [m].
        direction_x: Unit vector of the ray.
        direction_y: Unit vector of the ray.
        box_x: Centre [m].
        box_y: Centre [m].
        box_heading: [rad].
        box_length: [m].
        box_width: [m].
    """
    s, c = sin_cos(box_heading)
    dx = x - box_x
    dy = y - box_y
    return _ray(
        dx * c + dy * s,
        dy * c - dx * s,
        direction_x * c + direction_y * s,
        direction_y * c - direction_x * s,
        box_length,
        box_width,
    )


@inlined
def _ray(
    along: float, across: float, forward: float, sideways: float, length: float, width: float
) -> float:
    """Return how far a ray travels to a box, both given in the frame of the box [m]."""
    if math.isnan(along + across + forward + sideways + length + width):
        return math.nan
    near, far = _cut(along, forward, 0.5 * length, 0.0, math.inf)
    near, far = _cut(across, sideways, 0.5 * width, near, far)
    return near if near <= far else math.inf


@inlined
def _corners(
    dx: float, dy: float, c: float, s: float, half_length: float, half_width: float
) -> tuple[bool, float, float, float, float]:
    """Return whether the origin is in a box, and its rightmost and leftmost corners (x, y) [m].

    Seen from outside, a convex outline spans less than half a turn, so the sign of a cross product
    orders its corners without any angle.
    """
    inside = abs(dx * c + dy * s) <= half_length and abs(dy * c - dx * s) <= half_width
    right_x = left_x = dx + half_length * c - half_width * s
    right_y = left_y = dy + half_length * s + half_width * c
    for corner in range(1, 4):
        u = half_length if corner == 1 else -half_length
        v = half_width if corner == 3 else -half_width
        x = dx + u * c - v * s
        y = dy + u * s + v * c
        if left_x * y - left_y * x > 0.0:
            left_x, left_y = x, y
        if right_x * y - right_y * x < 0.0:
            right_x, right_y = x, y
    return inside, right_x, right_y, left_x, left_y


# Columns of how a box looks from a sensor.
(
    DX,  # its centre from the sensor, in the map [m]
    DY,
    DISTANCE,  # of its centre [m]
    HALF,  # radius of a circle around it [m]
    COSINE,  # of its heading
    SINE,
    INSIDE,  # 1 where the sensor is in it, NaN before its shape is asked for
    RIGHT_X,  # its rightmost corner from the sensor [m]
    RIGHT_Y,
    LEFT_X,  # its leftmost corner from the sensor [m]
    LEFT_Y,
    RIGHT,  # bearing of its right edge in (-pi, pi] [rad], NaN before it is asked for
    LEFT,  # of its left edge, in [right, right + pi) [rad]
) = range(13)
OUTLINE_WIDTH: Final = 13


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
    out[DX], out[DY] = dx, dy
    out[DISTANCE] = math.sqrt(dx * dx + dy * dy)
    out[HALF] = 0.5 * (size[0] + size[1])
    out[INSIDE] = math.nan


@inlined
def find_shape(box: Floats, size: Floats, look: Floats) -> None:
    """Find the corners that a box shows to a sensor, once.

    Args:
        box: (>= 3,) x [m], y [m], heading [rad].
        size: (>= 2,) length [m], width [m].
        look: (OUTLINE_WIDTH,) in and out, see ``sight``.
    """
    if not math.isnan(look[INSIDE]):
        return
    s, c = sin_cos(box[2])
    inside, right_x, right_y, left_x, left_y = _corners(
        look[DX], look[DY], c, s, 0.5 * size[0], 0.5 * size[1]
    )
    look[COSINE], look[SINE] = c, s
    look[INSIDE] = 1.0 if inside else 0.0
    look[RIGHT_X], look[RIGHT_Y], look[LEFT_X], look[LEFT_Y] = right_x, right_y, left_x, left_y
    look[RIGHT] = look[LEFT] = math.nan


@inlined
def outline(sensor_x: float, sensor_y: float, box: Floats, size: Floats, out: Floats) -> None:
    """Find how a box looks from a sensor: ``sight`` and ``find_shape``."""
    sight(sensor_x, sensor_y, box, size, out)
    find_shape(box, size, out)


@inlined
def nearest_point(size: Floats, look: Floats) -> float:
    """Return the distance of a box's nearest point [m], 0 from inside.

    Args:
        size: (>= 2,) length [m], width [m].
        look: (OUTLINE_WIDTH,) of the box.
    """
    if look[INSIDE] > 0.0:
        return 0.0
    dx, dy, c, s = look[DX], look[DY], look[COSINE], look[SINE]
    along = abs(dx * c + dy * s) - 0.5 * size[0]
    across = abs(dy * c - dx * s) - 0.5 * size[1]
    if along <= 0.0:
        return across
    if across <= 0.0:
        return along
    return math.sqrt(along * along + across * across)


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
    return _bearings(look, ahead_x, ahead_y)


@inlined
def _bearings(look: Floats, ahead_x: float, ahead_y: float) -> tuple[float, float]:
    """Return the bearings [rad] of a box about a direction, the left one not below; once."""
    if math.isnan(look[RIGHT]):
        x, y = look[RIGHT_X], look[RIGHT_Y]
        right = atan2(ahead_x * y - ahead_y * x, ahead_x * x + ahead_y * y)
        x, y = look[LEFT_X], look[LEFT_Y]
        left = atan2(ahead_x * y - ahead_y * x, ahead_x * x + ahead_y * y)
        look[RIGHT] = right
        look[LEFT] = left + 2.0 * math.pi if left < right else left
    return look[RIGHT], look[LEFT]


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
    return _way_to(x, y, other, size) < _way_to(x, y, target, target_size)


@inlined
def _way_to(direction_x: float, direction_y: float, look: Floats, size: Floats) -> float:
    """Return how far a ray from the sensor travels to a box [m], infinity past it."""
    c, s = look[COSINE], look[SINE]
    return _ray(
        -look[DX] * c - look[DY] * s,
        look[DX] * s - look[DY] * c,
        direction_x * c + direction_y * s,
        direction_y * c - direction_x * s,
        size[0],
        size[1],
    )


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
        sight(sensor_x, sensor_y, objects[thing], sizes[thing], looks[thing])
    find_shape(objects[target], sizes[target], looks[target])
    distance = looks[target, DISTANCE]
    ahead_x, ahead_y = 1.0, 0.0
    if distance > 0.0:
        ahead_x, ahead_y = looks[target, DX] / distance, looks[target, DY] / distance
    pieces = np.empty((objects.shape[0], 2))
    return visible_share(target, ahead_x, ahead_y, objects, sizes, looks, pieces)


@inlined
def visible_share(
    target: int,
    ahead_x: float,
    ahead_y: float,
    objects: Floats,
    sizes: Floats,
    looks: Floats,
    pieces: Floats,
) -> float:
    """Return what ``visible_fraction`` does, of boxes that are in sight.

    Args:
        target: Row of the object that is looked at; its shape is known.
        ahead_x: Unit vector that bearings count from.
        ahead_y: Of the same.
        objects: (M, >= 3) x [m], y [m], heading [rad] of every object.
        sizes: (M, >= 2) length [m], width [m].
        looks: (M, OUTLINE_WIDTH) of every object that may cover it, see ``sight``.
        pieces: (M, 2) scratch.
    """
    mine = looks[target]
    if mine[INSIDE] > 0.0:
        return 1.0
    right_x, right_y, left_x, left_y = mine[RIGHT_X], mine[RIGHT_Y], mine[LEFT_X], mine[LEFT_Y]
    if not right_x * left_y - right_y * left_x > 0.0:
        return math.nan
    right_size = math.sqrt(right_x * right_x + right_y * right_y)
    left_size = math.sqrt(left_x * left_x + left_y * left_y)
    limit = mine[DISTANCE] + mine[HALF]
    right = left = 0.0
    count = 0
    for other in range(looks.shape[0]):
        look = looks[other]
        dx, dy, half = look[DX], look[DY], look[HALF]
        # A circle around it that does not meet the wedge spares the angles. One jump for all.
        is_beyond = look[DISTANCE] > limit + half
        is_right = right_x * dy - right_y * dx < -half * right_size
        is_left = left_x * dy - left_y * dx > half * left_size
        if (other == target) | is_beyond | is_right | is_left:
            continue
        find_shape(objects[other], sizes[other], look)
        if look[INSIDE] > 0.0:
            return 0.0
        right, left = _bearings(mine, ahead_x, ahead_y)
        start, end = _bearings(look, ahead_x, ahead_y)
        if not start <= end:
            return math.nan
        start, end = _common(start, end, right, left)
        if start >= end:
            continue
        middle = 0.5 * (start + end)
        if _is_nearer(ahead_x, ahead_y, middle, look, mine, sizes[other], sizes[target]):
            pieces[count, 0] = start
            pieces[count, 1] = end
            count += 1
    if count == 0:
        return 1.0
    return _uncovered(right, left, pieces, count) / (left - right)
