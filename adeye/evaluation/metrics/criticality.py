"""Metrics of how near a run came to a collision: contact, distance, times, decelerations, RSS."""

from __future__ import annotations

import numpy as np

from adeye.evaluation.metrics.registry import (
    ERROR,
    NO_CONFLICT,
    NOT_APPLICABLE,
    VALUE,
    at_rows,
    extreme,
    metric_entry,
)
from adeye.evaluation.series import SERIES, TraceSeries
from adeye.evaluation.source import STANDSTILL_SPEED
from adeye.evaluation.stl.series import SampleStatus
from adeye.ports import MetricColumn
from adeye.signals import EGO_SPEED


@metric_entry(
    "adeye:criticality.contact@1", "contact", "1", "higher", "geometry of swept boxes", scale=1.0
)
def contact(series: TraceSeries) -> MetricColumn:
    """1 if the ego touches an object, else 0."""
    values = series.touched.astype(np.float64)
    row = series.touched.argmax(axis=1)
    status = np.full(row.shape, VALUE)
    column = at_rows(series, values, row, status, np.where(series.touched, _touched(series), -1))
    time = np.where(series.touched.any(axis=1), column.time, np.nan)
    return MetricColumn(column.value, column.status, time, column.actor)


@metric_entry(
    "adeye:criticality.impact_speed@1",
    "impact_speed_mps",
    "m/s",
    "higher",
    "size of the relative velocity at contact",
    scale=10.0,
)
def impact_speed(series: TraceSeries) -> MetricColumn:
    """Relative speed at the first contact; no conflict without contact."""
    row = series.touched.argmax(axis=1)
    has_contact = series.touched.any(axis=1)
    status = np.where(has_contact, VALUE, NO_CONFLICT)
    return at_rows(series, series.column("impact_speed"), row, status, _touched(series))


@metric_entry(
    "adeye:criticality.min_distance@1",
    "min_distance_m",
    "m",
    "lower",
    SERIES["distance"].source,
    scale=10.0,
    cap=SERIES["distance"].type.cap,
)
def min_distance(series: TraceSeries) -> MetricColumn:
    """Least distance between the bodies of the ego and any object; 0 at contact."""
    return extreme(series, series.least_distance, "lower")


@metric_entry(
    "adeye:criticality.min_ttc@1",
    "min_ttc_s",
    "s",
    "lower",
    SERIES["ttc"].source,
    scale=1.0,
    cap=SERIES["ttc"].type.cap,
)
def min_ttc(series: TraceSeries) -> MetricColumn:
    """Least time to collision at constant speeds with an object in the path; 0 at contact."""
    return extreme(series, series.samples("ttc"), "lower")


@metric_entry(
    "adeye:criticality.min_time_headway@1",
    "min_time_headway_s",
    "s",
    "lower",
    SERIES["time_headway"].source,
    scale=1.0,
    cap=SERIES["time_headway"].type.cap,
)
def min_time_headway(series: TraceSeries) -> MetricColumn:
    """Least time between the front bumpers of ego and object in the path passing one place."""
    return extreme(series, series.samples("time_headway"), "lower")


@metric_entry(
    "adeye:criticality.max_drac@1",
    "max_drac_mps2",
    "m/s²",
    "higher",
    SERIES["drac"].source,
    scale=1.0,
)
def max_drac(series: TraceSeries) -> MetricColumn:
    """Largest deceleration to avoid a crash, before contact, with who keeps its speed."""
    return extreme(series, series.samples("drac"), "higher")


@metric_entry(
    "adeye:criticality.max_required_deceleration@1",
    "max_required_deceleration_mps2",
    "m/s²",
    "higher",
    SERIES["required_deceleration"].source,
    scale=1.0,
)
def max_required_deceleration(series: TraceSeries) -> MetricColumn:
    """Largest constant deceleration needed, before contact, against who goes on braking."""
    return extreme(series, series.samples("required_deceleration"), "higher")


@metric_entry(
    "adeye:criticality.rss_violation@1",
    "rss_violation_s",
    "s",
    "higher",
    SERIES["rss_violation"].source,
    scale=1.0,
)
def rss_violation(series: TraceSeries) -> MetricColumn:
    """Time with an RSS violation, each row counting one step; when and who was the worst."""
    margin = series.samples("rss_margin")
    violated = series.known & (series.samples("rss_violation").values > 0.0)
    worst = extreme(series, margin, "lower", among=violated)
    is_error = (series.known & (margin.status == SampleStatus.ERROR)).any(axis=1)
    seconds = np.where(is_error, np.nan, violated.sum(axis=1) * series.step)
    status = tuple(ERROR if bad else VALUE for bad in is_error)
    return MetricColumn(seconds, status, worst.time, worst.actor)


@metric_entry(
    "adeye:criticality.standstill_gap@1",
    "standstill_gap_m",
    "m",
    "lower",
    SERIES["gap"].source,
    scale=10.0,
    cap=SERIES["gap"].type.cap,
)
def standstill_gap(series: TraceSeries) -> MetricColumn:
    """Least gap to an object in the path while the ego stands; not applicable if it never does."""
    speed = series.column("ego")[..., EGO_SPEED]
    stands = series.known & (np.abs(speed) <= STANDSTILL_SPEED)
    column = extreme(series, series.samples("gap"), "lower", among=stands)
    is_error = (series.known & ~np.isfinite(speed)).any(axis=1)
    status = np.where(stands.any(axis=1), column.status, NOT_APPLICABLE)
    status = np.where(is_error, ERROR, status)
    return MetricColumn(column.value, tuple(status.tolist()), column.time, column.actor)


def _touched(series: TraceSeries) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Give the object that the ego touches (B, T), also beyond the runs."""
    return np.asarray(series.column("contact"), dtype=np.int64)
