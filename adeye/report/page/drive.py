"""Turn one run of a trace into the replay that a report embeds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from adeye import signals as columns
from adeye.exchange.road_lines import VIEW, RoadLine, road_lines
from adeye.judge.grid import OBJECTS, TRUTH, GridMap, grid_at
from adeye.judge.metrics import METRICS
from adeye.judge.safe_stop import ratings_of
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.series import SampleStatus, Series
from adeye.judge.trace_signals import TraceSignals
from adeye.report.page import replay as drawn
from adeye.spec.channels import SafetyChannel
from adeye.spec.concept import Requirement
from adeye.spec.grid import GridSettings, rating_costs
from adeye.store.records import VerdictRecord
from adeye.trace import NO_TRACKS, Trace

# --- The trajectories that a channel chose from, as the replay draws them -------------------------

FAN_PERIOD: Final = 0.5
"""Time between two fans that are drawn [s]: each tick would make a run ten times as large."""

FAN_PLACES: Final = 1
"""Decimals of embedded places: a decimetre, less than a pixel of the view."""

WORTHLESS: Final = 1000.0
"""Cost above the best from which a candidate is not desirable at all: that of a collision."""


def fan_of(trace: Trace, run: int, channel: int, held: Any) -> drawn.FanView | None:
    """Return the fans of a channel that are drawn.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        channel: Index of the channel.
        held: (rows,) row of the trace that each row of the replay shows.

    Returns:
        None for a channel that shows none.
    """
    costs = trace["candidate_costs"][run, :, channel]
    if not np.isfinite(costs[held]).any():
        return None
    every = max(1, round(FAN_PERIOD / trace.layout.context.step))
    fans = tuple(
        _fan(
            trace["candidates"][run, row, channel],
            costs[row],
            int(trace["chosen"][run, row, channel]),
        )
        for row in held[::every]
    )
    return drawn.FanView(every=every, fans=fans)


def _fan(places: Any, costs: Any, chosen: int) -> tuple[drawn.Candidate, ...]:
    """List the candidates, the least desirable first and the chosen one last."""
    there = np.isfinite(places).all(axis=(1, 2)) & ~np.isnan(costs)
    least = float(costs[there].min()) if there.any() else 0.0
    rounded = np.round(places.astype(np.float64), FAN_PLACES) + 0.0
    order = sorted(np.flatnonzero(there), key=lambda row: (row == chosen, -costs[row], row))
    return tuple(
        drawn.Candidate(
            desirability=round(desirability(float(costs[row]), least), 2),
            is_chosen=bool(row == chosen),
            # The first place is that of the ego, which is known.
            points=tuple((float(x), float(y)) for x, y in rounded[row, 1:]),
        )
        for row in order
    )


def desirability(cost: float, least: float) -> float:
    """Return how desirable a candidate is, from 1 for the best down to 0; logarithmic.

    Args:
        cost: Infinity for one that limits of vehicle or road, or others on it, forbid.
        least: Cost of the best.

    >>> desirability(2.0, 2.0), round(desirability(12.0, 2.0), 2), desirability(math.inf, 2.0)
    (1.0, 0.65, 0.0)
    """
    if math.isinf(cost):
        return 0.0
    beyond = cost - least
    return max(0.0, 1.0 - math.log1p(max(0.0, beyond)) / math.log1p(WORTHLESS))


# --- The grid map of a run as the replay draws it: ratings of the ground, and when it is occupied -

GRID_PERIOD: Final = 0.25
"""Time between two maps of the ground that are drawn [s]; it does not move, the window does."""

MOST: Final = 60_000
"""Characters of all maps of a run, kept to by drawing fewer of those of what moves."""

TIMES: Final = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Times to occupancy that are told apart [s]; up to the first the cell is occupied now."""


