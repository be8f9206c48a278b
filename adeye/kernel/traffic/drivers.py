"""What the drivers of a run decide, and how their vehicles steer along the lanes and move.

Speed by IDM, lanes by MOBIL, one driver after the other. A driver sees the lanes that those before
it have just chosen. Everybody's place stays as it was at the beginning of the tick, so steering can
follow when all have decided.

Where all lanes lie side by side, a place along one of them is a place along all. So everybody is
sorted once, and one sweep against the traffic tells who drives ahead of whom; the model is the same
in the fast arithmetic.

Vehicles move in two kinds of arithmetic for one model. The *reference* goes through the formulas in
highway-env's order: the steering angle of a lane keeping controller, of which it keeps the tangent,
then the slip angle of a bicycle. The *fast* one keeps the sine of the slip angle instead, of which
the steering angle is only a detour. Both turn the sine and cosine that a vehicle's row has of its
heading, so these must fit. A tick is: decide, steer, move, locate; each for everybody before the
next, as the long chains of arithmetic of different vehicles overlap in a short loop.

Source:
    Treiber, Hennecke, Helbing (2000), "Congested traffic states in empirical observations and
    microscopic simulations"; Kesting, Treiber, Helbing (2007), "General lane-changing model MOBIL
    for car-following models". Parameters, order and formulas are those of highway-env 1.12
    (``vehicle/behavior.py``, ``vehicle/controller.py``, ``vehicle/kinematics.py``), with politeness
    zero and without routes; Polack, Altché, d'Andréa-Novel, de La Fortelle (2017), "The kinematic
    bicycle model".
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import asin, near_power, power, sin_cos, sin_cos_of_small
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import clip
from adeye.kernel.traffic.network import (
    ACCELERATION,
    ALONGSIDE,
    BRAKING,
    CHANGING,
    CONTROL,
    COSINE,
    COUNT,
    CRASHED,
    CRUISING,
    DESIRED_SPEED,
    EXPONENT,
    FIRST,
    FIXED,
    FOLLOWING,
    FORBIDDEN,
    GAIN,
    HEADING,
    JAM_DISTANCE,
    LANE,
    LANE_LENGTH,
    LATERAL,
    LENGTH,
    LIMIT,
    MARGIN,
    ORDER,
    OVERHANG,
    PLACE,
    RANK,
    ROLE,
    SINUS,
    SPEED,
    TARGET,
    TIME_GAP,
    TIMER,
    TOP_SPEED,
    WIDTH,
    Road,
    S,
    X,
    Y,
    forget_lists,
    front_listed,
    is_alone_nearest,
    is_on_lane,
    is_reachable,
    lane_heading,
    lane_local,
    list_around,
    nearest_lane,
    neighbours,
    next_lane,
    place_along,
    rear_listed,
    see_around,
    sort_along,
    straight_local,
    wrapped,
)

# --- What the drivers of a run decide: speed by IDM, lanes by MOBIL, one driver after the other ---

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


# --- How drivers decide on one straight road, in the fast arithmetic ------------------------------

LEAST_DIVISOR: Final = 1e-2
"""Nothing nearer to zero divides, as in ``not_zero``."""


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
def _free_acceleration_alongside(vehicles: Floats, driver: int, who: int, limit: float) -> float:
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
def _interaction_alongside(vehicles: Floats, driver: int, rear: int, front: int) -> float:
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
def _should_abort_alongside(road: Road, who: int) -> bool:
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
def _choose_lane_alongside(road: Road, who: int, free: float, here: float) -> float:
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
            there -= _interaction_alongside(road.vehicles, who, who, ahead)
        if there - here < LEAST_GAIN:
            continue
        behind = _rear(road, other, who)
        imposed = 0.0
        if behind >= 0 and road.marks[behind, ROLE] != FIXED:
            limit = road.lanes[road.marks[behind, LANE], LIMIT]
            imposed = _free_acceleration_alongside(road.vehicles, who, behind, limit)
            imposed -= _interaction_alongside(road.vehicles, who, behind, who)
        if not imposed < -IMPOSED_BRAKING:
            road.marks[who, TARGET] = other
            chosen = there
    return chosen


@inlined
def _decide_one_alongside(road: Road, who: int, front: int, free: float) -> float:
    """Choose the lane and return the acceleration of a driver, who knows who is ahead [m/s²]."""
    lane, target = road.marks[who, LANE], road.marks[who, TARGET]
    here = free
    if front >= 0:
        here -= _interaction_alongside(road.vehicles, who, who, front)
    there = here
    if target != lane:
        if road.marks[who, ROLE] == CHANGING and _should_abort_alongside(road, who):
            road.marks[who, TARGET] = lane
        else:
            ahead = _front(road, target, who)
            there = free
            if ahead >= 0:
                there -= _interaction_alongside(road.vehicles, who, who, ahead)
    elif road.marks[who, ROLE] == CHANGING and road.vehicles[who, TIMER] > CHANGE_PERIOD:
        road.vehicles[who, TIMER] = 0.0
        if abs(road.vehicles[who, SPEED]) >= LEAST_SPEED:
            there = _choose_lane_alongside(road, who, free, here)
    return min(here, there)


@inlined
def decide_alongside(road: Road) -> None:
    """Do what ``decide`` does, on one straight road.

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
                free = _free_acceleration_alongside(
                    road.vehicles, who, who, road.lanes[lane, LIMIT]
                )
            acceleration = _decide_one_alongside(road, who, front, free)
            road.vehicles[who, ACCELERATION] = clip(
                acceleration, -MAX_ACCELERATION, MAX_ACCELERATION
            )
            continue
        missing = road.vehicles[who, DESIRED_SPEED] - road.vehicles[who, SPEED]
        road.vehicles[who, ACCELERATION] = 1.0 / SPEED_TIME * missing


