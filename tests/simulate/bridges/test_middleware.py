"""Channels over a middleware: real nodes in processes of their own, honest ones and others."""

import io
import math
import os
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from adeye.campaign.run import fitting
from adeye.errors import InputError
from adeye.signals import SILENT, ControlCommand, Observation
from adeye.simulate.bridges import bridge_program, middleware, ros_messages
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.process.channel import MOST_PROGRAMS
from adeye.spec.channels import RosParameters, Topic
from adeye.store.read.query import run_query
from adeye.testing import channel_context
from adeye.trace import ChannelEvent
from docs import walk
from tests.conftest import MakeProject
from tests.frozen import assert_frozen, described
from tests.motorway import cut_ins
from tests.project import Project
from tests.refusals import refused
from tests.simulate.bridges import misdeeds
from tests.simulate.bridges.misdeeds import MISDEEDS, TICKS

PAGE = Path(__file__).resolve().parents[3] / "docs" / "guide" / "middleware.md"
ROS_1 = Path(middleware.ROS_1, "rospy").is_dir()
KINDS = [
    pytest.param("zenoh", marks=pytest.mark.skipif(not find_spec("zenoh"), reason="no zenoh")),
    pytest.param("ros2", marks=pytest.mark.skipif(not find_spec("cyclonedds"), reason="no DDS")),
    pytest.param("ros1", marks=pytest.mark.skipif(not ROS_1, reason="ROS 1 is not installed")),
]
"""Real ones; ROS 1 where Debian's packages are."""


# --- What a tick is told as ---------------------------------------------------------------------

HELLO: Mapping[str, Any] = {
    "parameters": {"topics": {"odom": "localization/odometry"}},
    "sensors": {
        "pose": {"kind": "localisation", "mount": None},
        "radar": {"kind": "radar", "mount": [2.0, 0.5, 0.5, np.pi / 2]},
        "lidar": {"kind": "lidar", "mount": [1.0, 0.0, 1.8, 0.1]},
        "imu": {"kind": "imu", "mount": [0.0, 0.0, 0.0, 0.0]},
        "gnss": {"kind": "gnss", "mount": None},
    },
}


def sample(**content: Any) -> dict[str, Any]:
    plain = {"stamp": 0.1, "fresh": True, "alive": True, "most": 0, "detections": []}
    return {**plain, **content}


def told(version: int = 2, **sensors: Any) -> dict[str, list[Any]]:
    topics = ros_messages.Topics(HELLO, version)
    shown = {"tick": 3, "time": 0.15, "sensors": sensors}
    found: dict[str, list[Any]] = {}
    for topic, message in topics.messages(b"{}\n", shown):
        found.setdefault(topic, []).append(message)
    return found


SEEN = [[40.0, 2.0, 1.0, 0.0, 4.5, 1.8, 1], [25.0, -3.5, None, 0.5, 9.0, 2.5, -1]]
ESTIMATE = [120.0, -4.0, 0.3, 22.0, 1.5, 0.02, 0.05, 3.5, 3, 0.25, 0.01, 1, 0.4]
POINTS = [[10.0, 0.2, 0.1], [0.0, 0.3, 0.1], [31.5, -1.2, -0.05]]
EVERYTHING = {
    "pose": sample(estimate=ESTIMATE),
    "radar": sample(most=8, detections=SEEN, stamp=1.25),
    "lidar": sample(points=POINTS, most=2, detections=SEEN[:1], stamp=0.05),
    "imu": sample(values=[0.5, -0.25, 0.125]),
    "gnss": sample(values=[1500.0, -2500.0]),
}


@pytest.mark.parametrize("version", [1, 2])
def test_messages_are_frozen(version: int) -> None:
    """Of a tick at which all deliver, of one without a position, and of one of nothing new."""
    lines = []
    for name, content in (
        ("all", EVERYTHING),
        ("no position", {"gnss": sample(values=[None, None]), "pose": sample(fresh=False)}),
        ("nothing new", {name: {**item, "fresh": False} for name, item in EVERYTHING.items()}),
    ):
        for topic, messages in told(version, **content).items():
            for message in messages:
                lines += described(message, f"{name} {topic}")
    topics = ros_messages.Topics(HELLO, version)
    list(topics.messages(b"{}\n", {"tick": 7, "time": 0.35, "sensors": {}}))
    for secs, nsecs in ((0, 350_000_000), (0, 350_000_001), (0, 0), (1, 0)):
        lines += described(topics.answer(secs, nsecs, 1.5, math.nan), f"answer {secs} {nsecs}")
    for kind, parts in ros_messages.definitions(version).items():
        lines.append(f"{kind}: {'; '.join(str(part) for part in parts)}")
    assert_frozen(f"ros_{version}.txt", "\n".join([*lines, ""]))


