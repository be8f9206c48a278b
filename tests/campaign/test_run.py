"""Campaigns and their blocks: what is executed, what is left alone, what ends it, what survives."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import adeye
from adeye.campaign import run as runner
from adeye.campaign import work
from adeye.campaign.work import BatchResult, BatchTask, execute
from adeye.cli.run import executed_text
from adeye.errors import IntegrityError, PlatformError, SpecError, Terminated
from adeye.judge.verdict import ExitCode, Verdict
from adeye.store.owner import Owner
from adeye.store.records import Block, Plan
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
    table_hash,
)
from tests.refusals import refused
from tests.stored import known, stored

# --- campaigns: what is executed, what is only judged, what is left alone, and what survives


PLUGIN: str = stored("plugins")["held"]
BROKEN: str = stored("plugins")["broken"]

SMALL = one_scenario(gap=["30 m", "50 m"])
"""Two situations, two architectures: four test cases."""


@pytest.fixture
def small(make_project: MakeProject) -> Project:
    return make_project(SMALL)


def identities(project: Project) -> dict[str, str]:
    """Test case and trace digest by run of the newest campaign."""
    return {row["run"]: row["trace_digest"] for row in project.rows()}


def test_every_case_is_executed_judged_and_accounted_for(mini: Executed) -> None:
    summary = mini.summary
    assert (summary.planned, summary.executed, summary.reused) == (28, 28, 0)
    with Repository.open(mini.db, create=False) as repository:
        progress = repository.progress(summary.campaign)
        assert (progress.planned, progress.accounted) == (28, 28)
        assert repository.verify() == ()
        assert repository.find_campaign(summary.campaign).state == "complete"


def test_candidate_passes_and_legacy_fails(mini: Executed) -> None:
    verdicts = {(line.architecture, line.fsr): line for line in mini.summary.verdicts}
    mandatory = [line for line in mini.summary.verdicts if line.is_gate and line.mandatory]
    assert {line.verdict for line in mandatory} == {Verdict.PASS}
    assert mini.summary.exit_code is ExitCode.OK
    failed = verdicts["legacy_camera", "FSR-01"]
    assert failed.verdict is Verdict.FAIL
    assert not failed.is_gate
    assert failed.worst_run in {row["run"] for row in mini.project.rows()}


@pytest.mark.slow
def test_second_run_executes_nothing(mini: Executed) -> None:
    project = mini.project
    before = count_rows(mini.db, "run"), table_hash(mini.db)
    again = runner.run_campaign(project.plan(), db=mini.db, workers=2)
    assert (again.executed, again.judged, again.reused) == (0, 0, 28)
    assert (again.campaign, again.exit_code) == (mini.summary.campaign, mini.summary.exit_code)
    assert again.verdicts == mini.summary.verdicts
    assert (count_rows(mini.db, "run"), table_hash(mini.db)) == before


@pytest.mark.slow
def test_new_threshold_judges_again_and_executes_nothing(small: Project) -> None:
    first = small.run()
    runs, before, rows = count_rows(small.db, "run"), identities(small), small.rows()
    with small.edited(CONCEPT) as concept:
        requirement = next(item for item in concept["requirements"] if item["id"] == "FSR-06")
        requirement["formula"] = "always(abs(ego.lane_offset) <= 0.0001 m)"
    second = small.run()
    assert second.campaign != first.campaign
    assert (second.executed, second.judged, second.reused) == (0, 4, 4)
    assert count_rows(small.db, "run") == runs
    assert identities(small) == before
    verdict = {(line.architecture, line.fsr): line.verdict for line in second.verdicts}
    assert verdict["camera_radar", "FSR-06"] is Verdict.FAIL
    assert second.exit_code is ExitCode.FAILED
    # The campaign before is as it was.
    assert small.rows(first.campaign) == rows


STEADY = "odd/architectures/steady.py"


def with_plugin(project: Project, acceleration: float = 0.0) -> None:
    """Give the ODD an architecture whose nominal channel comes from a file beside it."""
    text = PLUGIN.replace("{acceleration}", str(acceleration))
    (project.folder / STEADY).write_text(text, "utf-8")
    own = project.read(CANDIDATE)
    own["architecture"] = "own"
    own["channels"]["nominal"].update(kind="./steady.py:Steady")
    project.write("odd/architectures/own.yaml", own)
    with project.edited_odd() as odd:
        odd["architectures"] = [*MINI["architectures"], "architectures/own.yaml"]


@pytest.mark.slow
def test_texts_and_another_architecture_leave_results(small: Project) -> None:
    small.run()
    before = identities(small)
    with small.edited(CANDIDATE) as candidate:
        candidate.update(title="Renamed", cost=1)
        candidate["sensors"]["front_radar"]["cost"] = 1
    with small.edited("scenarios_db/motorway/cut_in.yaml") as scenario:
        scenario["title"] = "Renamed"
    assert small.run().executed == 0
    with_plugin(small)
    summary = small.run()
    assert (summary.executed, summary.reused) == (2, 4)
    after = identities(small)
    assert {run: after[run] for run in before} == before


@pytest.mark.slow
def test_changed_line_of_a_plugin_executes_its_runs_again(small: Project) -> None:
    with_plugin(small)
    first = small.run()
    before = {row["ordinal"]: row for row in small.rows()}
    with_plugin(small, acceleration=-1.0)
    summary = small.run()
    assert (summary.executed, summary.reused) == (2, 4)
    for row in small.rows():
        old = before[row["ordinal"]]
        assert (row["run"] == old["run"]) is (row["architecture"] != "own")
        assert row["test_case"] == old["test_case"]
        assert (row["trace_digest"] == old["trace_digest"]) is (row["architecture"] != "own")
    with_plugin(small)
    third = small.run()
    assert (third.campaign, third.executed, third.reused) == (first.campaign, 0, 6)


@pytest.mark.slow
def test_progress_rises_to_the_total(small: Project) -> None:
    seen: list[runner.Progress] = []
    adeye.run(small.odd, db=small.db, progress=seen.append)
    assert [item.phase for item in seen][-1] == "done"
    done = [item.done for item in seen]
    assert done == sorted(done)
    assert (seen[0].done, seen[-1].done, seen[-1].total) == (0, 4, 4)
    failed = [row for row in small.rows() if "FAIL" in row["verdicts"].values()]
    assert seen[-1].failures == len(failed)


def test_nothing_fails_where_nothing_is_left(mini: Executed, tmp_path: Path) -> None:
    db = tmp_path / "adeye.db"
    shutil.copy(mini.db, db)
    seen: list[runner.Progress] = []
    runner.run_campaign(mini.plan, db=db, progress=seen.append)
    assert {(item.done, item.total, item.failures) for item in seen} == {(0, 0, 0)}


# --- what goes wrong ------------------------------------------------------------------------------


@pytest.mark.slow
def test_interrupted_campaign_goes_on_where_it_ended(small: Project) -> None:
    def stop(state: runner.Progress) -> None:
        if state.done:
            raise KeyboardInterrupt

    refused(KeyboardInterrupt, adeye.run, small.odd, db=small.db, progress=stop)
    done = count_rows(small.db, "run")
    assert 0 < done < 4
    with Repository.open(small.db, create=False) as repository:
        campaign = known(repository.latest_campaign())
        assert campaign.state == "interrupted"
    summary = small.run()
    assert (summary.executed, summary.reused) == (4 - done, done)
    uninterrupted = small.run(db="other.db")
    assert uninterrupted.verdicts == summary.verdicts
    assert table_hash(small.db) == table_hash(small.folder / "other.db")


def failing(real: Callable[[BatchTask], Any], name: str) -> Callable[[BatchTask], Any]:
    """Fail like a defect of adeye wherever an architecture is executed."""

    def execute(task: BatchTask) -> Any:
        if any(case.architecture.architecture == name for case in task.execute):
            raise FloatingPointError(name)
        return real(task)

    return execute


@pytest.mark.slow
def test_defect_in_one_block(small: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(work, "_execute", failing(work._execute, "camera_radar"))
        summary = small.run()
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert "2 of 4 test cases accounted for" in summary.message
    assert {row["architecture"] for row in small.rows()} == {"legacy_camera"}
    missing = [line for line in summary.verdicts if line.architecture == "camera_radar"]
    assert {line.verdict for line in missing if line.mandatory} == {Verdict.NOT_RUN}
    assert summary.executed == 2
    # Without the defect, the next run tries what was set aside.
    assert (small.run().executed, small.run().executed) == (2, 0)


@pytest.mark.slow
def test_what_another_runner_executed_meanwhile_is_not_counted_as_executed_here(
    small: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "block_size", lambda _: 1)
    other: list[Any] = []

    def meanwhile(state: Any) -> None:
        if state.phase == "run" and state.done == 1 and not other:
            other.append(None)
            # It takes what is left and has gone before this one looks for more.
            other[0] = adeye.run(small.odd, db=small.db)

    summary = adeye.run(small.odd, db=small.db, progress=meanwhile)
    executed = other[0].executed
    assert executed > 0
    assert (summary.executed, summary.elsewhere) == (4 - executed, executed)
    assert f"; {executed} by other runners; 0 reused." in executed_text(summary)


@pytest.mark.slow
def test_worker_that_dies_costs_nothing_but_its_batch(small: Project) -> None:
    with_plugin(small)
    path = small.folder / STEADY
    mark = path.with_name("died")
    # Its first batch takes the whole worker down, as a crash in native code would.
    dying = f"import os\nfrom pathlib import Path\nMARK = Path({str(mark)!r})\n"
    body = "        if not MARK.exists():\n            MARK.touch()\n            os._exit(9)\n"
    text = path.read_text("utf-8").replace("        return", f"{body}        return")
    path.write_text(dying + text, "utf-8")
    summary = small.run(workers=2)
    assert mark.exists()
    assert (summary.executed, summary.planned) == (6, 6)
    with Repository.open(small.db, create=False) as repository:
        assert repository.progress(summary.campaign).accounted == 6


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_plugin_that_is_changed_meanwhile_ends_the_campaign_and_spoils_no_result(
    small: Project, workers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_plugin(small)
    path = small.folder / STEADY
    original = path.read_text("utf-8")
    monkeypatch.setattr(runner, "block_size", lambda _: 1)

    def edit(state: runner.Progress) -> None:
        if state.phase == "run" and state.done == 1:
            path.write_text(original.replace("0.0, 0.0", "-1.0, 0.0"), "utf-8")

    with pytest.raises(
        IntegrityError, match=r"\./steady\.py:Steady, which architecture own"
    ) as told:
        adeye.run(small.odd, db=small.db, progress=edit, workers=workers)
    assert told.value.exit_code == ExitCode.INTEGRITY
    assert str(path) in str(told.value)
    assert count_rows(small.db, "run") == 1
    path.write_text(original, "utf-8")
    # This process may hold what was in the file meanwhile, and is refused from now on.
    refused(SpecError, small.run, says="Start again in a new process")
    for db in (small.db, small.folder / "other.db"):
        command = [sys.executable, "-m", "adeye", "run", str(small.odd), "--db", str(db), "-q"]
        subprocess.run(command, cwd=small.folder, check=False, stdout=subprocess.DEVNULL)
    assert count_rows(small.db, "run") == 6
    assert table_hash(small.db) == table_hash(small.folder / "other.db")


@pytest.mark.slow
def test_run_that_comes_out_otherwise(small: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    small.run()
    with small.edited(CONCEPT) as concept:
        concept["requirements"][0]["formula"] = "always(not contact and ego.speed >= 0 m/s)"

    def otherwise(task: BatchTask) -> BatchResult:
        result = work.execute(task)
        assert result.judged is not None
        traces = ("0" * 32,) * len(result.judged.trace_digests)
        return replace(result, judged=replace(result.judged, trace_digests=traces))

    monkeypatch.setattr(runner, "execute", otherwise)
    refused(IntegrityError, small.run, says="does not come out as it was recorded")


@pytest.mark.slow
@pytest.mark.parametrize("others", [[], MINI["architectures"]], ids=["alone", "beside_others"])
def test_plugin_that_has_gone_ends_the_campaign(others: list[str], small: Project) -> None:
    with_plugin(small)
    with small.edited_odd() as odd:
        odd["architectures"] = [*others, "architectures/own.yaml"]
        odd["gate"] = {"architectures": ["own"]}
    plan = small.plan()
    # The file is gone between planning and running.
    (small.folder / STEADY).unlink()
    with pytest.raises(IntegrityError, match=r"steady\.py.* was changed after .* was planned"):
        runner.run_campaign(plan, db=small.db)


@pytest.mark.slow
def test_defect_of_ours_is_told(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "run_batch", Mock(side_effect=KeyError("no such column")))
    summary = make_project().run()
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert summary.executed == 0
    assert "blocks were given up: KeyError: 'no such column'" in summary.message


@pytest.mark.slow
def test_mastered_failure_of_a_channel_is_mentioned(small: Project) -> None:
    (small.folder / "odd/architectures/broken.py").write_text(BROKEN, "utf-8")
    with small.edited(CANDIDATE) as candidate:
        nominal = candidate["channels"]["nominal"]
        candidate["channels"]["nominal"] = {"kind": "./broken.py:Broken", "links": nominal["links"]}
    summary = small.run()
    told = "channel_error of channel nominal in 2 runs of camera_radar (RuntimeError: dead (broken"
    assert told in summary.message
    # The shipped concept has an FSR about it.
    assert "refused" not in summary.message
    with small.edited(CONCEPT) as concept:
        concept["requirements"] = [
            item for item in concept["requirements"] if "silent" not in item.get("formula", "")
        ]
    without = small.run()
    assert without.executed == 0
    assert without.exit_code is ExitCode.INCOMPLETE
    assert {item.verdict for item in without.verdicts if item.is_gate} == {Verdict.PASS}
    assert f"{told}.py:7)), refused: in 2 runs" in without.message
    (failure,) = (item for item in without.channel_failures if item.refused)
    assert (failure.channel, failure.runs, failure.refused) == ("nominal", 2, 2)
    with small.edited_odd() as odd:
        odd["gate"]["channel_failures"] = "allow"
    assert small.run().exit_code is ExitCode.OK


# --- blocks on their way: pieces together, failures apart, limits before they begin


GAPS = one_scenario(gap=["30 m", "35 m", "40 m", "45 m", "50 m", "55 m"])
GAPS["architectures"] = CANDIDATE_ONLY
"""Six test cases of one structure, so of one block."""


@pytest.fixture
def project(make_project: MakeProject) -> Project:
    return make_project(GAPS)


Make = Callable[..., runner.Tasks]


@pytest.fixture
def repository(project: Project) -> Iterator[Repository]:
    with Repository.open(project.db) as opened:
        yield opened


@pytest.fixture
def make(project: Project, repository: Repository) -> Make:
    plan = project.plan()

    def tasks(*ordinals: int, session: runner.Session | None = None) -> runner.Tasks:
        stored: Plan = repository.plan_campaign(plan.record(), plan.planned(), block_size=6)
        made = runner.Tasks(repository, plan, stored, (True, True), session or runner.Session())
        chosen = np.zeros(6, dtype=np.bool_)
        chosen[list(ordinals)] = True
        made.choose(chosen if ordinals else None, stored, 6)
        return made

    return tasks


@pytest.mark.slow
def test_pieces_are_executed_together(make: Make, project: Project, repository: Repository) -> None:
    tasks = make(0, 2, 5)
    (task,) = list(tasks)
    assert len(task.execute) == 3
    assert len(tasks.held()) == 3
    assert tasks.complete(task, execute(task)) == 3
    assert (tasks.executed, tasks.held()) == (3, [])
    assert repository.find_campaign().work.done == 3
    # The rest is in pieces too, and comes as one task, if all of it is chosen.
    rest = make(*range(6))
    (other,) = list(rest)
    assert len(other.execute) == 3
    rest.complete(other, execute(other))
    assert repository.verify() == ()
    project.run(db="whole.db")
    assert table_hash(project.db) == table_hash(project.folder / "whole.db")


def test_pieces_that_failed_are_tried_one_by_one(make: Make, repository: Repository) -> None:
    tasks = make(0, 2, 5)
    tasks.fail(next(tasks), "broken")
    assert tasks.held() == []
    assert [len(task.execute) for task in tasks] == [1, 1, 1]
    assert repository.find_campaign().work.leased == 3
    # What was not completed is given back.
    tasks.release()
    assert tasks.failures == ["broken"]
    assert repository.find_campaign().work.leased == 0


@pytest.mark.slow
def test_worker_that_dies_after_its_task_was_completed_takes_nothing_back(
    make: Make, repository: Repository
) -> None:
    tasks = make(0, 2, 5)
    task = next(tasks)
    assert tasks.complete(task, execute(task)) == 3
    tasks.fail(task, "its worker died")
    assert (tasks.failures, tasks.held(), tasks.executed) == (["its worker died"], [], 3)
    work = repository.find_campaign().work
    assert (work.done, work.leased, work.quarantined) == (3, 0, 0)
    assert list(tasks) == []


@pytest.mark.slow
def test_piece_that_was_taken_over_does_not_count(make: Make, repository: Repository) -> None:
    tasks = make(0, 2, 5)
    task = next(tasks)
    lost = tasks.held()[1]
    assert repository.release_block(lost)
    other = Owner("another machine", 1, "1")
    assert repository.claim_block(other, 1e6, campaign=lost.campaign) is not None
    assert tasks.complete(task, execute(task)) == 2
    assert (tasks.executed, tasks.dropped) == (2, 1)
    assert "1 block had been taken over" in tasks.notes(0)[-1]


def test_nothing_is_held_without_time_or_at_the_end(make: Make, repository: Repository) -> None:
    late, ended = runner.Session(limits=runner.Limits(budget_s=100.0)), runner.Session()
    late.limits.measure(1, 99.0)
    ended.stop.asked = KeyboardInterrupt
    for session in (late, ended):
        tasks = make(session=session)
        assert list(tasks) == []
        assert repository.find_campaign().work.leased == 0
        if session is late:
            (note,) = tasks.notes(6)
            assert "6 test cases remain, the same command goes on" in note


def test_others_are_met_where_they_hold_something(make: Make, repository: Repository) -> None:
    tasks = make()
    task = next(tasks)
    assert (tasks.open_elsewhere(), tasks.met_others) == (0, False)
    tasks.release()
    assert repository.claim_block(Owner("another machine", 1, "1"), 1e6) is not None
    assert len(task.execute) == 6
    assert (tasks.open_elsewhere(), tasks.met_others) == (6, True)


# --- blocks: small plans in small ones, large plans in large ones, as far as memory goes


def test_size_follows_the_plan_and_the_memory() -> None:
    for planned, most, size in (
        (28, 2_000, 16),
        (1_000, 2_000, 62),
        (65_536, 2_000, 1_024),
        (1_000_000, 640, 640),
        (5, 0, 1),
    ):
        assert runner._block_size(planned, most) == size


def test_fewer_fit_into_less_memory(mini: Executed, monkeypatch: pytest.MonkeyPatch) -> None:
    examples = mini.plan.examples()
    before = runner.fitting(examples)
    monkeypatch.setattr(runner, "TRACE_MEMORY", runner.TRACE_MEMORY // 4)
    assert runner.fitting(examples) == pytest.approx(before / 4, abs=1)
    assert runner.block_size(mini.plan) <= max(1, before)


# --- leases are renewed as long as the block inside runs, and no longer


@pytest.mark.parametrize("error", [None, PlatformError("database is locked")])
def test_every_block_that_is_held_is_renewed_until_the_end(error: Exception | None) -> None:
    """What cannot be renewed now is tried again."""
    renewed: list[tuple[int, float]] = []
    is_enough = threading.Event()

    def renew_lease(block: Block, lease_s: float) -> bool:
        renewed.append((block.id, lease_s))
        if len(renewed) >= 6:
            is_enough.set()
        if error is not None:
            raise error
        return True

    blocks = [Block(number, "c", 1, ()) for number in (3, 4)]
    leases: Any = SimpleNamespace(renew_lease=renew_lease)
    with runner.renewing(leases, lambda: blocks, 0.04):
        assert is_enough.wait(timeout=30.0)
    assert error or renewed[:4] == [(3, 0.04), (4, 0.04)] * 2
    assert "heartbeat" not in {thread.name for thread in threading.enumerate()}


def test_lease_is_renewed_four_times_in_its_time_and_not_after_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    waited: list[float] = []
    renewed: list[int] = []
    over: Any = SimpleNamespace(wait=waited.append, is_set=lambda: bool(renewed))
    leases: Any = SimpleNamespace(renew_lease=lambda block, _: renewed.append(block.id))
    monkeypatch.setattr(runner, "meanwhile", lambda beat, _: nullcontext(beat(over)))
    blocks = [Block(number, "c", 1, ()) for number in (3, 4)]
    with runner.renewing(leases, lambda: blocks, 40.0):
        assert (waited, renewed) == ([10.0], [3])


# --- what a session is without options, and when it has ended


def test_a_session_without_options_ends_when_it_is_asked_to() -> None:
    session, other = runner.Session(), runner.Session()
    assert session.choice.is_everything
    assert session.deadline_s == runner.DEADLINE_S == 3_600.0
    session.limits.reached = "enough"
    # Two share nothing.
    assert (session.has_ended, other.has_ended) == (True, False)
    other.stop.asked = KeyboardInterrupt
    assert other.has_ended


# --- what ends a campaign early, and how


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A clock that goes when it is told."""
    made = SimpleNamespace(now=100.0)
    monkeypatch.setattr("adeye.campaign.run.time.monotonic", lambda: made.now)
    return made