# --- How vehicles steer along their lanes and move, in two kinds of arithmetic for one model ------

HEADING_TIME: Final = 0.2
"""In which the heading follows its reference [s]."""

LATERAL_TIME: Final = 0.6
"""In which the lateral place follows the lane's centre [s]."""

PURSUIT_TIME: Final = 0.5 * HEADING_TIME
"""How far ahead the lane's direction is taken [s]."""

MAX_STEERING_TANGENT: Final = math.sqrt(3.0)
"""At the wheels, either way: a third of pi."""

_MAX_APPROACH_SINE: Final = math.sqrt(0.5)
"""Sine of the angle at which a lane is approached at most: a quarter of pi."""

MAX_SLIP_SINE: Final = math.sqrt(3.0 / 7.0)
"""Sine of the slip angle at the largest steering angle: its tangent is half of the other one's."""


@inlined
def steering_tangent(
    future_heading: float, lateral: float, heading: float, speed: float, length: float
) -> float:
    """Return the tangent of the steering angle that leads a vehicle to the centre of its lane.

    The angle itself, ``atan(2 tan(slip))``, is only ever asked for its tangent.

    Args:
        future_heading: Direction of the lane a little ahead [rad].
        lateral: Of the vehicle, to the left of the centre [m].
        heading: [rad].
        speed: [m/s].
        length: Of the vehicle; its axles are that far apart [m].
    """
    pace = 1.0 / not_zero(speed)
    approach = -(1.0 / LATERAL_TIME) * lateral * pace
    command = asin(clip(approach, -_MAX_APPROACH_SINE, _MAX_APPROACH_SINE))
    rate = 1.0 / HEADING_TIME * wrapped(future_heading + command - heading)
    slip = length / 2.0 * pace * rate
    if abs(slip) >= MAX_SLIP_SINE:
        return MAX_STEERING_TANGENT if slip > 0.0 else -MAX_STEERING_TANGENT
    # The tangent of an angle given by its sine.
    return 2.0 * slip / math.sqrt(1.0 - slip * slip)


@inlined
def slip_sine(
    future_heading: float, lateral: float, heading: float, speed: float, length: float
) -> float:
    """Return the sine of the slip angle that ``steering_tangent`` leads to.

    The limit of the steering angle is one of the slip's sine. Exactly zero on the centre of a lane
    in its direction.
    """
    pace = 1.0 / not_zero(speed)
    approach = -(1.0 / LATERAL_TIME) * lateral * pace
    command = asin(clip(approach, -_MAX_APPROACH_SINE, _MAX_APPROACH_SINE))
    rate = 1.0 / HEADING_TIME * wrapped(future_heading + command - heading)
    return clip(0.5 * length * pace * rate, -MAX_SLIP_SINE, MAX_SLIP_SINE)


