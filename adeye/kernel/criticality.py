"""Criticality of one following or passing situation, in closed form.

The rear vehicle (or the ego) follows the front vehicle (or the lead) at a bumper-to-bumper gap [m];
closing speed is rear minus front [m/s]. Accelerations are positive when speeding up, decelerations
are magnitudes. Infinity means "no conflict" for a time and "not possible" for a demand. NaN in, NaN
out. One formula serves the monitor that decides and the metric that judges.
"""

from __future__ import annotations

import math

from adeye.kernel.jit import compiled
from adeye.kernel.rss import (
    rss_lateral_distance,
    rss_longitudinal_distance,
    rss_opposite_distance,
)

__all__ = [
    "brake_threat_number",
    "deceleration_rate_to_avoid_crash",
    "enhanced_time_to_collision",
    "modified_time_to_collision",
    "ramped_stopping_distance",
    "required_deceleration",
    "rss_lateral_distance",
    "rss_longitudinal_distance",
    "rss_opposite_distance",
    "stopping_distance",
    "time_gap",
    "time_headway",
    "time_to_collision",
]


@compiled
def _positive_part(value: float) -> float:
    """Return the value, 0 for a negative one, NaN for NaN."""
    return 0.0 if value < 0.0 else value


@compiled
def time_to_collision(gap: float, closing_speed: float) -> float:
    """Return the time to collision at constant speed [s].

    Args:
        gap: Bumper-to-bumper distance [m]; <= 0 means contact.
        closing_speed: Rear minus front speed [m/s].

    Returns:
        ``gap / closing_speed``; 0 in contact, infinity where the gap does not close.

    Source:
        Hayward (1972), "Near-miss determination through use of a scale of danger".

    >>> time_to_collision(20.0, 5.0), time_to_collision(20.0, -1.0)
    (4.0, inf)
    """
    if math.isnan(gap + closing_speed):
        return math.nan
    if gap <= 0.0:
        return 0.0
    return gap / closing_speed if closing_speed > 0.0 else math.inf


@compiled
def _closing_root(gap: float, closing_speed: float, closing_acceleration: float) -> float:
    """Return the first t > 0 with a t^2 / 2 + v t = gap > 0, or infinity.

    Written so that it tends to ``gap / closing_speed`` with the acceleration, without a seam.
    """
    square = closing_speed * closing_speed + 2.0 * closing_acceleration * gap
    if square < 0.0:
        return math.inf
    root = math.sqrt(square)
    if closing_speed < 0.0:
        # No cancellation: here the acceleration is what closes the gap.
        return (root - closing_speed) / closing_acceleration if root > -closing_speed else math.inf
    return 2.0 * gap / (closing_speed + root) if closing_speed + root > 0.0 else math.inf


@compiled
def enhanced_time_to_collision(
    gap: float, closing_speed: float, closing_acceleration: float
) -> float:
    """Return the time to collision while the relative acceleration stays as it is [s].

    Nobody stops: a vehicle that brakes to standstill is taken to reverse, which is where it differs
    from ``modified_time_to_collision``.

    Args:
        gap: Bumper-to-bumper distance [m]; <= 0 means contact.
        closing_speed: Rear minus front speed [m/s].
        closing_acceleration: Rear minus front acceleration [m/s^2].

    Returns:
        First contact; 0 in contact, infinity without one.

    Source:
        ISO 15623, enhanced time to collision.
    """
    if math.isnan(gap + closing_speed + closing_acceleration):
        return math.nan
    if gap <= 0.0:
        return 0.0
    if gap == math.inf:
        return math.inf
    return _closing_root(gap, closing_speed, closing_acceleration)


@compiled
def _time_to_stop(speed: float, acceleration: float) -> float:
    """Return when a braking vehicle stands [s]; infinity when it does not brake."""
    if speed * acceleration < 0.0:
        return speed / -acceleration
    # One that stands and brakes stays.
    return 0.0 if speed == 0.0 and acceleration < 0.0 else math.inf