def test_topics_that_can_be_renamed_are_those_that_there_are() -> None:
    assert set(get_args(Topic)) == {*ros_messages.TOPICS, ros_messages.COMMAND}
    assert ros_messages.Topics(HELLO, 2).topic("odom") == "localization/odometry"
    assert ros_messages.Topics(HELLO, 2).topic("imu") == "imu"


def test_clock_comes_last_and_a_sensor_without_a_sample_is_not_told() -> None:
    found = told(radar=sample(most=4, fresh=False), gnss=sample(values=[None, None], fresh=False))
    assert list(found) == ["tf", "adeye/observation", "clock"]
    assert found["clock"] == [{"clock": {"secs": 0, "nsecs": 150_000_000}}]


def test_frames_lead_from_the_map_to_the_sensors_and_to_the_lane() -> None:
    heading = 0.3
    estimate = [10.0, 5.0, 0.35, 20.0, 0.0, 0.0, 0.0, 0.0, 0.0, heading, 0.0, 1, 0.5]
    found = told(pose=sample(estimate=estimate), radar=sample(most=4))
    frames = {item["child_frame_id"]: item for item in found["tf"][0]["transforms"]}
    parents = {name: item["header"]["frame_id"] for name, item in frames.items()}
    assert parents == {"base_link": "map", "lane": "map", "radar": "base_link"}
    lane = frames["lane"]["transform"]["translation"]
    # The ego is half a metre to the left of the centre of its lane.
    across = np.cos(heading) * (5.0 - lane["y"]) - np.sin(heading) * (10.0 - lane["x"])
    assert across == pytest.approx(0.5)
    assert frames["radar"]["transform"]["rotation"]["z"] == pytest.approx(np.sqrt(0.5))


@pytest.mark.parametrize("version", [1, 2])
def test_detection_is_in_the_frame_of_its_sensor(version: int) -> None:
    row = [12.0, 3.5, -2.0, 1.0, 4.5, 1.8, 2.0]
    (found,) = told(version, radar=sample(most=4, detections=[row]))["objects"]
    assert found["header"]["frame_id"] == "radar"
    (item,) = found["detections"]
    # The radar looks to the left: 10 m ahead of it is to its right.
    assert item["bbox"]["center"]["position"] == pytest.approx({"x": 3.0, "y": -10.0, "z": 0.0})
    (result,) = item["results"]
    known = {"id": 2, "score": 1.0} if version == 1 else {"class_id": "2", "score": 1.0}
    assert (result if version == 1 else result["hypothesis"]).items() >= known.items()


def test_points_are_those_beams_that_have_a_return() -> None:
    (cloud,) = told(lidar=sample(points=[[0.0, 0.0, 0.0], [10.0, 0.1, 0.0]]))["points"]
    assert (cloud["width"], cloud["height"], len(cloud["data"])) == (1, 1, 12)
    assert (cloud["point_step"], cloud["row_step"], cloud["is_dense"]) == (12, 12, True)
    assert np.frombuffer(cloud["data"], "<f4") == pytest.approx([10.0, 0.0, 0.0])


def test_fix_leads_back_to_the_map() -> None:
    (fix,) = told(gnss=sample(values=[100.0, -50.0, 1.0, 0.0]))["fix"]
    east = np.radians(fix["longitude"]) * ros_messages.METRES_EAST
    north = np.radians(fix["latitude"]) * ros_messages.METRES_NORTH
    assert (east, north) == pytest.approx((100.0, -50.0))