def grid_of(trace: Trace, run: int, held: Any) -> drawn.GridView:
    """Return the grid maps of a run that are drawn.

    The objects are those of the safety channel, or the truth where it shows no tracks. Numbers are
    its ratings of the ground.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        held: (rows,) row of the trace that each row of the replay shows.
    """
    every = max(1, math.ceil(GRID_PERIOD / trace.layout.context.step - 1e-6))
    ratings = ratings_of(trace.layout.architectures[run])
    ground = rating_costs(ratings).model_copy(update={"rules": ()})
    settings = GridSettings(costs=ground)
    view = view_of(trace, run)
    rows = range(len(held))
    grounds = [grid_at(trace, run, row, settings, layers=["number"]) for row in rows[::every]]
    levels = sorted({float(value) for item in grounds for value in np.unique(item["number"])})
    number = packed([np.searchsorted(levels, item["number"]) for item in grounds])
    room = MOST - sum(len(text) for text in number)
    codes = [
        occupancy(grid_at(trace, run, row, settings, view=view, layers=OBJECTS)) for row in rows
    ]
    for occupied_every in range(1, every + 1):
        occupied = packed(codes[::occupied_every])
        if sum(len(text) for text in occupied) <= room:
            break
    first = grounds[0]
    return drawn.GridView(
        every=every,
        occupied_every=occupied_every,
        view=view,
        cell_m=first.cell,
        x_m=float(first.x[0]) - 0.5 * first.cell,
        y_m=float(first.y[0]) - 0.5 * first.cell,
        columns=len(first.x),
        rows=len(first.y),
        levels=tuple(levels),
        worst=ground.blocked,
        times_s=TIMES,
        number=number,
        occupied=occupied,
    )


def view_of(trace: Trace, run: int) -> str:
    """Return whose objects are drawn: the first safety channel's that shows tracks, or the truth.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
    """
    channels = trace.layout.architecture.channels
    for index, name in enumerate(trace.layout.channels):
        shows = trace["false_tracks"][run, : trace.length[run], index] != NO_TRACKS
        if isinstance(channels.get(name), SafetyChannel) and shows.any():
            return name
    return TRUTH


def occupancy(found: GridMap) -> NDArray[np.int64]:
    """Return by which of ``TIMES`` each cell is occupied, counted from 1; 0 for never."""
    times = np.where(found["static"] > 0.0, 0.0, found["time_to_occupancy"])
    code = np.searchsorted(np.array(TIMES), times) + 1
    return np.where(code > len(TIMES), 0, code)


def packed(maps: Sequence[NDArray[Any]]) -> tuple[str, ...]:
    """Pack the codes of the cells of maps as one text each.

    Cells follow one another from the back to the front, and rows from the right to the left. Each
    code is taken exclusive-or with that of the cell to its right, because lanes are long rows, and
    equal ones are counted: a letter for the code, ``a`` for 0, and how often it repeats, if more
    than once. Where that is shorter, a map is first taken exclusive-or with the one before; its
    text begins with a plus.

    Args:
        maps: (X, Y) codes from 0 to 15.

    >>> one, other = np.array([[1, 1], [1, 1], [0, 2]]), np.array([[1, 1], [1, 1], [2, 0]])
    >>> packed([one, other, other])
    ('b2a3c', 'b2ca2c', '+a6')
    """
    made = []
    before: NDArray[Any] | None = None
    for codes in maps:
        text = _runs(codes)
        if before is not None:
            change = f"+{_runs(codes ^ before)}"
            text = change if len(change) < len(text) else text
        made.append(text)
        before = codes
    return tuple(made)


def _runs(codes: NDArray[Any]) -> str:
    rows = codes.T
    changed = rows.copy()
    changed[1:] ^= rows[:-1]
    flat = changed.ravel()
    starts = np.flatnonzero(np.diff(flat, prepend=-1))
    counts = np.diff(starts, append=len(flat))
    return "".join(
        f"{chr(ord('a') + code)}{count if count > 1 else ''}"
        for code, count in zip(flat[starts].tolist(), counts.tolist(), strict=True)
    )


# --- Turn one run of a trace into the replay that a report embeds ---------------------------------

PLACES = 3
"""Decimals of embedded places and speeds: a millimetre."""
ANGLES = 4


