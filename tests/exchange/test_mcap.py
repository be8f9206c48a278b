"""MCAP for viewers: what another reader finds is what was recorded."""

import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from adeye.exchange.mcap import _stamp, write_mcap
from adeye.exchange.view import Account, Remark, RunView
from adeye.spec.sensors import Camera
from adeye.trace import Album, Picture, Trace
from tests.conftest import MakeProject
from tests.exchange.foxglove_rules import findings
from tests.exchange.handed import in_left_hand_traffic, with_camera, with_kinds
from tests.judge.conftest import HandMade
from tests.project import CANDIDATE, odd_of, run_cases, use

NEAR = 1e-6
POINT = np.dtype([("place", "<f8", 3), ("colour", "u1", 4)])
ACCOUNT = Account(
    run="ab" * 32,
    about={"scenario": "follow"},
    remarks=(
        Remark(0.25, "info", "switch", "authority to safety"),
        Remark(9.0, "error", "FSR-01", "FAIL: ttc >= 1 s"),
    ),
    metrics={"min_ttc_s": None, "contact": 0.0},
)

Found = dict[str, list[tuple[float, Any]]]
"""Messages with their times [s], by topic."""


def read(path: Path) -> Found:
    """Read a file with the container's own reader and the schemas that it carries."""
    found: Found = {}
    decoders = DecoderFactory()
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            assert message.log_time == message.publish_time
            if channel.message_encoding == "json":
                content = json.loads(message.data)
            else:
                decode = decoders.decoder_for(channel.message_encoding, schema)
                assert decode is not None
                content = decode(message.data)
            found.setdefault(channel.topic, []).append((message.log_time / 1e9, content))
    return found


def written(trace: Trace, folder: Path, account: Account = ACCOUNT) -> Found:
    path = folder / "run.mcap"
    write_mcap(RunView(trace), account, path)
    return read(path)


def moved(point: Any, frame: Any) -> Any:
    """Move a point (3,) out of a frame that is turned about z only."""
    turn, to = frame.rotation, frame.translation
    assert (turn.x, turn.y) == (0.0, 0.0)
    yaw = 2.0 * np.arctan2(turn.z, turn.w)
    x, y, z = point
    sine, cosine = np.sin(yaw), np.cos(yaw)
    return to.x + cosine * x - sine * y, to.y + sine * x + cosine * y, to.z + z


@pytest.fixture
def made() -> HandMade:
    """A lead that a camera sees from a turned ego, from row 3 on."""
    made = HandMade(rows=11, objects=("lead", "other")).ego(heading=0.3, d=5.25, acceleration=-1.5)
    made.object("lead", size=(12.0, 2.5), heading=-0.2, d=1.75)
    made.columns["detected"][0, 3:, 0, 0] = True
    made.columns["detections"][0, :, 0, 0] = [44.123456789, 1.987654321]
    return made


def test_boxes_are_those_of_the_scene(made: HandMade, tmp_path: Path) -> None:
    scenes = written(made.trace(), tmp_path)["/scene"]
    assert [time for time, _ in scenes] == pytest.approx(made.time.tolist())
    boxes = {entity.id: entity.cubes[0] for entity in scenes[5][1].entities}
    assert {entity.frame_id for entity in scenes[5][1].entities} == {"map"}
    assert boxes.keys() == {"ego", "lead", "other"}
    size, pose = boxes["lead"].size, boxes["lead"].pose
    assert (size.x, size.y, size.z) == (12.0, 2.5, 1.5)
    assert (pose.position.x, pose.position.y, pose.position.z) == (44.0 + 20.0 * 0.5, 1.75, 0.75)
    assert 2.0 * np.arcsin(pose.orientation.z) == pytest.approx(-0.2)
    ego = boxes["ego"]
    assert (ego.size.x, ego.size.y, ego.size.z) == (4.0, 2.0, 1.5)
    assert (ego.pose.position.x, ego.pose.position.y) == (10.0, 5.25)


def test_plotted_numbers_are_the_recorded_ones(made: HandMade, tmp_path: Path) -> None:
    trace = made.trace()
    found = written(trace, tmp_path)
    names = ("x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2")
    for topic, states in (("/ego", trace["ego"][0]), ("/object/lead", trace["objects"][0, :, 0])):
        read_back = np.array([[said[name] for name in names] for _, said in found[topic]])
        np.testing.assert_allclose(read_back, states[:, :5], rtol=0.0, atol=NEAR)


