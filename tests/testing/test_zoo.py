"""Channels that misbehave: each gets its outcome, and the runs beside it keep every bit."""

from __future__ import annotations

import resource
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.campaign.parts import load_parts
from adeye.signals import SILENT, Observation
from adeye.simulate import engine
from adeye.simulate.channels.process.channel import ProcessChannel
from adeye.spec.architecture import Architecture
from adeye.spec.channels import ProcessParameters
from adeye.spec.load import load_architecture
from adeye.spec.quantity import SI
from adeye.testing import channel_context, straight_road, zoo
from adeye.testing.scenes import pose_measurement
from tests.project import CANDIDATE, Project

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.sweep.case import TestCase
    from adeye.trace import ChannelEvent, Trace

TICKS = 12
GAPS = ("30 m", "50 m")
ODD: dict[str, Any] = {
    "odd": "zoo",
    "scenarios": [{"use": "cut_in", "sweep": {"parameters": {"gap": list(GAPS)}}}],
    "architectures": ["architectures/camera_radar.yaml"],
    "concept": "concepts/motorway_chauffeur.yaml",
    "gate": {"architectures": ["camera_radar"]},
    "step": "0.05 s",
    "seed": 7,
}


@dataclass(frozen=True)
class Visit:
    """What a batch with the whole zoo in it came to."""

    names: tuple[str, ...]
    mixed: Trace
    honest: Trace
    open_before: int
    open_after: int
    grown_mib: float
    left: list[str]

    def event(self, name: str) -> ChannelEvent | None:
        return self.mixed.channel_events[self.names.index(name)]


def case_of(case: TestCase, name: str) -> TestCase:
    """Put an animal into the architecture of a test case."""
    content = case.architecture.model_dump(mode="json")
    content["channels"]["guest"]["parameters"] = ProcessParameters.model_validate(
        zoo.parameters(name)
    ).model_dump(mode="json")
    return replace(case, architecture=Architecture.model_validate(content, context=SI))


def processes_of(word: str) -> list[str]:
    """List the processes whose command line has a word."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            with suppress(OSError):
                line = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                if word in line:
                    found.append(line)
    return found


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def built(folder: Path) -> Project:
    project = Project(folder, ODD)
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["guest"] = {
            "kind": "process",
            "links": ["localisation", "front_camera", "channels.nominal", "switch"],
            "rate": "20 Hz",
            "parameters": zoo.parameters(),
        }
    zoo.settle(folder / "odd" / "architectures")
    return project


def run(project: Project, cases: Sequence[TestCase]) -> Trace:
    return engine.run(cases, base_dirs=project.plan().folders, most_ticks=TICKS)


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Visit:
    project = built(tmp_path_factory.mktemp("zoo") / "project")
    first, second = project.plan().cases
    names = ("", *zoo.ANIMALS, "")
    beside = [first, *(case_of(first, name) for name in zoo.ANIMALS), second]
    honest = run(project, [first, second])
    before, size = open_files(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ADEYE_CANARY", "secret")
        mixed = run(project, beside)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return Visit(
        names,
        mixed,
        honest,
        before,
        open_files(),
        (after - size) / 1024,
        processes_of(str(project.folder)),
    )


@pytest.mark.parametrize("name", zoo.ANIMALS)
def test_animal_gets_its_outcome(visit: Visit, name: str) -> None:
    animal, event = zoo.ANIMALS[name], visit.event(name)
    if animal.outcome == zoo.COMPLETED:
        assert event is None
        return
    assert event is not None
    assert (event.outcome, event.channel) == (animal.outcome, "guest")
    assert animal.detail in event.detail
    assert event.is_machine_dependent == animal.is_machine_dependent
    assert "/" not in event.detail.replace("adeye/channel@", "")


def test_runs_beside_the_zoo_keep_every_bit(visit: Visit) -> None:
    digests = visit.mixed.digests()
    assert [digests[0], digests[-1]] == visit.honest.digests()
    assert visit.mixed.channel_events[0] is visit.mixed.channel_events[-1] is None


def test_failed_channel_is_silent_from_then_on_and_its_run_goes_on(visit: Visit) -> None:
    channel = visit.mixed.layout.channels.index("guest")
    for name, animal in zoo.ANIMALS.items():
        run = visit.names.index(name)
        silent = visit.mixed["status"][run, :TICKS, channel] == SILENT
        assert visit.mixed.length[run] > TICKS
        assert silent.any() == (animal.outcome != zoo.COMPLETED), name
        assert np.all(np.diff(silent.astype(int)) >= 0), name


def test_nothing_is_left_of_the_zoo(visit: Visit) -> None:
    assert visit.left == []
    assert visit.open_after == visit.open_before
    assert visit.grown_mib < 50.0


def test_zoo_has_twenty_animals_and_every_outcome_of_a_channel() -> None:
    outcomes = [animal.outcome for animal in zoo.ANIMALS.values()]
    assert len(outcomes) >= 20
    assert set(outcomes) == {
        "completed",
        *(f"channel_{what}" for what in ("error", "timeout", "invalid_output", "killed")),
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sleeps", "stops_itself", "ignores_sigterm"])
def test_hang_costs_at_most_a_second_beyond_its_deadline(tmp_path: Path, name: str) -> None:
    zoo.settle(tmp_path)
    content = zoo.parameters(name)
    content["step_deadline"] = "0.5 s"
    content["values"]["from_tick"] = 0
    channel = ProcessChannel(tmp_path)
    context = channel_context(
        ProcessParameters.model_validate(content), links=(), sensors={"pose": "localisation"}
    )
    channel.reset(context)
    ego = np.zeros((1, 7))
    seen = {"pose": pose_measurement(straight_road(), ego, 0.0)}
    observation = Observation(0.0, seen, {}, None, np.ones(1, dtype=np.bool_))
    begin = time.perf_counter()
    command = channel.act(observation)
    channel.close()
    took = time.perf_counter() - begin
    assert command.status.tolist() == [SILENT]
    assert 0.5 <= took < 1.5
    assert processes_of(str(tmp_path)) == []


def test_program_of_the_zoo_is_part_of_the_identity(tmp_path: Path) -> None:
    project = built(tmp_path / "project")
    path = project.folder / CANDIDATE
    before = load_parts(load_architecture(path)).digest
    with (path.parent / "zoo.py").open("a") as stream:
        stream.write("# changed\n")
    assert load_parts(load_architecture(path)).digest != before != ""
