"""Metrics of exposure: how long and how deep a run was in conflict, and how it answered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.conflict import DRAC, GAP, RSS_MARGIN, TIME_GAP, TTC
from adeye.evaluation.metrics.criticality import worst_of
from adeye.evaluation.metrics.exposed import (
    EXPOSED,
    INTEGRATED,
    POTENTIAL,
    RESPONSE,
    exposures,
    first_evasions,
    least_safe_ratios,
    least_stopping_shares,
)
from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.series import SERIES
from adeye.ports import MetricColumn
from adeye.signals import EGO_ACCELERATION, EGO_SPEED

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.evaluation.series import TraceSeries
    from adeye.signals import Floats, Ints

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

_MINDERHOUD: Final = (
    "Minderhoud and Bovy (2001), Extended time-to-collision measures for road traffic safety"
    " assessment"
)
_RSS: Final = SERIES["rss_margin"].source


@metric_entry(
    "adeye:criticality.min_time_gap@1", "min_time_gap_s", "s", "lower",
    SERIES["time_gap"].source, scale=1.0, cap=SERIES["time_gap"].type.cap,
)  # fmt: skip
def min_time_gap(series: TraceSeries) -> MetricColumn:
    """Least time in which the ego drives the gap to the nearest object in the path."""
    return worst_of(series, TIME_GAP)


@metric_entry("adeye:criticality.tet@1", "tet_s", "s", "higher", _MINDERHOUD, scale=1.0)
def tet(series: TraceSeries) -> MetricColumn:
    """Time exposed: with a time to collision of at most 3 s, each row counting one step."""
    return _sum(series, EXPOSED)


@metric_entry("adeye:criticality.tit@1", "tit_s2", "s²", "higher", _MINDERHOUD, scale=1.0)
def tit(series: TraceSeries) -> MetricColumn:
    """Time integrated: by how much the time to collision was below 3 s, summed over time."""
    return _sum(series, INTEGRATED)


@metric_entry(
    "adeye:criticality.tet_share@1",
    "tet_share",
    "1",
    "higher",
    _MINDERHOUD,
    scale=0.1,
    least=0.0,
    most=1.0,
)
def tet_share(series: TraceSeries) -> MetricColumn:
    """Share of the run with a time to collision of at most 3 s."""
    return _mean(series, EXPOSED)


@metric_entry("adeye:criticality.tit_mean@1", "tit_mean_s", "s", "higher", _MINDERHOUD, scale=0.1)
def tit_mean(series: TraceSeries) -> MetricColumn:
    """By how much the time to collision was below 3 s, on average over the run."""
    return _mean(series, INTEGRATED)


@metric_entry(
    "adeye:criticality.crash_potential@1", "crash_potential", "1", "higher",
    "Cunto and Saccomanno (2008), Calibration and validation of simulated vehicle safety "
    "performance at signalized intersections",
    scale=0.01,
)  # fmt: skip
def crash_potential(series: TraceSeries) -> MetricColumn:
    """Crash potential index: mean probability that cars cannot brake as hard as they had to."""
    return _sum(series, POTENTIAL)


@metric_entry(
    "adeye:criticality.time_to_accident@1", "time_to_accident_s", "s", "lower",
    "Hydén (1987), The development of a method for traffic safety evaluation", scale=1.0,
    cap=10.0, settles=True, least=0.0,
)  # fmt: skip
def time_to_accident(series: TraceSeries) -> MetricColumn:
    """Time to collision when the ego first brakes or swerves with more than 2 m/s².

    It does not apply to an ego that never does.
    """
    values, actors = (part[TTC] for part in series.worst_conflicts)
    row, codes = first_evasions(
        series.trace.length,
        series.column("ego"),
        series.column("ego_place"),
        values,
        EVASIVE_BRAKING,
        EVASIVE_LATERAL,
    )
    runs = np.arange(len(row))
    return column_of(series, codes, row, values[runs, row], actors[runs, row])


@metric_entry(
    "adeye:criticality.min_psd@1", "min_psd", "1", "lower",
    "Allen, Shin, Cooper (1978), Analysis of traffic conflicts and collisions", scale=1.0,
    cap=10.0,
)  # fmt: skip
def min_psd(series: TraceSeries) -> MetricColumn:
    """Least gap in the path over the least way to standstill; below 1 there is no return."""
    gaps, actors = (part[GAP] for part in series.worst_conflicts)
    row, value, codes = least_stopping_shares(
        series.trace.length,
        gaps,
        series.column("ego")[..., EGO_SPEED],
        series.column("contact"),
        np.ascontiguousarray(series.abilities[:, 0]),
    )
    return column_of(series, codes, row, value, actors[np.arange(len(row)), row])


@metric_entry(
    "adeye:criticality.min_rss_ratio@2", "min_rss_ratio", "1", "lower", _RSS, scale=0.1, cap=10.0
)
def min_rss_ratio(series: TraceSeries) -> MetricColumn:
    """Least gap over the RSS distance, to who is laterally unsafe and has the least RSS margin."""
    context = series.trace.layout.context
    margins, actors = (part[RSS_MARGIN] for part in series.worst_conflicts)
    row, value, codes = least_safe_ratios(
        series.trace.length,
        margins,
        actors,
        series.column("ego"),
        series.column("ego_place"),
        context.ego_size,
        series.column("objects"),
        series.column("object_places"),
        context.object_sizes,
    )
    return column_of(series, codes, row, value, actors[np.arange(len(row)), row])


@metric_entry(
    "adeye:criticality.rss_response_violation@2", "rss_response_violation_s", "s", "higher", _RSS,
    scale=1.0,
)  # fmt: skip
def rss_response_violation(series: TraceSeries) -> MetricColumn:
    """Time with an RSS violation older than the response time and no braking as RSS asks for."""
    return _sum(series, RESPONSE)


def _exposures(series: TraceSeries) -> tuple[Floats, Ints, NDArray[np.int8]]:
    """Scan the runs once for all of these metrics."""
    if "exposures" not in series.kept:
        values, _ = series.worst_conflicts
        friction = series.trace.layout.context.surroundings.friction
        ends = np.array([BRAKING_MEAN, BRAKING_DEVIATION, BRAKING_LEAST, BRAKING_MOST])
        series.kept["exposures"] = exposures(
            series.trace.length,
            series.step,
            values[TTC],
            values[DRAC],
            values[RSS_MARGIN],
            series.column("ego")[..., EGO_ACCELERATION],
            EXPOSURE_TTC,
            friction[:, np.newaxis] * ends,
            series.rss_response[0],
            series.rss_response[1],
        )
    found: tuple[Floats, Ints, NDArray[np.int8]] = series.kept["exposures"]
    return found


_QUANTITY: Final = {EXPOSED: TTC, INTEGRATED: TTC, POTENTIAL: DRAC, RESPONSE: RSS_MARGIN}


def _sum(series: TraceSeries, what: int) -> MetricColumn:
    sums, rows, codes = _exposures(series)
    at = np.maximum(rows[what], 0)
    actors = series.worst_conflicts[1][_QUANTITY[what]][np.arange(len(at)), at]
    column = column_of(series, codes, at, sums[what], actors)
    # Where it is 0 there is no worst row.
    is_found = rows[what] >= 0
    time = np.where(is_found, column.time, np.nan)
    return MetricColumn(column.value, column.status, time, np.where(is_found, column.actor, -1))


def _mean(series: TraceSeries, what: int) -> MetricColumn:
    column = _sum(series, what)
    duration = np.maximum(series.trace.length, 1) * series.step
    return MetricColumn(column.value / duration, column.status, column.time, column.actor)
