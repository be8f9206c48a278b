"""Traces of ASAM OSI: what its own reader finds is what was recorded."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from osi3.osi_object_pb2 import MovingObject
from osi3trace.osi_trace import OSITrace

from adeye.errors import UsageError
from adeye.exchange import osi, require_place
from adeye.exchange.view import Account, RunView
from adeye.signals import OBJECT_CLASSES
from adeye.trace import Trace
from tests.exchange.handed import in_left_hand_traffic, with_camera, with_kinds
from tests.judge.conftest import HandMade

NEAR = 1e-6
ACCOUNT = Account(run="ab" * 32, about={"scenario": "follow"})
KINDS = {"GroundTruth": "_gt_", "SensorData": "_sd_"}


def read(folder: Path, kind: str, *, several: bool = False) -> list[Any]:
    """Read the messages of a kind with the reader of OSI's own bindings."""
    mark = "_multi_" if several else KINDS[kind]
    (path,) = (path for path in folder.iterdir() if mark in path.name)
    trace = OSITrace(str(path), kind)
    found = list(trace)
    trace.close()
    return found


@pytest.fixture
def made() -> HandMade:
    """A turning ego that sees one of two objects from row 3 on, in samples that are a tick old."""
    made = HandMade(rows=11, objects=("lead", "other")).ego(heading=0.3, d=5.25, acceleration=-1.5)
    made.columns["ego"][0, :, 6] = 0.05
    made.object("lead", size=(12.0, 2.5), heading=-0.2, d=1.75, acceleration=0.5)
    made.columns["sensor_stamp"][0, 1:, 0] = made.time[:-1]
    made.columns["sensor_stamp"][0, 0, 0] = -1.0
    made.columns["detected"][0, 3:, 0, 0] = True
    made.columns["detections"][0, :, 0, 0] = [44.123456789, 1.987654321]
    return made


def written(trace: Trace, folder: Path) -> list[str]:
    return osi.write_osi(RunView(trace), ACCOUNT, folder)


@pytest.mark.parametrize("several", [False, True])
def test_truth_is_the_recorded_one(made: HandMade, tmp_path: Path, several: bool) -> None:  # noqa: FBT001 - a parameter
    trace = made.trace()
    written(trace, tmp_path)
    truths = read(tmp_path, "GroundTruth", several=several)
    times = [truth.timestamp.seconds + 1e-9 * truth.timestamp.nanos for truth in truths]
    np.testing.assert_allclose(times, made.time, rtol=0.0, atol=NEAR)
    movers = [{item.id.value: item for item in truth.moving_object} for truth in truths]
    assert {truth.host_vehicle_id.value for truth in truths} == {osi.HOST}
    for number, states in ((osi.HOST, trace["ego"][0]), (osi.HOST + 1, trace["objects"][0, :, 0])):
        bases = [of_tick[number].base for of_tick in movers]
        found = np.array(
            [(base.position.x, base.position.y, base.orientation.yaw) for base in bases]
        )
        np.testing.assert_allclose(found, states[:, :3], rtol=0.0, atol=NEAR)
        speed = [np.hypot(base.acceleration.x, base.acceleration.y) for base in bases]
        np.testing.assert_allclose(speed, np.abs(states[:, 4]), rtol=0.0, atol=NEAR)
    lead = movers[4][osi.HOST + 1].base
    assert (lead.dimension.length, lead.dimension.width, lead.dimension.height) == (12.0, 2.5, 1.5)
    assert lead.position.z == 0.75
    assert (lead.velocity.x, lead.velocity.y) == pytest.approx(
        (20.0 * np.cos(0.2), -20.0 * np.sin(0.2)), abs=NEAR
    )


