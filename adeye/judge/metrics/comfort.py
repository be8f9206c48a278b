"""Metrics of comfort, from the recorded state and not from commands."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from adeye.judge.metrics import scans
from adeye.judge.metrics.registry import column_of, metric_entry
from adeye.judge.series import SERIES, TraceSeries, mean_change
from adeye.kernel.jit import allocating
from adeye.ports import MetricColumn
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_SPEED,
    EGO_YAW_RATE,
    PLACE_OFFSET,
    Bytes,
    Floats,
    Ints,
)

# --- Metrics of comfort, from the recorded state and not from commands ----------------------------


LEAST_ACCELERATION: Final = -4.05
MOST_ACCELERATION: Final = 2.40
MOST_LATERAL: Final = 4.89
MOST_LONGITUDINAL_JERK: Final = 4.13
MOST_JERK: Final = 8.37
MOST_YAW_RATE: Final = 0.95
MOST_YAW_ACCELERATION: Final = 1.93
"""What nuPlan takes for comfortable, in SI: exceeding one is not."""

_ACCELERATION, _LATERAL, _JERK, _YAW_RATE, _YAW_ACCELERATION, _TIME = range(6)


@allocating
def worst_comfort(
    length: Ints, ego: Floats, changes: Floats, step: float
) -> tuple[Floats, Ints, Bytes]:
    """Find the largest motions of the ego and the time beyond what is comfortable.

    Args:
        length: (B,) rows that a run has.
        ego: (B, T, 7).
        changes: (3, B, T) of the acceleration along and across [m/s³] and of the yaw rate [rad/s²].
        step: Time between rows [s].

    Returns:
        Values (6, B): acceleration and lateral acceleration [m/s²], jerk in the plane [m/s³], yaw
        rate [rad/s], yaw acceleration [rad/s²], uncomfortable time [s]; rows (6, B) and statuses
        (6, B), the changes ``undefined`` in a run of one row.
    """
    runs = length.shape[0]
    values = np.full((6, runs), -math.inf)
    rows = np.zeros((6, runs), dtype=np.int64)
    codes = np.full((6, runs), scans.UNDEFINED, dtype=np.int8)
    found = np.zeros(6)
    for run in range(runs):
        total = 0.0
        first = -1
        for row in range(length[run]):
            along = ego[run, row, EGO_ACCELERATION]
            rate = ego[run, row, EGO_YAW_RATE]
            across = ego[run, row, EGO_SPEED] * rate
            if not math.isfinite(along + across + rate):
                codes[:, run] = scans.ERROR
                break
            jerk, sideways = changes[0, run, row], changes[1, run, row]
            found[_ACCELERATION] = max(0.0, along)
            found[_LATERAL] = abs(across)
            found[_JERK] = math.sqrt(jerk * jerk + sideways * sideways)
            found[_YAW_RATE] = abs(rate)
            found[_YAW_ACCELERATION] = abs(changes[2, run, row])
            if (
                not LEAST_ACCELERATION <= along <= MOST_ACCELERATION
                or abs(across) > MOST_LATERAL
                or abs(jerk) > MOST_LONGITUDINAL_JERK
                or found[_JERK] > MOST_JERK
                or abs(rate) > MOST_YAW_RATE
                or found[_YAW_ACCELERATION] > MOST_YAW_ACCELERATION
            ):
                total += step
                first = row if first < 0 else first
            for what in range(_TIME):
                is_change = what in (_JERK, _YAW_ACCELERATION)
                if found[what] > values[what, run] and not (is_change and row == 0):
                    values[what, run], rows[what, run] = found[what], row
                    codes[what, run] = scans.VALUE
        if length[run] and codes[_TIME, run] != scans.ERROR:
            values[_TIME, run], rows[_TIME, run], codes[_TIME, run] = total, first, scans.VALUE
    return values, rows, codes


@metric_entry("adeye:comfort.max_acceleration@1", "m/s²", "higher")
def max_acceleration(series: TraceSeries) -> MetricColumn:
    """Largest longitudinal acceleration; 0 if the ego never speeds up."""
    return _column(series, _ACCELERATION)


@metric_entry("adeye:comfort.max_lateral_acceleration@1", "m/s²", "higher")
def max_lateral_acceleration(series: TraceSeries) -> MetricColumn:
    """Largest size of the lateral acceleration, speed times yaw rate."""
    return _column(series, _LATERAL)


@metric_entry("adeye:comfort.max_total_jerk@2", "m/s³", "higher", scale=10.0)
def max_total_jerk(series: TraceSeries) -> MetricColumn:
    """Largest size of the change of the acceleration, along and across, averaged over 1 s."""
    return _column(series, _JERK)


@metric_entry("adeye:comfort.max_yaw_rate@1", "rad/s", "higher", scale=0.1)
def max_yaw_rate(series: TraceSeries) -> MetricColumn:
    """Largest size of the yaw rate."""
    return _column(series, _YAW_RATE)


@metric_entry("adeye:comfort.max_yaw_acceleration@2", "rad/s²", "higher")
def max_yaw_acceleration(series: TraceSeries) -> MetricColumn:
    """Largest size of the change of the yaw rate, averaged over 1 s."""
    return _column(series, _YAW_ACCELERATION)


@metric_entry("adeye:comfort.uncomfortable_time@2", "s", "higher")
def uncomfortable_time(series: TraceSeries) -> MetricColumn:
    """Time with any of the motions beyond the limits of comfort, each row counting one step."""
    return _column(series, _TIME)


def _column(series: TraceSeries, what: int) -> MetricColumn:
    values, rows, codes = series.once("comfort", lambda: _worst(series))
    return column_of(series, codes[what], rows[what], values[what], is_found=rows[what] >= 0)


def _worst(series: TraceSeries) -> tuple[Floats, Ints, Bytes]:
    """Scan the runs."""
    ego, step = series.column("ego"), series.step
    motions = (
        ego[..., EGO_ACCELERATION],
        ego[..., EGO_SPEED] * ego[..., EGO_YAW_RATE],
        ego[..., EGO_YAW_RATE],
    )
    changes = np.stack([mean_change(motion, step) for motion in motions])
    return worst_comfort(series.trace.length, ego, changes, step)


# --- Metrics of how the ego moves: jerk, deceleration, place in the lane --------------------------


@metric_entry("adeye:motion.max_jerk@2", "m/s³", "higher", SERIES["jerk"], scale=10.0)
def max_jerk(series: TraceSeries) -> MetricColumn:
    """Largest size of the change of the longitudinal acceleration, averaged over 1 s."""
    jerk = mean_change(series.column("ego")[..., EGO_ACCELERATION], series.step)
    return _largest(series, jerk, scans.CHANGE)


@metric_entry("adeye:motion.max_deceleration@1", "m/s²", "higher")
def max_deceleration(series: TraceSeries) -> MetricColumn:
    """Largest longitudinal deceleration; 0 if the ego never brakes."""
    return _largest(series, series.column("ego")[..., EGO_ACCELERATION], scans.DECELERATION)


@metric_entry("adeye:motion.max_lane_offset@1", "m", "higher")
def max_lane_offset(series: TraceSeries) -> MetricColumn:
    """Largest distance of the ego's centre from the centre of the nearest lane."""
    return _largest(series, series.column("ego_place")[..., PLACE_OFFSET], scans.SIZE)


def _largest(series: TraceSeries, numbers: Floats, what: int) -> MetricColumn:
    """Reduce what is made of a number (B, T) of the ego to the largest of each run."""
    row, value, codes = scans.worst_motion(series.trace.length, np.ascontiguousarray(numbers), what)
    return column_of(series, codes, row, value)