@pytest.mark.skipif(not ROS_1, reason="ROS 1 is not installed")
def test_definitions_are_those_of_ros_1(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path, middleware.ROS_1])
    from genmsg import MsgContext
    from genmsg.gentools import compute_md5
    from genmsg.msg_loader import load_depends, load_msg_from_string

    context = MsgContext.create_default()
    specs = {}
    for kind, fields in ros_messages.definitions(1).items():
        lines = [
            f"{item.kind}{'' if item.length is None else f'[{item.length or str()}]'} {item.name}"
            + (f"={item.constant}" if item.constant else "")
            for item in fields
        ]
        specs[kind] = load_msg_from_string(context, "\n".join(lines), kind)
    for spec in specs.values():
        load_depends(context, spec, {})
    # As the packages of ROS have them.
    known = {
        "ackermann_msgs/AckermannDriveStamped": "1fd5d7f58889cefd44d29f6653240d0c",
        "nav_msgs/Odometry": "cd5e73d190d741a2f92e81eda573aca7",
        "rosgraph_msgs/Clock": "a9c97c1d230cfc112e270351a944ee47",
        "sensor_msgs/Imu": "6a62c6daae103f4ff57a132d6f95cec2",
        "sensor_msgs/NavSatFix": "2d3a8cd499b9b4a0249fb98fd05cfa48",
        "sensor_msgs/PointCloud2": "1158d486dd51d683ce2f1be655c3c181",
        "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec",
        "vision_msgs/Detection3DArray": "05c51d9aea1fb4cfdc8effb94f197b6f",
    }
    assert {kind: compute_md5(context, specs[kind]) for kind in known} == known


def test_middleware_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(middleware, "find_spec", lambda _: None)
    monkeypatch.setattr(middleware, "ROS_1", "/nowhere")
    for kind in middleware.MIDDLEWARE:
        caught = refused(InputError, middleware.require, kind, says=f"kind {kind} needs ")
        assert "install" in caught.remedy
    middleware.require("process")


# --- What the first tick may lose ---------------------------------------------------------------


class Alive:
    """A node that is there."""

    def __init__(self, *given: Any) -> None:
        del given

    def require(self, patience: float = 0.0) -> None:
        del patience

    def kill(self) -> None:
        pass


class Forgetful:
    """A middleware that loses the first messages, with a node that answers what reaches it."""

    def __init__(self, lost: int) -> None:
        self.lost = lost
        self.told: list[int] = []
        self._answers: list[Any] = []

    def open(self, hello: dict[str, Any]) -> dict[str, str]:
        del hello
        return {}

    def links(self) -> int:
        return 2

    def greet(self, line: bytes) -> Any:
        return {"hello": line.decode()}

    def publish(self, line: bytes, shown: dict[str, Any]) -> None:
        del line
        self.told.append(shown["tick"])
        if len(self.told) > self.lost:
            self._answers.append({"tick": shown["tick"]})

    def receive(self, patience: float) -> Any:
        if self._answers:
            return self._answers.pop(0)
        time.sleep(patience)
        return None


