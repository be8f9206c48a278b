"""Metrics of what the sensors see: how early an object in the path is detected."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.conflict import GAP
from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.scans import ERROR, NOT_APPLICABLE, VALUE, as_flags, last_found
from adeye.evaluation.outcome import last_rows
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from adeye.evaluation.series import TraceSeries
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
    trace, context = series.trace, series.trace.layout.context
    values, actors = series.worst_conflicts
    row, distance, found, is_error = last_found(
        trace.length,
        values[GAP],
        actors[GAP],
        as_flags(series.column("detected")),
        np.array(measuring_sensors(trace.layout), dtype=np.int64),
        series.column("ego"),
        series.column("ego_place"),
        context.ego_size,
        series.column("objects"),
        series.column("object_places"),
        context.object_sizes,
        series.column("contact"),
    )
    codes = np.select([is_error, found >= 0], [ERROR, VALUE], NOT_APPLICABLE)
    column = column_of(series, codes, np.minimum(row, last_rows(trace)), distance, found)
    # An error, too, tells who was looked at, and when.
    time = np.where(found >= 0, trace.time[np.minimum(row, last_rows(trace))], np.nan)
    return MetricColumn(column.value, column.status, time, found)


def measuring_sensors(layout: Layout) -> tuple[int, ...]:
    """Give the indices of the sensors that measure and are linked to a channel."""
    architecture = layout.architecture
    linked = {link for channel in architecture.channels.values() for link in channel.links}
    return tuple(
        index
        for index, name in enumerate(layout.sensors)
        if name in linked and architecture.sensors[name].kind != "ground_truth"
    )
