import multiprocessing
import signal
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from adeye.store.owner import Owner
from adeye.store.repository import Repository
from adeye.store.write import queue as leasing

FAR = Owner("another machine", 1, "1")


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=2)
    return str(plan.campaign)


def test_block_is_done_once(repository: Repository, example: Any, campaign: str) -> None:
    block = repository.claim_block(campaign=campaign)
    assert block is not None
    runs = example.runs(block)
    assert repository.complete_block(block, runs)
    assert not repository.complete_block(block, runs)
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
    assert not repository.complete_block(lost, example.runs(lost))
    assert not repository.renew_lease(lost)
    assert not repository.release_block(lost)
    assert repository.fail_block(lost, "late") is None
    assert not repository.quarantine_block(lost, "late")
    assert repository.info().rows["run"] == 0
    assert repository.complete_block(again, example.runs(again))


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
    assert not repository.complete_block(late, example.runs(late))
    assert repository.complete_block(again, example.runs(again))


def test_late_owner_whose_block_nobody_took_still_completes(
    repository: Repository, example: Any, campaign: str
) -> None:
    late = repository.claim_block(lease_s=-1.0, campaign=campaign)
    assert late is not None
    assert repository.complete_block(late, example.runs(late))


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
        repository.complete_block(block, example.runs(block)[:1])
    without = [example.run(case, verdicts=[]) for case in block.to_execute]
    with pytest.raises(ValueError, match="not complete"):
        repository.complete_block(block, without)
    assert repository.info().rows["run"] == 0
    assert repository.work_state(campaign).leased == 1
    assert repository.complete_block(block, example.runs(block))


def test_result_of_another_block_is_refused(
    repository: Repository, example: Any, campaign: str
) -> None:
    first = repository.claim_block(campaign=campaign)
    second = repository.claim_block(campaign=campaign)
    assert first is not None
    assert second is not None
    with pytest.raises(ValueError, match="not of this block"):
        repository.complete_block(first, [*example.runs(first), *example.runs(second)])
    assert repository.info().rows["run"] == 0


def test_block_that_another_campaign_filled_needs_nothing(
    repository: Repository, example: Any, campaign: str
) -> None:
    example.with_odd("2")
    example.campaign(repository, 8)
    block = repository.claim_block(campaign=campaign)
    assert block is not None
    assert block.cases == ()
    assert repository.complete_block(block, [])
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
            assert repository.complete_block(block, example.runs(block))
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
    assert repository.complete_block(again, example.runs(again))


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
