"""The queue as runners share it: names of test cases, what failed, what others hold."""

import json
import multiprocessing
import signal
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adeye.judge.verdict import Verdict
from adeye.store.owner import Owner
from adeye.store.records import Block
from adeye.store.repository import Repository
from adeye.store.write import queue as leasing
from adeye.store.write.queue import NamedCase, WantedBlocks
from tests.store.conftest import Store
from tests.stored import known

FAR = Owner("another machine", 1, "1")


ANYTHING = WantedBlocks()


@pytest.fixture
def campaign(store: Store) -> str:
    return store.plan(8, block_size=2).campaign


def claimed(store: Store, campaign: str, blocks: WantedBlocks = ANYTHING) -> Block:
    """Claim a block of those that are wanted where there is one."""
    return known(store.repository.claim_block(campaign=campaign, wanted=blocks))


def complete(store: Store, campaign: str, blocks: int) -> None:
    for _ in range(blocks):
        assert store.complete(claimed(store, campaign))


def hold(store: Store, campaign: str, blocks: int, **options: Any) -> list[Block]:
    """Claim blocks and do nothing with them."""
    return [store.claim(campaign, **options) for _ in range(blocks)]


def test_cases_are_told_by_the_names_that_people_give(store: Store, campaign: str) -> None:
    complete(store, campaign, 1)
    found = list(store.repository.queue.cases(campaign))
    assert [ordinal for ordinal, _, _ in found] == list(range(8))
    assert [has_result for *_, has_result in found] == [True] * 2 + [False] * 6
    planned = list(store.example.cases(8))
    for (_, named, _), case in zip(found, planned, strict=True):
        point = json.loads(named.point)
        assert named == NamedCase(
            case.scenario, case.architecture, case.fault_entry, case.replicates[0], named.point
        )
        assert point == json.loads(case.points[0])


@pytest.mark.parametrize("verdict", [Verdict.FAIL, Verdict.ERROR, Verdict.INCONCLUSIVE])
def test_failed_is_what_is_mandatory(store: Store, campaign: str, verdict: Verdict) -> None:
    given = {(3, "FSR1"): verdict, (5, "FSR2"): Verdict.FAIL}
    store.example.verdict_of = lambda case, fsr: given.get((case.ordinal, fsr), Verdict.PASS)
    complete(store, campaign, 4)
    bad = {3} if verdict in {Verdict.FAIL, Verdict.ERROR} else set()
    # FSR2 is optional.
    assert store.repository.queue.failed(campaign) == bad


def test_earlier_campaigns_of_the_same_odd_are_told_last_first(store: Store, campaign: str) -> None:
    second = store.plan(6).campaign
    third = store.plan(4).campaign
    assert store.repository.queue.earlier(third) == [second, campaign]
    store.plan(8)
    assert store.repository.queue.earlier(third) == [campaign, second]


def test_what_is_left_elsewhere_is_counted(store: Store, campaign: str) -> None:
    left = partial(store.repository.queue.open_elsewhere, campaign)
    assert left(ANYTHING, ()) == 8
    theirs = store.claim(campaign, owner=FAR, lease_s=1e6)
    mine = claimed(store, campaign)
    assert left(ANYTHING, {mine.id}) == 6
    assert left(WantedBlocks(within=(0, 4)), {mine.id}) == 2
    others = WantedBlocks(aside={theirs.id, mine.id})
    while (block := store.repository.claim_block(campaign=campaign, wanted=others)) is not None:
        assert store.complete(block)
    assert left(ANYTHING, {mine.id}) == 2
    assert store.complete(theirs)
    assert left(ANYTHING, {mine.id}) == 0


def test_quarantined_blocks_are_free_again(store: Store, campaign: str) -> None:
    assert store.repository.quarantine_block(claimed(store, campaign), "broken")
    assert store.repository.queue.requeue_quarantined(campaign) == 1
    assert store.repository.work_state(campaign).pending == 4


def test_block_is_done_once(store: Store, campaign: str) -> None:
    block = store.claim(campaign)
    runs = store.example.runs(block)
    assert store.complete(block, runs)
    assert not store.complete(block, runs)
    assert store.repository.info().rows["run"] == 2
    assert store.repository.work_state(campaign).done == 1


def test_blocks_that_are_held_are_not_given_out(store: Store, campaign: str) -> None:
    held = hold(store, campaign, 4)
    assert store.repository.claim_block(campaign=campaign) is None
    assert [case.ordinal for block in held for case in block.cases] == list(range(8))


