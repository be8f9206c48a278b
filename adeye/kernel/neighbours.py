"""Vehicles in rows of numbers, and who drives ahead of and behind a place on a lane.

The things on a road are the rows of ``vehicles`` (N, VEHICLE_WIDTH) and ``marks`` (N, MARK_WIDTH):
vehicles first, then fixed objects. Two searches give the same answer to the last bit: one looks at
everybody, the other keeps a sorted list for each lane, which pays with many.

Source:
    The rules are those of highway-env 1.12 (``Road.neighbour_vehicles`` in ``road/road.py``).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.lanes import (
    ARC,
    KIND,
    OVERHANG,
    RADIUS,
    STRAIGHT,
    WIDTH,
    is_on_lane,
    lane_local,
    least_distance,
)
from adeye.kernel.lanes import LENGTH as LANE_LENGTH
from adeye.kernel.lanes import X as LANE_X
from adeye.kernel.lanes import Y as LANE_Y
from adeye.kernel.network import LINKED, LIST, NEXT_ROADS

__all__ = [
    "MARK_WIDTH",
    "VEHICLE_WIDTH",
    "forget_lists",
    "front_listed",
    "list_around",
    "make_lists",
    "neighbours",
    "place_along",
    "rear_listed",
    "see_around",
    "sort_along",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Columns of a vehicle: its state, its place beside its lane, its control, then what its driver is.
(
    X,
    Y,
    HEADING,
    SPEED,
    SINUS,
    COSINE,
    S,
    LATERAL,
    CONTROL,
    ACCELERATION,
    TIMER,
    DESIRED_SPEED,
    EXPONENT,
    JAM_DISTANCE,
    TIME_GAP,
    GAIN,
    BRAKING,
    TOP_SPEED,
    LENGTH,
) = range(19)
VEHICLE_WIDTH: Final = 19

# Columns of its marks: the lane that it is on, the lane that it steers for, its role, and whether
# it has crashed; its line in the list of its lane. The last two are not its own: line k names the
# k-th thing in the order along the lanes and along x, as it was a tick ago.
LANE, TARGET, ROLE, CRASHED, RANK, ORDER, ORDER_X = range(7)
MARK_WIDTH: Final = 7

FIXED, PLACED, CRUISING, FOLLOWING, CHANGING = range(5)
"""Roles: an object; a vehicle moved by others; one that keeps lane and speed; one that follows the
vehicle ahead; one that changes lanes too."""

UNSEEN: Final = -1
"""Instead of how many are listed: nobody has looked at this lane in this tick."""

MARGIN: Final = 1.0
"""A vehicle is seen on a lane up to this far beside it [m]."""


def make_lists(lanes: int, things: int) -> tuple[Floats, Floats, Ints]:
    """Make room for who is seen on the lanes of a network, as scratch for a tick.

    Returns:
        seen: (L, N) where everybody is along each lane [m], NaN if not seen on it.
        along: (L, N) the same ascending, of those who are seen.
        listed: (L, 1 + N) how many these are, then who; of equal places the lower number first.
            All three hold for the lanes that somebody has looked at, the others are ``UNSEEN``.
    """
    shape = (lanes, things)
    return np.zeros(shape), np.zeros(shape), np.zeros((lanes, 1 + things), dtype=np.int64)


@inlined
def place_along(
    lanes: Floats, curves: Floats | None, vehicles: Floats, marks: Ints, lane: int, who: int
) -> float:
    """Return where somebody is along a lane [m]."""
    s = vehicles[who, S]
    if marks[who, LANE] != lane:
        s, _ = lane_local(lanes, lane, curves, vehicles[who, X], vehicles[who, Y])
    return s


@inlined
def _linked(links: Ints, lane: int, link: int) -> int:
    return links[lane, LIST + links[lane, NEXT_ROADS] + link]


@inlined
def forget_lists(listed: Ints) -> None:
    """Begin a tick: nobody is seen on any lane (L, 1 + N) yet."""
    for lane in range(listed.shape[0]):
        listed[lane, 0] = UNSEEN


@inlined
def _place_seen(
    lanes: Floats, curves: Floats | None, lane: int, reach: float, x: float, y: float
) -> float:
    """Return where a point is along a lane [m], NaN if not seen on it."""
    near = True
    if lanes[lane, KIND] != STRAIGHT:
        near = least_distance(lanes, lane, x, y) <= reach + OVERHANG + MARGIN
        if lanes[lane, KIND] == ARC:
            dx, dy = x - lanes[lane, LANE_X], y - lanes[lane, LANE_Y]
            near &= abs(lanes[lane, RADIUS] - math.sqrt(dx * dx + dy * dy)) <= reach
    place = math.nan
    if near:
        s, lateral = lane_local(lanes, lane, curves, x, y)
        if is_on_lane(lanes, lane, s, lateral, MARGIN):
            place = s
    return place


@inlined
def see_around(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    vehicles: Floats,
    seen: Floats,
    listed: Ints,
    lane: int,
) -> None:
    """Find out who is seen on a lane and those linked to it, unless that is known.

    Args:
        lanes: (L, LANE_WIDTH).
        links: Of the lanes, see ``kernel.network``.
        curves: See ``kernel.lanes``.
        vehicles: (N, VEHICLE_WIDTH).
        seen: (L, N) out, see ``make_lists``.
        listed: (L, 1 + N) out: which lanes are known.
        lane: Where to look.
    """
    for link in range(-1, links[lane, LINKED]):
        number = lane if link < 0 else _linked(links, lane, link)
        if listed[number, 0] != UNSEEN:
            continue
        listed[number, 0] = 0
        reach = lanes[number, WIDTH] / 2.0 + MARGIN
        for who in range(vehicles.shape[0]):
            x, y = vehicles[who, X], vehicles[who, Y]
            seen[number, who] = _place_seen(lanes, curves, number, reach, x, y)


@inlined
def _link_offset(lanes: Floats, links: Ints, lane: int, link: int) -> float:
    """Return what to add to a place on a linked lane to have it on the lane itself [m]."""
    offset = lanes[lane, LANE_LENGTH]
    if link >= links[lane, NEXT_ROADS]:
        offset = -lanes[_linked(links, lane, link), LANE_LENGTH]
    return offset


@inlined
def neighbours(
    lanes: Floats, links: Ints, seen: Floats, lane: int, who: int, s: float
) -> tuple[int, int]:
    """Find who is ahead of and who is behind somebody on a lane, by looking at everybody.

    Args:
        lanes: (L, LANE_WIDTH).
        links: Of the lanes, see ``kernel.network``.
        seen: (L, N) see ``see_around``.
        lane: Where to look.
        who: For whom.
        s: Where that is along the lane [m].

    Returns:
        The nearest at or ahead of the place and the nearest behind it, -1 for nobody. Somebody on
        the lane and on linked ones counts on the first of them.
    """
    front = rear = -1
    front_s, rear_s = math.inf, -math.inf
    count = links[lane, LINKED]
    for other in range(seen.shape[1]):
        place = seen[lane, other]
        link = 0
        while link < count and math.isnan(place):
            place = seen[_linked(links, lane, link), other] + _link_offset(lanes, links, lane, link)
            link += 1
        if other != who:
            if s <= place <= front_s:
                front, front_s = other, place
            if rear_s < place < s:
                rear, rear_s = other, place
    return front, rear


@compiled
def sort_along(vehicles: Floats, marks: Ints) -> None:
    """Sort everybody by the place along the own lane, beginning with the order of a tick ago."""
    for k in range(marks.shape[0]):
        who = marks[k, ORDER]
        place = k
        while place > 0 and vehicles[marks[place - 1, ORDER], S] > vehicles[who, S]:
            marks[place, ORDER] = marks[place - 1, ORDER]
            place -= 1
        marks[place, ORDER] = who


@compiled
def _list_lane(
    lanes: Floats,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    lane: int,
) -> None:
    reach = lanes[lane, WIDTH] / 2.0 + MARGIN
    count = 0
    for k in range(marks.shape[0]):
        who = marks[k, ORDER]
        s = _place_seen(lanes, curves, lane, reach, vehicles[who, X], vehicles[who, Y])
        seen[lane, who] = s
        if math.isnan(s):
            continue
        place = count
        while place > 0 and (
            along[lane, place - 1] > s
            or (along[lane, place - 1] == s and listed[lane, place] > who)
        ):
            along[lane, place] = along[lane, place - 1]
            listed[lane, 1 + place] = listed[lane, place]
            place -= 1
        along[lane, place], listed[lane, 1 + place] = s, who
        count += 1
    listed[lane, 0] = count
    for k in range(count):
        who = listed[lane, 1 + k]
        if marks[who, LANE] == lane:
            marks[who, RANK] = k


@inlined
def list_around(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    vehicles: Floats,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    lane: int,
) -> None:
    """Sort who is seen on a lane and those linked to it, unless that is done.

    Args:
        lanes: (L, LANE_WIDTH).
        links: Of the lanes, see ``kernel.network``.
        curves: See ``kernel.lanes``.
        vehicles: (N, VEHICLE_WIDTH).
        marks: (N, MARK_WIDTH) in and out: the rank.
        seen: (L, N) out, see ``make_lists``.
        along: (L, N) out.
        listed: (L, 1 + N) out.
        lane: Where to look.
    """
    for link in range(-1, links[lane, LINKED]):
        number = lane if link < 0 else _linked(links, lane, link)
        if listed[number, 0] == UNSEEN:
            _list_lane(lanes, curves, vehicles, marks, seen, along, listed, number)


@inlined
def _is_seen_before(links: Ints, seen: Floats, lane: int, before: int, who: int) -> bool:
    """Tell whether somebody is on a lane or one of its links before a link; -1 is before both."""
    found = False
    for link in range(-1, before):
        number = lane if link < 0 else _linked(links, lane, link)
        found |= not math.isnan(seen[number, who])
    return found


@inlined
def _first_at(along: Floats, lane: int, count: int, offset: float, s: float) -> int:
    """Return the first line of a lane's list that is at or ahead of a place."""
    first, high = 0, count
    while first < high:
        middle = (first + high) // 2
        if along[lane, middle] + offset < s:
            first = middle + 1
        else:
            high = middle
    return first


