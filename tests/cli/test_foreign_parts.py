"""Channel, sensor, metric and executor of another package are first-class in every verb."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from string import Template

import pytest

from adeye.campaign.parts import use_plugin_metrics
from adeye.cli.new import EXAMPLES
from tests.cli.conftest import Verb
from tests.cli.test_app import VERBS as ALL
from tests.project import CANDIDATE, CONCEPT, MINI, Project
from tests.stored import stored

EXECUTOR: str = stored("plugins")["inline"]
ALL_VERBS = stored("verbs")
ELSEWHERE: dict[str, str] = ALL_VERBS["elsewhere"]
"""Verbs that are about no campaign of a project with parts of others, and what they are about."""

VERBS: dict[str, list[str]] = ALL_VERBS["tried"]
"""Arguments of each verb about the campaign."""


def test_every_verb_is_tried_or_has_a_reason() -> None:
    assert {" ".join(path) for path in ALL} == VERBS.keys() | ELSEWHERE.keys()


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
        gaps = {"from": "30 m", "to": "39 m", "step": "1 m"}
        odd["scenarios"][0]["sweep"]["parameters"] = {"gap": gaps}
        odd["faults"] = [odd["faults"][1]]
        odd["uncertainty"] = {"situations": 10}
    yield project, f"{of_executor}:Inline"
    use_plugin_metrics((), folder)
    for name in [name for name in sys.modules if name.startswith("foreign_parts")]:
        del sys.modules[name]


@pytest.mark.slow
def test_every_verb_takes_foreign_parts(foreign: tuple[Project, str], adeye: Verb) -> None:
    project, executor = foreign
    odd = "project/odd/tested.yaml"
    assert adeye("run", odd, "--executor", executor).code in {0, 1, 3}

    def run_of(entry: str) -> str:
        sql = f"SELECT run FROM v_runs WHERE fault_entry = '{entry}'"  # noqa: S608 - two words
        return adeye("query", sql, "--format", "csv").out.split()[1]

    words = {
        "odd": odd,
        "architecture": f"project/{CANDIDATE}",
        "executor": executor,
        "run": run_of("none"),
        "fault": run_of("nominal_silent"),
    }
    failed = {}
    for verb, arguments in VERBS.items():
        use_plugin_metrics((), project.folder)  # as another process begins
        done = adeye(*verb.split(), *(item.format(**words) for item in arguments))
        troubles = ("no metric", "Traceback", "defect of adeye")
        if done.code not in {0, 1, 3} or any(word in done.err for word in troubles):
            failed[verb] = (done.code, done.err)
    assert not failed
