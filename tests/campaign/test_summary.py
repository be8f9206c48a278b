"""A file means the campaign that it plans; what was edited since is named, and never green."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from copy import copy
from pathlib import Path
from typing import Any

import pytest

from adeye.answers import gate_campaign
from adeye.campaign.naming import campaign_of_file, find_called
from adeye.errors import UsageError
from adeye.judge.verdict import ExitCode
from adeye.report.gate.decide import GateOptions
from adeye.store.repository import Repository
from tests.project import CANDIDATE, CANDIDATE_ONLY, CONCEPT, Project, one_scenario
from tests.refusals import refused
from tests.stored import stored

ODD: dict[str, Any] = one_scenario(ego_speed=["80 km/h", "100 km/h"], gap=["50 m"])
ODD |= {"architectures": CANDIDATE_ONLY, "plugins": ["./own.py:Own"]}
PLUGIN: str = stored("plugins")["place"]


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> Project:
    made = Project(tmp_path_factory.mktemp("lookup") / "project", ODD)
    (made.folder / "odd" / "own.py").write_text(PLUGIN, "utf-8")
    with made.edited(CONCEPT) as concept:
        concept["requirements"] = concept["requirements"][:2]
    made.run()
    return made


@pytest.fixture
def project(executed: Project, tmp_path: Path) -> Project:
    """Copy the project with what it executed."""
    shutil.copytree(executed.folder, tmp_path / "project")
    made = copy(executed)
    made.folder = tmp_path / "project"
    made.odd, made.db = made.folder / "odd" / "tested.yaml", made.folder / "adeye.db"
    return made


def meant(project: Project) -> tuple[int, str]:
    with Repository.open(project.db, create=False) as repository:
        found = campaign_of_file(repository, project.odd)
    return found.campaign.number, found.edits


def gated(project: Project) -> ExitCode:
    return gate_campaign(project.db, str(project.odd), GateOptions()).exit_code


TESTED, PLACE = "odd/tested.yaml", "odd/own.py"
EDITS: dict[str, tuple[str, Callable[[Any], object]]] = {
    "requirements FSR-02": (CONCEPT, lambda it: it["requirements"][1]["bound"].update(at_most=9)),
    "scenarios and sweeps": (
        TESTED, lambda it: it["scenarios"][0]["sweep"]["parameters"]["gap"].append("60 m"),
    ),
    "architectures camera_radar": (
        CANDIDATE, lambda it: it["sensors"]["front_camera"].update(latency="0.2 s"),
    ),
    "gate": (TESTED, lambda it: it.update(
        architectures=[*CANDIDATE_ONLY, "architectures/legacy_camera.yaml"],
        gate={"architectures": ["legacy_camera"]})),
    "title": (TESTED, lambda it: it.update(title="Another")),
    "the code of adeye or of a plug-in": (PLACE, lambda it: it.replace("+ 1.0", "+ 2.0")),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("words", EDITS)
def test_edit_is_named_and_incomplete_until_it_is_run(project: Project, words: str) -> None:
    assert (meant(project), gated(project)) == ((1, ""), ExitCode.OK)
    name, edit = EDITS[words]
    if name == PLACE:
        (project.folder / name).write_text(str(edit(PLUGIN)), "utf-8")
    else:
        with project.edited(name) as content:
            edit(content)
    number, edits = meant(project)
    assert number == 1
    assert words in edits
    with Repository.open(project.db, create=False) as repository:
        # What is told of the old campaign would be taken for what the file asks for.
        refused(UsageError, find_called, repository, str(project.odd), says=words)
        assert find_called(repository, "1").number == 1
        assert find_called(repository, str(project.odd), may_be_edited=True).number == 1
    result = gate_campaign(project.db, str(project.odd), GateOptions())
    assert result.exit_code is ExitCode.INCOMPLETE
    (finding,) = result.own
    assert words in finding.text
    assert f"Run adeye run {project.odd}" in finding.text
    summary = project.run()
    assert meant(project) == (2, "")
    assert gated(project) is summary.exit_code


def test_comment_is_no_edit(project: Project) -> None:
    project.odd.write_text(project.odd.read_text("utf-8") + "# a comment\n", "utf-8")
    assert (meant(project), gated(project)) == ((1, ""), ExitCode.OK)


@pytest.mark.slow
def test_file_that_was_put_back_means_the_campaign_that_it_had(project: Project) -> None:
    before = (project.folder / CONCEPT).read_text("utf-8")
    with project.edited(CONCEPT) as concept:
        concept["requirements"][1]["bound"]["at_most"] = 0.01
    assert project.run().exit_code is ExitCode.FAILED
    assert (meant(project), gated(project)) == ((2, ""), ExitCode.FAILED)
    edited = (project.folder / CONCEPT).read_text("utf-8")
    (project.folder / CONCEPT).write_text(before, "utf-8")
    # The evidence of what the file says is there, although another campaign is later.
    assert (meant(project), gated(project)) == ((1, ""), ExitCode.OK)
    assert gate_campaign(project.db, None, GateOptions()).exit_code is ExitCode.FAILED
    assert project.run().exit_code is ExitCode.OK
    assert gate_campaign(project.db, None, GateOptions()).exit_code is ExitCode.OK
    (project.folder / CONCEPT).write_text(edited, "utf-8")
    assert project.run().exit_code is ExitCode.FAILED
    for name in (None, "mini", str(project.odd)):
        assert gate_campaign(project.db, name, GateOptions()).exit_code is ExitCode.FAILED


def test_odd_without_a_campaign_is_a_usage_error(project: Project) -> None:
    with project.edited_odd() as odd:
        odd["odd"] = "another"
    with pytest.raises(UsageError, match="has no campaign"):
        meant(project)


def test_fsr_of_everywhere_that_no_run_inside_the_odd_exercises_is_vacuous(tmp_path: Path) -> None:
    project = Project(tmp_path / "project", {**ODD, "plugins": [], "outside": "robustness"})
    with project.edited_odd() as odd:
        odd["attributes"] = {"dynamic_elements": {"ego_speed": {"max": "90 km/h"}}}
    with project.edited(CONCEPT) as concept:
        first = concept["requirements"][0]
        bound = {"formula": "always(ego.speed > 95 km/h implies not contact)", "bound": None}
        concept["requirements"] = [
            {**first, "applies": "everywhere", "min_exercised": 1},
            {**first, "id": "FSR-99", "applies": "everywhere", **bound, "min_exercised": 1},
            {**first, "id": "FSR-98", "applies": "everywhere", "min_exercised": 2},
        ]
        for item in concept["requirements"]:
            item.pop("bound", None)
    summary = project.run()
    assert summary.exit_code is ExitCode.INCOMPLETE
    said = "FSR-99 VACUOUS for camera_radar (what it asks about inside the ODD never held)"
    assert said in summary.message
    told = "what it asks about inside the ODD in 2 runs never held"
    assert told in summary.message
    assert first["id"] not in summary.message
    with Repository.open(project.db, create=False) as repository:
        assert repository.verify() == ()
