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
    S,
    X,
    Y,
    sort_along,
)

__all__ = ["decide_alongside"]

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
def _find_free(lanes: Floats, vehicles: Floats, marks: Ints, free: Floats, scratch: Floats) -> None:
    """Write the acceleration of everybody on an empty lane to the first row (L, N) [m/s²].

    The powers are taken of all at once, in a loop that the compiler makes vectors of.
    """
    is_usual = True
    for who in range(vehicles.shape[0]):
        free[0, who] = _speed_ratio(vehicles, who, lanes[marks[who, LANE], LIMIT])
        scratch[0, who] = vehicles[who, EXPONENT]
        is_usual &= vehicles[who, EXPONENT] == 4.0
    if is_usual:
        for who in range(vehicles.shape[0]):
            square = free[0, who] * free[0, who]
            free[0, who] = vehicles[who, GAIN] * (1.0 - square * square)
        return
    for who in range(vehicles.shape[0]):
        scratch[0, who] = near_power(
            min(max(free[0, who], 0.25), 1.5), min(max(scratch[0, who], -16.0), 16.0)
        )
    for who in range(vehicles.shape[0]):
        raised, exponent = scratch[0, who], vehicles[who, EXPONENT]
        if not (0.25 <= free[0, who] <= 1.5 and abs(exponent) <= 16.0):
            raised = power(free[0, who], exponent)
        free[0, who] = vehicles[who, GAIN] * (1.0 - raised)


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
def _front_in_order(lanes: Floats, vehicles: Floats, marks: Ints, lane: int, who: int) -> int:
    """Do what ``_front_of_few`` does, going ahead from somebody in the order along the road."""
    front, front_s = -1, math.inf
    s = vehicles[who, S]
    k = marks[who, RANK]
    while k > 0 and vehicles[marks[k - 1, ORDER], S] == s:
        k -= 1
    while k < marks.shape[0]:
        other = marks[k, ORDER]
        if vehicles[other, S] > front_s:
            break
        if other != who and other > front and _is_seen(lanes, vehicles, lane, other):
            front, front_s = other, vehicles[other, S]
        k += 1
    return front


@inlined
def _rear_in_order(lanes: Floats, vehicles: Floats, marks: Ints, lane: int, who: int) -> int:
    """Do what ``_rear_of_few`` does, going back from somebody in the order along the road."""
    rear, rear_s = -1, -math.inf
    s = vehicles[who, S]
    k = marks[who, RANK] - 1
    while k >= 0:
        other = marks[k, ORDER]
        place = vehicles[other, S]
        if place < rear_s:
            break
        if place < s and (rear < 0 or other < rear) and _is_seen(lanes, vehicles, lane, other):
            rear, rear_s = other, place
        k -= 1
    return rear


@compiled
def _front(lanes: Floats, vehicles: Floats, marks: Ints, lane: int, who: int) -> int:
    """Return who is ahead of somebody on a lane, -1 for nobody."""
    if vehicles.shape[0] < MANY:
        return _front_of_few(lanes, vehicles, lane, who)
    return _front_in_order(lanes, vehicles, marks, lane, who)


@inlined
def _rear(lanes: Floats, vehicles: Floats, marks: Ints, lane: int, who: int) -> int:
    """Return who is behind somebody on a lane, -1 for nobody."""
    if vehicles.shape[0] < MANY:
        return _rear_of_few(lanes, vehicles, lane, who)
    return _rear_in_order(lanes, vehicles, marks, lane, who)


@inlined
def _find_fronts(lanes: Floats, vehicles: Floats, marks: Ints, listed: Ints) -> None:
    """Find who is ahead of everybody on the own lane: written to the first row of the lists.

    Going back from the foremost, the first column says who was seen last on each lane.
    """
    sort_along(vehicles, marks)
    for lane in range(lanes.shape[0]):
        listed[lane, 0] = -1
    tied = False
    passed = math.inf
    for k in range(marks.shape[0] - 1, -1, -1):
        who = marks[k, ORDER]
        marks[who, RANK] = k
        listed[0, 1 + who] = listed[marks[who, LANE], 0]
        tied |= vehicles[who, S] == passed
        passed = vehicles[who, S]
        for lane in range(lanes.shape[0]):
            if _is_seen(lanes, vehicles, lane, who):
                listed[lane, 0] = who
    if tied:
        # Of two abreast each is ahead of the other.
        for who in range(marks.shape[0]):
            listed[0, 1 + who] = _front(lanes, vehicles, marks, marks[who, LANE], who)


