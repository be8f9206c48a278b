"""Encounters of two bodies in the plane under a prediction: when they touch, how near they come.

Both keep their heading. The second body lies at (dx, dy) [m] from the first and moves past it at
(rate_x, rate_y) [m/s], so that only the relative motion is left. NaN in, NaN out.
"""

from __future__ import annotations

import math

from adeye.kernel.elementary import sin_cos
from adeye.kernel.geometry import signed_box_distance, sliding_contact
from adeye.kernel.jit import compiled, inlined

__all__ = [
    "closest_encounter",
    "passing_line",
    "planar_time_to_collision",
    "worst_time_to_collision",
]

_ENOUGH = 1e-13
"""Share of a time below which a further step does not matter."""

_STEPS = 60

_PARALLEL = 1e-12
"""Sine below which an edge lies along the motion: headings are no better known, and the corner at
which two bodies are nearest first would be a matter of rounding."""


@compiled
def planar_time_to_collision(
    dx: float,
    dy: float,
    rate_x: float,
    rate_y: float,
    heading_1: float,
    length_1: float,
    width_1: float,
    heading_2: float,
    length_2: float,
    width_2: float,
) -> float:
    """Return the first time at which two boxes touch at constant velocity [s].

    The exact root on the four separating axes, not a search in steps: nothing passes through.

    Returns:
        0 in contact, infinity where they never touch.

    Source:
        Westhofen et al. (2023), "Criticality metrics for automated driving", time to collision.
    """
    if math.isnan(
        dx + dy + rate_x + rate_y + heading_1 + length_1 + width_1 + heading_2 + length_2 + width_2
    ):
        return math.nan
    return sliding_contact(
        dx, dy, rate_x, rate_y, heading_1, length_1, width_1, heading_2, length_2, width_2,
        0.0, math.inf,
    )  # fmt: skip


@inlined
def passing_line(
    dx: float,
    dy: float,
    rate_x: float,
    rate_y: float,
    turn_1: tuple[float, float],
    length_1: float,
    width_1: float,
    turn_2: tuple[float, float],
    length_2: float,
    width_2: float,
) -> tuple[float, float, float]:
    """Return how far apart two boxes pass on the line of their relative motion, past and future.

    Args:
        dx: [m].
        dy: [m].
        rate_x: [m/s].
        rate_y: [m/s].
        turn_1: Sine and cosine of the first heading.
        length_1: [m].
        width_1: [m].
        turn_2: Sine and cosine of the second heading.
        length_2: [m].
        width_2: [m].

    Returns:
        Distance [m], negative by how far they overlap, and the times between which it is that [s];
        infinity, 0 and -1 without relative motion.
    """
    speed = math.sqrt(rate_x * rate_x + rate_y * rate_y)
    if not speed > 0.0:
        return math.inf, 0.0, -1.0
    u, v = rate_x / speed, rate_y / speed
    beside = dy * u - dx * v
    # Side of the first box on which the second one passes.
    side = 1.0 if beside >= 0.0 else -1.0
    apart = abs(beside)
    middle, spread = -(dx * u + dy * v), 0.0
    for axis in range(4):
        sine, cosine = turn_1 if axis < 2 else turn_2
        half = 0.5 * (length_1 if axis == 0 else width_1)
        if axis >= 2:
            half = 0.5 * (length_2 if axis == 2 else width_2)
        x, y = (cosine, sine) if axis % 2 == 0 else (-sine, cosine)
        across, along = side * (y * u - x * v), x * u + y * v
        apart -= half * abs(across)
        if abs(across) <= _PARALLEL:
            # An edge along the motion: nearest for as long as it passes.
            spread += half * abs(along)
        else:
            middle += math.copysign(half, across) * along
    return apart, (middle - spread) / speed, (middle + spread) / speed


@compiled
def closest_encounter(
    dx: float,
    dy: float,
    rate_x: float,
    rate_y: float,
    heading_1: float,
    length_1: float,
    width_1: float,
    heading_2: float,
    length_2: float,
    width_2: float,
) -> tuple[float, float]:
    """Return when two boxes are nearest at constant velocity [s], and how near [m].

    Exact: two convex bodies that never touch are nearest now, or where a corner of their difference
    passes nearest. Of several such times it is the first.

    Returns:
        Time to closest encounter and distance of closest encounter; the time of contact and 0 where
        they touch.

    Source:
        Eggert (2014), "Predictive risk estimation for intelligent ADAS functions".
    """
    time = planar_time_to_collision(
        dx, dy, rate_x, rate_y, heading_1, length_1, width_1, heading_2, length_2, width_2
    )
    if math.isnan(time):
        return math.nan, math.nan
    if time < math.inf:
        return time, 0.0
    least = signed_box_distance(
        0.0, 0.0, heading_1, length_1, width_1, dx, dy, heading_2, length_2, width_2
    )
    line, first, last = passing_line(
        dx, dy, rate_x, rate_y, sin_cos(heading_1), length_1, width_1, sin_cos(heading_2), length_2,
        width_2,
    )  # fmt: skip
    if 0.0 < line < least and last >= 0.0:
        return max(first, 0.0), line
    return 0.0, least


@compiled
def worst_time_to_collision(
    dx: float, dy: float, rate_x: float, rate_y: float, reach: float, acceleration: float
) -> float:
    """Return when two bodies can touch at the earliest, whatever both do [s].

    Each is the circle around its body; both accelerate from now on in the direction that is worst.

    Args:
        dx: From centre to centre [m].
        dy: [m].
        rate_x: Of the second past the first [m/s].
        rate_y: [m/s].
        reach: Sum of the radii of both circles [m].
        acceleration: Sum of what both can reach in any direction, >= 0 [m/s^2].

    Returns:
        First t with ``abs(d + v t) <= reach + acceleration t^2 / 2``; 0 where the circles overlap.

    Source:
        Wachenfeld, Junietz, Wenzel, Winner (2016), "The worst-time-to-collision metric for
        situation identification".
    """
    if math.isnan(dx + dy + rate_x + rate_y + reach + acceleration):
        return math.nan
    time = 0.0
    half = 0.5 * acceleration
    for _ in range(_STEPS):
        x, y = dx + rate_x * time, dy + rate_y * time
        apart = math.sqrt(x * x + y * y)
        room = apart - reach - half * time * time
        if room <= 0.0 or apart == math.inf:
            break
        # The distance lies above its tangent, so that no step goes beyond the first contact.
        closing = acceleration * time - (x * rate_x + y * rate_y) / apart
        root = math.sqrt(closing * closing + 4.0 * half * room)
        if not closing + root > 0.0:
            return math.inf
        step = 2.0 * room / (closing + root)
        time += step
        if not step > _ENOUGH * time:
            break
    return time if dx * dx + dy * dy < math.inf else math.inf
