"""A run on the page: what its trace holds, packed for replay."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.campaign.replay import Execution, rerun
from adeye.exchange.road_lines import VIEW
from adeye.judge.grid import grid_at
from adeye.judge.series import SERIES
from adeye.judge.verdict import Outcome
from adeye.kernel.road import position
from adeye.report.page import drive
from adeye.report.page.replay import Replay, SignalPlot, pack_replay
from adeye.signals import REASON_LABELS, RoadMap
from adeye.simulate import engine
from adeye.spec.architecture import Architecture
from adeye.spec.concept import MetricBound, Requirement
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from adeye.store.records import VerdictRecord
from adeye.store.repository import Repository
from adeye.sweep.case import TestCase
from adeye.trace import NO_TRACKS, Trace
from tests.judge.conftest import HandMade
from tests.project import Executed, run_cases
from tests.stored import known


def drawn(trace: Trace, run: int = 0) -> Replay:
    return drive.replay_of(
        trace,
        run,
        run="ab" * 32,
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


def test_last_tick_decides_and_nothing_is_minus_zero(trace: Trace) -> None:
    one = trace.select([1])
    last = int(one.length[0]) - 2
    one["reason"][0, last - 1 :] = [0, 1, 2]
    one["ego"][0, :, 1] = -1e-5
    made = drawn(one)
    assert made.reason[last - 1 :] == tuple(REASON_LABELS[reason] for reason in (0, 1, 1))
    assert {str(y) for y in made.ego.y_m} == {"0.0"}


def test_channels_are_named_with_their_states_and_tracks(replay: Replay) -> None:
    assert [channel.id for channel in replay.channels] == ["nominal", "safety"]
    assert "silent" in replay.channels[0].status
    tracks = known(replay.channels[0].tracks)
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
    assert known(replay.road.shoulder).y_m[0] == pytest.approx(-3.0)


def changed_road(trace: Trace, **changes: Any) -> Trace:
    road = replace(trace.layout.context.road, **changes)
    context = replace(trace.layout.context, road=road)
    return replace(trace, layout=replace(trace.layout, context=context))


LIDAR = {"kind": "lidar", "fidelity": "physical", "mount": {"x": 2.0, "z": 0.6}, "range": 150.0}


@pytest.mark.slow
def test_returns_of_a_lidar_are_drawn_once_per_sample(mini: Executed) -> None:
    case = mini.plan.cases[0]
    content = case.architecture.model_dump(mode="json")
    content["sensors"]["lidar"] = {**LIDAR, "field_of_view": 2.0 * math.pi, "rate": 10.0}
    architecture = Architecture.model_validate(content, context=SI)
    trace = engine.run([replace(case, architecture=architecture, faults=())], drawn=True)
    made = drawn(trace)
    points = {sensor.id: sensor.points for sensor in made.sensors}
    returns = known(points.pop("lidar"))
    assert set(points.values()) == {None}
    assert len(returns) == made.rows
    cutter = made.actors[0]
    for row in (40, 41, 80):
        then = row // 2 * 2
        away = [math.dist(place, (cutter.x_m[then], cutter.y_m[then])) for place in returns[row]]
        assert away
        # All on the outline of the one car that is there, when the sample was made.
        assert 0.8 < min(away) <= max(away) < 2.7
    assert returns[40] == returns[41] != returns[42]


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


def test_road_without_a_shoulder_has_none(trace: Trace) -> None:
    shoulder = np.zeros_like(trace.layout.context.road.shoulder)
    assert drawn(changed_road(trace, shoulder=shoulder)).road.shoulder is None


def test_static_objects_are_boxes_and_no_actors(mini: Executed) -> None:
    content = mini.project.read("scenarios_db/motorway/cut_in.yaml")
    size = {"length": "10 m", "width": "2.5 m", "height": "3.8 m"}
    truck = {"kind": "parked_truck", "s": "300 m", "offset": "-1.5 m", **size}
    content["world"]["objects"] = {"truck": truck}
    scenario = LogicalScenario.model_validate(content)
    made = drawn(run_cases(mini.plan, [replace(mini.plan.cases[0], scenario=scenario)]))
    assert [actor.id for actor in made.actors] == ["cutter"]
    (box,) = made.boxes
    assert (box.id, box.kind, box.length_m) == ("truck", "parked_truck", 10.0)
    assert box.y_m == pytest.approx(-1.5)


def test_a_bay_is_drawn_with_its_corners(trace: Trace) -> None:
    road = trace.layout.context.road
    runs = road.shoulder.shape[0]
    bays = np.tile([0.0, 200.0, 60.0, 4.0, 20.0], (runs, 1, 1))
    edge = known(drawn(changed_road(trace, refuges=bays)).road.shoulder)
    places = dict(zip(edge.x_m, edge.y_m, strict=True))
    assert (places[200.0], places[260.0]) == (-7.0, -7.0)
    assert (places[179.99], places[280.01]) == (-3.0, -3.0)
    bare = known(drawn(changed_road(trace, refuges=bays, shoulder=np.zeros(runs))).road.shoulder)
    assert min(bare.y_m) == -4.0


def unpacked(texts: tuple[str, ...], columns: int, rows: int) -> list[Any]:
    """Read back what ``packed`` wrote, as the page does."""
    made: list[Any] = []
    for text in texts:
        codes = [
            ord(letter) - ord("a")
            for letter, count in re.findall(r"([a-p])(\d*)", text)
            for _ in range(int(count or 1))
        ]
        cells = np.bitwise_xor.accumulate(np.array(codes).reshape(rows, columns), axis=0)
        made.append(cells ^ made[-1] if text.startswith("+") else cells)
    return made


def driving(**more: Any) -> Trace:
    """Let a car that the safety channel sees come nearer, on the lane of the ego."""
    made = HandMade(rows=21, **more)
    made.columns["tracks"][0, :, 1, 0] = [14.0, 0.0, 10.0, 0.0, 4.0, 2.0]
    return made.trace()


HELD = np.minimum(np.arange(21), 19)


def test_packed_maps_read_back_and_an_equal_one_costs_next_to_nothing() -> None:
    random = np.random.default_rng(5)
    for shape in ((1, 1), (7, 3), (3, 7), (40, 20)):
        maps = [random.integers(0, 16, shape) for _ in range(4)]
        maps.append(maps[-1])
        again = unpacked(drive.packed(maps), *shape)
        assert all(np.array_equal(one.T, other) for one, other in zip(again, maps, strict=True))
    cells = random.integers(0, 9, (150, 70))
    assert drive.packed([cells, cells])[1] == "+a10500"


def test_drawn_maps_are_those_of_the_run() -> None:
    trace = driving()
    view = drive.grid_of(trace, 0, HELD)
    # 0.25 s and 0.1 s, at steps of 0.1 s.
    assert (view.every, len(view.number)) == (3, 7)
    assert (view.occupied_every, len(view.occupied)) == (1, 21)
    number = unpacked(view.number, view.columns, view.rows)
    occupied = unpacked(view.occupied, view.columns, view.rows)
    for row in range(21):
        found = grid_at(trace, 0, row, view="safety")
        assert np.array_equal(occupied[row].T, drive.occupancy(found))
        if row % 3 == 0:
            is_free = found["time_to_occupancy"] > 0.0
            levels = np.array(view.levels)[number[row // 3].T]
            assert np.array_equal(levels[is_free], found["number"][is_free])
    assert (view.x_m, view.y_m, view.cell_m) == (-25.0, -17.5, 0.5)


def test_maps_of_a_run_are_small_and_fewer_where_they_are_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    trace = driving()
    whole = drive.grid_of(trace, 0, HELD)
    size = sum(len(text) for text in (*whole.number, *whole.occupied))
    # On a straight road, a few bytes for each.
    assert size < 100 * len(whole.number)
    monkeypatch.setattr("adeye.report.page.drive.MOST", size - 1)
    fewer = drive.grid_of(trace, 0, HELD)
    assert fewer.occupied_every == 2
    assert fewer.number == whole.number
    assert len(fewer.occupied) == 11


def test_occupied_now_and_later_are_told_apart() -> None:
    found = grid_at(driving(), 0, 0, view="safety")
    code = drive.occupancy(found)
    assert (code == 1).sum() == 32
    times = found["time_to_occupancy"]
    for index in range(1, len(drive.TIMES)):
        within = (times > drive.TIMES[index - 1]) & (times <= drive.TIMES[index])
        assert np.array_equal(code == index + 1, within)
    assert np.array_equal(code == 0, np.isinf(times))


def test_static_object_is_occupied_now() -> None:
    made = HandMade().object("lead", s=14.0, speed=0.0).ego(s=0.0)
    trace = made.trace()
    context = replace(trace.layout.context, actor_count=0)
    trace = replace(trace, layout=replace(trace.layout, context=context))
    assert (drive.occupancy(grid_at(trace, 0, 0)) == 1).sum() == 32


def test_view_is_the_safety_channel_that_shows_tracks_or_the_truth() -> None:
    made = HandMade()
    assert drive.view_of(made.trace(), 0) == "safety"
    made.columns["false_tracks"][:, :, 1] = NO_TRACKS
    assert drive.view_of(made.trace(), 0) == "truth"
    assert drive.grid_of(made.trace(), 0, HELD).view == "truth"


@pytest.fixture(scope="module")
def done(mini: Executed) -> Execution:
    """A cut-in of the candidate whose nominal channel falls silent."""
    row = next(
        row
        for row in mini.project.rows()
        if (row["fault_entry"], row["architecture"]) == ("nominal_silent", "camera_radar")
    )
    with Repository.open(mini.db, create=False) as repository:
        return rerun(repository, repository.find_run(row["run"]))


@pytest.fixture
def fsrs(mini: Executed) -> dict[str, Requirement]:
    return {item.id: item for item in mini.plan.files.concept.spec.requirements}


def plots(
    done: Execution, requirements: list[Requirement], **changed: VerdictRecord
) -> dict[str, SignalPlot]:
    """Plot with the stored verdicts, or others."""
    stored = {item.fsr_id: item for item in done.stored.verdicts} | {
        name.replace("_", "-"): record for name, record in changed.items()
    }
    made = drive.plots_of(done.signals, 0, requirements, stored)
    assert len({item.name for item in made}) == len(made)
    return {item.name: item for item in made}


def test_what_every_run_has_is_plotted_first_in_si_and_what_is_judged_is_added(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    plain = plots(done, [])
    assert list(plain) == list(drive.ALWAYS)
    speed = plain["ego.speed"]
    assert speed.unit == "m/s"
    assert speed.values == tuple(np.round(done.trace["ego"][0, : len(speed.values), 3], 3) + 0.0)
    # An axis ends where a larger value says no more.
    assert plain["ttc"].cap == SERIES["ttc"].type.cap
    assert plain["required_deceleration"].cap is None
    # No conflict is a gap and never a number.
    numbers = [value for value in plain["ttc"].values if value is not None]
    assert 0 < len(numbers) < len(plain["ttc"].values)
    assert all(np.isfinite(numbers))
    found = plots(done, [fsrs["FSR-03"]])
    assert {"channel.nominal.status", "authority.safety"} <= set(found)
    assert found["channel.nominal.status"].labels[-1] == "silent"
    assert found["authority.safety"].labels == ("false", "true")
    assert set(found["authority.safety"].values) == {0.0, 1.0, None}
    every = plots(done, list(fsrs.values()))
    assert len(every) <= drive.MAX_PLOTS
    for item in every.values():
        assert len(item.values) == int(done.trace.length[0])
    # Without a verdict, or of no extreme of a series, it adds nothing.
    unjudged = fsrs["FSR-03"].model_copy(update={"id": "FSR-99"})
    contact = MetricBound(metric="contact", at_most=0.0)
    bound = fsrs["FSR-02"].model_copy(update={"bound": contact})
    for requirement in (unjudged, bound):
        assert list(plots(done, [requirement])) == list(drive.ALWAYS)


def test_bound_of_a_metric_is_drawn_on_the_series_that_it_is_the_extreme_of(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    line = plots(done, [fsrs["FSR-02"]])["required_deceleration"].thresholds
    assert [(item.fsr, item.value, item.side) for item in line] == [("FSR-02", 6.0, "at_most")]


def test_threshold_of_the_binding_predicate_is_drawn_with_its_side(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    lane = plots(done, [fsrs["FSR-06"]])["ego.lane_offset"].thresholds
    assert [(item.value, item.side) for item in lane] in ([(0.6, "at_most")], [])
    record = next(item for item in done.stored.verdicts if item.fsr_id == "FSR-06")
    stop = replace(
        record,
        fsr_id="FSR-05",
        signal="ego.acceleration",
        predicate="ego.acceleration >= -4.5 m/s^2",
        threshold=-4.5,
    )
    drawn = plots(done, [fsrs["FSR-05"]], FSR_05=stop)["ego.acceleration"].thresholds
    assert [(item.fsr, item.value, item.side) for item in drawn] == [("FSR-05", -4.5, "at_least")]


def test_verdict_without_a_threshold_in_numbers_has_no_line(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    stored = next(item for item in done.stored.verdicts if item.fsr_id == "FSR-06")
    stored = replace(stored, signal="ego.lane_offset", threshold=0.6)
    changes: tuple[dict[str, Any], ...] = (
        {"threshold": None},
        {"signal": None},
        {"predicate": "not contact", "threshold": 1.0},
    )
    for change in changes:
        found = plots(done, [fsrs["FSR-06"]], FSR_06=replace(stored, **change))
        assert all(not item.thresholds for item in found.values())
