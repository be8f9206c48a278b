"""Compiled: how near the ego is to others at every row of its runs, and who is the worst.

An object is *ahead* if its centre is farther along the road than the ego's. It is *in the path* if
it is ahead and

- its lateral extent on the road overlaps the ego's corridor: d of the ego's centre plus and minus
  half of the ego's width; or
- it is crossing (it moves faster across the road than along it), there is a gap, and at constant
  velocities its lateral extent overlaps the corridor at some time while the bodies are side by side
  along the road.

Extents are those of the turned bodies on the road's direction. Gaps run along the road; where the
extents overlap although the bodies are apart, the gap is the distance of the bodies, so that it is
0 in contact only.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

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
from adeye.kernel.elementary import sin_cos
from adeye.kernel.geometry import box_distance
from adeye.kernel.jit import compiled
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

# Columns of a body's motion on the road.
_S, _D, _ALONG, _ACROSS, _HALF_LENGTH, _HALF_WIDTH = range(6)


@compiled
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
    values: Floats,
    actors: Ints,
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
        values: (B, T, 8) out, see ``QUANTITIES``; +inf where there is no conflict, 0 for the
            decelerations; all NaN at a row with an input that is not finite.
        actors: (B, T, 8) out: object of the worst case, -1 for none.
    """
    own = np.zeros(6)
    other = np.zeros(6)
    for run in range(length.shape[0]):
        for row in range(length[run]):
            worst, who = values[run, row], actors[run, row]
            worst[:] = math.inf
            worst[DRAC] = worst[REQUIRED] = 0.0
            who[:] = -1
            is_finite = _project(ego[run, row], ego_place[run, row], ego_size[run], own)
            for thing in range(objects.shape[2]):
                state = objects[run, row, thing]
                size = sizes[run, thing]
                is_finite &= _project(state, places[run, row, thing], size, other)
                if not is_finite:
                    break
                distance = body_distance(ego[run, row], ego_size[run], state, size)
                _keep_least(worst, who, DISTANCE, distance, thing)
                if other[_S] > own[_S]:
                    turn = state[OBJECT_HEADING] - places[run, row, thing, PLACE_HEADING]
                    lead_acceleration = state[OBJECT_ACCELERATION] * sin_cos(turn)[1]
                    corridor = 0.5 * ego_size[run, 1]
                    _measure_ahead(
                        own, other, corridor, lead_acceleration, distance, thing, worst, who
                    )
                    _measure_rss(own, other, rss, thing, worst, who)
            touched = contact[run, row]
            if touched >= 0:
                worst[DISTANCE] = worst[TTC] = 0.0
                who[DISTANCE] = who[TTC] = touched
            if not is_finite:
                worst[:] = math.nan


@compiled
def body_distance(ego: Floats, ego_size: Floats, state: Floats, size: Floats) -> float:
    """Distance between the ego's body and an object's [m], 0 in contact.

    Args:
        ego: (7,).
        ego_size: (3,) length, width, height [m].
        state: (5,).
        size: (3,) length, width, height [m].
    """
    return box_distance(
        ego[EGO_X],
        ego[EGO_Y],
        ego[EGO_HEADING],
        ego_size[0],
        ego_size[1],
        state[OBJECT_X],
        state[OBJECT_Y],
        state[OBJECT_HEADING],
        size[0],
        size[1],
    )


