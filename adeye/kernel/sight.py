"""What can be seen from a point in plan view: rays, bearings and occlusion of oriented boxes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import compiled

__all__ = ["box_bearings", "ray_box_distance", "visible_fraction"]

Floats = NDArray[np.float64]


@compiled
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
    along = dx * c + dy * s
    across = dy * c - dx * s
    forward = direction_x * c + direction_y * s
    sideways = direction_y * c - direction_x * s
    if math.isnan(along + across + forward + sideways + box_length + box_width):
        return math.nan
    near, far = _cut(along, forward, 0.5 * box_length, 0.0, math.inf)
    near, far = _cut(across, sideways, 0.5 * box_width, near, far)
    return near if near <= far else math.inf


@compiled
def _outline(
    dx: float, dy: float, heading: float, length: float, width: float
) -> tuple[bool, float, float, float, float]:
    """Return whether the origin is in a box, and its rightmost and leftmost corners (x, y) [m].

    Seen from outside, a convex outline spans less than half a turn, so the sign of a cross product
    orders its corners without any angle.
    """
    s, c = sin_cos(heading)
    half_length = 0.5 * length
    half_width = 0.5 * width
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


@compiled
def _bearings(
    right_x: float, right_y: float, left_x: float, left_y: float, ahead_x: float, ahead_y: float
) -> tuple[float, float]:
    """Return the bearings [rad] of two corners about a direction, the left one not below."""
    right = atan2(ahead_x * right_y - ahead_y * right_x, ahead_x * right_x + ahead_y * right_y)
    left = atan2(ahead_x * left_y - ahead_y * left_x, ahead_x * left_x + ahead_y * left_y)
    if left < right:
        left += 2.0 * math.pi
    return right, left


@compiled
def box_bearings(
    sensor_x: float,
    sensor_y: float,
    boresight: float,
    box_x: float,
    box_y: float,
    box_heading: float,
    box_length: float,
    box_width: float,
) -> tuple[float, float, float]:
    """Return how a box looks from a sensor: nearest distance and its bearings about the boresight.

    Args:
        sensor_x: [m].
        sensor_y: [m].
        boresight: Direction that the sensor looks in [rad].
        box_x: Centre [m].
        box_y: Centre [m].
        box_heading: [rad].
        box_length: [m].
        box_width: [m].

    Returns:
        Distance of the nearest point [m], bearing of the right edge in (-pi, pi] and of the left
        edge in [right, right + pi) [rad], counter-clockwise. From inside: 0, -pi, pi.
    """
    dx = box_x - sensor_x
    dy = box_y - sensor_y
    inside, right_x, right_y, left_x, left_y = _outline(dx, dy, box_heading, box_length, box_width)
    if inside:
        return 0.0, -math.pi, math.pi
    ahead_y, ahead_x = sin_cos(boresight)
    right, left = _bearings(right_x, right_y, left_x, left_y, ahead_x, ahead_y)
    s, c = sin_cos(box_heading)
    along = abs(dx * c + dy * s) - 0.5 * box_length
    across = abs(dy * c - dx * s) - 0.5 * box_width
    if along <= 0.0:
        return across, right, left
    if across <= 0.0:
        return along, right, left
    return math.sqrt(along * along + across * across), right, left


@compiled
def _is_nearer(
    sensor_x: float,
    sensor_y: float,
    direction_x: float,
    direction_y: float,
    occluder: int,
    target: int,
    objects: Floats,
    sizes: Floats,
) -> bool:
    """Tell whether a ray meets the occluder before the target."""
    blocked = ray_box_distance(
        sensor_x,
        sensor_y,
        direction_x,
        direction_y,
        objects[occluder, 0],
        objects[occluder, 1],
        objects[occluder, 2],
        sizes[occluder, 0],
        sizes[occluder, 1],
    )
    free = ray_box_distance(
        sensor_x,
        sensor_y,
        direction_x,
        direction_y,
        objects[target, 0],
        objects[target, 1],
        objects[target, 2],
        sizes[target, 0],
        sizes[target, 1],
    )
    return blocked < free


@compiled
def _common(start: float, end: float, right: float, left: float) -> tuple[float, float]:
    """Return the common part of two bearing intervals, the first also one turn further right.

    Both span less than half a turn, so only one of its two places can meet the second.
    """
    if start > left:
        start -= 2.0 * math.pi
        end -= 2.0 * math.pi
    return max(start, right), min(end, left)


@compiled
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


@compiled
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
    ahead_x = objects[target, 0] - sensor_x
    ahead_y = objects[target, 1] - sensor_y
    inside, right_x, right_y, left_x, left_y = _outline(
        ahead_x, ahead_y, objects[target, 2], sizes[target, 0], sizes[target, 1]
    )
    if inside:
        return 1.0
    distance = math.sqrt(ahead_x * ahead_x + ahead_y * ahead_y)
    right, left = _bearings(right_x, right_y, left_x, left_y, ahead_x, ahead_y)
    if not right < left:
        return math.nan
    farthest = distance + 0.5 * (sizes[target, 0] + sizes[target, 1])
    pieces = np.empty((objects.shape[0], 2))
    count = 0
    for other in range(objects.shape[0]):
        if other == target:
            continue
        dx = objects[other, 0] - sensor_x
        dy = objects[other, 1] - sensor_y
        beyond = farthest + 0.5 * (sizes[other, 0] + sizes[other, 1])
        if dx * dx + dy * dy > beyond * beyond:
            continue
        inside, right_x, right_y, left_x, left_y = _outline(
            dx, dy, objects[other, 2], sizes[other, 0], sizes[other, 1]
        )
        if inside:
            return 0.0
        start, end = _bearings(right_x, right_y, left_x, left_y, ahead_x, ahead_y)
        if not start <= end:
            return math.nan
        start, end = _common(start, end, right, left)
        if start >= end:
            continue
        s, c = sin_cos(0.5 * (start + end))
        direction_x = (ahead_x * c - ahead_y * s) / distance
        direction_y = (ahead_x * s + ahead_y * c) / distance
        if _is_nearer(sensor_x, sensor_y, direction_x, direction_y, other, target, objects, sizes):
            pieces[count, 0] = start
            pieces[count, 1] = end
            count += 1
    return _uncovered(right, left, pieces, count) / (left - right)
