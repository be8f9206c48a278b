"""Metrics of how the ego moves: jerk, deceleration, place in the lane."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.scans import CHANGE, DECELERATION, SIZE, worst_motion
from adeye.evaluation.series import SERIES, TraceSeries, mean_change
from adeye.signals import EGO_ACCELERATION, PLACE_OFFSET, Floats

if TYPE_CHECKING:
    from adeye.ports import MetricColumn


@metric_entry(
    "adeye:motion.max_jerk@2", "max_jerk_mps3", "m/s³", "higher", SERIES["jerk"].source, scale=10.0
)
def max_jerk(series: TraceSeries) -> MetricColumn:
    """Largest size of the change of the longitudinal acceleration, averaged over 1 s."""
    jerk = mean_change(series.column("ego")[..., EGO_ACCELERATION], series.step)
    return _worst(series, jerk, CHANGE)


@metric_entry(
    "adeye:motion.max_deceleration@1",
    "max_deceleration_mps2",
    "m/s²",
    "higher",
    "recorded state",
    scale=1.0,
)
def max_deceleration(series: TraceSeries) -> MetricColumn:
    """Largest longitudinal deceleration; 0 if the ego never brakes."""
    return _worst(series, series.column("ego")[..., EGO_ACCELERATION], DECELERATION)


@metric_entry(
    "adeye:motion.max_lane_offset@1",
    "max_lane_offset_m",
    "m",
    "higher",
    "recorded state",
    scale=1.0,
)
def max_lane_offset(series: TraceSeries) -> MetricColumn:
    """Largest distance of the ego's centre from the centre of the nearest lane."""
    return _worst(series, series.column("ego_place")[..., PLACE_OFFSET], SIZE)


def _worst(series: TraceSeries, numbers: Floats, what: int) -> MetricColumn:
    """Reduce what is made of a number (B, T) of the ego to the largest of each run."""
    row, value, codes = worst_motion(series.trace.length, numbers, what)
    return column_of(series, codes, row, value)
