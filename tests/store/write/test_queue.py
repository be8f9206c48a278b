"""The queue as runners share it: names of test cases, what failed, what others hold."""

import json
import multiprocessing
import signal
import sqlite3
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adeye.judge.verdict import Verdict
from adeye.store.owner import Owner
from adeye.store.repository import Repository
from adeye.store.write import queue as leasing
from adeye.store.write.queue import NamedCase, WantedBlocks
from tests.store.rows import complete_block

FAR = Owner("another machine", 1, "1")


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=2)
    return str(plan.campaign)


def complete(repository: Repository, example: Any, campaign: str, blocks: int) -> None:
    for _ in range(blocks):
        block = repository.queue.claim(campaign, WantedBlocks(), 60.0)
        assert block is not None
        assert complete_block(repository, block, example.runs(block))


def test_cases_are_told_by_the_names_that_people_give(
    repository: Repository, example: Any, campaign: str
) -> None:
    complete(repository, example, campaign, 1)
    found = list(repository.queue.cases(campaign))
    assert [ordinal for ordinal, _, _ in found] == list(range(8))
    assert [has_result for *_, has_result in found] == [True] * 2 + [False] * 6
    planned = list(example.cases(8))
    for (_, named, _), case in zip(found, planned, strict=True):
        point = json.loads(named.point)
        assert named == NamedCase(
            case.scenario, case.architecture, case.fault_entry, case.replicates[0], named.point
        )
        assert point == json.loads(case.points[0])


@pytest.mark.parametrize("verdict", [Verdict.FAIL, Verdict.ERROR, Verdict.INCONCLUSIVE])
def test_failed_is_what_a_mandatory_requirement_failed_on(
    repository: Repository, example: Any, campaign: str, verdict: Verdict
) -> None:
    given = {(3, "FSR1"): verdict, (5, "FSR2"): Verdict.FAIL}
    example.verdict_of = lambda case, fsr: given.get((case.ordinal, fsr), Verdict.PASS)
    complete(repository, example, campaign, 4)
    bad = {3} if verdict in {Verdict.FAIL, Verdict.ERROR} else set()
    # FSR2 is optional.
    assert repository.queue.failed(campaign) == bad


def test_earlier_campaigns_of_the_same_odd_are_told_last_first(
    repository: Repository, example: Any, campaign: str
) -> None:
    second = repository.plan_campaign(example.record(), example.cases(6)).campaign
    third = repository.plan_campaign(example.record(), example.cases(4)).campaign
    assert repository.queue.earlier(third) == [second, campaign]
    repository.plan_campaign(example.record(), example.cases(8))
    assert repository.queue.earlier(third) == [campaign, second]


def test_what_is_left_elsewhere_is_counted_as_far_as_it_is_wanted(
    repository: Repository, example: Any, campaign: str
) -> None:
    assert repository.queue.open_elsewhere(campaign, WantedBlocks(), ()) == 8
    theirs = repository.claim_block(FAR, lease_s=1e6, campaign=campaign)
    mine = repository.queue.claim(campaign, WantedBlocks(), 60.0)
    assert theirs is not None
    assert mine is not None
    assert repository.queue.open_elsewhere(campaign, WantedBlocks(), {mine.id}) == 6
    assert repository.queue.open_elsewhere(campaign, WantedBlocks(within=(0, 4)), {mine.id}) == 2
    complete_all = WantedBlocks(aside={theirs.id, mine.id})
    while (block := repository.queue.claim(campaign, complete_all, 60.0)) is not None:
        assert complete_block(repository, block, example.runs(block))
    assert repository.queue.open_elsewhere(campaign, WantedBlocks(), {mine.id}) == 2
    assert complete_block(repository, theirs, example.runs(theirs))
    assert repository.queue.open_elsewhere(campaign, WantedBlocks(), {mine.id}) == 0


def test_quarantined_blocks_are_free_again(repository: Repository, campaign: str) -> None:
    block = repository.queue.claim(campaign, WantedBlocks(), 60.0)
    assert block is not None
    assert repository.quarantine_block(block, "broken")
    assert repository.queue.requeue_quarantined(campaign) == 1
    assert repository.work_state(campaign).pending == 4


