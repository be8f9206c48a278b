"""Compiled: what is left against objects in the path: times, decelerations, last moments to evade.

Beside what ``conflict`` measures at every row, at those at which it found somebody in the path.
Others keep their velocity, but for the times to collision with acceleration; ``kernel.encounter``
says what a manoeuvre avoids.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from adeye import signals as columns
from adeye.judge.conflict import (
    ACROSS,
    ALONG,
    HALF_LENGTH,
    HALF_WIDTH,
    Body,
    D,
    Scene,
    is_in_path,
    limited_demand,
    on_road,
    turn,
)
from adeye.kernel import criticality, encounter
from adeye.kernel.boxes import box_distance, box_of
from adeye.kernel.criticality import road_gap
from adeye.kernel.jit import allocating, inlined
from adeye.kernel.road import lane_way
from adeye.signals import Floats, Ints, Shorts

MTTC, ETTC, MDRAC, DST, MTC, TTB, TTS, TTK, TTR, STN = range(10)
FOLLOWING: Final = 10
"""Number of the quantities; MDRAC, DST and STN are worse when larger, the others when smaller."""

BRAKING, LATERAL, ACCELERATION = range(3)
"""Columns of what the ego is able to do."""

RESPONSE_TIME: Final = 1.0
"""Of the modified deceleration rate [s]; Fu and Sayed (2021) draw it around this value."""

SAFETY_TIME: Final = 1.0
"""What is to be left between both for the deceleration to safety time [s], as in Hupfer (1997)."""

MARGIN_BRAKING: Final = 0.7 * 9.80665
"""Of both for the margin to collision [m/s²], as in Kitajima et al. (2009)."""

LATEST: Final = -10.0
"""Time to react that a later one, or a manoeuvre that never avoids, counts as [s]."""

_NO_CROSSING: Final = 0.7
"""Angle to the road below which nobody moves faster across it than along [rad]."""


@allocating
def following_series(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    scene: Scene,
    gaps: Floats,
    ahead: Shorts,
    limits: Floats,
    quantity: int,
    values: Floats,
    actors: Shorts,
) -> None:
    """Write one quantity at every row of B runs.

    Args:
        scene: The runs.
        gaps: (B, T) gap of ``conflict``: NaN at a row with an input that is not finite.
        ahead: (B, T) its object, -1 where nobody is in the path.
        limits: (B, 3) what the egos are able to do, see ``abilities``.
        quantity: ``MTTC`` or one of its neighbours that is worse when smaller.
        values: (B, T) out; +inf where there is no conflict, NaN where an input is not finite, 0
            beyond the run.
        actors: (B, T) out, -1 for none.
    """
    found, who = np.zeros(FOLLOWING), np.zeros(FOLLOWING, dtype=np.int64)
    length, contact = scene.length, scene.contact
    turns = np.zeros((scene.objects.shape[2] + 1, 3))
    for run in range(length.shape[0]):
        turns[:] = math.nan
        for row in range(length[run]):
            values[run, row], actors[run, row] = math.inf, -1
            if math.isnan(gaps[run, row]):
                values[run, row] = math.nan
            elif ahead[run, row] >= 0 or contact[run, row] >= 0:
                measure_following(run, row, scene, limits, turns, found, who)
                if who[quantity] >= 0:
                    values[run, row], actors[run, row] = found[quantity], who[quantity]
        for row in range(length[run], values.shape[1]):
            values[run, row], actors[run, row] = 0.0, -1


@inlined
def is_worse_when_larger(quantity: int) -> bool:
    """Tell whether a quantity is a demand."""
    return quantity in (MDRAC, DST, STN)


@inlined
def _keep(quantity: int, value: float, thing: int, found: Floats, who: Ints) -> None:
    sign = -1.0 if is_worse_when_larger(quantity) else 1.0
    if sign * value < sign * found[quantity]:
        found[quantity] = value
        who[quantity] = thing


@inlined
def measure_following(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    run: int,
    row: int,
    scene: Scene,
    limits: Floats,
    turns: Floats,
    found: Floats,
    who: Ints,
) -> None:
    """Measure the worst of each quantity at a row whose numbers are finite.

    Args:
        run: Which run.
        row: Which row.
        scene: The runs.
        limits: (B, 3).
        turns: (M + 1, 3) angles to the road with sine and cosine.
        found: (10,) out.
        who: (10,) out: object, -1 where there is no conflict.
    """
    _, ego, ego_place, ego_size, objects, places, sizes, contact = scene
    for quantity in range(FOLLOWING):
        found[quantity] = -math.inf if is_worse_when_larger(quantity) else math.inf
        who[quantity] = -1
    touched = contact[run, row]
    if touched >= 0:
        # In contact nothing is left to demand or to avoid.
        for quantity in (MTTC, ETTC):
            found[quantity], who[quantity] = 0.0, touched
        return
    s, d = ego_place[run, row, columns.PLACE_S], ego_place[run, row, columns.PLACE_D]
    length, width = ego_size[run, 0], ego_size[run, 1]
    heading = ego[run, row, columns.EGO_HEADING]
    road = ego_place[run, row, columns.PLACE_HEADING]
    turn(turns, 0, heading - road)
    own = on_road(s, d, ego[run, row, columns.EGO_SPEED], length, width, turns[0, 1], turns[0, 2])
    acceleration = ego[run, row, columns.EGO_ACCELERATION] * turns[0, 2]
    for thing in range(objects.shape[2]):
        os = places[run, row, thing, columns.PLACE_S]
        if not os > s:
            continue
        o_heading = objects[run, row, thing, columns.OBJECT_HEADING]
        angle = abs(o_heading - places[run, row, thing, columns.PLACE_HEADING])
        # Who is beside the corridor and does not cross is in nobody's path; a sine is less than
        # its angle.
        half = 0.5 * (width + sizes[run, thing, 1] + sizes[run, thing, 0] * angle)
        if angle < _NO_CROSSING and abs(places[run, row, thing, columns.PLACE_D] - d) > 1e-6 + half:
            continue
        turn(turns, thing + 1, o_heading - places[run, row, thing, columns.PLACE_HEADING])
        sine, cosine = turns[thing + 1, 1], turns[thing + 1, 2]
        other = on_road(
            os, places[run, row, thing, columns.PLACE_D],
            objects[run, row, thing, columns.OBJECT_SPEED],
            sizes[run, thing, 0], sizes[run, thing, 1], sine, cosine,
        )  # fmt: skip
        apart = lane_way(s, road, d, os, places[run, row, thing, columns.PLACE_HEADING])
        gap = road_gap(apart, own[HALF_LENGTH], other[HALF_LENGTH])
        if not is_in_path(own, 0.5 * width, other, gap):
            continue
        if gap <= 0.0:
            body = box_of(objects[run, row, thing], sizes[run, thing])
            gap = box_distance(box_of(ego[run, row], ego_size[run]), body)
        _follow(
            own, other, acceleration,
            objects[run, row, thing, columns.OBJECT_ACCELERATION] * cosine, gap, thing, found, who,
        )  # fmt: skip
        _evade(own, other, 0.5 * width, gap, limits[run], thing, found, who)


@inlined
def _follow(  # noqa: PLR0913, PLR0917 - a kernel
    own: Body,
    other: Body,
    acceleration: float,
    other_acceleration: float,
    gap: float,
    thing: int,
    found: Floats,
    who: Ints,
) -> None:
    """Keep times and decelerations of following one object."""
    speed, lead = own[ALONG], other[ALONG]
    closing = speed - lead
    relative = acceleration - other_acceleration
    if closing > 0.0 or relative > 0.0:
        mttc = criticality.modified_time_to_collision(
            gap, speed, lead, acceleration, other_acceleration
        )
        _keep(MTTC, mttc, thing, found, who)
        _keep(
            ETTC, criticality.enhanced_time_to_collision(gap, closing, relative), thing, found, who
        )
    mdrac = criticality.modified_deceleration_rate(gap, closing, RESPONSE_TIME)
    _keep(MDRAC, limited_demand(min(mdrac, 1e300)), thing, found, who)
    # Nobody keeps a time gap to who comes towards him.
    dst = criticality.deceleration_to_safety_time(gap, closing, max(lead, 0.0), SAFETY_TIME)
    _keep(DST, limited_demand(dst), thing, found, who)
    _keep(MTC, criticality.margin_to_collision(gap, speed, lead, MARGIN_BRAKING), thing, found, who)


@inlined
def _evade(  # noqa: PLR0913, PLR0917 - a kernel
    own: Body,
    other: Body,
    corridor: float,
    gap: float,
    limits: Floats,
    thing: int,
    found: Floats,
    who: Ints,
) -> None:
    """Keep how long the ego may wait before it evades one object."""
    closing = own[ALONG] - other[ALONG]
    if closing <= 0.0:
        _keep(STN, 0.0, thing, found, who)
        return
    arrival = criticality.time_to_collision(gap, closing)
    way = 2.0 * (own[HALF_LENGTH] + other[HALF_LENGTH])
    reach, beside, across = corridor + other[HALF_WIDTH], other[D] - own[D], other[ACROSS]
    enter, leave = -math.inf, math.inf
    if across != 0.0:
        enter = (-math.copysign(reach, across) - beside) / across
        leave = (math.copysign(reach, across) - beside) / across
    if enter > (gap + way) / closing or leave < arrival:
        _keep(STN, 0.0, thing, found, who)
        return
    offset = encounter.evasive_offset(beside + across * arrival, across * way / closing, reach)
    brake = encounter.time_to_brake(gap, closing, own[ALONG], leave, limits[BRAKING])
    steer = encounter.time_to_steer(arrival, offset, limits[LATERAL])
    kick = encounter.time_to_kickdown(gap, closing, way, enter, limits[ACCELERATION])
    _keep(TTB, max(brake, LATEST), thing, found, who)
    _keep(TTS, max(steer, LATEST), thing, found, who)
    _keep(TTK, max(kick, LATEST), thing, found, who)
    _keep(TTR, max(encounter.time_to_react(brake, steer, kick), LATEST), thing, found, who)
    threat = encounter.steer_threat_number(arrival, offset, limits[LATERAL])
    _keep(STN, min(threat, 100.0), thing, found, who)
