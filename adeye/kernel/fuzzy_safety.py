"""Fuzzy surrogate safety metrics of following: how unsafe a distance is, from 0 to 1.

Source:
    Mattas et al. (2020), "Fuzzy surrogate safety metrics for real-time assessment of rear-end
    collision risk"; UN Regulation 157, 01 series of amendments, annex 4 appendix 3.
"""

from __future__ import annotations

import math

from adeye.kernel.jit import compiled

__all__ = ["critical_fuzzy_safety", "proactive_fuzzy_safety"]


@compiled
def proactive_fuzzy_safety(
    gap: float,
    rear_speed: float,
    front_speed: float,
    delay: float,
    comfortable: float,
    most: float,
    lead_braking: float,
    margin: float,
) -> float:
    """Return how unsafe a distance is if the front vehicle should brake, 0 to 1 (PFS).

    Args:
        gap: Bumper-to-bumper distance [m].
        rear_speed: >= 0 [m/s].
        front_speed: >= 0 [m/s].
        delay: Reaction time of the rear vehicle [s].
        comfortable: Comfortable braking of the rear vehicle, > 0 [m/s^2].
        most: Its full braking, > ``comfortable`` [m/s^2].
        lead_braking: Braking of the front vehicle, > 0 [m/s^2].
        margin: Distance at standstill; also what a safe distance has in addition [m].

    Source:
        UN R157, 01 series, annex 4 appendix 3; Mattas et al. (2020), equations 6 to 8.
    """
    if math.isnan(gap + rear_speed + front_speed):
        return math.nan
    way = rear_speed * delay - front_speed * front_speed / (2.0 * lead_braking)
    square = rear_speed * rear_speed
    safe = way + square / (2.0 * comfortable) + margin
    unsafe = way + square / (2.0 * most)
    return _membership(gap - margin, unsafe, safe)


@compiled
def critical_fuzzy_safety(
    gap: float,
    rear_speed: float,
    front_speed: float,
    rear_acceleration: float,
    delay: float,
    comfortable: float,
    most: float,
    is_raw: bool,  # noqa: FBT001 - compiled
) -> float:
    """Return how unsafe a distance is at the present speeds and acceleration, 0 to 1 (CFS).

    Args:
        gap: Bumper-to-bumper distance [m].
        rear_speed: >= 0 [m/s].
        front_speed: >= 0 [m/s].
        rear_acceleration: [m/s^2].
        delay: Reaction time of the rear vehicle [s].
        comfortable: Comfortable braking of the rear vehicle, > 0 [m/s^2].
        most: Its full braking, > ``comfortable`` [m/s^2].
        is_raw: Whether a rear vehicle that is slow enough after its delay is judged by its whole
            braking, as in the published code, instead of at most the comfortable one.

    Source:
        UN R157, 01 series, annex 4 appendix 3; Mattas et al. (2020), equations 9 to 13.
    """
    if math.isnan(gap + rear_speed + front_speed + rear_acceleration):
        return math.nan
    closing = rear_speed - front_speed
    if closing <= 0.0:
        return 0.0
    counted = max(rear_acceleration, -comfortable)
    reached = rear_speed + counted * delay
    if reached <= front_speed:
        braking = abs(rear_acceleration) if is_raw else abs(counted)
        return 1.0 if gap < closing * closing / (2.0 * braking) else 0.0
    way = (0.5 * (rear_speed + reached) - front_speed) * delay
    square = (reached - front_speed) * (reached - front_speed)
    return _membership(gap, way + square / (2.0 * most), way + square / (2.0 * comfortable))


@compiled
def _membership(distance: float, unsafe: float, safe: float) -> float:
    """Return 1 below the unsafe distance, 0 from the safe one on, linear between."""
    if distance >= safe:
        return 0.0
    return 1.0 if distance <= unsafe else (safe - distance) / (safe - unsafe)
