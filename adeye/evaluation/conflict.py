"""Compiled: how near the ego is to others at every row of its runs, and who is the worst.

An object is *ahead* if its centre is farther along the road than the ego's; ``bodies`` says when it
is in the path. Gaps run along the lane that the ego drives, at its lateral place, and speeds are
those along each one's own lane; where the extents overlap although the bodies are apart, the gap is
the distance of the bodies, so that it is 0 in contact only.
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
from adeye.evaluation.culling import (
    distance_below,
    is_far_beside,
    lateral_reach,
    least_so_far,
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
from adeye.kernel.jit import allocating, compiled, inlined
from adeye.kernel.road import lane_way
from adeye.kernel.rss import rss_lateral_distance_printed
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
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
def measure_runs(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
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
        rss: (12,) parameters, in the order of ``series.RssParameters``.
        is_least_only: Whether of the distances only the least of a run is wanted: others may be
            +inf.
        values: (8, B, T) out, see ``QUANTITIES``; +inf where there is no conflict, 0 for the
            decelerations; all NaN at a row with an input that is not finite; 0 beyond the run.
        actors: (8, B, T) out: object of the worst case, -1 for none.
    """
    turns = np.zeros((2, objects.shape[2] + 1, 3))
    reach = np.zeros(objects.shape[2])
    for run in range(length.shape[0]):
        _fill_free(length[run], run, values, actors)
        own_reach = reach_of(ego_size[run, 0], ego_size[run, 1])
        for thing in range(objects.shape[2]):
            reach[thing] = own_reach + reach_of(sizes[run, thing, 0], sizes[run, thing, 1])
        turns[:] = math.nan
        nearest, is_open = math.inf, False
        if is_least_only:
            nearest, is_open = least_so_far(run, length[run], ego, ego_size, objects, sizes), True
        for row in range(length[run]):
            if not is_least_only:
                nearest = math.inf
            nearest, is_open = _measure_row(
                run, row, ego, ego_place, ego_size, objects, places, sizes, rss, turns, reach,
                nearest, is_open, values, actors,
            )  # fmt: skip
            touched = contact[run, row]
            if touched >= 0 and values[DISTANCE, run, row] == values[DISTANCE, run, row]:
                values[DISTANCE, run, row] = values[TTC, run, row] = 0.0
                actors[DISTANCE, run, row] = actors[TTC, run, row] = touched


@inlined
def _fill_free(rows: int, run: int, values: Floats, actors: Shorts) -> None:
    """Write "no conflict" at every row of a run, and 0 beyond it."""
    for quantity in range(8):
        nothing = 0.0 if quantity in (DRAC, REQUIRED) else math.inf
        for row in range(rows):
            values[quantity, run, row] = nothing
        for row in range(rows, values.shape[2]):
            values[quantity, run, row] = 0.0
        for row in range(values.shape[2]):
            actors[quantity, run, row] = -1


