"""What twins and forks told is kept, found again, shown by SQL, and counted by no campaign."""

import sqlite3
from contextlib import closing
from dataclasses import replace
from typing import Any

import pytest

from adeye.errors import IntegrityError
from adeye.judge.timeline import Timeline
from adeye.store.repository import Repository
from adeye.store.write import studies as hindsight
from tests.store.raw import raw_connection


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    return str(example.campaign(repository, 8))


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
    before = (repository.result_table_hash(campaign), repository.gate(campaign))
    example.hindsight(repository, campaign)
    assert (repository.result_table_hash(campaign), repository.gate(campaign)) == before


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
