"""A network of lanes: which one a vehicle is on, which are beside it, and which comes next.

A lane is a row (LANE_WIDTH,), straight or circular. A place is (s, lateral): s [m] along its centre
from its start, and how far to the left of the centre [m].

Lanes are numbered road by road, in the order in which the roads were added and within a road from
the left, so the lanes of a road have consecutive numbers. What is connected stands in rows of
``links``, which all runs of a batch share.

The things on a road are the rows of ``vehicles`` (N, VEHICLE_WIDTH) and ``marks`` (N, MARK_WIDTH):
vehicles first, then fixed objects. Two searches give the same answer to the last bit: one looks at
everybody, the other keeps a sorted list for each lane, which pays with many.

Source:
    Formulas, rules and their order are those of highway-env 1.12, with y to the left
    (``road/lane.py``) and without routes (``RoadNetwork``, ``Road.neighbour_vehicles`` in
    ``road/road.py``).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan2, cos, sin_cos
from adeye.kernel.jit import compiled, inlined

# --- Lanes as rows of numbers: straight and circular ones, and places beside their centre ---------

Floats = NDArray[np.float64]

# Columns of a lane. X and Y are its start, of an arc the centre of its circle.
(
    KIND,
    LANE_X,
    LANE_Y,
    LANE_HEADING,
    LANE_COSINE,
    LANE_SINUS,
    LANE_LENGTH,
    WIDTH,
    LIMIT,
    FORBIDDEN,
    RADIUS,
    PHASE,
    TURN,
    LEAST_X,
    MOST_X,
    LEAST_Y,
    MOST_Y,
    ALONGSIDE,
) = range(18)
LANE_WIDTH: Final = 18
"""Columns of a lane. ``LIMIT`` is its speed limit [m/s], inf for none; ``TURN`` of an arc is 1 to
the left and -1 to the right; four are a box around the centre line, for quick looks; the last says
that all lanes are side by side on one straight road, see ``mark_alongside``."""

STRAIGHT, ARC = 0.0, 1.0

OVERHANG: Final = 5.0
"""How far before its start and past its end something still counts as on a lane [m]."""


@inlined
def wrapped(angle: float) -> float:
    """Return the same direction in [-pi, pi) [rad], rounded as ``(angle + pi) % (2 pi) - pi``."""
    turned = angle + math.pi
    if not 0.0 <= turned < 2.0 * math.pi:
        turned %= 2.0 * math.pi
    return turned - math.pi


@inlined
def _arc_local(
    dx: float, dy: float, radius: float, phase: float, turn: float
) -> tuple[float, float]:
    """Return the place beside an arc of a point given from the centre of its circle."""
    phi = phase + wrapped(atan2(dy, dx) - phase)
    return turn * (phi - phase) * radius, turn * (radius - math.sqrt(dx * dx + dy * dy))


@inlined
def straight_local(lanes: Floats, lane: int, x: float, y: float) -> tuple[float, float]:
    """Return the place (s, lateral) of a point beside the straight line of a lane's row [m]."""
    dx = x - lanes[lane, LANE_X]
    dy = y - lanes[lane, LANE_Y]
    s = dx * lanes[lane, LANE_COSINE] + dy * lanes[lane, LANE_SINUS]
    return s, dy * lanes[lane, LANE_COSINE] - dx * lanes[lane, LANE_SINUS]


@inlined
def lane_local(lanes: Floats, lane: int, x: float, y: float) -> tuple[float, float]:
    """Return the place (s, lateral) of a point beside a lane [m].

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        x: [m].
        y: [m].
    """
    dx = x - lanes[lane, LANE_X]
    dy = y - lanes[lane, LANE_Y]
    s = dx * lanes[lane, LANE_COSINE] + dy * lanes[lane, LANE_SINUS]
    lateral = dy * lanes[lane, LANE_COSINE] - dx * lanes[lane, LANE_SINUS]
    if lanes[lane, KIND] == ARC:
        s, lateral = _arc_local(dx, dy, lanes[lane, RADIUS], lanes[lane, PHASE], lanes[lane, TURN])
    return s, lateral