@inlined
def _measure_row(  # noqa: PLR0913, PLR0917 - a part of the kernel
    run: int,
    row: int,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    objects: Floats,
    places: Floats,
    sizes: Floats,
    rss: Floats,
    turns: Floats,
    reach: Floats,
    nearest: float,
    is_open: bool,  # noqa: FBT001 - compiled
    values: Floats,
    actors: Shorts,
) -> tuple[float, bool]:
    """Measure the conflicts with all objects at a row, which has none so far.

    Beside what ``measure_runs`` takes: angles with sine and cosine (2, M + 1, 3), those of the
    bodies to the road and those of the objects to the ego; how much nearer than their centres the
    bodies can be (M,) [m]; and a distance from which on distances need not be known [m], with
    whether that very distance is still to be found.

    Returns:
        The last two: the least distance, if it is less, is found.
    """
    x, y, heading = ego[run, row, EGO_X], ego[run, row, EGO_Y], ego[run, row, EGO_HEADING]
    speed, acceleration = ego[run, row, EGO_SPEED], ego[run, row, EGO_ACCELERATION]
    s, d = ego_place[run, row, PLACE_S], ego_place[run, row, PLACE_D]
    road = ego_place[run, row, PLACE_HEADING]
    length, width = ego_size[run, 0], ego_size[run, 1]
    is_finite = are_finite(x, y, heading, speed, acceleration, s, d, road, length, width)
    turn(turns[0], 0, heading - road)
    body = on_road(s, d, speed, length, width, turns[0, 0, 1], turns[0, 0, 2])
    half_width = max(body[HALF_WIDTH], 0.5 * width)
    # Without braking there is no lateral distance that is safe.
    can_cull = rss[7] > 0.0 and rss[6] >= 0.0 and rss[8] >= 0.0
    braking = 0.5 / rss[7]
    own_reach = lateral_reach(abs(body[ACROSS]), rss[0], rss[6], braking) + rss[8]
    for thing in range(objects.shape[2]):
        ox, oy = objects[run, row, thing, OBJECT_X], objects[run, row, thing, OBJECT_Y]
        o_heading = objects[run, row, thing, OBJECT_HEADING]
        o_speed = objects[run, row, thing, OBJECT_SPEED]
        acceleration = objects[run, row, thing, OBJECT_ACCELERATION]
        os, od = places[run, row, thing, PLACE_S], places[run, row, thing, PLACE_D]
        o_turn = o_heading - places[run, row, thing, PLACE_HEADING]
        o_length, o_width = sizes[run, thing, 0], sizes[run, thing, 1]
        is_finite &= are_finite(
            ox, oy, o_heading, o_speed, acceleration, os, od, o_turn, o_length, o_width
        )
        if not is_finite:
            break
        dx, dy = ox - x, oy - y
        within = nearest + reach[thing]
        if not (dx * dx + dy * dy) * 0.9999998 > within * within:
            apart = distance_below(
                dx, dy, heading, length, width, o_heading, o_length, o_width, turns[1], thing,
                nearest,
            )  # fmt: skip
            if apart < nearest or (is_open and apart == nearest):
                nearest, is_open = apart, False
                values[DISTANCE, run, row] = apart
                actors[DISTANCE, run, row] = thing
        if os > s and not (
            can_cull
            and is_far_beside(
                od - d, half_width, own_reach, o_speed, o_turn, o_length, o_width, rss, braking
            )
        ):
            turn(turns[0], thing + 1, o_turn)
            sine, cosine = turns[0, thing + 1, 1], turns[0, thing + 1, 2]
            other = on_road(os, od, o_speed, o_length, o_width, sine, cosine)
            apart = lane_way(s, road, d, os, places[run, row, thing, PLACE_HEADING])
            free = road_gap(apart, body[HALF_LENGTH], other[HALF_LENGTH])
            if is_in_path(body, 0.5 * width, other, free):
                gap = free
                if gap <= 0.0:
                    gap = distance_below(
                        dx, dy, heading, length, width, o_heading, o_length, o_width, turns[1],
                        thing, math.inf,
                    )  # fmt: skip
                _measure_ahead(
                    body, other, acceleration * cosine, gap, thing, run, row, values, actors
                )
            _measure_rss(body, other, rss, free, thing, run, row, values, actors)
    if not is_finite:
        for quantity in range(8):
            values[quantity, run, row] = math.nan
            actors[quantity, run, row] = -1
    return nearest, is_open


@inlined
def _keep_least(  # noqa: PLR0913, PLR0917 - where it is kept
    quantity: int, value: float, thing: int, run: int, row: int, values: Floats, actors: Shorts
) -> None:
    if value < values[quantity, run, row]:
        values[quantity, run, row] = value
        actors[quantity, run, row] = thing


@inlined
def _keep_largest(  # noqa: PLR0913, PLR0917 - where it is kept
    quantity: int, value: float, thing: int, run: int, row: int, values: Floats, actors: Shorts
) -> None:
    # An object in the path is somebody's worst case also where it demands nothing.
    if value > values[quantity, run, row] or actors[quantity, run, row] < 0:
        values[quantity, run, row] = value
        actors[quantity, run, row] = thing


