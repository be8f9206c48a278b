"""Margins of following with assumptions on how both brake, and how grave a collision is.

As in ``criticality``: gaps bumper to bumper, decelerations as magnitudes, infinity for what cannot
be reached. NaN in, NaN out.
"""

from __future__ import annotations

import math

from adeye.kernel.criticality import time_to_collision
from adeye.kernel.elementary import exp
from adeye.kernel.jit import compiled

__all__ = [
    "crash_probability",
    "deceleration_to_safety_time",
    "fatality_probability",
    "margin_to_collision",
    "modified_deceleration_rate",
    "normal_share",
    "proportion_of_stopping_distance",
    "safe_distance_ratio",
    "speed_change",
]

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