@inlined
def lane_heading(lanes: Floats, lane: int, s: float) -> float:
    """Return the direction of a lane at a place along it [rad], not wrapped.

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        s: [m].
    """
    heading = lanes[lane, LANE_HEADING]
    if lanes[lane, KIND] == ARC:
        turn = lanes[lane, TURN]
        heading = turn * s / lanes[lane, RADIUS] + lanes[lane, PHASE] + math.pi / 2.0 * turn
    return heading


@inlined
def lane_point(lanes: Floats, lane: int, s: float, lateral: float) -> tuple[float, float]:
    """Return the point (x, y) at a place beside a lane [m].

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        s: [m].
        lateral: To the left of the centre [m].
    """
    if lanes[lane, KIND] == ARC:
        sine, cosine = sin_cos(lanes[lane, TURN] * s / lanes[lane, RADIUS] + lanes[lane, PHASE])
        reach = lanes[lane, RADIUS] - lateral * lanes[lane, TURN]
        return lanes[lane, LANE_X] + reach * cosine, lanes[lane, LANE_Y] + reach * sine
    x = lanes[lane, LANE_X] + s * lanes[lane, LANE_COSINE] - lateral * lanes[lane, LANE_SINUS]
    return x, lanes[lane, LANE_Y] + s * lanes[lane, LANE_SINUS] + lateral * lanes[lane, LANE_COSINE]


@inlined
def is_on_lane(lanes: Floats, lane: int, s: float, lateral: float, margin: float) -> bool:
    """Tell whether a place lies on a lane widened by a margin [m] to either side."""
    return (
        abs(lateral) <= lanes[lane, WIDTH] / 2.0 + margin
        and -OVERHANG <= s < lanes[lane, LANE_LENGTH] + OVERHANG
    )


@inlined
def is_reachable(lanes: Floats, lane: int, s: float, lateral: float) -> bool:
    """Tell whether one may change to a lane from a place beside it."""
    return (
        lanes[lane, FORBIDDEN] == 0.0
        and abs(lateral) <= 2.0 * lanes[lane, WIDTH]
        and 0.0 <= s < lanes[lane, LANE_LENGTH] + OVERHANG
    )


@inlined
def distance_to_lane(lanes: Floats, lane: int, s: float, lateral: float) -> float:
    """Return how far a place is from the centre line, along plus across [m]."""
    return abs(lateral) + max(s - lanes[lane, LANE_LENGTH], 0.0) + max(0.0 - s, 0.0)


@inlined
def least_distance(lanes: Floats, lane: int, x: float, y: float) -> float:
    """Return a distance [m] that a point has at least from a lane; cheap, and often far too low.

    Never above ``distance_to_lane`` of its place, nor above what a place on the lane's margin and
    overhang has, but for rounding.
    """
    dx = max(lanes[lane, LEAST_X] - x, x - lanes[lane, MOST_X])
    return max(dx, lanes[lane, LEAST_Y] - y, y - lanes[lane, MOST_Y])


@compiled
def write_straight(
    lane: Floats, x: float, y: float, heading: float, length: float, width: float, limit: float
) -> None:
    """Write a straight lane.

    Args:
        lane: (LANE_WIDTH,) out.
        x: Of its start [m].
        y: Of its start [m].
        heading: [rad].
        length: [m].
        width: [m].
        limit: Speed limit [m/s], inf for none.
    """
    lane[:] = 0.0
    lane[KIND], lane[LANE_X], lane[LANE_Y], lane[LANE_HEADING] = STRAIGHT, x, y, heading
    lane[LANE_SINUS], lane[LANE_COSINE] = sin_cos(heading)
    lane[LANE_LENGTH], lane[WIDTH], lane[LIMIT] = length, width, limit
    _bound(lane, x, y, x + length * lane[LANE_COSINE], y + length * lane[LANE_SINUS], 0.0)


