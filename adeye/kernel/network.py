"""A network of lanes: which one a vehicle is on, which are beside it, and which comes next.

Lanes are numbered road by road, in the order in which the roads were added and within a road from
the left, so the lanes of a road have consecutive numbers. Geometry stands in the lanes' rows
(``kernel.lanes``), what is connected in rows of ``links``, which all runs of a batch share.

Source:
    The rules are those of highway-env 1.12 (``RoadNetwork`` in ``road/road.py``), without routes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.lanes import (
    ALONGSIDE,
    ARC,
    COSINE,
    KIND,
    LENGTH,
    RADIUS,
    SINUS,
    STRAIGHT,
    WIDTH,
    X,
    Y,
    distance_to_lane,
    lane_heading,
    lane_local,
    lane_point,
    least_distance,
    wrapped,
)

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

__all__ = [
    "build_links",
    "is_alone_nearest",
    "mark_alongside",
    "nearest_lane",
    "next_lane",
    "search_lanes",
]

Floats = NDArray[np.float64]
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
        alongside &= lanes[lane, KIND] == STRAIGHT and lanes[lane, LENGTH] == lanes[0, LENGTH]
        alongside &= (
            lanes[lane, COSINE] == lanes[0, COSINE] and lanes[lane, SINUS] == lanes[0, SINUS]
        )
        for other in range(lane):
            dx, dy = lanes[lane, X] - lanes[other, X], lanes[lane, Y] - lanes[other, Y]
            along = dx * lanes[0, COSINE] + dy * lanes[0, SINUS]
            across = dy * lanes[0, COSINE] - dx * lanes[0, SINUS]
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
def _weight(
    lanes: Floats, lane: int, curves: Floats | None, s: float, lateral: float, heading: float
) -> float:
    """Return the distance of a place from a lane, with a radian for a metre."""
    turned = wrapped(heading - lane_heading(lanes, lane, curves, s))
    return distance_to_lane(lanes, lane, s, lateral) + abs(turned)


@compiled
def search_lanes(
    lanes: Floats, curves: Floats | None, x: float, y: float, heading: float
) -> tuple[int, float, float]:
    """Find the lane that a vehicle is on by looking at every lane.

    Args:
        lanes: (L, LANE_WIDTH), L >= 1.
        curves: See ``kernel.lanes``.
        x: [m].
        y: [m].
        heading: [rad].

    Returns:
        The lane nearest in place and direction, the first of equals, and the place (s, lateral)
        beside it [m].
    """
    found = 0
    found_s, found_lateral = lane_local(lanes, 0, curves, x, y)
    least = _weight(lanes, 0, curves, found_s, found_lateral, heading)
    for number in range(1, lanes.shape[0]):
        s, lateral = lane_local(lanes, number, curves, x, y)
        weight = _weight(lanes, number, curves, s, lateral, heading)
        if weight < least:
            least, found, found_s, found_lateral = weight, number, s, lateral
    return found, found_s, found_lateral


@inlined
def nearest_lane(
    lanes: Floats,
    links: Ints,
    curves: Floats | None,
    guess: int,
    x: float,
    y: float,
    heading: float,
) -> tuple[int, float, float]:
    """Find what ``search_lanes`` finds, beginning where it probably is.

    A lane is skipped if it is further away for certain than the best one so far; the best is known
    early because the guess, its neighbours and what follows it are looked at first.

    Args:
        lanes: (L, LANE_WIDTH), L >= 1.
        links: (L, T), see ``build_links``.
        curves: See ``kernel.lanes``.
        guess: Lane of the vehicle a tick ago.
        x: [m].
        y: [m].
        heading: [rad].
    """
    found = guess
    found_s, found_lateral = lane_local(lanes, guess, curves, x, y)
    least = _weight(lanes, guess, curves, found_s, found_lateral, heading)
    if not 0.0 <= found_s <= lanes[guess, LENGTH]:
        # Past the end of its lane a vehicle is on the road that follows.
        for k in range(links[guess, NEXT_ROADS]):
            first = links[guess, LIST + k]
            number = first + min(links[guess, PLACE], links[first, COUNT] - 1)
            s, lateral = lane_local(lanes, number, curves, x, y)
            weight = _weight(lanes, number, curves, s, lateral, heading)
            if weight < least or (weight == least and number < found):
                least, found, found_s, found_lateral = weight, number, s, lateral
    begun = found
    for number in range(lanes.shape[0]):
        if number == begun or least_distance(lanes, number, x, y) > least + _SLACK:
            continue
        if lanes[number, KIND] == ARC:
            dx, dy = x - lanes[number, X], y - lanes[number, Y]
            if abs(lanes[number, RADIUS] - math.sqrt(dx * dx + dy * dy)) > least + _SLACK:
                continue
        s, lateral = lane_local(lanes, number, curves, x, y)
        weight = _weight(lanes, number, curves, s, lateral, heading)
        if weight < least or (weight == least and number < found):
            least, found, found_s, found_lateral = weight, number, s, lateral
    return found, found_s, found_lateral


@compiled
def next_lane(
    lanes: Floats, links: Ints, curves: Floats | None, lane: int, x: float, y: float
) -> int:
    """Return the lane to go on in at the end of a lane; itself if none follows.

    Of each road that follows, the same lane if it has as many, else the nearest one; of these, the
    nearest, the first of equals.

    Args:
        lanes: (L, LANE_WIDTH).
        links: (L, T), see ``build_links``.
        curves: See ``kernel.lanes``.
        lane: That ends.
        x: Of the vehicle [m].
        y: Of the vehicle [m].
    """
    s, _ = lane_local(lanes, lane, curves, x, y)
    x, y = lane_point(lanes, lane, curves, s, 0.0)
    chosen = lane
    least = math.inf
    for k in range(links[lane, NEXT_ROADS]):
        first = links[lane, LIST + k]
        begin, end = first, first + links[first, COUNT]
        if links[first, COUNT] == links[lane, COUNT]:
            begin = first + links[lane, PLACE]
            end = begin + 1
        for number in range(begin, end):
            along, lateral = lane_local(lanes, number, curves, x, y)
            distance = distance_to_lane(lanes, number, along, lateral)
            if distance < least:
                least, chosen = distance, number
    return chosen
