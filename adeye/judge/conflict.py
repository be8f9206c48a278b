"""Compiled: how near the ego is to others at every row of its runs, and who is the worst.

An object is *ahead* if its centre is farther along the road than the ego's; ``bodies`` says when it
is in the path. Gaps run along the lane that the ego drives, at its lateral place, and speeds are
those along each one's own lane; where the extents overlap although the bodies are apart, the gap is
the distance of the bodies, so that it is 0 in contact only.

An object ahead of the ego is *in the path* if

- its lateral extent on the road overlaps the ego's corridor: d of the ego's centre plus and minus
  half of the ego's width; or
- it is crossing (it moves faster across the road than along it), there is a gap, and at constant
  velocities its lateral extent overlaps the corridor at some time while the bodies are side by side
  along the road.

Extents are those of the turned bodies on the road's direction.

Nothing that a bound leaves out changes a result: it would have been kept only if it were worse.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from adeye.kernel import criticality
from adeye.kernel.boxes import Extent, Vector, box_distance, box_of, placed_box_distance
from adeye.kernel.criticality import road_gap
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import allocating, compiled, inlined
from adeye.kernel.road import lane_way
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
    Shorts,
)


class Scene(NamedTuple):
    """What scans read of B runs of up to T rows with M objects.

    Attributes:
        length: (B,) rows that a run has.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        objects: (B, T, M, 5).
        places: (B, T, M, 6).
        sizes: (B, M, 3).
        contact: (B, T) object that the ego touches, -1 for none.
    """

    length: Ints
    ego: Floats
    ego_place: Floats
    ego_size: Floats
    objects: Floats
    places: Floats
    sizes: Floats
    contact: Shorts


# --- Compiled: bodies on the road, their extents and whether one is in the ego's path -------------

Body = tuple[float, float, float, float, float, float]
"""A body's motion on the road."""

S, D, ALONG, ACROSS, HALF_LENGTH, HALF_WIDTH = range(6)
"""Places of a ``Body``: of its centre [m], speeds [m/s] and half extents [m]."""


@compiled
def reach_of(length: float, width: float) -> float:
    """Half of the diagonal of a body [m], a little more than that."""
    return 0.5000001 * math.sqrt(length * length + width * width) + 1e-6


@inlined
def are_finite(  # noqa: PLR0913, PLR0917 - what a body has
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
    g: float,
    h: float,
    i: float,
    j: float,
) -> bool:
    """Tell whether ten numbers are finite: zero times anything else is no number."""
    return 0.0 * a + 0.0 * b + 0.0 * c + 0.0 * d + 0.0 * e == -(
        0.0 * f + 0.0 * g + 0.0 * h + 0.0 * i + 0.0 * j
    )


@inlined
def turn(turns: Floats, place: int, angle: float) -> None:
    """Keep sine and cosine of an angle to the road, which often is that of the row before."""
    if angle != turns[place, 0]:
        turns[place, 0] = angle
        turns[place, 1], turns[place, 2] = sin_cos(angle)


@inlined
def on_road(  # noqa: PLR0913, PLR0917 - a kernel
    s: float, d: float, speed: float, length: float, width: float, sine: float, cosine: float
) -> Body:
    """Give a body on the road: s, d, speed along and across, half extent along and across."""
    return (
        s,
        d,
        speed * cosine,
        speed * sine,
        0.5 * (length * abs(cosine) + width * abs(sine)),
        0.5 * (length * abs(sine) + width * abs(cosine)),
    )


@inlined
def is_in_path(own: Body, corridor: float, other: Body, gap: float) -> bool:
    """Tell whether an object ahead is in the path, see the module.

    Args:
        own: (6,) ego on the road.
        corridor: Half of the ego's width [m].
        other: (6,) object on the road.
        gap: [m].
    """
    beside = other[D] - own[D]
    reach = corridor + other[HALF_WIDTH]
    if abs(beside) < reach:
        return True
    across = other[ACROSS]
    closing = own[ALONG] - other[ALONG]
    if gap <= 0.0 or closing <= 0.0 or abs(across) <= abs(other[ALONG]):
        return False
    first = gap / closing
    last = first + 2.0 * (own[HALF_LENGTH] + other[HALF_LENGTH]) / closing
    enter = (-math.copysign(reach, across) - beside) / across
    leave = (math.copysign(reach, across) - beside) / across
    return bool(enter <= last and leave >= first)


# --- Compiled: leave out what cannot be a worst case, by bounds that cost less than the measure ---

Turned = tuple[float, float, float, float]
"""Speed [m/s], angle to the road [rad], length and width [m] of a body."""

_SMALL_ANGLE = 0.5
"""Below it a body moves more along the road than across [rad]."""


