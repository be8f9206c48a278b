"""Compiled: leave out what cannot be a worst case, by bounds that cost less than the measure.

Nothing that a bound leaves out changes a result: it would have been kept only if it were worse.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from adeye.evaluation.bodies import turn
from adeye.kernel.geometry import box_distance, placed_box_distance
from adeye.kernel.jit import compiled, inlined
from adeye.signals import EGO_HEADING, EGO_X, EGO_Y, OBJECT_HEADING, OBJECT_X, OBJECT_Y

if TYPE_CHECKING:
    from adeye.signals import Floats

_SMALL_ANGLE = 0.5
"""Below it a body moves more along the road than across [rad]."""


@compiled
def least_so_far(
    run: int,
    rows: int,
    ego: Floats,
    ego_size: Floats,
    objects: Floats,
    sizes: Floats,
) -> float:
    """Give the distance of the bodies whose centres come nearest in a run [m].

    No row has to be looked at that is farther; +inf where there is no such distance.

    Args:
        run: Which run.
        rows: Rows that it has.
        ego: (B, T, 7).
        ego_size: (B, 3).
        objects: (B, T, M, 5).
        sizes: (B, M, 3).
    """
    least, at, who = math.inf, -1, -1
    for row in range(rows):
        x, y = ego[run, row, EGO_X], ego[run, row, EGO_Y]
        for thing in range(objects.shape[2]):
            dx, dy = objects[run, row, thing, OBJECT_X] - x, objects[run, row, thing, OBJECT_Y] - y
            if dx * dx + dy * dy < least:
                least = dx * dx + dy * dy
                at, who = row, thing
    if at < 0:
        return math.inf
    distance = box_distance(
        ego[run, at, EGO_X], ego[run, at, EGO_Y], ego[run, at, EGO_HEADING],
        ego_size[run, 0], ego_size[run, 1],
        objects[run, at, who, OBJECT_X], objects[run, at, who, OBJECT_Y],
        objects[run, at, who, OBJECT_HEADING], sizes[run, who, 0], sizes[run, who, 1],
    )  # fmt: skip
    return distance if math.isfinite(distance) else math.inf


@inlined
def distance_below(  # noqa: PLR0913, PLR0917 - two boxes
    dx: float,
    dy: float,
    heading: float,
    length: float,
    width: float,
    o_heading: float,
    o_length: float,
    o_width: float,
    turns: Floats,
    thing: int,
    enough: float,
) -> float:
    """Give the distance of two bodies [m]; from ``enough`` on it may be a bound above that.

    Args:
        dx: From the first to the second [m].
        dy: [m].
        heading: Of the first [rad].
        length: [m].
        width: [m].
        o_heading: Of the second [rad].
        o_length: [m].
        o_width: [m].
        turns: (M + 1, 3) angles with sine and cosine: the first's heading, and by object that of
            the second in the frame of the first.
        thing: Object.
        enough: [m].
    """
    turn(turns, 0, heading)
    turn(turns, thing + 1, o_heading - heading)
    s, c = turns[0, 1], turns[0, 2]
    distance = placed_box_distance(
        dx * c + dy * s, dy * c - dx * s, turns[thing + 1, 1], turns[thing + 1, 2],
        length, width, o_length, o_width, enough,
    )  # fmt: skip
    return 0.0 if distance <= 0.0 else distance


@inlined
def lateral_reach(speed: float, response_time: float, acceleration: float, braking: float) -> float:
    """Give a bound of what a lateral speed adds to the RSS distance beside each other [m].

    Args:
        speed: Size of the lateral speed [m/s].
        response_time: [s].
        acceleration: >= 0 [m/s²].
        braking: One over twice the lateral braking [s²/m].
    """
    gained = response_time * acceleration
    reached = speed + gained
    return 1.000001 * ((speed + 0.5 * gained) * response_time + reached * reached * braking) + 1e-6


@inlined
def is_far_beside(  # noqa: PLR0913, PLR0917 - a kernel
    beside: float,
    half_width: float,
    own_reach: float,
    speed: float,
    angle: float,
    length: float,
    width: float,
    rss: Floats,
    braking: float,
) -> bool:
    """Tell whether an object is too far beside to be in the path or laterally unsafe; else maybe.

    Args:
        beside: From the ego's centre to its centre across the road [m].
        half_width: Of the ego across the road [m].
        own_reach: ``lateral_reach`` of the ego and how much both sway [m].
        speed: Of the object [m/s].
        angle: Of the object to the road [rad].
        length: Of the object [m].
        width: Of the object [m].
        rss: (12,) parameters, in the order of ``series.RssParameters``.
        braking: One over twice the lateral braking [s²/m].
    """
    size = abs(angle)
    # A sine is less than its angle.
    across = abs(speed) * size
    room = abs(beside) - half_width - 0.5 * (width + length * size)
    unsafe = own_reach + lateral_reach(across, rss[1], rss[6], braking)
    return bool(size < _SMALL_ANGLE and room > unsafe)
