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

__all__ = ["MANY", "decide", "desired_gap", "following_acceleration", "not_zero"]

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
def following_acceleration(
    lanes: Floats,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    driver: int,
    rear: int,
    front: int,
) -> float:
    """Return the acceleration of a vehicle behind another one, as a driver thinks [m/s²].

    Args:
        lanes: (L, LANE_WIDTH).
        curves: See ``kernel.traffic.lanes``.
        vehicles: (N, VEHICLE_WIDTH).
        marks: (N, MARK_WIDTH).
        driver: Whose parameters count.
        rear: Who accelerates; 0 for nobody (-1) and for fixed objects.
        front: Who drives ahead of it, -1 for nobody.
    """
    acceleration = 0.0
    if rear >= 0 and marks[rear, ROLE] != FIXED:
        lane = marks[rear, LANE]
        acceleration = _free_acceleration(vehicles, driver, rear, lanes[lane, LIMIT])
        if front >= 0:
            distance = place_along(lanes, curves, vehicles, marks, lane, front) - vehicles[rear, S]
            acceleration -= _interaction(vehicles, driver, rear, front, distance)
    return acceleration


@inlined
def _find_front(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    lane: int,
    who: int,
    s: float,
) -> int:
    if vehicles.shape[0] < MANY:
        see_around(lanes, links, curves, vehicles, seen, listed, lane)
        front, _ = neighbours(lanes, links, seen, lane, who, s)
    else:
        list_around(lanes, links, curves, vehicles, marks, seen, along, listed, lane)
        front = front_listed(lanes, links, marks, seen, along, listed, lane, who, s)
    return front


@inlined
def _find_both(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    lane: int,
    who: int,
    s: float,
) -> tuple[int, int]:
    if vehicles.shape[0] < MANY:
        see_around(lanes, links, curves, vehicles, seen, listed, lane)
        front, rear = neighbours(lanes, links, seen, lane, who, s)
    else:
        list_around(lanes, links, curves, vehicles, marks, seen, along, listed, lane)
        front = front_listed(lanes, links, marks, seen, along, listed, lane, who, s)
        rear = rear_listed(lanes, links, seen, along, listed, lane, who, s)
    return front, rear


@inlined
def _should_abort(
    lanes: Floats, curves: Floats | None, vehicles: Floats, marks: Ints, who: int
) -> bool:
    """Tell whether somebody close ahead is on the way to the same lane."""
    lane, target = marks[who, LANE], marks[who, TARGET]
    found = False
    for other in range(vehicles.shape[0]):
        if (
            other != who
            and marks[other, TARGET] == target
            and marks[other, LANE] != target
            and marks[other, ROLE] >= CRUISING
        ):
            distance = place_along(lanes, curves, vehicles, marks, lane, other) - vehicles[who, S]
            found |= 0.0 < distance < desired_gap(vehicles, who, who, other)
    return found


@inlined
def _is_better(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    who: int,
    free: float,
    here: float,
    lane: int,
    s: float,
) -> bool:
    """Tell whether MOBIL wants a change to a lane, where the driver would be at a place [m].

    ``free`` is its acceleration on an empty lane, ``here`` that on its own lane [m/s²].
    """
    ahead, behind = _find_both(
        lanes, links, curves, vehicles, marks, seen, along, listed, lane, who, s
    )
    there = free
    if ahead >= 0:
        own = marks[who, LANE]
        distance = place_along(lanes, curves, vehicles, marks, own, ahead) - vehicles[who, S]
        there = free - _interaction(vehicles, who, who, ahead, distance)
    # The cheaper half of the question first.
    if there - here < LEAST_GAIN:
        return False
    imposed = following_acceleration(lanes, curves, vehicles, marks, who, behind, who)
    return not imposed < -IMPOSED_BRAKING