@compiled
def _should_abort(vehicles: Floats, marks: Ints, who: int) -> bool:
    """Tell whether somebody close ahead is on the way to the same lane."""
    target = marks[who, TARGET]
    found = False
    for other in range(vehicles.shape[0]):
        if (
            other != who
            and marks[other, TARGET] == target
            and marks[other, LANE] != target
            and marks[other, ROLE] >= CRUISING
        ):
            distance = vehicles[other, S] - vehicles[who, S]
            found |= 0.0 < distance < _desired_gap(vehicles, who, who, other)
    return found


@compiled
def _choose_lane(
    lanes: Floats, vehicles: Floats, marks: Ints, who: int, free: float, here: float
) -> float:
    """Think of changing lanes by MOBIL; return the acceleration of a lane that is better [m/s²].

    ``free`` is that on an empty lane, ``here`` that on the own one, which no better one leaves.
    """
    lane = marks[who, LANE]
    s = vehicles[who, S]
    chosen = here
    for other in range(max(lane - 1, 0), min(lane + 2, lanes.shape[0]), 2 if lane > 0 else 1):
        _, lateral = straight_local(lanes, other, vehicles[who, X], vehicles[who, Y])
        if (
            other == lane
            or lanes[other, FORBIDDEN] != 0.0
            or abs(lateral) > 2.0 * lanes[other, WIDTH]
            or not 0.0 <= s < lanes[other, LANE_LENGTH] + OVERHANG
        ):
            continue
        there = free
        ahead = _front(lanes, vehicles, marks, other, who)
        if ahead >= 0:
            there -= _interaction(vehicles, who, who, ahead)
        if there - here < LEAST_GAIN:
            continue
        behind = _rear(lanes, vehicles, marks, other, who)
        imposed = 0.0
        if behind >= 0 and marks[behind, ROLE] != FIXED:
            limit = lanes[marks[behind, LANE], LIMIT]
            imposed = _free_acceleration(vehicles, who, behind, limit)
            imposed -= _interaction(vehicles, who, behind, who)
        if not imposed < -IMPOSED_BRAKING:
            marks[who, TARGET] = other
            chosen = there
    return chosen


@inlined
def _decide_one(
    lanes: Floats, vehicles: Floats, marks: Ints, who: int, front: int, free: float
) -> float:
    """Choose the lane and return the acceleration of a driver, who knows who is ahead [m/s²]."""
    lane, target = marks[who, LANE], marks[who, TARGET]
    here = free
    if front >= 0:
        here -= _interaction(vehicles, who, who, front)
    there = here
    if target != lane:
        if marks[who, ROLE] == CHANGING and _should_abort(vehicles, marks, who):
            marks[who, TARGET] = lane
        else:
            ahead = _front(lanes, vehicles, marks, target, who)
            there = free
            if ahead >= 0:
                there -= _interaction(vehicles, who, who, ahead)
    elif marks[who, ROLE] == CHANGING and vehicles[who, TIMER] > CHANGE_PERIOD:
        vehicles[who, TIMER] = 0.0
        if abs(vehicles[who, SPEED]) >= LEAST_SPEED:
            there = _choose_lane(lanes, vehicles, marks, who, free, here)
    return min(here, there)


@inlined
def decide_alongside(
    lanes: Floats, vehicles: Floats, marks: Ints, seen: Floats, along: Floats, listed: Ints
) -> None:
    """Do what ``drivers.decide`` does, on one straight road.

    Args:
        lanes: (L, LANE_WIDTH), see ``network.mark_alongside``.
        vehicles: (N, VEHICLE_WIDTH) in and out: timer and acceleration.
        marks: (N, MARK_WIDTH) in and out: target lanes.
        seen: (L, N) scratch, see ``neighbours.make_lists``.
        along: (L, N) scratch.
        listed: (L, 1 + N) scratch.
    """
    is_many = vehicles.shape[0] >= MANY
    if is_many:
        _find_fronts(lanes, vehicles, marks, listed)
        _find_free(lanes, vehicles, marks, seen, along)
    for who in range(vehicles.shape[0]):
        role = marks[who, ROLE]
        if role < CRUISING or (role >= FOLLOWING and marks[who, CRASHED] != 0):
            continue
        if role >= FOLLOWING:
            if is_many:
                front, free = listed[0, 1 + who], seen[0, who]
            else:
                lane = marks[who, LANE]
                front = _front_of_few(lanes, vehicles, lane, who)
                free = _free_acceleration(vehicles, who, who, lanes[lane, LIMIT])
            acceleration = _decide_one(lanes, vehicles, marks, who, front, free)
            vehicles[who, ACCELERATION] = clip(acceleration, -MAX_ACCELERATION, MAX_ACCELERATION)
            continue
        missing = vehicles[who, DESIRED_SPEED] - vehicles[who, SPEED]
        vehicles[who, ACCELERATION] = 1.0 / SPEED_TIME * missing
