"""Forks of stored runs: the laws that make them evidence."""

from __future__ import annotations

import shutil
import sqlite3
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign.replay import recall, replay_run
from adeye.campaign.studies import forks
from adeye.campaign.studies.forks import fork_run
from adeye.errors import InputError, IntegrityError
from adeye.store.repository import Repository
from adeye.sweep.case import AuthorityOverride
from adeye.trace import LINK_TICKS

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


@pytest.fixture
def db(mini: Executed, tmp_path: Path) -> Path:
    """A copy of the mini campaign, which may be written to."""
    copy = tmp_path / "adeye.db"
    shutil.copyfile(mini.db, copy)
    return copy


def run_of(mini: Executed, architecture: str, entry: str = "nominal_silent") -> str:
    return next(
        str(row["run"])
        for row in mini.project.rows()
        if (row["architecture"], row["fault_entry"]) == (architecture, entry)
    )


def takeover_of(db: Path, run: str) -> int:
    with Repository.open(db, create=False) as repository:
        recalled = recall(repository, repository.find_run(run))
    time = next(
        event.time_s
        for event in recalled.stored.events
        if (event.kind, event.subject) == ("switch", "safety")
    )
    return round(time / recalled.case.step)


@pytest.mark.slow
def test_fork_with_the_original_decision_is_the_run_bit_for_bit(mini: Executed, db: Path) -> None:
    run = run_of(mini, "camera_radar")
    forked = fork_run(db, run, start=str(takeover_of(db, run)), authority="safety")
    assert forked.is_same
    assert forked.fork.trace_digest == forked.origin.trace_digest
    assert forked.fork.run != forked.origin.run == run


@pytest.mark.slow
def test_fork_with_the_other_decision_is_another_run(mini: Executed, db: Path) -> None:
    run = run_of(mini, "camera_radar")
    forked = fork_run(db, run, start=str(takeover_of(db, run)), authority="nominal")
    assert not forked.is_same
    assert forked.fork.verdicts.keys() == forked.origin.verdicts.keys()


@pytest.mark.slow
def test_fork_is_kept_and_replays_but_counts_in_no_campaign(mini: Executed, db: Path) -> None:
    with Repository.open(db, create=False) as repository:
        newest = repository.latest_campaign()
        assert newest is not None
        before = repository.results(newest.id), repository.gate(newest.id)
    forked = fork_run(db, run_of(mini, "camera_radar"), start="2 s", authority="safety")
    assert forked.from_tick == 40
    replayed = replay_run(db, forked.fork.run)
    assert replayed.identical
    assert replayed.trace_digest == forked.fork.trace_digest
    with Repository.open(db, create=False) as repository:
        assert repository.latest_campaign() == newest
        assert (repository.results(newest.id), repository.gate(newest.id)) == before
        assert repository.verify() == ()


@pytest.mark.slow
def test_chain_of_a_fork_begins_with_that_of_its_run(mini: Executed, db: Path) -> None:
    run = run_of(mini, "camera_radar", "none")
    forked = fork_run(db, run, start=str(2 * LINK_TICKS), authority="safety")
    with Repository.open(db, create=False) as repository:
        origin, fork = (repository.run_row(name) for name in (run, forked.fork.run))
    assert origin is not None
    assert fork is not None
    assert origin.links is not None
    assert fork.links is not None
    assert forked.links == 2
    assert fork.links[:2] == origin.links[:2]
    assert fork.links[2] != origin.links[2]


def altered(db: Path, statement: str) -> None:
    connection = sqlite3.connect(db)
    for (name,) in connection.execute(
        "SELECT name FROM sqlite_master WHERE type = 'trigger'"
    ).fetchall():
        connection.execute(f"DROP TRIGGER {name}")
    connection.execute(statement)
    connection.commit()
    connection.close()


@pytest.mark.slow
def test_recorded_chain_that_says_otherwise_is_refused(mini: Executed, db: Path) -> None:
    altered(db, "UPDATE chain SET links = replace(links, substr(links, 1, 8), '00000000')")
    with pytest.raises(IntegrityError, match="recorded digest chain") as raised:
        fork_run(db, run_of(mini, "camera_radar"), start=str(LINK_TICKS), authority="safety")
    assert raised.value.exit_code == 4


@pytest.mark.slow
def test_run_that_does_not_come_out_as_recorded_has_no_forks(mini: Executed, db: Path) -> None:
    altered(db, "UPDATE run SET trace_digest = lower(hex(zeroblob(16)))")
    with pytest.raises(IntegrityError, match=r"the first \d+ ticks are as recorded"):
        fork_run(db, run_of(mini, "camera_radar"), start="2 s", authority="safety")


@pytest.mark.slow
def test_fork_that_departs_before_its_tick_is_refused(
    mini: Executed, db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def early(case: Any, **changes: Any) -> Any:
        override = changes["override"]
        return replace(case, override=AuthorityOverride(override.from_tick - 1, override.channel))

    monkeypatch.setattr(forks, "replace", early)
    run = run_of(mini, "camera_radar", "none")
    with pytest.raises(IntegrityError, match="before tick 40"):
        fork_run(db, run, start="40", authority="safety")


@pytest.mark.slow
def test_runs_before_the_digest_chain_can_be_forked(mini: Executed, db: Path) -> None:
    altered(db, "DELETE FROM chain")
    forked = fork_run(db, run_of(mini, "camera_radar"), start="150", authority="safety")
    assert forked.links is None


@pytest.mark.parametrize(
    ("start", "authority", "message"),
    [
        ("99999", "safety", "behind the end"),
        ("4", "autopilot", "no such channel"),
        ("4.01 s", "safety", "no whole number"),
        ("-1 s", "safety", "negative"),
        ("soon", "safety", "not a quantity"),
    ],
)
def test_what_cannot_be_forked_is_an_input_error(
    mini: Executed, db: Path, start: str, authority: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        fork_run(db, run_of(mini, "camera_radar"), start=start, authority=authority)


@pytest.mark.slow
def test_fork_of_a_fork_is_an_input_error(mini: Executed, db: Path) -> None:
    forked = fork_run(db, run_of(mini, "camera_radar"), start="2 s", authority="safety")
    with pytest.raises(InputError, match="fork itself"):
        fork_run(db, forked.fork.run, start="3 s", authority="nominal")


def test_sample_is_the_same_every_time_and_part_of_a_larger_one(db: Path) -> None:
    with Repository.open(db, create=False) as repository:
        newest = repository.latest_campaign()
        assert newest is not None
        small, large, whole = (
            repository.hindsight.executed(newest.id, most) for most in (3, 7, None)
        )
        faulty = repository.hindsight.executed(newest.id, 7, only_faulty=True)
        entries = {run.result_digest: recall(repository, run).case.fault_entry for run in large}
    assert small == large[:3]
    assert large == whole[:7]
    assert len(whole) == 28
    assert [run for run in large if entries[run.result_digest] != "none"] == faulty
    assert 0 < len(faulty) < 7