def test_frames_lead_from_the_sensor_to_the_map(made: HandMade, tmp_path: Path) -> None:
    trace = with_camera(made.trace(), mount={"x": 1.2, "y": 0.4, "z": 1.3, "yaw": 0.2})
    found = written(trace, tmp_path)
    ((_, still),) = found["/tf_static"]
    frames = {item.child_frame_id: item for item in still.transforms}
    camera_spec = trace.layout.architecture.sensors["camera"]
    assert isinstance(camera_spec, Camera)
    mount = camera_spec.mount
    camera = frames["sensor/camera"]
    assert camera.parent_frame_id == "base_link"
    assert len(found["/tf"]) == len(made.time)
    for row in (0, 7):
        ((base),) = found["/tf"][row][1].transforms
        assert (base.parent_frame_id, base.child_frame_id) == ("map", "base_link")
        x, y, heading = trace["ego"][0, row, :3]
        wanted = (
            x + np.cos(heading) * mount.x - np.sin(heading) * mount.y,
            y + np.sin(heading) * mount.x + np.cos(heading) * mount.y,
            mount.z,
        )
        assert moved(moved((0.0, 0.0, 0.0), camera), base) == pytest.approx(wanted, abs=NEAR)


def test_detections_are_a_cloud_for_each_sample(made: HandMade, tmp_path: Path) -> None:
    clouds = written(made.trace(), tmp_path)["/sensor/camera/detections"]
    assert len(clouds) == len(made.time) - 1
    places = [np.frombuffer(cloud.data, POINT) for _, cloud in clouds]
    assert [len(item) for item in places] == [0] * 3 + [1] * 7
    camera: Any = made.trace().layout.architecture.sensors["camera"]
    wanted = [[44.123456789, 1.987654321, camera.mount.z]]
    np.testing.assert_allclose(places[4]["place"], wanted, atol=NEAR)
    assert {(cloud.frame_id, cloud.point_stride) for _, cloud in clouds} == {("map", 28)}
    # A viewer that takes the colour from numbers of a point would draw a single one in the dark.
    assert [field.name for field in clouds[4][1].fields] == [
        *"xyz",
        "red",
        "green",
        "blue",
        "alpha",
    ]
    assert places[4]["colour"].max() == 255


def test_tracks_are_plates_in_the_frame_of_the_ego(made: HandMade, tmp_path: Path) -> None:
    made.columns["tracks"][0, 4, 1, 2] = [30.0, -3.0, 0.0, 5.0, 4.5, 1.8]
    updates = written(made.trace(), tmp_path)["/channel/safety/tracks"]
    (entity,) = updates[4][1].entities
    (plate,) = entity.cubes
    assert (entity.frame_id, entity.frame_locked) == ("base_link", True)
    assert (plate.pose.position.x, plate.pose.position.y) == (30.0, -3.0)
    assert 2.0 * np.arcsin(plate.pose.orientation.z) == pytest.approx(0.5 * np.pi)
    assert len(updates[5][1].entities[0].cubes) == 0


def test_candidates_are_drawn_when_they_change_and_the_chosen_one_last(
    made: HandMade, tmp_path: Path
) -> None:
    shape = (1, made.rows, 2, 3)
    fan = np.full((*shape, 2, 2), np.nan, dtype=np.float32)
    costs = np.full(shape, np.nan, dtype=np.float32)
    for index in range(2):
        fan[0, 2:, 0, index] = [[0.0, 0.0], [10.0, index]]
        costs[0, 2:, 0, index] = 5.0
    made.columns |= {"candidates": fan, "candidate_costs": costs}
    made.columns["chosen"] = np.zeros((1, made.rows, 2), dtype=np.int16)
    found = written(made.trace(), tmp_path)
    assert "/channel/safety/candidates" not in found
    updates = found["/channel/nominal/candidates"]
    assert [time for time, _ in updates] == pytest.approx([0.0, 0.2])
    lines = updates[1][1].entities[0].lines
    assert [line.points[1].y for line in lines] == [1.0, 0.0]
    assert lines[1].color != lines[0].color


