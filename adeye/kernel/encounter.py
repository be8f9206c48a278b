"""Encounters of two bodies in the plane under a prediction: when they touch, how near they come.

Both keep their heading. The second body lies at ``place`` (x, y) [m] from the first and moves past
it at ``rate`` (x, y) [m/s], so that only the relative motion is left. NaN in, NaN out.

Times to react [s]: what is left until the last moment at which a manoeuvre avoids the collision.
They are at most the time to collision. A negative one is past: the manoeuvre should have begun so
long ago. Minus infinity: it never avoids; infinity: there is no collision to avoid. NaN in, NaN
out.

The collision that is avoided: the ego closes a gap along the road to a body that takes up its
corridor from ``enter`` to ``leave`` [s]; for a body that is there already and stays, ``enter`` is
<= 0 and ``leave`` infinite.

Source:
    Hillenbrand, Spieker, Kroschel (2006), "A multilevel collision mitigation approach"; Tamke,
    Dang, Breuel (2011), "A flexible method for criticality assessment in driver assistance
    systems".
"""

from __future__ import annotations

import math
from typing import Final

from adeye.kernel.boxes import Extent, Size, Turn, Vector, signed_box_distance, sliding_contact
from adeye.kernel.criticality import stopping_distance, time_to_collision
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import GRAVITY

# --- Encounters of two bodies in the plane under a prediction: when they touch, how near they
# come.

_ENOUGH = 1e-13
"""Share of a time below which a further step does not matter."""

_STEPS = 60

_PARALLEL = 1e-12
"""Sine below which an edge lies along the motion: headings are no better known, and the corner at
which two bodies are nearest first would be a matter of rounding."""


@compiled
def planar_time_to_collision(place: Vector, rate: Vector, body_1: Extent, body_2: Extent) -> float:
    """Return the first time at which two boxes touch at constant velocity [s].

    The exact root on the four separating axes, not a search in steps: nothing passes through.

    Returns:
        0 in contact, infinity where they never touch.

    Source:
        Westhofen et al. (2023), "Criticality metrics for automated driving", time to collision.
    """
    (dx, dy), (rate_x, rate_y) = place, rate
    (heading_1, length_1, width_1), (heading_2, length_2, width_2) = body_1, body_2
    if math.isnan(
        dx + dy + rate_x + rate_y + heading_1 + length_1 + width_1 + heading_2 + length_2 + width_2
    ):
        return math.nan
    return sliding_contact(place, rate, heading_1, body_1[1:], heading_2, body_2[1:], 0.0, math.inf)


@inlined
def passing_line(
    place: Vector, rate: Vector, turn_1: Turn, size_1: Size, turn_2: Turn, size_2: Size
) -> tuple[float, float, float]:
    """Return how far apart two boxes pass on the line of their relative motion, past and future.

    Args:
        place: Of the second box from the first [m].
        rate: Of their motion [m/s].
        turn_1: Of the first.
        size_1: Of the first.
        turn_2: Of the second.
        size_2: Of the second.

    Returns:
        Distance [m], negative by how far they overlap, and the times between which it is that [s];
        infinity, 0 and -1 without relative motion.
    """
    (dx, dy), (rate_x, rate_y) = place, rate
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
        half = 0.5 * (size_1[0] if axis == 0 else size_1[1])
        if axis >= 2:
            half = 0.5 * (size_2[0] if axis == 2 else size_2[1])
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
    place: Vector, rate: Vector, body_1: Extent, body_2: Extent
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
    time = planar_time_to_collision(place, rate, body_1, body_2)
    if math.isnan(time):
        return math.nan, math.nan
    if time < math.inf:
        return time, 0.0
    least = signed_box_distance((0.0, 0.0, *body_1), (*place, *body_2))
    line, first, last = passing_line(
        place, rate, sin_cos(body_1[0]), body_1[1:], sin_cos(body_2[0]), body_2[1:]
    )
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


# --- How long the ego may wait before it evades, in closed form, everybody else at constant
# velocity.


@compiled
def time_to_brake(
    gap: float, closing_speed: float, speed: float, leave: float, braking: float
) -> float:
    """Return how long braking may wait [s].

    The ego comes down to the speed of the body before the gap is used up, or arrives when the body
    has left its corridor, whichever needs less.

    Args:
        gap: Along the road [m].
        closing_speed: Ego minus body along the road [m/s].
        speed: Of the ego [m/s]; it does not reverse for a body that comes towards it.
        leave: When the body has left the ego's corridor [s].
        braking: > 0 [m/s^2].

    Returns:
        ``gap / closing_speed - closing_speed / (2 braking)`` for a body that stays.
    """
    if math.isnan(gap + closing_speed + speed + leave + braking):
        return math.nan
    arrival = time_to_collision(gap, closing_speed)
    if arrival == math.inf or leave < arrival:
        return math.inf
    if gap <= 0.0 or braking <= 0.0:
        return -math.inf
    wait = -math.inf
    if closing_speed <= speed:
        wait = arrival - 0.5 * closing_speed / braking
    if leave < math.inf:
        needed = math.sqrt(2.0 * (closing_speed * leave - gap) / braking)
        if needed * braking <= min(closing_speed, speed):
            wait = max(wait, leave - needed)
        elif closing_speed > speed > 0.0:
            # The ego stands before somebody who comes towards it has left.
            room = gap - (closing_speed - speed) * leave
            wait = room / speed - 0.5 * speed / braking
    return wait


