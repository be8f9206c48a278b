"""What becomes of vehicles that touch, as highway-env has it; our traffic ends a run before.

Two boxes that will touch within the tick push each other apart, and those that touch brake to
standstill. With it the compiled traffic does all the work of highway-env's step, so the two can be
compared at any time, in what they compute and in how long they take.

Source:
    highway-env 1.12, ``RoadObject.handle_collisions`` in ``vehicle/objects.py`` and
    ``are_polygons_intersecting`` in ``utils.py``.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.traffic.drivers import (
    MANY,
    decide,
    decide_fast,
    locate_drivers,
    move_fast,
    move_reference,
    steer_fast,
    steer_reference,
)
from adeye.kernel.traffic.network import (
    COSINE,
    CRASHED,
    FIXED,
    ORDER_X,
    ROLE,
    SINUS,
    SPEED,
    Road,
    X,
    Y,
)

__all__ = [
    "advance_crashing_fast",
    "advance_crashing_reference",
    "collide",
    "make_bodies",
    "push",
    "separating_push",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


# Columns of a body: its box, and the push that it got.
LENGTH, WIDTH, DIAGONAL, PUSHED, PUSH_X, PUSH_Y = range(6)
BODY_WIDTH: Final = 6

_SLACK: Final = 1e-6
"""Rounding that a cheap test of two boxes may be off by [m], amply."""


def make_bodies(sizes: Floats) -> tuple[Floats, Ints, Floats]:
    """Make the bodies of boxes, and scratch for them.

    Args:
        sizes: (N, 2) length and width [m].

    Returns:
        (N, BODY_WIDTH) bodies, (P, 2) room for the pairs that may touch, (8, 2) for the corners of
        two boxes.
    """
    things = len(sizes)
    bodies = np.zeros((things, BODY_WIDTH))
    bodies[:, :2] = sizes
    bodies[:, DIAGONAL] = np.sqrt(sizes[:, 0] ** 2 + sizes[:, 1] ** 2)
    pairs = np.zeros((max(1, things * (things - 1) // 2), 2), dtype=np.int64)
    return bodies, pairs, np.zeros((8, 2))


@inlined
def _write_corners(vehicles: Floats, bodies: Floats, who: int, corners: Floats, first: int) -> None:
    sine, cosine = vehicles[who, SINUS], vehicles[who, COSINE]
    for number in range(4):
        along = -bodies[who, LENGTH] / 2.0 if number < 2 else bodies[who, LENGTH] / 2.0
        across = bodies[who, WIDTH] / 2.0 if number in (0, 3) else -bodies[who, WIDTH] / 2.0
        corners[first + number, 0] = cosine * along - sine * across + vehicles[who, X]
        corners[first + number, 1] = sine * along + cosine * across + vehicles[who, Y]


@inlined
def _shadow(corners: Floats, first: int, x: float, y: float) -> tuple[float, float]:
    """Return the least and the largest projection of the four corners of a box."""
    least = most = corners[first, 0] * x + corners[first, 1] * y
    for number in range(first + 1, first + 4):
        place = corners[number, 0] * x + corners[number, 1] * y
        least = min(least, place)
        most = max(most, place)
    return least, most


@inlined
def _gap(least_1: float, most_1: float, least_2: float, most_2: float) -> float:
    """Return the distance of two intervals, negative if they overlap."""
    return least_2 - most_1 if least_1 < least_2 else least_1 - most_2


@compiled
def separating_push(corners: Floats, way_x: float, way_y: float) -> tuple[bool, bool, float, float]:
    """Find out whether two boxes touch, or will after a way, and what would separate them.

    Args:
        corners: (8, 2) of the two boxes, in order around them.
        way_x: Way of the first as the second sees it [m].
        way_y: [m].

    Returns:
        Whether they touch, whether they will touch, and the push of the first one [m], 0 if they
        will not.
    """
    touch = will_touch = True
    least = math.inf
    push_x = push_y = 0.0
    dx = _mean(corners, 0, 0) - _mean(corners, 4, 0)
    dy = _mean(corners, 0, 1) - _mean(corners, 4, 1)
    for box in range(2):
        for number in range(4):
            corner, following = 4 * box + number, 4 * box + (number + 1) % 4
            x = corners[following, 1] - corners[corner, 1]
            y = -(corners[following, 0] - corners[corner, 0])
            size = math.sqrt(x * x + y * y)
            x, y = x / size, y / size
            least_1, most_1 = _shadow(corners, 0, x, y)
            least_2, most_2 = _shadow(corners, 4, x, y)
            if _gap(least_1, most_1, least_2, most_2) > 0.0:
                touch = False
            way = x * way_x + y * way_y
            if way < 0.0:
                least_1 += way
            else:
                most_1 += way
            distance = _gap(least_1, most_1, least_2, most_2)
            if distance > 0.0:
                will_touch = False
            if not touch and not will_touch:
                return False, False, 0.0, 0.0
            if abs(distance) < least:
                least = abs(distance)
                push_x, push_y = (x, y) if dx * x + dy * y > 0.0 else (-x, -y)
    if not will_touch:
        return touch, False, 0.0, 0.0
    return touch, True, least * push_x, least * push_y


@inlined
def _mean(corners: Floats, first: int, axis: int) -> float:
    total = corners[first, axis] + corners[first + 1, axis] + corners[first + 2, axis]
    return (total + corners[first + 3, axis]) / 4.0


@inlined
def _are_near(vehicles: Floats, bodies: Floats, first: int, second: int, step: float) -> bool:
    """Tell whether circles around two things touch within a tick."""
    dx = vehicles[second, X] - vehicles[first, X]
    dy = vehicles[second, Y] - vehicles[first, Y]
    reach = 0.5 * (bodies[first, DIAGONAL] + bodies[second, DIAGONAL])
    reach += vehicles[first, SPEED] * step
    if abs(dx) > reach or abs(dy) > reach:
        return False
    return not math.sqrt(dx * dx + dy * dy) > reach


@inlined
def _are_apart(vehicles: Floats, bodies: Floats, first: int, second: int, step: float) -> bool:
    """Tell whether an axis of the first box keeps two boxes apart, now and after their way.

    ``separating_push`` looks at that axis too, so it would find that they do not touch.
    """
    sine, cosine = vehicles[first, SINUS], vehicles[first, COSINE]
    dx = vehicles[second, X] - vehicles[first, X]
    dy = vehicles[second, Y] - vehicles[first, Y]
    turned = vehicles[second, SINUS] * cosine - vehicles[second, COSINE] * sine
    level = vehicles[second, COSINE] * cosine + vehicles[second, SINUS] * sine
    across = bodies[first, WIDTH] + bodies[second, WIDTH] * abs(level)
    across += (bodies[second, LENGTH] + 2.0 * step * abs(vehicles[second, SPEED])) * abs(turned)
    if 2.0 * abs(dy * cosine - dx * sine) > across + _SLACK:
        return True
    along = bodies[first, LENGTH] + bodies[second, LENGTH] * abs(level)
    along += bodies[second, WIDTH] * abs(turned)
    along += 2.0 * step * abs(vehicles[first, SPEED] - vehicles[second, SPEED] * level)
    return 2.0 * abs(dx * cosine + dy * sine) > along + _SLACK


@compiled
def _collide_pair(
    vehicles: Floats,
    marks: Ints,
    bodies: Floats,
    corners: Floats,
    first: int,
    second: int,
    step: float,
) -> None:
    """Let a vehicle and something of a higher number touch, if they do."""
    _write_corners(vehicles, bodies, first, corners, 0)
    _write_corners(vehicles, bodies, second, corners, 4)
    speed_1, speed_2 = vehicles[first, SPEED], vehicles[second, SPEED]
    way_x = speed_1 * vehicles[first, COSINE] * step - speed_2 * vehicles[second, COSINE] * step
    way_y = speed_1 * vehicles[first, SINUS] * step - speed_2 * vehicles[second, SINUS] * step
    touch, will_touch, x, y = separating_push(corners, way_x, way_y)
    if will_touch:
        # A fixed object leaves the whole way to the other one.
        part = 1.0 if marks[second, ROLE] == FIXED else 2.0
        bodies[first, PUSHED], bodies[second, PUSHED] = 1.0, part - 1.0
        bodies[first, PUSH_X], bodies[first, PUSH_Y] = x / part, y / part
        bodies[second, PUSH_X], bodies[second, PUSH_Y] = -x / part, -y / part
    if touch:
        marks[first, CRASHED] = marks[second, CRASHED] = 1


@compiled
def _list_pairs(vehicles: Floats, marks: Ints, bodies: Floats, pairs: Ints, step: float) -> int:
    """List the pairs that are near, in the order of their numbers; return how many there are."""
    largest = fastest = 0.0
    for k in range(marks.shape[0]):
        who = marks[k, ORDER_X]
        largest = max(largest, bodies[who, DIAGONAL])
        fastest = max(fastest, vehicles[who, SPEED])
        place = k
        while place > 0 and vehicles[marks[place - 1, ORDER_X], X] > vehicles[who, X]:
            marks[place, ORDER_X] = marks[place - 1, ORDER_X]
            place -= 1
        marks[place, ORDER_X] = who
    # A metre more than what decides, so that rounding does not.
    reach = largest + fastest * step + 1.0
    count = 0
    for k in range(marks.shape[0]):
        for m in range(k + 1, marks.shape[0]):
            one, other = marks[k, ORDER_X], marks[m, ORDER_X]
            if vehicles[other, X] - vehicles[one, X] > reach:
                break
            first, second = min(one, other), max(one, other)
            if (
                marks[first, ROLE] == FIXED
                or not _are_near(vehicles, bodies, first, second, step)
                or _are_apart(vehicles, bodies, first, second, step)
            ):
                continue
            place = count
            while place > 0 and (
                pairs[place - 1, 0] > first
                or (pairs[place - 1, 0] == first and pairs[place - 1, 1] > second)
            ):
                pairs[place, 0], pairs[place, 1] = pairs[place - 1, 0], pairs[place - 1, 1]
                place -= 1
            pairs[place, 0], pairs[place, 1] = first, second
            count += 1
    return count


@inlined
def collide(
    vehicles: Floats, marks: Ints, bodies: Floats, pairs: Ints, corners: Floats, step: float
) -> None:
    """Find who touches whom after a tick.

    Args:
        vehicles: (N, VEHICLE_WIDTH), the fixed objects last.
        marks: (N, MARK_WIDTH) in and out.
        bodies: (N, BODY_WIDTH) in and out.
        pairs: Scratch, see ``make_bodies``.
        corners: Scratch.
        step: [s].
    """
    if vehicles.shape[0] >= MANY:
        for k in range(_list_pairs(vehicles, marks, bodies, pairs, step)):
            first, second = pairs[k, 0], pairs[k, 1]
            _collide_pair(vehicles, marks, bodies, corners, first, second, step)
        return
    largest = 0.0
    for who in range(vehicles.shape[0]):
        largest = max(largest, bodies[who, DIAGONAL])
    for first in range(vehicles.shape[0]):
        if marks[first, ROLE] == FIXED:
            break
        x = vehicles[first, X]
        # At least that of any pair.
        reach = 0.5 * (bodies[first, DIAGONAL] + largest) + vehicles[first, SPEED] * step + _SLACK
        for second in range(first + 1, vehicles.shape[0]):
            if abs(vehicles[second, X] - x) > reach:
                continue
            if _are_near(vehicles, bodies, first, second, step) and not _are_apart(
                vehicles, bodies, first, second, step
            ):
                _collide_pair(vehicles, marks, bodies, corners, first, second, step)


@inlined
def push(vehicles: Floats, marks: Ints, bodies: Floats) -> None:
    """Push apart who was found to touch, as part of the motion of the next tick."""
    for who in range(vehicles.shape[0]):
        if bodies[who, PUSHED] != 0.0:
            vehicles[who, X] += bodies[who, PUSH_X]
            vehicles[who, Y] += bodies[who, PUSH_Y]
            marks[who, CRASHED] = 1
            bodies[who, PUSHED] = 0.0


@inlined
def advance_crashing_reference(
    road: Road, bodies: Floats, pairs: Ints, corners: Floats, step: float
) -> None:
    """Do what highway-env's ``Road.act`` and ``Road.step`` do, in the reference arithmetic.

    Args:
        road: In and out.
        bodies: (N, BODY_WIDTH) in and out.
        pairs: Scratch, see ``make_bodies``.
        corners: Scratch.
        step: [s].
    """
    decide(road)
    steer_reference(road)
    move_reference(road.vehicles, road.marks, step)
    push(road.vehicles, road.marks, bodies)
    locate_drivers(road)
    collide(road.vehicles, road.marks, bodies, pairs, corners, step)


@inlined
def advance_crashing_fast(
    road: Road, bodies: Floats, pairs: Ints, corners: Floats, step: float
) -> None:
    """Do what ``advance_crashing_reference`` does, in the fast arithmetic."""
    decide_fast(road)
    steer_fast(road)
    move_fast(road.vehicles, road.marks, step)
    push(road.vehicles, road.marks, bodies)
    locate_drivers(road)
    collide(road.vehicles, road.marks, bodies, pairs, corners, step)
