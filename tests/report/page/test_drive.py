"""One run of a trace as the replay that a page embeds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.judge.verdict import Outcome
from adeye.kernel.road import position
from adeye.report.page.drive import VIEW, replay_of
from adeye.report.page.replay import pack_replay
from adeye.simulate import engine
from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from tests.project import Executed, run_cases

if TYPE_CHECKING:
    from adeye.report.page.replay import Replay
    from adeye.signals import RoadMap
    from adeye.sweep.case import TestCase
    from adeye.trace import Trace


def drawn(trace: Trace, run: int = 0) -> Replay:
    return replay_of(
        trace,
        run,
        run_id="ab" * 32,
        architecture="camera_radar",
        fault="none",
        parameters=(),
        outcome=Outcome.COMPLETED,
        verdicts=(),
        events=(),
        signals=(),
        why="asked for",
        command="adeye replay ab",
    )


@pytest.fixture(scope="module")
def trace(cut_ins: tuple[list[TestCase], Trace]) -> Trace:
    return cut_ins[1]


@pytest.fixture(scope="module")
def replay(trace: Trace) -> Replay:
    return drawn(trace, 1)


def test_everything_that_moves_has_one_value_per_row(replay: Replay, trace: Trace) -> None:
    rows = int(trace.length[1])
    assert len(replay.ego.x_m) == len(replay.actors[0].x_m) == rows
    assert len(replay.authority) == len(replay.reason) == rows
    for sensor in replay.sensors:
        assert len(sensor.alive) == len(sensor.detections) == rows
    for channel in replay.channels:
        assert len(channel.acceleration_mps2) == len(channel.status) == rows


def test_ego_and_actor_are_where_the_trace_says(replay: Replay, trace: Trace) -> None:
    rows = int(trace.length[1])
    assert replay.ego.x_m == pytest.approx(trace["ego"][1, :rows, 0], abs=5e-4)
    assert replay.ego.speed_mps == pytest.approx(trace["ego"][1, :rows, 3], abs=5e-4)
    assert replay.actors[0].id == "cutter"
    assert replay.actors[0].y_m == pytest.approx(trace["objects"][1, :rows, 0, 1], abs=5e-4)
    assert replay.trace_digest == trace.digests()[1]
    assert replay.step_s == 0.05
    assert replay.horizon_s == pytest.approx(12.0)


def test_decisions_of_the_last_row_are_those_of_the_row_before(replay: Replay) -> None:
    # A trace's last row has a scene only.
    for channel in replay.channels:
        assert channel.acceleration_mps2[-1] == channel.acceleration_mps2[-2]
        assert channel.status[-1] == channel.status[-2]
    assert replay.authority[-1] == replay.authority[-2]
    assert replay.faults[0].active[-1] == replay.faults[0].active[-2]


def test_channels_are_named_with_their_states_and_tracks(replay: Replay) -> None:
    assert [channel.id for channel in replay.channels] == ["nominal", "safety"]
    assert "silent" in replay.channels[0].status
    tracks = replay.channels[0].tracks
    assert tracks is not None
    assert max(len(row) for row in tracks) >= 1
    assert {"default", "request"} & set(replay.reason)


def test_sensors_have_their_view_and_what_they_report(replay: Replay, trace: Trace) -> None:
    camera = next(item for item in replay.sensors if item.id == "front_camera")
    assert (camera.kind, camera.range_m, camera.x_m) == ("camera", 120.0, 1.5)
    assert camera.fov_rad == pytest.approx(math.radians(38.0))
    index = trace.layout.sensors.index("front_camera")
    seen = trace["detected"][1, : trace.length[1] - 1, index].sum(axis=1)
    assert [len(points) for points in camera.detections[:-1]] == seen.tolist()
    pose = next(item for item in replay.sensors if item.id == "localisation")
    assert (pose.range_m, pose.fov_rad) == (None, None)


@pytest.mark.slow
def test_what_a_failed_part_gives_instead_of_a_number_is_a_gap(trace: Trace) -> None:
    columns: dict[str, Any] = {name: values.copy() for name, values in trace.columns.items()}
    columns["acceleration"][1, 5, 0], columns["steering_angle"][1, 6, 0] = math.nan, math.inf
    camera = trace.layout.sensors.index("front_camera")
    row = int(np.flatnonzero(columns["detected"][1, :, camera].any(axis=-1))[0])
    there = int(columns["detected"][1, row, camera].sum())
    columns["detections"][1, row, camera] = math.nan
    replay = drawn(replace(trace, columns=columns), 1)
    nominal = replay.channels[0]
    assert (nominal.acceleration_mps2[5], nominal.steering_angle_rad[6]) == (None, None)
    assert (nominal.acceleration_mps2[6], nominal.steering_angle_rad[5]) != (None, None)
    camera_view = next(item for item in replay.sensors if item.id == "front_camera")
    assert there > 0
    assert camera_view.detections[row] == ()
    assert pack_replay(replay)["channels"][0]["acceleration"]["d"][5] is None


def test_fault_is_shown_while_it_is_present(replay: Replay, trace: Trace) -> None:
    assert [fault.id for fault in replay.faults] == ["nominal_silent"]
    first = replay.faults[0].active.index(True)
    assert trace.time[first] == pytest.approx(3.0)


def test_straight_road_is_one_line_per_boundary_around_what_is_driven(
    replay: Replay, trace: Trace
) -> None:
    lines = replay.road.boundaries
    assert [line.marking for line in lines] == ["solid", "dashed", "dashed", "solid"]
    assert all(len(line.x_m) == 2 for line in lines)
    x = trace["ego"][1, : trace.length[1], 0]
    assert lines[0].x_m[0] == pytest.approx(x.min() - VIEW, abs=0.01)
    assert lines[0].x_m[-1] == pytest.approx(x.max() + VIEW, abs=0.01)
    assert [line.y_m[0] for line in lines] == pytest.approx([0.0, 3.5, 7.0, 10.5])
    assert replay.road.shoulder is not None
    assert replay.road.shoulder.y_m[0] == pytest.approx(-3.0)


def changed_road(trace: Trace, **changes: Any) -> Trace:
    road = replace(trace.layout.context.road, **changes)
    context = replace(trace.layout.context, road=road)
    return replace(trace, layout=replace(trace.layout, context=context))


@pytest.mark.slow
def test_returns_of_a_lidar_are_drawn_once_per_sample(mini: Executed) -> None:
    case = mini.plan.cases[0]
    content = case.architecture.model_dump(mode="json")
    content["sensors"]["lidar"] = {
        "kind": "lidar",
        "fidelity": "physical",
        "mount": {"x": 2.0, "z": 0.6},
        "field_of_view": 2.0 * math.pi,
        "range": 150.0,
        "rate": 10.0,
    }
    architecture = Architecture.model_validate(content, context=SI)
    trace = engine.run([replace(case, architecture=architecture, faults=())], drawn=True)
    made = drawn(trace)
    lidar = next(sensor for sensor in made.sensors if sensor.id == "lidar")
    assert lidar.points is not None
    assert len(lidar.points) == made.rows
    assert all(sensor.points is None for sensor in made.sensors if sensor.id != "lidar")
    for row in (40, 41, 80):
        cutter = made.actors[0]
        then = row // 2 * 2
        away = [math.dist(p, (cutter.x_m[then], cutter.y_m[then])) for p in lidar.points[row]]
        assert away
        # All on the outline of the one car that is there, when the sample was made.
        assert 0.8 < min(away) <= max(away) < 2.7
    assert lidar.points[40] == lidar.points[41]
    assert lidar.points[40] != lidar.points[42]


@pytest.mark.slow
def test_bend_is_drawn_in_short_pieces_on_the_arc(trace: Trace) -> None:
    road: RoadMap = trace.layout.context.road
    segments = road.segments.copy()
    segments[:, :, 4] = 1.0 / 800.0
    replay = drawn(changed_road(trace, segments=segments))
    edge = replay.road.boundaries[0]
    pieces = np.hypot(np.diff(edge.x_m), np.diff(edge.y_m))
    assert len(edge.x_m) > 50
    assert pieces.max() <= 5.0 + 1e-3
    x, y, _ = position(segments[0], trace["ego_place"][0, : trace.length[0], 0].min() - VIEW, 0.0)
    assert [edge.x_m[0], edge.y_m[0]] == pytest.approx([x, y], abs=1e-3)


@pytest.mark.slow
def test_road_without_a_shoulder_has_none(trace: Trace) -> None:
    shoulder = np.zeros_like(trace.layout.context.road.shoulder)
    assert drawn(changed_road(trace, shoulder=shoulder)).road.shoulder is None


@pytest.mark.slow
def test_static_objects_are_boxes_and_no_actors(mini: Executed) -> None:
    case = mini.plan.cases[0]
    box = {
        "kind": "parked_truck",
        "s": "300 m",
        "offset": "-1.5 m",
        "length": "10 m",
        "width": "2.5 m",
        "height": "3.8 m",
    }
    content = mini.project.read("scenarios_db/motorway/cut_in.yaml")
    content["world"]["objects"] = {"truck": box}
    scenario = LogicalScenario.model_validate(content)
    made = drawn(run_cases(mini.plan, [replace(case, scenario=scenario)]))
    assert [actor.id for actor in made.actors] == ["cutter"]
    assert [(item.id, item.kind, item.length_m) for item in made.boxes] == [
        ("truck", "parked_truck", 10.0)
    ]
    assert made.boxes[0].y_m == pytest.approx(-1.5)


@pytest.mark.slow
def test_a_bay_is_drawn_with_its_corners(trace: Trace) -> None:
    road = trace.layout.context.road
    runs = road.shoulder.shape[0]
    bays = np.tile([0.0, 200.0, 60.0, 4.0, 20.0], (runs, 1, 1))
    edge = drawn(changed_road(trace, refuges=bays)).road.shoulder
    assert edge is not None
    places = dict(zip(edge.x_m, edge.y_m, strict=True))
    assert (places[200.0], places[260.0]) == (-7.0, -7.0)
    assert (places[179.99], places[280.01]) == (-3.0, -3.0)
    bare = drawn(changed_road(trace, refuges=bays, shoulder=np.zeros(runs))).road.shoulder
    assert bare is not None
    assert min(bare.y_m) == -4.0
