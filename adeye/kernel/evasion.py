"""How long the ego may wait before it evades, in closed form, everybody else at constant velocity.

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

from adeye.kernel.criticality import time_to_collision
from adeye.kernel.jit import compiled

__all__ = [
    "evasive_offset",
    "steer_threat_number",
    "time_to_brake",
    "time_to_kickdown",
    "time_to_react",
    "time_to_steer",
]


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
