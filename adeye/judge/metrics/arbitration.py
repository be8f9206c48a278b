"""Metrics of arbitration: how far the channels disagree, whoever of them acts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.judge.metrics.handling import decided_rows, default_channel
from adeye.judge.metrics.registry import CODES, UNDEFINED, column_of, metric_entry
from adeye.judge.metrics.scans import NOT_APPLICABLE, VALUE
from adeye.signals import FAULT, SILENT

if TYPE_CHECKING:
    from adeye.judge.series import TraceSeries
    from adeye.ports import MetricColumn
    from adeye.signals import Bools


@metric_entry(
    "adeye:arbitration.acceleration_disagreement@1",
    "m/s²",
    "higher",
    column="max_acceleration_disagreement_mps2",
)
def acceleration_disagreement(series: TraceSeries) -> MetricColumn:
    """Largest difference of the accelerations that the default and another channel command.

    Rows count at which both have a command: neither silent nor in fault, and finite.
    """
    return _largest(series, "acceleration")


@metric_entry(
    "adeye:arbitration.steering_disagreement@1",
    "rad",
    "higher",
    column="max_steering_disagreement_rad",
    scale=0.1,
)
def steering_disagreement(series: TraceSeries) -> MetricColumn:
    """Largest difference of the steering angles that the default and another channel command.

    Rows count at which both have a command: neither silent nor in fault, and finite.
    """
    return _largest(series, "steering_angle")


def _largest(series: TraceSeries, name: str) -> MetricColumn:
    """Reduce the distance of the default channel's numbers (B, T, C) from the others'."""
    trace, numbers = series.trace, series.column(name)
    runs, default = np.arange(trace.runs), default_channel(trace)
    if numbers.shape[-1] == 1:
        return column_of(series, np.full(trace.runs, NOT_APPLICABLE), runs, np.zeros(trace.runs))
    others = np.arange(numbers.shape[-1]) != default
    has_both = series.once("commands", lambda: _commands(series))
    has_both = has_both[..., others] & has_both[..., [default]]
    apart = np.abs(numbers[..., others] - numbers[..., [default]])
    worst = np.where(has_both, apart, -1.0).max(axis=-1)
    row = worst.argmax(axis=1)
    value = worst[runs, row]
    return column_of(series, np.where(value < 0.0, CODES[UNDEFINED], VALUE), row, value)


def _commands(series: TraceSeries) -> Bools:
    """Tell which channels have a command (B, T, C)."""
    status = series.column("status")
    is_finite = np.isfinite(series.column("acceleration"))
    is_finite &= np.isfinite(series.column("steering_angle"))
    decided = decided_rows(series.trace)[..., np.newaxis]
    return np.asarray((status != SILENT) & (status != FAULT) & is_finite & decided)
