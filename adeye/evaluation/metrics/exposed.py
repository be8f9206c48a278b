"""Compiled: how long and how badly a run was exposed, from its series of conflicts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.bodies import turn
from adeye.evaluation.metrics.scans import ERROR, NO_CONFLICT, NOT_APPLICABLE, UNDEFINED, VALUE
from adeye.kernel.jit import allocating
from adeye.kernel.margins import (
    crash_probability,
    proportion_of_stopping_distance,
    safe_distance_ratio,
)
from adeye.kernel.road import lane_way
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    EGO_YAW_RATE,
    OBJECT_HEADING,
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
)
from adeye.world.triggers import road_gap

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Floats, Ints

    Codes = NDArray[np.int8]
    Shorts = NDArray[np.int16]

EXPOSED, INTEGRATED, POTENTIAL, RESPONSE = range(4)


@allocating
def exposures(  # noqa: C901, PLR0913, PLR0917 - a kernel over what is measured
    length: Ints,
    step: float,
    ttc: Floats,
    drac: Floats,
    margins: Floats,
    accelerations: Floats,
    threshold: float,
    braking: Floats,
    response: float,
    least_braking: float,
) -> tuple[Floats, Ints, Codes]:
    """Sum up the rows of B runs, each counting one step.

    Args:
        length: (B,) rows that a run has.
        step: Time between rows [s].
        ttc: (B, T) time to collision, +inf for none [s].
        drac: (B, T) deceleration rate to avoid a crash [m/s²].
        margins: (B, T) of RSS, +inf for none [m].
        accelerations: (B, T) of the ego [m/s²].
        threshold: Time to collision up to which it is exposed [s].
        braking: (B, 4) mean, deviation, least and most of the largest deceleration [m/s²].
        response: Of RSS [s].
        least_braking: Proper response of RSS [m/s²].

    Returns:
        (4, B) time exposed [s], time integrated [s²], crash potential index and time without the
        proper response [s]; rows (4, B) of the worst; statuses (B,).
    """
    runs = length.shape[0]
    sums, rows = np.zeros((4, runs)), np.full((4, runs), -1)
    codes = np.full(runs, VALUE, dtype=np.int8)
    for run in range(runs):
        least, most, since = math.inf, 0.0, 0
        rest = 0.0
        if length[run] == 0:
            codes[run] = UNDEFINED
        for row in range(length[run]):
            time, demand, margin = ttc[run, row], drac[run, row], margins[run, row]
            if math.isnan(time) or math.isnan(demand) or math.isnan(margin):
                codes[run] = ERROR
                break
            if time <= threshold:
                sums[EXPOSED, run] += step
                sums[INTEGRATED, run] += (threshold - time) * step
                if time < least:
                    least = time
                    rows[EXPOSED, run] = rows[INTEGRATED, run] = row
            if demand > braking[run, 2]:
                chance = crash_probability(
                    demand, braking[run, 0], braking[run, 1], braking[run, 2], braking[run, 3]
                )
                sums[POTENTIAL, run] += chance
                if chance > most:
                    most = chance
                    rows[POTENTIAL, run] = row
            since = since + 1 if margin < 0.0 else 0
            late = (since - 1) * step > response + 1e-9
            if since > 0 and late and not accelerations[run, row] <= -least_braking:
                sums[RESPONSE, run] += step
                if margin < rest:
                    rest = margin
                    rows[RESPONSE, run] = row
        sums[POTENTIAL, run] /= max(1, length[run])
    return sums, rows, codes


@allocating
def first_evasions(
    length: Ints,
    ego: Floats,
    ego_place: Floats,
    ttc: Floats,
    braking: float,
    lateral: float,
) -> tuple[Ints, Codes]:
    """Find the row at which the ego first evades.

    Args:
        length: (B,) rows that a run has.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ttc: (B, T) time to collision, +inf for none [s].
        braking: Deceleration above which it is evasive [m/s²].
        lateral: Lateral acceleration beyond that of the curve above which it is [m/s²].

    Returns:
        Rows (B,) and statuses (B,): ``not_applicable`` where it never evades, ``no_conflict`` where
        it evades without a collision to come.
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    codes = np.full(length.shape[0], NOT_APPLICABLE, dtype=np.int8)
    for run in range(length.shape[0]):
        for row in range(length[run]):
            speed = ego[run, row, EGO_SPEED]
            curve = speed * ego_place[run, row, PLACE_CURVATURE]
            aside = speed * (ego[run, row, EGO_YAW_RATE] - curve)
            slowing = -ego[run, row, EGO_ACCELERATION]
            if math.isnan(ttc[run, row]) or not math.isfinite(aside + slowing):
                codes[run] = ERROR
                break
            if codes[run] == NOT_APPLICABLE and (slowing > braking or abs(aside) > lateral):
                rows[run] = row
                codes[run] = VALUE if ttc[run, row] < math.inf else NO_CONFLICT
    return rows, codes