@pytest.mark.parametrize("lost", [0, 2])
def test_only_the_first_tick_is_told_again(
    lost: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, value in {"WATCH_S": 0.001, "SETTLED_S": 0.0, "AGAIN_S": 0.01}.items():
        monkeypatch.setattr(bridge_program, name, value)
    monkeypatch.setattr(bridge_program, "Node", Alive)
    peer, answers = Forgetful(lost), list[Any]()
    ticks = b"".join(b'{"tick": %d}\n' % tick for tick in range(3))
    bridge_program.serve(peer, ["node"], io.BytesIO(b"{}\n" + ticks), answers.append)
    assert peer.told == [0] * (lost + 1) + [1, 2]
    assert answers[1:] == [{"tick": 0}, {"tick": 1}, {"tick": 2}]


class Hasty(Forgetful):
    """A node that answers the next tick with each."""

    def publish(self, line: bytes, shown: dict[str, Any]) -> None:
        super().publish(line, shown)
        super().publish(line, {"tick": shown["tick"] + 1})


def test_answer_that_is_there_before_it_is_asked_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(bridge_program, "SETTLED_S", 0.0)
    monkeypatch.setattr(bridge_program, "Node", Alive)
    answers = list[Any]()
    ticks = b"".join(b'{"tick": %d}\n' % tick for tick in range(2))
    bridge_program.serve(Hasty(0), ["node"], io.BytesIO(b"{}\n" + ticks), answers.append)
    assert answers[1:] == [{"tick": 0}, {"tick": "1, before it is asked"}]


# --- Nodes that misbehave -------------------------------------------------------------------------


@dataclass(frozen=True)
class Visit:
    """What a batch with every misdeed in it came to."""

    kind: str
    events: dict[str, ChannelEvent | None]
    answers: list[ControlCommand]
    open_before: int
    open_after: int
    ports: set[str]
    left: list[str]

    def of(self, name: str) -> list[float]:
        at = list(MISDEEDS).index(name)
        return [float(answer.acceleration[at]) for answer in self.answers]


def below(pid: int) -> list[int]:
    """List the descendants of a process."""
    found: list[int] = []
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                found += [int(child), *below(int(child))]
    return found


def sockets() -> set[str]:
    """List the inodes of sockets that listen on TCP, or have a port of UDP."""
    lines = [
        line.split()
        for name in ("tcp", "tcp6", "udp", "udp6")
        for line in Path("/proc/net", name).read_text().splitlines()[1:]
    ]
    return {line[9] for line in lines if line[3] in {"0A", "07"}}


def ports_of(pids: list[int]) -> set[str]:
    """List the inodes of open ports that some processes have."""
    found = set()
    for pid in pids:
        with suppress(OSError):
            for entry in Path(f"/proc/{pid}/fd").iterdir():
                with suppress(OSError):
                    found.add(str(entry.readlink()).removeprefix("socket:[").rstrip("]"))
    return found & sockets()


def misdeed_parameters(kind: str, name: str) -> dict[str, Any]:
    python = "/usr/bin/python3" if kind == "ros1" else sys.executable
    return {
        "command": [Path(python).name, "./misdeeds.py"],
        "values": {"misdeed": name, "at": 3, "middleware": kind},
        "start_deadline": "20 s",
        "step_deadline": "2 s",
    }


@pytest.fixture(scope="module", params=KINDS)
def visit(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Visit:
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "misdeeds.py").write_text(Path(misdeeds.__file__).read_text("utf-8"), "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        first = "/usr/bin" if request.param == "ros1" else str(Path(sys.executable).parent)
        patch.setenv("PATH", os.pathsep.join([first, os.environ["PATH"]]))
        given = [
            RosParameters.model_validate(misdeed_parameters(request.param, name))
            for name in MISDEEDS
        ]
        others = set(below(os.getpid()))  # of the tests before: they are no matter of this one
        open_before = len(list(Path("/proc/self/fd").iterdir()))
        channel: Any = make_channel(request.param, folder)
        channel.reset(channel_context(given, links=(), sensors={}, runs=len(given)))
        started = [pid for pid in below(os.getpid()) if pid not in others]
        ports = ports_of(started)
        assert ports
        running = np.ones(len(given), dtype=bool)
        answers = [
            channel.act(Observation(0.05 * tick, {}, {}, None, running)) for tick in range(TICKS)
        ]
        channel.close()
    return Visit(
        request.param,
        dict(zip(MISDEEDS, channel.events, strict=True)),
        answers,
        open_before,
        len(list(Path("/proc/self/fd").iterdir())),
        ports & sockets(),
        [str(pid) for pid in started if Path(f"/proc/{pid}").exists()],
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", MISDEEDS)
def test_misdeed_ends_as_the_guide_says(visit: Visit, name: str) -> None:
    event, expected = visit.events[name], MISDEEDS[name]
    if not expected.outcome:
        assert event is None
        assert visit.of(name) == pytest.approx([0.1 * tick for tick in range(TICKS)])
        return
    assert event is not None
    at_hello = {"ends_at_once", "never_connects", "wrong_type"}
    assert event.time == (0.0 if name in at_hello else pytest.approx(0.15))
    if name == "wrong_type" and visit.kind == "zenoh":  # it connects, there are no types
        expected = misdeeds.Misdeed("channel_invalid_output", "is no JSON object")
    assert event.outcome == expected.outcome
    assert expected.words in event.detail
    at = list(MISDEEDS).index(name)
    assert visit.answers[-1].status[at] == SILENT


@pytest.mark.slow
def test_nothing_is_left_of_nodes(visit: Visit) -> None:
    assert visit.left == []
    assert visit.ports == set()
    assert visit.open_after == visit.open_before


# --- The nodes of the guide, in closed loop -------------------------------------------------------

DEATHS = {
    "zenoh": ("    ego = seen", "seen['tick']"),
    "ros2": ("    poses, trees", "tick.clock.nanosec / 5e7 + 20 * tick.clock.sec"),
    "ros1": ("    ego, road =", "20 * stamp.to_sec()"),
}
"""Line of each node of the guide that one is written before which ends it, and its number of the
tick."""


def settled(make_project: MakeProject, architecture: str) -> Project:
    """Make a project with the nodes of the guide that drives an architecture of it."""
    project = make_project(cut_ins("nodes", "60 m"))
    folder = project.folder / "odd" / "architectures"
    for name, text in walk.files_of(PAGE.read_text("utf-8")).items():
        if name.startswith("nodes/odd/architectures/"):
            path = folder / Path(name).name
            path.write_text(text, "utf-8")
            path.chmod(0o755)
    with project.edited_odd() as odd:
        odd["architectures"] = [f"architectures/{architecture}.yaml"]
        odd["gate"] = {"architectures": [architecture]}
    return project


def drive(project: Project, repetitions: int) -> dict[str, Any]:
    """Drive that often, see that it is the same each time, and return the run."""
    found = []
    for repetition in range(repetitions):
        project.run(db=f"{repetition}.db")
        found.append(project.rows(db=f"{repetition}.db"))
    seen = {str([(row["trace_digest"], row["verdicts"]) for row in rows]) for rows in found}
    assert len(seen) == 1, [[row["outcome_detail"] for row in rows] for rows in found]
    (row,) = found[0]
    return row


@pytest.fixture(autouse=True)
def python_of_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    monkeypatch.setenv("PATH", path)


@pytest.mark.parametrize("kind", KINDS)
def test_fewer_nodes_than_programs_run_at_once(make_project: MakeProject, kind: str) -> None:
    plan = settled(make_project, f"on_{kind}").plan()
    assert fitting(plan.examples()) == MOST_PROGRAMS // middleware.COUNTS_AS


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_node_of_the_guide_closes_the_loop(make_project: MakeProject, kind: str) -> None:
    row = drive(settled(make_project, f"on_{kind}"), 3)
    assert row["outcome"] == "completed"
    # It never brakes for what is ahead, and is not relieved of it.
    assert row["max_acceleration_mps2"] < 1.0
    assert row["verdicts"]["FSR-02"] == "FAIL"


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_safety_channel_takes_over_from_a_killed_node(make_project: MakeProject, kind: str) -> None:
    project = settled(make_project, f"on_{kind}")
    node = project.folder / "odd" / "architectures" / f"{kind}_node.py"
    anchor, tick = DEATHS[kind]
    text = node.read_text("utf-8")
    assert text.count(anchor) == 1
    death = f"    if {tick} > 39.5: os.kill(os.getpid(), 9)\n{anchor}"
    node.write_text(text.replace(anchor, death), "utf-8")
    row = drive(project, 3)
    detail = "at 2 s: ended with code 1 without an answer: its node ended by signal 9"
    assert (row["outcome"], row["outcome_channel"]) == ("channel_error", "nominal")
    assert row["outcome_detail"] == detail
    assert row["verdicts"]["FSR-02"] == "PASS"
    query = "SELECT time_s FROM v_timeline WHERE text LIKE 'authority to safety from nominal%'"
    ((time,),) = run_query(project.folder / "0.db", query).rows
    assert 2.0 < time < 2.5


@pytest.mark.slow
@pytest.mark.skipif(not ROS_1, reason="ROS 1 is not installed")
def test_launch_file_of_the_guide_closes_the_same_loop(make_project: MakeProject) -> None:
    project = settled(make_project, "launched")
    launched = drive(project, 1)
    with project.edited_odd() as odd:
        odd["architectures"] = ["architectures/on_ros1.yaml"]
        odd["gate"] = {"architectures": ["on_ros1"]}
    assert launched["outcome"] == "completed", launched["outcome_detail"]
    assert launched["trace_digest"] == drive(project, 1)["trace_digest"]