def replay_of(trace: Trace, row: int, **said: Any) -> drawn.Replay:
    """Draw a run.

    Args:
        trace: The batch that it is in.
        row: Of the run in the batch.
        said: What the replay says of it that no trace has: its architecture, why it is shown, …
    """
    layout = trace.layout
    rows = int(trace.length[row])
    held = np.minimum(np.arange(rows), max(rows - 2, 0))
    return drawn.Replay(
        **said,
        scenario=layout.scenario,
        trace_digest=trace.digests()[row],
        step_s=layout.context.step,
        horizon_s=float(trace.time[trace.horizon_row[row]]),
        left_hand=layout.context.road.left_hand,
        road=_road(trace, row, rows),
        ego=_ego(trace, row, rows),
        actors=_actors(trace, row, rows),
        boxes=_boxes(trace, row),
        sensors=_sensors(trace, row, held),
        channels=_channels(trace, row, held),
        grid=grid_of(trace, row, held),
        faults=_faults(trace, row, held),
        authority=tuple(int(value) for value in trace["authority"][row, held]),
        reason=tuple(columns.REASON_LABELS[int(value)] for value in trace["reason"][row, held]),
    )


def _floats(values: Any, places: int = PLACES) -> drawn.Floats:
    # Adding zero turns -0.0, which rounding makes, into 0.0.
    return tuple(float(value) for value in np.round(values, places) + 0.0)


def _gaps(values: Any, places: int = PLACES) -> drawn.Gaps:
    """Round as ``_floats``; None where a failed channel gave no finite number."""
    rounded = np.round(values, places) + 0.0
    return tuple(float(value) if np.isfinite(value) else None for value in rounded)


def _road(trace: Trace, run: int, rows: int) -> drawn.RoadGeometry:
    ground = trace.layout.context.road.ground(run)
    s = trace["ego_place"][run, :rows, columns.PLACE_S]
    found = road_lines(ground, float(s.min()) - VIEW, float(s.max()) + VIEW)

    def line(item: RoadLine) -> drawn.Line:
        x, y = item.places.T
        return drawn.Line(marking=item.marking, x_m=_floats(x), y_m=_floats(y))

    return drawn.RoadGeometry(
        boundaries=tuple(map(line, found.boundaries)),
        shoulder=None if found.shoulder is None else line(found.shoulder),
    )


def _ego(trace: Trace, run: int, rows: int) -> drawn.EgoMotion:
    state = trace["ego"][run, :rows]
    length, width, _ = trace.layout.context.ego_size[run]
    return drawn.EgoMotion(
        length_m=float(length),
        width_m=float(width),
        wheelbase_m=trace.layout.architecture.vehicle.wheelbase,
        x_m=_floats(state[:, columns.EGO_X]),
        y_m=_floats(state[:, columns.EGO_Y]),
        heading_rad=_floats(state[:, columns.EGO_HEADING], ANGLES),
        speed_mps=_floats(state[:, columns.EGO_SPEED]),
        acceleration_mps2=_floats(state[:, columns.EGO_ACCELERATION]),
        steering_angle_rad=_floats(state[:, columns.EGO_STEERING], ANGLES),
    )


def _body(trace: Trace, run: int, index: int) -> dict[str, Any]:
    """Say of an object what it is and how large."""
    context = trace.layout.context
    length, width, _ = context.object_sizes[run, index]
    return {
        "id": context.object_ids[index],
        "kind": columns.OBJECT_CLASSES[int(context.object_classes[index])],
        "length_m": float(length),
        "width_m": float(width),
    }


def _actors(trace: Trace, run: int, rows: int) -> tuple[drawn.ActorMotion, ...]:
    made = []
    for index in range(trace.layout.context.actor_count):
        state = trace["objects"][run, :rows, index]
        made.append(
            drawn.ActorMotion(
                **_body(trace, run, index),
                x_m=_floats(state[:, columns.OBJECT_X]),
                y_m=_floats(state[:, columns.OBJECT_Y]),
                heading_rad=_floats(state[:, columns.OBJECT_HEADING], ANGLES),
                speed_mps=_floats(state[:, columns.OBJECT_SPEED]),
            )
        )
    return tuple(made)


