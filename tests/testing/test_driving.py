"""A small closed loop, the check of channels, and scenes for the tests of plug-ins."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.errors import InputError
from adeye.ports import ChannelContext
from adeye.signals import OK, PLACE_LANE, PLACE_OFFSET, SILENT, ControlCommand, Observation
from adeye.simulate import engine
from adeye.simulate.channels.process.protocol import Witness
from adeye.sweep.case import TestCase
from adeye.testing import (
    Drive,
    ScriptedChannel,
    World,
    channel_context,
    check_channel,
    drive,
    feed,
    scenes,
)
from adeye.trace import Trace
from tests.motorway import cut_ins
from tests.project import CANDIDATE, ROOT, Project

# --- ``plugins``


def scripted(acceleration: float) -> ScriptedChannel:
    channel = ScriptedChannel([acceleration])
    channel.reset(channel_context(None, links=(), sensors={}, channel_id="nominal"))
    return channel


def driven(acceleration: float, world: World, horizon: float, **more: Any) -> Drive:
    channels = {"nominal": scripted(acceleration)}
    return drive(channels, {"nominal": ()}, world, horizon=horizon, **more)


def test_coasting_ego_keeps_its_speed_and_lane() -> None:
    done = driven(0.0, World(speed=20.0), 1.0)
    assert len(done.time) == 21
    assert done.ego[-1, :4] == pytest.approx([20.0, 5.25, 0.0, 20.0])


def test_braking_ego_stops_where_the_closed_form_says() -> None:
    done = driven(-4.0, World(speed=20.0), 8.0)
    # v² / (2 b), and the lag of 0.15 s at full speed.
    assert done.ego[-1, 0] == pytest.approx(20.0**2 / 8.0 + 20.0 * 0.15, abs=0.2)


def test_distance_is_to_the_nearest_body() -> None:
    world = World(objects=lambda _: [[50.0, 5.25, 0, 0, 0], [90.0, 5.25, 0, 0, 0]], speed=0.0)
    assert driven(0.0, world, 0.1).distance.tolist() == pytest.approx([45.5] * 3)
    assert driven(0.0, World(), 0.0).distance[0] == np.inf


def test_hook_makes_a_fault_between_channel_and_switch() -> None:
    def silence(_time: float, proposals: list[ControlCommand]) -> list[ControlCommand]:
        quiet = proposals[0].copy()
        quiet.status[:] = SILENT
        quiet.stamp[:] = -1.0
        return [quiet]

    done = driven(-4.0, World(), 1.0, on_commands=silence)
    assert (done.authority == -1).all()
    assert done.ego[-1, 3] == 30.0


# --- what a channel was shown, saved and fed again: it answers as it did in the run


TICKS = 60
PLUGIN = """
from adeye import ports


class Mine:
    class Parameters(ports.Parameters):
        gain: float = 0.5

    def __init__(self, parameters, context):
        self.gain, self.desired = parameters.gain, context.desired_speed

    def act(self, observation):
        pose = observation.measurements["localisation"]
        ahead = observation.measurements["front_radar"].detections
        return self.gain * (self.desired - pose.estimate[3]) - 0.01 * len(ahead), 0.0
