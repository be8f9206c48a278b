"""Forks beside the campaigns: found by their digest, and counted by no campaign."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import IntegrityError
from adeye.judge.timeline import Timeline
from adeye.store.records import BlockCase
from adeye.store.repository import Repository
from adeye.store.write import studies as benchmarks
from adeye.store.write import studies as hindsight
from tests.project import Executed
from tests.store.raw import raw_connection
from tests.store.rows import result_table_hash, run_block


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    return str(example.campaign(repository, 8))


def test_a_fork_is_found_where_its_run_stands(
    repository: Repository, example: Any, campaign: str
) -> None:
    fork = example.fork(repository, campaign)
    origin = repository.find_run("0", campaign=campaign)
    found = repository.find_run(fork.result_digest[:12])
    assert (found.campaign, found.ordinal, found.is_done) == (campaign, 0, True)
    assert (found.result_digest, found.test_case) == (fork.result_digest, fork.test_case)
    assert found.scenario == origin.scenario
    stored = repository.run_row(fork.result_digest)
    assert stored is not None
    assert [item.fsr_id for item in stored.verdicts] == ["FSR1"]


def test_the_test_case_of_a_fork_is_that_of_its_run_with_the_override(
    repository: Repository, example: Any, campaign: str
) -> None:
    fork = example.fork(repository, campaign)
    origin = repository.find_run("0", campaign=campaign)
    plain, forked = map(repository.test_case_row, (origin.test_case, fork.test_case))
    assert plain.fork is None
    assert forked.fork == fork
    assert replace(forked, test_case=plain.test_case, fork=None) == plain


def test_no_campaign_counts_a_fork(repository: Repository, example: Any, campaign: str) -> None:
    def seen() -> tuple[object, ...]:
        return (
            repository.progress(campaign),
            repository.fsr_status(campaign),
            repository.gate(campaign),
            repository.results(campaign),
            result_table_hash(repository, campaign),
            len(repository.campaigns()),
        )

    before = seen()
    example.fork(repository, campaign)
    assert seen() == before
    assert repository.verify() == ()


def test_the_same_fork_again_changes_nothing(
    repository: Repository, example: Any, campaign: str
) -> None:
    example.fork(repository, campaign)
    before = repository.info().rows
    example.fork(repository, campaign)
    assert repository.info().rows == before


def test_a_fork_that_comes_out_otherwise_is_refused(
    repository: Repository, example: Any, campaign: str
) -> None:
    fork = example.fork(repository, campaign)
    case = BlockCase(0, fork.test_case, fork.result_digest, has_result=False, missing_fsrs=())
    other = run_block([example.run(case, trace_digest="0" * 32)])
    with pytest.raises(IntegrityError, match="differ"):
        repository.hindsight.save_forks([fork], other)


def test_results_of_other_forks_are_refused(
    repository: Repository, example: Any, campaign: str
) -> None:
    fork = example.fork(repository, campaign)
    with pytest.raises(ValueError, match="not those of the forks"):
        repository.hindsight.save_forks([fork], run_block([]))


def test_the_chain_of_a_run_is_read_link_by_link(repository: Repository, campaign: str) -> None:
    run = repository.find_run("0", campaign=campaign)
    stored = repository.run_row(run.result_digest)
    assert stored is not None
    assert stored.links is not None
    assert [len(link) for link in stored.links] == [32]


@pytest.mark.slow
def test_what_is_kept_is_found_as_it_was(
    repository: Repository, example: Any, campaign: str
) -> None:
    found, line = example.hindsight(repository, campaign)
    assert repository.hindsight.injections(campaign) == (found,)
    assert repository.hindsight.takeovers(campaign) == (line,)
    assert repository.verify() == ()


def test_the_same_again_changes_nothing(
    repository: Repository, example: Any, campaign: str
) -> None:
    example.hindsight(repository, campaign)
    before = repository.info().rows
    example.hindsight(repository, campaign)
    assert repository.info().rows == before


def test_no_result_of_a_campaign_changes(
    repository: Repository, example: Any, campaign: str
) -> None:
    before = (result_table_hash(repository, campaign), repository.gate(campaign))
    example.hindsight(repository, campaign)
    assert (result_table_hash(repository, campaign), repository.gate(campaign)) == before


def test_another_finding_for_the_same_run_is_refused(
    repository: Repository, example: Any, campaign: str
) -> None:
    found, line = example.hindsight(repository, campaign)
    with pytest.raises(IntegrityError, match=r"injection of run .* something else"):
        repository.hindsight.save_injections([replace(found, times=Timeline(1.0))])
    with pytest.raises(IntegrityError, match=r"takeover of run .* something else"):
        repository.hindsight.save_takeovers([replace(line, class_="spurious")])


def test_another_version_of_the_timeline_does_not_take_what_an_older_one_found(
    repository: Repository, example: Any, campaign: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, line = example.hindsight(repository, campaign)
    monkeypatch.setattr(hindsight, "TIMELINE_VERSION", 9)
    monkeypatch.setattr(hindsight, "TAKEOVERS_VERSION", 9)
    assert repository.hindsight.injections(campaign) == ()
    assert repository.hindsight.takeovers(campaign) == ()
    later = replace(found, times=replace(found.times, detect_s=1.5))
    repository.hindsight.save_injections([later])
    repository.hindsight.save_takeovers([replace(line, class_="late")])
    assert repository.hindsight.injections(campaign) == (later,)


def test_views_show_the_newest_finding_of_each_run_and_fork(
    repository: Repository,
    example: Any,
    campaign: str,
    raw: sqlite3.Connection,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, line = example.hindsight(repository, campaign)
    monkeypatch.setattr(hindsight, "TIMELINE_VERSION", 9)
    repository.hindsight.save_injections([replace(found, class_="detected_late")])
    [shown] = raw.execute(
        "SELECT campaign, run, class, fdti_s, frti_s, fhti_s, eoti_s, ftti_s, margin_s, detect_s "
        "FROM v_faults"
    ).fetchall()
    assert shown[:3] == (campaign, found.run, "detected_late")
    assert shown[3:] == pytest.approx((0.25, 0.25, 0.5, 4.5, 3.0, 2.5, 1.25))
    [fork] = raw.execute(
        "SELECT campaign, run, fork, authority, from_tick, class, takeover_s, fork_violation_s "
        "FROM v_forks"
    ).fetchall()
    assert fork[:6] == (campaign, line.run, line.fork, "safety", 40, "needed_and_done")
    assert fork[6:] == pytest.approx((1.3, 4.0))


def test_fork_that_nobody_classified_has_no_class(
    repository: Repository, example: Any, campaign: str, raw: sqlite3.Connection
) -> None:
    example.fork(repository, campaign)
    assert raw.execute("SELECT class, takeover_s FROM v_forks").fetchall() == [(None, None)]


@pytest.mark.slow
@pytest.mark.parametrize("table", ["injection", "takeover"])
def test_findings_cannot_be_changed_and_an_altered_one_is_named(
    repository: Repository, example: Any, campaign: str, raw: sqlite3.Connection, table: str
) -> None:
    example.hindsight(repository, campaign)
    for statement in (f"UPDATE {table} SET class = 'late'", f"DELETE FROM {table}"):  # noqa: S608
        with pytest.raises(sqlite3.IntegrityError, match="insert-only"):
            raw.execute(statement)
    raw.execute(f"DROP TRIGGER {table}_no_update")
    raw.execute(f"UPDATE {table} SET violation_s = 2.0")  # noqa: S608
    raw.commit()
    named = {(item.table, item.problem) for item in repository.verify()}
    assert (table, "altered") in named


def test_exercised_are_pairs_of_measured_runs_only(
    repository: Repository, example: Any, campaign: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = example.hindsight(repository, campaign)
    with closing(raw_connection(repository)) as connection:
        rows = connection.execute(
            "SELECT run, fsr FROM v_verdicts WHERE campaign = ? AND exercised = 1", (campaign,)
        ).fetchall()
    fsrs = sorted({fsr for _, fsr in rows})
    expected = {(run, fsr) for run, fsr in rows if run == found.run}
    assert 0 < len(expected) < len(set(rows))
    assert repository.hindsight.exercised(campaign, fsrs) == expected
    assert repository.hindsight.exercised(campaign, ["FSR-99"]) == frozenset()
    assert repository.hindsight.exercised("f" * 32, fsrs) == frozenset()
    monkeypatch.setattr(hindsight, "TIMELINE_VERSION", 9)
    assert repository.hindsight.exercised(campaign, fsrs) == frozenset()


@pytest.mark.slow
def test_what_is_kept_is_found_once_and_the_same_again_changes_nothing(
    repository: Repository, example: Any
) -> None:
    campaign = example.campaign(repository, 4)
    example.hindsight(repository, campaign)
    kept = repository.hindsight.benchmarks
    (found,) = kept.comparisons(campaign)
    assert (found.model, found.edition, found.drive) == ("cc", "r157-01", found.run)
    assert found.cell in {"both_avoid", "neither", "unknown"}
    before = repository.info().rows
    kept.save((), (), None, [benchmarks.DriveRecord(found.run, "cc", "r157-01", found.run)])
    assert repository.info().rows == before
    assert repository.verify() == ()


def test_drives_of_another_version_are_not_taken(
    repository: Repository, example: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = example.campaign(repository, 4)
    example.hindsight(repository, campaign)
    monkeypatch.setattr(benchmarks, "BENCHMARK_VERSION", 9)
    assert repository.hindsight.benchmarks.comparisons(campaign) == []


def test_every_executed_run_is_a_candidate_once(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 4)
    found = repository.hindsight.benchmarks.candidates(campaign)
    assert [item.run.ordinal for item in found] == list(range(len(found)))
    assert len(found) == repository.progress(campaign).executed


def test_contacts_without_a_drive_are_open_until_they_have_one(
    mini: Executed, tmp_path: Path
) -> None:
    db = shutil.copyfile(mini.db, tmp_path / "adeye.db")
    with Repository.open(db, create=False) as repository:
        campaign, kept = mini.summary.campaign, repository.hindsight.benchmarks
        found = kept.candidates(campaign)
        contacts = sorted(item.run.result_digest for item in found if item.contact is not False)
        assert 0 < len(contacts) == kept.open_contacts(campaign)
        drives = [benchmarks.DriveRecord(run, "cc", "r157-01", run) for run in contacts]
        kept.save((), (), None, drives[:1])
        assert kept.open_contacts(campaign) == len(contacts) - 1
        kept.save((), (), None, drives)
        assert kept.open_contacts(campaign) == 0
        assert kept.open_contacts("f" * 32) == 0


def test_contact_whose_drive_is_of_another_version_is_open(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db = shutil.copyfile(mini.db, tmp_path / "adeye.db")
    with Repository.open(db, create=False) as repository:
        campaign, kept = mini.summary.campaign, repository.hindsight.benchmarks
        before = kept.open_contacts(campaign)
        runs = [item.run.result_digest for item in kept.candidates(campaign)]
        kept.save((), (), None, [benchmarks.DriveRecord(r, "cc", "r157-01", r) for r in runs])
        monkeypatch.setattr(benchmarks, "BENCHMARK_VERSION", 9)
        assert kept.open_contacts(campaign) == before > 0
