"""The queue as runners share it: names of test cases, what failed, what others hold."""

import json
from typing import Any

import pytest

from adeye.judge.verdict import Verdict
from adeye.store.owner import Owner
from adeye.store.repository import Repository
from adeye.store.write.queue import NamedCase, WantedBlocks

FAR = Owner("another machine", 1, "1")


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=2)
    return str(plan.campaign)


def complete(repository: Repository, example: Any, campaign: str, blocks: int) -> None:
    for _ in range(blocks):
        block = repository.queue.claim(campaign, WantedBlocks(), 60.0)
        assert block is not None
        assert repository.complete_block(block, example.runs(block))


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
            case.scenario, case.architecture, case.fault_entry, case.replicate, named.point
        )
        assert point == dict(case.point)


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
        assert repository.complete_block(block, example.runs(block))
    assert repository.queue.open_elsewhere(campaign, WantedBlocks(), {mine.id}) == 2
    assert repository.complete_block(theirs, example.runs(theirs))
    assert repository.queue.open_elsewhere(campaign, WantedBlocks(), {mine.id}) == 0


def test_quarantined_blocks_are_free_again(repository: Repository, campaign: str) -> None:
    block = repository.queue.claim(campaign, WantedBlocks(), 60.0)
    assert block is not None
    assert repository.quarantine_block(block, "broken")
    assert repository.queue.requeue_quarantined(campaign) == 1
    assert repository.work_state(campaign).pending == 4
