"""The report of a campaign, put together from its database."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.build import MAX_REPLAYS, WORST_PER_FSR, ReplayRequest, ReportBuilder
from adeye.report.credibility import write_result
from adeye.report.model.report import Cell, Report
from adeye.report.page.html import arrange, badge, render
from adeye.report.page.replay import Replay
from adeye.simulate.engine import NUMERICS_VERSION
from adeye.store.repository import Repository
from adeye.version import __version__
from tests.project import CONCEPT, Executed, Project, rows_of
from tests.report.test_credibility import GOOD
from tests.stored import known


def no_replays(_: Sequence[ReplayRequest]) -> tuple[Replay, ...]:
    return ()


@pytest.fixture(scope="module")
def repository(mini: Executed) -> Iterator[Repository]:
    with Repository.open(mini.db, create=False) as opened:
        yield opened


@pytest.fixture(scope="module")
def builder(repository: Repository, mini: Executed) -> ReportBuilder:
    return ReportBuilder(repository, repository.find_campaign(mini.summary.campaign), "my.db")


@pytest.fixture(scope="module")
def built(builder: ReportBuilder) -> Report:
    return builder.build(no_replays)


@pytest.fixture(scope="module")
def rows(mini: Executed) -> list[dict[str, Any]]:
    return mini.project.rows()


def total(report: Report, fsr: str, architecture: str) -> Cell:
    return next(
        cell
        for cell in report.cells
        if (cell.fsr, cell.architecture, cell.scenario) == (fsr, architecture, None)
    )


@pytest.mark.slow
def test_report_tells_of_the_self_test_of_the_same_code_only(
    builder: ReportBuilder, built: Report, mini: Executed
) -> None:
    assert built.self_test is None
    own = {"version": __version__, "numerics_version": NUMERICS_VERSION}
    made = GOOD.model_copy(update=own)
    kept = write_result(made, mini.db.parent)
    assert builder.build(no_replays).self_test == made
    write_result(made.model_copy(update={"version": "0.0.0"}), mini.db.parent)
    assert builder.build(no_replays).self_test is None
    kept.unlink()


def test_report_counts_what_the_database_holds(built: Report, rows: list[dict[str, Any]]) -> None:
    assert (built.planned, built.accounted, len(rows)) == (28, 28, 28)
    assert sum(built.outcomes.values()) == 28
    for cell in built.cells:
        own = [
            row["verdicts"][cell.fsr]
            for row in rows
            if row["architecture"] == cell.architecture
            and cell.scenario in {None, row["scenario"]}
            and cell.fsr in row["verdicts"]
        ]
        assert {key.value: count for key, count in cell.counts.items()} == Counter(own)


def test_report_says_what_was_made_of_maps(repository: Repository, mini: Executed) -> None:
    campaign = repository.find_campaign(mini.summary.campaign)
    counts = {"taken": 9, "approximated": 2, "repaired": 1, "guessed": 41, "ignored": 5}
    told = {**campaign.provenance, "maps": {"town.xodr": {"given": 3, **counts}}}
    built = ReportBuilder(repository, replace(campaign, provenance=told), "").build(no_replays)
    assert [item.model_dump() for item in built.maps] == [
        {"name": "town.xodr", "given": 3, **counts}
    ]
    assert "town.xodr, rules: 3 given, 41 guessed" in render(built)


def test_report_has_the_gates_verdict_and_its_determinism(built: Report, mini: Executed) -> None:
    assert (built.exit_code, built.message) == (mini.summary.exit_code, mini.summary.message)
    assert built.exit_code is ExitCode.OK
    folded = {(line.architecture, line.fsr): line.verdict for line in mini.summary.verdicts}
    for (architecture, fsr), verdict in folded.items():
        assert total(built, fsr, architecture).verdict is verdict
    assert built.determinism.startswith("Class portable")
    assert "(traffic batch, reference-1)" in built.determinism
    assert built.dead_axes == ()


def test_every_number_has_a_command_on_this_database(
    built: Report, repository: Repository, mini: Executed
) -> None:
    commands = [item.command for item in built.cells]
    commands += [item.command for item in built.worst_cases]
    commands += [item.minimum.command for item in built.metrics if item.minimum]
    assert len(commands) > 50
    assert all(text.endswith(" --db my.db") for text in commands)
    assert built.command.startswith("adeye run ")
    # The default database needs no option.
    default = ReportBuilder(repository, repository.find_campaign(mini.summary.campaign))
    assert default.replay_command("ab" * 32) == "adeye replay abababababab"


def test_worst_run_of_a_cell_is_the_one_with_the_least_robustness(
    built: Report, rows: list[dict[str, Any]]
) -> None:
    cell = total(built, "FSR-02", "camera_radar")
    own = [row for row in rows if row["architecture"] == "camera_radar"]
    worst = max(own, key=lambda row: row["max_required_deceleration_mps2"] or 0.0)
    assert cell.worst_run == worst["run"]
    assert known(cell.margin).value == pytest.approx(6.0 - worst["max_required_deceleration_mps2"])


def test_worst_cases_begin_with_failures_in_the_users_units_and_are_few(built: Report) -> None:
    verdicts = [case.verdict for case in built.worst_cases]
    failures = verdicts.count(Verdict.FAIL)
    assert failures > 0
    assert set(verdicts[:failures]) == {Verdict.FAIL}
    per_fsr = Counter((case.fsr, case.architecture) for case in built.worst_cases)
    assert max(per_fsr.values()) <= WORST_PER_FSR
    assert Verdict.VACUOUS not in verdicts
    labels = {item.label: item.value for item in built.worst_cases[0].parameters}
    assert labels["ego_speed"] in {"80 km/h", "120 km/h"}
    assert labels["gap"] in {"30 m", "50 m"}


@pytest.mark.slow
def test_page_draws_the_worst_of_failing_fsrs_and_a_passing_run_per_scenario(
    builder: ReportBuilder, rows: list[dict[str, Any]]
) -> None:
    asked: list[ReplayRequest] = []

    def remember(requests: Sequence[ReplayRequest]) -> tuple[Replay, ...]:
        asked.extend(requests)
        return ()

    report = builder.build(remember)
    assert 0 < len(asked) <= MAX_REPLAYS
    runs = {row["run"]: row for row in rows}
    chosen = [runs[item.run.result_digest] for item in asked]
    assert len({row["run"] for row in chosen}) == len(chosen)
    failing = {
        (cell.fsr, cell.architecture)
        for cell in report.cells
        if cell.verdict is Verdict.FAIL and cell.scenario is None
    }
    assert failing
    for fsr, architecture in failing:
        drawn = [row for row in chosen if row["verdicts"].get(fsr) == "FAIL"]
        assert any(row["architecture"] == architecture for row in drawn), (fsr, architecture)
    passing = {row["scenario"] for row in chosen if "FAIL" not in row["verdicts"].values()}
    assert passing == {"cut_in", "lead_braking"}
    assert all(item.why for item in asked)


@pytest.mark.slow
def test_without_replays_nothing_is_executed(builder: ReportBuilder) -> None:
    def refuse(_: Sequence[ReplayRequest]) -> tuple[Replay, ...]:
        raise AssertionError

    assert builder.build(refuse, replays=0).replays == ()


@pytest.mark.slow
def test_report_without_a_time_of_day_is_the_same_every_time(builder: ReportBuilder) -> None:
    assert builder.build(no_replays) == builder.build(no_replays)


@pytest.mark.slow
def test_waiver_counts_what_it_sets_aside(project_with_waiver: Project) -> None:
    project = project_with_waiver
    project.run()
    with Repository.open(project.db, create=False) as repository:
        campaign = known(repository.latest_campaign())
        report = ReportBuilder(repository, campaign).build(no_replays)
        rows = rows_of(repository)
    open_runs = [row for row in rows if row["verdicts"]["FSR-03"] == "INCONCLUSIVE"]
    assert [(item.fsr, item.runs, item.is_expired) for item in report.waivers] == [
        ("FSR-03", len(open_runs), False)
    ]


@pytest.fixture
def project_with_waiver(tmp_path: Any) -> Project:
    project = Project(tmp_path / "project")
    with project.edited_odd() as odd:
        odd["scenarios"] = odd["scenarios"][:1]
        odd["scenarios"][0]["sweep"]["parameters"]["gap"] = ["10 m"]
        odd["scenarios"][0]["faults"] = ["none"]
    with project.edited(CONCEPT) as concept:
        concept["waivers"] = [
            {
                "requirement": "FSR-03",
                "reason": "contact ends the run",
                "author": "safety engineer",
                "expires": date(2100, 1, 1),
            }
        ]
    return project


def test_report_knows_its_evidence_lines_and_rules(built: Report, repository: Repository) -> None:
    root = known(repository.evidence.root(built.campaign))
    assert built.evidence_digest == root.root
    assert built.integrity_rules > 20
    assert len(built.verification) == len(built.fsrs) * len(built.architectures)
    assert all(item.digest for item in built.fsrs)
    for fsr in built.fsrs:
        assert fsr.where is not None
        lines = Path(fsr.where.path).read_text("utf-8").splitlines()
        assert fsr.id in lines[fsr.where.line - 1]
    assert sum(item.executed for item in built.realisations) == built.accounted


@pytest.mark.slow
def test_large_campaign_is_not_asked_every_rule(
    builder: ReportBuilder, repository: Repository, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adeye.report.build.MAX_READ", 1)
    told = builder.build(no_replays)
    root = known(repository.evidence.root(told.campaign))
    assert told.evidence_digest == root.root
    assert 0 < told.integrity_rules < 28


@pytest.mark.slow
def test_root_that_nobody_stored_is_not_printed(
    builder: ReportBuilder, repository: Repository, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of somebody who made every hash and the ledger agree with what was altered."""
    root = known(repository.evidence.root(builder.campaign.id))
    other = replace(root, root="f" * 64)
    monkeypatch.setattr(type(repository.evidence), "computed_root", lambda *_: other)
    told = replace(builder).build(no_replays)
    assert (told.exit_code, told.evidence_digest) == (ExitCode.INTEGRITY, root.root)
    assert "its evidence has root ffffffffffff" in told.message
    assert arrange(told).gate == badge(Verdict.ERROR), "nothing is green"
    verified = replace(builder, is_verified=True).build(no_replays)
    assert verified.exit_code is ExitCode.OK, "who compared the rows tells"


def test_runs_are_read_once(builder: ReportBuilder, rows: list[dict[str, Any]]) -> None:
    assert len(builder.figures) == len(rows)
    assert builder.figures is builder.figures