@inlined
def front_listed(
    lanes: Floats,
    links: Ints,
    marks: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    lane: int,
    who: int,
    s: float,
) -> int:
    """Find who is ahead, as ``neighbours`` does, in the lists that ``list_around`` made.

    Of equal places the higher number is ahead, as when everybody is looked at in turn.
    """
    front = -1
    front_s = math.inf
    for link in range(-1, links[lane, LINKED]):
        number = lane if link < 0 else _linked(links, lane, link)
        offset = 0.0 if link < 0 else _link_offset(lanes, links, lane, link)
        count = listed[number, 0]
        if number == marks[who, LANE] and link < 0 and seen[number, who] == s:
            k = marks[who, RANK]
            while k > 0 and along[number, k - 1] == s:
                k -= 1
        else:
            k = _first_at(along, number, count, offset, s)
        while k < count and along[number, k] + offset <= front_s:
            other, place = listed[number, 1 + k], along[number, k] + offset
            if (
                other != who
                and (place < front_s or other > front)
                and not _is_seen_before(links, seen, lane, link, other)
            ):
                front, front_s = other, place
            k += 1
    return front


@inlined
def rear_listed(
    lanes: Floats,
    links: Ints,
    seen: Floats,
    along: Floats,
    listed: Ints,
    lane: int,
    who: int,
    s: float,
) -> int:
    """Find who is behind, as ``front_listed`` does; of equal places it is the lower number."""
    rear = -1
    rear_s = -math.inf
    for link in range(-1, links[lane, LINKED]):
        number = lane if link < 0 else _linked(links, lane, link)
        offset = 0.0 if link < 0 else _link_offset(lanes, links, lane, link)
        k = _first_at(along, number, listed[number, 0], offset, s) - 1
        while k >= 0 and along[number, k] + offset >= rear_s:
            other, place = listed[number, 1 + k], along[number, k] + offset
            if (
                other != who
                and (place > rear_s or other < rear)
                and not _is_seen_before(links, seen, lane, link, other)
            ):
                rear, rear_s = other, place
            k -= 1
    return rear