@compiled
def measure_object(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    length: Ints,
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
    """Measure body distance and signed gap to one object at each row of B runs.

    Args:
        length: (B,) rows that a run has.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        states: (B, T, 5) of the object.
        places: (B, T, 6) of the object.
        sizes: (B, 3) of the object.
        contact: (B, T) object that the ego touches, -1 for none.
        thing: Index of the object.
        distances: (B, T) out [m].
        gaps: (B, T) out [m]: ahead > 0, behind < 0, 0 side by side.
    """
    own = np.zeros(6)
    other = np.zeros(6)
    for run in range(length.shape[0]):
        for row in range(length[run]):
            is_finite = _project(ego[run, row], ego_place[run, row], ego_size[run], own)
            is_finite &= _project(states[run, row], places[run, row], sizes[run], other)
            if not is_finite:
                distances[run, row] = gaps[run, row] = math.nan
                continue
            gaps[run, row] = road_gap(own[_S], own[_HALF_LENGTH], other[_S], other[_HALF_LENGTH])
            distances[run, row] = 0.0
            if contact[run, row] != thing:
                distances[run, row] = body_distance(
                    ego[run, row], ego_size[run], states[run, row], sizes[run]
                )


@compiled
def _project(state: Floats, place: Floats, size: Floats, out: Floats) -> bool:
    """Write a body's motion on the road, and tell whether all of it is finite.

    Args:
        state: (5,) or (7,); the first columns of ego and objects are the same.
        place: (6,).
        size: (3,).
        out: (6,): s, d, speed along and across the road, half extent along and across.
    """
    is_finite = math.isfinite(size[0]) and math.isfinite(size[1])
    for column in range(5):
        is_finite &= math.isfinite(state[column])
    for column in range(3):
        is_finite &= math.isfinite(place[column])
    if not is_finite:
        return False
    sine, cosine = sin_cos(state[OBJECT_HEADING] - place[PLACE_HEADING])
    out[_S], out[_D] = place[PLACE_S], place[PLACE_D]
    out[_ALONG] = state[OBJECT_SPEED] * cosine
    out[_ACROSS] = state[OBJECT_SPEED] * sine
    out[_HALF_LENGTH] = 0.5 * (size[0] * abs(cosine) + size[1] * abs(sine))
    out[_HALF_WIDTH] = 0.5 * (size[0] * abs(sine) + size[1] * abs(cosine))
    return True


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
def _is_in_path(own: Floats, corridor: float, other: Floats, gap: float) -> bool:
    """Tell whether an object ahead is in the path, see the module.

    Args:
        own: (6,) ego on the road.
        corridor: Half of the ego's width [m].
        other: (6,) object on the road.
        gap: [m].
    """
    beside = other[_D] - own[_D]
    reach = corridor + other[_HALF_WIDTH]
    if abs(beside) < reach:
        return True
    across = other[_ACROSS]
    closing = own[_ALONG] - other[_ALONG]
    if gap <= 0.0 or closing <= 0.0 or abs(across) <= abs(other[_ALONG]):
        return False
    first = gap / closing
    last = first + 2.0 * (own[_HALF_LENGTH] + other[_HALF_LENGTH]) / closing
    enter = (-math.copysign(reach, across) - beside) / across
    leave = (math.copysign(reach, across) - beside) / across
    return bool(enter <= last and leave >= first)


@compiled
def _measure_ahead(  # noqa: PLR0913, PLR0917 - a kernel
    own: Floats,
    other: Floats,
    corridor: float,
    acceleration: float,
    distance: float,
    thing: int,
    worst: Floats,
    who: Ints,
) -> None:
    """Keep what an object ahead is to the ego, if it is in the path.

    Args:
        own: (6,) ego on the road.
        other: (6,) object on the road.
        corridor: Half of the ego's width [m].
        acceleration: Of the object along the road [m/s²].
        distance: Of the bodies [m].
        thing: Index of the object.
        worst: (8,) in and out.
        who: (8,) in and out.
    """
    free = road_gap(own[_S], own[_HALF_LENGTH], other[_S], other[_HALF_LENGTH])
    if not _is_in_path(own, corridor, other, free):
        return
    gap = free if free > 0.0 else distance
    speed, lead = own[_ALONG], other[_ALONG]
    closing = speed - lead
    _keep_least(worst, who, GAP, gap, thing)
    _keep_least(worst, who, TTC, time_to_collision(gap, closing), thing)
    _keep_least(worst, who, TIME_GAP, time_gap(gap, speed), thing)
    headway = time_headway(gap, 2.0 * other[_HALF_LENGTH], speed)
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
def _measure_rss(
    own: Floats, other: Floats, rss: Floats, thing: int, worst: Floats, who: Ints
) -> None:
    """Keep the RSS margin to an object ahead, if it is beside the ego at no safe distance.

    Args:
        own: (6,) ego on the road.
        other: (6,) object on the road.
        rss: (9,) parameters, in the order of ``series.RssParameters``.
        thing: Index of the object.
        worst: (8,) in and out.
        who: (8,) in and out.
    """
    beside = other[_D] - own[_D]
    side = math.copysign(1.0, beside)
    lateral = rss_lateral_distance(
        side * own[_ACROSS], side * other[_ACROSS], rss[0], rss[1], rss[6], rss[7], rss[8]
    )
    if abs(beside) - own[_HALF_WIDTH] - other[_HALF_WIDTH] >= lateral:
        return
    speed, lead = own[_ALONG], other[_ALONG]
    if lead < 0.0:
        safe = rss_opposite_distance(speed, -lead, rss[0], rss[2], rss[5], rss[3])
    else:
        safe = rss_longitudinal_distance(speed, lead, rss[0], rss[2], rss[3], rss[4])
    gap = road_gap(own[_S], own[_HALF_LENGTH], other[_S], other[_HALF_LENGTH])
    _keep_least(worst, who, RSS_MARGIN, gap - safe, thing)