@inlined
def _ahead(road: Road, who: int) -> tuple[float, float]:
    """Return the direction of the target lane a little ahead [rad] and the place beside it [m]."""
    s, lateral = road.vehicles[who, S], road.vehicles[who, LATERAL]
    target = road.marks[who, TARGET]
    if target != road.marks[who, LANE]:
        s, lateral = lane_local(road.lanes, target, road.vehicles[who, X], road.vehicles[who, Y])
    return lane_heading(road.lanes, target, s + road.vehicles[who, SPEED] * PURSUIT_TIME), lateral


@inlined
def _clip_actions(vehicles: Floats, who: int, crashed: int) -> None:
    """Brake a crashed vehicle, and one that is too fast."""
    if crashed != 0:
        vehicles[who, CONTROL] = 0.0
        vehicles[who, ACCELERATION] = -vehicles[who, SPEED]
    if vehicles[who, SPEED] > vehicles[who, TOP_SPEED]:
        vehicles[who, ACCELERATION] = min(
            vehicles[who, ACCELERATION], vehicles[who, TOP_SPEED] - vehicles[who, SPEED]
        )


@inlined
def _change_speed(vehicles: Floats, who: int, step: float) -> None:
    """Change the speed, braking no further than to standstill."""
    vehicles[who, SPEED] = max(0.0, vehicles[who, SPEED] + vehicles[who, ACCELERATION] * step)


@inlined
def _limit_braking(vehicles: Floats, who: int, step: float) -> None:
    if vehicles[who, SPEED] + vehicles[who, ACCELERATION] * step < 0.0:
        vehicles[who, ACCELERATION] = -vehicles[who, SPEED] / step


@inlined
def steer_reference(road: Road) -> None:
    """Let the drivers of a run steer for their target lanes; ``CONTROL`` is the steering tangent.

    Args:
        road: In and out: the control.
    """
    for who in range(road.vehicles.shape[0]):
        if road.marks[who, ROLE] >= CRUISING and road.marks[who, CRASHED] == 0:
            row = road.vehicles[who]
            future, lateral = _ahead(road, who)
            row[CONTROL] = steering_tangent(future, lateral, row[HEADING], row[SPEED], row[LENGTH])


@inlined
def steer_fast(road: Road) -> None:
    """Do what ``steer_reference`` does; ``CONTROL`` is the sine of the slip angle."""
    for who in range(road.vehicles.shape[0]):
        if road.marks[who, ROLE] >= CRUISING and road.marks[who, CRASHED] == 0:
            row = road.vehicles[who]
            future, lateral = _ahead(road, who)
            row[CONTROL] = slip_sine(future, lateral, row[HEADING], row[SPEED], row[LENGTH])


@inlined
def move_reference(vehicles: Floats, marks: Ints, step: float) -> None:
    """Move the vehicles that drivers steer over one tick; ``CONTROL`` is the steering tangent.

    Args:
        vehicles: (N, VEHICLE_WIDTH) in and out.
        marks: (N, MARK_WIDTH).
        step: [s].
    """
    for who in range(vehicles.shape[0]):
        if marks[who, ROLE] < CRUISING:
            continue
        vehicles[who, TIMER] += step
        _clip_actions(vehicles, who, marks[who, CRASHED])
        _limit_braking(vehicles, who, step)
        speed = vehicles[who, SPEED]
        # Sine and cosine of the slip angle, whose tangent this is, and of the course.
        slip = 0.5 * vehicles[who, CONTROL]
        cosine = 1.0 / math.sqrt(1.0 + slip * slip)
        sine = slip * cosine
        course_x = vehicles[who, COSINE] * cosine - vehicles[who, SINUS] * sine
        course_y = vehicles[who, SINUS] * cosine + vehicles[who, COSINE] * sine
        vehicles[who, X] += speed * course_x * step
        vehicles[who, Y] += speed * course_y * step
        vehicles[who, HEADING] += speed * sine / (vehicles[who, LENGTH] / 2.0) * step
        _change_speed(vehicles, who, step)
    for who in range(vehicles.shape[0]):
        if marks[who, ROLE] >= CRUISING:
            vehicles[who, SINUS], vehicles[who, COSINE] = sin_cos(vehicles[who, HEADING])