def test_returns_of_a_lidar_are_a_cloud(made: HandMade, tmp_path: Path) -> None:
    lidar = {
        "kind": "lidar",
        "fidelity": "physical",
        "mount": {"x": 1.0, "z": 1.5},
        "range": 100.0,
        "field_of_view": 3.0,
        "rate": 10.0,
    }
    trace = with_camera(made.trace(), **lidar)
    points = np.full((1, made.rows, 1, 4, 2), np.nan, dtype=np.float32)
    points[0, 5:, 0, :2] = [[1.5, 2.5], [3.25, -1.0]]
    columns: dict[str, Any] = {**trace.columns, "points": points}
    columns["sensor_stamp"] = trace["sensor_stamp"].copy()
    columns["sensor_stamp"][0, 5:, 0] = 0.4
    clouds = written(replace(trace, columns=columns), tmp_path)
    (_, none), (time, cloud) = clouds["/sensor/camera/points"]
    assert time == pytest.approx(0.5)
    # It was measured before it was delivered.
    assert cloud.timestamp.ToNanoseconds() == 400_000_000
    assert len(none.data) == 0
    read_back = np.frombuffer(cloud.data, POINT)["place"]
    assert read_back.tolist() == [[1.5, 2.5, 1.5], [3.25, -1.0, 1.5]]


def test_road_and_what_stands_are_told_once(made: HandMade, tmp_path: Path) -> None:
    found = written(with_kinds(made.trace(), 0, 9, actors=1), tmp_path)
    ((time, update),) = found["/road"]
    entities = {entity.id: entity for entity in update.entities}
    assert time == 0.0
    assert entities.keys() == {"road", "other"}
    lines = entities["road"].lines
    assert [line.points[0].y for line in lines] == pytest.approx([0.0, 3.5, 7.0, 10.5, -2.0])
    assert lines[1].thickness < lines[0].thickness
    assert [entity.id for entity in found["/scene"][0][1].entities] == ["ego", "lead"]
    assert "/object/other" not in found


def test_commands_that_are_no_numbers_are_left_out(made: HandMade, tmp_path: Path) -> None:
    made.set("acceleration", np.nan, rows=2, at=1).set("authority", -1, rows=2)
    found = written(made.trace(), tmp_path)
    assert found["/channel/safety/command"][2][1] == {"steering_angle_rad": 0.0, "status": "ok"}
    assert [said["authority"] for _, said in found["/switch"][1:3]] == ["nominal", "none"]
    assert len(found["/switch"]) == len(made.time) - 1


def test_events_and_verdicts_are_a_log(made: HandMade, tmp_path: Path) -> None:
    found = written(made.trace(), tmp_path)
    said = [(time, log.level, log.name, log.message) for time, log in found["/events"]]
    # What is told of a time after the end is told at the end.
    assert said == [
        (0.25, 2, "switch", "authority to safety"),
        (1.0, 4, "FSR-01", "FAIL: ttc >= 1 s"),
    ]
    assert found["/metrics"] == [(1.0, {"contact": 0.0})]
    with (tmp_path / "run.mcap").open("rb") as stream:
        (about,) = make_reader(stream).iter_metadata()
    assert about.metadata == {"run": "ab" * 32, "scenario": "follow"}


def test_left_is_left_in_left_hand_traffic(made: HandMade, tmp_path: Path) -> None:
    made.set("steering_angle", 0.1).columns["tracks"][0, :, 0, 0] = [30.0, 3.0, 0.0, 0.0, 4.0, 2.0]
    found = written(in_left_hand_traffic(made.trace()), tmp_path)
    assert found["/ego"][0][1]["y_m"] == -5.25
    assert found["/channel/nominal/command"][0][1]["steering_angle_rad"] == -0.1
    (plate,) = found["/channel/nominal/tracks"][0][1].entities[0].cubes
    assert plate.pose.position.y == -3.0


def test_same_run_gives_the_same_bytes_in_order_of_time(made: HandMade, tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("a.mcap", "b.mcap")]
    for path in paths:
        write_mcap(RunView(made.trace()), ACCOUNT, path)
    one, other = (path.read_bytes() for path in paths)
    assert one == other
    with paths[0].open("rb") as stream:
        reader = make_reader(stream)
        times = [message.log_time for _, _, message in reader.iter_messages(log_time_order=False)]
    assert times == sorted(times)
    assert (times[0], times[-1]) == (0, 1_000_000_000)


