"""Turn one run of a trace into the replay that a report embeds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from adeye.kernel.refuges import right_edge
from adeye.kernel.road import position
from adeye.report.fan import fan_of
from adeye.report.replay import (
    ActorMotion,
    ChannelView,
    EgoMotion,
    Event,
    FaultView,
    Floats,
    Line,
    Point,
    Replay,
    RoadGeometry,
    SensorView,
    SignalPlot,
    StaticBox,
)
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    EGO_STEERING,
    EGO_X,
    EGO_Y,
    OBJECT_CLASSES,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_S,
    REASON_LABELS,
    REFUGE_LENGTH,
    REFUGE_S,
    REFUGE_TAPER,
    STATUS_LABELS,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from adeye.evaluation.verdict import Outcome
    from adeye.report.parts import Label, RunVerdict
    from adeye.trace import Trace

PLACES = 3
"""Decimals of embedded places and speeds: a millimetre."""
ANGLES = 4
BOUNDARY_STEP = 5.0
"""Longest piece of a drawn lane boundary on a bend [m]."""
_STEP = 0.01
"""Length of a step in a drawn edge [m]."""
VIEW = 150.0
"""How much road is drawn before and behind what the ego drives [m]."""


def replay_of(  # noqa: PLR0913 - what a page says about a run is this much
    trace: Trace,
    run: int,
    *,
    run_id: str,
    architecture: str,
    fault: str,
    parameters: Sequence[Label],
    outcome: Outcome,
    verdicts: Sequence[RunVerdict],
    events: Sequence[Event],
    signals: Sequence[SignalPlot],
    why: str,
    command: str,
) -> Replay:
    """Draw a run.

    Args:
        trace: The batch that it is in.
        run: Its row in the batch.
        run_id: Digest of its result.
        architecture: Id.
        fault: Its fault entry.
        parameters: Swept values for people.
        outcome: What happened to it.
        verdicts: One per FSR.
        events: In order of time.
        signals: Plots, one value per tick.
        why: Why it was selected.
        command: Reproduces it.
    """
    layout = trace.layout
    rows = int(trace.length[run])
    held = np.minimum(np.arange(rows), max(rows - 2, 0))
    return Replay(
        run=run_id,
        scenario=layout.scenario,
        architecture=architecture,
        fault=fault,
        parameters=tuple(parameters),
        outcome=outcome,
        verdicts=tuple(verdicts),
        why=why,
        command=command,
        trace_digest=trace.digests()[run],
        step_s=layout.context.step,
        horizon_s=float(trace.time[trace.horizon_row[run]]),
        road=_road(trace, run, rows),
        ego=_ego(trace, run, rows),
        actors=_actors(trace, run, rows),
        boxes=_boxes(trace, run),
        sensors=_sensors(trace, run, held),
        channels=_channels(trace, run, held),
        faults=_faults(trace, run, held),
        authority=tuple(int(value) for value in trace["authority"][run, held]),
        reason=tuple(REASON_LABELS[int(value)] for value in trace["reason"][run, held]),
        events=tuple(events),
        signals=tuple(signals),
    )


def _floats(values: Any, places: int = PLACES) -> Floats:
    # Adding zero turns -0.0, which rounding makes, into 0.0.
    return tuple(float(value) for value in np.round(values, places) + 0.0)


def _road(trace: Trace, run: int, rows: int) -> RoadGeometry:
    road = trace.layout.context.road
    segments = road.segments[run]
    s = trace["ego_place"][run, :rows, PLACE_S]
    start, end = float(s.min()) - VIEW, float(s.max()) + VIEW
    curved = bool(np.any(segments[:, 4] != 0.0))
    pieces = max(1, math.ceil((end - start) / BOUNDARY_STEP)) if curved else 1
    stations = np.linspace(start, end, pieces + 1)
    width = float(road.lane_width[run])

    def line(
        d: float | Floats, marking: Literal["solid", "dashed", "none"], at: Any = stations
    ) -> Line:
        places = zip(at, np.broadcast_to(d, len(at)), strict=True)
        points = [position(segments, float(station), float(beside)) for station, beside in places]
        return Line(
            marking=marking,
            x_m=_floats([point[0] for point in points]),
            y_m=_floats([point[1] for point in points]),
        )

    edges = [
        line(k * width, "solid" if k in {0, road.lanes} else "dashed")
        for k in range(road.lanes + 1)
    ]
    shoulder, refuges = float(road.shoulder[run]), road.refuges[run]
    at = _with_corners(stations, refuges)
    right = tuple(right_edge(refuges, float(station), shoulder, 0.0) for station in at)
    return RoadGeometry(
        boundaries=tuple(edges),
        shoulder=line(right, "none", at) if min(right) < 0.0 else None,
    )


def _with_corners(stations: NDArray[np.float64], refuges: NDArray[np.float64]) -> Any:
    """Add the corners of parking bays and rest areas (R, 5) to the stations of a line."""
    first = refuges[:, REFUGE_S] - refuges[:, REFUGE_TAPER]
    last = refuges[:, REFUGE_S] + refuges[:, REFUGE_LENGTH]
    # A corner without a taper is a step: a place just outside, and one just inside.
    corners = [first - _STEP, refuges[:, REFUGE_S], last, last + refuges[:, REFUGE_TAPER] + _STEP]
    inside = np.concatenate(corners)
    inside = inside[(inside > stations[0]) & (inside < stations[-1])]
    return np.unique(np.concatenate([stations, inside]))


def _ego(trace: Trace, run: int, rows: int) -> EgoMotion:
    state = trace["ego"][run, :rows]
    length, width, _ = trace.layout.context.ego_size[run]
    return EgoMotion(
        length_m=float(length),
        width_m=float(width),
        wheelbase_m=trace.layout.architecture.vehicle.wheelbase,
        x_m=_floats(state[:, EGO_X]),
        y_m=_floats(state[:, EGO_Y]),
        heading_rad=_floats(state[:, EGO_HEADING], ANGLES),
        speed_mps=_floats(state[:, EGO_SPEED]),
        acceleration_mps2=_floats(state[:, EGO_ACCELERATION]),
        steering_angle_rad=_floats(state[:, EGO_STEERING], ANGLES),
    )


def _actors(trace: Trace, run: int, rows: int) -> tuple[ActorMotion, ...]:
    context = trace.layout.context
    made = []
    for index in range(context.actor_count):
        state = trace["objects"][run, :rows, index]
        length, width, _ = context.object_sizes[run, index]
        made.append(
            ActorMotion(
                id=context.object_ids[index],
                kind=OBJECT_CLASSES[int(context.object_classes[index])],
                length_m=float(length),
                width_m=float(width),
                x_m=_floats(state[:, OBJECT_X]),
                y_m=_floats(state[:, OBJECT_Y]),
                heading_rad=_floats(state[:, OBJECT_HEADING], ANGLES),
                speed_mps=_floats(state[:, OBJECT_SPEED]),
            )
        )
    return tuple(made)


def _boxes(trace: Trace, run: int) -> tuple[StaticBox, ...]:
    context = trace.layout.context
    made = []
    for index in range(context.actor_count, len(context.object_ids)):
        state = trace["objects"][run, 0, index]
        length, width, _ = context.object_sizes[run, index]
        made.append(
            StaticBox(
                id=context.object_ids[index],
                kind=OBJECT_CLASSES[int(context.object_classes[index])],
                length_m=float(length),
                width_m=float(width),
                x_m=float(state[OBJECT_X]),
                y_m=float(state[OBJECT_Y]),
                heading_rad=float(state[OBJECT_HEADING]),
            )
        )
    return tuple(made)


def _sensors(trace: Trace, run: int, held: Any) -> tuple[SensorView, ...]:
    made = []
    for index, (name, spec) in enumerate(trace.layout.architecture.sensors.items()):
        found = trace["detected"][run, held, index]
        places = np.round(trace["detections"][run, held, index], 2) + 0.0
        mount = getattr(spec, "mount", None)
        made.append(
            SensorView(
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


def _points(trace: Trace, run: int, held: Any, name: str) -> tuple[tuple[Point, ...], ...]:
    """Place the returns of a lidar; rows that show one sample share its places."""
    column: Any = trace["points"]
    samples = column[run, held, trace.layout.lidars.index(name)]
    made: list[tuple[Point, ...]] = []
    for row, sample in enumerate(samples):
        if row and np.array_equal(sample, samples[row - 1], equal_nan=True):
            made.append(made[-1])
            continue
        there = np.round(sample[np.isfinite(sample[:, 0])].astype(np.float64), 1) + 0.0
        made.append(tuple((float(x), float(y)) for x, y in there))
    return tuple(made)


def _channels(trace: Trace, run: int, held: Any) -> tuple[ChannelView, ...]:
    made = []
    for index, name in enumerate(trace.layout.channels):
        tracks = trace["tracks"][run, held, index]
        there = np.isfinite(tracks).all(axis=-1)
        rounded = np.round(tracks, 2) + 0.0
        made.append(
            ChannelView(
                id=name,
                acceleration_mps2=_floats(trace["acceleration"][run, held, index]),
                steering_angle_rad=_floats(trace["steering_angle"][run, held, index], ANGLES),
                status=tuple(
                    STATUS_LABELS[int(value)] for value in trace["status"][run, held, index]
                ),
                tracks=tuple(
                    tuple(
                        (
                            float(t[0]),
                            float(t[1]),
                            float(t[2]),
                            float(t[3]),
                            float(t[4]),
                            float(t[5]),
                        )
                        for t in row[mask]
                    )
                    for row, mask in zip(rounded, there, strict=True)
                )
                if there.any()
                else None,
                fan=fan_of(trace, run, index, held),
            )
        )
    return tuple(made)


def _faults(trace: Trace, run: int, held: Any) -> tuple[FaultView, ...]:
    return tuple(
        FaultView(
            id=name,
            text=name,
            active=tuple(bool(value) for value in trace["fault_active"][run, held, index]),
        )
        for index, name in enumerate(trace.layout.faults)
    )