def test_lease_of_a_dead_process_is_taken_over(store: Store, campaign: str) -> None:
    context = multiprocessing.get_context("fork")
    inbox: multiprocessing.Queue[Any] = context.Queue()

    def claim_and_wait() -> None:
        inbox.put(store.repository.claim_block(lease_s=1e6, campaign=campaign))
        signal.pause()

    process = context.Process(target=claim_and_wait)
    process.start()
    lost = inbox.get(timeout=30)
    others = [store.repository.claim_block(campaign=campaign) for _ in range(4)]
    assert others[3] is None
    assert store.repository.work_state(campaign).leased == 4
    process.kill()
    process.join()
    assert store.repository.work_state(campaign).leased == 3
    again = store.claim(campaign)
    assert (again.id, again.attempt) == (lost.id, lost.attempt + 1)
    assert not store.complete(lost)
    assert not store.repository.renew_lease(lost, 60.0)
    assert not store.repository.release_block(lost)
    assert store.repository.fail_block(lost, "late") is None
    assert not store.repository.quarantine_block(lost, "late")
    assert store.repository.info().rows["run"] == 0
    assert store.complete(again)


def test_late_owner_whose_block_was_taken_is_fenced_off(store: Store, campaign: str) -> None:
    assert store.complete(store.claim(campaign, lease_s=-1.0))
    late = store.claim(campaign, lease_s=-1.0)
    hold(store, campaign, 2)
    again = store.claim(campaign)
    assert again.id == late.id
    assert not store.complete(late)
    assert store.complete(again)


def test_changed_time_of_day_ends_no_lease_on_this_machine(store: Store, campaign: str) -> None:
    hold(store, campaign, 4)
    store.raw.execute("UPDATE work SET until = '2000-01-01T00:00:00.000+00:00'")
    assert store.repository.claim_block(campaign=campaign) is None


def test_lease_of_another_machine_ends_by_the_time_of_day(store: Store, campaign: str) -> None:
    hold(store, campaign, 4, owner=FAR)
    store.raw.execute("UPDATE work SET until_boot_s = 0")
    assert store.repository.claim_block(campaign=campaign) is None
    store.raw.execute("UPDATE work SET until = '2000-01-01T00:00:00.000+00:00' WHERE id = 3")
    assert store.claim(campaign).id == 3


def test_renewed_lease_holds_and_released_block_is_free(store: Store, campaign: str) -> None:
    first = store.claim(campaign, lease_s=-1.0)
    assert store.repository.renew_lease(first, 100.0)
    hold(store, campaign, 3)
    assert store.repository.claim_block(campaign=campaign) is None
    assert store.repository.release_block(first)
    again = store.claim(campaign)
    assert (again.id, again.attempt) == (first.id, 2)


def test_incomplete_or_foreign_results_are_refused(store: Store, campaign: str) -> None:
    block, other = hold(store, campaign, 2)
    runs = store.example.runs(block)
    unjudged = [store.example.run(case, verdicts=[]) for case in block.to_execute]
    for given, said in (
        (runs[:1], "not complete"),
        (unjudged, "not complete"),
        ([*runs, *store.example.runs(other)], "not of this block"),
    ):
        with pytest.raises(ValueError, match=said):
            store.complete(block, given)
    assert store.repository.info().rows["run"] == 0
    assert store.repository.work_state(campaign).leased == 2
    assert store.complete(block)


def test_block_that_another_campaign_filled_needs_nothing(store: Store, campaign: str) -> None:
    store.example.with_odd("2")
    store.campaign(8)
    block = store.claim(campaign)
    assert block.cases == ()
    assert store.complete(block, [])
    assert store.repository.progress(campaign).accounted == 2


def test_failing_block_is_halved_down_to_the_bad_case(store: Store) -> None:
    plan = store.plan(8, block_size=8)
    attempts = 0
    while (block := store.repository.claim_block(campaign=plan.campaign)) is not None:
        attempts += 1
        if any(case.ordinal == 5 for case in block.cases):
            assert store.repository.fail_block(block, "worker died") in {"pending", "quarantined"}
        else:
            assert store.complete(block)
    state = store.repository.work_state(plan.campaign)
    assert (state.quarantined, state.text) == (1, "quarantined")
    assert store.repository.progress(plan.campaign).accounted == 7
    assert attempts == leasing.MAX_FAILURES + 3 + 3
    assert store.repository.verify() == ()
    fsr1 = {
        item.architecture: item
        for item in store.repository.gate(plan.campaign)
        if item.fsr == "FSR1"
    }
    assert (str(fsr1["new"].verdict), str(fsr1["legacy"].verdict)) == ("NOT_RUN", "PASS")
    assert store.repository.queue.requeue_quarantined(plan.campaign) == 1
    assert store.work_off(plan.campaign) == 1
    assert store.repository.progress(plan.campaign).accounted == 8
    assert store.repository.verify() == ()


