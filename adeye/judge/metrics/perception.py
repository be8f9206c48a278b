"""Metrics of perception: how early sensors have what matters, and what the channel believes.

The channel is the one that acts without a request: the switch's default. What it believes is judged
at every row, also while another channel acts.

An object *matters* at a row if it is the nearest in the path, no farther than the ego gets before
it can stand (``kernel.encounter``), and half of its extent is to be seen from the ego's centre.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.judge.conflict import are_finite
from adeye.judge.metrics.handling import default_channel
from adeye.judge.metrics.registry import StatusColumn, column_of, metric_entry, object_entry
from adeye.judge.metrics.scans import ERROR, INCOMPLETE, NOT_APPLICABLE, VALUE, as_flags
from adeye.judge.outcome import last_rows
from adeye.kernel.boxes import box_distance, box_of
from adeye.kernel.encounter import reachable_distance
from adeye.kernel.jit import allocating, inlined
from adeye.kernel.relation import tick_times
from adeye.kernel.road import Grounds, ground_of, lane_way, lane_width
from adeye.kernel.sight import visible_fraction
from adeye.ports import MetricColumn
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    OBJECT_ACCELERATION,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
)
from adeye.trace import NO_TRACKS

if TYPE_CHECKING:
    from adeye.judge.conflict import Scene
    from adeye.judge.series import TraceSeries
    from adeye.signals import Bools, Bytes, Floats, Ints, Shorts
    from adeye.trace import Layout


# --- Compiled: which objects matter, since when, and whether sensors and channel have them --------

LEAST_SEEN: Final = 0.5
"""Share of an object's extent that must be to be seen for it to matter. Our choice, as the usual
``min_visible`` of sensors."""


@inlined
def matters(
    gap: float,
    thing: int,
    ego: Floats,
    friction: float,
    objects: Floats,
    sizes: Floats,
) -> bool:
    """Tell whether the nearest object in the path matters at a row, see the module.

    Args:
        gap: To it [m].
        thing: Index of it, -1 for none.
        ego: (7,).
        friction: Of the road.
        objects: (M, 5).
        sizes: (M, 3).
    """
    if thing < 0 or not gap <= reachable_distance(ego[EGO_SPEED], friction):
        return False
    return bool(visible_fraction(ego[EGO_X], ego[EGO_Y], thing, objects, sizes) >= LEAST_SEEN)


@allocating
def worst_latencies(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    scene: Scene,
    horizon: Ints,
    gaps: Floats,
    ahead: Shorts,
    friction: Floats,
    detected: Bools,
    sensors: Ints,
) -> tuple[Ints, Ints, Ints, Bytes]:
    """Find the object that a sensor has latest after it first mattered.

    Args:
        scene: The runs.
        horizon: (B,) last row at which an obligation begins: what matters by then and is never
            detected leaves the run incomplete.
        gaps: (B, T) to the nearest object in the path [m].
        ahead: (B, T) that object, -1 for none.
        friction: (B,).
        detected: (B, T, S, M).
        sensors: Those that count.

    Returns:
        Rows (B,) from mattering to detection, 0 if it was detected before; rows (B,) of the
        detection, the last one if there is none; objects (B,); and statuses (B,).
    """
    length, ego, _, _, objects, _, sizes, _ = scene
    runs = length.shape[0]
    late, rows = np.zeros(runs, dtype=np.int64), np.zeros(runs, dtype=np.int64)
    worst = np.full(runs, -1, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    since = np.zeros(objects.shape[2], dtype=np.int64)
    for run in range(runs):
        since[:] = -1
        for row in range(length[run]):
            thing = ahead[run, row]
            if not gaps[run, row] > -math.inf:
                codes[run] = ERROR
            # Of the last row nothing is decided, so nothing can be detected at it.
            elif (
                row < length[run] - 1
                and thing >= 0
                and since[thing] < 0
                and matters(
                    gaps[run, row], thing, ego[run, row], friction[run], objects[run, row],
                    sizes[run],
                )
            ):  # fmt: skip
                since[thing] = row
        if codes[run] == ERROR or sensors.shape[0] == 0:
            continue
        for thing in range(objects.shape[2]):
            if since[thing] >= 0:
                first = _first_detection(detected[run], sensors, thing, length[run] - 1)
                after = max(0, first - since[thing])
                if after > late[run] or worst[run] < 0:
                    late[run], rows[run], worst[run] = after, max(first, since[thing]), thing
                is_open = first == length[run] - 1 and since[thing] <= horizon[run]
                if codes[run] != INCOMPLETE:
                    codes[run] = INCOMPLETE if is_open else VALUE
    return late, rows, worst, codes


@inlined
def _first_detection(detected: Bools, sensors: Ints, thing: int, end: int) -> int:
    """Return the first row (T, S, M) at which a sensor has an object, ``end`` if none has."""
    for row in range(end):
        for place in range(sensors.shape[0]):
            if detected[row, sensors[place], thing]:
                return row
    return end


@allocating
def last_found(  # noqa: C901 - a kernel over the whole scene
    scene: Scene, gaps: Floats, ahead: Shorts, detected: Bools, sensors: Ints
) -> tuple[Ints, Floats, Ints, Bools]:
    """Find the object in the path that the sensors have last, and how near it was then.

    Args:
        scene: The runs.
        gaps: (B, T) to the nearest object in the path [m].
        ahead: (B, T) that object, -1 for none.
        detected: (B, T, S, M).
        sensors: Those that count.

    Returns:
        Rows (B,) of the first detection, distances (B,) there [m], NaN where they cannot be told,
        objects (B,), -1 for none, and whether a gap is an error (B,). An object that is never
        detected has row T and distance 0.
    """
    length, ego, ego_place, ego_size, objects, places, sizes, contact = scene
    runs, never = gaps.shape[0], gaps.shape[1]
    rows = np.full(runs, -1, dtype=np.int64)
    distances = np.full(runs, math.nan)
    found = np.full(runs, -1, dtype=np.int64)
    is_error = np.zeros(runs, dtype=np.bool_)
    in_path = np.zeros(objects.shape[2], dtype=np.bool_)
    for run in range(runs):
        in_path[:] = False
        for row in range(length[run]):
            if not gaps[run, row] > -math.inf:
                is_error[run] = True
            if ahead[run, row] >= 0:
                in_path[ahead[run, row]] = True
        if sensors.shape[0] == 0:
            continue
        for thing in range(objects.shape[2]):
            if not in_path[thing]:
                continue
            first = _first_detection(detected[run], sensors, thing, length[run] - 1)
            if first == length[run] - 1:
                first = never
            distance = 0.0
            if first < never and contact[run, first] != thing:
                own, own_place = ego[run, first], ego_place[run, first]
                other, where = objects[run, first, thing], places[run, first, thing]
                own_size, size = ego_size[run], sizes[run, thing]
                distance = math.nan
                if are_finite(
                    own[EGO_X], own[EGO_Y], own[EGO_HEADING], own[EGO_SPEED],
                    own[EGO_ACCELERATION], own_place[PLACE_S], own_place[PLACE_D],
                    own_place[PLACE_HEADING], own_size[0], own_size[1],
                ) and are_finite(
                    other[OBJECT_X], other[OBJECT_Y], other[OBJECT_HEADING], other[OBJECT_SPEED],
                    other[OBJECT_ACCELERATION], where[PLACE_S], where[PLACE_D],
                    where[PLACE_HEADING], size[0], size[1],
                ):  # fmt: skip
                    distance = box_distance(box_of(own, own_size), box_of(other, size))
            if first > rows[run] or (first == rows[run] and distance < distances[run]):
                rows[run], distances[run], found[run] = first, distance, thing
    return rows, distances, found, is_error


@allocating
def worst_missed(  # noqa: C901 - a kernel over the whole scene
    scene: Scene, gaps: Floats, ahead: Shorts, friction: Floats, errors: Floats
) -> tuple[Ints, Ints, Ints, Bytes]:
    """Find the object that matters at most rows without being tracked.

    Args:
        scene: The runs.
        gaps: (B, T) to the nearest object in the path [m].
        ahead: (B, T) that object, -1 for none.
        friction: (B,).
        errors: (B, T, M, 2) of the channel's tracks [m], NaN for an object without one.

    Returns:
        Rows (B,) at which it is missed, the first of them (B,), the object (B,) and statuses (B,):
        ``not_applicable`` where none matters.
    """
    length, ego, _, _, objects, _, sizes, _ = scene
    runs = length.shape[0]
    most, rows = np.zeros(runs, dtype=np.int64), np.zeros(runs, dtype=np.int64)
    worst = np.full(runs, -1, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    # Of each object: at how many rows it is missed, -1 before it matters, and the first of them.
    missed = np.zeros(objects.shape[2], dtype=np.int64)
    first = np.zeros(objects.shape[2], dtype=np.int64)
    for run in range(runs):
        missed[:] = -1
        first[:] = 0
        for row in range(length[run] - 1):
            thing = ahead[run, row]
            if not gaps[run, row] > -math.inf:
                codes[run] = ERROR
            if thing < 0:
                continue
            is_tracked = math.isfinite(errors[run, row, thing, 0])
            if is_tracked and missed[thing] >= 0:
                continue
            if matters(
                gaps[run, row], thing, ego[run, row], friction[run], objects[run, row], sizes[run]
            ):
                missed[thing] = max(0, missed[thing])
                if not is_tracked:
                    first[thing] = row if missed[thing] == 0 else first[thing]
                    missed[thing] += 1
        if codes[run] == ERROR:
            continue
        for thing in range(objects.shape[2]):
            if missed[thing] > most[run] or (missed[thing] == 0 and worst[run] < 0):
                most[run], rows[run], worst[run] = missed[thing], first[thing], thing
                codes[run] = VALUE
    return most, rows, worst, codes


@allocating
def false_rows(length: Ints, false: Bytes) -> tuple[Ints, Ints, Bytes]:
    """Count the rows with a false track.

    Args:
        length: (B,) rows that a run has.
        false: (B, T) false tracks, ``NO_TRACKS`` where the channel shows none.

    Returns:
        Rows (B,), the first of them (B,) and statuses (B,): ``not_applicable`` where the channel
        never shows its tracks.
    """
    runs = length.shape[0]
    counts, rows = np.zeros(runs, dtype=np.int64), np.zeros(runs, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    for run in range(runs):
        for row in range(length[run] - 1):
            if false[run, row] != NO_TRACKS:
                codes[run] = VALUE
            if false[run, row] > 0:
                if counts[run] == 0:
                    rows[run] = row
                counts[run] += 1
    return counts, rows, codes


RANGE, POSITION = range(2)
"""What ``pooled_errors`` makes of the errors: root mean square along the line of sight, 95th
percentile of the distance."""


@allocating
def pooled_errors(
    scene: Scene, gaps: Floats, ahead: Shorts, friction: Floats, errors: Floats, what: int
) -> tuple[Floats, Ints, Ints, Bytes]:
    """Pool the errors of the tracks of what is nearest in the path and within the ego's reach.

    Args:
        scene: The runs.
        gaps: (B, T) to the nearest object in the path [m].
        ahead: (B, T) that object, -1 for none.
        friction: (B,).
        errors: (B, T, M, 2) of the channel's tracks [m], NaN for an object without one.
        what: ``RANGE`` or ``POSITION``.

    Returns:
        Pooled errors (B,) [m], rows (B,) with the largest, its objects (B,) and statuses (B,):
        ``not_applicable`` where no such object is tracked.
    """
    length, ego = scene.length, scene.ego
    runs = length.shape[0]
    values, rows = np.zeros(runs), np.zeros(runs, dtype=np.int64)
    worst = np.full(runs, -1, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    sizes = np.zeros(gaps.shape[1])
    for run in range(runs):
        count, most, total = 0, -1.0, 0.0
        for row in range(length[run] - 1):
            gap, thing = gaps[run, row], ahead[run, row]
            if not gap > -math.inf:
                codes[run] = ERROR
                break
            if thing < 0 or not gap <= reachable_distance(ego[run, row, EGO_SPEED], friction[run]):
                continue
            along, across = errors[run, row, thing, 0], errors[run, row, thing, 1]
            if not math.isfinite(along + across):
                continue
            size = abs(along)
            if what == POSITION:
                size = math.sqrt(along * along + across * across)
            sizes[count] = size
            total += size * size
            count += 1
            if size > most:
                most, rows[run], worst[run] = size, row, thing
        if count and codes[run] != ERROR:
            codes[run] = VALUE
            values[run] = math.sqrt(total / count)
            if what == POSITION:
                ordered = np.sort(sizes[:count])
                # The least value that 95 of 100 do not exceed.
                values[run] = ordered[(95 * count + 99) // 100 - 1]
    return values, rows, worst, codes


# --- Compiled: how far away sensors have who comes from behind in the next lane -------------------

REAR_RESPONSE: Final = 0.4
REAR_BRAKING: Final = 3.0
REAR_TIME_GAP: Final = 1.0
"""What UN R79, 5.6.4.7 grants who comes from behind when the ego changes
lanes: 0.4 s to respond, 3 m/s² of braking, and at its end 1 s of the ego's speed as distance."""

