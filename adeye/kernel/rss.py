"""Safe distances of responsibility-sensitive safety (RSS): behind, towards and beside others.

Source:
    Shalev-Shwartz, Shammah, Shashua (2017), "On a formal model of safe and scalable self-driving
    cars"; beside others, and where speeds or distances are limited, as the ad-rss library 5.0 does.
"""

from __future__ import annotations

import math

from adeye.kernel.jit import compiled

__all__ = [
    "rss_lateral_distance",
    "rss_lateral_distance_printed",
    "rss_longitudinal_distance",
    "rss_opposite_distance",
]


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
) -> float:
    """Return the safe distance beside each other [m].

    Who still moves away after its response has no way of braking to be kept free, and two that
    move apart for long enough need no distance at all.

    Args:
        speed_1: Lateral speed of the one towards the other, positive in that direction [m/s].
        speed_2: Lateral speed of the other, positive in the same direction (away) [m/s].
        response_time_1: [s].
        response_time_2: [s].
        acceleration: Largest lateral acceleration towards each other while they respond [m/s^2].
        braking: Least lateral braking afterwards, > 0 [m/s^2].
        fluctuation: Margin for swaying in the lane [m].

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
    if reached_1 > 0.0:
        way_1 += reached_1 * reached_1 / (2.0 * braking)
    if reached_2 < 0.0:
        way_2 -= reached_2 * reached_2 / (2.0 * braking)
    return _positive_part(fluctuation + (way_1 - way_2))


@compiled
def rss_lateral_distance_printed(
    speed_1: float,
    speed_2: float,
    response_time_1: float,
    response_time_2: float,
    acceleration: float,
    braking: float,
    fluctuation: float,
) -> float:
    """Return the safe distance beside each other as the definition is printed [m].

    Braking terms keep their sign when a vehicle moves away, and the margin is always kept: it asks
    for more than ``rss_lateral_distance`` where somebody moves away, never for less.

    Args:
        speed_1: As there [m/s].
        speed_2: As there [m/s].
        response_time_1: [s].
        response_time_2: [s].
        acceleration: As there [m/s^2].
        braking: As there [m/s^2].
        fluctuation: As there [m].

    Source:
        Definition 6, with a response time each.
    """
    if math.isnan(braking):
        return math.nan
    if braking <= 0.0:
        return math.inf
    reached_1 = speed_1 + response_time_1 * acceleration
    reached_2 = speed_2 - response_time_2 * acceleration
    way_1 = 0.5 * (speed_1 + reached_1) * response_time_1 + reached_1 * reached_1 / (2.0 * braking)
    way_2 = 0.5 * (speed_2 + reached_2) * response_time_2 - reached_2 * reached_2 / (2.0 * braking)
    return fluctuation + _positive_part(way_1 - way_2)
