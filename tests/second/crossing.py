"""A second implementation of post-encroachment and encroachment times at constant velocities.

In continuous time, without rows: when both are where the actor crosses follows from their motion.
"""

import math
from typing import NamedTuple

from tests.second.scene import Body

INF = math.inf


class Crossing(NamedTuple):
    """Values with their statuses, as metrics say them."""

    pet: tuple[float, str]
    overlap: tuple[float, str]
    encroachment: tuple[float, str]


NOTHING = (math.nan, "no_conflict")


def crosses(other: Body) -> bool:
    return abs(other.across) > abs(other.along)


def in_corridor(own: Body, other: Body) -> tuple[float, float]:
    """From when to when the actor is in the corridor of an ego that drives along the road."""
    reach = own.half_width + other.half_width
    ends = sorted((side * reach - (other.d - own.d)) / other.across for side in (-1.0, 1.0))
    return ends[0], ends[1]


def area(own: Body, other: Body, enter: float, leave: float) -> tuple[float, float]:
    """When the ego enters and leaves what the actor takes up along the road between two times."""
    places = [other.s + other.along * time for time in (enter, leave)]
    low, high = min(places) - other.half_length, max(places) + other.half_length
    front, rear = own.s + own.half_length, own.s - own.half_length
    return (low - front) / own.along, (high - rear) / own.along


def known(time: float, end: float, *, is_at_start: bool) -> float:
    """A time as a run until its end knows it: before its begin and after its end are infinite."""
    if is_at_start:
        return -INF
    return time if time <= end else INF


def judged(own: Body, other: Body, end: float, *, is_contact: bool) -> Crossing:
    """Judge a run with one actor that ends after so long."""
    if not crosses(other):
        return Crossing(NOTHING, NOTHING, NOTHING)
    enter, leave = in_corridor(own, other)
    if enter > end or leave <= 0.0:
        return Crossing(NOTHING, NOTHING, NOTHING)
    first, gone = area(own, other, max(enter, 0.0), min(leave, end))
    enter = known(enter, end, is_at_start=enter < 0.0)
    leave = known(leave, end, is_at_start=False)
    first = known(first, end, is_at_start=first <= 0.0)
    gone = known(gone, end, is_at_start=gone <= 0.0)
    if gone == -INF and not is_contact:
        return Crossing(NOTHING, NOTHING, NOTHING)
    stays = (leave - enter, "value") if enter > -INF and leave < INF else (math.nan, "incomplete")
    second = max(enter, first, 0.0)
    if is_contact or (second < INF and first < leave and enter < gone):
        together = max(0.0, min(leave, gone, end) - min(second, end))
        return Crossing((math.nan, "undefined"), (together, "value"), stays)
    if second == INF:
        return Crossing((math.nan, "incomplete"), NOTHING, stays)
    miss = first - leave if first >= leave else enter - gone
    return Crossing((miss, "value"), NOTHING, stays)


def predicted(own: Body, other: Body) -> float:
    """Post-encroachment time as forecast; 0 for both at once, infinity for none."""
    gap = other.s - own.s - own.half_length - other.half_length
    if not crosses(other) or gap <= 0.0 or own.along <= 0.0:
        return INF
    enter, leave = in_corridor(own, other)
    if leave < 0.0:
        return INF
    first, gone = area(own, other, max(enter, 0.0), leave)
    if gone <= 0.0:
        return INF
    return max(0.0, max(first, 0.0) - leave, enter - gone)
