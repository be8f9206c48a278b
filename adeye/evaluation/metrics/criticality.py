"""Metrics of how near a run came to a collision: contact, distance, times, decelerations, RSS."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.conflict import DISTANCE, DRAC, GAP, REQUIRED, RSS_MARGIN, TIME_HEADWAY, TTC
from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.scans import (
    ERROR,
    NO_CONFLICT,
    UNDEFINED,
    VALUE,
    first_contacts,
    worst_at_standstill,
    worst_conflicts,
    worst_violations,
)
from adeye.evaluation.metrics.statuses import StatusColumn
from adeye.evaluation.samples import is_demand
from adeye.evaluation.series import SERIES, TraceSeries
from adeye.evaluation.source import STANDSTILL_SPEED
from adeye.kernel.clock import tick_times
from adeye.ports import MetricColumn
from adeye.signals import EGO_SPEED

if TYPE_CHECKING:
    from adeye.signals import Bools, Ints


@metric_entry(
    "adeye:criticality.contact@1",
    "contact",
    "1",
    "higher",
    "geometry of swept boxes",
    scale=1.0,
    least=0.0,
    most=1.0,
)
def contact(series: TraceSeries) -> MetricColumn:
    """1 if the ego touches an object, else 0."""
    row, has_contact, touched = contacts_of(series)
    codes = np.full(row.shape, VALUE)
    column = column_of(series, codes, row, has_contact.astype(np.float64), touched)
    time = np.where(has_contact, column.time, np.nan)
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
    row, has_contact, touched = contacts_of(series)
    codes = np.where(has_contact, VALUE, NO_CONFLICT)
    speed = series.column("impact_speed")[np.arange(len(row)), row]
    return column_of(series, codes, row, speed, touched)


@metric_entry(
    "adeye:criticality.min_distance@1",
    "min_distance_m",
    "m",
    "lower",
    SERIES["distance"].source,
    scale=10.0,
    cap=SERIES["distance"].type.cap,
    least=0.0,
)
def min_distance(series: TraceSeries) -> MetricColumn:
    """Least distance between the bodies of the ego and any object; 0 at contact."""
    return worst_of(series, DISTANCE)


@metric_entry(
    "adeye:criticality.min_ttc@1",
    "min_ttc_s",
    "s",
    "lower",
    SERIES["ttc"].source,
    scale=1.0,
    cap=SERIES["ttc"].type.cap,
    least=0.0,
)
def min_ttc(series: TraceSeries) -> MetricColumn:
    """Least time to collision at constant speeds with an object in the path; 0 at contact."""
    return worst_of(series, TTC)


@metric_entry(
    "adeye:criticality.min_time_headway@1",
    "min_time_headway_s",
    "s",
    "lower",
    SERIES["time_headway"].source,
    scale=1.0,
    cap=SERIES["time_headway"].type.cap,
    least=0.0,
)
def min_time_headway(series: TraceSeries) -> MetricColumn:
    """Least time between the front bumpers of ego and object in the path passing one place."""
    return worst_of(series, TIME_HEADWAY)


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
    return worst_of(series, DRAC)


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
    return worst_of(series, REQUIRED)


@metric_entry(
    "adeye:criticality.rss_violation@2",
    "rss_violation_s",
    "s",
    "higher",
    SERIES["rss_violation"].source,
    scale=1.0,
)
def rss_violation(series: TraceSeries) -> MetricColumn:
    """Time with an RSS violation, each row counting one step; when and who was the worst."""
    margins, actors = (part[RSS_MARGIN] for part in series.worst_conflicts)
    row, count, is_error = worst_violations(series.trace.length, margins)
    runs = np.arange(len(row))
    codes = np.where(count > 0, VALUE, UNDEFINED)
    worst = column_of(series, codes, row, margins[runs, row], actors[runs, row])
    seconds = np.where(is_error, np.nan, tick_times(count, series.step))
    status = StatusColumn(np.where(is_error, ERROR, VALUE))
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
    gaps, actors = (part[GAP] for part in series.worst_conflicts)
    speed = series.column("ego")[..., EGO_SPEED]
    row, codes = worst_at_standstill(series.trace.length, gaps, speed, STANDSTILL_SPEED)
    runs = np.arange(len(row))
    return column_of(series, codes, row, gaps[runs, row], actors[runs, row])


def worst_of(series: TraceSeries, quantity: int) -> MetricColumn:
    """Reduce a quantity of ``conflict`` to the worst of each run."""
    values, actors = (part[quantity] for part in series.worst_conflicts)
    row, codes = worst_conflicts(
        series.trace.length, values, actors, series.column("contact"), is_demand(quantity)
    )
    runs = np.arange(len(row))
    return column_of(series, codes, row, values[runs, row], actors[runs, row])


def contacts_of(series: TraceSeries) -> tuple[Ints, Bools, Ints]:
    """Give the row (B,) of the first contact, 0 for none, whether there is one, and with whom."""
    touched = series.column("contact")
    row = first_contacts(series.trace.length, touched)
    has_contact = row >= 0
    row = np.where(has_contact, row, 0)
    return row, has_contact, np.where(has_contact, touched[np.arange(len(row)), row], -1)
