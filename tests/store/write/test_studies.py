"""Forks beside the campaigns: found by their digest, and counted by no campaign."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from adeye.errors import InputError, IntegrityError
from adeye.judge.timeline import Timeline
from adeye.judge.verdict import ExitCode
from adeye.store.evidence import roots
from adeye.store.evidence.roots import CertificateRecord
from adeye.store.read.bulk import executed_runs
from adeye.store.read.checking import EVIDENCE_RULES, check_campaign
from adeye.store.read.totals import gate_code
from adeye.store.records import BlockCase
from adeye.store.repository import Repository
from adeye.store.rules import NOT_CERTIFIED
from adeye.store.write import studies as benchmarks
from adeye.store.write import studies as hindsight
from tests.project import Executed
from tests.store.conftest import Store
from tests.store.rows import run_block
from tests.stored import known as sure


@pytest.fixture
def campaign(store: Store) -> str:
    return str(store.campaign(8))


def test_a_fork_is_its_run_with_the_override(store: Store, campaign: str) -> None:
    fork = store.fork(campaign)
    origin = store.repository.find_run("0", campaign=campaign)
    found = store.repository.find_run(fork.result_digest[:12])
    assert (found.campaign, found.ordinal, found.is_done) == (campaign, 0, True)
    assert (found.result_digest, found.test_case) == (fork.result_digest, fork.test_case)
    assert found.scenario == origin.scenario
    stored = store.run(fork.result_digest)
    assert [item.fsr_id for item in stored.verdicts] == ["FSR1"]
    plain, forked = map(store.repository.test_case_row, (origin.test_case, fork.test_case))
    assert plain.fork is None
    assert forked.fork == fork
    assert replace(forked, test_case=plain.test_case, fork=None) == plain


def test_no_campaign_counts_a_fork(store: Store, campaign: str) -> None:
    def seen() -> tuple[object, ...]:
        return (
            store.repository.progress(campaign),
            store.repository.fsr_status(campaign),
            store.repository.gate(campaign),
            store.repository.results(campaign),
            store.result_hash(campaign),
            len(store.repository.campaigns()),
        )

    before = seen()
    store.fork(campaign)
    rows = store.repository.info().rows
    store.fork(campaign)
    assert store.repository.info().rows == rows
    assert seen() == before
    assert store.repository.verify() == ()


def test_a_fork_that_comes_out_otherwise_is_refused(store: Store, campaign: str) -> None:
    fork = store.fork(campaign)
    case = BlockCase(0, fork.test_case, fork.result_digest, has_result=False, missing_fsrs=())
    other = run_block([store.example.run(case, trace_digest="0" * 32)])
    with pytest.raises(IntegrityError, match="differ"):
        store.repository.hindsight.save_forks([fork], other)


def test_results_of_other_forks_are_refused(store: Store, campaign: str) -> None:
    fork = store.fork(campaign)
    with pytest.raises(ValueError, match="not those of the forks"):
        store.repository.hindsight.save_forks([fork], run_block([]))


def test_the_chain_of_a_run_is_read_link_by_link(store: Store, campaign: str) -> None:
    links = store.run(store.repository.find_run("0", campaign=campaign).result_digest).links
    assert [len(link) for link in links or ()] == [32]


def test_what_is_kept_is_found_as_it_was(store: Store, campaign: str) -> None:
    before = (store.result_hash(campaign), store.repository.gate(campaign))
    found, line = store.hindsight(campaign)
    rows = store.repository.info().rows
    store.hindsight(campaign)
    assert store.repository.info().rows == rows
    assert (store.result_hash(campaign), store.repository.gate(campaign)) == before
    kept = store.repository.hindsight
    assert kept.injections(campaign) == (found,)
    assert kept.takeovers(campaign) == (line,)
    (compared,) = kept.benchmarks.comparisons(campaign)
    assert (compared.model, compared.edition, compared.drive) == ("cc", "r157-01", compared.run)
    assert compared.cell in {"both_avoid", "neither", "unknown"}
    assert store.repository.verify() == ()


def test_another_finding_for_the_same_run_is_refused(store: Store, campaign: str) -> None:
    found, line = store.hindsight(campaign)
    with pytest.raises(IntegrityError, match=r"injection of run .* something else"):
        store.repository.hindsight.save_injections([replace(found, times=Timeline(1.0))])
    with pytest.raises(IntegrityError, match=r"takeover of run .* something else"):
        store.repository.hindsight.save_takeovers([replace(line, class_="spurious")])


def test_another_version_of_the_timeline_does_not_take_what_an_older_one_found(
    store: Store, campaign: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, line = store.hindsight(campaign)
    monkeypatch.setattr("adeye.judge.timeline.TIMELINE_VERSION", 9)
    monkeypatch.setattr(hindsight, "TAKEOVERS_VERSION", 9)
    assert store.repository.hindsight.injections(campaign) == ()
    assert store.repository.hindsight.takeovers(campaign) == ()
    later = replace(found, times=replace(found.times, detect_s=1.5))
    store.repository.hindsight.save_injections([later])
    store.repository.hindsight.save_takeovers([replace(line, class_="late")])
    assert store.repository.hindsight.injections(campaign) == (later,)


def test_views_show_the_newest_finding_of_each_run_and_fork(
    store: Store, campaign: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, line = store.hindsight(campaign)
    monkeypatch.setattr("adeye.judge.timeline.TIMELINE_VERSION", 9)
    store.repository.hindsight.save_injections([replace(found, class_="detected_late")])
    [shown] = store.rows(
        "SELECT campaign, run, class, fdti_s, frti_s, fhti_s, eoti_s, ftti_s, margin_s, detect_s "
        "FROM v_faults"
    )
    assert shown[:3] == (campaign, found.run, "detected_late")
    assert shown[3:] == pytest.approx((0.25, 0.25, 0.5, 4.5, 3.0, 2.5, 1.25))
    [fork] = store.rows(
        "SELECT campaign, run, fork, authority, from_tick, class, takeover_s, fork_violation_s "
        "FROM v_forks"
    )
    assert fork[:6] == (campaign, line.run, line.fork, "safety", 40, "needed_and_done")
    assert fork[6:] == pytest.approx((1.3, 4.0))


def test_fork_that_nobody_classified_has_no_class(store: Store, campaign: str) -> None:
    store.fork(campaign)
    assert store.rows("SELECT class, takeover_s FROM v_forks") == [(None, None)]


def test_measured_pairs(store: Store, campaign: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found, _ = store.hindsight(campaign)
    asked = "SELECT run, fsr FROM v_verdicts WHERE campaign = ? AND exercised = 1"
    rows = store.rows(asked, (campaign,))
    fsrs = sorted({fsr for _, fsr in rows})
    expected = {(run, fsr) for run, fsr in rows if run == found.run}
    assert 0 < len(expected) < len(set(rows))
    assert store.repository.hindsight.exercised(campaign, fsrs) == expected
    assert store.repository.hindsight.exercised(campaign, ["FSR-99"]) == frozenset()
    assert store.repository.hindsight.exercised("f" * 32, fsrs) == frozenset()
    monkeypatch.setattr("adeye.judge.timeline.TIMELINE_VERSION", 9)
    assert store.repository.hindsight.exercised(campaign, fsrs) == frozenset()


@pytest.mark.parametrize(
    ("actor", "time", "is_same"),
    [("lead", 4.0, True), ("lead", 9.0, True), ("lead", 9.5, False), ("other", 4.0, False)],
)
def test_contacts_of_one_hazard_are_with_one_road_user_and_near(
    actor: str, time: float, *, is_same: bool
) -> None:
    item = SimpleNamespace(
        contact_actor="lead",
        contact_time_s=4.0,
        drive_contact_actor=actor,
        drive_contact_time_s=time,
    )
    assert benchmarks._is_same(item) is is_same
    assert not benchmarks._is_same(SimpleNamespace(**{**vars(item), "contact_time_s": None}))


def test_drives_of_another_version(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign = store.campaign(4)
    store.hindsight(campaign)
    monkeypatch.setattr(benchmarks, "BENCHMARK_VERSION", 9)
    assert store.repository.hindsight.benchmarks.comparisons(campaign) == []


def test_every_executed_run_is_a_candidate_once(store: Store) -> None:
    campaign = store.campaign(4)
    found = store.repository.hindsight.benchmarks.candidates(campaign)
    assert [item.run.ordinal for item in found] == list(range(len(found)))
    assert len(found) == store.repository.progress(campaign).executed


def test_contacts_without_a_drive_of_this_version_are_open(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db = shutil.copyfile(mini.db, tmp_path / "adeye.db")
    with Repository.open(db, create=False) as repository:
        campaign, kept = mini.summary.campaign, repository.hindsight.benchmarks
        found = kept.candidates(campaign)
        contacts = sorted(item.run.result_digest for item in found if item.contact is not False)
        drives = [benchmarks.DriveRecord(run, "cc", "r157-01", run) for run in contacts]
        for count in (0, 1, len(contacts)):
            kept.save((), (), None, drives[:count])
            assert kept.open_contacts(campaign) == len(contacts) - count
        assert kept.open_contacts("f" * 32) == 0
        monkeypatch.setattr(benchmarks, "BENCHMARK_VERSION", 9)
        assert kept.open_contacts(campaign) == len(contacts) > 1


def test_withdrawn_run_is_none_of_those_whose_faults_and_forks_are_counted(store: Store) -> None:
    campaign = store.campaign(4)
    found, _ = store.hindsight(campaign)
    seen = "SELECT run FROM v_faults UNION SELECT run FROM v_forks UNION SELECT run FROM v_timeline"
    assert (found.run,) in map(tuple, store.rows(seen))
    assert store.repository.evidence.withdraw(found.run, author="me", reason="wrong map")
    assert (found.run,) not in map(tuple, store.rows(seen))
    assert store.repository.hindsight.injections(campaign) == ()
    assert store.repository.hindsight.takeovers(campaign) == ()


def test_withdrawn_run_has_no_result_in_what_lists_executed_runs(store: Store) -> None:
    campaign = store.campaign(4)
    known = store.repository.hindsight
    first, *others = known.executed(campaign)
    assert store.repository.evidence.withdraw(first.result_digest, author="me", reason="wrong map")
    assert known.executed(campaign) == others
    assert first not in [item.run for item in known.benchmarks.candidates(campaign)]
    assert executed_runs(store.repository.location, campaign).without_result == 1
    assert store.rows("SELECT rule FROM v_check WHERE rule = 'not_run'")


def test_withdrawn_fork_tells_no_decision(store: Store) -> None:
    campaign = store.campaign(4)
    _, line = store.hindsight(campaign)
    assert store.repository.evidence.withdraw(line.fork, author="me", reason="wrong map")
    assert store.repository.hindsight.takeovers(campaign) == ()
    assert not store.rows("SELECT run FROM v_forks")


def test_sample_with_a_withdrawn_twin_tells_no_uncertainty(store: Store) -> None:
    campaign = store.campaign(4)
    store.halved(campaign)
    info = store.repository.find_campaign(campaign)
    (twin,) = next(iter(store.rows("SELECT result_digest FROM half_step")))
    assert "withdrawn" not in gate_code(store.repository, info)[1]
    assert store.repository.evidence.withdraw(twin, author="me", reason="wrong map")
    (line,) = store.repository.hindsight.half_steps.uncertainty(campaign)
    assert (line.difference.pairs, line.difference.uncertainty) == (10, None)
    assert [item.result_digest for item in store.repository.evidence.withdrawals(campaign)] == [
        twin
    ]
    code, why = gate_code(store.repository, info)
    assert code is ExitCode.INCOMPLETE
    assert "1 result is withdrawn" in why
    other = store.campaign(8)
    assert store.repository.evidence.withdrawals(other) == ()


def test_result_of_a_second_try_is_said_and_refused_if_code_from_outside_raised(
    store: Store,
) -> None:
    plan = store.plan(4)
    block = store.claim(plan.campaign)
    raised = "PluginError: the sensor ./s.py:S raised ValueError: by chance\nat s.py:3"
    assert store.repository.fail_block(block, raised) == "pending"
    store.work_off(plan.campaign)
    count = len(block.cases)
    # The second campaign takes its results from the first one.
    for name in (plan.campaign, store.campaign(8)):
        info = store.repository.find_campaign(name)
        assert store.repository.tried_again(info.id) == {raised: count}
        code, why = gate_code(store.repository, info)
        assert code is ExitCode.INCOMPLETE
        assert (
            f"{count} results came out only when their block was tried again: the sensor ./s.py:S "
            "raised ValueError: by chance (mend the part, or allow it" in why
        )


def test_what_was_given_up_and_told_is_said_and_not_refused_when_it_is_run_again(
    store: Store,
) -> None:
    plan = store.plan(4)
    block = store.claim(plan.campaign)
    store.repository.quarantine_block(block, "PluginError: no licence")
    assert store.repository.queue.requeue_quarantined(plan.campaign) == 1
    store.work_off(plan.campaign)
    info = store.repository.find_campaign(plan.campaign)
    assert store.repository.tried_again(info.id) == {"no licence": len(block.cases)}
    assert "mend the part" not in gate_code(store.repository, info)[1]


def test_result_of_a_second_try_is_not_refused_if_a_worker_was_lost(store: Store) -> None:
    alone, _ = gate_code(store.repository, store.repository.find_campaign(store.campaign(8)))
    plan = store.plan(12)
    block = store.claim(plan.campaign)
    store.repository.fail_block(block, "its worker ended with signal 9")
    store.work_off(plan.campaign)
    info = store.repository.find_campaign(plan.campaign)
    assert store.repository.tried_again(info.id)
    assert gate_code(store.repository, info)[0] is alone


def test_result_that_came_out_otherwise_is_green_nowhere_any_more(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    info = store.repository.find_campaign(store.campaign(4))
    sound = gate_code(store.repository, info)
    runs = [run for (run,) in store.rows("SELECT run FROM v_runs ORDER BY run")]

    def found(name: str) -> list[str]:
        checked = check_campaign(store.repository.location, name, rules=EVIDENCE_RULES)
        return [i.detail for i in sure(checked).violations if i.rule == NOT_CERTIFIED.name]

    def told(*findings: str, at: str) -> None:
        monkeypatch.setattr(roots, "utc_text", lambda _: f"{at}T00:00:00.000+00:00")
        tried = [{"condition": "batch", "runs": 4}]
        listed = [{"run": run, "conditions": ["batch"]} for run in findings]
        kept = CertificateRecord(info.id, "1", "portable", 4, 1000, 4, 0, tried, listed)
        store.repository.hindsight.certificates.save(kept)

    def differ(count: int, day: str) -> None:
        for name in (info.id, store.campaign(8)):  # which has the same four results, and more
            code, why = gate_code(store.repository, store.repository.find_campaign(name))
            assert code is ExitCode.INTEGRITY
            assert found(name) == [why]
            assert why.startswith(f"{count} result")
            assert f"executed runs again on {day}: {runs[0][:10]}" in why
            assert all(run[:10] in why for run in runs[:count])

    assert found(info.id) == []
    told("another result", at="2026-01-30")
    assert (*gate_code(store.repository, info), found(info.id)) == (*sound, [])
    told(runs[0], at="2026-01-31")
    # It may come out as it is another time, whatever the clock says then.
    for day in ("2026-02-01", "2026-01-01"):
        told(at=day)
        differ(1, "2026-01-31")
    told(runs[0], runs[1], at="2026-01-01")
    differ(2, "2026-01-31")
    assert store.repository.evidence.withdraw(runs[0], author="me", reason="not the same again")
    assert store.repository.evidence.withdraw(runs[1], author="me", reason="not the same again")
    assert gate_code(store.repository, info)[0] is ExitCode.INCOMPLETE


def test_no_copy_leaves_behind_what_a_certificate_has_against_a_result(
    store: Store, tmp_path: Path
) -> None:
    smaller, larger = store.campaign(4), store.campaign(8)
    (run, *_) = [run for (run,) in store.rows("SELECT run FROM v_runs ORDER BY run")]
    findings = [{"run": run, "conditions": ["batch"]}]
    kept = CertificateRecord(smaller, "1", "portable", 4, 1000, 4, 0, [], findings)
    store.repository.hindsight.certificates.save(kept)
    with Repository.open(tmp_path / "kept.db") as into:
        with pytest.raises(InputError, match="1 of the results came out otherwise") as caught:
            into.copy(store.repository.location, [larger])
        assert f"--campaign {smaller[:10]}" in str(caught.value)
        assert into.campaigns() == ()
        into.copy(store.repository.location, [larger, smaller])
        assert gate_code(into, into.find_campaign(larger))[0] is ExitCode.INTEGRITY


# --- twins with half the step and what they told: kept once, refused when they contradict


def test_what_twins_told_is_read_as_it_was_saved(store: Store) -> None:
    campaign = store.campaign(4)
    assert store.repository.hindsight.half_steps.uncertainty(campaign) == ()
    store.halved(campaign)
    (line,) = store.repository.hindsight.half_steps.uncertainty(campaign)
    found = line.difference
    assert (found.name, found.unit, found.pairs, found.uncertainty) == ("FSR9", "m", 11, 0.5)
    assert found.changes == {"PASS → FAIL": 1}
    assert (line.fsr_digest, line.judged_digest) == ("f" * 64, "e" * 64)
    store.halved(campaign)
    assert store.repository.hindsight.half_steps.uncertainty(campaign) == (line,)
    assert store.repository.verify() == ()


def test_something_else_is_refused(store: Store) -> None:
    campaign = store.campaign(4)
    store.halved(campaign)
    halves = store.repository.hindsight.half_steps
    (line,) = halves.uncertainty(campaign)
    other = replace(line, difference=replace(line.difference, p95=0.6))
    with pytest.raises(IntegrityError, match="something else before"):
        halves.save_uncertainty(campaign, [other])
    assert halves.uncertainty(campaign) == (line,)
