"""Metrics of how a fault is handled, and of how often another channel acts.

Times count from the first row at which a fault is present, and do not apply without one. A fault
that nobody detects, and one that is not handled before the run ends, leaves them incomplete: a
bound on them is then undecided, never kept and never without a case.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.intervals import alarms, any_of, others_act
from adeye.evaluation.metrics.handled import Handled, decided_rows, default_channel, handled
from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.scans import (
    ERROR,
    NOT_APPLICABLE,
    VALUE,
    as_flags,
    first_faults,
    first_takeovers,
    safe_from,
)
from adeye.evaluation.metrics.statuses import CODES, INCOMPLETE, UNDEFINED
from adeye.evaluation.road import on_road
from adeye.evaluation.source import STANDSTILL_SPEED
from adeye.signals import EGO_SPEED, EGO_X, EGO_Y, NO_CHANNEL, PLACE_D

if TYPE_CHECKING:
    from adeye.evaluation.series import TraceSeries
    from adeye.ports import MetricColumn
    from adeye.signals import Bools, Floats, Ints


@metric_entry(
    "adeye:handling.fault_to_safe_state@1",
    "fault_to_safe_state_s",
    "s",
    "higher",
    "ISO 26262-1:2018, 3.56 (fault handling time interval), measured",
    scale=1.0,
    settles=True,
)
def fault_to_safe_state(series: TraceSeries) -> MetricColumn:
    """Time from the first fault until the ego is in a safe state and stays there to the end.

    It is incomplete where the run ends before.
    """
    trace, place = series.trace, series.column("ego_place")
    row = safe_from(
        trace.length,
        series.column("ego")[..., EGO_SPEED],
        place[..., PLACE_D],
        series.column("contact"),
        on_road(trace.layout.context.road, place),
        STANDSTILL_SPEED,
    )
    return _since_fault(series, _onset(series), row, row < trace.length, row < 0)


@metric_entry(
    "adeye:handling.distance_to_safe_state@1",
    "distance_to_safe_state_m",
    "m",
    "higher",
    "own definition: way driven meanwhile",
    scale=10.0,
    settles=True,
)
def distance_to_safe_state(series: TraceSeries) -> MetricColumn:
    """Way that the ego drives from the first fault until it is in a safe state to the end.

    It is incomplete where the run ends before.
    """
    found = _handled(series)
    ego = series.column("ego")
    step = np.diff(ego[..., [EGO_X, EGO_Y]], axis=1, prepend=ego[:, :1, [EGO_X, EGO_Y]])
    rows = np.arange(ego.shape[1])
    begin, end = found.fault[:, np.newaxis], found.safe[:, np.newaxis]
    driven = np.hypot(step[..., 0], step[..., 1])
    way = np.where((rows > begin) & (rows <= end), driven, 0.0).sum(axis=1)
    way = np.where(found.safe >= 0, way, np.nan)
    is_unknown = found.is_unknown | ((found.safe >= 0) & ~np.isfinite(way))
    return _interval(series, found.fault, way, found.safe, is_unknown=is_unknown)


@metric_entry(
    "adeye:handling.takeover_time@1",
    "takeover_time_s",
    "s",
    "higher",
    "own definition: latency of the arbitration",
    scale=1.0,
    settles=True,
)
def takeover_time(series: TraceSeries) -> MetricColumn:
    """Time from the first fault until authority first passes to another channel.

    It is incomplete where no handover follows before the run ends.
    """
    trace = series.trace
    onset = _onset(series)
    default = default_channel(trace)
    row = first_takeovers(trace.length, onset, series.column("authority"), default)
    return _since_fault(series, onset, row, row >= 0, np.zeros(trace.runs, dtype=np.bool_))


@metric_entry(
    "adeye:handling.fault_detection_time@1",
    "fault_detection_time_s",
    "s",
    "higher",
    "ISO 26262-1:2018, 3.55 (fault detection time interval), measured",
    scale=1.0,
    settles=True,
)
def fault_detection_time(series: TraceSeries) -> MetricColumn:
    """Time from the first fault until a monitor is confirmed or the acting channel is unusable.

    What has been so since before the fault, without a break, detects nothing.
    """
    found = _handled(series)
    return _interval(series, found.fault, found.intervals.fdti, found.detect)


@metric_entry(
    "adeye:handling.fault_reaction_time@1",
    "fault_reaction_time_s",
    "s",
    "higher",
    "ISO 26262-1:2018, 3.59 (fault reaction time interval), measured",
    scale=1.0,
    settles=True,
)
def fault_reaction_time(series: TraceSeries) -> MetricColumn:
    """Time from the detection of the first fault to the safe state or to emergency operation."""
    found = _handled(series)
    frti = found.intervals.frti
    row = found.detect + np.rint(np.nan_to_num(frti) / series.step).astype(np.int64)
    return _interval(series, found.fault, frti, row, is_unknown=found.is_unknown)


@metric_entry(
    "adeye:handling.fault_handling_time@1",
    "fault_handling_time_s",
    "s",
    "higher",
    "ISO 26262-1:2018, 3.56 (fault handling time interval), measured",
    scale=1.0,
    settles=True,
)
def fault_handling_time(series: TraceSeries) -> MetricColumn:
    """Time from the first fault to the safe state or to emergency operation, if it is detected."""
    found = _handled(series)
    fhti = found.intervals.fhti
    row = found.fault + np.rint(np.nan_to_num(fhti) / series.step).astype(np.int64)
    return _interval(series, found.fault, fhti, row, is_unknown=found.is_unknown)


@metric_entry(
    "adeye:handling.emergency_operation_time@1",
    "emergency_operation_time_s",
    "s",
    "higher",
    "ISO 26262-1:2018, 3.44 (emergency operation time interval), measured",
    scale=1.0,
    settles=True,
)
def emergency_operation_time(series: TraceSeries) -> MetricColumn:
    """Time from emergency operation after the first fault to the safe state.

    It does not apply where the safe state needs no emergency operation.
    """
    found = _handled(series)
    needs_none = (found.emergency < 0) & (found.safe >= 0)
    fault = np.where(needs_none, -1, found.fault)
    return _interval(series, fault, found.intervals.eoti, found.safe, is_unknown=found.is_unknown)


@metric_entry(
    "adeye:handling.nominal_availability@1",
    "nominal_availability",
    "1",
    "lower",
    "own definition: share of time",
    scale=1.0,
    cap=1.0,
    least=0.0,
    most=1.0,
)
def nominal_availability(series: TraceSeries) -> MetricColumn:
    """Share of the time of the run at which the default channel acts."""
    trace = series.trace
    decided = decided_rows(trace)
    away = decided & (series.column("authority") != default_channel(trace))
    rows = decided.sum(axis=1)
    codes = np.where(rows > 0, VALUE, CODES[UNDEFINED])
    share = 1.0 - away.sum(axis=1) / np.maximum(rows, 1)
    return column_of(series, codes, away.argmax(axis=1), share)


@metric_entry(
    "adeye:handling.takeovers@1",
    "takeovers",
    "1",
    "higher",
    "own definition: count of handovers",
    scale=1.0,
)
def takeovers(series: TraceSeries) -> MetricColumn:
    """How often authority passes from the default channel to another."""
    return _counted(series, _away(series))


@metric_entry(
    "adeye:handling.trips@1",
    "trips",
    "1",
    "higher",
    "own definition: count of alarms and handovers",
    scale=1.0,
)
def trips(series: TraceSeries) -> MetricColumn:
    """How often a monitor is confirmed, the acting channel unusable, or another channel acts.

    What goes on at the same time is one.
    """
    monitors = series.trace.layout.monitors
    on = any_of(alarms(series.column("monitors"), series.column("reason"), monitors))
    return _counted(series, on | _away(series))


def _handled(series: TraceSeries) -> Handled:
    """Read how faults are handled, once for all metrics."""
    found: Handled = series.kept.get("handled") or handled(series.trace)
    series.kept["handled"] = found
    return found


def _away(series: TraceSeries) -> Bools:
    """Tell at which rows (B, T) another channel than the default acts, or acted last."""
    if "away" not in series.kept:
        authority = np.asarray(series.column("authority"))
        away = others_act(authority, default_channel(series.trace))
        nobody = authority == NO_CHANNEL
        # Who acted last counts while nobody does; few runs have both.
        for run in np.flatnonzero(away.any(axis=1) & nobody.any(axis=1)):
            rows = np.arange(authority.shape[1])
            last = np.maximum.accumulate(np.where(nobody[run], -1, rows))
            away[run] = (last >= 0) & away[run, np.maximum(last, 0)]
        series.kept["away"] = away
    found: Bools = series.kept["away"]
    return found


def _counted(series: TraceSeries, on: Bools) -> MetricColumn:
    """Count the rows (B, T) at which something begins."""
    begins = on & decided_rows(series.trace)
    begins[:, 1:] &= ~on[:, :-1]
    codes = np.full(len(on), VALUE)
    return column_of(series, codes, begins.argmax(axis=1), begins.sum(axis=1).astype(np.float64))


def _interval(
    series: TraceSeries,
    fault: Ints,
    value: Floats,
    row: Ints,
    *,
    is_unknown: Bools | None = None,
) -> MetricColumn:
    """Give an interval of fault handling.

    Args:
        series: Series of the trace.
        fault: (B,) first row with a fault, -1 where the interval does not apply.
        value: (B,) [s], NaN where it did not come to its end.
        row: (B,) its end.
        is_unknown: (B,) whether that cannot be told.
    """
    unknown = np.zeros(len(fault), dtype=np.bool_) if is_unknown is None else is_unknown
    codes = np.select(
        [unknown & (fault >= 0), fault < 0, np.isfinite(value)],
        [ERROR, NOT_APPLICABLE, VALUE],
        CODES[INCOMPLETE],
    )
    return column_of(series, codes, np.maximum(row, 0), value)


def _onset(series: TraceSeries) -> Ints:
    """Give the first row (B,) with a fault, -1 for none."""
    return first_faults(series.trace.length, as_flags(series.column("fault_active")))


def _since_fault(
    series: TraceSeries, onset: Ints, row: Ints, is_reached: Bools, is_error: Bools
) -> MetricColumn:
    """Give the time from the first fault to a row, 0 if it lies before.

    Args:
        series: Series of the trace.
        onset: (B,) first row with a fault, -1 for none.
        row: (B,) when it was reached.
        is_reached: (B,) whether it was.
        is_error: (B,) whether that cannot be told.
    """
    time = series.trace.time
    codes = np.select(
        [is_error, onset < 0, is_reached], [ERROR, NOT_APPLICABLE, VALUE], CODES[INCOMPLETE]
    )
    reached = np.where(codes == VALUE, np.maximum(row, onset), 0)
    return column_of(series, codes, reached, time[reached] - time[onset])
