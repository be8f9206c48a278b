"""Metrics of what the sensors see: how early an object in the path is detected."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.metrics.registry import (
    ERROR,
    NOT_APPLICABLE,
    VALUE,
    metric_entry,
)
from adeye.evaluation.outcome import last_rows
from adeye.evaluation.stl.series import SampleStatus
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from adeye.evaluation.series import TraceSeries
    from adeye.signals import Bools
    from adeye.trace import Layout


@metric_entry(
    "adeye:perception.first_detection_distance@1",
    "first_detection_distance_m",
    "m",
    "lower",
    "own definition: distance between the bodies at the first detection",
    scale=10.0,
    settles=True,
)
def first_detection_distance(series: TraceSeries) -> MetricColumn:
    """Distance at which a sensor first has the object in the path that is found last.

    Objects count that are the nearest in the path at any row; sensors count that measure
    (everything but ground truth) and are linked to a channel. An object that is never detected is
    found last, at 0 m. Not applicable without such an object or sensor.
    """
    trace = series.trace
    sensors = measuring_sensors(trace.layout)
    gap = series.samples("gap")
    objects = len(trace.layout.context.object_ids)
    is_error = (series.known & (gap.status == SampleStatus.ERROR)).any(axis=1)
    value, time = np.full(trace.runs, np.nan), np.full(trace.runs, np.nan)
    actor = np.full(trace.runs, -1)
    found_last = np.full(trace.runs, -1)
    for index in range(objects if sensors else 0):
        in_path = (series.known & (gap.actor == index)).any(axis=1)
        seen = _detected(series, sensors, index)
        row = np.where(seen.any(axis=1), seen.argmax(axis=1), trace.time.shape[0])
        distance = np.zeros(trace.runs)
        if in_path.any():
            is_seen = row < trace.time.shape[0]
            where = np.where(is_seen, row, 0)
            at_row = series.object_distance_at(index, where, is_seen & in_path)
            distance = np.where(is_seen, at_row, 0.0)
        is_later = in_path & ((row > found_last) | ((row == found_last) & (distance < value)))
        found_last[is_later] = row[is_later]
        value[is_later], actor[is_later] = distance[is_later], index
        time[is_later] = trace.time[np.minimum(row, last_rows(trace))][is_later]
    status = np.select([is_error, actor >= 0], [ERROR, VALUE], NOT_APPLICABLE)
    return MetricColumn(value, tuple(status.tolist()), time, tuple(actor.tolist()))


def measuring_sensors(layout: Layout) -> tuple[int, ...]:
    """Give the indices of the sensors that measure and are linked to a channel."""
    architecture = layout.architecture
    linked = {link for channel in architecture.channels.values() for link in channel.links}
    return tuple(
        index
        for index, name in enumerate(layout.sensors)
        if name in linked and architecture.sensors[name].kind != "ground_truth"
    )


def _detected(series: TraceSeries, sensors: tuple[int, ...], index: int) -> Bools:
    """Tell at which rows (B, T) one of the sensors has an object."""
    detected = np.asarray(series.column("detected")[:, :, list(sensors), index], dtype=np.bool_)
    rows = np.arange(series.trace.time.shape[0])
    decided = rows < last_rows(series.trace)[:, np.newaxis]
    return np.asarray(detected.any(axis=2) & decided)
