"""What the recorder keeps of each tick, on hand-made batches."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.delivery import no_measurement
from adeye.signals import OK, SILENT, Authority, ControlCommand, Measurement, Scene
from adeye.simulate.recorder import POINTS, TRACKS, Memory, Recorder, cut, mark_detected, move
from adeye.trace import COLUMNS, NO_TRACKS, ChannelEvent, Layout, Trace
from tests.simulate.sensors.scenes import CAR, architecture, scene, scene_context

SENSORS = {
    "front": {"kind": "ground_truth", "rate": "20 Hz"},
    "pose": {"kind": "localisation", "rate": "20 Hz"},
}
RUNS = 2


CONTEXT = scene_context([CAR, CAR], runs=RUNS)
LAYOUT = Layout(
    scenario="tested",
    architecture=architecture(SENSORS),
    architectures=(architecture(SENSORS),) * RUNS,
    sensors=("front", "pose"),
    channels=("nominal", "safety"),
    monitors=("first", "second"),
    faults=("fault",),
    context=CONTEXT,
    horizon=0.1,
    tail=0.05,
    realised=(),
)


def begun(rows: int, *, layout: Layout = LAYOUT, drawn: bool = True, **more: Any) -> Recorder:
    """Return a recorder with room for some rows."""
    return Recorder(layout, rows, ("a", "b"), drawn=drawn, **more)


def shown(tick: int, *, running: Any = (True, True)) -> Scene:
    made = scene(CONTEXT, [(40.0, 0.0), (20.0, 0.0)], ego=(float(tick), 0.0, 0.0, 20.0), tick=tick)
    made.running[:] = running
    return made


def reading(stamp: float, found: dict[int, tuple[float, float]] | None = None) -> Measurement:
    made = no_measurement(RUNS, 2, with_estimate=False)
    made.stamp[:] = stamp
    for row, (thing, place) in enumerate((found or {}).items()):
        made.mask[:, row] = True
        made.source[:, row] = thing
        made.detections[:, row, :2] = place
    return made


def command(channel: str, acceleration: float, **extra: Any) -> ControlCommand:
    return ControlCommand(
        channel,
        np.full(RUNS, acceleration),
        np.full(RUNS, 0.01 * acceleration),
        np.full(RUNS, 0.5),
        np.full(RUNS, extra.pop("status", OK), dtype=np.int64),
        **extra,
    )


def add(
    recorder: Recorder,
    at: Scene,
    *,
    front: Measurement | None = None,
    proposals: list[ControlCommand] | None = None,
) -> None:
    """Record a tick: the nominal channel acts, the fault is present in run 1."""
    recorder.add(
        at,
        {"front": front or reading(at.time), "pose": reading(-1.0)},
        proposals or [command("nominal", 1.0), command("safety", -2.0)],
        np.tile([1.0, 0.01], (RUNS, 1)),
        Authority(np.zeros(RUNS, dtype=np.int64), np.ones(RUNS, dtype=np.int64)),
        np.array([[False], [True]]),
    )


def closed(recorder: Recorder, at: Scene, **changes: Any) -> Trace:
    recorder.close(at)
    return recorder.trace(
        **{
            "horizon_row": np.array([2, 2]),
            "complete": np.ones(RUNS, dtype=np.bool_),
            "events": [None, ChannelEvent("channel_error", "nominal", 0.1, "lost")],
            **changes,
        }
    )


def recorded(rows: int = 4) -> Trace:
    recorder = begun(rows)
    for tick in range(3):
        add(recorder, shown(tick))
    return closed(recorder, shown(3))


def test_every_column_of_the_trace_is_recorded() -> None:
    trace = recorded()
    assert set(trace.columns) == set(COLUMNS)
    assert {len(values) for values in trace.columns.values()} == {RUNS}
    assert trace.case_digests == ("a", "b")
    assert trace.channel_events[0] is None


def test_a_row_is_the_scene_of_its_tick_and_what_was_decided_from_it() -> None:
    trace = recorded()
    assert trace.time.tolist() == pytest.approx([0.0, 0.05, 0.1, 0.15])
    assert trace["ego"][0, :, 0].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert trace["acceleration"][0, 1].tolist() == [1.0, -2.0]
    assert trace["steering_angle"][0, 1].tolist() == pytest.approx([0.01, -0.02])
    assert trace["command"][0, 1].tolist() == [1.0, 0.01]
    assert (trace["authority"][0, 1], trace["reason"][0, 1]) == (0, 1)
    assert trace["fault_active"][:, 1, 0].tolist() == [False, True]
    assert trace["sensor_stamp"][0, 1].tolist() == pytest.approx([0.05, -1.0])


def test_last_row_has_a_scene_only_and_the_longest_run_ends_the_trace() -> None:
    trace = recorded(rows=100)
    assert trace.length.tolist() == [4, 4]
    assert trace.time.size == trace["ego"].shape[1] == 4
    # Kernels are compiled for one layout.
    assert all(values.flags.c_contiguous for values in trace.columns.values())
    assert trace["ego"][0, 3, 3] == 20.0
    decided = ("acceleration", "stamp", "command", "sensor_stamp", "fault_active", "tracks")
    for name in (*decided, "track_error", "false_tracks"):
        assert not trace[name][:, 3].any(), name


def test_ended_run_does_not_grow() -> None:
    recorder = begun(6)
    add(recorder, shown(0))
    # Run 1 ends in the scene of tick 1: it is its last row.
    for tick in (1, 2):
        add(recorder, shown(tick, running=(True, False)))
    trace = closed(recorder, shown(3, running=(False, False)))
    assert trace.length.tolist() == [4, 2]
    assert trace["ego"][1, :, 0].tolist() == [0.0, 1.0, 0.0, 0.0]
    assert not trace["acceleration"][1, 1:].any()
    assert trace["ego"][0, 3, 0] == 3.0


def test_what_other_runs_did_does_not_reach_a_digest() -> None:
    one = recorded()
    recorder = begun(9)
    add(recorder, shown(0))
    add(recorder, shown(1))
    add(recorder, shown(2, running=(True, True)))
    at = shown(3, running=(False, True))
    add(recorder, at)
    other = closed(recorder, shown(4, running=(False, False)))
    assert one.digests()[0] == other.digests()[0]
    assert one.digests()[1] != other.digests()[1]


def test_detection_is_placed_in_the_map_by_the_pose_of_its_sample() -> None:
    recorder = begun(4)
    turned = shown(0)
    turned.ego[:, :3] = (10.0, 5.0, math.pi / 2.0)
    add(recorder, turned)
    # Delivered one tick later, when the ego is elsewhere: 7 m ahead, 2 m to the left of then.
    add(recorder, shown(1), front=reading(0.0, {1: (7.0, 2.0)}))
    trace = closed(recorder, shown(2))
    assert trace["detected"][0, 1, 0].tolist() == [False, True]
    assert trace["detections"][0, 1, 0, 1].tolist() == pytest.approx([8.0, 12.0])
    assert not trace["detected"][0, 1, 1].any()


LIDAR = {
    "kind": "lidar",
    "fidelity": "physical",
    "mount": {"x": "2 m", "y": "1 m", "z": "1 m"},
    "field_of_view": "360 deg",
    "range": "80 m",
    "rate": "20 Hz",
}


def with_points(points: list[tuple[float, float, float]]) -> Any:
    """Record two ticks of a lidar that shows these returns of the first; give its places."""
    made = replace(LAYOUT, architecture=architecture({"front": LIDAR, "pose": SENSORS["pose"]}))
    mounts = {"front": np.tile([2.0, 1.0, 1.0, 0.0], (RUNS, 1))}
    recorder = begun(3, layout=made, mounts=mounts)
    turned = shown(0)
    turned.ego[:, :3] = (10.0, 5.0, math.pi / 2.0)
    add(recorder, turned, front=reading(-1.0))
    found = reading(0.0)
    found.points = np.tile(np.array(points), (RUNS, 1, 1))
    add(recorder, shown(1), front=found)
    trace = closed(recorder, shown(2))
    assert trace["points"].dtype == np.float32
    return trace["points"][0]


def test_return_is_placed_in_the_map_by_mount_and_pose_of_its_sample() -> None:
    beams = [(7.0, 0.0, 0.0), (0.0, 0.0, 0.0), (math.sqrt(2.0), math.pi / 4.0, 0.0)]
    points = with_points(beams)
    assert points.shape[1:] == (1, POINTS, 2)
    # The vehicle looks along y, so 9 m ahead and 1 m to the left is (-1, 9) from it.
    assert points[1, 0, :3].tolist() == [
        pytest.approx([9.0, 14.0]),
        pytest.approx([8.0, 8.0]),
        pytest.approx([np.nan, np.nan], nan_ok=True),
    ]
    assert np.isnan(points[[0, 2]]).all()


def test_returns_of_the_ground_are_not_drawn() -> None:
    down = -math.asin(1.0 / 7.0)
    points = with_points([(7.0, 0.0, down), (3.0, 0.0, down), (9.0, 0.0, 0.0)])
    assert np.isfinite(points[1, 0, :, 0]).sum() == 2


def test_many_returns_are_thinned_evenly() -> None:
    many = 3 * POINTS - 7
    points = with_points([(5.0 + k, 0.0, 0.0) for k in range(many)])[1, 0]
    assert np.isfinite(points).all()
    # The ego looked along y then.
    steps = np.diff(points[:, 1])
    assert points[0, 1] == pytest.approx(5.0 + 2.0 + 5.0)
    assert set(np.round(steps).astype(int)) == {2, 3}


def test_monitors_of_all_channels_stand_in_the_order_of_the_channels() -> None:
    recorder = begun(3)
    states = [np.tile([[[True, False]]], (RUNS, 1, 1)), np.tile([[[True, True]]], (RUNS, 1, 1))]
    proposals = [
        command("nominal", 0.0, monitors=states[0]),
        command("safety", 0.0, monitors=states[1]),
    ]
    add(recorder, shown(0), proposals=proposals)
    trace = closed(recorder, shown(1))
    assert trace["monitors"][0, 0].tolist() == [[True, False], [True, True]]


def test_what_only_pictures_need_is_not_kept_unless_it_is_drawn() -> None:
    traces = []
    for drawn in (False, True):
        recorder = begun(3, drawn=drawn)
        proposals = [command("nominal", 0.0, **fan(4, 3)), command("safety", 0.0)]
        add(recorder, shown(0), front=reading(0.0, {0: (8.0, 1.0)}), proposals=proposals)
        traces.append(closed(recorder, shown(1)))
    lean, rich = traces
    assert lean["tracks"].shape == (RUNS, 2, 2, 0, 6)
    assert lean["detections"].shape == (RUNS, 2, 2, 0, 2)
    assert lean["candidates"].size == lean["chosen"].size == 0
    assert rich["detections"][0, 0, 0, 0].tolist() == [8.0, 1.0]
    assert lean.digests() == rich.digests()
    assert np.array_equal(lean["detected"], rich["detected"])


def test_memory_is_used_again_and_leaves_nothing_behind() -> None:
    memory = Memory()
    for rows in (9, 4):
        recorder = begun(rows, drawn=False, memory=memory)
        for tick in range(rows - 1):
            # Run 1 ends after its first tick.
            add(recorder, shown(tick, running=(True, tick == 0)))
        again = closed(recorder, shown(rows - 1, running=(False, False)))
    recorder = begun(4, drawn=False)
    for tick in range(3):
        add(recorder, shown(tick, running=(True, tick == 0)))
    fresh = closed(recorder, shown(3, running=(False, False)))
    assert again.digests() == fresh.digests()
    assert again.length.tolist() == [4, 2]
    for name in COLUMNS:
        assert np.array_equal(again[name], fresh[name], equal_nan=True), name


def fan(count: int, points: int) -> dict[str, Any]:
    places = np.arange(RUNS * count * points * 2.0).reshape(RUNS, count, points, 2)
    costs = np.arange(RUNS * count * 1.0).reshape(RUNS, count)
    chosen = np.full(RUNS, count - 1, dtype=np.int64)
    return {"candidates": places, "candidate_costs": costs, "chosen": chosen}


def test_fan_takes_the_size_of_the_first_and_others_are_cut_or_filled() -> None:
    recorder = begun(5)
    silent = command("safety", 0.0, status=SILENT)
    add(recorder, shown(0), proposals=[command("nominal", 0.0), silent])
    first = fan(4, 3)
    for tick, shape in ((1, first), (2, fan(6, 2)), (3, fan(2, 5))):
        proposals = [command("nominal", 0.0, **shape), silent]
        add(recorder, shown(tick), proposals=proposals)
    trace = closed(recorder, shown(4))
    assert trace["candidates"].shape == (RUNS, 5, 2, 4, 3, 2)
    assert np.array_equal(trace["candidates"][:, 1, 0], first["candidates"])
    assert np.array_equal(trace["candidate_costs"][:, 1, 0], first["candidate_costs"])
    assert np.isnan(trace["candidate_costs"][:, [0, 3], 0, 2:]).all()
    assert np.isnan(trace["candidates"][:, 2, 0, :, 2]).all()
    assert np.isnan(trace["candidates"][:, :4, 1]).all()
    assert trace["chosen"][0, :4, 0].tolist() == [-1, 3, 5, 1]
    assert trace["chosen"][0, 1, 1] == -1


def test_tracks_are_cut_and_missing_ones_are_nan() -> None:
    recorder = begun(3)
    tracks = np.arange(RUNS * (TRACKS + 2) * 6, dtype=np.float64).reshape(RUNS, TRACKS + 2, 6)
    proposals = [command("nominal", 0.0, tracks=tracks), command("safety", 0.0, status=SILENT)]
    add(recorder, shown(0), proposals=proposals)
    trace = closed(recorder, shown(1))
    assert np.array_equal(trace["tracks"][:, 0, 0], tracks[:, :TRACKS])
    assert np.isnan(trace["tracks"][:, 0, 1]).all()
    assert trace["status"][0, 0].tolist() == [OK, SILENT]


def test_tracks_are_compared_with_the_objects_of_their_observation() -> None:
    recorder = begun(40, drawn=False)
    # The ego has driven on from where it saw the object 40 m ahead; the command comes late.
    tracks = np.full((RUNS, 8, 6), np.nan)
    for tick in range(30):
        seen_at = max(0, tick - 2)
        tracks[:, 0] = (40.5 - seen_at, 0.0, 0.0, 0.0, 4.5, 1.8)
        late = command("nominal", 0.0, tracks=tracks.copy())
        late.stamp[:] = 0.05 * seen_at
        add(recorder, shown(tick), proposals=[late, command("safety", 0.0)])
    trace = closed(recorder, shown(30))
    assert trace["track_error"][0, :30, 0, 0, 0].tolist() == pytest.approx([0.5] * 30)
    assert np.isnan(trace["track_error"][:, :30, 0, 1]).all()
    assert not trace["false_tracks"][:, :, 0].any()
    assert np.isnan(trace["track_error"][:, :30, 1]).all()
    assert (trace["false_tracks"][:, :30, 1] == NO_TRACKS).all()


# --- Rows in the ring and in the columns: what is written, what is left alone ---------------------

BATCH, RING, ROWS = 3, 4, 10


@pytest.mark.parametrize("kind", [np.float64, np.int8, np.int16, np.bool_])
def test_run_gets_its_rows_of_the_ring_as_far_as_it_has_come(kind: type[np.generic]) -> None:
    ring = (np.arange(RING * BATCH * 2).reshape(RING, BATCH, 2) % 3 + 1).astype(kind)
    column = np.zeros((BATCH, ROWS, 2), dtype=kind)
    # The first run has ended before the ring, the second within it, the third goes on.
    move(ring, 4, np.array([3, 6, 8]), column)
    assert not column[0].any()
    assert np.array_equal(column[1, 4:6], ring[:2, 1])
    assert np.array_equal(column[2, 4:8], ring[:, 2])
    column[1, 4:6] = column[2, 4:8] = 0
    assert not column.any()


def test_column_is_cut_in_its_place_and_zero_beyond_the_end_of_a_run() -> None:
    column = np.arange(1.0, 1 + BATCH * ROWS * 2).reshape(BATCH, ROWS, 2)
    expected = column[:, :8].copy()
    ends = np.array([10, 4, 0])
    for run, end in enumerate(ends):
        expected[run, end:] = 0.0
    kept = column.reshape(-1)[: expected.size].reshape(expected.shape)
    cut(column, ends, kept)
    assert np.array_equal(kept, expected)


def test_reading_marks_the_objects_behind_its_detections() -> None:
    detected = np.ones((2, 3), dtype=np.bool_)
    mask = np.array([[True, True, False], [False, True, True]])
    # A detection without an object leaves no mark, and what was marked before is forgotten.
    mark_detected(mask, np.array([[1, -1, 0], [0, 2, 1]]), detected)
    assert detected.tolist() == [[False, True, False], [False, True, True]]


def guest_layout() -> Layout:
    """Return the layout with a sensor of somebody else in the place of the first one."""
    theirs = architecture({**SENSORS, "front": {"kind": "./theirs.py:Theirs", "rate": "20 Hz"}})
    return replace(LAYOUT, architecture=theirs, architectures=(theirs,) * RUNS)


# The objects are 40 m and 20 m ahead of an ego at x = 0, and a car is 1.8 m wide.
@pytest.mark.parametrize(
    ("claimed", "place", "is_of"),
    [
        (0, (38.0, 1.0), 0),
        # It says whose it is, and it is not there.
        (0, (-40.0, 30.0), None),
        (0, (21.0, 0.0), 1),
        (1, (math.nan, 0.0), None),
        # Somebody's false alarm is one, wherever it is.
        (-1, (40.0, 0.0), None),
        # From its side the gate is 2.5 m and 5 % of the distance.
        (0, (40.0, 0.9 + 3.5), 0),
        (0, (40.0, 0.9 + 4.8), None),
    ],
)
@pytest.mark.parametrize("late", [0, 2])
def test_detection_of_a_guest_is_of_what_is_there(
    claimed: int, place: tuple[float, float], is_of: int | None, late: int
) -> None:
    found = {}
    ticks = 19  # more than are held back
    for layout in (LAYOUT, guest_layout()):
        recorder = begun(ticks + 1, layout=layout)
        for tick in range(ticks):
            # The ego moves; what was measured is where it was then.
            then = max(0, tick - late)
            told = reading(0.05 * then, {claimed: (place[0] - then, place[1])})
            add(recorder, shown(tick), front=told)
        seen = closed(recorder, shown(ticks))["detected"]
        assert (seen[0] == seen[1]).all()
        found[layout is LAYOUT] = seen[0, :-1, 0]
    assert (found[False] == [thing == is_of for thing in range(2)]).all()
    # Of one of the package it is known.
    assert (found[True] == [thing == claimed for thing in range(2)]).all()
