"""Channel, sensor, metric and executor of another package are first-class in every verb."""

from __future__ import annotations

import shutil
import sys
from string import Template
from typing import TYPE_CHECKING, Any

import pytest
import typer

from adeye.campaign.parts import use_plugin_metrics
from adeye.cli.app import app
from adeye.cli.new import EXAMPLES
from tests.project import CANDIDATE, CONCEPT, MINI, Project

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.cli.conftest import Verb

EXECUTOR = '''
from adeye.ports import Done


class Inline:
    """Executes each task where it is asked for."""

    def __init__(self, context):
        self.work = context.work

    def run(self, tasks):
        for task in tasks:
            yield Done(task, self.work(task))

    def close(self):
        pass
'''
ELSEWHERE = {
    "db grant": "rights of a server",
    "db merge": "other databases",
    "db upgrade": "a database of an earlier version",
    "db withdraw": "what was authorised before",
    "init": "writes a project",
    "manifest keygen": "writes a key",
    "new channel": "writes an example",
    "new metric": "writes an example",
    "new sensor": "writes an example",
    "reference": "scenes of their own",
    "scenario lint": "scenarios only",
    "scenario list": "scenarios only",
    "scenario show": "scenarios only",
    "selftest": "projects of its own",
    "stl": "tables of their own",
    "warmup": "kernels, compiled for minutes",
}
"""Verbs that are about no campaign of a project with parts of others, and what they are about."""

VERBS = {
    "plan": ["{odd}"],
    "signals": ["{odd}"],
    "dependencies": ["{odd}"],
    "sensors": ["{architecture}"],
    "plugins": ["{odd}"],
    "coverage": ["{odd}"],
    "judge": ["{odd}"],
    "gate": [],
    "stale": ["{odd}"],
    "check": ["{odd}"],
    "show": ["{run}"],
    "replay": ["{run}"],
    "timeline": ["{fault}"],
    "faults": [],
    "fork": ["{run}", "--from", "1 s", "--authority", "safety"],
    "forks": [],
    "uncertainty": [],
    "preventability": [],
    "query": ["SELECT count(*) FROM v_runs"],
    "compare": [],
    "confidence": [],
    "report": ["--output", "r.html", "--junit", "r.xml", "--report-json", "r.json"],
    "matrix": [],
    "export": ["--output", "exported"],
    "certify": ["--sample", "2"],
    "doctor": [],
    "db info": [],
    "db verify": [],
    "db prove": ["{run}"],
    "db metadata": [],
    "db copy": ["--campaign", "1", "--to", "copied.db"],
    "manifest write": ["--output", "m.json"],
    "manifest verify": ["m.json", "--unsigned"],
    "run": ["{odd}", "--executor", "{executor}"],
}
"""Arguments of each verb about the campaign."""


def verbs(command: Any, path: tuple[str, ...] = ()) -> Iterator[str]:
    """List every verb of the program."""
    if not hasattr(command, "commands"):
        yield " ".join(path)
        return
    for name, part in command.commands.items():
        yield from verbs(part, (*path, name))


def test_every_verb_is_tried_or_has_a_reason() -> None:
    assert {*verbs(typer.main.get_command(app))} == VERBS.keys() | ELSEWHERE.keys()


@pytest.fixture(params=["package", "file"])
def foreign(
    request: pytest.FixtureRequest, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Project, str]]:
    """Make a project whose channel, sensor and metric are another package's, and name its parts."""
    project = Project(folder / "project", {**MINI, "scenarios": [MINI["scenarios"][0]]})
    sources = [
        Template(EXAMPLES[kind].source).substitute(name=f"foreign_{kind}", class_name=name)
        for kind, name in (("channel", "Steady"), ("sensor", "Round"), ("metric", "Fastest"))
    ]
    package = folder / "elsewhere" / "foreign_parts"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("", "utf-8")
    (package / "parts.py").write_text("\n".join([*sources, EXECUTOR]), "utf-8")
    of_odd = of_architecture = of_executor = "foreign_parts.parts"
    if request.param == "file":
        shutil.copy(package / "parts.py", project.folder / "odd" / "parts.py")
        of_odd, of_architecture = "./parts.py", "../parts.py"
        of_executor = "./project/odd/parts.py"
    monkeypatch.syspath_prepend(str(package.parent))
    monkeypatch.setenv("PYTHONPATH", str(package.parent))
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["foreign"] = {"kind": f"{of_architecture}:Round", "rate": "20 Hz"}
        candidate["channels"]["nominal"] = {
            "kind": f"{of_architecture}:Steady",
            "links": ["localisation", "front_camera", "foreign"],
            "rate": "20 Hz",
        }
    with project.edited(CONCEPT) as concept:
        first = {**concept["requirements"][0], "id": "FSR-99"}
        del first["formula"]
        bound = {"metric": "foreign_metric_mps", "at_most": "300 km/h"}
        concept["requirements"] = [concept["requirements"][0], {**first, "bound": bound}]
    with project.edited_odd() as odd:
        odd["plugins"] = [f"{of_odd}:Fastest"]
        odd["scenarios"][0]["sweep"]["parameters"] = {"gap": ["30 m"]}
        odd["faults"] = [odd["faults"][1]]
        odd["uncertainty"] = {"situations": 10}
    yield project, f"{of_executor}:Inline"
    use_plugin_metrics((), folder)
    for name in [name for name in sys.modules if name.startswith("foreign_parts")]:
        del sys.modules[name]


@pytest.mark.slow
def test_every_verb_takes_a_campaign_of_foreign_parts(
    foreign: tuple[Project, str], adeye: Verb
) -> None:
    project, executor = foreign
    odd = "project/odd/tested.yaml"
    assert adeye("run", odd, "--executor", executor).code in {0, 1, 3}
    runs = {
        entry: adeye(
            "query",
            f"SELECT run FROM v_runs WHERE fault_entry = '{entry}'",  # noqa: S608 - two words
            "--format",
            "csv",
        ).out.split()[1]
        for entry in ("none", "nominal_silent")
    }
    words = {
        "odd": odd,
        "architecture": f"project/{CANDIDATE}",
        "executor": executor,
        "run": runs["none"],
        "fault": runs["nominal_silent"],
    }
    failed = {}
    for verb, arguments in VERBS.items():
        use_plugin_metrics((), project.folder)  # as another process begins
        done = adeye(*verb.split(), *(item.format(**words) for item in arguments))
        troubles = [
            word for word in ("no metric", "Traceback", "defect of adeye") if word in done.err
        ]
        if done.code not in {0, 1, 3} or troubles:
            failed[verb] = (done.code, done.err)
    assert not failed