def of_everything(made: HandMade) -> Trace:
    """Return a run with each kind of message, and with what has no number in most of them."""
    made.columns["tracks"][0, 4, 1, :2] = [
        [30.0, -3.0, 0.0, 5.0, 4.5, 1.8],
        [9.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    ]
    shape = (1, made.rows, 2, 3)
    fan = np.full((*shape, 2, 2), np.nan, dtype=np.float32)
    fan[0, 2:, 0, 0] = [[0.0, 0.0], [10.0, 1.0]]
    costs = np.full(shape, np.nan, dtype=np.float32)
    costs[0, 2:, 0, 0] = 5.0
    made.columns |= {"candidates": fan, "candidate_costs": costs}
    made.columns["chosen"] = np.zeros((1, made.rows, 2), dtype=np.int16)
    made.set("acceleration", np.nan, rows=2, at=1).set("authority", -1, rows=2)
    lidar = {"kind": "lidar", "fidelity": "physical", "range": 100.0, "field_of_view": 3.0}
    mount = {"x": 1.0, "z": 1.5, "yaw": 0.2, "pitch": 0.1}
    trace = with_camera(made.trace(), **lidar, mount=mount, rate=10.0)
    points = np.full((1, made.rows, 1, 4, 2), np.nan, dtype=np.float32)
    points[0, 5:, 0, :2] = [[1.5, 2.5], [3.25, -1.0]]
    columns: dict[str, Any] = {**trace.columns, "points": points}
    return replace(trace, columns=columns)


def test_every_message_is_what_its_schema_and_a_viewer_need(made: HandMade, tmp_path: Path) -> None:
    trace = of_everything(made)
    for number, item in enumerate((trace, in_left_hand_traffic(trace))):
        path = tmp_path / f"{number}.mcap"
        write_mcap(RunView(item), ACCOUNT, path)
        assert findings(path) == []
        topics = {topic.rpartition("/")[2] for topic in read(path)}
        assert {"points", "detections", "tracks", "candidates", "road", "tf_static"} <= topics


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("MAP", "world", "/tf: no way from 'base_link' to map"),
        ("_DEFAULT_TRACK", 0.0, "/channel/safety/tracks at 400000000 ns: size of a cube"),
        ("_DEFAULT_TRACK", np.nan, "/channel/safety/tracks at 400000000 ns: Vector3"),
        ("_WHITE", (1.5, 0.0, 0.0, 1.0), "/road at 0 ns: colour"),
        ("_LINE", 0.0, "/road at 0 ns: line of"),
        ("quaternion", lambda *_: (0.0, 0.0, 0.0, 0.0), "/tf at 0 ns: rotation"),
        ("_stamp", lambda time: _stamp(time + 0.2), "/tf at 0 ns: is stamped 200000000 ns"),
    ],
)
def test_rules_of_a_viewer_find_what_is_broken(
    made: HandMade,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    value: Any,
    says: str,
) -> None:
    monkeypatch.setattr(f"adeye.exchange.mcap.{name}", value)
    write_mcap(RunView(of_everything(made)), ACCOUNT, tmp_path / "run.mcap")
    assert any(text.startswith(says) for text in findings(tmp_path / "run.mcap"))


PHYSICAL: dict[str, Any] = {
    "kind": "camera",
    "fidelity": "physical",
    "mount": {"x": 0.9, "z": 1.3},
    "field_of_view": 0.9,
    "columns": 8,
    "rows": 4,
    "rate": 10.0,
}


def test_image_shows_objects_and_noise_where_they_are(made: HandMade, tmp_path: Path) -> None:
    trace = with_kinds(with_camera(made.trace(), **PHYSICAL), 0, 9, actors=1)
    pixels = np.full((4, 8), -1, dtype=np.int16)
    pixels[1:3, 0], pixels[2, 1:3], pixels[0, 7] = 0, 1, -2
    album = {"camera": [Picture(0.2, pixels), Picture(0.7, np.full_like(pixels, -1))]}
    for item in (trace, in_left_hand_traffic(trace)):
        write_mcap(RunView(item), ACCOUNT, tmp_path / "run.mcap", album)
        assert findings(tmp_path / "run.mcap") == []
        found = read(tmp_path / "run.mcap")
        (time, image), (later, empty) = found["/sensor/camera/image"]
        assert (time, later) == (0.2, 0.7)
        assert (image.width, image.height, image.step, image.encoding) == (8, 4, 24, "rgb8")
        seen = np.frombuffer(image.data, dtype=np.uint8).reshape(4, 8, 3)
        shown = seen if item is trace else seen[:, ::-1]
        night = np.frombuffer(empty.data, dtype=np.uint8)[:3]
        assert (np.frombuffer(empty.data, dtype=np.uint8).reshape(-1, 3) == night).all()
        for number in np.unique(pixels).tolist():
            assert len(np.unique(shown[pixels == number], axis=0)) == 1
        assert len(np.unique(shown.reshape(-1, 3), axis=0)) == 4
        assert (shown[3, 7] == night).all()