"""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """A project with a channel of every kind, the later ones without authority."""
    made = Project(tmp_path_factory.mktemp("fed") / "project", cut_ins("fed", "30 m"))
    folder = made.folder / "odd" / "architectures"
    (folder / "mine.py").write_text(PLUGIN, "utf-8")
    shutil.copyfile(ROOT / "tests" / "testing" / "keeper.py", folder / "keeper.py")
    seen = {"links": ["localisation", "front_camera", "front_radar"], "rate": "20 Hz"}
    with made.edited(CANDIDATE) as candidate:
        del candidate["channels"]["nominal"]["delay"]
        candidate["channels"] |= {
            "planner": {"kind": "trajectory", **seen},
            "asked": {"kind": "policy", "parameters": {"policy": "./keeper.py:drive"}, **seen},
            "mine": {"kind": "./mine.py:Mine", "parameters": {"gain": 0.25}, **seen},
            "told": {
                "kind": "process",
                "parameters": {"command": ["python3", "./keeper.py"], "values": {"gain": 0.3}},
                **seen,
            },
        }
    return made


def shown(project: Project, channel: str, file: Path) -> tuple[TestCase, Trace]:
    """Run a test case and save what a channel is shown."""
    plan = project.plan()
    case = plan.cases[0]
    with file.open("wb") as stream:
        witness = Witness(channel, stream)
        trace = engine.run([case], base_dirs=plan.folders, most_ticks=TICKS, witness=witness)
    return case, trace


@pytest.mark.slow
@pytest.mark.parametrize("name", ["nominal", "safety", "planner", "asked", "mine", "told"])
def test_every_kind_answers_as_in_the_run(project: Project, tmp_path: Path, name: str) -> None:
    file = tmp_path / "shown.jsonl"
    case, trace = shown(project, name, file)
    kind = case.architecture.channels[name].kind
    fed = list(feed(kind, file, folder=project.folder / "odd" / "architectures"))
    channel = trace.layout.channels.index(name)
    assert [item.tick for item in fed] == list(range(TICKS))
    for column in ("acceleration", "steering_angle", "stamp", "status"):
        answered = np.array([getattr(item.command, column)[0] for item in fed])
        assert np.array_equal(answered, trace[column][0, :TICKS, channel]), column
    assert {item.failure for item in fed} == {None}
    assert len(set(trace["acceleration"][0, :TICKS, channel])) > 2


@pytest.mark.slow
def test_witness_changes_no_bit(project: Project, tmp_path: Path) -> None:
    case, trace = shown(project, "safety", tmp_path / "shown.jsonl")
    again = engine.run([case], base_dirs=project.plan().folders, most_ticks=TICKS)
    assert again.digests() == trace.digests()


class Counting:
    """A channel on the batch that counts what it was shown."""

    monitor_ids: tuple[str, ...] = ()

    def __init__(self) -> None:
        self.seen = 0

    def reset(self, _: object) -> None:
        self.seen = 0

    def act(self, observation: object) -> ControlCommand:
        self.seen += 1
        time = np.array([getattr(observation, "time", np.nan)])
        return ControlCommand("counting", np.zeros(1), np.zeros(1), time, np.array([OK]))


@pytest.mark.slow
def test_channel_of_a_class_or_an_instance_is_fed_one_at_a_time(
    project: Project, tmp_path: Path
) -> None:
    file = tmp_path / "shown.jsonl"
    shown(project, "mine", file)
    counting = Counting()
    fed = feed(counting, file)
    assert [next(fed).tick, next(fed).tick, counting.seen] == [0, 1, 2]
    assert len(list(feed(Counting, file))) == TICKS


WRONG: list[tuple[list[str | None], str, str]] = [
    ([], "1:1", "does not say hello"),
    (["{}"], "1:1", "does not say hello"),
    (["nonsense"], "1:1", "no observation"),
    (['{"hello": "adeye/channel@0"}'], "1:1", "does not say hello"),
    ([None, "{}"], "2:1", "it lacks 'switch'"),
    ([None, "[]"], "2:1", "it is no object"),
]
"""Lines, the first of what was shown for None; where they are wrong, and how."""


@pytest.mark.slow
def test_file_that_holds_something_else_is_refused(project: Project, tmp_path: Path) -> None:
    file = tmp_path / "shown.jsonl"
    shown(project, "mine", file)
    first = file.read_text().splitlines()[0]
    for lines, place, words in WRONG:
        file.write_text("".join(f"{line or first}\n" for line in lines))
        with pytest.raises(InputError, match=words) as caught:
            list(feed(Counting, file))
        assert f"{file}:{place}" in str(caught.value)


def test_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        next(feed(Counting, tmp_path / "missing.jsonl"))


@pytest.mark.slow
def test_saved_lines_are_what_a_program_gets(project: Project, tmp_path: Path) -> None:
    file = tmp_path / "shown.jsonl"
    shown(project, "told", file)
    first, second = (json.loads(line) for line in file.read_text().splitlines()[:2])
    told = [first[name] for name in ("hello", "channel", "kind")]
    assert told == ["adeye/channel@1", "told", "process"]
    assert first["parameters"]["values"] == {"gain": 0.3}
    assert set(second) == {"tick", "time", "sensors", "channels", "switch"}
    assert set(second["sensors"]) == {"localisation", "front_camera", "front_radar"}


# --- The check of channels passes those that conform, and names the rule that another breaks ------


def observation() -> Observation:
    return Observation(0.0, {}, {}, None, np.ones(2, dtype=np.bool_))


def test_scripted_channel_gives_its_script_and_stays_at_the_last_command() -> None:
    channel = ScriptedChannel(np.array([[1.0, 2.0], [3.0, 4.0]]), [0.1])
    channel.reset(channel_context(None, links=(), sensors={}, runs=2))
    rows = [channel.act(observation()).acceleration.tolist() for _ in range(3)]
    assert rows == [[1.0, 3.0], [2.0, 4.0], [2.0, 4.0]]


class Broken:
    """A channel that breaks one rule, by the name of a method."""

    monitor_ids: tuple[str, ...] = ()
    made = 0

    def __init__(self, rule: str) -> None:
        self.rule = rule
        self.context: Any = None
        self.tick = 0
        Broken.made += 1
        self.number = Broken.made

    def reset(self, context: ChannelContext) -> None:
        self.context = context
        if self.rule != "remembers":
            self.tick = 0

    def act(self, seen: Observation) -> ControlCommand:
        self.tick += 1
        runs = self.context.runs
        value = {
            "remembers": float(self.tick),
            "random": float(self.number),
            "batch": float(runs),
            "infinite": np.inf,
        }.get(self.rule, 0.0)
        if self.rule == "alters":
            seen.measurements["front"].detections[:] = 0.0
        if self.rule == "blind":
            assert seen.measurements["pose"].stamp[0] >= 0.0, "cannot go on"
        count = runs + 1 if self.rule == "shape" else runs
        status = np.full(runs, 7 if self.rule == "status" else OK, dtype=np.int64)
        zeros = np.zeros(runs)
        name = "other" if self.rule == "name" else self.context.channel_id
        return ControlCommand(name, np.full(count, value), zeros, zeros, status)


RULES = {
    "remembers": "second reset",
    "random": "equal inputs",
    "batch": "other runs of its batch",
    "infinite": "not finite",
    "shape": "acceleration has shape",
    "status": "unknown",
    "name": "another id",
    "blind": "cannot go on",
    "alters": "read-only",
}


@pytest.mark.parametrize("rule", RULES)
def test_broken_rule_is_named(rule: str) -> None:
    check_channel(lambda: ScriptedChannel([1.0, -1.0]))
    with pytest.raises((AssertionError, ValueError), match=RULES[rule]):
        check_channel(lambda: Broken(rule))


def test_failing_object_per_run_is_found() -> None:
    class Failing:
        def __init__(self, _parameters: Any, _context: Any) -> None:
            pass

        def act(self, _seen: Any) -> Any:
            raise RuntimeError("lost")

    with pytest.raises(AssertionError, match="lost"):
        check_channel(Failing)


# --- Scenes for the tests of plug-ins: contexts, estimates and measurements -----------------------

EGO = np.array([[10.0, 5.25, 0.0, 20.0, 0.0, 0.0, 0.0]])


def test_estimate_knows_the_lane() -> None:
    for y, lane, offset in ((5.25, 1, 0.0), (6.0, 1, 0.75), (-1.0, -1, -2.75)):
        ego = EGO.copy()
        ego[0, 1] = y
        place = scenes.ego_estimate(scenes.straight_road(), ego)[0, 7:]
        assert (place[PLACE_LANE], place[PLACE_OFFSET]) == (lane, pytest.approx(offset))


def test_objects_are_seen_nearest_first_with_their_range_rate() -> None:
    objects = np.array([[[90.0, 5.25, 0, 10, 0], [40.0, 5.25, 0, 25, 0], [999.0, 0, 0, 0, 0]]])
    seen = scenes.object_measurement(EGO, objects, 0.5, sight=100.0)
    assert seen.mask[0].tolist() == [True, True, False]
    assert seen.source[0].tolist() == [1, 0, -1]
    assert seen.detections[0, :2, 0].tolist() == [30.0, 80.0]
    assert seen.detections[0, :2, 2].tolist() == [5.0, -10.0]
    assert seen.estimate is None


def test_pose_has_an_estimate_and_no_detections() -> None:
    seen = scenes.pose_measurement(scenes.straight_road(), EGO, 0.5)
    assert seen.estimate is not None
    assert seen.mask.shape == (1, 0)
