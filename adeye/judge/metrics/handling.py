"""Metrics of how a fault is handled, and of how often another channel acts.

Times count from the first row at which a fault is present, and do not apply without one. A fault
that nobody detects, and one that is not handled before the run ends, leaves them incomplete: a
bound on them is then undecided, never kept and never without a case.

An alarm that has been on since before the fault, without a break, is no detection here. Against a
fault-free twin (``judge.timeline``) it is none either, but there also an alarm is none that
begins later and that the twin has as well; so a detection by chance counts here and not there.

Vehicle, decelerations and ratings are those of each run's own architecture. Two architectures that
rate places differently are each measured by their own ratings.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.judge.intervals import (
    Intervals,
    alarms,
    any_of,
    degradation,
    first_from,
    held_since_before,
    intervals,
    operates_in_emergency,
    others_act,
)
from adeye.judge.metrics import scans
from adeye.judge.metrics.registry import column_of, metric_entry
from adeye.judge.outcome import on_road
from adeye.judge.safe_stop import achieved_rating, best_rating, rules_of
from adeye.judge.trace_signals import STANDSTILL_SPEED
from adeye.signals import EGO_SPEED, EGO_X, EGO_Y, NO_CHANNEL, PLACE_D

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.judge.series import TraceSeries
    from adeye.ports import MetricColumn
    from adeye.signals import Bools, Floats, Ints
    from adeye.trace import Trace

    Ends = tuple[NDArray[np.int8], Floats]

# --- How the faults of many runs are handled, read from their traces alone, without twins ---------


@dataclass(frozen=True, slots=True)
class Handled:
    """Rows and intervals of fault handling in B runs.

    Attributes:
        fault: (B,) first row with a fault, -1 for none; so also below.
        detect: (B,) an alarm is on that has not been since before the fault.
        emergency: (B,) emergency operation.
        safe: (B,) from here to the end the ego is in a safe state, the fault's row at the earliest.
        is_unknown: (B,) whether the safe state cannot be told, because a number is not finite.
        intervals: Each (B,), NaN where it did not come to its end.
    """

    fault: Ints
    detect: Ints
    emergency: Ints
    safe: Ints
    is_unknown: Bools
    intervals: Intervals


def handled(trace: Trace) -> Handled:
    """Read how the first fault of each run is handled."""
    fault = np.asarray(scans.first_faults(trace.length, scans.as_flags(trace["fault_active"])))
    rows = np.full((3, trace.runs), -1, dtype=np.int64)
    is_unknown = np.zeros(trace.runs, dtype=np.bool_)
    chosen = np.flatnonzero(fault >= 0)
    if len(chosen):
        columns = dict[str, Any](trace.columns)
        onset = fault[chosen]
        places = columns["ego_place"][chosen]
        speed = columns["ego"][chosen, :, EGO_SPEED]
        found = scans.safe_from(
            trace.length[chosen],
            speed,
            places[..., PLACE_D],
            columns["contact"][chosen],
            on_road(trace.layout.context.road.of(chosen), places),
            STANDSTILL_SPEED,
        )
        is_unknown[chosen] = found < 0
        is_safe = (found >= 0) & (found < trace.length[chosen])
        decided = decided_rows(trace)[chosen]
        on = alarms(trace["monitors"][chosen], trace["reason"][chosen], trace.layout.monitors)
        fresh = any_of(on & ~held_since_before(on, onset))
        acts = others_act(trace["authority"][chosen], default_channel(trace))
        degraded = degradation(trace["monitors"][chosen], trace.layout.monitors)
        braking = columns["command"][chosen, :, 0]
        emergency = operates_in_emergency(acts, braking, speed, degraded)
        rows[0, chosen] = first_from(fresh & decided, onset)
        rows[1, chosen] = first_from(emergency & decided, onset)
        rows[2, chosen] = np.where(is_safe, np.maximum(found, onset), -1)
    detect, emergency_from, safe = rows
    times = [np.where(row >= 0, trace.time[row], np.nan) for row in (fault, *rows)]
    return Handled(fault, detect, emergency_from, safe, is_unknown, intervals(*times))


def decided_rows(trace: Trace) -> Bools:
    """Tell at which rows (B, T) something was decided: all of a run but its last."""
    return np.arange(trace.time.shape[0]) < trace.length[:, np.newaxis] - 1


def default_channel(trace: Trace) -> int:
    """Give the index of the channel that acts without a request."""
    return trace.layout.channels.index(trace.layout.architecture.switch.default)


# --- Metrics of how a fault is handled, and of how often another channel acts ---------------------

_timed = partial(metric_entry, worse="higher", settles=True, since_fault=True)


@_timed("adeye:handling.fault_to_safe_state@1", "s")
def fault_to_safe_state(series: TraceSeries) -> MetricColumn:
    """Time from the first fault until the ego is in a safe state and stays there to the end.

    It is incomplete where the run ends before.
    """
    trace, place = series.trace, series.column("ego_place")
    row = scans.safe_from(
        trace.length,
        series.column("ego")[..., EGO_SPEED],
        place[..., PLACE_D],
        series.column("contact"),
        on_road(trace.layout.context.road, place),
        STANDSTILL_SPEED,
    )
    return _since_fault(series, _onset(series), row, row < trace.length, row < 0)


@_timed("adeye:handling.distance_to_safe_state@1", "m", scale=10.0)
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


@_timed("adeye:handling.takeover_time@2", "s")
def takeover_time(series: TraceSeries) -> MetricColumn:
    """Time from the first fault until authority passes from the default channel to another.

    It is incomplete where no handover follows before the run ends.
    """
    trace = series.trace
    onset = _onset(series)
    default = default_channel(trace)
    row = scans.first_takeovers(trace.length, onset, series.column("authority"), default)
    return _since_fault(series, onset, row, row >= 0, np.zeros(trace.runs, dtype=np.bool_))


@_timed("adeye:handling.fault_detection_time@1", "s")
def fault_detection_time(series: TraceSeries) -> MetricColumn:
    """Time from the first fault until a monitor is confirmed or the acting channel is unusable.

    What has been so since before the fault, without a break, detects nothing.
    """
    found = _handled(series)
    return _interval(series, found.fault, found.intervals.fdti, found.detect)


@_timed("adeye:handling.fault_reaction_time@1", "s")
def fault_reaction_time(series: TraceSeries) -> MetricColumn:
    """Time from the detection of the first fault to the safe state or to emergency operation."""
    found = _handled(series)
    frti = found.intervals.frti
    row = found.detect + np.rint(np.nan_to_num(frti) / series.step).astype(np.int64)
    return _interval(series, found.fault, frti, row, is_unknown=found.is_unknown)


@_timed("adeye:handling.fault_handling_time@1", "s")
def fault_handling_time(series: TraceSeries) -> MetricColumn:
    """Time from the first fault to the safe state or to emergency operation, if it is detected."""
    found = _handled(series)
    fhti = found.intervals.fhti
    row = found.fault + np.rint(np.nan_to_num(fhti) / series.step).astype(np.int64)
    return _interval(series, found.fault, fhti, row, is_unknown=found.is_unknown)


@_timed("adeye:handling.emergency_operation_time@1", "s")
def emergency_operation_time(series: TraceSeries) -> MetricColumn:
    """Time from emergency operation after the first fault to the safe state.

    It does not apply where the safe state needs no emergency operation.
    """
    found = _handled(series)
    needs_none = (found.emergency < 0) & (found.safe >= 0)
    fault = np.where(needs_none, -1, found.fault)
    return _interval(series, fault, found.intervals.eoti, found.safe, is_unknown=found.is_unknown)


@metric_entry("adeye:handling.nominal_availability@1", "1", "lower", cap=1.0, most=1.0)
def nominal_availability(series: TraceSeries) -> MetricColumn:
    """Share of the time of the run at which the default channel acts."""
    trace = series.trace
    decided = decided_rows(trace)
    away = decided & (series.column("authority") != default_channel(trace))
    rows = decided.sum(axis=1)
    codes = np.where(rows > 0, scans.VALUE, scans.UNDEFINED)
    share = 1.0 - away.sum(axis=1) / np.maximum(rows, 1)
    return column_of(series, codes, away.argmax(axis=1), share)


@metric_entry("adeye:handling.takeovers@1", "1", "higher", most=0.5, most_per="row")
def takeovers(series: TraceSeries) -> MetricColumn:
    """How often authority passes from the default channel to another."""
    return _counted(series, series.once("away", lambda: _away(series)))


@metric_entry("adeye:handling.trips@1", "1", "higher", most=0.5, most_per="row")
def trips(series: TraceSeries) -> MetricColumn:
    """How often a monitor is confirmed, the acting channel unusable, or another channel acts.

    What goes on at the same time is one.
    """
    monitors = series.trace.layout.monitors
    on = any_of(alarms(series.column("monitors"), series.column("reason"), monitors))
    return _counted(series, on | series.once("away", lambda: _away(series)))


def _handled(series: TraceSeries) -> Handled:
    return series.once("handled", lambda: handled(series.trace))


def _away(series: TraceSeries) -> Bools:
    """Tell at which rows (B, T) another channel than the default acts, or acted last."""
    authority = np.asarray(series.column("authority"))
    away = others_act(authority, default_channel(series.trace))
    nobody = authority == NO_CHANNEL
    # Who acted last counts while nobody does; few runs have both.
    for run in np.flatnonzero(away.any(axis=1) & nobody.any(axis=1)):
        rows = np.arange(authority.shape[1])
        last = np.maximum.accumulate(np.where(nobody[run], -1, rows))
        away[run] = (last >= 0) & away[run, np.maximum(last, 0)]
    return away


def _counted(series: TraceSeries, on: Bools) -> MetricColumn:
    """Count the rows (B, T) at which something begins."""
    begins = on & decided_rows(series.trace)
    begins[:, 1:] &= ~on[:, :-1]
    codes = np.full(len(on), scans.VALUE)
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
        [scans.ERROR, scans.NOT_APPLICABLE, scans.VALUE],
        scans.INCOMPLETE,
    )
    return column_of(series, codes, np.maximum(row, 0), value)


def _onset(series: TraceSeries) -> Ints:
    """Give the first row (B,) with a fault, -1 for none."""
    return scans.first_faults(series.trace.length, scans.as_flags(series.column("fault_active")))


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
        [is_error, onset < 0, is_reached],
        [scans.ERROR, scans.NOT_APPLICABLE, scans.VALUE],
        scans.INCOMPLETE,
    )
    reached = np.where(codes == scans.VALUE, np.maximum(row, onset), 0)
    return column_of(series, codes, reached, time[reached] - time[onset])


# --- Metrics of where the ego stands at the end of a run, against what was reachable at the fault -


@metric_entry("adeye:stopping.stop_rating@1", "1", "higher", most=8.0)
def stop_rating(series: TraceSeries) -> MetricColumn:
    """Rating of the place where the ego stands at the end, from 0 for a refuge to 8 for contact.

    It does not apply to an ego that does not stand at the end.
    """
    codes, values = series.once("stops", lambda: _ends(series))
    return column_of(series, codes, series.trace.length - 1, values, _touched(series.trace))


@metric_entry("adeye:stopping.stop_regret@1", "1", "higher", least=-8.0, most=8.0, since_fault=True)
def stop_regret(series: TraceSeries) -> MetricColumn:
    """Rating of the place where the ego stands, minus the best reachable when the fault began.

    It is negative where the ego went on to a better place than was within reach. It does not apply
    without a fault, or to an ego that does not stand at the end.
    """
    trace = series.trace
    ends, ratings = series.once("stops", lambda: _ends(series))
    fault = _onset(series)
    codes = np.where(fault < 0, np.int8(scans.NOT_APPLICABLE), ends)
    values = np.full(trace.runs, np.nan)
    for run in np.flatnonzero(codes == scans.VALUE).tolist():
        row = int(fault[run])
        if not _is_known(trace, run, row):
            codes[run] = scans.ERROR
            continue
        best = best_rating(trace, run, row, rules_of(trace.layout.architectures[run]))
        values[run] = ratings[run] - best
    return column_of(series, codes, trace.length - 1, values, _touched(trace))


def _ends(series: TraceSeries) -> Ends:
    """Give status and rating (B,) of the places where the runs end."""
    trace = series.trace
    last = trace.length - 1
    every = np.arange(trace.runs)
    touched = _touched(trace) >= 0
    ego, place = series.column("ego")[every, last], series.column("ego_place")[every, last]
    is_known = np.isfinite(ego).all(axis=1) & np.isfinite(place).all(axis=1)
    stands = touched | (np.abs(ego[:, EGO_SPEED]) <= STANDSTILL_SPEED)
    codes = np.select(
        [~is_known & ~touched, stands],
        [np.int8(scans.ERROR), np.int8(scans.VALUE)],
        np.int8(scans.NOT_APPLICABLE),
    )
    values = np.full(trace.runs, np.nan)
    for run in np.flatnonzero(codes == scans.VALUE).tolist():
        values[run] = achieved_rating(trace, run, rules_of(trace.layout.architectures[run]))
    return codes, values


def _touched(trace: Trace) -> NDArray[np.int64]:
    """Give what the ego touches (B,) in the last row of each run, -1 for nothing."""
    last = trace["contact"][np.arange(trace.runs), trace.length - 1]
    return np.asarray(last, dtype=np.int64)


def _is_known(trace: Trace, run: int, row: int) -> bool:
    """Tell whether all that says what was reachable at a row is finite."""
    places = (trace[name][run, row] for name in ("ego", "ego_place", "object_places"))
    objects = trace["objects"][run, row : trace.length[run]]
    return all(np.isfinite(values).all() for values in (*places, objects))
