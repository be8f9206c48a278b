"""Reports written to files, and the runs that a page embeds."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from adeye.campaign.replay import Execution, rerun
from adeye.campaign.run import Progress
from adeye.errors import InputError, UsageError
from adeye.judge.verdict import ExitCode
from adeye.report.build import ReplayRequest, ReportBuilder
from adeye.report.model.report import Report
from adeye.reporting import read_report, write_replay, write_reports
from adeye.store.records import RunRef
from adeye.store.repository import Repository
from tests.project import Executed, count_rows, table_hash
from tests.refusals import refused


@pytest.fixture(scope="module")
def written(
    mini: Executed, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Report, list[Progress]]:
    folder = tmp_path_factory.mktemp("reports")
    seen: list[Progress] = []
    report = write_reports(
        mini.db,
        None,
        html=folder / "report.html",
        junit=folder / "junit.xml",
        json=folder / "report.json",
        progress=seen.append,
    )
    return folder, report, seen


def test_page_embeds_runs_with_their_replays(
    written: tuple[Path, Report, list[Progress]], mini: Executed
) -> None:
    folder, report, _ = written
    page = (folder / "report.html").read_text("utf-8")
    assert len(report.replays) >= 3
    digests = {row["run"]: row["trace_digest"] for row in mini.project.rows()}
    for replay in report.replays:
        # What is drawn is what was judged: the run was executed again to the same bits.
        assert replay.trace_digest == digests[replay.run]
        assert replay.run[:12] in page
    assert "http://" not in page.replace("http://www.w3.org/", "")
    assert "https://" not in page
    assert len(page.encode()) < 10_000_000


def test_drawn_run_has_verdicts_events_and_signals(
    written: tuple[Path, Report, list[Progress]],
) -> None:
    replay = written[1].replays[0]
    assert {item.fsr for item in replay.verdicts} >= {"FSR-01", "FSR-06"}
    assert any(event.kind == "storyboard" for event in replay.events)
    assert {item.name for item in replay.signals} >= {"ego.speed", "any_actor.distance"}
    assert {item.label for item in replay.parameters} >= {"ego_speed", "gap"}


def test_junit_and_json_agree_with_the_page(
    written: tuple[Path, Report, list[Progress]], mini: Executed
) -> None:
    folder, report, _ = written
    document = json.loads((folder / "report.json").read_text("utf-8"))
    assert document["campaign"] == report.campaign == mini.summary.campaign
    tree = ET.parse(folder / "junit.xml").getroot()  # noqa: S314 - written by ourselves
    suites = {suite.get("name"): suite for suite in tree.iter("testsuite")}
    # Green, as the exit code says: the legacy architecture is not in the gate.
    assert report.exit_code is ExitCode.OK
    assert any("camera_radar" in str(name) for name in suites)
    cases = list(tree.iter("testcase"))
    assert len(cases) > 8
    assert not [case for case in cases if len(case.findall("failure") + case.findall("error"))]
    assert not [case for case in cases if case.find("skipped") is not None]


def test_progress_counts_the_runs_that_are_drawn(
    written: tuple[Path, Report, list[Progress]],
) -> None:
    _, report, seen = written
    assert [item.done for item in seen] == list(range(len(report.replays) + 1))
    assert {(item.phase, item.total) for item in seen} == {("report", len(report.replays))}


@pytest.mark.slow
def test_reporting_changes_nothing_in_the_database(mini: Executed, tmp_path: Path) -> None:
    before = count_rows(mini.db, "run"), table_hash(mini.db)
    report = write_reports(mini.db, mini.summary.campaign[:8], junit=tmp_path / "junit.xml")
    assert report.replays == ()
    assert list(tmp_path.iterdir()) == [tmp_path / "junit.xml"]
    assert (count_rows(mini.db, "run"), table_hash(mini.db)) == before


@pytest.mark.slow
def test_one_run_has_a_page_of_its_own(mini: Executed, tmp_path: Path) -> None:
    run = mini.project.rows()[5]["run"]
    write_replay(mini.db, run[:12], tmp_path / "replay.html")
    page = (tmp_path / "replay.html").read_text("utf-8")
    assert run[:12] in page
    assert "asked for" in page
    assert page.index('id="run"') < page.index('id="player"') < page.index('id="summary"')
    assert f"run {run[:12]}</title>" in page


@pytest.mark.slow
def test_run_that_comes_out_otherwise_is_not_drawn(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after an edit of a channel: what would be drawn is another drive than the stored one."""
    with Repository.open(mini.db, create=False) as repository:
        failing = repository.find_run(mini.project.rows()[0]["run"]).result_digest

    def drifting(repository: Repository, run: RunRef) -> Execution:
        done = rerun(repository, run)
        if run.result_digest != failing:
            return done
        assert done.trace.digests()[0] == done.stored.trace_digest
        row = {**done.stored.row, "trace_digest": "0" * 32}
        return replace(done, stored=replace(done.stored, row=row))

    monkeypatch.setattr("adeye.reporting.rerun", drifting)
    monkeypatch.setattr(ReportBuilder, "_requests", lambda self, _: requests(self, failing))
    names = ("html", "junit", "json")
    files: dict[str, Any] = {name: tmp_path / f"a.{name}" for name in names}
    for told in (
        write_reports(mini.db, None, **files),
        write_replay(mini.db, failing, tmp_path / "b.html"),
    ):
        assert told.exit_code is ExitCode.INTEGRITY
        assert [item.run for item in told.undrawn] == [failing]
        assert failing not in {item.run for item in told.replays}
        assert f"run {failing[:12]}, " in told.message
        assert "comes out otherwise than it is stored, and is not drawn" in told.message
    for name in ("a.html", "b.html"):
        page = (tmp_path / name).read_text("utf-8")
        assert "Not drawn, as it comes out otherwise than it is stored" in page
        assert "Exit code 4" in page
    assert "comes out otherwise" in files["junit"].read_text("utf-8")
    assert '"exit_code": 4' in files["json"].read_text("utf-8")


