"""How drivers decide on one straight road, in the fast arithmetic.

Where all lanes lie side by side, a place along one of them is a place along all. So everybody is
sorted once, and one sweep against the traffic tells who drives ahead of whom. The model is that of
``kernel.traffic.drivers``.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import near_power, power
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import clip
from adeye.kernel.traffic.drivers import (
    CHANGE_PERIOD,
    IMPOSED_BRAKING,
    LEAST_GAIN,
    LEAST_SPEED,
    MANY,
    MAX_ACCELERATION,
    SPEED_TIME,
    not_zero,
)
from adeye.kernel.traffic.lanes import (
    FORBIDDEN,
    LANE_LENGTH,
    LIMIT,
    OVERHANG,
    WIDTH,
    is_on_lane,
    straight_local,
)
from adeye.kernel.traffic.network import (
    ACCELERATION,
    BRAKING,
    CHANGING,
    COSINE,
    CRASHED,
    CRUISING,
    DESIRED_SPEED,
    EXPONENT,
    FIXED,
    FOLLOWING,
    GAIN,
    JAM_DISTANCE,
    LANE,
    LENGTH,
    MARGIN,
    ORDER,
    RANK,
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
    sort_along,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_DIVISOR: Final = 1e-2
"""Nothing nearer to zero divides, as in ``drivers.not_zero``."""


@inlined
def _is_seen(lanes: Floats, vehicles: Floats, lane: int, who: int) -> bool:
    """Tell whether somebody is seen on a lane."""
    _, lateral = straight_local(lanes, lane, vehicles[who, X], vehicles[who, Y])
    return is_on_lane(lanes, lane, vehicles[who, S], lateral, MARGIN)


@inlined
def _speed_ratio(vehicles: Floats, who: int, limit: float) -> float:
    """Return the share of its desired speed that somebody drives at."""
    desired = max(min(vehicles[who, DESIRED_SPEED], limit), LEAST_DIVISOR)
    return max(vehicles[who, SPEED], 0.0) / desired


@inlined
def _free_acceleration(vehicles: Floats, driver: int, who: int, limit: float) -> float:
    """Return the acceleration of a vehicle on an empty lane, as a driver thinks [m/s²]."""
    ratio = _speed_ratio(vehicles, who, limit)
    square = ratio * ratio
    raised = square * square
    if vehicles[driver, EXPONENT] != 4.0:
        raised = power(ratio, vehicles[driver, EXPONENT])
    return vehicles[driver, GAIN] * (1.0 - raised)


@inlined
def _find_free(road: Road, free: Floats, scratch: Floats) -> None:
    """Write the acceleration of everybody on an empty lane to the first row (L, N) [m/s²].

    The powers are taken of all at once, in a loop that the compiler makes vectors of.
    """
    is_usual = True
    for who in range(road.vehicles.shape[0]):
        free[0, who] = _speed_ratio(road.vehicles, who, road.lanes[road.marks[who, LANE], LIMIT])
        scratch[0, who] = road.vehicles[who, EXPONENT]
        is_usual &= road.vehicles[who, EXPONENT] == 4.0
    if is_usual:
        for who in range(road.vehicles.shape[0]):
            square = free[0, who] * free[0, who]
            free[0, who] = road.vehicles[who, GAIN] * (1.0 - square * square)
        return
    for who in range(road.vehicles.shape[0]):
        scratch[0, who] = near_power(
            min(max(free[0, who], 0.25), 1.5), min(max(scratch[0, who], -16.0), 16.0)
        )
    for who in range(road.vehicles.shape[0]):
        raised, exponent = scratch[0, who], road.vehicles[who, EXPONENT]
        if not (0.25 <= free[0, who] <= 1.5 and abs(exponent) <= 16.0):
            raised = power(free[0, who], exponent)
        free[0, who] = road.vehicles[who, GAIN] * (1.0 - raised)


@inlined
def _desired_gap(vehicles: Floats, driver: int, rear: int, front: int) -> float:
    """Return the distance between centres that a driver thinks right for a pair [m]."""
    speed = vehicles[rear, SPEED]
    level = (
        vehicles[rear, COSINE] * vehicles[front, COSINE]
        + vehicles[rear, SINUS] * vehicles[front, SINUS]
    )
    closing = speed - vehicles[front, SPEED] * level
    jam = vehicles[driver, JAM_DISTANCE] - vehicles[driver, LENGTH]
    jam += 0.5 * (vehicles[rear, LENGTH] + vehicles[front, LENGTH])
    return jam + speed * (vehicles[driver, TIME_GAP] + closing / vehicles[driver, BRAKING])


@inlined
def _interaction(vehicles: Floats, driver: int, rear: int, front: int) -> float:
    """Return what the vehicle ahead takes from the acceleration of the one behind [m/s²]."""
    distance = vehicles[front, S] - vehicles[rear, S]
    share = _desired_gap(vehicles, driver, rear, front) / not_zero(distance)
    return vehicles[driver, GAIN] * (share * share)


@inlined
def _front_of_few(lanes: Floats, vehicles: Floats, lane: int, who: int) -> int:
    """Return who is ahead of somebody on a lane by looking at everybody; of equals the last."""
    front, front_s = -1, math.inf
    s = vehicles[who, S]
    for other in range(vehicles.shape[0]):
        place = vehicles[other, S]
        if s <= place <= front_s and other != who and _is_seen(lanes, vehicles, lane, other):
            front, front_s = other, place
    return front


@inlined
def _rear_of_few(lanes: Floats, vehicles: Floats, lane: int, who: int) -> int:
    """Return who is behind somebody on a lane by looking at everybody; of equals the first."""
    rear, rear_s = -1, -math.inf
    s = vehicles[who, S]
    for other in range(vehicles.shape[0]):
        place = vehicles[other, S]
        if rear_s < place < s and _is_seen(lanes, vehicles, lane, other):
            rear, rear_s = other, place
    return rear


@inlined
def _front_in_order(road: Road, lane: int, who: int) -> int:
    """Do what ``_front_of_few`` does, going ahead from somebody in the order along the road."""
    front, front_s = -1, math.inf
    s = road.vehicles[who, S]
    k = road.marks[who, RANK]
    while k > 0 and road.vehicles[road.marks[k - 1, ORDER], S] == s:
        k -= 1
    while k < road.marks.shape[0]:
        other = road.marks[k, ORDER]
        if road.vehicles[other, S] > front_s:
            break
        if other != who and other > front and _is_seen(road.lanes, road.vehicles, lane, other):
            front, front_s = other, road.vehicles[other, S]
        k += 1
    return front


@inlined
def _rear_in_order(road: Road, lane: int, who: int) -> int:
    """Do what ``_rear_of_few`` does, going back from somebody in the order along the road."""
    rear, rear_s = -1, -math.inf
    s = road.vehicles[who, S]
    k = road.marks[who, RANK] - 1
    while k >= 0:
        other = road.marks[k, ORDER]
        place = road.vehicles[other, S]
        if place < rear_s:
            break
        if (
            place < s
            and (rear < 0 or other < rear)
            and _is_seen(road.lanes, road.vehicles, lane, other)
        ):
            rear, rear_s = other, place
        k -= 1
    return rear


@compiled
def _front(road: Road, lane: int, who: int) -> int:
    """Return who is ahead of somebody on a lane, -1 for nobody."""
    if road.vehicles.shape[0] < MANY:
        return _front_of_few(road.lanes, road.vehicles, lane, who)
    return _front_in_order(road, lane, who)


@inlined
def _rear(road: Road, lane: int, who: int) -> int:
    """Return who is behind somebody on a lane, -1 for nobody."""
    if road.vehicles.shape[0] < MANY:
        return _rear_of_few(road.lanes, road.vehicles, lane, who)
    return _rear_in_order(road, lane, who)


@inlined
def _find_fronts(road: Road) -> None:
    """Find who is ahead of everybody on the own lane: written to the first row of the lists.

    Going back from the foremost, the first column says who was seen last on each lane.
    """
    sort_along(road.vehicles, road.marks)
    for lane in range(road.lanes.shape[0]):
        road.listed[lane, 0] = -1
    tied = False
    passed = math.inf
    for k in range(road.marks.shape[0] - 1, -1, -1):
        who = road.marks[k, ORDER]
        road.marks[who, RANK] = k
        road.listed[0, 1 + who] = road.listed[road.marks[who, LANE], 0]
        tied |= road.vehicles[who, S] == passed
        passed = road.vehicles[who, S]
        for lane in range(road.lanes.shape[0]):
            if _is_seen(road.lanes, road.vehicles, lane, who):
                road.listed[lane, 0] = who
    if tied:
        # Of two abreast each is ahead of the other.
        for who in range(road.marks.shape[0]):
            road.listed[0, 1 + who] = _front(road, road.marks[who, LANE], who)


@compiled
def _should_abort(road: Road, who: int) -> bool:
    """Tell whether somebody close ahead is on the way to the same lane."""
    target = road.marks[who, TARGET]
    found = False
    for other in range(road.vehicles.shape[0]):
        if (
            other != who
            and road.marks[other, TARGET] == target
            and road.marks[other, LANE] != target
            and road.marks[other, ROLE] >= CRUISING
        ):
            distance = road.vehicles[other, S] - road.vehicles[who, S]
            found |= 0.0 < distance < _desired_gap(road.vehicles, who, who, other)
    return found


@compiled
def _choose_lane(road: Road, who: int, free: float, here: float) -> float:
    """Think of changing lanes by MOBIL; return the acceleration of a lane that is better [m/s²].

    ``free`` is that on an empty lane, ``here`` that on the own one, which no better one leaves.
    """
    lane = road.marks[who, LANE]
    s = road.vehicles[who, S]
    chosen = here
    for other in range(max(lane - 1, 0), min(lane + 2, road.lanes.shape[0]), 2 if lane > 0 else 1):
        _, lateral = straight_local(road.lanes, other, road.vehicles[who, X], road.vehicles[who, Y])
        if (
            other == lane
            or road.lanes[other, FORBIDDEN] != 0.0
            or abs(lateral) > 2.0 * road.lanes[other, WIDTH]
            or not 0.0 <= s < road.lanes[other, LANE_LENGTH] + OVERHANG
        ):
            continue
        there = free
        ahead = _front(road, other, who)
        if ahead >= 0:
            there -= _interaction(road.vehicles, who, who, ahead)
        if there - here < LEAST_GAIN:
            continue
        behind = _rear(road, other, who)
        imposed = 0.0
        if behind >= 0 and road.marks[behind, ROLE] != FIXED:
            limit = road.lanes[road.marks[behind, LANE], LIMIT]
            imposed = _free_acceleration(road.vehicles, who, behind, limit)
            imposed -= _interaction(road.vehicles, who, behind, who)
        if not imposed < -IMPOSED_BRAKING:
            road.marks[who, TARGET] = other
            chosen = there
    return chosen


@inlined
def _decide_one(road: Road, who: int, front: int, free: float) -> float:
    """Choose the lane and return the acceleration of a driver, who knows who is ahead [m/s²]."""
    lane, target = road.marks[who, LANE], road.marks[who, TARGET]
    here = free
    if front >= 0:
        here -= _interaction(road.vehicles, who, who, front)
    there = here
    if target != lane:
        if road.marks[who, ROLE] == CHANGING and _should_abort(road, who):
            road.marks[who, TARGET] = lane
        else:
            ahead = _front(road, target, who)
            there = free
            if ahead >= 0:
                there -= _interaction(road.vehicles, who, who, ahead)
    elif road.marks[who, ROLE] == CHANGING and road.vehicles[who, TIMER] > CHANGE_PERIOD:
        road.vehicles[who, TIMER] = 0.0
        if abs(road.vehicles[who, SPEED]) >= LEAST_SPEED:
            there = _choose_lane(road, who, free, here)
    return min(here, there)


@inlined
def decide_alongside(road: Road) -> None:
    """Do what ``drivers.decide`` does, on one straight road.

    Args:
        road: In and out: timers, accelerations and target lanes; see ``network.mark_alongside``.
    """
    is_many = road.vehicles.shape[0] >= MANY
    if is_many:
        _find_fronts(road)
        _find_free(road, road.seen, road.along)
    for who in range(road.vehicles.shape[0]):
        role = road.marks[who, ROLE]
        if role < CRUISING or (role >= FOLLOWING and road.marks[who, CRASHED] != 0):
            continue
        if role >= FOLLOWING:
            if is_many:
                front, free = road.listed[0, 1 + who], road.seen[0, who]
            else:
                lane = road.marks[who, LANE]
                front = _front_of_few(road.lanes, road.vehicles, lane, who)
                free = _free_acceleration(road.vehicles, who, who, road.lanes[lane, LIMIT])
            acceleration = _decide_one(road, who, front, free)
            road.vehicles[who, ACCELERATION] = clip(
                acceleration, -MAX_ACCELERATION, MAX_ACCELERATION
            )
            continue
        missing = road.vehicles[who, DESIRED_SPEED] - road.vehicles[who, SPEED]
        road.vehicles[who, ACCELERATION] = 1.0 / SPEED_TIME * missing