def _boxes(trace: Trace, run: int) -> tuple[drawn.StaticBox, ...]:
    context = trace.layout.context
    made = []
    for index in range(context.actor_count, len(context.object_ids)):
        state = trace["objects"][run, 0, index]
        made.append(
            drawn.StaticBox(
                **_body(trace, run, index),
                x_m=float(state[columns.OBJECT_X]),
                y_m=float(state[columns.OBJECT_Y]),
                heading_rad=float(state[columns.OBJECT_HEADING]),
            )
        )
    return tuple(made)


def _sensors(trace: Trace, run: int, held: Any) -> tuple[drawn.SensorView, ...]:
    made = []
    for index, (name, spec) in enumerate(trace.layout.architecture.sensors.items()):
        places = np.round(trace["detections"][run, held, index], 2) + 0.0
        # A failed sensor reports places that are no numbers.
        found = trace["detected"][run, held, index] & np.isfinite(places).all(axis=-1)
        mount = getattr(spec, "mount", None)
        made.append(
            drawn.SensorView(
                id=name,
                kind=spec.kind,
                x_m=mount.x if mount else 0.0,
                y_m=mount.y if mount else 0.0,
                yaw_rad=mount.yaw if mount else 0.0,
                fov_rad=getattr(spec, "field_of_view", None),
                range_m=getattr(spec, "range", None),
                alive=tuple(bool(value) for value in trace["sensor_alive"][run, held, index]),
                detections=tuple(
                    tuple((float(x), float(y)) for x, y in points[mask])
                    for points, mask in zip(places, found, strict=True)
                ),
                points=_points(trace, run, held, name) if name in trace.layout.lidars else None,
            )
        )
    return tuple(made)


def _points(trace: Trace, run: int, held: Any, name: str) -> tuple[tuple[drawn.Point, ...], ...]:
    """Place the returns of a lidar; rows that show one sample share its places."""
    column: Any = trace["points"]
    samples = column[run, held, trace.layout.lidars.index(name)]
    made: list[tuple[drawn.Point, ...]] = []
    for row, sample in enumerate(samples):
        if row and np.array_equal(sample, samples[row - 1], equal_nan=True):
            made.append(made[-1])
            continue
        there = np.round(sample[np.isfinite(sample[:, 0])].astype(np.float64), 1) + 0.0
        made.append(tuple((float(x), float(y)) for x, y in there))
    return tuple(made)


def _channels(trace: Trace, run: int, held: Any) -> tuple[drawn.ChannelView, ...]:
    made = []
    for index, name in enumerate(trace.layout.channels):
        tracks = trace["tracks"][run, held, index]
        there = np.isfinite(tracks).all(axis=-1)
        rounded = np.round(tracks, 2) + 0.0
        made.append(
            drawn.ChannelView(
                id=name,
                acceleration_mps2=_gaps(trace["acceleration"][run, held, index]),
                steering_angle_rad=_gaps(trace["steering_angle"][run, held, index], ANGLES),
                status=tuple(
                    columns.STATUS_LABELS[int(value)] for value in trace["status"][run, held, index]
                ),
                tracks=tuple(
                    tuple(tuple(track) for track in row[mask].tolist())
                    for row, mask in zip(rounded, there, strict=True)
                )
                if there.any()
                else None,
                fan=fan_of(trace, run, index, held),
            )
        )
    return tuple(made)


def _faults(trace: Trace, run: int, held: Any) -> tuple[drawn.FaultView, ...]:
    active = trace["fault_active"][run, held]
    return tuple(
        drawn.FaultView(id=name, text=name, active=tuple(active[:, index].tolist()))
        for index, name in enumerate(trace.layout.faults)
    )


# --- The signals of a run that a report plots: what every run has, and what its verdicts are
# about.