@compiled
def write_arc(
    lane: Floats,
    x: float,
    y: float,
    radius: float,
    phase: float,
    turn: float,
    length: float,
    width: float,
    limit: float,
) -> None:
    """Write a circular lane.

    Args:
        lane: (LANE_WIDTH,) out.
        x: Of the centre [m].
        y: Of the centre [m].
        radius: > 0 [m].
        phase: Direction of its start as seen from the centre [rad].
        turn: 1 to the left, -1 to the right.
        length: [m].
        width: [m].
        limit: Speed limit [m/s], inf for none.
    """
    lane[:] = 0.0
    lane[KIND], lane[LANE_X], lane[LANE_Y], lane[RADIUS] = ARC, x, y, radius
    lane[PHASE], lane[TURN] = phase, turn
    lane[LANE_LENGTH], lane[WIDTH], lane[LIMIT] = length, width, limit
    half = 0.5 * length / radius
    if half >= 0.5 * math.pi:
        _bound(lane, x, y, x, y, radius)
        return
    # An arc of less than a half turn lies within its sagitta of its chord.
    sine, cosine = sin_cos(phase)
    sine_end, cosine_end = sin_cos(phase + turn * length / radius)
    _bound(
        lane,
        x + radius * cosine,
        y + radius * sine,
        x + radius * cosine_end,
        y + radius * sine_end,
        radius * (1.0 - cos(half)),
    )


@inlined
def _bound(lane: Floats, x_1: float, y_1: float, x_2: float, y_2: float, margin: float) -> None:
    """Write the box around two points, larger by a margin on all sides."""
    lane[LEAST_X], lane[MOST_X] = min(x_1, x_2) - margin, max(x_1, x_2) + margin
    lane[LEAST_Y], lane[MOST_Y] = min(y_1, y_2) - margin, max(y_1, y_2) + margin


# --- A network of lanes: which one a vehicle is on, which are beside it, and which comes next -----

Ints = NDArray[np.int64]

# Columns of a lane's links: the first lane of its road, how many the road has, which of them it is;
# how many roads follow, and how many lanes are looked into; then the first lane of each road that
# follows, and the lanes that are looked into.
FIRST, COUNT, PLACE, NEXT_ROADS, LINKED, LIST = range(6)

_SLACK = 1e-6
"""Rounding that ``least_distance`` may be off by [m], amply."""

_SAME = 1e-9
"""Rounding of where a lane begins [m], amply."""


def build_links(roads: Sequence[tuple[Hashable, Hashable, int]], *, connected: bool = True) -> Ints:
    """Number the lanes of roads and connect them.

    A driver looks beyond the ends of a lane into one lane of each road that follows, then into one
    of each road that leads to the lane's: the same from the left, or else the first.

    Args:
        roads: Node at which a road starts, node at which it ends, and its number of lanes.
        connected: Whether drivers look beyond the ends of a lane.

    Returns:
        (L, T) one row for each lane, filled with -1.
    """
    firsts = np.cumsum([0, *(count for _, _, count in roads)])
    rows: list[list[int]] = []
    for number, (begin, end, count) in enumerate(roads):
        after = [k for k, road in enumerate(roads) if road[0] == end]
        before = [k for k, road in enumerate(roads) if road[1] == begin]
        others = [*after, *before] if connected else []
        for place in range(count):
            row = [int(firsts[number]), count, place, len(after), len(others)]
            row += [int(firsts[k]) for k in after]
            row += [int(firsts[k]) + (place if place < roads[k][2] else 0) for k in others]
            rows.append(row)
    links = np.full((len(rows), max(len(row) for row in rows)), -1, dtype=np.int64)
    for number, row in enumerate(rows):
        links[number, : len(row)] = row
    return links


