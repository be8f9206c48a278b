"""What changed since a baseline, and what became stale by the files."""

import json
from pathlib import Path

import pytest

from adeye.answers import gate_campaign
from adeye.errors import InputError, IntegrityError
from adeye.judge.verdict import ExitCode
from adeye.report.gate.baseline import Kind
from adeye.report.gate.decide import GateOptions
from adeye.report.model.evidence import Impact, StaleFiles
from adeye.reporting import change_since, stale_now, write_reports
from adeye.store.repository import Repository
from tests.conftest import MakeProject
from tests.project import CANDIDATE, Project
from tests.stored import known


@pytest.fixture
def project(make_project: MakeProject) -> Project:
    found = make_project()
    found.run()
    return found


@pytest.fixture
def baseline(project: Project) -> Path:
    path = project.folder / "base line.json"
    gate_campaign(project.db, None, GateOptions(baseline=path, is_update=True))
    return path


def since(project: Project, path: Path) -> Impact:
    with Repository.open(project.db, create=False) as repository:
        return change_since(repository, repository.find_campaign(), path, project.db)


def stale(project: Project) -> StaleFiles | str:
    with Repository.open(project.db, create=False) as repository:
        return stale_now(repository, repository.find_campaign())


@pytest.mark.slow
def test_change_is_told_from_verdicts_to_stale_evidence(project: Project, baseline: Path) -> None:
    told = since(project, baseline)
    assert (told.changes, told.exit_code) == ((), ExitCode.OK)
    assert told.command.endswith(f"--baseline '{baseline}' --db {project.db}")
    assert told.stale is not None
    assert (told.stale.counts, told.stale.causes) == (told.stale.evidence, ())

    # The files change, the campaign does not: its evidence is stale.
    with project.edited(CANDIDATE) as candidate:
        candidate["switch"]["policy"] = "stuck"
    told = since(project, baseline)
    assert told.changes == ()
    assert told.stale is not None
    [cause] = told.stale.causes
    assert (cause.cause, cause.architectures, cause.runs) == ("architecture", ("camera_radar",), 14)
    assert told.stale.counts == told.stale.evidence - cause.evidence > 0
    assert told.stale.to_execute == 14

    # The campaign follows: nothing is stale, and the FSR fails newly.
    former = told.campaign
    project.run()
    told = since(project, baseline)
    assert told.campaign == former
    assert told.exit_code is ExitCode.FAILED
    failing = [item for item in told.changes if item.kind is Kind.NEWLY_FAILING and item.decides]
    assert "FSR-03" in {item.fsr for item in failing}
    assert failing[0].command.startswith(f"adeye show {failing[0].runs[0][:12]}")
    assert known(told.stale).causes == ()


def test_files_that_cannot_be_planned_are_said(project: Project) -> None:
    with project.edited(CANDIDATE) as candidate:
        candidate["switch"]["policy"] = "nothing"
    found = stale(project)
    assert str(found).startswith("The files cannot be planned as they are now:")
    project.odd.unlink()
    assert stale(project) == f"The ODD of the campaign is no longer at {project.odd}."


@pytest.mark.slow
def test_report_has_the_change_in_its_json(project: Project, baseline: Path) -> None:
    path = project.folder / "r.json"
    write_reports(project.db, None, json=path, baseline=baseline)
    assert json.loads(path.read_text("utf-8"))["impact"]["baseline"] == str(baseline)
    write_reports(project.db, None, json=path)
    assert json.loads(path.read_text("utf-8"))["impact"] is None


def test_wrong_baseline_is_refused_and_nothing_written(project: Project, baseline: Path) -> None:
    path = project.folder / "r.json"
    with pytest.raises(InputError, match="no such baseline"):
        write_reports(project.db, None, json=path, baseline=project.folder / "missing.json")
    text = baseline.read_text("utf-8")
    baseline.write_text(text.replace('"exit_code": 0', '"exit_code": 1', 1), "utf-8")
    with pytest.raises(IntegrityError, match="was edited"):
        write_reports(project.db, None, json=path, baseline=baseline)
    assert not path.exists()