def test_who_asks_is_heard_at_the_end_of_a_block_and_hides_no_error() -> None:
    with pytest.raises(Terminated):
        runner.Stop().ask(Terminated)
    stop, done = runner.Stop(), []

    def execute(error: type[Exception] | None) -> None:
        with stop.deferred():
            assert stop.is_deferred
            stop.ask(KeyboardInterrupt)
            done.append("the block")
            if error is not None:
                raise error

    refused(KeyboardInterrupt, execute, None)
    assert done == ["the block"]
    assert not stop.is_deferred
    refused(ZeroDivisionError, execute, ZeroDivisionError)


def test_block_that_would_not_end_in_time_is_not_begun(clock: SimpleNamespace) -> None:
    limits, little, none = runner.Limits(100.0), runner.Limits(5.0), runner.Limits()
    assert limits.allow(10**6)  # nothing is known yet
    clock.now += 40.0
    for each in (limits, none):
        each.measure(10, 20.0)
        assert each.allow(29)
    assert not limits.allow(30)
    assert "no block would end" in limits.reached
    # It has ended: a smaller one does not begin either.
    assert not limits.allow(1)
    # Time that is over ends it, though nothing is known of blocks; without limits all begin.
    assert not little.allow(0)
    assert "is over" in little.reached
    none.count(10**6)
    assert none.allow(10**9)
    assert (none.left_s, none.reached) == (math.inf, "")


def test_slowest_of_the_last_blocks_counts(clock: SimpleNamespace) -> None:
    limits = runner.Limits(budget_s=100.0)
    assert clock.now == 100.0
    limits.measure(1, 90.0)  # it compiled
    assert limits.allow(1)
    for _ in range(8):
        limits.measure(10, 10.0)
    limits.measure(0, 1e9)  # it had nothing to do
    assert limits.allow(99)


def test_enough_failures_end_it() -> None:
    for failures, is_over in ((0, False), (2, False), (3, True), (4, True)):
        limits = runner.Limits(most_failures=3)
        limits.count(failures)
        assert limits.allow(1) is not is_over
        assert (f"{failures} runs with a FAIL" in limits.reached) is is_over
