"""A small closed loop, and channels that are fed again with what they were shown."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from adeye.errors import InputError
from adeye.signals import OK, SILENT, ControlCommand
from adeye.simulate import engine
from adeye.simulate.channels.process.protocol import Witness
from adeye.sweep.case import TestCase
from adeye.testing import ScriptedChannel, World, channel_context, drive, feed
from adeye.trace import Trace
from tests.motorway import cut_ins
from tests.project import CANDIDATE, ROOT, Project

# --- ``plugins``


def scripted(acceleration: float) -> ScriptedChannel:
    channel = ScriptedChannel([acceleration])
    channel.reset(channel_context(None, links=(), sensors={}, channel_id="nominal"))
    return channel


def test_coasting_ego_keeps_its_speed_and_lane() -> None:
    done = drive({"nominal": scripted(0.0)}, {"nominal": ()}, World(speed=20.0), horizon=1.0)
    assert len(done.time) == 21
    assert done.ego[-1, :4] == pytest.approx([20.0, 5.25, 0.0, 20.0])


def test_braking_ego_stops_where_the_closed_form_says() -> None:
    done = drive({"nominal": scripted(-4.0)}, {"nominal": ()}, World(speed=20.0), horizon=8.0)
    # v² / (2 b), and the lag of 0.15 s at full speed.
    assert done.ego[-1, 0] == pytest.approx(20.0**2 / 8.0 + 20.0 * 0.15, abs=0.2)


def test_distance_is_to_the_nearest_body() -> None:
    world = World(objects=lambda _: [[50.0, 5.25, 0, 0, 0], [90.0, 5.25, 0, 0, 0]], speed=0.0)
    done = drive({"nominal": scripted(0.0)}, {"nominal": ()}, world, horizon=0.1)
    assert done.distance.tolist() == pytest.approx([45.5] * 3)
    assert (
        drive({"nominal": scripted(0.0)}, {"nominal": ()}, World(), horizon=0.0).distance[0]
        == np.inf
    )


def test_hook_makes_a_fault_between_channel_and_switch() -> None:
    def silence(_time: float, proposals: list[ControlCommand]) -> list[ControlCommand]:
        quiet = proposals[0].copy()
        quiet.status[:] = SILENT
        quiet.stamp[:] = -1.0
        return [quiet]

    done = drive(
        {"nominal": scripted(-4.0)}, {"nominal": ()}, World(), horizon=1.0, on_commands=silence
    )
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "place", "words"),
    [
        ([], "1:1", "does not say hello"),
        (["{}"], "1:1", "does not say hello"),
        (["nonsense"], "1:1", "no observation"),
        (['{"hello": "adeye/channel@0"}'], "1:1", "does not say hello"),
        ([None, "{}"], "2:1", "it lacks 'switch'"),
        ([None, "[]"], "2:1", "it is no object"),
    ],
)
def test_file_that_holds_something_else_is_refused(
    project: Project, tmp_path: Path, lines: Sequence[str | None], place: str, words: str
) -> None:
    file = tmp_path / "shown.jsonl"
    shown(project, "mine", file)
    first = file.read_text().splitlines()[0]
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
    assert (first["hello"], first["channel"], first["kind"]) == (
        "adeye/channel@1",
        "told",
        "process",
    )
    assert first["parameters"]["values"] == {"gain": 0.3}
    assert set(second) == {"tick", "time", "sensors", "channels", "switch"}
    assert set(second["sensors"]) == {"localisation", "front_camera", "front_radar"}