def test_late_failure_of_a_block_that_failed_before_changes_nothing(store: Store) -> None:
    plan = store.plan(4, block_size=4)
    for _ in range(leasing.MAX_FAILURES - 1):
        block = store.claim(plan.campaign)
        assert store.repository.fail_block(block, "worker died") == "pending"
    late = store.claim(plan.campaign, lease_s=-1.0)
    again = store.claim(plan.campaign)
    assert store.repository.fail_block(late, "worker died") is None
    assert store.complete(again)


def claim_all(path: Path, outbox: "multiprocessing.Queue[list[int]]") -> None:
    found: list[int] = []
    with Repository.open(path) as repository:
        while (block := repository.claim_block(lease_s=1e6)) is not None:
            found.append(block.id)
        outbox.put(found)
        # Stay alive, so that nobody takes its leases over.
        signal.sigwait({signal.SIGTERM})


def test_processes_that_claim_at_once_get_different_blocks(store: Store) -> None:
    store.plan(120, block_size=2)
    context = multiprocessing.get_context("fork")
    outbox: multiprocessing.Queue[list[int]] = context.Queue()
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    try:
        processes = [
            context.Process(target=claim_all, args=(store.repository.location, outbox))
            for _ in range(3)
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
def partly(store: Store) -> str:
    plan = store.plan(8, block_size=4)
    return str(plan.campaign)


def mask(*ordinals: int, planned: int = 8) -> Any:
    chosen = np.zeros(planned, dtype=np.bool_)
    chosen[list(ordinals)] = True
    return chosen


def claim(repository: Repository, partly: str, wanted: WantedBlocks) -> tuple[int, ...] | None:
    block = repository.claim_block(campaign=partly, wanted=wanted)
    return None if block is None else tuple(case.ordinal for case in block.cases)


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
    assert WantedBlocks().is_anything
    assert not WantedBlocks(aside={3}).is_anything
    assert WantedBlocks().stretches(2, 5) == [(2, 5)]
    block: Any = SimpleNamespace(id=1, from_ordinal=4, to_ordinal=8)
    for wanted, is_wanted in (
        (WantedBlocks(mask(7)), True),
        (WantedBlocks(mask(3)), False),
        (WantedBlocks(mask(7), aside={1}), False),
        (WantedBlocks(within=(4, 8)), True),
        (WantedBlocks(within=(5, 8)), False),
        (WantedBlocks(within=(0, 7)), False),
    ):
        assert wanted.wants(block) is is_wanted


def test_only_what_is_wanted_is_leased(repository: Repository, partly: str) -> None:
    wanted = WantedBlocks(mask(1, 2, 6))
    assert claim(repository, partly, wanted) == (1, 2)
    assert claim(repository, partly, wanted) == (6,)
    assert claim(repository, partly, wanted) is None
    rest = [claim(repository, partly, WantedBlocks()) for _ in range(5)]
    assert sorted(item for item in rest if item) == [(0,), (3,), (4, 5), (7,)]
    assert rest[-1] is None


def test_what_is_cut_is_completed_counted_and_covers_the_plan(store: Store, partly: str) -> None:
    for wanted in (WantedBlocks(mask(1, 2, 6)), WantedBlocks()):
        while (block := store.repository.claim_block(campaign=partly, wanted=wanted)) is not None:
            assert store.complete(block)
    assert store.repository.verify() == ()
    assert store.repository.progress(partly).accounted == 8
    assert store.repository.work_state(partly).text == "complete"


def test_an_abandoned_block_is_cut_too(store: Store, partly: str) -> None:
    hold(store, partly, 2, lease_s=-1.0)
    assert claim(store.repository, partly, WantedBlocks(mask(5))) == (5,)


def test_failures_of_a_block_stay_with_its_pieces(store: Store, partly: str) -> None:
    for _ in range(2):
        block = claimed(store, partly, WantedBlocks(mask(0, 1, 2, 3)))
        store.repository.fail_block(block, "broken")
    piece = claimed(store, partly, WantedBlocks(mask(0)))
    # The third failure of one case sets it aside.
    assert store.repository.fail_block(piece, "broken") == "quarantined"
