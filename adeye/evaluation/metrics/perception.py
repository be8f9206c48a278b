"""Metrics of perception: how early sensors have what matters, and what the channel believes.

The channel is the one that acts without a request: the switch's default. What it believes is judged
at every row, also while another channel acts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.conflict import GAP
from adeye.evaluation.metrics.rear import rear_margins
from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.relevance import (
    POSITION,
    RANGE,
    false_rows,
    pooled_errors,
    worst_latencies,
    worst_missed,
)
from adeye.evaluation.metrics.scans import ERROR, NOT_APPLICABLE, VALUE, as_flags, last_found
from adeye.evaluation.outcome import last_rows
from adeye.kernel.clock import tick_times
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from adeye.evaluation.samples import Shorts
    from adeye.evaluation.series import TraceSeries
    from adeye.signals import Floats, Ints
    from adeye.trace import Layout


@metric_entry(
    "adeye:perception.first_detection_distance@1",
    "first_detection_distance_m",
    "m",
    "lower",
    "own definition: distance between the bodies at the first detection",
    scale=10.0,
    settles=True,
    least=0.0,
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


@metric_entry(
    "adeye:perception.detection_latency@1",
    "detection_latency_s",
    "s",
    "higher",
    "own definition over the stopping sight distance",
    scale=1.0,
)
def detection_latency(series: TraceSeries) -> MetricColumn:
    """Time from when an object first matters until a sensor has it; 0 if one has it before.

    Of several objects the latest counts; one that is never detected counts to the end of the run.
    Not applicable without an object that matters (``relevance``) or a measuring sensor that is
    linked to a channel.
    """
    late, row, thing, codes = worst_latencies(
        *_nearest_in_path(series),
        series.trace.layout.context.object_sizes,
        as_flags(series.column("detected")),
        _sensors(series),
    )
    return column_of(series, codes, row, tick_times(late, series.step), thing)


@metric_entry(
    "adeye:perception.missed_time@1",
    "missed_time_s",
    "s",
    "higher",
    "own definition over the stopping sight distance",
    scale=1.0,
)
def missed_time(series: TraceSeries) -> MetricColumn:
    """Time for which an object that matters is in no confirmed track, each row counting one step.

    Of several objects the one that is missed longest counts; the time is that of the first miss.
    Not applicable without an object that matters or where the channel never shows its tracks.
    """
    channel = _default_channel(series)
    missed, row, thing, codes = worst_missed(
        *_nearest_in_path(series),
        series.trace.layout.context.object_sizes,
        series.column("track_error")[:, :, channel],
    )
    _, _, shown = false_rows(series.trace.length, series.column("false_tracks")[:, :, channel])
    codes = np.where((codes == VALUE) & (shown != VALUE), NOT_APPLICABLE, codes)
    return column_of(series, codes, row, tick_times(missed, series.step), thing)


@metric_entry(
    "adeye:perception.false_track_time@1",
    "false_track_time_s",
    "s",
    "higher",
    "own definition over the stopping sight distance",
    scale=1.0,
)
def false_track_time(series: TraceSeries) -> MetricColumn:
    """Time with a confirmed track of nothing in the corridor, no farther than the ego's reach.

    Each row counts one step. Not applicable where the channel never shows its tracks.
    """
    channel = _default_channel(series)
    wrong, row, codes = false_rows(
        series.trace.length, series.column("false_tracks")[:, :, channel]
    )
    return column_of(series, codes, row, tick_times(wrong, series.step))


@metric_entry(
    "adeye:perception.range_error_rms@1",
    "range_error_rms_m",
    "m",
    "higher",
    "root mean square over the rows with a track",
    scale=1.0,
)
def range_error_rms(series: TraceSeries) -> MetricColumn:
    """Error along the line of sight of the tracks of what is nearest in the path, within reach.

    It compares the centres at the time of the channel's observation; when and who had the largest.
    Not applicable without such a track.
    """
    return _pooled(series, RANGE)


@metric_entry(
    "adeye:perception.position_error_p95@1",
    "position_error_p95_m",
    "m",
    "higher",
    "95th percentile over the rows with a track",
    scale=1.0,
)
def position_error_p95(series: TraceSeries) -> MetricColumn:
    """Distance of the tracks of what is nearest in the path, within reach, from its true place.

    As the range error otherwise.
    """
    return _pooled(series, POSITION)


@metric_entry(
    "adeye:perception.rear_detection_margin@1",
    "rear_detection_margin_m",
    "m",
    "lower",
    "UN R79, 5.6.4.7: critical situation of a lane change",
    scale=10.0,
    settles=True,
)
def rear_detection_margin(series: TraceSeries) -> MetricColumn:
    """Distance at which a sensor has who comes from behind, beyond what a lane change needs.

    Objects count that are faster than the ego, behind it and in the next lane, and were farther
    away than needed at first; one that is never detected while behind is at 0 m. The worst counts.
    Not applicable without such an object or a measuring sensor that is linked to a channel.
    """
    context = series.trace.layout.context
    margin, row, thing, codes = rear_margins(
        series.trace.length,
        series.column("ego"),
        series.column("ego_place"),
        context.ego_size,
        series.column("objects"),
        series.column("object_places"),
        context.object_sizes,
        context.road.lane_width,
        as_flags(series.column("detected")),
        _sensors(series),
    )
    return column_of(series, codes, row, margin, thing)


def _nearest_in_path(series: TraceSeries) -> tuple[Ints, Floats, Shorts, Floats, Floats, Floats]:
    """Give lengths, gap and object of the nearest in the path, ego, friction and objects."""
    values, actors = series.worst_conflicts
    friction = series.trace.layout.context.surroundings.friction
    own, objects = series.column("ego"), series.column("objects")
    return series.trace.length, values[GAP], actors[GAP], own, friction, objects


def _pooled(series: TraceSeries, what: int) -> MetricColumn:
    length, gaps, ahead, own, friction, _ = _nearest_in_path(series)
    errors = series.column("track_error")[:, :, _default_channel(series)]
    value, row, thing, codes = pooled_errors(length, gaps, ahead, own, friction, errors, what)
    return column_of(series, codes, row, value, thing)


def _default_channel(series: TraceSeries) -> int:
    layout = series.trace.layout
    return layout.channels.index(layout.architecture.switch.default)


def _sensors(series: TraceSeries) -> Ints:
    return np.array(measuring_sensors(series.trace.layout), dtype=np.int64)


def measuring_sensors(layout: Layout) -> tuple[int, ...]:
    """Give the indices of the sensors that measure and are linked to a channel."""
    architecture = layout.architecture
    linked = {link for channel in architecture.channels.values() for link in channel.links}
    return tuple(
        index
        for index, name in enumerate(layout.sensors)
        if name in linked and architecture.sensors[name].kind != "ground_truth"
    )