@inlined
def move_fast(vehicles: Floats, marks: Ints, step: float) -> None:
    """Do what ``move_reference`` does; ``CONTROL`` is the sine of the slip angle."""
    for who in range(vehicles.shape[0]):
        if marks[who, ROLE] < CRUISING:
            continue
        vehicles[who, TIMER] += step
        speed, acceleration = vehicles[who, SPEED], vehicles[who, ACCELERATION]
        slip = vehicles[who, CONTROL]
        if marks[who, CRASHED] != 0:
            slip = vehicles[who, CONTROL] = 0.0
            acceleration = -speed
        if speed > vehicles[who, TOP_SPEED]:
            acceleration = min(acceleration, vehicles[who, TOP_SPEED] - speed)
        if speed + acceleration * step < 0.0:
            acceleration = -speed / step
        vehicles[who, ACCELERATION] = acceleration
        vehicles[who, SPEED] = max(0.0, speed + acceleration * step)
        way = speed * step
        sine, cosine = vehicles[who, SINUS], vehicles[who, COSINE]
        if slip == 0.0:
            vehicles[who, X] += way * cosine
            vehicles[who, Y] += way * sine
            continue
        level = math.sqrt(1.0 - slip * slip)
        vehicles[who, X] += way * (cosine * level - sine * slip)
        vehicles[who, Y] += way * (sine * level + cosine * slip)
        heading = vehicles[who, HEADING] + 2.0 * way * slip / vehicles[who, LENGTH]
        vehicles[who, HEADING] = heading
    for who in range(vehicles.shape[0]):
        if marks[who, ROLE] >= CRUISING and vehicles[who, CONTROL] != 0.0:
            sine, cosine = sin_cos_of_small(vehicles[who, HEADING])
            vehicles[who, SINUS], vehicles[who, COSINE] = sine, cosine


@inlined
def locate(road: Road, who: int) -> None:
    """Find the lane that somebody is on, and the place beside it.

    Args:
        road: In and out: lane and place; the lane is that of a tick ago, or any.
        who: For whom.
    """
    lane, x, y = road.marks[who, LANE], road.vehicles[who, X], road.vehicles[who, Y]
    s, lateral = straight_local(road.lanes, lane, x, y)
    if not is_alone_nearest(road.lanes, lane, lateral):
        heading = road.vehicles[who, HEADING]
        road.marks[who, LANE], s, lateral = nearest_lane(
            road.lanes, road.links, lane, x, y, heading
        )
    road.vehicles[who, S], road.vehicles[who, LATERAL] = s, lateral


@inlined
def locate_drivers(road: Road) -> None:
    """Find the lanes of all vehicles that drivers steer."""
    for who in range(road.vehicles.shape[0]):
        if road.marks[who, ROLE] >= CRUISING:
            locate(road, who)


@inlined
def decide_fast(road: Road) -> None:
    """Do what ``decide`` does, in the fast arithmetic where there is one."""
    if road.lanes[0, ALONGSIDE] != 0.0:
        decide_alongside(road)
    else:
        decide(road)


@inlined
def advance_reference(road: Road, step: float) -> None:
    """Advance the vehicles of one run that drivers steer by one tick, in the reference arithmetic.

    Args:
        road: In and out.
        step: [s].
    """
    decide(road)
    steer_reference(road)
    move_reference(road.vehicles, road.marks, step)
    locate_drivers(road)


@inlined
def advance_fast(road: Road, step: float) -> None:
    """Do what ``advance_reference`` does, in the fast arithmetic."""
    decide_fast(road)
    steer_fast(road)
    move_fast(road.vehicles, road.marks, step)
    locate_drivers(road)
