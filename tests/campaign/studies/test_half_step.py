"""Twins with half the step: which are chosen, what they tell, how runs are judged with that."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import adeye
from adeye.answers import claim, describe_run
from adeye.campaign import run as runner
from adeye.campaign.integrity import check_stored
from adeye.campaign.plan import CampaignPlan
from adeye.campaign.replay import replay_run, rerun
from adeye.campaign.selection import Choice, Shard
from adeye.campaign.stale import Staleness, find_stale
from adeye.campaign.studies import half_step as halving
from adeye.campaign.studies.forks import fork_run
from adeye.campaign.studies.half_step import twin_of, uncertainty_table
from adeye.campaign.traces import altered_files
from adeye.campaign.work import BatchResult, BatchTask, execute
from adeye.errors import InputError, IntegrityError, SpecError
from adeye.judge.uncertainty import Difference, differences, sampled_metric
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.claims import ClaimOptions
from adeye.report.gate import baseline
from adeye.report.gate.changes import Tolerances
from adeye.report.gate.decide import judge_campaign
from adeye.store.records import RAISED
from adeye.store.repository import Repository
from tests.conftest import MakeProject
from tests.project import (
    CANDIDATE,
    CANDIDATE_ONLY,
    CONCEPT,
    MINI,
    Executed,
    Project,
    count_rows,
    one_scenario,
    run_cases,
)
from tests.refusals import refused
from tests.sql import alter, rows
from tests.stored import known, stored

# --- twins with half the step: which are chosen, what they tell, and how runs are judged with that


SPEEDS = ["80 km/h", "100 km/h", "120 km/h"]
GAPS = ["20 m", "30 m", "40 m", "50 m", "60 m"]
BRAKINGS = {"from": "3 m/s^2", "to": "6 m/s^2", "step": "0.25 m/s^2"}
UNASKED = one_scenario(ego_speed=SPEEDS, gap=GAPS)
SAMPLED = {"uncertainty": {"situations": 12}}
ASKED: dict[str, Any] = {**UNASKED, **SAMPLED}
"""Fifteen situations, two architectures; twelve situations of each are executed with half too."""
RUNS, TWINS = 30, 24
WATCHED = ("FSR-02", "camera_radar")


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> Executed:
    project = Project(tmp_path_factory.mktemp("asked"), ASKED)
    return Executed(project, project.plan(), project.run(), project.db)


def lines(project: Project) -> list[tuple[Any, ...]]:
    """What halving the step changed, without what names the campaign."""
    sql = """SELECT scenario, architecture, kind, name, unit, sampled, pairs, p95, largest,
        uncertainty, differing, changes, fsr_digest, judged_digest FROM uncertainty
        ORDER BY scenario, architecture, kind, name, unit"""
    return rows(project.db, sql)


def verdicts(project: Project) -> list[tuple[Any, ...]]:
    sql = "SELECT run, fsr, verdict, margin, detail FROM v_verdicts ORDER BY run, fsr"
    return rows(project.db, sql)


def chosen(plan: CampaignPlan) -> dict[tuple[str, str], tuple[str, ...]]:
    return {(item.scenario, item.architecture): item.results for item in plan.samples}


# --- the sample


def test_sample_is_that_of_the_smallest_situations(asked: Executed) -> None:
    plan = asked.project.plan()
    assert [len(item.results) for item in plan.samples] == [12, 12]
    for item in plan.samples:
        cases = [case for case in plan.cases if case.architecture.architecture == item.architecture]
        cases.sort(key=lambda case: case.situation_digest)
        assert [plan.cases[ordinal].digest for ordinal in item.ordinals] == [
            case.digest for case in cases[:12]
        ]


@pytest.mark.slow
def test_unrelated_edits_leave_the_sample(make_project: MakeProject) -> None:
    project = make_project(ASKED)
    before = chosen(project.plan())
    with project.edited_odd() as odd:
        odd["title"] = "Another title"
        other = {**MINI["scenarios"][1], "sweep": {"parameters": {"deceleration": BRAKINGS}}}
        odd["scenarios"] = [other, *odd["scenarios"]]
        odd["scenarios"][1]["faults"] = ["front_camera_out"]
        odd["faults"] = MINI["faults"][:1]
        odd["architectures"] = odd["architectures"][::-1]
    with project.edited(CONCEPT) as concept:
        concept["requirements"][1]["bound"]["at_most"] = 5.5
    after = chosen(project.plan())
    # The fault that came adds runs of the same situations, and changes none.
    assert all(set(results) < set(after[key]) for key, results in before.items())
    assert len(after) == 4


def test_situation_is_sampled_without_a_fault_and_with_one_of_its_faults(tmp_path: Path) -> None:
    odd = one_scenario("cut_in", "front_camera_out", "nominal_silent", ego_speed=SPEEDS, gap=GAPS)
    odd["scenarios"][0]["faults"] = ["none", "front_camera_out", "nominal_silent"]
    plan = Project(tmp_path, {**odd, **SAMPLED}).plan()
    for item in plan.samples:
        entries: dict[str, list[str]] = {}
        for case in (plan.cases[ordinal] for ordinal in item.ordinals):
            entries.setdefault(case.situation_digest, []).append(case.fault_entry)
        assert list(entries) == sorted(entries)
        assert len(entries) == 12
        assert all(len(found) == 2 and found[0] == "none" for found in entries.values())
        assert {found[1] for found in entries.values()} == {"front_camera_out", "nominal_silent"}


def test_more_points_change_little_of_the_sample(asked: Executed, tmp_path: Path) -> None:
    before = chosen(asked.plan)
    more = one_scenario(ego_speed=SPEEDS, gap=[*GAPS, "45 m"])
    for key, results in chosen(Project(tmp_path, {**more, **SAMPLED}).plan()).items():
        assert len(set(results) & set(before[key])) >= 12 - len(SPEEDS)


def test_variants_of_an_architecture_are_one_situation(tmp_path: Path) -> None:
    yaw = {"architecture.sensors.front_camera.mount.yaw": ["0 deg", "2 deg"]}
    odd = one_scenario("cut_in", **{"ego_speed": SPEEDS, "gap": GAPS, **yaw})
    plan = Project(tmp_path, {**odd, **SAMPLED}).plan()
    for item in plan.samples:
        situations = {plan.cases[ordinal].situation_digest for ordinal in item.ordinals}
        assert len(situations) == len(item.ordinals) == 12


def test_twin_has_the_same_situation_and_noise_and_half_the_step(asked: Executed) -> None:
    case = asked.project.plan().cases[0]
    twin = twin_of(case)
    assert twin.step == case.step / 2
    assert (twin.situation_digest, twin.stream_seed) == (case.situation_digest, case.stream_seed)
    assert twin.digest != case.digest


def test_clock_beyond_ticks(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> None:
    project = make_project(ASKED)
    scenarios = [case.scenario for case in project.plan().examples()]
    longest = max(max(scenario.horizon, scenario.tail) for scenario in scenarios)
    monkeypatch.setattr("adeye.simulate.world.clock.MAX_TICKS", int(longest / 0.05) + 1)
    raised = refused(SpecError, project.plan, says=r"half the step, 0\.025 s")
    assert raised.where is not None
    assert raised.where.line is not None


# --- what it tells


def test_uncertainty_is_that_of_the_stored_pairs(asked: Executed) -> None:
    pairs = """SELECT m.min_distance_m, n.min_distance_m FROM half_step h
        JOIN run a ON a.result_digest = h.origin_digest
        JOIN run b ON b.result_digest = h.result_digest
        JOIN metric m ON m.run_number = a.number JOIN metric n ON n.run_number = b.number
        JOIN campaign_case c ON c.result_digest = h.origin_digest
        WHERE c.architecture = 'camera_radar'"""
    kept = """SELECT pairs, uncertainty, largest FROM v_uncertainty
        WHERE name = 'min_distance_m' AND architecture = 'camera_radar'"""
    worst = max(abs(first - last) for first, last in rows(asked.db, pairs))
    assert worst > 0.0
    assert rows(asked.db, kept) == [(12, worst, worst)]


def test_every_fsr_and_metric_has_a_line(asked: Executed) -> None:
    found = {(line[1], line[2], line[3]) for line in lines(asked.project)}
    plan = asked.project.plan()
    for architecture in plan.files.architectures:
        for item in plan.requirements:
            has_line = (architecture, "fsr", item.requirement.id) in found
            assert has_line == (architecture not in item.not_applicable)
    assert ("camera_radar", "metric", "min_ttc_s") in found


@pytest.mark.slow
@pytest.mark.parametrize(("workers", "threads", "batch"), [(1, 2, 5), (2, 1, 64)])
def test_uncertainty_and_verdicts_do_not_depend_on_how_runs_are_executed(
    asked: Executed,
    make_project: MakeProject,
    monkeypatch: pytest.MonkeyPatch,
    workers: int,
    threads: int,
    batch: int,
) -> None:
    monkeypatch.setattr(halving, "_BATCH", batch)
    project = make_project(ASKED)
    summary = project.run(workers=workers, threads=threads)
    assert (summary.executed, summary.twins) == (RUNS, TWINS)
    assert lines(project) == lines(asked.project)
    assert verdicts(project) == verdicts(asked.project)


@pytest.mark.slow
def test_uncertainty_falls_with_the_step_as_its_order_says(asked: Executed) -> None:
    plan = asked.plan
    for sample in plan.samples:
        cases = [plan.cases[ordinal] for ordinal in sample.ordinals]
        first, second = (of_step(plan, cases, step) for step in (0.05, 0.025))
        # Rows are counted, of which twice as many tell the time to half of a step.
        assert first["rss_violation_s"].uncertainty == pytest.approx(0.05 / 2)
        assert second["rss_violation_s"].uncertainty == pytest.approx(0.025 / 2)
        if sample.architecture == "legacy_camera":
            # Nobody reacts to the cut-in, so nothing is decided a tick earlier or later: what is
            # left is the row that is nearest to the least distance, an error of second order.
            whole, half = (found["min_distance_m"].uncertainty for found in (first, second))
            assert whole is not None
            assert half is not None
            assert half / whole == pytest.approx(0.25, rel=0.15)


@pytest.mark.slow
def test_requirement_about_a_fault_has_an_uncertainty(tmp_path: Path) -> None:
    odd = one_scenario("cut_in", "nominal_silent", ego_speed=SPEEDS, gap=GAPS)
    project = Project(tmp_path, {**odd, **SAMPLED, "architectures": CANDIDATE_ONLY})
    with project.edited(CONCEPT) as concept:
        stop = next(item for item in concept["requirements"] if item["id"] == "FSR-05")
        stop |= {"formula": "always(faulted implies ego.acceleration >= -4.5 m/s^2)"}
        concept["requirements"] = [stop]
    project.run()
    (found,) = [row for row in lines(project) if row[2] == "fsr"]
    sampled, pairs, p95 = found[5:8]
    assert (sampled, pairs) == (24, 12)
    assert 0.0 < p95 < 0.5
    sql = "SELECT MIN(time_s) FROM event WHERE kind = 'fault' GROUP BY run_number"
    begun = rows(project.db, sql)
    # With the step and with half of it, the fault begins when the ODD says.
    assert {round(time, 9) for (time,) in begun} == {3.0}
    assert len(begun) >= 24


@pytest.mark.slow
def test_noise_of_a_run_is_that_of_its_twin(asked: Executed) -> None:
    cases = [case for case in asked.plan.cases if case.architecture.architecture == "camera_radar"]
    whole = run_cases(asked.plan, cases)["detections"]
    half = run_cases(asked.plan, [twin_of(case) for case in cases])["detections"]
    # Before anybody reacts the scenes differ by what the integrator leaves, the draws by nothing.
    before = slice(0, 20)
    assert np.isfinite(whole[:, before]).any()
    np.testing.assert_allclose(whole[:, before], half[:, ::2][:, before], rtol=0.0, atol=1e-7)


def of_step(plan: CampaignPlan, cases: list[Any], step: float) -> dict[str, Difference]:
    whole = [replace(case, step=step) for case in cases]
    first, second = (metrics_of(plan, part) for part in (whole, [twin_of(case) for case in whole]))
    return {
        name: differences("metric", name, list(zip(first[name], second[name], strict=True)))[0]
        for name in ("rss_violation_s", "min_ttc_s", "min_distance_m")
    }


def metrics_of(plan: CampaignPlan, cases: list[Any]) -> Mapping[str, list[Any]]:
    done = execute(BatchTask(1, tuple(cases), (), plan.work))
    assert done.runs is not None, done.failure
    block = done.runs.metrics
    statuses = np.where(np.isfinite(block.value), "value", "none")
    return {
        name: [
            sampled_metric(name, float(block.value[run, place]), str(statuses[run, place]), "s")
            for run in range(len(cases))
        ]
        for place, name in enumerate(block.ids)
    }


# --- judging


def test_margins_below_the_uncertainty_are_inconclusive_and_no_others(asked: Executed) -> None:
    sql = """SELECT p.verdict, p.margin, p.detail, j.verdict, j.margin, j.detail, u.uncertainty
        FROM campaign_case c JOIN run r ON r.result_digest = c.result_digest
        JOIN uncertainty u ON u.scenario = c.scenario AND u.architecture = c.architecture
        JOIN verdict p ON p.run_number = r.number AND p.fsr_digest = u.fsr_digest
        JOIN verdict j ON j.run_number = r.number AND j.fsr_digest = u.judged_digest
        WHERE u.kind = 'fsr' AND u.unit = COALESCE(p.unit, '')"""
    seen = set()
    for plain, margin, detail, judged, same, why, least in rows(asked.db, sql):
        assert same == margin
        is_small = plain == "PASS" and least is not None and margin is not None and margin < least
        assert judged == ("INCONCLUSIVE" if is_small else plain)
        assert is_small == (why is not None and why.startswith("margin below the numeric uncert"))
        assert is_small or why == detail
        seen.add((plain, judged))
    assert {("PASS", "INCONCLUSIVE"), ("PASS", "PASS"), ("FAIL", "FAIL")} <= seen


@pytest.mark.slow
def test_rows_are_those_of_the_judge_with_the_same_uncertainty(asked: Executed) -> None:
    with Repository.open(asked.db, create=False) as repository:
        campaign = asked.summary.campaign
        found = set()
        for ordinal in range(0, RUNS, 4):
            run = repository.find_run(str(ordinal), campaign=campaign)
            done = rerun(repository, run)
            stored = {item.fsr_digest: item for item in done.stored.verdicts}
            assert len(stored) == 2 * len(done.evaluation.judgements[0])
            for judged in done.evaluation.judgements[0]:
                row = stored[judged.fsr_digest]
                for name in ("verdict", "margin", "unit", "time_s", "actor", "value", "detail"):
                    assert getattr(row, name) == getattr(judged, name), name
                found.add(row.verdict)
    assert Verdict.INCONCLUSIVE in found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "verdict"),
    [
        (-0.01, Verdict.FAIL),
        (0.5, Verdict.INCONCLUSIVE),
        (0.99, Verdict.INCONCLUSIVE),
        (1.01, Verdict.PASS),
        (2.0, Verdict.PASS),
    ],
)
def test_threshold_decides_by_the_uncertainty_and_a_failure_stays_one(
    asked: Executed, tmp_path: Path, share: float, verdict: Verdict
) -> None:
    least, worst = worst_deceleration(asked)
    project = Project(tmp_path / "seeded", ASKED)
    with project.edited(CONCEPT) as concept:
        # The bound stands above the worst run by a share of the uncertainty.
        concept["requirements"][1]["bound"]["at_most"] = worst + share * least
    summary = project.run()
    (line,) = [it for it in summary.verdicts if (it.fsr, it.architecture) == WATCHED]
    assert line.verdict is verdict
    assert line.margin == pytest.approx(share * least)
    if verdict is Verdict.FAIL:
        return
    # A fork of the run is held against the same: the margin of both is the run's.
    with Repository.open(project.db, create=False) as repository:
        gate = repository.gate(summary.campaign)
    (run,) = [it.worst_run for it in gate if (it.fsr, it.architecture) == WATCHED]
    forked = fork_run(project.db, known(run), start="0", authority="nominal")
    assert forked.origin.verdicts["FSR-02"] == line.verdict.value
    if forked.is_same:
        assert forked.fork.verdicts["FSR-02"] == line.verdict.value


def worst_deceleration(asked: Executed) -> tuple[float, float]:
    sql = """SELECT (SELECT uncertainty FROM v_uncertainty
            WHERE name = 'FSR-02' AND architecture = 'camera_radar'),
        MAX(max_required_deceleration_mps2) FROM v_runs WHERE architecture = 'camera_radar'"""
    [(least, worst)] = rows(asked.db, sql)
    assert least > 0.0
    return float(least), float(worst)


@pytest.mark.slow
def test_asking_later_executes_only_twins(asked: Executed, make_project: MakeProject) -> None:
    project = make_project(UNASKED)
    plain = project.run()
    assert (plain.executed, plain.twins) == (RUNS, 0)
    assert lines(project) == []
    with project.edited_odd() as odd:
        odd["uncertainty"] = ASKED["uncertainty"]
    asked_for = staleness(project)
    assert {item.cause for item in asked_for.stale} == {"uncertainty"}
    assert (asked_for.counts, asked_for.there) == (0, 0)
    assert (asked_for.to_judge, asked_for.to_replay, asked_for.to_execute) == (RUNS, 0, TWINS)
    later = project.run()
    assert staleness(project).counts == staleness(project).there == asked_for.planned
    assert (later.executed, later.reused, later.judged, later.twins) == (0, RUNS, RUNS, TWINS)
    assert later.campaign != plain.campaign
    assert lines(project) == lines(asked.project)
    again = project.run()
    assert (again.executed, again.judged, again.twins) == (0, 0, 0)
    with project.edited_odd() as odd:
        del odd["uncertainty"]
    back = project.run()
    assert (back.campaign, back.executed, back.judged) == (plain.campaign, 0, 0)
    assert back.verdicts == plain.verdicts
    assert count_rows(project.db, "run") == RUNS + TWINS
    with Repository.open(project.db, create=False) as repository:
        assert repository.verify() == ()


@pytest.mark.slow
def test_withdrawn_twin_leaves_no_verdict_that_counts(make_project: MakeProject) -> None:
    project = make_project(ASKED)
    project.run()
    assert staleness(project).is_complete
    (twin,) = rows(project.db, "SELECT MIN(result_digest) FROM half_step")[0]
    with Repository.open(project.db, create=False) as repository:
        assert repository.evidence.withdraw(twin, author="J. Doe", reason="wrong map")
    found = staleness(project)
    place = """FROM half_step h JOIN campaign_case c ON c.result_digest = h.origin_digest
        WHERE h.result_digest = ?"""
    [(architecture, scenario)] = rows(
        project.db, f"SELECT DISTINCT c.architecture, c.scenario {place}", twin
    )
    assert [item.cause for item in found.stale] == ["withdrawn"]
    assert found.stale[0].architectures == (architecture,)
    assert found.counts == found.there == found.planned - found.stale[0].evidence
    assert not found.is_complete
    broken = known(check_stored(project.db)).findings
    assert [(item.rule, item.id) for item in broken if "half the step" in item.detail] == [
        ("not_run", scenario)
    ]


def test_odd_that_does_not_ask_is_the_content_that_it_was(make_project: MakeProject) -> None:
    plan = make_project(UNASKED).plan()
    assert "uncertainty" not in plan.record().odd.content["odd"]
    assert plan.samples == ()
    assert not any(item.judged for item in plan.record().fsrs)


def staleness(project: Project) -> Staleness:
    with Repository.open(project.db, create=False) as repository:
        return find_stale(repository, project.plan(), known(repository.latest_campaign()))


# --- interruption and failure


@pytest.mark.parametrize(
    ("part", "told"),
    [
        ("Channel", "channel_error of channel nominal in 10 twins with half the step of camera_"),
        ("Metric", "metric half_m raised in 10 twins with half the step"),
    ],
)
def test_what_fails_in_twins_alone_is_told_and_not_green(
    tmp_path: Path, part: str, told: str, caplog: pytest.LogCaptureFixture
) -> None:
    sample: dict[str, Any] = {"uncertainty": {"situations": 10}}
    project = Project(tmp_path, {**KEPT, **sample, "architectures": CANDIDATE_ONLY})
    (tmp_path / "odd/architectures/halved.py").write_text(stored("plugins")["halved"], "utf-8")
    if part == "Metric":
        with project.edited_odd() as odd:
            odd["plugins"] = ["architectures/halved.py:Metric"]
    else:
        with project.edited(CANDIDATE) as candidate:
            channel = {"kind": "./halved.py:Channel", "links": ["localisation"]}
            candidate["channels"]["nominal"] = channel
    with project.edited(CONCEPT) as concept:
        concept["requirements"] = concept["requirements"][:1]
    summary = project.run()
    assert {item.verdict for item in summary.verdicts} == {Verdict.PASS}
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert told in summary.message
    judged = adeye.gate(db=project.db)
    assert judged.exit_code is ExitCode.INCOMPLETE
    assert told in str(judged.findings)
    caplog.set_level("INFO", "adeye.notices")
    claim(project.db, None, ClaimOptions())
    assert told in caplog.text
    caplog.clear()
    with project.edited_odd() as odd:
        odd["gate"] = {"architectures": ["camera_radar"], "channel_failures": "allow"}
    allowed = project.run()
    assert allowed.exit_code is ExitCode.OK
    assert told in allowed.message
    claim(project.db, None, ClaimOptions())
    assert not [item for item in caplog.messages if "does not let" in item]


KEPT = one_scenario(ego_speed=SPEEDS, gap=GAPS[:4])
"""Twelve situations, of which ten are sampled where the uncertainty is asked for."""


@pytest.mark.parametrize("wanted", [pytest.param("all", marks=pytest.mark.slow), "failures"])
def test_traces_of_sampled_runs_are_kept_as_those_of_others(tmp_path: Path, wanted: Any) -> None:
    kept: list[list[tuple[Any, ...]]] = []
    for name, odd in (("plain", KEPT), ("asked", {**KEPT, "uncertainty": {"situations": 10}})):
        project = Project(tmp_path / name, {**odd, "architectures": CANDIDATE_ONLY})
        with project.edited(CONCEPT) as concept:
            concept["requirements"] = [
                {**item, "formula": "always(any_actor.distance >= 10 m or ego.speed <= 12 m/s)"}
                for item in concept["requirements"]
                if item["id"] == "FSR-01"
            ]
        runner.run_campaign(project.plan(), db=project.db, traces=wanted)
        sql = "FROM run JOIN kept_trace ON run_number = number ORDER BY result_digest"
        kept.append(rows(project.db, f"SELECT result_digest {sql}"))
        with Repository.open(project.db, create=False) as repository:
            assert (repository.verify(), [*altered_files(repository)]) == ((), [])
    assert kept[0]
    assert kept[0] == kept[1], "those of twins are not among them"
    assert wanted != "all" or len(kept[0]) == 12
    with project.edited(CONCEPT) as concept:
        (item,) = concept["requirements"]
        concept["requirements"] = [{**item, "formula": item["formula"].replace("10 m", "9 m")}]
    told = runner.judge_campaign(project.plan(), db=project.db)
    assert "nothing is judged without the twins" in told.message
    told = runner.run_campaign(project.plan(), db=project.db)
    assert (told.executed, told.twins) == (0, 10)
    assert told.replayed == 0 or wanted != "all"


@pytest.mark.slow
def test_interrupted_twins_are_gone_on_with(
    asked: Executed, make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(halving, "_BATCH", 5)
    project = make_project(ASKED)
    absorb = halving.HalfStepTasks.absorb
    left = iter(range(4))

    def interrupted(self: halving.HalfStepTasks, done: Any) -> None:
        if next(left, None) is None:
            raise KeyboardInterrupt
        absorb(self, done)

    with monkeypatch.context() as patched:
        patched.setattr(halving.HalfStepTasks, "absorb", interrupted)
        refused(KeyboardInterrupt, project.run)
    kept = count_rows(project.db, "run")
    assert 0 < kept < TWINS
    assert lines(project) == []
    assert verdicts_judged(project) == 0
    summary = project.run()
    assert summary.executed + summary.reused == RUNS
    assert count_rows(project.db, "run") == RUNS + TWINS
    assert lines(project) == lines(asked.project)
    assert verdicts(project) == verdicts(asked.project)


def verdicts_judged(project: Project) -> int:
    [(count,)] = rows(project.db, "SELECT COUNT(*) FROM v_verdicts WHERE verdict <> 'NOT_RUN'")
    return int(count)


@pytest.mark.slow
def test_twin_that_cannot_be_executed_leaves_nothing_judged(
    asked: Executed, make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = make_project(ASKED)
    bad = project.plan().samples[0].ordinals[3]
    situation = project.plan().cases[bad].situation_digest

    def failing(task: BatchTask) -> BatchResult:
        if any(case.step < 0.05 and case.situation_digest == situation for case in task.execute):
            return BatchResult(failure="ValueError: too fast a clock")
        return execute(task)

    with monkeypatch.context() as patched:
        patched.setattr(runner, "execute", failing)
        summary = project.run()
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert "twin with half the step of cut_in: ValueError: too fast a clock" in summary.message
    assert lines(project) == []
    assert verdicts_judged(project) == 0
    healed = project.run()
    assert healed.twins <= 2
    assert verdicts(project) == verdicts(asked.project)


def test_empty_shard_has_nothing_to_do(tmp_path: Path) -> None:
    project = Project(tmp_path, ASKED)
    session = runner.Session(choice=Choice(shard=Shard(3, 3)))
    summary = runner.run_campaign(project.plan(), db=project.db, session=session)
    assert (summary.selected, summary.executed, summary.twins) == (0, 0, 0)
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert "an empty selection is no success" in summary.message


# --- twins as runs


@pytest.mark.slow
def test_twin_is_found_and_replays_bit_for_bit(asked: Executed) -> None:
    sql = "SELECT result_digest, origin_digest FROM half_step ORDER BY 1 LIMIT 1"
    [(twin, origin)] = rows(asked.db, sql)
    assert replay_run(asked.db, twin).identical
    described = describe_run(asked.db, twin)
    assert described["step_s"] == 0.025
    assert described["situation"] == describe_run(asked.db, origin)["situation"]
    assert len(described["verdicts"]) == len(describe_run(asked.db, origin)["verdicts"])


def test_run_is_shown_with_the_verdicts_that_the_step_was_counted_in(asked: Executed) -> None:
    sql = "SELECT result_digest, origin_digest FROM half_step ORDER BY 1 LIMIT 1"
    [pair] = rows(asked.db, sql)
    fsrs = sorted(name for (name,) in rows(asked.db, "SELECT DISTINCT fsr_id FROM campaign_fsr"))
    for run in pair:
        assert sorted(item["fsr"] for item in describe_run(asked.db, run)["verdicts"]) == fsrs


def test_twins_are_in_no_selection_and_the_database_verifies(asked: Executed) -> None:
    assert len(asked.project.rows()) == RUNS
    assert count_rows(asked.db, "run") == RUNS + TWINS
    with Repository.open(asked.db, create=False) as repository:
        assert repository.verify() == ()


# --- the gate


def improved(now: Any, part: Any, at: int, gain: float) -> Any:
    """Give the margins of one FSR of some test cases a gain, so that they are lost now."""
    better = []
    for row in part.rows:
        margins = list(row.margins)
        margins[at] = None if margins[at] is None else margins[at] + gain
        better.append(row.model_copy(update={"margins": tuple(margins)}))
    changed = part.model_copy(update={"rows": tuple(better)})
    return now.model_copy(
        update={"cases": tuple(changed if it is part else it for it in now.cases)}
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "kind"), [(0.5, baseline.Kind.NOTE), (2.0, baseline.Kind.MARGIN)]
)
def test_gate_takes_no_loss_for_a_regression_that_the_step_is_worth(
    asked: Executed, tmp_path: Path, share: float, kind: baseline.Kind
) -> None:
    with Repository.open(asked.db, create=False) as repository:
        campaign = repository.find_campaign(asked.summary.campaign)
        now = judge_campaign(repository, campaign, None, Tolerances()).state
        worth = {
            (item.difference.name, item.architecture): item.difference.uncertainty
            for item in repository.hindsight.half_steps.uncertainty(campaign.id)
            if item.difference.kind == "fsr" and item.difference.unit
        }
        part, at, size = next(
            (part, at, size)
            for part in now.cases or ()
            if part.architecture in now.gate
            for at, (fsr, measure) in enumerate(zip(part.fsrs, part.measures, strict=True))
            if (size := worth.get((fsr, part.architecture)))
            and measure is not None
            and now.fsrs[fsr].mandatory
        )
        baseline.write_baseline(improved(now, part, at, share * size), tmp_path / "b.json")
        (found,) = judge_campaign(repository, campaign, tmp_path / "b.json", Tolerances()).changes
    assert (found.kind, found.fsr) == (kind, part.fsrs[at])
    assert (found in baseline.deciding([found])) is (kind is baseline.Kind.MARGIN)
    assert "the step is worth" in found.text


# --- reading what halving the step changed: only of a campaign that asked for it


def test_altered_uncertainty_is_refused(asked: Executed, tmp_path: Path) -> None:
    shutil.copyfile(asked.db, tmp_path / "altered.db")
    alter(tmp_path / "altered.db", "UPDATE uncertainty SET pairs = pairs + 1")
    with pytest.raises(IntegrityError, match=r"uncertainty .*: altered"):
        uncertainty_table(tmp_path / "altered.db")


@pytest.mark.parametrize("what", [None, "mini", "1"])
def test_campaign_that_did_not_ask_is_refused(mini: Executed, what: str | None) -> None:
    refused(InputError, uncertainty_table, mini.db, what, says="without numeric uncertainty")


def test_guest_that_raises_in_a_twin_once_is_not_tried_until_it_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sample: dict[str, Any] = {"uncertainty": {"situations": 10}}
    project = Project(tmp_path, {**KEPT, **sample, "architectures": CANDIDATE_ONLY})
    raised: list[int] = []

    def failing(task: BatchTask) -> BatchResult:
        if task.execute[0].step < 0.05 and not raised:
            raised.append(len(task.execute))
            return BatchResult(failure=f"{RAISED}sensor own.py:Radar raised ValueError: by chance")
        return execute(task)

    monkeypatch.setattr(runner, "execute", failing)
    summary = project.run()
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert "nothing is judged without the twins" in summary.message
    assert "by chance" in summary.message
