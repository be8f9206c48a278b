"""Metrics of how the ego moves: jerk, deceleration, place in the lane."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.metrics.registry import extreme, metric_entry
from adeye.evaluation.series import SERIES, Samples, TraceSeries
from adeye.evaluation.stl.series import SampleStatus
from adeye.signals import EGO_ACCELERATION, PLACE_OFFSET, Floats

if TYPE_CHECKING:
    from adeye.ports import MetricColumn


@metric_entry(
    "adeye:motion.max_jerk@1", "max_jerk_mps3", "m/s³", "higher", SERIES["jerk"].source, scale=10.0
)
def max_jerk(series: TraceSeries) -> MetricColumn:
    """Largest size of the change of the longitudinal acceleration."""
    jerk = series.samples("jerk")
    return extreme(series, Samples(np.abs(jerk.values), jerk.status, jerk.actor), "higher")


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
    acceleration = series.column("ego")[..., EGO_ACCELERATION]
    return extreme(series, _samples(np.maximum(-acceleration, 0.0)), "higher")


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
    offset = series.column("ego_place")[..., PLACE_OFFSET]
    return extreme(series, _samples(np.abs(offset)), "higher")


def _samples(values: Floats) -> Samples:
    status = np.where(np.isfinite(values), SampleStatus.VALUE, SampleStatus.ERROR)
    return Samples(values, status.astype(np.int8), np.full(values.shape, -1, dtype=np.int64))
