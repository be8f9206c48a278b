"""Channels that misbehave: each gets its outcome, and the runs beside it keep every bit."""

import ast
import json
import os
import random  # noqa: TID251 - plug-ins seed it
import resource
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

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
from adeye.sweep.case import TestCase
from adeye.testing import channel_context, straight_road, zoo
from adeye.testing.scenes import pose_measurement
from adeye.testing.zoo import plugin as zoo_plugin
from adeye.testing.zoo import program
from adeye.trace import ChannelEvent, Trace
from tests.motorway import cut_ins
from tests.project import CANDIDATE, ROOT, Project

TICKS = 12
LINKS = ["localisation", "front_camera", "channels.nominal", "switch"]


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


def case_of(case: TestCase, kind: str, parameters: dict[str, Any]) -> TestCase:
    """Put an animal into the architecture of a test case."""
    content = case.architecture.model_dump(mode="json")
    content["channels"]["guest"] |= {"kind": kind, "parameters": parameters}
    return replace(case, architecture=Architecture.model_validate(content, context=SI))


def program_case(case: TestCase, name: str) -> TestCase:
    parameters = ProcessParameters.model_validate(zoo.parameters(name))
    return case_of(case, "process", parameters.model_dump(mode="json"))


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


def built(folder: Path, kind: str, parameters: dict[str, Any]) -> Project:
    """Copy a project whose candidate has an honest guest; each animal takes its place."""
    project = Project(folder, cut_ins("zoo", "30 m", "50 m"))
    guest = {"kind": kind, "links": LINKS, "rate": "20 Hz", "parameters": parameters}
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["guest"] = guest
    zoo.settle(folder / "odd" / "architectures")
    return project


def plugin_project(folder: Path) -> Project:
    return built(folder, "./zoo_plugin.py:One", {"animal": ""})


def judge(animal: zoo.Animal, event: ChannelEvent | None) -> None:
    """Say whether the event of a run is the one that its animal must have."""
    if animal.outcome == zoo.COMPLETED:
        assert event is None
        return
    assert event is not None
    assert (event.outcome, event.channel) == (animal.outcome, "guest")
    assert animal.detail in event.detail
    assert len(event.detail) <= 500
    assert event.detail.encode()
    assert event.is_machine_dependent == animal.is_machine_dependent
    assert str(ROOT) not in event.detail


def run(project: Project, cases: Sequence[TestCase]) -> Trace:
    return engine.run(cases, base_dirs=project.plan().folders, most_ticks=TICKS)


def is_costly(name: str) -> bool:
    """Tell who burns time or waits for its deadline; one who only sleeps stays with the others."""
    animal = zoo.ANIMALS[name]
    greedy = {"burns_the_processor", "forks", "leaks_memory"}
    return name in greedy or (animal.outcome == zoo.TIMEOUT and name != "sleeps")


