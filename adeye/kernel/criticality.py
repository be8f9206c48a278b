"""Criticality of one following or passing situation, in closed form.

The rear vehicle (or the ego) follows the front vehicle (or the lead) at a bumper-to-bumper gap [m];
closing speed is rear minus front [m/s]. Accelerations are positive when speeding up, decelerations
are magnitudes. Infinity means "no conflict" for a time and "not possible" for a demand. NaN in, NaN
out. One formula serves the monitor that decides and the metric that judges.

Source:
    Shalev-Shwartz, Shammah, Shashua (2017), "On a formal model of safe and scalable self-driving
    cars"; beside others, and where speeds or distances are limited, as the ad-rss library 5.0 does.

As in ``criticality``: gaps bumper to bumper, decelerations as magnitudes, infinity for what cannot
be reached. NaN in, NaN out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import exp, sin_cos
from adeye.kernel.jit import compiled

Floats = NDArray[np.float64]

# --- Safe distances of responsibility-sensitive safety (RSS): behind, towards and beside others ---


@compiled
def _positive_part(value: float) -> float:
    """Return the value, 0 for a negative one, NaN for NaN."""
    return 0.0 if value < 0.0 else value


@compiled
def rss_longitudinal_distance(
    rear_speed: float,
    front_speed: float,
    response_time: float,
    acceleration: float,
    least_braking: float,
    most_braking: float,
    least_distance: float = 0.0,
    fastest: float = math.inf,
) -> float:
    """Return the safe distance behind a vehicle that goes the same way [m].

    The rear vehicle accelerates through its response time and then brakes at least so much, while
    the front vehicle brakes at most so much.

    Args:
        rear_speed: >= 0 [m/s].
        front_speed: >= 0 [m/s].
        response_time: [s].
        acceleration: Largest of the rear vehicle while it responds [m/s^2].
        least_braking: Of the rear vehicle, > 0 [m/s^2].
        most_braking: Of the front vehicle, > 0 [m/s^2].
        least_distance: Kept in addition, whatever the speeds [m].
        fastest: Speed up to which the rear vehicle accelerates while it responds; one that is
            faster keeps its speed [m/s].

    Source:
        Definition 1 and lemma 2; ad-rss 5.0, ``min_longitudinal_safety_distance`` and
        ``max_speed_on_acceleration``.
    """
    if math.isnan(least_braking + most_braking + least_distance + fastest):
        return math.nan
    if least_braking <= 0.0:
        return math.inf
    reached = rear_speed + response_time * acceleration
    distance = response_time * (rear_speed + 0.5 * acceleration * response_time)
    if reached > fastest:
        reached = max(rear_speed, fastest)
        grown = (reached - rear_speed) / acceleration if acceleration > 0.0 else 0.0
        distance = 0.5 * (rear_speed + reached) * grown + reached * (response_time - grown)
    distance += reached * reached / (2.0 * least_braking)
    if most_braking > 0.0:
        distance -= front_speed * front_speed / (2.0 * most_braking)
    elif front_speed > 0.0:
        return least_distance
    return _positive_part(distance) + least_distance


@compiled
def rss_opposite_distance(
    speed: float,
    oncoming_speed: float,
    response_time: float,
    acceleration: float,
    correct_braking: float,
    oncoming_braking: float,
    least_distance: float = 0.0,
    fastest: float = math.inf,
) -> float:
    """Return the safe distance to oncoming traffic: both ways to standstill [m].

    Args:
        speed: Of the vehicle in its correct lane, >= 0 [m/s].
        oncoming_speed: Magnitude, >= 0 [m/s].
        response_time: Of both [s].
        acceleration: Largest of both while they respond [m/s^2].
        correct_braking: Least braking of the vehicle in its correct lane [m/s^2].
        oncoming_braking: Least braking of the other [m/s^2].
        least_distance: Kept in addition, once for both [m].
        fastest: Speed up to which each accelerates while it responds [m/s].

    Source:
        Definition 2; ad-rss 5.0 as for ``rss_longitudinal_distance``.
    """
    own = rss_longitudinal_distance(
        speed, 0.0, response_time, acceleration, correct_braking, 1.0, least_distance, fastest
    )
    other = rss_longitudinal_distance(
        oncoming_speed, 0.0, response_time, acceleration, oncoming_braking, 1.0, 0.0, fastest
    )
    return own + other


@compiled
def rss_lateral_distance(
    speed_1: float,
    speed_2: float,
    response_time_1: float,
    response_time_2: float,
    acceleration: float,
    braking: float,
    fluctuation: float,
    is_printed: bool = False,  # noqa: FBT001, FBT002 - compiled
) -> float:
    """Return the safe distance beside each other [m].

    Who still moves away after its response has no way of braking to be kept free, and two that
    move apart for long enough need no distance at all. As the definition is printed, braking terms
    keep their sign when a vehicle moves away, and the margin is always kept: it asks for more
    where somebody moves away, never for less.

    Args:
        speed_1: Lateral speed of the one towards the other, positive in that direction [m/s].
        speed_2: Lateral speed of the other, positive in the same direction (away) [m/s].
        response_time_1: [s].
        response_time_2: [s].
        acceleration: Largest lateral acceleration towards each other while they respond [m/s^2].
        braking: Least lateral braking afterwards, > 0 [m/s^2].
        fluctuation: Margin for swaying in the lane [m].
        is_printed: Whether the definition is taken as it is printed.

    Source:
        Definition 6 with a response time each, as ``calculateSafeLateralDistance`` of ad-rss 5.0
        reads it.
    """
    if math.isnan(braking):
        return math.nan
    if braking <= 0.0:
        return math.inf
    reached_1 = speed_1 + response_time_1 * acceleration
    reached_2 = speed_2 - response_time_2 * acceleration
    way_1 = 0.5 * (speed_1 + reached_1) * response_time_1
    way_2 = 0.5 * (speed_2 + reached_2) * response_time_2
    if is_printed or reached_1 > 0.0:
        way_1 += reached_1 * reached_1 / (2.0 * braking)
    if is_printed or reached_2 < 0.0:
        way_2 -= reached_2 * reached_2 / (2.0 * braking)
    if is_printed:
        return fluctuation + _positive_part(way_1 - way_2)
    return _positive_part(fluctuation + (way_1 - way_2))


# --- Criticality of one following or passing situation, in closed form ----------------------------


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
def road_gap(apart: float, ego_extent: float, other_extent: float) -> float:
    """Bumper-to-bumper gap along a lane [m]: positive ahead, negative behind, 0 side by side.

    Args:
        apart: From the ego's centre to that of the other, as of ``road.lane_way`` [m].
        ego_extent: Half of the length that the ego takes along the road [m].
        other_extent: Half of the length that the other takes [m].
    """
    free = max(0.0, abs(apart) - ego_extent - other_extent)
    return math.copysign(free, apart)


@compiled
def road_ttc(gap: float, ego_speed: float, other_speed: float) -> float:
    """Time to collision along the road at constant speeds [s], inf if the gap does not close.

    Args:
        gap: As of ``road_gap`` [m].
        ego_speed: Along the lane [m/s].
        other_speed: Along the same lane, see ``lane_share`` [m/s].
    """
    closing = (ego_speed - other_speed) * math.copysign(1.0, gap)
    return abs(gap) / closing if closing > 0.0 else math.inf


@compiled
def road_extent(size: Floats, angle: float) -> float:
    """Half of the length that a box takes along the road [m].

    Args:
        size: (3,) length, width, height [m].
        angle: Heading relative to the road [rad].
    """
    sine, cosine = sin_cos(angle)
    return float(0.5 * (size[0] * abs(cosine) + size[1] * abs(sine)))


# --- Margins of following with assumptions on how both brake, and how grave a collision is --------

_ROOT_HALF = 0.70710678118654752440
_TWO_OVER_ROOT_PI = 1.12837916709551257390


@compiled
def modified_deceleration_rate(gap: float, closing_speed: float, response_time: float) -> float:
    """Return the deceleration to avoid a crash with braking that begins late [m/s^2].

    Args:
        gap: [m].
        closing_speed: Rear minus front speed; the front vehicle keeps its speed [m/s].
        response_time: Time before the braking begins [s].

    Returns:
        ``closing_speed / (2 (ttc - response_time))``; 0 where the gap does not close, infinity
        where it is used up before the braking begins.

    Source:
        Fu and Sayed (2021), "Comparison of threshold determination methods for the deceleration
        rate to avoid a crash (DRAC)-based crash estimation".
    """
    if math.isnan(gap + closing_speed + response_time):
        return math.nan
    if closing_speed <= 0.0:
        return 0.0
    left = time_to_collision(gap, closing_speed) - response_time
    return closing_speed / (2.0 * left) if left > 0.0 else math.inf


@compiled
def deceleration_to_safety_time(
    gap: float, closing_speed: float, front_speed: float, safety_time: float
) -> float:
    """Return the deceleration that keeps a time gap behind the front vehicle [m/s^2].

    Args:
        gap: [m].
        closing_speed: Rear minus front speed [m/s].
        front_speed: Constant [m/s].
        safety_time: What is left between both in the end [s]; with 0 it is the deceleration rate to
            avoid a crash.

    Returns:
        ``closing_speed**2 / (2 (gap - front_speed safety_time))``; 0 where the gap does not close,
        infinity where the time gap is lost already.

    Source:
        Hupfer (1997), "Deceleration to safety time (DST) - a useful figure to evaluate traffic
        safety?".
    """
    if math.isnan(gap + closing_speed + front_speed + safety_time):
        return math.nan
    if closing_speed <= 0.0:
        return 0.0
    room = gap - front_speed * safety_time
    return closing_speed * closing_speed / (2.0 * room) if room > 0.0 else math.inf


@compiled
def margin_to_collision(gap: float, speed: float, front_speed: float, braking: float) -> float:
    """Return the room over the way to standstill, if both brake at once and equally.

    Args:
        gap: [m].
        speed: Of the rear vehicle [m/s].
        front_speed: Of the front vehicle; one that comes towards the rear one (< 0) uses room up
            [m/s].
        braking: Of both, > 0 [m/s^2].

    Returns:
        ``(gap + v_f**2 / 2b) / (v_r**2 / 2b)``, at least 0; below 1 they collide; infinity at
        standstill.

    Source:
        Kitajima, Marumo, Hiraoka, Itoh (2009), "Comparison of evaluation indices concerning
        estimation of driver's risk perception".
    """
    if math.isnan(gap + speed + front_speed + braking):
        return math.nan
    if speed <= 0.0:
        return math.inf
    room = 2.0 * braking * gap + front_speed * abs(front_speed)
    return 0.0 if room < 0.0 else room / (speed * speed)


@compiled
def proportion_of_stopping_distance(gap: float, speed: float, braking: float) -> float:
    """Return the distance to the conflict over the least way to standstill; below 1 it is too late.

    Args:
        gap: Distance to where the conflict is [m].
        speed: [m/s].
        braking: Largest, > 0 [m/s^2].

    Returns:
        ``gap / (speed**2 / (2 braking))``; infinity at standstill.

    Source:
        Allen, Shin, Cooper (1978), "Analysis of traffic conflicts and collisions".
    """
    if math.isnan(gap + speed + braking):
        return math.nan
    if gap <= 0.0:
        return 0.0
    return 2.0 * braking * gap / (speed * speed) if speed > 0.0 else math.inf


@compiled
def safe_distance_ratio(gap: float, safe_distance: float) -> float:
    """Return the gap over the safe distance; below 1 it is not kept, infinity where none is asked.

    Source:
        Shalev-Shwartz, Shammah, Shashua (2017), "On a formal model of safe and scalable
        self-driving cars", definition 1 for the distance.
    """
    if math.isnan(gap + safe_distance):
        return math.nan
    return gap / safe_distance if safe_distance > 0.0 else math.inf


@compiled
def normal_share(x: float) -> float:
    """Return the share of a standard normal distribution below x, to 1e-15.

    By the series of the error function, all of whose terms have the same sign.
    """
    if math.isnan(x):
        return math.nan
    if x > 8.3:
        return 1.0
    if x < -8.3:
        return 0.0
    z = x * _ROOT_HALF
    term = z
    total = z
    for number in range(1, 200):
        term *= 2.0 * z * z / (2.0 * number + 1.0)
        total += term
        if abs(term) <= 1e-17 * abs(total):
            break
    return 0.5 + 0.5 * _TWO_OVER_ROOT_PI * exp(-z * z) * total


@compiled
def crash_probability(
    needed: float, mean: float, deviation: float, least: float, most: float
) -> float:
    """Return the probability that a deceleration is more than the vehicle can brake.

    Args:
        needed: Deceleration [m/s^2].
        mean: Of the normally distributed largest deceleration [m/s^2].
        deviation: Its standard deviation, > 0 [m/s^2].
        least: Where the distribution is cut off [m/s^2].
        most: [m/s^2].

    Source:
        Cunto and Saccomanno (2008), "Calibration and validation of simulated vehicle safety
        performance at signalized intersections", crash potential index.
    """
    if math.isnan(needed + mean + deviation + least + most):
        return math.nan
    if needed <= least:
        return 0.0
    if needed >= most:
        return 1.0
    low = normal_share((least - mean) / deviation)
    high = normal_share((most - mean) / deviation)
    return (normal_share((needed - mean) / deviation) - low) / (high - low)


@compiled
def speed_change(own_mass: float, other_mass: float, relative_speed: float) -> float:
    """Return by how much a collision changes the speed of one body, if both go on as one [m/s].

    Args:
        own_mass: [kg].
        other_mass: [kg]; infinity for what does not move.
        relative_speed: Size of the relative velocity at contact [m/s].

    Source:
        Shelby (2011), "Delta-V as a measure of traffic conflict severity".
    """
    if other_mass == math.inf:
        return relative_speed
    return other_mass / (own_mass + other_mass) * relative_speed


@compiled
def fatality_probability(change: float) -> float:
    """Return the probability that an occupant dies of a change of speed [m/s], at most 1.

    Source:
        Joksch (1993), "Velocity change and fatality risk in a crash: a rule of thumb":
        ``(change / 71 mph)**4``.
    """
    share = change / 31.74
    share *= share
    return min(1.0, share * share) if not math.isnan(change) else math.nan