@compiled
def mark_alongside(lanes: Floats, links: Ints) -> None:
    """Say in all lanes whether they are one straight road: then a place along one is one along all.

    They have one direction, one beginning and one end, and none overlaps another: of somebody
    between the edges of one lane, no other is nearer.

    Args:
        lanes: (L, LANE_WIDTH) in and out.
        links: (L, T), see ``build_links``.
    """
    alongside = links[0, COUNT] == lanes.shape[0]
    for lane in range(lanes.shape[0]):
        alongside &= links[lane, NEXT_ROADS] == 0 and links[lane, LINKED] == 0
        alongside &= (
            lanes[lane, KIND] == STRAIGHT and lanes[lane, LANE_LENGTH] == lanes[0, LANE_LENGTH]
        )
        alongside &= (
            lanes[lane, LANE_COSINE] == lanes[0, LANE_COSINE]
            and lanes[lane, LANE_SINUS] == lanes[0, LANE_SINUS]
        )
        for other in range(lane):
            dx, dy = (
                lanes[lane, LANE_X] - lanes[other, LANE_X],
                lanes[lane, LANE_Y] - lanes[other, LANE_Y],
            )
            along = dx * lanes[0, LANE_COSINE] + dy * lanes[0, LANE_SINUS]
            across = dy * lanes[0, LANE_COSINE] - dx * lanes[0, LANE_SINUS]
            width = max(lanes[lane, WIDTH], lanes[other, WIDTH])
            alongside &= abs(along) <= _SAME and abs(across) >= width - _SAME
    for lane in range(lanes.shape[0]):
        lanes[lane, ALONGSIDE] = 1.0 if alongside else 0.0


@inlined
def is_alone_nearest(lanes: Floats, lane: int, lateral: float) -> bool:
    """Tell whether no other lane can be nearer, for certain, by the place beside this one [m].

    So it is between the edges of a lane of one straight road; there that place is
    ``straight_local``, anywhere else the answer is no.
    """
    return lanes[lane, ALONGSIDE] != 0.0 and abs(lateral) < 0.5 * lanes[lane, WIDTH] - _SLACK


@inlined
def _weight(lanes: Floats, lane: int, s: float, lateral: float, heading: float) -> float:
    """Return the distance of a place from a lane, with a radian for a metre."""
    turned = wrapped(heading - lane_heading(lanes, lane, s))
    return distance_to_lane(lanes, lane, s, lateral) + abs(turned)


@inlined
def nearest_lane(
    lanes: Floats,
    links: Ints,
    guess: int,
    x: float,
    y: float,
    heading: float,
) -> tuple[int, float, float]:
    """Find the lane that a vehicle is on: the nearest in place and direction, the first of equals.

    It begins where that probably is. A lane is skipped if it is further away for certain than the
    best one so far; the best is known early because the guess, its neighbours and what follows it
    are looked at first.

    Args:
        lanes: (L, LANE_WIDTH), L >= 1.
        links: (L, T), see ``build_links``.
        guess: Lane of the vehicle a tick ago.
        x: [m].
        y: [m].
        heading: [rad].

    Returns:
        The lane, and the place (s, lateral) beside it [m].
    """
    found = guess
    found_s, found_lateral = lane_local(lanes, guess, x, y)
    least = _weight(lanes, guess, found_s, found_lateral, heading)
    if not 0.0 <= found_s <= lanes[guess, LANE_LENGTH]:
        # Past the end of its lane a vehicle is on the road that follows.
        for k in range(links[guess, NEXT_ROADS]):
            first = links[guess, LIST + k]
            number = first + min(links[guess, PLACE], links[first, COUNT] - 1)
            s, lateral = lane_local(lanes, number, x, y)
            weight = _weight(lanes, number, s, lateral, heading)
            if weight < least or (weight == least and number < found):
                least, found, found_s, found_lateral = weight, number, s, lateral
    begun = found
    for number in range(lanes.shape[0]):
        if number == begun or least_distance(lanes, number, x, y) > least + _SLACK:
            continue
        if lanes[number, KIND] == ARC:
            dx, dy = x - lanes[number, LANE_X], y - lanes[number, LANE_Y]
            if abs(lanes[number, RADIUS] - math.sqrt(dx * dx + dy * dy)) > least + _SLACK:
                continue
        s, lateral = lane_local(lanes, number, x, y)
        weight = _weight(lanes, number, s, lateral, heading)
        if weight < least or (weight == least and number < found):
            least, found, found_s, found_lateral = weight, number, s, lateral
    return found, found_s, found_lateral


