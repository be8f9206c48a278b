"""What the drivers of a run decide: speed by IDM, lanes by MOBIL, one driver after the other.

A driver sees the lanes that those before it have just chosen. Everybody's place stays as it was at
the beginning of the tick, so steering can follow when all have decided.

Source:
    Treiber, Hennecke, Helbing (2000), "Congested traffic states in empirical observations and
    microscopic simulations"; Kesting, Treiber, Helbing (2007), "General lane-changing model MOBIL
    for car-following models". Parameters, order and formulas are those of highway-env 1.12
    (``vehicle/behavior.py``), with politeness zero and without routes.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import power
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import clip
from adeye.kernel.traffic.lanes import LANE_LENGTH, LIMIT, is_reachable, lane_local
from adeye.kernel.traffic.network import (
    ACCELERATION,
    BRAKING,
    CHANGING,
    COSINE,
    COUNT,
    CRASHED,
    CRUISING,
    DESIRED_SPEED,
    EXPONENT,
    FIRST,
    FIXED,
    FOLLOWING,
    GAIN,
    JAM_DISTANCE,
    LANE,
    LENGTH,
    PLACE,
    ROLE,
    SINUS,
    SPEED,
    TARGET,
    TIME_GAP,
    TIMER,
    Road,
    S,
    X,
    Y,
    forget_lists,
    front_listed,
    list_around,
    neighbours,
    next_lane,
    place_along,
    rear_listed,
    see_around,
    sort_along,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MAX_ACCELERATION: Final = 6.0
"""Of a driver who follows, either way [m/s²]."""

SPEED_TIME: Final = 0.6
"""In which one who cruises closes the gap to its desired speed [s]."""

CHANGE_PERIOD: Final = 1.0
"""Time between two thoughts of changing lanes [s]."""

LEAST_GAIN: Final = 0.2
"""Acceleration that a change must bring [m/s²]."""

IMPOSED_BRAKING: Final = 2.0
"""Braking that a change may ask of the new follower [m/s²]."""

LEAST_SPEED: Final = 1.0
"""Slower than this nobody changes lanes [m/s]."""

PASSED: Final = 2.5
"""So far before its end a lane is left for the next [m]."""

MANY: Final = 12
"""From so many things on the road, lists are faster than looking at everybody."""


@inlined
def not_zero(value: float) -> float:
    """Return a divisor away from zero, by highway-env's 0.01."""
    if abs(value) > 1e-2:
        return value
    return 1e-2 if value >= 0.0 else -1e-2


@inlined
def desired_gap(vehicles: Floats, driver: int, rear: int, front: int) -> float:
    """Return the distance between centres that a driver thinks right for a pair [m].

    Args:
        vehicles: (N, VEHICLE_WIDTH).
        driver: Whose parameters count.
        rear: Who is behind.
        front: Who is ahead.
    """
    speed = vehicles[rear, SPEED]
    closing = (
        speed * vehicles[rear, COSINE] - vehicles[front, SPEED] * vehicles[front, COSINE]
    ) * vehicles[rear, COSINE] + (
        speed * vehicles[rear, SINUS] - vehicles[front, SPEED] * vehicles[front, SINUS]
    ) * vehicles[rear, SINUS]
    gap = (
        vehicles[driver, JAM_DISTANCE]
        + speed * vehicles[driver, TIME_GAP]
        + speed * closing / vehicles[driver, BRAKING]
    )
    # The jam distance is meant for three vehicles of the driver's length.
    own = vehicles[driver, LENGTH]
    return gap + 0.5 * ((vehicles[rear, LENGTH] - own) + (vehicles[front, LENGTH] - own))


@inlined
def _free_acceleration(vehicles: Floats, driver: int, who: int, limit: float) -> float:
    """Return the acceleration of a vehicle on an empty lane, as a driver thinks [m/s²]."""
    desired = clip(vehicles[who, DESIRED_SPEED], 0.0, limit)
    ratio = max(vehicles[who, SPEED], 0.0) / abs(not_zero(desired))
    return vehicles[driver, GAIN] * (1.0 - power(ratio, vehicles[driver, EXPONENT]))


@inlined
def _interaction(vehicles: Floats, driver: int, rear: int, front: int, distance: float) -> float:
    """Return what the vehicle ahead takes from the acceleration of the one behind [m/s²]."""
    share = desired_gap(vehicles, driver, rear, front) / not_zero(distance)
    return vehicles[driver, GAIN] * (share * share)


@inlined
def following_acceleration(road: Road, driver: int, rear: int, front: int) -> float:
    """Return the acceleration of a vehicle behind another one, as a driver thinks [m/s²].

    Args:
        road: As it is.
        driver: Whose parameters count.
        rear: Who accelerates; 0 for nobody (-1) and for fixed objects.
        front: Who drives ahead of it, -1 for nobody.
    """
    acceleration = 0.0
    if rear >= 0 and road.marks[rear, ROLE] != FIXED:
        lane = road.marks[rear, LANE]
        acceleration = _free_acceleration(road.vehicles, driver, rear, road.lanes[lane, LIMIT])
        if front >= 0:
            distance = place_along(road, lane, front) - road.vehicles[rear, S]
            acceleration -= _interaction(road.vehicles, driver, rear, front, distance)
    return acceleration


@inlined
def _find_front(road: Road, lane: int, who: int, s: float) -> int:
    if road.vehicles.shape[0] < MANY:
        see_around(road, lane)
        front, _ = neighbours(road, lane, who, s)
    else:
        list_around(road, lane)
        front = front_listed(road, lane, who, s)
    return front