@compiled
def least_so_far(run: int, scene: Scene) -> float:
    """Give the distance of the bodies whose centres come nearest in a run [m].

    No row has to be looked at that is farther; +inf where there is no such distance.

    Args:
        run: Which run.
        scene: The runs.
    """
    length, ego, _, ego_size, objects, _, sizes, _ = scene
    least, at, who = math.inf, -1, -1
    for row in range(length[run]):
        x, y = ego[run, row, EGO_X], ego[run, row, EGO_Y]
        for thing in range(objects.shape[2]):
            dx, dy = objects[run, row, thing, OBJECT_X] - x, objects[run, row, thing, OBJECT_Y] - y
            if dx * dx + dy * dy < least:
                least = dx * dx + dy * dy
                at, who = row, thing
    if at < 0:
        return math.inf
    own = box_of(ego[run, at], ego_size[run])
    distance = box_distance(own, box_of(objects[run, at, who], sizes[run, who]))
    return distance if math.isfinite(distance) else math.inf


@inlined
def distance_below(
    away: Vector, body: Extent, other: Extent, turns: Floats, thing: int, enough: float
) -> float:
    """Give the distance of two bodies [m]; from ``enough`` on it may be a bound above that.

    Args:
        away: From the first to the second [m].
        body: The first.
        other: The second.
        turns: (M + 1, 3) angles with sine and cosine: the first's heading, and by object that of
            the second in the frame of the first.
        thing: Object.
        enough: [m].
    """
    turn(turns, 0, body[0])
    turn(turns, thing + 1, other[0] - body[0])
    (dx, dy), s, c = away, turns[0, 1], turns[0, 2]
    placed = (dx * c + dy * s, dy * c - dx * s, turns[thing + 1, 1], turns[thing + 1, 2])
    distance = placed_box_distance(placed, body[1:], other[1:], enough)
    return 0.0 if distance <= 0.0 else distance


@inlined
def lateral_reach(speed: float, response_time: float, acceleration: float, braking: float) -> float:
    """Give a bound of what a lateral speed adds to the RSS distance beside each other [m].

    Args:
        speed: Size of the lateral speed [m/s].
        response_time: [s].
        acceleration: >= 0 [m/s²].
        braking: One over twice the lateral braking [s²/m].
    """
    gained = response_time * acceleration
    reached = speed + gained
    return 1.000001 * ((speed + 0.5 * gained) * response_time + reached * reached * braking) + 1e-6


@inlined
def is_far_beside(
    beside: float, half_width: float, own_reach: float, other: Turned, rss: Floats, braking: float
) -> bool:
    """Tell whether an object is too far beside to be in the path or laterally unsafe; else maybe.

    Args:
        beside: From the ego's centre to its centre across the road [m].
        half_width: Of the ego across the road [m].
        own_reach: ``lateral_reach`` of the ego and how much both sway [m].
        other: The object.
        rss: (12,) parameters, in the order of ``series.RssParameters``.
        braking: One over twice the lateral braking [s²/m].
    """
    speed, angle, length, width = other
    size = abs(angle)
    # A sine is less than its angle.
    across = abs(speed) * size
    room = abs(beside) - half_width - 0.5 * (width + length * size)
    unsafe = own_reach + lateral_reach(across, rss[1], rss[6], braking)
    return bool(size < _SMALL_ANGLE and room > unsafe)


# --- Compiled: how near the ego is to others at every row of its runs, and who is the worst -------

DISTANCE, GAP, TTC, TIME_GAP, TIME_HEADWAY, DRAC, REQUIRED, RSS_MARGIN = range(8)
"""Columns of the result; the decelerations are worse when larger, the others when smaller."""

LARGEST_DEMAND: Final = 100.0
"""Deceleration that a demand is limited to [m/s²], ten times what tyres can do: just before contact
it grows without bound, and its size says nothing any more."""