ALWAYS = (
    "ego.speed",
    "ego.acceleration",
    "any_actor.distance",
    "ttc",
    "time_headway",
    "required_deceleration",
    "ego.lane_offset",
)
"""Signals that are plotted for every run, where it has them."""

MAX_PLOTS = 14
DECIMALS = 3
NUMBER = "number"


def plots_of(
    signals: TraceSignals,
    run: int,
    requirements: Iterable[Requirement],
    verdicts: Mapping[str, VerdictRecord],
    only: Sequence[str] = (),
) -> tuple[drawn.SignalPlot, ...]:
    """Choose and cut the signals of one run.

    Args:
        signals: Of the trace that the run is in.
        run: Its row.
        requirements: FSRs that were judged on it.
        verdicts: Their verdicts, by FSR.
        only: The signals; by default those that the FSRs are about.
    """
    lines: dict[str, list[drawn.ThresholdLine]] = {}
    names = dict.fromkeys(name for name in ALWAYS if name in signals.dictionary)
    for item in requirements:
        record = verdicts.get(item.id)
        if record is None:
            continue
        for name in _signals(item):
            if name in signals.dictionary:
                names[name] = None
        if record.signal is not None and record.threshold is not None:
            line = _line(item, record)
            if line is not None:
                plotted = item.bound and _series_of(item.bound.metric)
                lines.setdefault(plotted or record.signal, []).append(line)
    chosen = only or list(names)[:MAX_PLOTS]
    return tuple(_plot(signals.series(name), name, signals, run, lines) for name in chosen)


def _signals(item: Requirement) -> Iterator[str]:
    if item.formula is not None:
        yield from sorted(parse_formula(item.formula, parameters=item.constants).names)
    elif item.bound is not None:
        series = _series_of(item.bound.metric)
        if series is not None:
            yield series


def _series_of(metric: str) -> str | None:
    """Name the series that a metric is the extreme of, if it is one.

    >>> _series_of("max_required_deceleration_mps2")
    'required_deceleration'
    """
    if metric not in METRICS:
        return None
    stem = metric.removeprefix("min_").removeprefix("max_").rpartition("_")[0]
    known = {
        "ttc": "ttc",
        "time_headway": "time_headway",
        "drac": "drac",
        "required_deceleration": "required_deceleration",
        "distance": "any_actor.distance",
        "jerk": "jerk",
        "lane_offset": "ego.lane_offset",
    }
    return known.get(stem)


def _line(item: Requirement, record: VerdictRecord) -> drawn.ThresholdLine | None:
    assert record.threshold is not None
    if item.bound is not None:
        side = "at_least" if item.bound.at_least is not None else "at_most"
    elif record.predicate and ">" in record.predicate:
        side = "at_least"
    elif record.predicate and "<" in record.predicate:
        side = "at_most"
    else:
        return None
    return drawn.ThresholdLine.model_validate(
        {"fsr": item.id, "value": record.threshold, "side": side}
    )


def _plot(
    series: Series,
    name: str,
    signals: TraceSignals,
    run: int,
    lines: Mapping[str, list[drawn.ThresholdLine]],
) -> drawn.SignalPlot:
    rows = int(signals.trace.length[run])
    values = np.asarray(series.values[run, :rows], dtype=np.float64)
    known = np.isfinite(values)
    if series.status is not None:
        known &= series.status[run, :rows] == SampleStatus.VALUE
    rounded = np.round(values, DECIMALS) + 0.0
    kind = signals.dictionary[name]
    labels = kind.labels if kind.kind != NUMBER else ()
    if kind.kind == "boolean":
        labels = ("false", "true")
    return drawn.SignalPlot(
        name=name,
        unit="" if kind.unit == "1" else kind.unit,
        values=tuple(
            float(value) if is_known else None
            for value, is_known in zip(rounded, known, strict=True)
        ),
        labels=labels,
        thresholds=tuple(lines.get(name, ())) if kind.kind == NUMBER else (),
        cap=kind.cap,
    )
