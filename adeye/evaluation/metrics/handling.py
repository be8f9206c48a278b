"""Metrics of how a fault is handled: how soon another channel acts, how soon the ego is safe.

They count from the first row at which a fault is present, and are not applicable without one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.metrics.registry import (
    ERROR,
    INCOMPLETE,
    NOT_APPLICABLE,
    VALUE,
    metric_entry,
)
from adeye.evaluation.outcome import last_rows
from adeye.evaluation.source import TraceSignals
from adeye.evaluation.stl.series import SampleStatus
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from adeye.evaluation.series import TraceSeries
    from adeye.signals import Bools, Ints
    from adeye.trace import Layout


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
    signals = TraceSignals(series.trace, np.ones(series.trace.runs, dtype=np.bool_))
    safe = signals.series("safe_state")
    is_error = (series.known & (np.asarray(safe.status) == SampleStatus.ERROR)).any(axis=1)
    unsafe = series.known & ~np.asarray(safe.values, dtype=np.bool_)
    # The row after the last unsafe one.
    last_unsafe = safe.values.shape[1] - 1 - unsafe[:, ::-1].argmax(axis=1)
    held_from = np.where(unsafe.any(axis=1), last_unsafe + 1, 0)
    is_held = np.asarray(held_from <= last_rows(series.trace))
    return _since_fault(series, held_from, is_held, is_error)


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
    authority = series.column("authority")
    before = authority[np.arange(trace.runs), np.maximum(onset - 1, 0)]
    # With a fault from the start, the channel that acts without a request is the one before.
    before = np.where(onset == 0, _default_channel(trace.layout), before)
    rows = np.arange(trace.time.shape[0])
    has_other = _decided(series) & (rows >= onset[:, np.newaxis])
    has_other &= authority != before[:, np.newaxis]
    nothing = np.zeros(trace.runs, dtype=np.bool_)
    is_reached = np.asarray(has_other.any(axis=1))
    return _since_fault(series, has_other.argmax(axis=1), is_reached, nothing)


def _default_channel(layout: Layout) -> int:
    return layout.channels.index(layout.architecture.switch.default)


def _decided(series: TraceSeries) -> Bools:
    """Tell which rows (B, T) hold a decision: all but the last of each run."""
    rows = np.arange(series.trace.time.shape[0])
    return np.asarray(rows < last_rows(series.trace)[:, np.newaxis])


def _active(series: TraceSeries) -> Bools:
    """Tell at which rows (B, T) a fault is present."""
    active = np.asarray(series.column("fault_active"), dtype=np.bool_)
    return np.asarray(active.any(axis=2) & _decided(series))


def _onset(series: TraceSeries) -> Ints:
    return np.asarray(_active(series).argmax(axis=1))


def _since_fault(
    series: TraceSeries, row: Ints, is_reached: Bools, is_error: Bools
) -> MetricColumn:
    """Give the time from the first fault to a row, 0 if it lies before.

    Args:
        series: Series of the trace.
        row: (B,) when it was reached.
        is_reached: (B,) whether it was.
        is_error: (B,) whether that cannot be told.
    """
    trace = series.trace
    has_fault = _active(series).any(axis=1)
    onset = _onset(series)
    status = np.select(
        [is_error, ~has_fault, is_reached], [ERROR, NOT_APPLICABLE, VALUE], INCOMPLETE
    )
    has_value = status == VALUE
    reached = np.maximum(np.where(has_value, row, 0), onset)
    nothing = np.full(trace.runs, np.nan)
    return MetricColumn(
        np.where(has_value, trace.time[reached] - trace.time[onset], nothing),
        tuple(status.tolist()),
        np.where(has_value, trace.time[reached], nothing),
        (-1,) * trace.runs,
    )