@compiled
def modified_time_to_collision(  # noqa: C901 - three phases of two vehicles
    gap: float,
    rear_speed: float,
    front_speed: float,
    rear_acceleration: float,
    front_acceleration: float,
) -> float:
    """Return the time to collision at constant acceleration [s]; who brakes to a stop stays there.

    Args:
        gap: Bumper-to-bumper distance [m]; <= 0 means contact.
        rear_speed: >= 0 [m/s].
        front_speed: Of one that comes towards the rear vehicle < 0 [m/s].
        rear_acceleration: [m/s^2].
        front_acceleration: In the direction of the rear vehicle [m/s^2].

    Returns:
        First contact; 0 in contact, infinity without one.

    Source:
        Ozbay, Yang, Bartin, Mudigonda (2008), "Derivation and validation of new simulation-based
        surrogate safety measure", eq. 4, here in up to three phases parted by the two stops.
    """
    if math.isnan(gap + rear_speed + front_speed + rear_acceleration + front_acceleration):
        return math.nan
    if gap <= 0.0:
        return 0.0
    if gap == math.inf:
        return math.inf
    elapsed = 0.0
    for _ in range(3):
        rear_stop = _time_to_stop(rear_speed, rear_acceleration)
        front_stop = _time_to_stop(front_speed, front_acceleration)
        if rear_stop == 0.0:
            rear_speed = rear_acceleration = 0.0
        if front_stop == 0.0:
            front_speed = front_acceleration = 0.0
        rear_stop = _time_to_stop(rear_speed, rear_acceleration)
        front_stop = _time_to_stop(front_speed, front_acceleration)
        phase = min(rear_stop, front_stop)
        closing = rear_speed - front_speed
        root = _closing_root(gap, closing, rear_acceleration - front_acceleration)
        if root <= phase:
            return elapsed + root
        if phase == math.inf:
            return math.inf
        gap -= phase * (closing + 0.5 * phase * (rear_acceleration - front_acceleration))
        elapsed += phase
        # Exactly zero, so that no rest of rounding drives a stopped vehicle on.
        if rear_stop == phase:
            rear_speed = rear_acceleration = 0.0
        else:
            rear_speed += phase * rear_acceleration
        if front_stop == phase:
            front_speed = front_acceleration = 0.0
        else:
            front_speed += phase * front_acceleration
    return math.inf


@compiled
def time_gap(gap: float, speed: float) -> float:
    """Return the time in which the rear vehicle drives the gap [s].

    Args:
        gap: Bumper-to-bumper distance [m].
        speed: Of the rear vehicle [m/s].

    Returns:
        ``gap / speed``; 0 in contact, infinity at standstill.

    Source:
        ISO 15622, time gap.
    """
    return time_to_collision(gap, speed)


@compiled
def time_headway(gap: float, front_length: float, speed: float) -> float:
    """Return the time between the two front bumpers passing one place [s].

    Args:
        gap: Bumper-to-bumper distance [m].
        front_length: Length of the front vehicle [m].
        speed: Of the rear vehicle [m/s].

    Source:
        Jansson (2005), "Collision avoidance theory with application to automotive collision
        mitigation".
    """
    return time_to_collision(gap + front_length, speed)


@compiled
def deceleration_rate_to_avoid_crash(gap: float, closing_speed: float) -> float:
    """Return the constant deceleration that just brings the closing speed to zero [m/s^2].

    Args:
        gap: Bumper-to-bumper distance [m].
        closing_speed: Rear minus front speed [m/s]; the front vehicle keeps its speed.

    Returns:
        ``closing_speed**2 / (2 gap)``; 0 where the gap does not close, infinity in contact.

    Source:
        Cooper and Ferguson (1976), "Traffic studies at T-junctions".
    """
    if math.isnan(gap + closing_speed):
        return math.nan
    if closing_speed <= 0.0:
        return 0.0
    return closing_speed * closing_speed / (2.0 * gap) if gap > 0.0 else math.inf