def test_middle_of_the_ego_moves_across_while_it_turns(made: HandMade, tmp_path: Path) -> None:
    trace = made.trace()
    written(trace, tmp_path)
    ego = read(tmp_path, "GroundTruth")[0].moving_object[0]
    half = 0.5 * trace.layout.architecture.vehicle.wheelbase
    sine, cosine = np.sin(0.3), np.cos(0.3)
    wanted = (20.0 * cosine - 0.05 * half * sine, 20.0 * sine + 0.05 * half * cosine)
    assert (ego.base.velocity.x, ego.base.velocity.y) == pytest.approx(wanted, abs=NEAR)
    assert ego.base.orientation_rate.yaw == 0.05
    assert ego.vehicle_attributes.bbcenter_to_rear.x == pytest.approx(-half)
    assert not ego.vehicle_attributes.HasField("steering_wheel_angle")


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_detections_lead_through_the_frames_to_their_places(
    made: HandMade, tmp_path: Path, side: float
) -> None:
    trace = with_camera(made.trace(), mount={"x": 1.2, "y": 0.4, "yaw": 0.7})
    written(trace if side > 0.0 else in_left_hand_traffic(trace), tmp_path)
    samples, truths = read(tmp_path, "SensorData"), read(tmp_path, "GroundTruth")
    assert [len(sample.moving_object) for sample in samples] == [0] * 2 + [1] * 7
    for sample in samples[2:]:
        at = sample.last_measurement_time
        (ego,) = (
            item
            for truth in truths
            if (truth.timestamp.seconds, truth.timestamp.nanos) == (at.seconds, at.nanos)
            for item in truth.moving_object
            if item.id.value == truth.host_vehicle_id.value
        )
        (found,) = sample.moving_object
        assert found.header.ground_truth_id[0].value == osi.HOST + 1
        mounted = sample.mounting_position
        place = turned(found.base.position, mounted.orientation.yaw) + xy(mounted.position)
        place = turned_xy(
            place + xy(ego.vehicle_attributes.bbcenter_to_rear), ego.base.orientation.yaw
        ) + xy(ego.base.position)
        np.testing.assert_allclose(place, [44.123456789, side * 1.987654321], rtol=0.0, atol=NEAR)


def xy(vector: Any) -> Any:
    return np.array([vector.x, vector.y])


def turned(vector: Any, yaw: float) -> Any:
    return turned_xy(xy(vector), yaw)


def turned_xy(place: Any, yaw: float) -> Any:
    sine, cosine = np.sin(yaw), np.cos(yaw)
    return np.array([cosine * place[0] - sine * place[1], sine * place[0] + cosine * place[1]])


def test_lanes_and_lines_know_each_other(made: HandMade, tmp_path: Path) -> None:
    written(made.trace(), tmp_path)
    truth = read(tmp_path, "GroundTruth")[0]
    lines = {line.id.value: line for line in truth.lane_boundary}
    assert len(lines) == 5
    lanes = {lane.id.value: lane.classification for lane in truth.lane}
    assert len(lanes) == 3
    numbers = [*lines, *lanes, *(item.id.value for item in truth.moving_object)]
    assert len(numbers) == len(set(numbers))
    for number, lane in lanes.items():
        right, left = (
            lines[side[0].value].boundary_line[0].position.y
            for side in (lane.right_lane_boundary_id, lane.left_lane_boundary_id)
        )
        assert (left - right, lane.centerline[0].y) == (3.5, 0.5 * (left + right))
        for other in lane.left_adjacent_lane_id:
            assert number in [item.value for item in lanes[other.value].right_adjacent_lane_id]
            assert lanes[other.value].centerline[0].y == lane.centerline[0].y + 3.5
    assert [len(lane.left_adjacent_lane_id) for lane in lanes.values()] == [1, 1, 0]


def test_what_stands_is_stationary(made: HandMade, tmp_path: Path) -> None:
    barrier = OBJECT_CLASSES.index("barrier")
    written(with_kinds(made.trace(), 0, barrier, actors=1), tmp_path)
    for truth in read(tmp_path, "GroundTruth"):
        (standing,) = truth.stationary_object
        assert standing.classification.type == standing.classification.TYPE_BARRIER
        assert len(truth.moving_object) == 2