@inlined
def _measure_ahead(  # noqa: PLR0913, PLR0917 - a kernel
    own: Body,
    other: Body,
    acceleration: float,
    gap: float,
    thing: int,
    run: int,
    row: int,
    values: Floats,
    actors: Shorts,
) -> None:
    """Keep what an object in the path is to the ego.

    Args:
        own: (6,) ego on the road.
        other: (6,) object on the road.
        acceleration: Of the object along the road [m/s²].
        gap: Along the road, or the distance of the bodies where they overlap along it [m].
        thing: Index of the object.
        run: Where it is kept.
        row: Where it is kept.
        values: (8, B, T) in and out.
        actors: (8, B, T) in and out.
    """
    speed, lead = own[ALONG], other[ALONG]
    closing = speed - lead
    headway = time_headway(gap, 2.0 * other[HALF_LENGTH], speed)
    drac = limited_demand(deceleration_rate_to_avoid_crash(gap, closing))
    # The closed form is for a lead that goes the same way; of oncoming ones the speed counts.
    needed = drac if lead < 0.0 else required_deceleration(gap, speed, lead, acceleration)
    needed = limited_demand(needed)
    if gap < values[GAP, run, row]:
        # Who is nearer is nearer in time as well.
        _keep_least(GAP, gap, thing, run, row, values, actors)
        _keep_least(TIME_GAP, time_gap(gap, speed), thing, run, row, values, actors)
    if closing > 0.0 or gap <= 0.0:
        _keep_least(TTC, time_to_collision(gap, closing), thing, run, row, values, actors)
    _keep_least(TIME_HEADWAY, headway, thing, run, row, values, actors)
    _keep_largest(DRAC, drac, thing, run, row, values, actors)
    _keep_largest(REQUIRED, needed, thing, run, row, values, actors)


@compiled
def limited_demand(demand: float) -> float:
    """Limit a deceleration demand; what is not finite stays as it is and is told apart later."""
    return LARGEST_DEMAND if LARGEST_DEMAND < demand < math.inf else demand


@inlined
def _measure_rss(  # noqa: PLR0913, PLR0917 - a kernel
    own: Body,
    other: Body,
    rss: Floats,
    gap: float,
    thing: int,
    run: int,
    row: int,
    values: Floats,
    actors: Shorts,
) -> None:
    """Keep the RSS margin to an object ahead, if it is beside the ego at no safe distance.

    Args:
        own: (6,) ego on the road.
        other: (6,) object on the road.
        rss: (12,) parameters, in the order of ``series.RssParameters``.
        gap: Along the road [m].
        thing: Index of the object.
        run: Where it is kept.
        row: Where it is kept.
        values: (8, B, T) in and out.
        actors: (8, B, T) in and out.
    """
    beside = other[D] - own[D]
    side = math.copysign(1.0, beside)
    towards, away = side * own[ACROSS], side * other[ACROSS]
    if rss[11] > 0.0:
        lateral = rss_lateral_distance_printed(
            towards, away, rss[0], rss[1], rss[6], rss[7], rss[8]
        )
    else:
        lateral = rss_lateral_distance(towards, away, rss[0], rss[1], rss[6], rss[7], rss[8])
    if not abs(beside) - own[HALF_WIDTH] - other[HALF_WIDTH] >= lateral:
        speed, lead = own[ALONG], other[ALONG]
        if lead < 0.0:
            safe = rss_opposite_distance(
                speed, -lead, rss[0], rss[2], rss[5], rss[3], rss[9], rss[10]
            )
        else:
            safe = rss_longitudinal_distance(
                speed, lead, rss[0], rss[2], rss[3], rss[4], rss[9], rss[10]
            )
        _keep_least(RSS_MARGIN, gap - safe, thing, run, row, values, actors)