@compiled
def required_deceleration(
    gap: float, rear_speed: float, front_speed: float, front_acceleration: float
) -> float:
    """Return the least constant deceleration with which the rear vehicle never touches [m/s^2].

    The magnitude of the field's (negative) required longitudinal acceleration. A braking front
    vehicle stops and stays: what counts is whether it still moves when the speeds are equal.

    Args:
        gap: Bumper-to-bumper distance [m].
        rear_speed: >= 0 [m/s].
        front_speed: >= 0 [m/s].
        front_acceleration: Constant until standstill [m/s^2].

    Returns:
        0 where no braking is needed, infinity in contact unless the gap opens.

    Source:
        Jansson (2005), "Collision avoidance theory with application to automotive collision
        mitigation", section 4.2. A page in circulation prints ``min(a + v^2/(2 d), 0)``, which is
        always 0 for an unbraked front vehicle.
    """
    if math.isnan(gap + rear_speed + front_speed + front_acceleration):
        return math.nan
    closing = rear_speed - front_speed
    braking = _positive_part(-front_acceleration)
    if gap == math.inf or (closing <= 0.0 and braking == 0.0):
        return 0.0
    if gap <= 0.0:
        return 0.0 if rear_speed <= 0.0 else math.inf
    if closing > 0.0 and front_speed * closing >= 2.0 * braking * gap:
        return _positive_part(closing * closing / (2.0 * gap) - front_acceleration)
    room = gap
    if front_speed > 0.0:
        room += front_speed * front_speed / (2.0 * braking)
    return rear_speed * rear_speed / (2.0 * room)


@compiled
def brake_threat_number(required: float, available: float) -> float:
    """Return the required over the available deceleration; 1 and above is past avoiding.

    Args:
        required: ``required_deceleration``, >= 0 [m/s^2].
        available: What vehicle and friction allow [m/s^2].

    Returns:
        0 if none is required, infinity if some is and none available.

    Source:
        Brännström, Sjöberg, Coelingh (2008), "A situation and threat assessment algorithm for a
        rear-end collision avoidance system".
    """
    if math.isnan(required + available):
        return math.nan
    if required <= 0.0:
        return 0.0
    return required / available if available > 0.0 else math.inf


@compiled
def stopping_distance(speed: float, delay: float, deceleration: float) -> float:
    """Return the way to standstill: a delay at constant speed, then constant deceleration [m].

    Args:
        speed: >= 0 [m/s].
        delay: >= 0 [s].
        deceleration: [m/s^2].

    Returns:
        ``speed delay + speed**2 / (2 deceleration)``; infinity if it moves and does not brake.
    """
    if math.isnan(speed + delay + deceleration):
        return math.nan
    if speed <= 0.0:
        return 0.0
    if deceleration <= 0.0:
        return math.inf
    return speed * delay + speed * speed / (2.0 * deceleration)


@compiled
def ramped_stopping_distance(
    speed: float, delay: float, coasting: float, jerk: float, deceleration: float
) -> float:
    """Return the way to standstill with a braking that builds up at constant jerk [m].

    Args:
        speed: >= 0 [m/s].
        delay: Time before the brake responds [s].
        coasting: Deceleration during the delay, from which the ramp starts [m/s^2]; 0 for none.
        jerk: Growth of the deceleration, > 0 [m/s^3].
        deceleration: What the ramp ends at, >= ``coasting`` [m/s^2].

    Returns:
        Way over delay, ramp and constant deceleration, ended wherever standstill comes first.

    Source:
        UN R157, performance model of a careful and competent driver.
    """
    if math.isnan(speed + delay + coasting + jerk + deceleration):
        return math.nan
    if speed <= 0.0:
        return 0.0
    if deceleration <= 0.0 or jerk <= 0.0:
        return math.inf
    if coasting * delay >= speed:
        return speed * speed / (2.0 * coasting)
    way = delay * (speed - 0.5 * coasting * delay)
    speed -= coasting * delay
    ramp = _positive_part((deceleration - coasting) / jerk)
    stop = 2.0 * speed / (coasting + math.sqrt(coasting * coasting + 2.0 * jerk * speed))
    time = min(ramp, stop)
    way += time * (speed - time * (0.5 * coasting + jerk * time / 6.0))
    if stop <= ramp:
        return way
    speed -= time * (coasting + 0.5 * jerk * time)
    return way + speed * speed / (2.0 * deceleration)
