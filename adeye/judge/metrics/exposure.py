"""Metrics of exposure: how long and how deep a run was in conflict, and how it answered."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye import signals
from adeye.judge.conflict import DRAC, RSS_MARGIN, TIME_GAP, TTC, turn
from adeye.judge.metrics.criticality import worst_of
from adeye.judge.metrics.registry import column_at, column_of, object_entry
from adeye.judge.metrics.scans import ERROR, NO_CONFLICT, NOT_APPLICABLE, UNDEFINED, VALUE
from adeye.judge.series import SERIES
from adeye.kernel.criticality import (
    crash_probability,
    proportion_of_stopping_distance,
    road_gap,
    safe_distance_ratio,
)
from adeye.kernel.jit import allocating
from adeye.kernel.road import lane_way
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.judge.conflict import Scene
    from adeye.judge.series import TraceSeries
    from adeye.signals import Bytes, Floats, Ints, Shorts


# --- Compiled: how long and how badly a run was exposed, from its series of conflicts -------------

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
) -> tuple[Floats, Ints, Bytes]:
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
) -> tuple[Ints, Bytes]:
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
            speed = ego[run, row, signals.EGO_SPEED]
            curve = speed * ego_place[run, row, signals.PLACE_CURVATURE]
            aside = speed * (ego[run, row, signals.EGO_YAW_RATE] - curve)
            slowing = -ego[run, row, signals.EGO_ACCELERATION]
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
) -> tuple[Ints, Floats, Bytes]:
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
def least_safe_ratios(scene: Scene, margins: Floats, worst: Shorts) -> tuple[Ints, Floats, Bytes]:
    """Find the row with the least ratio of gap and RSS distance.

    Args:
        scene: The runs.
        margins: (B, T) gap less RSS distance of who has the least, +inf for none [m].
        worst: (B, T) who that is, -1 for nobody.

    Returns:
        Rows (B,), values (B,), statuses (B,).
    """
    length, ego, ego_place, ego_size, objects, places, sizes, _ = scene
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
            turn(turns, 0, ego[run, row, signals.EGO_HEADING] - own[signals.PLACE_HEADING])
            heading = objects[run, row, thing, signals.OBJECT_HEADING]
            turn(turns, 1, heading - other[signals.PLACE_HEADING])
            own_half = 0.5 * (
                ego_size[run, 0] * abs(turns[0, 2]) + ego_size[run, 1] * abs(turns[0, 1])
            )
            half = 0.5 * (
                sizes[run, thing, 0] * abs(turns[1, 2]) + sizes[run, thing, 1] * abs(turns[1, 1])
            )
            apart = lane_way(
                own[signals.PLACE_S], own[signals.PLACE_HEADING], own[signals.PLACE_D],
                other[signals.PLACE_S], other[signals.PLACE_HEADING],
            )  # fmt: skip
            gap = road_gap(apart, own_half, half)
            ratio = safe_distance_ratio(gap, gap - margin)
            if ratio < least[run]:
                least[run], rows[run], codes[run] = ratio, row, VALUE
    return rows, least, codes


# --- Metrics of exposure: how long and how deep a run was in conflict, and how it answered --------

EXPOSURE_TTC: Final = 3.0
"""Time to collision up to which a run counts as exposed [s], the largest of those in use."""

EVASIVE_BRAKING: Final = 2.0
EVASIVE_LATERAL: Final = 2.0
"""Deceleration and lateral acceleration beyond which the ego evades [m/s²]: more than drivers use
without need."""

BRAKING_MEAN: Final = 8.45
BRAKING_DEVIATION: Final = 1.40
BRAKING_LEAST: Final = 4.23
BRAKING_MOST: Final = 12.68
"""Largest deceleration of cars on a dry road for the crash potential index [m/s²], normally
distributed between two ends, as in Cunto and Saccomanno (2008); all of them times the friction."""


@object_entry("adeye:criticality.min_time_gap@1", "s", "lower", SERIES["time_gap"])
def min_time_gap(series: TraceSeries) -> MetricColumn:
    """Least time in which the ego drives the gap to the nearest object in the path."""
    return worst_of(series, TIME_GAP)


@object_entry("adeye:criticality.tet@1", "s", "higher")
def tet(series: TraceSeries) -> MetricColumn:
    """Time exposed: with a time to collision of at most 3 s, each row counting one step."""
    return _sum(series, EXPOSED)


@object_entry("adeye:criticality.tit@1", "s²", "higher", most=EXPOSURE_TTC, most_per="s")
def tit(series: TraceSeries) -> MetricColumn:
    """Time integrated: by how much the time to collision was below 3 s, summed over time."""
    return _sum(series, INTEGRATED)


@object_entry("adeye:criticality.tet_share@1", "1", "higher", scale=0.1, most=1.0)
def tet_share(series: TraceSeries) -> MetricColumn:
    """Share of the run with a time to collision of at most 3 s."""
    return _mean(series, EXPOSED)


@object_entry("adeye:criticality.tit_mean@1", "s", "higher", scale=0.1, most=EXPOSURE_TTC)
def tit_mean(series: TraceSeries) -> MetricColumn:
    """By how much the time to collision was below 3 s, on average over the run."""
    return _mean(series, INTEGRATED)


@object_entry("adeye:criticality.crash_potential@1", "1", "higher", scale=0.01, most=1.0)
def crash_potential(series: TraceSeries) -> MetricColumn:
    """Crash potential index: mean probability that cars cannot brake as hard as they had to."""
    return _sum(series, POTENTIAL)


@object_entry("adeye:criticality.time_to_accident@1", "s", "lower", cap=10.0, settles=True)
def time_to_accident(series: TraceSeries) -> MetricColumn:
    """Time to collision when the ego first brakes or swerves with more than 2 m/s².

    It does not apply to an ego that never does.
    """
    scene, ttc = series.scene, series.worst_conflicts[0][TTC]
    row, codes = first_evasions(
        scene.length, scene.ego, scene.ego_place, ttc, EVASIVE_BRAKING, EVASIVE_LATERAL
    )
    return column_at(series, codes, row, TTC)


@object_entry("adeye:criticality.min_psd@1", "1", "lower", cap=10.0)
def min_psd(series: TraceSeries) -> MetricColumn:
    """Least gap in the path over the least way to standstill; below 1 there is no return."""
    (gaps, actors), scene = series.nearest, series.scene
    braking = np.ascontiguousarray(series.abilities[:, 0])
    row, value, codes = least_stopping_shares(
        scene.length, gaps, scene.ego[..., signals.EGO_SPEED], scene.contact, braking
    )
    return column_of(series, codes, row, value, actors[np.arange(len(row)), row])


@object_entry("adeye:criticality.min_rss_ratio@2", "1", "lower", scale=0.1, cap=10.0)
def min_rss_ratio(series: TraceSeries) -> MetricColumn:
    """Least gap over the RSS distance, to who is laterally unsafe and has the least RSS margin."""
    margins, actors = (part[RSS_MARGIN] for part in series.worst_conflicts)
    row, value, codes = least_safe_ratios(series.scene, margins, actors)
    return column_of(series, codes, row, value, actors[np.arange(len(row)), row])


@object_entry("adeye:criticality.rss_response_violation@2", "s", "higher")
def rss_response_violation(series: TraceSeries) -> MetricColumn:
    """Time with an RSS violation older than the response time and no braking as RSS asks for."""
    return _sum(series, RESPONSE)


def _exposures(series: TraceSeries) -> tuple[Floats, Ints, NDArray[np.int8]]:
    """Scan the runs."""
    values, _ = series.worst_conflicts
    friction = series.trace.layout.context.surroundings.friction
    ends = np.array([BRAKING_MEAN, BRAKING_DEVIATION, BRAKING_LEAST, BRAKING_MOST])
    return exposures(
        series.trace.length,
        series.step,
        values[TTC],
        values[DRAC],
        values[RSS_MARGIN],
        series.column("ego")[..., signals.EGO_ACCELERATION],
        EXPOSURE_TTC,
        friction[:, np.newaxis] * ends,
        *series.rss_response,
    )


_QUANTITY: Final = {EXPOSED: TTC, INTEGRATED: TTC, POTENTIAL: DRAC, RESPONSE: RSS_MARGIN}


def _sum(series: TraceSeries, what: int) -> MetricColumn:
    sums, rows, codes = series.once("exposures", lambda: _exposures(series))
    row = rows[what]
    actors = series.worst_conflicts[1][_QUANTITY[what]][np.arange(len(row)), row]
    # Where it is 0 there is no worst row.
    return column_of(series, codes, row, sums[what], actors, is_found=row >= 0)


def _mean(series: TraceSeries, what: int) -> MetricColumn:
    column = _sum(series, what)
    duration = np.maximum(series.trace.length, 1) * series.step
    return MetricColumn(column.value / duration, column.status, column.time, column.actor)
