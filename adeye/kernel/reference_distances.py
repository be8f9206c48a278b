"""Distances that reference drivers keep, and the cut-ins that UN R157 asks to master."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.criticality import time_to_collision
from adeye.kernel.jit import compiled
from adeye.kernel.reference_columns import (
    CC,
    CC_HEADWAY,
    DELAY,
    FSM,
    FSM_COMFORTABLE,
    FSM_LEAD_BRAKING,
    FSM_MARGIN,
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
)
from adeye.kernel.rss import rss_longitudinal_distance

__all__ = ["cut_in_threshold", "following_distance", "must_be_avoided", "r157_following_distance"]

Floats = NDArray[np.float64]

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