def test_trace_without_images_names_no_topic_for_them(made: HandMade, tmp_path: Path) -> None:
    found = written(with_camera(made.trace(), **PHYSICAL), tmp_path)
    assert not {topic for topic in found if "image" in topic or "calibration" in topic}


def in_pixels(box: Any, frames: list[Any], camera: Any) -> Any:
    """Return where a camera depicts the corners of a box in the map, (2, 8), column and row."""
    place, yaw = box.pose.position, 2.0 * np.arcsin(box.pose.orientation.z)
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    points = Rotation.from_rotvec([0.0, 0.0, yaw]).apply(
        corners * [box.size.x, box.size.y, box.size.z]
    )
    points += [place.x, place.y, place.z]
    for frame in frames:
        turn, to = frame.rotation, frame.translation
        turned = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
        points = turned.inv().apply(points - [to.x, to.y, to.z])
    across, down, depth = np.reshape(camera.K, (3, 3)) @ points.T
    assert (depth > 0.0).all()
    return np.array([across, down]) / depth


@pytest.mark.parametrize("rule", ["right", pytest.param("left", marks=pytest.mark.slow)])
def test_image_shows_an_actor_where_frames_and_calibration_put_it(
    make_project: MakeProject, tmp_path: Path, rule: str
) -> None:
    project = make_project(odd_of(use("cut_in", {"gap": ["30 m"]})))
    with project.edited("scenarios_db/motorway/cut_in.yaml") as scenario:
        scenario["world"]["road"]["traffic"] = rule
    with project.edited(CANDIDATE) as candidate:
        given = candidate["sensors"]["front_camera"]
        mount = {"x": "0.9 m", "y": "0.3 m", "z": "1.3 m", "yaw": "3 deg", "pitch": "2 deg"}
        given |= {"fidelity": "physical", "columns": 320, "rows": 120, "mount": mount}
        for name in ("range", "distance_noise", "bearing_noise", "night_range"):
            del given[name]
    plan = project.plan()
    album: Album = {}
    trace = run_cases(plan, plan.cases, album)
    assert trace.digests() == run_cases(plan, plan.cases).digests()
    write_mcap(RunView(trace), ACCOUNT, tmp_path / "run.mcap", album)
    assert findings(tmp_path / "run.mcap") == []
    found = read(tmp_path / "run.mcap")
    ((_, camera),) = found["/sensor/front_camera/calibration"]
    still = {item.child_frame_id: item for item in found["/tf_static"][0][1].transforms}
    mounted = [still["sensor/front_camera"], still[camera.frame_id]]
    bases = {round(time, 6): message.transforms[0] for time, message in found["/tf"]}
    scenes = {round(time, 6): message.entities for time, message in found["/scene"]}
    looked = 0
    for time, image in found["/sensor/front_camera/image"]:
        at = round(time, 6)
        (box,) = next(item.cubes for item in scenes[at] if item.id == "cutter")
        columns, rows = in_pixels(box, [bases[at], *mounted], camera)
        pixels = np.frombuffer(image.data, dtype=np.uint8).reshape(image.height, image.width, 3)
        # There is nothing else, and by day no noise: what is not as the first pixel is the cutter.
        down, across = np.nonzero((pixels != pixels[0, 0]).any(axis=2))
        if columns.min() > 0.0 and columns.max() < image.width - 1.0:
            assert [across.min(), across.max()] == pytest.approx(
                [columns.min(), columns.max()], abs=1.5
            )
            assert [down.min(), down.max()] == pytest.approx([rows.min(), rows.max()], abs=1.5)
            looked += 1
    assert looked > 50
