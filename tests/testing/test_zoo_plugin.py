"""Plug-ins that misbehave: each gets its outcome, and the runs beside it keep every bit."""

from __future__ import annotations

import os
import random  # noqa: TID251 - plug-ins seed it
import subprocess
import sys
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.signals import SILENT
from adeye.simulate import engine
from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.testing import zoo
from adeye.testing.zoo import plugin as zoo_plugin
from tests.project import CANDIDATE, ROOT, Project
from tests.testing.test_zoo import ODD, TICKS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.sweep.case import TestCase
    from adeye.trace import ChannelEvent, Trace

LINKS = ["localisation", "front_camera", "channels.nominal", "switch"]


@dataclass(frozen=True)
class Visit:
    """Where the zoo is, two situations to drive, and what they are like without mischief."""

    project: Project
    cases: tuple[TestCase, TestCase]
    honest: dict[str, Trace]

    def run(self, kind: str, names: Sequence[str], cases: Sequence[TestCase]) -> Trace:
        made = [case_of(case, kind, name) for case, name in zip(cases, names, strict=True)]
        with spoilt(self.project.folder):
            return engine.run(made, base_dirs=self.project.plan().folders, most_ticks=TICKS)


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


def case_of(case: TestCase, kind: str, name: str) -> TestCase:
    """Put an animal into the architecture of a test case."""
    content = case.architecture.model_dump(mode="json")
    content["channels"]["guest"]["kind"] = f"./zoo_plugin.py:{kind}"
    content["channels"]["guest"]["parameters"] = {"animal": name, "from_tick": zoo.FROM_TICK}
    return replace(case, architecture=Architecture.model_validate(content, context=SI))


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Visit:
    project = built(tmp_path_factory.mktemp("zoo") / "project")
    first, second = project.plan().cases
    empty = Visit(project, (first, second), {})
    honest = {kind: empty.run(kind, ("", ""), (first, second)) for kind in ("One", "Herd")}
    return replace(empty, honest=honest)


def built(folder: Path) -> Project:
    project = Project(folder, ODD)
    zoo.settle(folder / "odd" / "architectures")
    guest = {
        "kind": "./zoo_plugin.py:One",
        "links": LINKS,
        "rate": "20 Hz",
        "parameters": {"animal": ""},
    }
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["guest"] = guest
    return project


def judge(animals: Mapping[str, zoo.Animal], name: str, event: ChannelEvent | None) -> None:
    animal = animals[name]
    if animal.outcome == zoo.COMPLETED:
        assert event is None
        return
    assert event is not None
    assert (event.outcome, event.channel) == (animal.outcome, "guest")
    assert animal.detail in event.detail
    assert len(event.detail) <= 500
    assert event.detail.encode()
    assert not event.is_machine_dependent
    assert str(ROOT) not in event.detail


@pytest.mark.parametrize("name", zoo.OBJECTS)
def test_object_gets_its_outcome_and_runs_beside_it_keep_every_bit(visit: Visit, name: str) -> None:
    first, second = visit.cases
    trace = visit.run("One", ("", name, ""), (first, first, second))
    judge(zoo.OBJECTS, name, trace.channel_events[1])
    digests = trace.digests()
    assert [digests[0], digests[2]] == visit.honest["One"].digests()
    assert trace.channel_events[0] is trace.channel_events[2] is None


@pytest.mark.parametrize("name", zoo.HERDS)
def test_herd_gets_its_outcome_and_the_other_channels_keep_every_bit(
    visit: Visit, name: str
) -> None:
    trace, honest = visit.run("Herd", (name, name), visit.cases), visit.honest["Herd"]
    for event in trace.channel_events:
        judge(zoo.HERDS, name, event)
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


@pytest.mark.parametrize("error", [KeyboardInterrupt])
def test_who_asks_for_the_end_ends_the_campaign(
    visit: Visit, error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Nobody can tell whether it was the channel or a person at the keyboard.
    plan = visit.project.plan()
    module = sys.modules[plan.parts["camera_radar"].plugins[0].obj.__module__]

    def interrupt(_: Any) -> Any:
        raise error

    monkeypatch.setitem(module.ONE, "raises", interrupt)
    with pytest.raises(error):
        visit.run("One", ("raises",), visit.cases[:1])


@pytest.mark.slow
def test_outcomes_and_traces_are_the_same_whoever_executes_them(tmp_path: Path) -> None:
    project = built(tmp_path / "project")
    path = "architecture.channels.guest.parameters.animal"
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"] = {"gap": ["50 m"], path: ["", *zoo.OBJECTS]}
    command = "import sys; from adeye.cli.app import main; sys.exit(main(sys.argv[1:]))"
    ways = {
        "here": ["--threads", "1"],
        "threads": ["--threads", "2"],
        "workers": ["--workers", "2"],
    }
    if find_spec("distributed"):
        ways["dask"] = ["--executor", "dask", "--workers", "2"]
    told = {}
    for way, options in ways.items():
        done = subprocess.run(
            [sys.executable, "-c", command, "run", str(project.odd), "--quiet", *options,
             "--db", f"{way}.db"],
            cwd=project.folder, capture_output=True, text=True, timeout=500, check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        assert done.returncode in (0, 1, 3), done.stderr
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
    project = built(tmp_path / "project")
    names = ["", "prints", "closes_its_streams", "raises_what_no_text_is", "leaves"]
    path = "architecture.channels.guest.parameters.animal"
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"] = {"gap": ["50 m"], path: names}
    command = "import sys; from adeye.cli.app import main; sys.exit(main(sys.argv[1:]))"
    told = {}
    for workers in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", command, "run", str(project.odd), "--json", "--workers", workers,
             "--db", f"{workers}.db"],
            cwd=project.folder, capture_output=True, text=True, timeout=300, check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        assert done.returncode in (0, 1, 3), done.stderr
        assert done.stdout.startswith("{\n"), done.stdout[:200]
        assert done.stdout.endswith("}\n")
        assert "brake!" in done.stderr
        told[workers] = sorted(row["outcome"] for row in project.rows(db=f"{workers}.db"))
    expected = sorted(zoo.OBJECTS[name].outcome if name else "completed" for name in names)
    assert told["1"] == told["2"] == expected