@compiled
def time_to_kickdown(
    gap: float, closing_speed: float, way: float, enter: float, acceleration: float
) -> float:
    """Return how long full acceleration may wait, to be past before the body enters [s].

    Args:
        gap: Along the road [m].
        closing_speed: Ego minus body along the road [m/s].
        way: From the gap's end until the ego is past the body: both lengths [m].
        enter: When the body reaches the ego's corridor [s].
        acceleration: > 0 [m/s^2].

    Returns:
        Minus infinity for a body that is in the corridor already: nobody drives through it.
    """
    if math.isnan(gap + closing_speed + way + enter + acceleration):
        return math.nan
    if time_to_collision(gap, closing_speed) == math.inf:
        return math.inf
    lacking = gap + way - closing_speed * enter
    if lacking <= 0.0 and enter > 0.0:
        return math.inf
    if gap <= 0.0 or enter <= 0.0 or acceleration <= 0.0:
        return -math.inf
    return enter - math.sqrt(2.0 * lacking / acceleration)


@compiled
def evasive_offset(beside: float, drift: float, reach: float) -> float:
    """Return the least way aside with which the ego passes a body [m].

    Args:
        beside: From the ego to the body across the road when they get side by side [m].
        drift: How far the body moves across until the ego is past it [m].
        reach: Half of both widths [m].

    Returns:
        0 for a body that is out of the way.
    """
    after = beside + drift
    left = max(beside, after) + reach
    right = reach - min(beside, after)
    offset = min(left, right)
    return 0.0 if offset < 0.0 else offset


@compiled
def time_to_steer(arrival: float, offset: float, lateral_acceleration: float) -> float:
    """Return how long steering may wait [s].

    Args:
        arrival: Time to collision [s].
        offset: Way aside that it takes, see ``evasive_offset`` [m].
        lateral_acceleration: Constant, > 0 [m/s^2].

    Returns:
        ``arrival - sqrt(2 offset / lateral_acceleration)``.
    """
    if math.isnan(arrival + offset + lateral_acceleration):
        return math.nan
    if arrival == math.inf or offset <= 0.0:
        return math.inf
    if lateral_acceleration <= 0.0:
        return -math.inf
    return arrival - math.sqrt(2.0 * offset / lateral_acceleration)


@compiled
def time_to_react(brake: float, steer: float, kickdown: float) -> float:
    """Return how long the best of the manoeuvres may wait [s].

    Source:
        Tamke et al. (2011): the largest time to a manoeuvre.
    """
    if math.isnan(brake) or math.isnan(steer) or math.isnan(kickdown):
        return math.nan
    return max(brake, steer, kickdown)


@compiled
def steer_threat_number(arrival: float, offset: float, available: float) -> float:
    """Return the lateral acceleration that passes a body over the available one.

    Args:
        arrival: Time to collision [s].
        offset: Way aside that it takes [m].
        available: Lateral acceleration [m/s^2].

    Returns:
        ``2 offset / arrival**2 / available``; 0 without a collision, infinity in contact.

    Source:
        Brännström, Sjöberg, Coelingh (2008), "A situation and threat assessment algorithm for a
        rear-end collision avoidance system".
    """
    if math.isnan(arrival + offset + available):
        return math.nan
    if arrival == math.inf or offset <= 0.0:
        return 0.0
    if arrival <= 0.0 or available <= 0.0:
        return math.inf
    return 2.0 * offset / (arrival * arrival * available)


# --- How far ahead of the ego an object matters: as far as the ego gets before it can stand -------

REACTION_TIME: Final = 1.0
"""From what is there to full braking [s]: sensing, deciding, building up pressure. Our choice."""

BRAKING: Final = 6.0
"""Deceleration of an emergency stop on a dry road [m/s²], as UN R157, 5.2.5.2 takes it."""


@compiled
def reachable_distance(speed: float, friction: float) -> float:
    """Way ahead that the ego covers whatever it does: reaction at its speed, then braking [m].

    Args:
        speed: Of the ego [m/s].
        friction: Tyre-road friction coefficient, which limits the braking.

    Returns:
        ``speed reaction + speed**2 / (2 min(braking, friction g))``.

    Source:
        Stopping sight distance as of road design (AASHTO, A policy on geometric design of highways
        and streets, 3.2.2), with the values above for a driver's.

    >>> reachable_distance(12.0, 1.0), round(reachable_distance(12.0, 0.3), 1)
    (24.0, 36.5)
    """
    return stopping_distance(speed, REACTION_TIME, min(BRAKING, friction * GRAVITY))
