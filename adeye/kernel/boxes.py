"""Oriented boxes in the plane: separation, distance and contact while moving.

A box is (x, y, heading, length, width): centre [m], direction of its length [rad], full sizes [m].
What touches is in contact. With a NaN nothing is certified apart: boxes count as in contact, and a
distance is NaN.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import LARGEST_ANGLE, sin_cos
from adeye.kernel.jit import compiled, inlined

#: What a turning box is thickened by at most [m] in ``swept_contact``.
SWEEP_TOLERANCE = 1e-4
_DEEPEST = 24

Vector = tuple[float, float]
"""Along x and along y."""

Turn = tuple[float, float]
"""Sine and cosine of a heading."""

Extent = tuple[float, float, float]
"""Heading [rad], length and width [m]."""

Box = tuple[float, float, float, float, float]
"""x, y [m], heading [rad], length and width [m]."""

Pose = tuple[float, float, float]
"""x, y [m] and heading [rad] of a box."""

Size = tuple[float, float]
"""Length and width of a box [m]."""

Placed = tuple[float, float, float, float]
"""A box in the frame of another: its centre along and across [m], sine and cosine of its
heading."""


@inlined
def wrap_to_pi(angle: float) -> float:
    """Return the same direction in (-pi, pi] [rad]; NaN beyond ``LARGEST_ANGLE``."""
    if -math.pi < angle <= math.pi:
        return angle
    if not abs(angle) <= LARGEST_ANGLE:
        return math.nan
    rest = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
    if rest > math.pi:
        return rest - 2.0 * math.pi
    if rest <= -math.pi:
        return rest + 2.0 * math.pi
    return rest


@inlined
def box_of(state: NDArray[np.float64], size: NDArray[np.float64]) -> Box:
    """Return the box of a state that begins with x, y, heading and a size with length, width."""
    return state[0], state[1], state[2], size[0], size[1]


@compiled
def _larger(a: float, b: float) -> float:
    """Return the larger number, or NaN if one is NaN."""
    if a >= b:
        return a
    return b if a < b else math.nan


@compiled
def _placed(box_1: Box, box_2: Box) -> Placed:
    """Return box 2 in the frame of box 1."""
    s, c = sin_cos(box_1[2])
    dx = box_2[0] - box_1[0]
    dy = box_2[1] - box_1[1]
    sine, cosine = sin_cos(box_2[2] - box_1[2])
    return dx * c + dy * s, dy * c - dx * s, sine, cosine


@compiled
def _outside(along: float, across: float, length: float, width: float) -> float:
    """Return the distance [m] of a point, given in the frame of a box, from the box."""
    dx = abs(along) - 0.5 * length
    dy = abs(across) - 0.5 * width
    if dx <= 0.0:
        return 0.0 if dy <= 0.0 else dy
    if dy <= 0.0:
        return dx
    return math.sqrt(dx * dx + dy * dy)


@compiled
def _separation(placed: Placed, size_1: Size, size_2: Size) -> float:
    """Return the largest gap [m] between the shadows of two boxes on their four edge directions.

    It is positive exactly if the boxes are apart; negative, it is how far they overlap.

    Args:
        placed: Box 2 in the frame of box 1.
        size_1: Of box 1.
        size_2: Of box 2.
    """
    along, across, sine, cosine = placed
    (length_1, width_1), (length_2, width_2) = size_1, size_2
    s = abs(sine)
    c = abs(cosine)
    gap = abs(along) - 0.5 * (length_1 + length_2 * c + width_2 * s)
    gap = _larger(gap, abs(across) - 0.5 * (width_1 + length_2 * s + width_2 * c))
    forward = abs(along * cosine + across * sine)
    gap = _larger(gap, forward - 0.5 * (length_2 + length_1 * c + width_1 * s))
    sideways = abs(across * cosine - along * sine)
    return _larger(gap, sideways - 0.5 * (width_2 + length_1 * s + width_1 * c))


@compiled
def _corner_distance(placed: Placed, size_1: Size, size_2: Size) -> float:
    """Return the least distance [m] from box 1 of the corners of box 2, placed as above."""
    along, across, sine, cosine = placed
    (length_1, width_1), (length_2, width_2) = size_1, size_2
    least = math.inf
    for corner in range(4):
        u = 0.5 * length_2 if corner < 2 else -0.5 * length_2
        v = 0.5 * width_2 if corner % 2 == 0 else -0.5 * width_2
        distance = _outside(
            along + u * cosine - v * sine, across + u * sine + v * cosine, length_1, width_1
        )
        least = -_larger(-least, -distance)
    return least


@compiled
def placed_box_distance(placed: Placed, size_1: Size, size_2: Size, enough: float) -> float:
    """Return the signed distance [m] of two boxes, of which the second is placed as above.

    From ``enough`` on it may be a lower bound of the distance that is above ``enough``, too.
    """
    separation = _separation(placed, size_1, size_2)
    if not separation > 0.0 or separation * 0.9999999 - 1e-6 > enough:
        return separation
    along, across, sine, cosine = placed
    # Two convex polygons apart are nearest at a corner of one of them.
    seen_from_1 = _corner_distance(placed, size_1, size_2)
    there = (-(along * cosine + across * sine), along * sine - across * cosine, -sine, cosine)
    seen_from_2 = _corner_distance(there, size_2, size_1)
    return seen_from_1 if seen_from_1 <= seen_from_2 else seen_from_2


@compiled
def signed_box_distance(box_1: Box, box_2: Box) -> float:
    """Return the distance [m] of two boxes; in contact, minus the way that would separate them.

    The way out of an overlap is the shortest one at right angles to an edge.
    """
    return placed_box_distance(_placed(box_1, box_2), box_1[3:], box_2[3:], math.inf)


@compiled
def box_distance(box_1: Box, box_2: Box) -> float:
    """Return the distance [m] of two boxes, 0 in contact."""
    distance = signed_box_distance(box_1, box_2)
    return 0.0 if distance <= 0.0 else distance


@compiled
def boxes_overlap(box_1: Box, box_2: Box) -> bool:
    """Tell whether two boxes touch or overlap; True with a NaN."""
    dx = box_2[0] - box_1[0]
    dy = box_2[1] - box_1[1]
    reach = 0.5 * (box_1[3] + box_1[4] + box_2[3] + box_2[4])
    if dx * dx + dy * dy > reach * reach:
        return False
    return not _separation(_placed(box_1, box_2), box_1[3:], box_2[3:]) > 0.0


@inlined
def narrow(
    start: float, rate: float, radius: float, first: float, last: float
) -> tuple[float, float]:
    """Cut [first, last] down to the times at which abs(start + rate * t) <= radius."""
    if rate == 0.0:
        return (math.inf, -math.inf) if abs(start) > radius else (first, last)
    enter = (-radius - start) / rate
    leave = (radius - start) / rate
    if enter > leave:
        enter, leave = leave, enter
    return (enter if enter > first else first), (leave if leave < last else last)


@compiled
def sliding_contact(
    place: tuple[float, float],
    rate: tuple[float, float],
    heading_1: float,
    size_1: Size,
    heading_2: float,
    size_2: Size,
    first: float,
    last: float,
) -> float:
    """Return the first time in [first, last] at which two boxes of fixed heading touch, else inf.

    Box 2 is at a place from box 1 at time 0 and moves at a rate past it. Exact.
    """
    (dx, dy), (rate_x, rate_y) = place, rate
    (length_1, width_1), (length_2, width_2) = size_1, size_2
    s_1, c_1 = sin_cos(heading_1)
    s_2, c_2 = sin_cos(heading_2)
    c = abs(c_1 * c_2 + s_1 * s_2)
    s = abs(c_1 * s_2 - s_1 * c_2)
    for axis in range(4):
        if axis == 0:
            u, v, radius = c_1, s_1, 0.5 * (length_1 + length_2 * c + width_2 * s)
        elif axis == 1:
            u, v, radius = -s_1, c_1, 0.5 * (width_1 + length_2 * s + width_2 * c)
        elif axis == 2:
            u, v, radius = c_2, s_2, 0.5 * (length_2 + length_1 * c + width_1 * s)
        else:
            u, v, radius = -s_2, c_2, 0.5 * (width_2 + length_1 * s + width_1 * c)
        first, last = narrow(u * dx + v * dy, u * rate_x + v * rate_y, radius, first, last)
        if first > last:
            return math.inf
    return first


@compiled
def swept_contact(
    start_1: Pose, end_1: Pose, size_1: Size, start_2: Pose, end_2: Pose, size_2: Size
) -> tuple[bool, float]:
    """Find the first contact of two boxes that move evenly from a start to an end pose.

    Nothing passes through, however fast. Centres move on straight lines and headings turn the
    shorter way. Boxes that keep their heading are exact; a turning one is thickened to what it
    sweeps, by at most ``SWEEP_TOLERANCE``, so a contact may be found that much too early, never
    missed.

    Returns:
        Whether there is contact, and at which share of the step, in [0, 1]; infinity without
        contact. With a NaN: contact at share 0.
    """
    (length_1, width_1), (length_2, width_2) = size_1, size_2
    heading_1, heading_2 = start_1[2], start_2[2]
    dx = start_2[0] - start_1[0]
    dy = start_2[1] - start_1[1]
    rate_x = (end_2[0] - end_1[0]) - dx
    rate_y = (end_2[1] - end_1[1]) - dy
    turn_1 = wrap_to_pi(end_1[2] - heading_1)
    turn_2 = wrap_to_pi(end_2[2] - heading_2)
    if math.isnan(dx + dy + rate_x + rate_y + turn_1 + turn_2 + heading_1 + heading_2):
        return True, 0.0
    # Walk the halvings of the step in time order, deeper only where the thick boxes touch.
    depth = 0
    place = 0
    while place < (1 << depth):
        share = 1.0 / (1 << depth)
        middle = (place + 0.5) * share
        grow_1 = 0.5 * share * abs(turn_1)
        grow_2 = 0.5 * share * abs(turn_2)
        thick_1 = grow_1 * (length_1 + width_1)
        thick_2 = grow_2 * (length_2 + width_2)
        at = sliding_contact(
            (dx, dy),
            (rate_x, rate_y),
            heading_1 + middle * turn_1,
            (length_1 + grow_1 * width_1, width_1 + grow_1 * length_1),
            heading_2 + middle * turn_2,
            (length_2 + grow_2 * width_2, width_2 + grow_2 * length_2),
            place * share,
            (place + 1) * share,
        )
        if at < math.inf:
            if thick_1 + thick_2 <= SWEEP_TOLERANCE or depth >= _DEEPEST:
                return True, at
            depth += 1
            place *= 2
            continue
        place += 1
        while depth > 0 and place % 2 == 0:
            depth -= 1
            place //= 2
    return False, math.inf