@allocating
def least_stopping_shares(
    length: Ints, gaps: Floats, speeds: Floats, contact: Shorts, braking: Floats
) -> tuple[Ints, Floats, Codes]:
    """Find the row with the least share of the way to standstill that is left.

    Args:
        length: (B,) rows that a run has.
        gaps: (B, T) to the nearest in the path, +inf for none [m].
        speeds: (B, T) of the ego [m/s].
        contact: (B, T) object that the ego touches, -1 for none.
        braking: (B,) largest deceleration [m/s²].

    Returns:
        Rows (B,), values (B,), statuses (B,).
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    least = np.full(length.shape[0], math.inf)
    codes = np.full(length.shape[0], UNDEFINED, dtype=np.int8)
    for run in range(length.shape[0]):
        for row in range(length[run]):
            gap = gaps[run, row]
            if math.isnan(gap):
                codes[run] = ERROR
                break
            if contact[run, row] >= 0:
                continue
            share = math.inf
            if gap < math.inf:
                share = proportion_of_stopping_distance(gap, speeds[run, row], braking[run])
            if share < least[run]:
                least[run], rows[run], codes[run] = share, row, VALUE
            elif codes[run] == UNDEFINED:
                codes[run] = NO_CONFLICT
    return rows, least, codes


@allocating
def least_safe_ratios(  # noqa: PLR0913, PLR0917 - a kernel over the scene
    length: Ints,
    margins: Floats,
    worst: Shorts,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    objects: Floats,
    places: Floats,
    sizes: Floats,
) -> tuple[Ints, Floats, Codes]:
    """Find the row with the least ratio of gap and RSS distance.

    Args:
        length: (B,) rows that a run has.
        margins: (B, T) gap less RSS distance of who has the least, +inf for none [m].
        worst: (B, T) who that is, -1 for nobody.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        objects: (B, T, M, 5).
        places: (B, T, M, 6).
        sizes: (B, M, 3).

    Returns:
        Rows (B,), values (B,), statuses (B,).
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    least = np.full(length.shape[0], math.inf)
    codes = np.full(length.shape[0], NO_CONFLICT, dtype=np.int8)
    turns = np.full((2, 3), math.nan)
    for run in range(length.shape[0]):
        for row in range(length[run]):
            margin, thing = margins[run, row], worst[run, row]
            if math.isnan(margin):
                codes[run] = ERROR
                break
            if thing < 0:
                continue
            own, other = ego_place[run, row], places[run, row, thing]
            turn(turns, 0, ego[run, row, EGO_HEADING] - own[PLACE_HEADING])
            turn(turns, 1, objects[run, row, thing, OBJECT_HEADING] - other[PLACE_HEADING])
            own_half = 0.5 * (
                ego_size[run, 0] * abs(turns[0, 2]) + ego_size[run, 1] * abs(turns[0, 1])
            )
            half = 0.5 * (
                sizes[run, thing, 0] * abs(turns[1, 2]) + sizes[run, thing, 1] * abs(turns[1, 1])
            )
            apart = lane_way(
                own[PLACE_S], own[PLACE_HEADING], own[PLACE_D],
                other[PLACE_S], other[PLACE_HEADING],
            )  # fmt: skip
            gap = road_gap(apart, own_half, half)
            ratio = safe_distance_ratio(gap, gap - margin)
            if ratio < least[run]:
                least[run], rows[run], codes[run] = ratio, row, VALUE
    return rows, least, codes