NEXT_LANE: Final = 1.5
"""Lateral distance of centres up to which a vehicle is in the next lane [lane widths]."""


@allocating
def rear_margins(
    scene: Scene, grounds: Grounds, detected: Bools, sensors: Ints
) -> tuple[Floats, Ints, Ints, Bytes]:
    """Find who comes from behind in the next lane and is seen latest for what a lane change needs.

    Whoever is nearer than that from the start does not count: no sensor could have seen it.

    Args:
        scene: The runs.
        grounds: Their roads.
        detected: (B, T, S, M).
        sensors: Those that count.

    Returns:
        Distance behind the ego at the first detection less the critical one (B,) [m], with 0 for
        the distance of who is never detected while behind; rows (B,), objects (B,), statuses (B,).
    """
    length, ego, ego_place, ego_size, objects, places, sizes, _ = scene
    runs = length.shape[0]
    margins, rows = np.full(runs, math.inf), np.zeros(runs, dtype=np.int64)
    worst = np.full(runs, -1, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    for run in range(runs):
        for thing in range(objects.shape[2]):
            could_be_seen = is_seen = False
            margin, last = math.inf, 0
            for row in range(length[run] - 1):
                behind, critical = _approach(
                    grounds, run, ego[run, row], ego_place[run, row], ego_size[run],
                    objects[run, row, thing], places[run, row, thing], sizes[run, thing],
                )  # fmt: skip
                if math.isnan(behind):
                    codes[run] = ERROR
                    break
                for place in range(sensors.shape[0]):
                    is_seen |= detected[run, row, sensors[place], thing]
                if behind <= 0.0:
                    continue
                could_be_seen |= behind > critical
                margin, last = -critical, row
                if is_seen:
                    margin = behind - critical
                    break
            if could_be_seen and margin < margins[run]:
                margins[run], rows[run], worst[run] = margin, last, thing
        if worst[run] >= 0 and sensors.shape[0] > 0 and codes[run] != ERROR:
            codes[run] = VALUE
    return margins, rows, worst, codes


@inlined
def _approach(  # noqa: PLR0913, PLR0917 - a part of the kernel
    grounds: Grounds,
    run: int,
    own: Floats,
    place: Floats,
    size: Floats,
    other: Floats,
    other_place: Floats,
    other_size: Floats,
) -> tuple[float, float]:
    """Return how far behind the ego somebody faster in the next lane is, and what is critical [m].

    Returns:
        The distance along the lane of the other, 0 for everybody else, NaN with a number that is
        not finite; and the critical distance of ``REAR_RESPONSE`` and its fellows.
    """
    if not are_finite(
        own[EGO_SPEED], place[PLACE_S], place[PLACE_D], size[0], size[1],
        other[OBJECT_SPEED], other_place[PLACE_S], other_place[PLACE_D], other_size[0],
        other[OBJECT_X] + other[OBJECT_Y] + other[OBJECT_HEADING] + other_size[1],
    ):  # fmt: skip
        return math.nan, math.nan
    # Who comes from behind drives the way, so that it is as long as on that lane.
    behind = lane_way(
        other_place[PLACE_S], other_place[PLACE_HEADING], other_place[PLACE_D],
        place[PLACE_S], place[PLACE_HEADING],
    ) - 0.5 * (size[0] + other_size[0])  # fmt: skip
    beside = abs(place[PLACE_D] - other_place[PLACE_D])
    closing = other[OBJECT_SPEED] - own[EGO_SPEED]
    width = lane_width(ground_of(grounds, run), place[PLACE_S], place[PLACE_D])
    is_next = 0.5 * (size[1] + other_size[1]) <= beside < NEXT_LANE * width
    if behind <= 0.0 or closing <= 0.0 or not is_next:
        return 0.0, 0.0
    braked = closing * closing / (2.0 * REAR_BRAKING)
    return behind, closing * REAR_RESPONSE + braked + own[EGO_SPEED] * REAR_TIME_GAP


# --- Metrics of perception: how early sensors have what matters, and what the channel believes ----


@object_entry("adeye:perception.first_detection_distance@1", "m", "lower", scale=10.0, settles=True)
def first_detection_distance(series: TraceSeries) -> MetricColumn:
    """Distance at which a sensor first has the object in the path that is found last.

    Objects count that are the nearest in the path at any row; sensors count that measure
    (everything but ground truth) and are linked to a channel. An object that is never detected is
    found last, at 0 m. Not applicable without such an object or sensor.
    """
    trace = series.trace
    row, distance, found, is_error = last_found(series.scene, *series.nearest, *_sensed(series))
    codes = np.select([is_error, found >= 0], [ERROR, VALUE], NOT_APPLICABLE)
    row = np.minimum(row, last_rows(trace))
    column = column_of(series, codes, row, distance)
    # An error, too, tells who was looked at, and when.
    time = np.where(found >= 0, trace.time[row], np.nan)
    return MetricColumn(column.value, column.status, time, found)


@object_entry("adeye:perception.detection_latency@2", "s", "higher")
def detection_latency(series: TraceSeries) -> MetricColumn:
    """Time from when an object first matters until a sensor has it; 0 if one has it before.

    Of several objects the latest counts; one that is never detected counts to the end of the run.
    It is incomplete where such a one mattered by the horizon, and then the least that it can be.
    Not applicable without an object that matters (``relevance``) or a measuring sensor that is
    linked to a channel.
    """
    late, row, thing, codes = worst_latencies(
        series.scene,
        series.trace.horizon_row,
        *series.nearest,
        _friction(series),
        *_sensed(series),
    )
    found = column_of(
        series,
        np.where(codes == INCOMPLETE, VALUE, codes),
        row,
        tick_times(late, series.step),
        thing,
    )
    return replace(found, status=StatusColumn(codes))


@object_entry("adeye:perception.missed_time@1", "s", "higher")
def missed_time(series: TraceSeries) -> MetricColumn:
    """Time for which an object that matters is in no confirmed track, each row counting one step.

    Of several objects the one that is missed longest counts; the time is that of the first miss.
    Not applicable without an object that matters or where the channel never shows its tracks.
    """
    missed, row, thing, codes = worst_missed(
        series.scene, *series.nearest, _friction(series), _shown(series, "track_error")
    )
    _, _, shown = false_rows(series.trace.length, _shown(series, "false_tracks"))
    codes = np.where((codes == VALUE) & (shown != VALUE), NOT_APPLICABLE, codes)
    return column_of(series, codes, row, tick_times(missed, series.step), thing)


@metric_entry("adeye:perception.false_track_time@1", "s", "higher")
def false_track_time(series: TraceSeries) -> MetricColumn:
    """Time with a confirmed track of nothing in the corridor, no farther than the ego's reach.

    Each row counts one step. Not applicable where the channel never shows its tracks.
    """
    wrong, row, codes = false_rows(series.trace.length, _shown(series, "false_tracks"))
    return column_of(series, codes, row, tick_times(wrong, series.step))


@object_entry("adeye:perception.range_error_rms@1", "m", "higher")
def range_error_rms(series: TraceSeries) -> MetricColumn:
    """Error along the line of sight of the tracks of what is nearest in the path, within reach.

    It compares the centres at the time of the channel's observation; when and who had the largest.
    Not applicable without such a track.
    """
    return _pooled(series, RANGE)


@object_entry("adeye:perception.position_error_p95@1", "m", "higher")
def position_error_p95(series: TraceSeries) -> MetricColumn:
    """Distance of the tracks of what is nearest in the path, within reach, from its true place.

    As the range error otherwise.
    """
    return _pooled(series, POSITION)


@object_entry(
    "adeye:perception.rear_detection_margin@1", "m", "lower", scale=10.0, settles=True, least=None
)
def rear_detection_margin(series: TraceSeries) -> MetricColumn:
    """Distance at which a sensor has who comes from behind, beyond what a lane change needs.

    Objects count that are faster than the ego, behind it and in the next lane, and were farther
    away than needed at first; one that is never detected while behind is at 0 m. The worst counts.
    Not applicable without such an object or a measuring sensor that is linked to a channel.
    """
    grounds = series.trace.layout.context.road.grounds()
    margin, row, thing, codes = rear_margins(series.scene, grounds, *_sensed(series))
    return column_of(series, codes, row, margin, thing)


def _pooled(series: TraceSeries, what: int) -> MetricColumn:
    value, row, thing, codes = pooled_errors(
        series.scene, *series.nearest, _friction(series), _shown(series, "track_error"), what
    )
    return column_of(series, codes, row, value, thing)


def _shown(series: TraceSeries, column: str) -> Any:
    """Return a column of the default channel, one row behind the other as kernels are compiled."""
    return np.ascontiguousarray(series.column(column)[:, :, default_channel(series.trace)])


def _friction(series: TraceSeries) -> Floats:
    return series.trace.layout.context.surroundings.friction


def _sensed(series: TraceSeries) -> tuple[Bools, Ints]:
    """Give what sensors detect (B, T, S, M), and which of them count."""
    sensors = np.array(measuring_sensors(series.trace.layout), dtype=np.int64)
    return as_flags(series.column("detected")), sensors


def measuring_sensors(layout: Layout) -> tuple[int, ...]:
    """Give the indices of the sensors that measure and are linked to a channel."""
    architecture = layout.architecture
    linked = {link for channel in architecture.channels.values() for link in channel.links}
    return tuple(
        index
        for index, name in enumerate(layout.sensors)
        if name in linked and architecture.sensors[name].kind != "ground_truth"
    )