COSTLY = [name for name in zoo.ANIMALS if is_costly(name)]
BRIEF = [name for name in zoo.ANIMALS if name not in COSTLY]


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(BRIEF, id="brief"),
        pytest.param(COSTLY, marks=pytest.mark.slow, id="costly"),
    ],
)
def visit(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Visit:
    animals: list[str] = request.param
    project = built(tmp_path_factory.mktemp("zoo") / "project", "process", zoo.parameters())
    first, second = project.plan().cases
    names = ("", *animals, "")
    beside = [first, *(program_case(first, name) for name in animals), second]
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


@pytest.mark.parametrize(
    ("visit", "name"),
    [
        *(pytest.param(BRIEF, name, id=name) for name in BRIEF),
        *(pytest.param(COSTLY, name, id=name, marks=pytest.mark.slow) for name in COSTLY),
    ],
    indirect=["visit"],
    scope="module",
)
def test_animal_gets_its_outcome(visit: Visit, name: str) -> None:
    event = visit.event(name)
    judge(zoo.ANIMALS[name], event)
    assert event is None or "/" not in event.detail.replace("adeye/channel@", "")


def test_runs_beside_the_zoo_keep_every_bit(visit: Visit) -> None:
    digests = visit.mixed.digests()
    assert [digests[0], digests[-1]] == visit.honest.digests()
    assert visit.mixed.channel_events[0] is visit.mixed.channel_events[-1] is None


def test_failed_channel_is_silent_from_then_on_and_its_run_goes_on(visit: Visit) -> None:
    channel = visit.mixed.layout.channels.index("guest")
    for run, name in enumerate(visit.names[1:-1], start=1):
        animal = zoo.ANIMALS[name]
        silent = visit.mixed["status"][run, :TICKS, channel] == SILENT
        assert visit.mixed.length[run] > TICKS
        assert silent.any() == (animal.outcome != zoo.COMPLETED), name
        assert np.all(np.diff(silent.astype(int)) >= 0), name


def test_nothing_is_left_of_the_zoo(visit: Visit) -> None:
    assert visit.left == []
    assert visit.open_after == visit.open_before
    assert visit.grown_mib < 50.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sleeps", "stops_itself", "ignores_sigterm"])
def test_hang_costs_at_most_a_second_beyond_its_deadline(tmp_path: Path, name: str) -> None:
    zoo.settle(tmp_path)
    content = zoo.parameters(name)
    content["step_deadline"] = "0.5 s"
    content["values"]["from_tick"] = 0
    parameters = ProcessParameters.model_validate(content)
    channel = ProcessChannel(tmp_path)
    channel.reset(channel_context(parameters, links=(), sensors={"pose": "localisation"}))
    seen = {"pose": pose_measurement(straight_road(), np.zeros((1, 7)), 0.0)}
    observation = Observation(0.0, seen, {}, None, np.ones(1, dtype=np.bool_))
    begin = time.perf_counter()
    command = channel.act(observation)
    channel.close()
    assert 0.5 <= time.perf_counter() - begin < 1.5
    assert command.status.tolist() == [SILENT]
    assert processes_of(str(tmp_path)) == []


def test_program_of_the_zoo_is_part_of_the_identity(tmp_path: Path) -> None:
    project = built(tmp_path / "project", "process", zoo.parameters())
    path = project.folder / CANDIDATE
    before = load_parts(load_architecture(path)).digest
    with (path.parent / "zoo.py").open("a") as stream:
        stream.write("# changed\n")
    assert load_parts(load_architecture(path)).digest != before != ""


# --- plug-ins that misbehave: each gets its outcome, and the runs beside it keep every bit


@dataclass(frozen=True)
class PluginVisit:
    """Where the zoo is, two situations to drive, and what they are like without mischief."""

    project: Project
    folders: Mapping[str, Path]
    cases: tuple[TestCase, TestCase]
    honest: dict[str, Trace]

    def run(self, kind: str, names: Sequence[str], cases: Sequence[TestCase]) -> Trace:
        made = [plugin_case(case, kind, name) for case, name in zip(cases, names, strict=True)]
        with spoilt(self.project.folder):
            return engine.run(made, base_dirs=self.folders, most_ticks=TICKS)


@contextmanager
def spoilt(folder: Path) -> Iterator[None]:
    """Give what plug-ins can spoil in a process back to the other tests."""
    zoo_plugin.KEPT.clear()
    state, strictness, seed = random.getstate(), np.geterr(), np.random.get_state()  # noqa: NPY002
    streams = sys.stdin, sys.stdout
    with (
        warnings.catch_warnings(),
        (folder / "in").open("w+") as stdin,
        (folder / "out").open("w+") as stdout,
    ):
        sys.stdin, sys.stdout = stdin, stdout
        try:
            yield
        finally:
            sys.stdin, sys.stdout = streams
    assert np.geterr() == strictness
    random.setstate(state)
    np.random.set_state(seed)  # noqa: NPY002


def plugin_case(case: TestCase, kind: str, name: str) -> TestCase:
    parameters = {"animal": name, "from_tick": zoo.FROM_TICK}
    return case_of(case, f"./zoo_plugin.py:{kind}", parameters)


@pytest.fixture(scope="module")
def plugin_visit(tmp_path_factory: pytest.TempPathFactory) -> PluginVisit:
    project = plugin_project(tmp_path_factory.mktemp("zoo") / "project")
    plan = project.plan()
    first, second = plan.cases
    empty = PluginVisit(project, plan.folders, (first, second), {})
    honest = {kind: empty.run(kind, ("", ""), (first, second)) for kind in ("One", "Herd")}
    return replace(empty, honest=honest)


@pytest.mark.parametrize("name", zoo.OBJECTS)
def test_object_gets_its_outcome_and_runs_beside_it_keep_every_bit(
    plugin_visit: PluginVisit, name: str
) -> None:
    first, second = plugin_visit.cases
    trace = plugin_visit.run("One", ("", name, ""), (first, first, second))
    judge(zoo.OBJECTS[name], trace.channel_events[1])
    digests = trace.digests()
    assert [digests[0], digests[2]] == plugin_visit.honest["One"].digests()
    assert trace.channel_events[0] is trace.channel_events[2] is None


@pytest.mark.parametrize("name", zoo.HERDS)
def test_herd_gets_its_outcome_and_the_other_channels_keep_every_bit(
    plugin_visit: PluginVisit, name: str
) -> None:
    trace, honest = (
        plugin_visit.run("Herd", (name, name), plugin_visit.cases),
        plugin_visit.honest["Herd"],
    )
    for event in trace.channel_events:
        judge(zoo.HERDS[name], event)
    guest = trace.layout.channels.index("guest")
    others = [number for number in range(len(trace.layout.channels)) if number != guest]
    for column in ("acceleration", "steering_angle", "status"):
        assert np.array_equal(trace[column][:, :TICKS, others], honest[column][:, :TICKS, others])
    assert np.array_equal(trace["ego"][:, :TICKS], honest["ego"][:, :TICKS])
    silent = trace["status"][:, :TICKS, guest] == SILENT
    assert silent.any() == (zoo.HERDS[name].outcome != zoo.COMPLETED)


def test_every_plugin_of_the_zoo_has_an_outcome() -> None:
    at_once = {"fails_at_once", "leaves_at_once"}
    assert set(zoo.OBJECTS) == set(zoo_plugin.ONE) | at_once
    assert set(zoo.HERDS) == set(zoo_plugin.HERD) | {"fails_at_once"}
    assert len(zoo.OBJECTS) + len(zoo.HERDS) >= 40


def test_who_asks_for_the_end_ends_the_campaign(
    plugin_visit: PluginVisit, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Nobody can tell whether it was the channel or a person at the keyboard.
    plan = plugin_visit.project.plan()
    module = sys.modules[plan.parts["camera_radar"].plugins[0].obj.__module__]

    def interrupt(_: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setitem(module.ONE, "raises", interrupt)
    with pytest.raises(KeyboardInterrupt):
        plugin_visit.run("One", ("raises",), plugin_visit.cases[:1])


def swept(folder: Path, names: Sequence[str]) -> Project:
    """Copy a project that sweeps the animal of its guest."""
    project = plugin_project(folder)
    path = "architecture.channels.guest.parameters.animal"
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"] = {"gap": ["50 m"], path: list(names)}
    return project


def executed(project: Project, db: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Run the ODD of a project as a process of its own."""
    command = "import sys; from adeye.cli.app import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", command, "run", str(project.odd), *options, "--db", db],
        cwd=project.folder, capture_output=True, text=True, timeout=500, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode in (0, 1, 3), done.stderr
    return done


@pytest.mark.slow
def test_outcomes_and_traces_are_the_same_whoever_executes_them(tmp_path: Path) -> None:
    project = swept(tmp_path / "project", ["", *zoo.OBJECTS])
    ways = {
        "here": ["--threads", "1"],
        "threads": ["--threads", "2"],
        "workers": ["--workers", "2"],
    }
    if find_spec("distributed"):
        ways["dask"] = ["--executor", "dask", "--workers", "2"]
    told = {}
    for way, options in ways.items():
        executed(project, f"{way}.db", "--quiet", *options)
        told[way] = sorted(
            (row["trace_digest"], row["outcome"], row["outcome_detail"] or "")
            for row in project.rows(db=f"{way}.db")
        )
    expected = sorted(["completed", *(animal.outcome for animal in zoo.OBJECTS.values())])
    for way, rows in told.items():
        assert sorted(outcome for _, outcome, _ in rows) == expected, way
        assert rows == told["here"], way


@pytest.mark.slow
def test_campaign_stores_what_no_text_is_and_its_standard_output_is_clean(tmp_path: Path) -> None:
    names = ["", "prints", "closes_its_streams", "raises_what_no_text_is", "leaves"]
    project = swept(tmp_path / "project", names)
    expected = sorted(zoo.OBJECTS[name].outcome if name else "completed" for name in names)
    for workers in ("1", "2"):
        done = executed(project, f"{workers}.db", "--json", "--workers", workers)
        assert done.stdout.startswith("{\n"), done.stdout[:200]
        assert done.stdout.endswith("}\n")
        assert "brake!" in done.stderr
        outcomes = sorted(row["outcome"] for row in project.rows(db=f"{workers}.db"))
        assert outcomes == expected, workers


# --- the program of the zoo knows every animal that has an outcome, and no other


def asked(name: str, *lines: object) -> list[str]:
    """Say hello to the program as an animal, show it some lines, and return its answers."""
    values = {"animal": name, "from_tick": 1}
    hello = {"hello": "adeye/channel@1", "links": [], "parameters": {"values": values}}
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-B", zoo.PROGRAM],
        input="".join(json.dumps(line) + "\n" for line in (hello, *lines)),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    return done.stdout.splitlines()


def test_program_has_every_animal_and_no_other() -> None:
    tree = ast.parse(zoo.PROGRAM.read_text("utf-8"))
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    acting = {name[1:] for name in functions - {"_say", "_answer", "_is_open", "main"}}
    answering = set(program.ANSWERS)
    assert acting | answering == set(zoo.ANIMALS)
    assert not acting & answering


def test_without_an_animal_it_answers_every_observation() -> None:
    said = [json.loads(line) for line in asked("", {"tick": 0}, {"tick": 1})]
    assert said[0] == {"hello": "adeye/channel@1"}
    assert [item["tick"] for item in said[1:]] == [0, 1]


@pytest.mark.parametrize("name", ["raises", "leaves", "says_half_a_line"])
def test_animal_behaves_until_its_tick(name: str) -> None:
    said = asked(name, {"tick": 0}, {"tick": 1})
    assert json.loads(said[1])["tick"] == 0
    assert not any("acceleration" in line for line in said[2:])
