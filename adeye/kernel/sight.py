"""What can be seen from a point in plan view: rays, bearings and occlusion of oriented boxes."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import allocating, compiled, inlined

__all__ = [
    "OUTLINE_WIDTH",
    "box_bearings",
    "outline",
    "ray_box_distance",
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
    INSIDE,  # 1 where the sensor is in it
    RIGHT_X,  # its rightmost corner from the sensor [m]
    RIGHT_Y,
    LEFT_X,  # its leftmost corner from the sensor [m]
    LEFT_Y,
    RIGHT,  # bearing of its right edge in (-pi, pi] [rad], NaN before it is asked for
    LEFT,  # of its left edge, in [right, right + pi) [rad]
) = range(13)
OUTLINE_WIDTH: Final = 13


@inlined
def outline(sensor_x: float, sensor_y: float, box: Floats, size: Floats, out: Floats) -> None:
    """Find how a box looks from a sensor.

    Args:
        sensor_x: [m].
        sensor_y: [m].
        box: (>= 3,) x [m], y [m], heading [rad].
        size: (>= 2,) length [m], width [m].
        out: (OUTLINE_WIDTH,) out.
    """
    dx, dy = box[0] - sensor_x, box[1] - sensor_y
    s, c = sin_cos(box[2])
    inside, right_x, right_y, left_x, left_y = _corners(dx, dy, c, s, 0.5 * size[0], 0.5 * size[1])
    out[DX], out[DY] = dx, dy
    out[DISTANCE] = math.sqrt(dx * dx + dy * dy)
    out[HALF] = 0.5 * (size[0] + size[1])
    out[COSINE], out[SINE] = c, s
    out[INSIDE] = 1.0 if inside else 0.0
    out[RIGHT_X], out[RIGHT_Y], out[LEFT_X], out[LEFT_Y] = right_x, right_y, left_x, left_y
    out[RIGHT] = out[LEFT] = math.nan


@inlined
def box_bearings(
    ahead_x: float, ahead_y: float, size: Floats, look: Floats
) -> tuple[float, float, float]:
    """Return how a box looks from a sensor: nearest distance and its bearings about the boresight.

    Args:
        ahead_x: Unit vector of the direction that the sensor looks in.
        ahead_y: Of the same.
        size: (>= 2,) length [m], width [m].
        look: (OUTLINE_WIDTH,) of the box; its bearings are kept there.

    Returns:
        Distance of the nearest point [m], bearing of the right edge in (-pi, pi] and of the left
        edge in [right, right + pi) [rad], counter-clockwise. From inside: 0, -pi, pi.
    """
    if look[INSIDE] > 0.0:
        return 0.0, -math.pi, math.pi
    right, left = _bearings(look, ahead_x, ahead_y)
    dx, dy, c, s = look[DX], look[DY], look[COSINE], look[SINE]
    along = abs(dx * c + dy * s) - 0.5 * size[0]
    across = abs(dy * c - dx * s) - 0.5 * size[1]
    if along <= 0.0:
        return across, right, left
    if across <= 0.0:
        return along, right, left
    return math.sqrt(along * along + across * across), right, left


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
    direction_x: float, direction_y: float, other: Floats, target: Floats, sizes: Floats, rows: Any
) -> bool:
    """Tell whether a ray from the sensor meets the other box before the target."""
    # Circles around both decide most cases.
    if other[DISTANCE] + other[HALF] < target[DISTANCE] - target[HALF]:
        return True
    if other[DISTANCE] - other[HALF] > target[DISTANCE] + target[HALF]:
        return False
    blocked = _way_to(direction_x, direction_y, other, sizes[rows[0]])
    return blocked < _way_to(direction_x, direction_y, target, sizes[rows[1]])


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
        outline(sensor_x, sensor_y, objects[thing], sizes[thing], looks[thing])
    distance = looks[target, DISTANCE]
    ahead_x, ahead_y = 1.0, 0.0
    if distance > 0.0:
        ahead_x, ahead_y = looks[target, DX] / distance, looks[target, DY] / distance
    return visible_share(target, ahead_x, ahead_y, sizes, looks, np.empty((objects.shape[0], 2)))


@inlined
def visible_share(  # noqa: C901 - a kernel
    target: int, ahead_x: float, ahead_y: float, sizes: Floats, looks: Floats, pieces: Floats
) -> float:
    """Return what ``visible_fraction`` does, of outlines that are known.

    Args:
        target: Row of the object that is looked at.
        ahead_x: Unit vector that bearings count from.
        ahead_y: Of the same.
        sizes: (M, >= 2) length [m], width [m].
        looks: (M, OUTLINE_WIDTH) of every object that may cover it, see ``outline``.
        pieces: (M, 2) scratch.
    """
    mine = looks[target]
    if mine[INSIDE] > 0.0:
        return 1.0
    if not mine[RIGHT_X] * mine[LEFT_Y] - mine[RIGHT_Y] * mine[LEFT_X] > 0.0:
        return math.nan
    # Unit vectors along the edges of the wedge that the target fills.
    size = math.sqrt(mine[RIGHT_X] * mine[RIGHT_X] + mine[RIGHT_Y] * mine[RIGHT_Y])
    edge_x, edge_y = mine[RIGHT_X] / size, mine[RIGHT_Y] / size
    size = math.sqrt(mine[LEFT_X] * mine[LEFT_X] + mine[LEFT_Y] * mine[LEFT_Y])
    far_x, far_y = mine[LEFT_X] / size, mine[LEFT_Y] / size
    right = left = 0.0
    count = 0
    for other in range(looks.shape[0]):
        if other == target:
            continue
        dx, dy, half = looks[other, DX], looks[other, DY], looks[other, HALF]
        if looks[other, DISTANCE] > mine[DISTANCE] + mine[HALF] + half:
            continue
        # A circle around it that does not meet the wedge spares the angles.
        if edge_x * dy - edge_y * dx < -half or far_x * dy - far_y * dx > half:
            continue
        if looks[other, INSIDE] > 0.0:
            return 0.0
        right, left = _bearings(mine, ahead_x, ahead_y)
        start, end = _bearings(looks[other], ahead_x, ahead_y)
        if not start <= end:
            return math.nan
        start, end = _common(start, end, right, left)
        if start >= end:
            continue
        s, c = sin_cos(0.5 * (start + end))
        direction_x, direction_y = ahead_x * c - ahead_y * s, ahead_x * s + ahead_y * c
        if _is_nearer(direction_x, direction_y, looks[other], mine, sizes, (other, target)):
            pieces[count, 0] = start
            pieces[count, 1] = end
            count += 1
    if count == 0:
        return 1.0
    return _uncovered(right, left, pieces, count) / (left - right)