@pytest.mark.parametrize("kind", OBJECT_CLASSES[: OBJECT_CLASSES.index("parked_truck")])
def test_every_kind_of_actor_has_its_word(made: HandMade, kind: str) -> None:
    number = OBJECT_CLASSES.index(kind)
    view = RunView(with_kinds(made.trace(), number, number, actors=2))
    actor = next(osi.ground_truth(view)).moving_object[1]
    word = MovingObject.VehicleClassification.Type.Name(actor.vehicle_classification.type)
    if kind == "pedestrian":
        assert actor.type == MovingObject.TYPE_PEDESTRIAN
    else:
        assert actor.type == MovingObject.TYPE_VEHICLE
        assert word not in {"TYPE_UNKNOWN", "TYPE_OTHER"}


def test_angles_are_within_half_a_turn(made: HandMade) -> None:
    made.columns["ego"][0, :, 2] = 4.0
    yaw = next(osi.ground_truth(RunView(made.trace()))).moving_object[0].base.orientation.yaw
    assert yaw == pytest.approx(4.0 - 2.0 * np.pi)


def test_files_are_named_as_osi_asks_for(made: HandMade, tmp_path: Path) -> None:
    names = written(made.trace(), tmp_path)
    assert sorted(names) == sorted(path.name for path in tmp_path.iterdir())
    form = re.compile(r"\d{8}T\d{6}Z_(gt|sd|multi)_\d+_\d+_(\d+)_([\w-]+)\.(osi|mcap)")
    found = [match.groups() for name in names for match in [form.fullmatch(name)] if match]
    assert found == [
        ("gt", "11", "ab" * 6, "osi"),
        ("sd", "9", f"{'ab' * 6}-camera", "osi"),
        ("multi", "11", "ab" * 6, "mcap"),
    ]
    trace = OSITrace(str(tmp_path / names[-1]), "SensorData")
    assert sorted(trace.get_available_topics()) == ["GroundTruth", "SensorData/camera"]
    (said,) = trace.get_file_metadata()
    assert said.name == "net.asam.osi.trace"
    assert said.metadata["zero_time"] == "1970-01-01T00:00:00Z"
    assert {"version", "min_osi_version", "min_protobuf_version"} <= said.metadata.keys()
    channel = trace.get_channel_metadata()
    assert channel["net.asam.osi.trace.channel.osi_version"] == said.metadata["version"]
    trace.close()


def test_tools_of_asam_accept_the_files(made: HandMade, tmp_path: Path) -> None:
    tools = pytest.importorskip("osi_utilities", reason="needs asam-osi-utilities")
    names = written(made.trace(), tmp_path)
    counts: dict[str, list[str]] = {}
    for name in names:
        is_single = name.endswith(".osi")
        if is_single:
            said = tools.parse_osi_trace_filename(name)
            assert said["number_of_frames"] == int(name.split("_")[4])
        reader = (
            tools.SingleTraceReader()
            if is_single
            else tools.MultiTraceReader(skip_incompatible_messages=False)
        )
        with reader:
            assert reader.open(tmp_path / name)
            # Iterating raises at what it cannot read.
            counts[name] = sorted(type(item.message).__name__ for item in reader)
    truths, samples = 11 * ["GroundTruth"], 9 * ["SensorData"]
    assert list(counts.values()) == [truths, samples, truths + samples]


def test_same_run_gives_the_same_bytes(made: HandMade, tmp_path: Path) -> None:
    folders = [tmp_path / name for name in "ab"]
    for folder in folders:
        folder.mkdir()
        written(made.trace(), folder)
    one, other = ({path.name: path.read_bytes() for path in item.iterdir()} for item in folders)
    assert one == other


def test_folder_of_something_else_is_left_alone(made: HandMade, tmp_path: Path) -> None:
    require_place(tmp_path / "new", osi.NAMES, "traces", osi.is_own)
    written(made.trace(), tmp_path)
    require_place(tmp_path, osi.NAMES, "traces", osi.is_own)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(UsageError, match="holds something else"):
        require_place(tmp_path, osi.NAMES, "traces", osi.is_own)