@allocating
def measure_runs(
    scene: Scene,
    rss: Floats,
    is_least_only: bool,  # noqa: FBT001 - compiled
    values: Floats,
    actors: Shorts,
) -> None:
    """Measure the conflicts of B runs at each of their rows.

    Args:
        scene: The runs.
        rss: (12,) parameters, in the order of ``series.RssParameters``.
        is_least_only: Whether of the distances only the least of a run is wanted: others may be
            +inf.
        values: (8, B, T) out, see ``DISTANCE``; +inf where there is no conflict, 0 for the
            decelerations; all NaN at a row with an input that is not finite; 0 beyond the run.
        actors: (8, B, T) out: object of the worst case, -1 for none.
    """
    length, _, _, ego_size, objects, _, sizes, contact = scene
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
            nearest, is_open = least_so_far(run, scene), True
        for row in range(length[run]):
            if not is_least_only:
                nearest = math.inf
            nearest, is_open = _measure_row(
                run, row, scene, rss, turns, reach, nearest, is_open, values, actors
            )
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
    scene: Scene,
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
    _, ego, ego_place, ego_size, objects, places, sizes, _ = scene
    here, who = values[:, run, row], actors[:, run, row]
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
        own, o_box = (heading, length, width), (o_heading, o_length, o_width)
        within = nearest + reach[thing]
        if not (dx * dx + dy * dy) * 0.9999998 > within * within:
            apart = distance_below((dx, dy), own, o_box, turns[1], thing, nearest)
            if apart < nearest or (is_open and apart == nearest):
                nearest, is_open = apart, False
                here[DISTANCE], who[DISTANCE] = apart, thing
        if os > s and not (
            can_cull
            and is_far_beside(
                od - d, half_width, own_reach, (o_speed, o_turn, o_length, o_width), rss, braking
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
                    gap = distance_below((dx, dy), own, o_box, turns[1], thing, math.inf)
                _measure_ahead(body, other, acceleration * cosine, gap, thing, here, who)
            _measure_rss(body, other, rss, free, thing, here, who)
    if not is_finite:
        here[:] = math.nan
        who[:] = -1
    return nearest, is_open


@inlined
def _keep_least(quantity: int, value: float, thing: int, values: Floats, actors: Shorts) -> None:
    if value < values[quantity]:
        values[quantity], actors[quantity] = value, thing


@inlined
def _keep_largest(quantity: int, value: float, thing: int, values: Floats, actors: Shorts) -> None:
    # An object in the path is somebody's worst case also where it demands nothing.
    if value > values[quantity] or actors[quantity] < 0:
        values[quantity], actors[quantity] = value, thing


@inlined
def _measure_ahead(  # noqa: PLR0913, PLR0917 - a kernel
    own: Body,
    other: Body,
    acceleration: float,
    gap: float,
    thing: int,
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
        values: (8,) in and out.
        actors: (8,) in and out.
    """
    speed, lead = own[ALONG], other[ALONG]
    closing = speed - lead
    headway = criticality.time_headway(gap, 2.0 * other[HALF_LENGTH], speed)
    drac = limited_demand(criticality.deceleration_rate_to_avoid_crash(gap, closing))
    # The closed form is for a lead that goes the same way; of oncoming ones the speed counts.
    needed = (
        drac if lead < 0.0 else criticality.required_deceleration(gap, speed, lead, acceleration)
    )
    needed = limited_demand(needed)
    if gap < values[GAP]:
        # Who is nearer is nearer in time as well.
        _keep_least(GAP, gap, thing, values, actors)
        _keep_least(TIME_GAP, criticality.time_gap(gap, speed), thing, values, actors)
    if closing > 0.0 or gap <= 0.0:
        _keep_least(TTC, criticality.time_to_collision(gap, closing), thing, values, actors)
    _keep_least(TIME_HEADWAY, headway, thing, values, actors)
    _keep_largest(DRAC, drac, thing, values, actors)
    _keep_largest(REQUIRED, needed, thing, values, actors)


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
        values: (8,) in and out.
        actors: (8,) in and out.
    """
    beside = other[D] - own[D]
    side = math.copysign(1.0, beside)
    towards, away = side * own[ACROSS], side * other[ACROSS]
    lateral = criticality.rss_lateral_distance(
        towards, away, rss[0], rss[1], rss[6], rss[7], rss[8], rss[11] > 0.0
    )
    if not abs(beside) - own[HALF_WIDTH] - other[HALF_WIDTH] >= lateral:
        speed, lead = own[ALONG], other[ALONG]
        if lead < 0.0:
            safe = criticality.rss_opposite_distance(
                speed, -lead, rss[0], rss[2], rss[5], rss[3], rss[9], rss[10]
            )
        else:
            safe = criticality.rss_longitudinal_distance(
                speed, lead, rss[0], rss[2], rss[3], rss[4], rss[9], rss[10]
            )
        _keep_least(RSS_MARGIN, gap - safe, thing, values, actors)


# --- Compiled: how near the ego is to one object at every row of its runs -------------------------


@allocating
def measure_object(scene: Scene, thing: int, distances: Floats, gaps: Floats) -> None:
    """Measure body distance and signed gap to one object at the rows of B runs.

    Args:
        scene: The runs.
        thing: Index of the object.
        distances: (B, T) out [m], or (B, 0) if they are not wanted.
        gaps: (B, T) out [m]: ahead > 0, behind < 0, 0 side by side; or (B, 0).
    """
    rows, ego, ego_place, ego_size, objects, places, sizes, contact = scene
    turns = np.zeros((2, 3))
    for run in range(rows.shape[0]):
        turns[:] = math.nan
        own, own_place = ego[run], ego_place[run]
        state, place = objects[run, :, thing], places[run, :, thing]
        own_length, own_width = ego_size[run, 0], ego_size[run, 1]
        length, width = sizes[run, thing, 0], sizes[run, thing, 1]
        for row in range(rows[run]):
            x, y, heading = own[row, EGO_X], own[row, EGO_Y], own[row, EGO_HEADING]
            ox, oy = state[row, OBJECT_X], state[row, OBJECT_Y]
            o_heading = state[row, OBJECT_HEADING]
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
                    apart = lane_way(
                        s, own_place[row, PLACE_HEADING], own_place[row, PLACE_D],
                        os, place[row, PLACE_HEADING],
                    )  # fmt: skip
                    gaps[run, row] = road_gap(apart, body[HALF_LENGTH], other[HALF_LENGTH])
            if distances.shape[1]:
                distances[run, row] = 0.0
                if not is_finite:
                    distances[run, row] = math.nan
                elif contact[run, row] != thing:
                    distances[run, row] = box_distance(
                        (x, y, heading, own_length, own_width), (ox, oy, o_heading, length, width)
                    )