def test_block_is_done_once(repository: Repository, example: Any, campaign: str) -> None:
    block = repository.claim_block(campaign=campaign)
    assert block is not None
    runs = example.runs(block)
    assert complete_block(repository, block, runs)
    assert not complete_block(repository, block, runs)
    assert repository.info().rows["run"] == 2
    assert repository.work_state(campaign).done == 1


def test_blocks_that_are_held_are_not_given_out(repository: Repository, campaign: str) -> None:
    held = [repository.claim_block(campaign=campaign) for _ in range(5)]
    assert held[4] is None
    ordinals = [case.ordinal for block in held[:4] if block for case in block.cases]
    assert ordinals == list(range(8))


@pytest.mark.slow
def test_lease_of_a_dead_process_is_taken_over_and_its_owner_fenced_off(
    repository: Repository, example: Any, campaign: str
) -> None:
    context = multiprocessing.get_context("fork")
    inbox: multiprocessing.Queue[Any] = context.Queue()

    def claim_and_wait() -> None:
        inbox.put(repository.claim_block(lease_s=1e6, campaign=campaign))
        signal.pause()

    process = context.Process(target=claim_and_wait)
    process.start()
    lost = inbox.get(timeout=30)
    others = [repository.claim_block(campaign=campaign) for _ in range(4)]
    assert others[3] is None
    assert repository.work_state(campaign).leased == 4
    process.kill()
    process.join()
    assert repository.work_state(campaign).leased == 3
    again = repository.claim_block(campaign=campaign)
    assert again is not None
    assert (again.id, again.attempt) == (lost.id, lost.attempt + 1)
    assert not complete_block(repository, lost, example.runs(lost))
    assert not repository.renew_lease(lost, 60.0)
    assert not repository.release_block(lost)
    assert repository.fail_block(lost, "late") is None
    assert not repository.quarantine_block(lost, "late")
    assert repository.info().rows["run"] == 0
    assert complete_block(repository, again, example.runs(again))


def test_late_owner_is_fenced_off_though_it_lives(
    repository: Repository, example: Any, campaign: str
) -> None:
    late = repository.claim_block(lease_s=-1.0, campaign=campaign)
    assert late is not None
    for _ in range(3):
        assert repository.claim_block(campaign=campaign) is not None
    again = repository.claim_block(campaign=campaign)
    assert again is not None
    assert again.id == late.id
    assert not complete_block(repository, late, example.runs(late))
    assert complete_block(repository, again, example.runs(again))


def test_late_owner_whose_block_nobody_took_still_completes(
    repository: Repository, example: Any, campaign: str
) -> None:
    late = repository.claim_block(lease_s=-1.0, campaign=campaign)
    assert late is not None
    assert complete_block(repository, late, example.runs(late))