@inlined
def _find_both(road: Road, lane: int, who: int, s: float) -> tuple[int, int]:
    if road.vehicles.shape[0] < MANY:
        see_around(road, lane)
        front, rear = neighbours(road, lane, who, s)
    else:
        list_around(road, lane)
        front = front_listed(road, lane, who, s)
        rear = rear_listed(road, lane, who, s)
    return front, rear


@inlined
def _should_abort(road: Road, who: int) -> bool:
    """Tell whether somebody close ahead is on the way to the same lane."""
    lane, target = road.marks[who, LANE], road.marks[who, TARGET]
    found = False
    for other in range(road.vehicles.shape[0]):
        if (
            other != who
            and road.marks[other, TARGET] == target
            and road.marks[other, LANE] != target
            and road.marks[other, ROLE] >= CRUISING
        ):
            distance = place_along(road, lane, other) - road.vehicles[who, S]
            found |= 0.0 < distance < desired_gap(road.vehicles, who, who, other)
    return found


@inlined
def _is_better(road: Road, who: int, free: float, here: float, lane: int, s: float) -> bool:
    """Tell whether MOBIL wants a change to a lane, where the driver would be at a place [m].

    ``free`` is its acceleration on an empty lane, ``here`` that on its own lane [m/s²].
    """
    ahead, behind = _find_both(road, lane, who, s)
    there = free
    if ahead >= 0:
        own = road.marks[who, LANE]
        distance = place_along(road, own, ahead) - road.vehicles[who, S]
        there = free - _interaction(road.vehicles, who, who, ahead, distance)
    # The cheaper half of the question first.
    if there - here < LEAST_GAIN:
        return False
    imposed = following_acceleration(road, who, behind, who)
    return not imposed < -IMPOSED_BRAKING


@compiled
def _choose_lane(road: Road, who: int, free: float, here: float) -> None:
    """Go on with a change of lanes, give it up, or think of one as it is time to."""
    lane = road.marks[who, LANE]
    target = road.marks[who, TARGET]
    if lane != target:
        if road.links[lane, FIRST] == road.links[target, FIRST] and _should_abort(road, who):
            road.marks[who, TARGET] = lane
        return
    road.vehicles[who, TIMER] = 0.0
    if abs(road.vehicles[who, SPEED]) < LEAST_SPEED:
        return
    place, count = road.links[lane, PLACE], road.links[lane, COUNT]
    for side in range(-1, 2, 2):
        if not 0 <= place + side < count:
            continue
        other = lane + side
        s, lateral = lane_local(road.lanes, other, road.vehicles[who, X], road.vehicles[who, Y])
        if is_reachable(road.lanes, other, s, lateral) and _is_better(
            road, who, free, here, other, s
        ):
            road.marks[who, TARGET] = other


@inlined
def _follow_road(road: Road, who: int) -> None:
    """Steer for the next lane near the end of one."""
    target = road.marks[who, TARGET]
    s = place_along(road, target, who)
    if s > road.lanes[target, LANE_LENGTH] - PASSED:
        road.marks[who, TARGET] = next_lane(
            road.lanes, road.links, target, road.vehicles[who, X], road.vehicles[who, Y]
        )


@inlined
def _decide_one(road: Road, who: int) -> None:
    lane = road.marks[who, LANE]
    front = _find_front(road, lane, who, road.vehicles[who, S])
    free = _free_acceleration(road.vehicles, who, who, road.lanes[lane, LIMIT])
    acceleration = free
    if front >= 0:
        distance = place_along(road, lane, front) - road.vehicles[who, S]
        acceleration = free - _interaction(road.vehicles, who, who, front, distance)
    if road.marks[who, ROLE] == CHANGING and (
        road.marks[who, TARGET] != lane or road.vehicles[who, TIMER] > CHANGE_PERIOD
    ):
        _choose_lane(road, who, free, acceleration)
    target = road.marks[who, TARGET]
    if target != lane:
        s = place_along(road, target, who)
        front = _find_front(road, target, who, s)
        other = free
        if front >= 0:
            # Measured along the lane that it is on, whichever the other one is found on.
            distance = place_along(road, lane, front) - road.vehicles[who, S]
            other = free - _interaction(road.vehicles, who, who, front, distance)
        acceleration = min(acceleration, other)
    road.vehicles[who, ACCELERATION] = clip(acceleration, -MAX_ACCELERATION, MAX_ACCELERATION)


@inlined
def decide(road: Road) -> None:
    """Let the drivers of a run choose lanes and accelerations, one after the other.

    Args:
        road: In and out: timers, accelerations and target lanes.
    """
    forget_lists(road.listed)
    if road.vehicles.shape[0] >= MANY:
        sort_along(road.vehicles, road.marks)
    for who in range(road.vehicles.shape[0]):
        role = road.marks[who, ROLE]
        # One who cruises follows the road even after a crash, in highway-env.
        if role < CRUISING or (role >= FOLLOWING and road.marks[who, CRASHED] != 0):
            continue
        _follow_road(road, who)
        if role >= FOLLOWING:
            _decide_one(road, who)
            continue
        missing = road.vehicles[who, DESIRED_SPEED] - road.vehicles[who, SPEED]
        road.vehicles[who, ACCELERATION] = 1.0 / SPEED_TIME * missing