@compiled
def next_lane(lanes: Floats, links: Ints, lane: int, x: float, y: float) -> int:
    """Return the lane to go on in at the end of a lane; itself if none follows.

    Of each road that follows, the same lane if it has as many, else the nearest one; of these, the
    nearest, the first of equals.

    Args:
        lanes: (L, LANE_WIDTH).
        links: (L, T), see ``build_links``.
        lane: That ends.
        x: Of the vehicle [m].
        y: Of the vehicle [m].
    """
    s, _ = lane_local(lanes, lane, x, y)
    x, y = lane_point(lanes, lane, s, 0.0)
    chosen = lane
    least = math.inf
    for k in range(links[lane, NEXT_ROADS]):
        first = links[lane, LIST + k]
        begin, end = first, first + links[first, COUNT]
        if links[first, COUNT] == links[lane, COUNT]:
            begin = first + links[lane, PLACE]
            end = begin + 1
        for number in range(begin, end):
            along, lateral = lane_local(lanes, number, x, y)
            distance = distance_to_lane(lanes, number, along, lateral)
            if distance < least:
                least, chosen = distance, number
    return chosen


# --- Vehicles in rows of numbers, and who drives ahead of and behind a place on a lane ------------

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


class Road(NamedTuple):
    """The lanes of a run, the things on them, and scratch for a tick.

    Attributes:
        lanes: (L, LANE_WIDTH).
        links: (L, T), see ``build_links``.
        vehicles: (N, VEHICLE_WIDTH).
        marks: (N, MARK_WIDTH).
        seen: (L, N), see ``make_lists``.
        along: (L, N).
        listed: (L, 1 + N).
    """

    lanes: Floats
    links: Ints
    vehicles: Floats
    marks: Ints
    seen: Floats
    along: Floats
    listed: Ints


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
def place_along(road: Road, lane: int, who: int) -> float:
    """Return where somebody is along a lane [m]."""
    s = road.vehicles[who, S]
    if road.marks[who, LANE] != lane:
        s, _ = lane_local(road.lanes, lane, road.vehicles[who, X], road.vehicles[who, Y])
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
def _place_seen(lanes: Floats, lane: int, reach: float, x: float, y: float) -> float:
    """Return where a point is along a lane [m], NaN if not seen on it."""
    near = True
    if lanes[lane, KIND] != STRAIGHT:
        near = least_distance(lanes, lane, x, y) <= reach + OVERHANG + MARGIN
        if lanes[lane, KIND] == ARC:
            dx, dy = x - lanes[lane, LANE_X], y - lanes[lane, LANE_Y]
            near &= abs(lanes[lane, RADIUS] - math.sqrt(dx * dx + dy * dy)) <= reach
    place = math.nan
    if near:
        s, lateral = lane_local(lanes, lane, x, y)
        if is_on_lane(lanes, lane, s, lateral, MARGIN):
            place = s
    return place


@inlined
def see_around(road: Road, lane: int) -> None:
    """Find out who is seen on a lane and those linked to it, unless that is known.

    Args:
        road: Out: who is seen, and which lanes are known.
        lane: Where to look.
    """
    for link in range(-1, road.links[lane, LINKED]):
        number = lane if link < 0 else _linked(road.links, lane, link)
        if road.listed[number, 0] != UNSEEN:
            continue
        road.listed[number, 0] = 0
        reach = road.lanes[number, WIDTH] / 2.0 + MARGIN
        for who in range(road.vehicles.shape[0]):
            x, y = road.vehicles[who, X], road.vehicles[who, Y]
            road.seen[number, who] = _place_seen(road.lanes, number, reach, x, y)


@inlined
def _link_offset(lanes: Floats, links: Ints, lane: int, link: int) -> float:
    """Return what to add to a place on a linked lane to have it on the lane itself [m]."""
    offset = lanes[lane, LANE_LENGTH]
    if link >= links[lane, NEXT_ROADS]:
        offset = -lanes[_linked(links, lane, link), LANE_LENGTH]
    return offset


