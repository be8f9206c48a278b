"""Metrics of how a fault is handled: how soon another channel acts, how soon the ego is safe.

They count from the first row at which a fault is present, and are not applicable without one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

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
from adeye.evaluation.metrics.statuses import CODES, INCOMPLETE
from adeye.evaluation.road import on_road
from adeye.evaluation.source import STANDSTILL_SPEED
from adeye.signals import EGO_SPEED, PLACE_D

if TYPE_CHECKING:
    from adeye.evaluation.series import TraceSeries
    from adeye.ports import MetricColumn
    from adeye.signals import Bools, Ints


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
    default = trace.layout.channels.index(trace.layout.architecture.switch.default)
    row = first_takeovers(trace.length, onset, series.column("authority"), default)
    return _since_fault(series, onset, row, row >= 0, np.zeros(trace.runs, dtype=np.bool_))


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
