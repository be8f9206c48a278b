"""Compiled: how near the ego is to others at every row of its runs, and who is the worst.

An object is *ahead* if its centre is farther along the road than the ego's; ``bodies`` says when it
is in the path. Gaps run along the road; where the extents overlap although the bodies are apart,
the gap is the distance of the bodies, so that it is 0 in contact only.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.bodies import (
    ACROSS,
    ALONG,
    HALF_LENGTH,
    HALF_WIDTH,
    Body,
    D,
    are_finite,
    is_in_path,
    on_road,
    reach_of,
    turn,
)
from adeye.kernel.criticality import (
    deceleration_rate_to_avoid_crash,
    required_deceleration,
    rss_lateral_distance,
    rss_longitudinal_distance,
    rss_opposite_distance,
    time_gap,
    time_headway,
    time_to_collision,
)
from adeye.kernel.geometry import box_distance
from adeye.kernel.jit import allocating, compiled
from adeye.signals import (
    EGO_HEADING,
    EGO_X,
    EGO_Y,
    OBJECT_ACCELERATION,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
    Floats,
    Ints,
)
from adeye.world.triggers import road_gap

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Shorts = NDArray[np.int16]

QUANTITIES: Final = (
    "distance",
    "gap",
    "ttc",
    "time_gap",
    "time_headway",
    "drac",
    "required_deceleration",
    "rss_margin",
)
"""Columns of the result; the decelerations are worse when larger, the others when smaller."""
DISTANCE, GAP, TTC, TIME_GAP, TIME_HEADWAY, DRAC, REQUIRED, RSS_MARGIN = range(8)

LARGEST_DEMAND: Final = 100.0
"""Deceleration that a demand is limited to [m/s²], ten times what tyres can do: just before contact
it grows without bound, and its size says nothing any more."""


@allocating
def measure_runs(  # noqa: C901, PLR0913, PLR0915, PLR0917 - a kernel over the whole scene
    length: Ints,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    objects: Floats,
    places: Floats,
    sizes: Floats,
    contact: Ints,
    rss: Floats,
    is_least_only: bool,  # noqa: FBT001 - compiled
    values: Floats,
    actors: Shorts,
) -> None:
    """Measure the conflicts of B runs at each of their rows.

    Args:
        length: (B,) rows that a run has.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        objects: (B, T, M, 5).
        places: (B, T, M, 6).
        sizes: (B, M, 3).
        contact: (B, T) object that the ego touches, -1 for none.
        rss: (9,) parameters, in the order of ``series.RssParameters``.
        is_least_only: Whether of the distances only the least of a run is wanted: others may be
            replaced by a lower bound that is larger than it.
        values: (8, B, T) out, see ``QUANTITIES``; +inf where there is no conflict, 0 for the
            decelerations; all NaN at a row with an input that is not finite.
        actors: (8, B, T) out: object of the worst case, -1 for none.
    """
    worst = np.zeros(8)
    who = np.zeros(8, dtype=np.int64)
    turns = np.zeros((objects.shape[2] + 1, 3))
    reach = np.zeros(objects.shape[2])
    for run in range(length.shape[0]):
        # Views of one row would cost more than what is measured there.
        own, own_place = ego[run], ego_place[run]
        states, where, size = objects[run], places[run], sizes[run]
        own_length, own_width = ego_size[run, 0], ego_size[run, 1]
        for thing in range(objects.shape[2]):
            reach[thing] = reach_of(own_length, own_width) + reach_of(
                size[thing, 0], size[thing, 1]
            )
        turns[:] = math.nan
        least = math.inf
        for row in range(length[run]):
            worst[:] = math.inf
            worst[DRAC] = worst[REQUIRED] = 0.0
            who[:] = -1
            x, y, heading = own[row, EGO_X], own[row, EGO_Y], own[row, EGO_HEADING]
            s, d = own_place[row, PLACE_S], own_place[row, PLACE_D]
            speed = own[row, OBJECT_SPEED]
            acceleration, road = own[row, OBJECT_ACCELERATION], own_place[row, PLACE_HEADING]
            is_finite = are_finite(
                x, y, heading, speed, acceleration, s, d, road, own_length, own_width
            )
            turn(turns, 0, heading - road)
            body = on_road(s, d, speed, own_length, own_width, turns[0, 1], turns[0, 2])
            for thing in range(objects.shape[2]):
                if not is_finite:
                    break
                ox, oy = states[row, thing, OBJECT_X], states[row, thing, OBJECT_Y]
                o_heading = states[row, thing, OBJECT_HEADING]
                o_speed = states[row, thing, OBJECT_SPEED]
                acceleration = states[row, thing, OBJECT_ACCELERATION]
                os, od = where[row, thing, PLACE_S], where[row, thing, PLACE_D]
                o_turn = where[row, thing, PLACE_HEADING]
                o_length, o_width = size[thing, 0], size[thing, 1]
                is_finite = are_finite(
                    ox, oy, o_heading, o_speed, acceleration, os, od, o_turn, o_length, o_width
                )
                if not is_finite:
                    break
                turn(turns, thing + 1, o_heading - o_turn)
                sine, cosine = turns[thing + 1, 1], turns[thing + 1, 2]
                other = on_road(os, od, o_speed, o_length, o_width, sine, cosine)
                nearest = min(worst[DISTANCE], least) if is_least_only else worst[DISTANCE]
                apart = math.sqrt((ox - x) * (ox - x) + (oy - y) * (oy - y))
                apart = apart * 0.9999999 - reach[thing]
                if not apart > nearest:
                    apart = box_distance(
                        x, y, heading, own_length, own_width, ox, oy, o_heading, o_length, o_width
                    )
                _keep_least(worst, who, DISTANCE, apart, thing)
                if os > s:
                    free = road_gap(s, body[HALF_LENGTH], os, other[HALF_LENGTH])
                    if is_in_path(body, 0.5 * own_width, other, free):
                        gap = free
                        if gap <= 0.0:
                            gap = box_distance(x, y, heading, own_length, own_width,
                                               ox, oy, o_heading, o_length, o_width)  # fmt: skip
                        _measure_ahead(body, other, acceleration * cosine, gap, thing, worst, who)
                    _measure_rss(body, other, rss, free, thing, worst, who)
            least = min(least, worst[DISTANCE])
            touched = contact[run, row]
            if touched >= 0:
                worst[DISTANCE] = worst[TTC] = 0.0
                who[DISTANCE] = who[TTC] = touched
            for quantity in range(8):
                values[quantity, run, row] = worst[quantity] if is_finite else math.nan
                actors[quantity, run, row] = who[quantity]


@allocating
def measure_object(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    first: Ints,
    end: Ints,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    states: Floats,
    places: Floats,
    sizes: Floats,
    contact: Ints,
    thing: int,
    distances: Floats,
    gaps: Floats,
) -> None:
    """Measure body distance and signed gap to one object at some rows of B runs.

    Args:
        first: (B,) first row.
        end: (B,) row behind the last.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        states: (B, T, 5) of the object.
        places: (B, T, 6) of the object.
        sizes: (B, 3) of the object.
        contact: (B, T) object that the ego touches, -1 for none.
        thing: Index of the object.
        distances: (B, T) out [m], or (B, 0) if they are not wanted.
        gaps: (B, T) out [m]: ahead > 0, behind < 0, 0 side by side; or (B, 0).
    """
    turns = np.zeros((2, 3))
    for run in range(first.shape[0]):
        turns[:] = math.nan
        own, own_place, state, place = ego[run], ego_place[run], states[run], places[run]
        own_length, own_width = ego_size[run, 0], ego_size[run, 1]
        length, width = sizes[run, 0], sizes[run, 1]
        for row in range(first[run], end[run]):
            x, y, heading = own[row, EGO_X], own[row, EGO_Y], own[row, EGO_HEADING]
            ox, oy, o_heading = (
                state[row, OBJECT_X],
                state[row, OBJECT_Y],
                state[row, OBJECT_HEADING],
            )
            s, os = own_place[row, PLACE_S], place[row, PLACE_S]
            is_finite = are_finite(
                x, y, heading, own[row, OBJECT_SPEED], own[row, OBJECT_ACCELERATION], s,
                own_place[row, PLACE_D], own_place[row, PLACE_HEADING], own_length, own_width,
            ) and are_finite(
                ox, oy, o_heading, state[row, OBJECT_SPEED], state[row, OBJECT_ACCELERATION], os,
                place[row, PLACE_D], place[row, PLACE_HEADING], length, width,
            )  # fmt: skip
            if gaps.shape[1]:
                gaps[run, row] = math.nan
                if is_finite:
                    turn(turns, 0, heading - own_place[row, PLACE_HEADING])
                    turn(turns, 1, o_heading - place[row, PLACE_HEADING])
                    body = on_road(s, 0.0, 0.0, own_length, own_width, turns[0, 1], turns[0, 2])
                    other = on_road(os, 0.0, 0.0, length, width, turns[1, 1], turns[1, 2])
                    gaps[run, row] = road_gap(s, body[HALF_LENGTH], os, other[HALF_LENGTH])
            if distances.shape[1]:
                distances[run, row] = 0.0
                if not is_finite:
                    distances[run, row] = math.nan
                elif contact[run, row] != thing:
                    distances[run, row] = box_distance(
                        x, y, heading, own_length, own_width, ox, oy, o_heading, length, width
                    )


@compiled
def _keep_least(worst: Floats, who: Ints, quantity: int, value: float, thing: int) -> None:
    if value < worst[quantity]:
        worst[quantity] = value
        who[quantity] = thing


@compiled
def _keep_largest(worst: Floats, who: Ints, quantity: int, value: float, thing: int) -> None:
    # An object in the path is somebody's worst case also where it demands nothing.
    if value > worst[quantity] or who[quantity] < 0:
        worst[quantity] = value
        who[quantity] = thing


@compiled
def _measure_ahead(  # noqa: PLR0913, PLR0917 - a kernel
    own: Body,
    other: Body,
    acceleration: float,
    gap: float,
    thing: int,
    worst: Floats,
    who: Ints,
) -> None:
    """Keep what an object in the path is to the ego.

    Args:
        own: (6,) ego on the road.
        other: (6,) object on the road.
        acceleration: Of the object along the road [m/s²].
        gap: Along the road, or the distance of the bodies where they overlap along it [m].
        thing: Index of the object.
        worst: (8,) in and out.
        who: (8,) in and out.
    """
    speed, lead = own[ALONG], other[ALONG]
    closing = speed - lead
    _keep_least(worst, who, GAP, gap, thing)
    _keep_least(worst, who, TTC, time_to_collision(gap, closing), thing)
    _keep_least(worst, who, TIME_GAP, time_gap(gap, speed), thing)
    headway = time_headway(gap, 2.0 * other[HALF_LENGTH], speed)
    _keep_least(worst, who, TIME_HEADWAY, headway, thing)
    drac = limited_demand(deceleration_rate_to_avoid_crash(gap, closing))
    _keep_largest(worst, who, DRAC, drac, thing)
    # The closed form is for a lead that goes the same way; of oncoming ones the speed counts.
    needed = drac if lead < 0.0 else required_deceleration(gap, speed, lead, acceleration)
    needed = limited_demand(needed)
    _keep_largest(worst, who, REQUIRED, needed, thing)


@compiled
def limited_demand(demand: float) -> float:
    """Limit a deceleration demand; what is not finite stays as it is and is told apart later."""
    return LARGEST_DEMAND if LARGEST_DEMAND < demand < math.inf else demand


@compiled
def _measure_rss(  # noqa: PLR0913, PLR0917 - a kernel
    own: Body, other: Body, rss: Floats, gap: float, thing: int, worst: Floats, who: Ints
) -> None:
    """Keep the RSS margin to an object ahead, if it is beside the ego at no safe distance.

    Args:
        own: (6,) ego on the road.
        other: (6,) object on the road.
        rss: (9,) parameters, in the order of ``series.RssParameters``.
        gap: Along the road [m].
        thing: Index of the object.
        worst: (8,) in and out.
        who: (8,) in and out.
    """
    beside = other[D] - own[D]
    side = math.copysign(1.0, beside)
    lateral = rss_lateral_distance(
        side * own[ACROSS], side * other[ACROSS], rss[0], rss[1], rss[6], rss[7], rss[8]
    )
    if abs(beside) - own[HALF_WIDTH] - other[HALF_WIDTH] >= lateral:
        return
    speed, lead = own[ALONG], other[ALONG]
    if lead < 0.0:
        safe = rss_opposite_distance(speed, -lead, rss[0], rss[2], rss[5], rss[3])
    else:
        safe = rss_longitudinal_distance(speed, lead, rss[0], rss[2], rss[3], rss[4])
    _keep_least(worst, who, RSS_MARGIN, gap - safe, thing)
