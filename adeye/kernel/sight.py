"""How oriented boxes look from a point in plan view: distance, corners, bearings, rays."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.branchless import sin_cos_of_any
from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import compiled, inlined

__all__ = [
    "OUTLINE_WIDTH",
    "bearings",
    "fill_extents",
    "find_shape",
    "outline",
    "outlines",
    "ray_box_distance",
    "sight",
    "way_to",
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
