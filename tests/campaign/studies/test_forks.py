"""Forks of stored runs, and the takeovers of a campaign in hindsight."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from adeye.campaign.replay import failed_beside, recall, replay_run
from adeye.campaign.studies import forks
from adeye.campaign.studies.forks import TakeoverMatrix, fork_run, look_back
from adeye.cli.app import main
from adeye.errors import InputError, IntegrityError
from adeye.judge.preventability import TAKEOVER_CLASSES
from adeye.store.repository import Repository
from adeye.sweep.case import AuthorityOverride
from adeye.trace import LINK_TICKS, ChannelEvent
from tests.project import CANDIDATE, CANDIDATE_ONLY, Executed, Project, one_scenario
from tests.sql import alter, rows
from tests.stored import known, stored

# --- forks of stored runs: the laws that make them evidence


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
    sql = "SELECT time_s FROM v_timeline WHERE run = ? AND kind = 'switch' AND subject = 'safety'"
    return round(float(rows(db, sql, run)[0][0]) / 0.05)


@pytest.mark.slow
def test_fork_with_the_decision_of_the_run_is_the_run(mini: Executed, db: Path) -> None:
    run = run_of(mini, "camera_radar")
    start = str(takeover_of(db, run))
    forked = fork_run(db, run, start=start, authority="safety")
    assert forked.is_same
    assert forked.fork.trace_digest == forked.origin.trace_digest
    assert forked.fork.run != forked.origin.run == run
    other = fork_run(db, run, start=start, authority="nominal")
    assert not other.is_same
    assert other.fork.verdicts.keys() == other.origin.verdicts.keys()


@pytest.mark.slow
def test_fork_is_kept_and_replays_but_counts_in_no_campaign(mini: Executed, db: Path) -> None:
    with Repository.open(db, create=False) as repository:
        newest = known(repository.latest_campaign())
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
        stored = [repository.run_row(name) for name in (run, forked.fork.run)]
    origin, fork = (item.links for item in stored if item is not None and item.links is not None)
    assert forked.links == 2
    assert fork[:2] == origin[:2]
    assert fork[2] != origin[2]


@pytest.mark.slow
def test_recorded_chain_that_says_otherwise_is_refused(mini: Executed, db: Path) -> None:
    alter(db, "UPDATE chain SET links = replace(links, substr(links, 1, 8), '00000000')")
    with pytest.raises(IntegrityError, match="recorded digest chain") as raised:
        fork_run(db, run_of(mini, "camera_radar"), start=str(LINK_TICKS), authority="safety")
    assert raised.value.exit_code == 4


@pytest.mark.slow
def test_run_that_does_not_come_out_as_recorded_has_no_forks(mini: Executed, db: Path) -> None:
    alter(db, "UPDATE run SET trace_digest = lower(hex(zeroblob(16)))")
    with pytest.raises(IntegrityError, match=r"the first \d+ ticks are as recorded"):
        fork_run(db, run_of(mini, "camera_radar"), start="2 s", authority="safety")


@pytest.mark.slow
def test_fork_that_departs_early_is_refused(
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
    alter(db, "DELETE FROM chain")
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
def test_what_cannot_be_forked(
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
        newest = known(repository.latest_campaign())
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


# --- takeovers of a campaign in hindsight, over the mini campaign


@pytest.fixture(scope="module")
def mini_db(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> Path:
    copy = tmp_path_factory.mktemp("takeovers") / "adeye.db"
    shutil.copyfile(mini.db, copy)
    return copy


@pytest.fixture(scope="module")
def matrix(mini_db: Path) -> TakeoverMatrix:
    return look_back(mini_db)


def test_what_was_found_is_kept(
    mini_db: Path, matrix: TakeoverMatrix, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(forks, "make_forks", Mock(side_effect=AssertionError))
    assert look_back(mini_db) == matrix
    with Repository.open(mini_db, create=False) as repository:
        assert repository.verify() == ()


def test_matrix_of_altered_takeovers_is_refused(
    mini_db: Path, matrix: TakeoverMatrix, tmp_path: Path
) -> None:
    assert matrix.looked_at
    shutil.copyfile(mini_db, tmp_path / "altered.db")
    alter(tmp_path / "altered.db", "UPDATE takeover SET class = 'not_needed'")
    with pytest.raises(IntegrityError, match=r"takeover .*: altered"):
        look_back(tmp_path / "altered.db")


def test_every_run_has_one_class(matrix: TakeoverMatrix) -> None:
    assert matrix.looked_at == matrix.executed == sum(matrix.counts.values()) == 28
    assert tuple(matrix.counts) == TAKEOVER_CLASSES
    assert len({line.run for line in matrix.lines}) == 28


def test_missed_are_contacts_without_a_takeover(matrix: TakeoverMatrix, mini: Executed) -> None:
    touched = {
        row["run"]
        for row in mini.project.rows()
        if row["end_reason"] == "contact" and row["architecture"] == "legacy_camera"
    }
    # The switch of the legacy architecture is stuck: nobody ever takes over there.
    missed = {line.run for line in matrix.lines if line.class_ == "missed"}
    assert touched
    assert missed == touched


def test_needed_takeovers_are_those_whose_fork_violates(matrix: TakeoverMatrix) -> None:
    needed = [line for line in matrix.lines if line.class_ == "needed_and_done"]
    assert needed
    for line in needed:
        assert line.takeover_s is not None
        assert line.violation_s is None
        assert line.fork_violation_s is not None
        assert line.fork_violation_s > line.takeover_s


@pytest.mark.slow
def test_sample_is_a_part(mini: Executed, tmp_path: Path, matrix: TakeoverMatrix) -> None:
    shutil.copyfile(mini.db, tmp_path / "adeye.db")
    part = look_back(tmp_path / "adeye.db", most=4)
    assert part.looked_at == 4
    assert set(part.lines) <= set(matrix.lines)


def test_precision_and_recall_are_those_of_the_lines(matrix: TakeoverMatrix) -> None:
    took = [line for line in matrix.lines if line.takeover_s is not None]
    needed = [line for line in took if line.class_ in {"needed_and_done", "late"}]
    assert matrix.precision == (len(needed), len(took))
    assert matrix.recall[0] == matrix.counts["needed_and_done"]
    assert matrix.recall[1] == len(needed) + matrix.avoidable


# --- a channel that fails where it goes on, and not in the run


def test_channel_that_fails_in_a_fork_or_twin_alone_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = one_scenario("cut_in", "nominal_silent", gap=["60 m"], relative_speed=["-10 km/h"])
    project = Project(tmp_path, {**odd, "architectures": CANDIDATE_ONLY})
    (tmp_path / "odd/architectures/late.py").write_text(stored("plugins")["late"], "utf-8")
    with project.edited(CANDIDATE) as candidate:
        channel = {"kind": "./late.py:Late", "links": ["localisation"]}
        candidate["channels"]["nominal"] = channel
    project.run()
    failed = {row["fault_entry"]: row["outcome"] for row in project.rows()}
    assert failed == {"none": "channel_error", "nominal_silent": "completed"}
    told = "channel_error of channel nominal of camera_radar in"
    fork, twin = (f"{told} {where} of 1 run, and not" for where in ("the fork", "a twin"))
    run = next(row["run"] for row in project.rows() if row["fault_entry"] != "none")
    for _ in range(2):
        for verb, given, said in (
            ("forks", ["--json"], fork),
            ("faults", [], twin),
            ("timeline", [run, "--json"], twin),
            ("fork", [run, "--from", "2 s", "--authority", "nominal"], fork),
        ):
            capsys.readouterr()
            assert main([verb, *given, "--db", str(project.db), "--quiet"]) == 0
            out, err = capsys.readouterr()
            assert f"note: {said}" in err
            assert "--json" not in given or told[:31] in str(json.loads(out)["failed"])
        kept = "SELECT fault_entry FROM v_forks WHERE class IS NOT NULL"
        assert rows(project.db, kept) == [("none",)]
        assert rows(project.db, "SELECT COUNT(*) FROM v_faults") == [(0,)]


def test_what_failed_in_the_run_itself_is_not_told_of_its_fork() -> None:
    run = Mock(architecture="radar")
    safety = ChannelEvent("channel_timeout", "safety", 2.0, "late")
    nominal = ChannelEvent("channel_error", "nominal", 1.0, "dead")
    both = replace(nominal, later=(safety,))
    told = "channel_timeout of channel safety of radar"
    assert failed_beside(run, nominal, None, both) == told
    assert failed_beside(run, both, nominal, both) == ""
    assert failed_beside(run, None, both, safety) == f"channel_error of channel nominal and {told}"
    assert failed_beside(run, None, None) == ""