def test_changed_time_of_day_ends_no_lease_on_this_machine(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    for _ in range(4):
        assert repository.claim_block(campaign=campaign) is not None
    raw.execute("UPDATE work SET until = '2000-01-01T00:00:00.000+00:00'")
    assert repository.claim_block(campaign=campaign) is None


def test_lease_of_another_machine_ends_by_the_time_of_day(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    for _ in range(4):
        assert repository.claim_block(FAR, campaign=campaign) is not None
    raw.execute("UPDATE work SET until_boot_s = 0")
    assert repository.claim_block(campaign=campaign) is None
    raw.execute("UPDATE work SET until = '2000-01-01T00:00:00.000+00:00' WHERE id = 3")
    found = repository.claim_block(campaign=campaign)
    assert found is not None
    assert found.id == 3


def test_renewed_lease_holds(repository: Repository, campaign: str) -> None:
    blocks = [repository.claim_block(lease_s=-1.0, campaign=campaign) for _ in range(1)]
    assert blocks[0] is not None
    assert repository.renew_lease(blocks[0], 100.0)
    for _ in range(3):
        assert repository.claim_block(campaign=campaign) is not None
    assert repository.claim_block(campaign=campaign) is None


def test_released_block_is_given_out_again(repository: Repository, campaign: str) -> None:
    first = repository.claim_block(campaign=campaign)
    assert first is not None
    assert repository.release_block(first)
    again = repository.claim_block(campaign=campaign)
    assert again is not None
    assert (again.id, again.attempt) == (first.id, 2)


def test_incomplete_block_is_refused_and_stays_leased(
    repository: Repository, example: Any, campaign: str
) -> None:
    block = repository.claim_block(campaign=campaign)
    assert block is not None
    with pytest.raises(ValueError, match="not complete"):
        complete_block(repository, block, example.runs(block)[:1])
    without = [example.run(case, verdicts=[]) for case in block.to_execute]
    with pytest.raises(ValueError, match="not complete"):
        complete_block(repository, block, without)
    assert repository.info().rows["run"] == 0
    assert repository.work_state(campaign).leased == 1
    assert complete_block(repository, block, example.runs(block))


def test_result_of_another_block_is_refused(
    repository: Repository, example: Any, campaign: str
) -> None:
    first = repository.claim_block(campaign=campaign)
    second = repository.claim_block(campaign=campaign)
    assert first is not None
    assert second is not None
    with pytest.raises(ValueError, match="not of this block"):
        complete_block(repository, first, [*example.runs(first), *example.runs(second)])
    assert repository.info().rows["run"] == 0


def test_block_that_another_campaign_filled_needs_nothing(
    repository: Repository, example: Any, campaign: str
) -> None:
    example.with_odd("2")
    example.campaign(repository, 8)
    block = repository.claim_block(campaign=campaign)
    assert block is not None
    assert block.cases == ()
    assert complete_block(repository, block, [])
    assert repository.progress(campaign).accounted == 2


@pytest.mark.slow
def test_failing_block_is_halved_down_to_the_bad_case(repository: Repository, example: Any) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=8)
    attempts = 0
    while (block := repository.claim_block(campaign=plan.campaign)) is not None:
        attempts += 1
        if any(case.ordinal == 5 for case in block.cases):
            assert repository.fail_block(block, "worker died") in {"pending", "quarantined"}
        else:
            assert complete_block(repository, block, example.runs(block))
    state = repository.work_state(plan.campaign)
    assert (state.quarantined, state.text) == (1, "quarantined")
    assert repository.progress(plan.campaign).accounted == 7
    assert attempts == leasing.MAX_FAILURES + 3 + 3
    assert repository.verify() == ()
    fsr1 = {
        item.architecture: item for item in repository.gate(plan.campaign) if item.fsr == "FSR1"
    }
    assert (str(fsr1["new"].verdict), str(fsr1["legacy"].verdict)) == ("NOT_RUN", "PASS")
    assert repository.queue.requeue_quarantined(plan.campaign) == 1
    assert example.work_off(repository, plan.campaign) == 1
    assert repository.progress(plan.campaign).accounted == 8
    assert repository.verify() == ()


def test_late_failure_of_a_block_that_failed_before_changes_nothing(
    repository: Repository, example: Any
) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(4), block_size=4)
    for _ in range(leasing.MAX_FAILURES - 1):
        block = repository.claim_block(campaign=plan.campaign)
        assert block is not None
        assert repository.fail_block(block, "worker died") == "pending"
    late = repository.claim_block(lease_s=-1.0, campaign=plan.campaign)
    assert late is not None
    again = repository.claim_block(campaign=plan.campaign)
    assert again is not None
    assert repository.fail_block(late, "worker died") is None
    assert complete_block(repository, again, example.runs(again))


def claim_all(path: Path, outbox: "multiprocessing.Queue[list[int]]") -> None:
    found: list[int] = []
    with Repository.open(path) as repository:
        while (block := repository.claim_block(lease_s=1e6)) is not None:
            found.append(block.id)
        outbox.put(found)
        # Stay alive, so that nobody takes its leases over.
        signal.sigwait({signal.SIGTERM})


@pytest.mark.slow
def test_processes_that_claim_at_once_get_different_blocks(
    repository: Repository, example: Any
) -> None:
    repository.plan_campaign(example.record(), example.cases(120), block_size=2)
    context = multiprocessing.get_context("fork")
    outbox: multiprocessing.Queue[list[int]] = context.Queue()
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    try:
        processes = [
            context.Process(target=claim_all, args=(repository.location, outbox)) for _ in range(3)
        ]
        for process in processes:
            process.start()
        claimed = [outbox.get(timeout=60) for _ in processes]
        for process in processes:
            process.terminate()
            process.join(30)
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    assert sorted(block for part in claimed for block in part) == list(range(1, 61))