def requests(builder: ReportBuilder, run: str) -> list[ReplayRequest]:
    """Ask for a run and for another one."""
    find, own = builder.repository.find_run, builder.campaign.id
    others = (find(at, campaign=own) for at in "12")
    other = next(item for item in others if item.result_digest != run)
    return [ReplayRequest(find(run, campaign=own), "one"), ReplayRequest(other, "another")]


@pytest.mark.slow
def test_folder_that_is_not_there_is_made_or_refused(mini: Executed, tmp_path: Path) -> None:
    path = tmp_path / "deep" / "junit.xml"
    write_reports(mini.db, None, junit=path)
    assert path.is_file()


def test_database_without_a_campaign_is_a_usage_error(tmp_path: Path) -> None:
    db = tmp_path / "adeye.db"
    Repository.open(db).close()
    with pytest.raises(UsageError, match="has no campaign"):
        write_reports(db, None, junit=tmp_path / "junit.xml")


def test_unknown_campaign_and_missing_database_are_input_errors(
    mini: Executed, tmp_path: Path
) -> None:
    for db, campaign in ((mini.db, "fedcba"), (tmp_path / "missing.db", None)):
        refused(InputError, write_reports, db, campaign, junit=tmp_path / "junit.xml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_exports_are_written_without_a_page(mini: Executed, tmp_path: Path) -> None:
    files = {"sarif": tmp_path / "v.sarif", "gsn": tmp_path / "a.svg", "reqif": tmp_path / "r.xml"}
    report = write_reports(mini.db, None, exports=files)
    assert set(tmp_path.iterdir()) == set(files.values())
    log = json.loads(files["sarif"].read_text("utf-8"))
    (rules,) = [run["tool"]["driver"]["rules"] for run in log["runs"]]
    assert [rule["id"] for rule in rules] == [item.id for item in report.fsrs]


def test_form_that_is_none_is_refused_before_anything_is_read(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no form"):
        write_reports(tmp_path / "missing.db", None, exports={"gsn": tmp_path / "a.png"})


@pytest.mark.slow
def test_report_is_read_by_the_id_of_its_odd(mini: Executed) -> None:
    found = read_report(mini.db, "mini")
    assert found.campaign == mini.summary.campaign
    assert found.replays == ()