@compiled
def _choose_lane(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    who: int,
    free: float,
    here: float,
) -> None:
    """Go on with a change of lanes, give it up, or think of one as it is time to."""
    lane = marks[who, LANE]
    target = marks[who, TARGET]
    if lane != target:
        if links[lane, FIRST] == links[target, FIRST] and _should_abort(
            lanes, curves, vehicles, marks, who
        ):
            marks[who, TARGET] = lane
        return
    vehicles[who, TIMER] = 0.0
    if abs(vehicles[who, SPEED]) < LEAST_SPEED:
        return
    place, count = links[lane, PLACE], links[lane, COUNT]
    for side in range(-1, 2, 2):
        if not 0 <= place + side < count:
            continue
        other = lane + side
        s, lateral = lane_local(lanes, other, curves, vehicles[who, X], vehicles[who, Y])
        if is_reachable(lanes, other, s, lateral) and _is_better(
            lanes, links, curves, vehicles, marks, seen, along, listed, who, free, here, other, s
        ):
            marks[who, TARGET] = other


@inlined
def _follow_road(
    lanes: Floats, links: Ints, curves: Floats | None, vehicles: Floats, marks: Ints, who: int
) -> None:
    """Steer for the next lane near the end of one."""
    target = marks[who, TARGET]
    s = place_along(lanes, curves, vehicles, marks, target, who)
    if s > lanes[target, LANE_LENGTH] - PASSED:
        marks[who, TARGET] = next_lane(
            lanes, links, curves, target, vehicles[who, X], vehicles[who, Y]
        )


@inlined
def _decide_one(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    who: int,
) -> None:
    lane = marks[who, LANE]
    front = _find_front(
        lanes, links, curves, vehicles, marks, seen, along, listed, lane, who, vehicles[who, S]
    )
    free = _free_acceleration(vehicles, who, who, lanes[lane, LIMIT])
    acceleration = free
    if front >= 0:
        distance = place_along(lanes, curves, vehicles, marks, lane, front) - vehicles[who, S]
        acceleration = free - _interaction(vehicles, who, who, front, distance)
    if marks[who, ROLE] == CHANGING and (
        marks[who, TARGET] != lane or vehicles[who, TIMER] > CHANGE_PERIOD
    ):
        _choose_lane(
            lanes, links, curves, vehicles, marks, seen, along, listed, who, free, acceleration
        )
    target = marks[who, TARGET]
    if target != lane:
        s = place_along(lanes, curves, vehicles, marks, target, who)
        front = _find_front(
            lanes, links, curves, vehicles, marks, seen, along, listed, target, who, s
        )
        other = free
        if front >= 0:
            # Measured along the lane that it is on, whichever the other one is found on.
            distance = place_along(lanes, curves, vehicles, marks, lane, front) - vehicles[who, S]
            other = free - _interaction(vehicles, who, who, front, distance)
        acceleration = min(acceleration, other)
    vehicles[who, ACCELERATION] = clip(acceleration, -MAX_ACCELERATION, MAX_ACCELERATION)


@inlined
def decide(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
) -> None:
    """Let the drivers of a run choose lanes and accelerations, one after the other.

    Args:
        lanes: (L, LANE_WIDTH).
        links: Of the lanes, see ``kernel.traffic.network``.
        curves: See ``kernel.traffic.lanes``.
        vehicles: (N, VEHICLE_WIDTH) in and out: timer and acceleration.
        marks: (N, MARK_WIDTH) in and out: target lanes.
        seen: (L, N) scratch, see ``neighbours.make_lists``.
        along: (L, N) scratch.
        listed: (L, 1 + N) scratch.
    """
    forget_lists(listed)
    if vehicles.shape[0] >= MANY:
        sort_along(vehicles, marks)
    for who in range(vehicles.shape[0]):
        role = marks[who, ROLE]
        # One who cruises follows the road even after a crash, in highway-env.
        if role < CRUISING or (role >= FOLLOWING and marks[who, CRASHED] != 0):
            continue
        _follow_road(lanes, links, curves, vehicles, marks, who)
        if role >= FOLLOWING:
            _decide_one(lanes, links, curves, vehicles, marks, seen, along, listed, who)
            continue
        missing = vehicles[who, DESIRED_SPEED] - vehicles[who, SPEED]
        vehicles[who, ACCELERATION] = 1.0 / SPEED_TIME * missing