@pytest.fixture
def partly(repository: Repository, example: Any) -> str:
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=4)
    return str(plan.campaign)


def mask(*ordinals: int, planned: int = 8) -> Any:
    chosen = np.zeros(planned, dtype=np.bool_)
    chosen[list(ordinals)] = True
    return chosen


def claim(repository: Repository, partly: str, wanted: WantedBlocks) -> tuple[int, ...] | None:
    block = repository.queue.claim(partly, wanted, 60.0)
    return None if block is None else tuple(case.ordinal for case in block.cases)


def test_everything_is_wanted_unless_something_is_said() -> None:
    assert WantedBlocks().is_anything
    assert not WantedBlocks(aside={3}).is_anything
    assert WantedBlocks().stretches(2, 5) == [(2, 5)]


@pytest.mark.parametrize(
    ("chosen", "stretches"),
    [
        ((), [(0, 8)]),
        (range(8), [(0, 8)]),
        ((0, 1, 5), [(0, 2), (2, 5), (5, 6), (6, 8)]),
        ((3,), [(0, 3), (3, 4), (4, 8)]),
        ((7,), [(0, 7), (7, 8)]),
    ],
)
def test_a_range_is_cut_where_wanted_and_unwanted_meet(chosen: Any, stretches: Any) -> None:
    assert WantedBlocks(mask(*chosen)).stretches(0, 8) == stretches


def test_a_block_is_wanted_if_a_case_of_it_is() -> None:
    block: Any = SimpleNamespace(id=1, from_ordinal=4, to_ordinal=8)
    assert WantedBlocks(mask(7)).wants(block)
    assert not WantedBlocks(mask(3)).wants(block)
    assert not WantedBlocks(mask(7), aside={1}).wants(block)
    assert WantedBlocks(within=(4, 8)).wants(block)
    assert not WantedBlocks(within=(5, 8)).wants(block)
    assert not WantedBlocks(within=(0, 7)).wants(block)


def test_only_what_is_wanted_is_leased_and_the_rest_waits(
    repository: Repository, partly: str
) -> None:
    wanted = WantedBlocks(mask(1, 2, 6))
    assert claim(repository, partly, wanted) == (1, 2)
    assert claim(repository, partly, wanted) == (6,)
    assert claim(repository, partly, wanted) is None
    rest = [claim(repository, partly, WantedBlocks()) for _ in range(5)]
    assert sorted(item for item in rest if item) == [(0,), (3,), (4, 5), (7,)]
    assert rest[-1] is None


@pytest.mark.slow
def test_what_is_cut_is_completed_counted_and_covers_the_plan(
    repository: Repository, example: Any, partly: str
) -> None:
    for wanted in (WantedBlocks(mask(1, 2, 6)), WantedBlocks()):
        while (block := repository.queue.claim(partly, wanted, 60.0)) is not None:
            assert complete_block(repository, block, example.runs(block))
    assert repository.verify() == ()
    assert repository.progress(partly).accounted == 8
    assert repository.work_state(partly).text == "complete"


def test_an_abandoned_block_is_cut_too(repository: Repository, partly: str) -> None:
    for _ in range(2):
        assert repository.claim_block(lease_s=-1.0, campaign=partly) is not None
    assert claim(repository, partly, WantedBlocks(mask(5))) == (5,)


def test_failures_of_a_block_stay_with_its_pieces(repository: Repository, partly: str) -> None:
    for _ in range(2):
        block = repository.queue.claim(partly, WantedBlocks(mask(0, 1, 2, 3)), 60.0)
        assert block is not None
        repository.fail_block(block, "broken")
    piece = repository.queue.claim(partly, WantedBlocks(mask(0)), 60.0)
    assert piece is not None
    # The third failure of one case sets it aside.
    assert repository.fail_block(piece, "broken") == "quarantined"
