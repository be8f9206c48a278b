"""What the reference drivers share: what is ahead, the delay, the ramp, the end of a danger.

Source:
    Mattas et al. (2020), "Fuzzy surrogate safety metrics for real-time assessment of rear-end
    collision risk"; UN Regulation 157, 01 series of amendments, annex 4 appendix 3.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.criticality import rss_longitudinal_distance, time_to_collision
from adeye.kernel.jit import compiled
from adeye.kernel.reference_drivers.parameters import (
    BESIDE,
    CAME_FROM_SIDE,
    CC,
    CC_HEADWAY,
    COASTING,
    DECELERATION,
    DELAY,
    DELAYED,
    EGO_SPEED,
    FSM,
    FSM_COMFORTABLE,
    FSM_LEAD_BRAKING,
    FSM_MARGIN,
    GAP,
    JERK,
    LATERAL_GAP,
    LENGTHS,
    OTHER_ACCELERATION,
    OTHER_SPEED,
    REACTING,
    REG157_HEADWAY,
    RSS,
    RSS_ACCELERATION,
    RSS_LEAD_BRAKES,
    RSS_LEAST_BRAKING,
    RSS_MOST_BRAKING,
    S_EGO_SPEED,
    S_GAP,
    S_LANE_WIDTH,
    S_LATERAL_ACCELERATION,
    S_LATERAL_OFFSET,
    S_LATERAL_SPEED,
    S_OTHER_SPEED,
    S_OTHER_WIDTH,
    VIEW_SIZE,
)

# --- What the reference drivers share: what is ahead, the delay, the ramp, the end of a danger ----

Floats = NDArray[np.float64]

# Sums of steps may miss a time by their rounding, differences a deceleration or nothing.
ROUNDING: Final = 1e-9


@compiled
def is_unknown(view: Floats) -> bool:
    """Tell whether something that is seen is no number."""
    total = 0.0
    for column in range(VIEW_SIZE):
        total += 0.0 * view[column]
    return math.isnan(total)


@compiled
def is_ahead(view: Floats, parameters: Floats) -> bool:
    """Tell whether the other is ahead of the ego, or as far beside it as counts."""
    return view[GAP] >= -parameters[BESIDE] * view[LENGTHS]


@compiled
def note_side(view: Floats, state: Floats) -> None:
    """Note whether the other is one that cuts in; who is no longer nearer is a lead."""
    if view[LATERAL_GAP] > 0.0:
        state[CAME_FROM_SIDE] = 1.0
    elif view[EGO_SPEED] <= view[OTHER_SPEED]:
        state[CAME_FROM_SIDE] = 0.0


@compiled
def is_lead_at_once(view: Floats, parameters: Floats, state: Floats) -> bool:
    """Tell whether a lead brakes or closes in, or did so since: the answer goes to standstill."""
    if view[LATERAL_GAP] > 0.0 or state[CAME_FROM_SIDE] > 0.0 or not is_ahead(view, parameters):
        return False
    closes = view[EGO_SPEED] - view[OTHER_SPEED] > ROUNDING
    return closes or view[OTHER_ACCELERATION] < -ROUNDING or state[REACTING] > 0.0


@compiled
def respond(parameters: Floats, state: Floats, most: float, step: float) -> float:
    """Return the acceleration of one tick of a driver who has decided to brake [m/s^2]."""
    if state[DELAYED] < parameters[DELAY] - ROUNDING:
        state[DELAYED] += step
        state[DECELERATION] = parameters[COASTING]
    else:
        state[DECELERATION] = min(state[DECELERATION] + parameters[JERK] * step, most)
    return 0.0 - state[DECELERATION]


@compiled
def react(
    parameters: Floats,
    state: Floats,
    is_dangerous: bool,  # noqa: FBT001 - compiled
    most: float,
    step: float,
) -> float:
    """Return the limit of a driver who brakes as long as there is danger, and no longer.

    How hard it braked is remembered: a danger that flickers is no new ramp each time.
    """
    if is_dangerous:
        state[REACTING] = 1.0
        return respond(parameters, state, most, step)
    state[REACTING] = 0.0
    return math.inf


# --- Distances that reference drivers keep, and the cut-ins that UN R157 asks to master -----------

VISIBLE: Final = 0.72
"""For how long the lateral movement must have been visible before the lane intrusion [s]."""

# UN R157, paragraph 5.2.3.3: speed [km/h] and minimum time gap [s] for M1 and N1.
_SPEEDS: Final = (7.2, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
_TIME_GAPS: Final = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6)
_STANDSTILL: Final = 2.0


@compiled
def r157_following_distance(speed: float) -> float:
    """Return the least following distance of a car [m].

    Args:
        speed: >= 0 [m/s].

    Returns:
        The distance of the interpolated time gap; 2 m at least; the time gap of 60 km/h above it.

    Source:
        UN R157, paragraph 5.2.3.3, M1 and N1.
    """
    if math.isnan(speed):
        return math.nan
    gap = _TIME_GAPS[6]
    for k in range(6, 0, -1):
        high = _SPEEDS[k] / 3.6
        low = _SPEEDS[k - 1] / 3.6
        if speed <= high:
            share = max(speed - low, 0.0) / (high - low)
            gap = _TIME_GAPS[k - 1] + share * (_TIME_GAPS[k] - _TIME_GAPS[k - 1])
    return max(speed * gap, _STANDSTILL)


@compiled
def following_distance(model: int, parameters: Floats, speed: float) -> float:
    """Return the gap with which a driver follows a vehicle as fast as itself [m].

    Args:
        model: CC, FSM, RSS or REG157.
        parameters: Of that model.
        speed: >= 0 [m/s].
    """
    if model == CC:
        headway = parameters[CC_HEADWAY]
        return speed * (headway if headway < math.inf else 2.0)
    if model == FSM:
        distance = speed * parameters[DELAY] + 2.0 * parameters[FSM_MARGIN]
        distance += speed * speed / (2.0 * parameters[FSM_COMFORTABLE])
        return distance - speed * speed / (2.0 * parameters[FSM_LEAD_BRAKING])
    if model == RSS:
        # Where the lead is by then, and how fast.
        time, braking = parameters[RSS_LEAD_BRAKES], parameters[RSS_MOST_BRAKING]
        return 0.5 * braking * time * time + rss_longitudinal_distance(
            speed,
            max(speed - braking * time, 0.0),
            parameters[DELAY],
            parameters[RSS_ACCELERATION],
            parameters[RSS_LEAST_BRAKING],
            parameters[RSS_MOST_BRAKING],
        )
    if parameters[REG157_HEADWAY] < math.inf:
        return speed * parameters[REG157_HEADWAY]
    return r157_following_distance(speed)


@compiled
def cut_in_threshold(closing_speed: float, delay: float, braking: float) -> float:
    """Return the TTC at the lane intrusion above which a cut-in must not end in contact [s].

    Args:
        closing_speed: Ego's minus the other's [m/s].
        delay: [s].
        braking: > 0 [m/s^2].

    Source:
        UN R157, paragraph 5.2.5.2: 0.35 s and 6 m/s^2.

    >>> round(cut_in_threshold(60.0 / 3.6, 0.35, 6.0), 3)
    1.739
    """
    return closing_speed / (2.0 * braking) + delay


@compiled
def must_be_avoided(scene: Floats, delay: float, braking: float, intrusion: float) -> float:
    """Tell whether paragraph 5.2.5.2 forbids a contact in a cut-in: 1, or 0 if it does not.

    Args:
        scene: Shape (SCENE_SIZE,).
        delay: Of the threshold [s].
        braking: Of the threshold [m/s^2].
        intrusion: Into the lane, at which the TTC is taken [m].

    Returns:
        NaN if a number is unknown, and where the other has intruded before the scene begins: the
        rule is about the moment at which it does.
    """
    closing = scene[S_EGO_SPEED] - scene[S_OTHER_SPEED]
    lateral = scene[S_LATERAL_SPEED]
    place = 0.5 * (scene[S_LANE_WIDTH] + scene[S_OTHER_WIDTH]) - intrusion
    if math.isnan(closing + lateral + place + scene[S_LATERAL_OFFSET] + scene[S_GAP]):
        return math.nan
    way = abs(scene[S_LATERAL_OFFSET]) - place
    growing, growth = scene[S_LATERAL_ACCELERATION], 0.0
    if 0.0 < growing < math.inf and lateral > 0.0:
        growth = lateral / growing
    if way + 0.5 * lateral * growth < 0.0:
        return math.nan
    if closing <= 0.0 or lateral <= 0.0:
        return 0.0
    # From the end of the growth on; the intrusion may be before it.
    moment = way / lateral
    if way < 0.0:
        moment = math.sqrt(2.0 * (way + 0.5 * lateral * growth) / growing) - growth
    if moment + growth < VISIBLE:
        return 0.0
    ttc = time_to_collision(scene[S_GAP] - moment * closing, closing)
    return 1.0 if ttc > cut_in_threshold(closing, delay, braking) else 0.0


# --- Fuzzy surrogate safety metrics of following: how unsafe a distance is, from 0 to 1 -----------


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