@inlined
def neighbours(road: Road, lane: int, who: int, s: float) -> tuple[int, int]:
    """Find who is ahead of and who is behind somebody on a lane, by looking at everybody.

    Args:
        road: After ``see_around``.
        lane: Where to look.
        who: For whom.
        s: Where that is along the lane [m].

    Returns:
        The nearest at or ahead of the place and the nearest behind it, -1 for nobody. Somebody on
        the lane and on linked ones counts on the first of them.
    """
    front = rear = -1
    front_s, rear_s = math.inf, -math.inf
    count = road.links[lane, LINKED]
    for other in range(road.seen.shape[1]):
        place = road.seen[lane, other]
        link = 0
        while link < count and math.isnan(place):
            place = road.seen[_linked(road.links, lane, link), other] + _link_offset(
                road.lanes, road.links, lane, link
            )
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
def _list_lane(road: Road, lane: int) -> None:
    reach = road.lanes[lane, WIDTH] / 2.0 + MARGIN
    count = 0
    for k in range(road.marks.shape[0]):
        who = road.marks[k, ORDER]
        s = _place_seen(road.lanes, lane, reach, road.vehicles[who, X], road.vehicles[who, Y])
        road.seen[lane, who] = s
        if math.isnan(s):
            continue
        place = count
        while place > 0 and (
            road.along[lane, place - 1] > s
            or (road.along[lane, place - 1] == s and road.listed[lane, place] > who)
        ):
            road.along[lane, place] = road.along[lane, place - 1]
            road.listed[lane, 1 + place] = road.listed[lane, place]
            place -= 1
        road.along[lane, place], road.listed[lane, 1 + place] = s, who
        count += 1
    road.listed[lane, 0] = count
    for k in range(count):
        who = road.listed[lane, 1 + k]
        if road.marks[who, LANE] == lane:
            road.marks[who, RANK] = k


@inlined
def list_around(road: Road, lane: int) -> None:
    """Sort who is seen on a lane and those linked to it, unless that is done.

    Args:
        road: Out: the lists, and the ranks in the marks.
        lane: Where to look.
    """
    for link in range(-1, road.links[lane, LINKED]):
        number = lane if link < 0 else _linked(road.links, lane, link)
        if road.listed[number, 0] == UNSEEN:
            _list_lane(road, number)


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
def front_listed(road: Road, lane: int, who: int, s: float) -> int:
    """Find who is ahead, as ``neighbours`` does, in the lists that ``list_around`` made.

    Of equal places the higher number is ahead, as when everybody is looked at in turn.
    """
    front = -1
    front_s = math.inf
    for link in range(-1, road.links[lane, LINKED]):
        number = lane if link < 0 else _linked(road.links, lane, link)
        offset = 0.0 if link < 0 else _link_offset(road.lanes, road.links, lane, link)
        count = road.listed[number, 0]
        if number == road.marks[who, LANE] and link < 0 and road.seen[number, who] == s:
            k = road.marks[who, RANK]
            while k > 0 and road.along[number, k - 1] == s:
                k -= 1
        else:
            k = _first_at(road.along, number, count, offset, s)
        while k < count and road.along[number, k] + offset <= front_s:
            other, place = road.listed[number, 1 + k], road.along[number, k] + offset
            if (
                other != who
                and (place < front_s or other > front)
                and not _is_seen_before(road.links, road.seen, lane, link, other)
            ):
                front, front_s = other, place
            k += 1
    return front


@inlined
def rear_listed(road: Road, lane: int, who: int, s: float) -> int:
    """Find who is behind, as ``front_listed`` does; of equal places it is the lower number."""
    rear = -1
    rear_s = -math.inf
    for link in range(-1, road.links[lane, LINKED]):
        number = lane if link < 0 else _linked(road.links, lane, link)
        offset = 0.0 if link < 0 else _link_offset(road.lanes, road.links, lane, link)
        k = _first_at(road.along, number, road.listed[number, 0], offset, s) - 1
        while k >= 0 and road.along[number, k] + offset >= rear_s:
            other, place = road.listed[number, 1 + k], road.along[number, k] + offset
            if (
                other != who
                and (place > rear_s or other < rear)
                and not _is_seen_before(road.links, road.seen, lane, link, other)
            ):
                rear, rear_s = other, place
            k -= 1
    return rear
