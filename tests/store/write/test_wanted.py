"""Blocks that are wanted in part are cut, and nothing of them is lost."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adeye.store.repository import Repository
from adeye.store.write.queue import WantedBlocks


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=4)
    return str(plan.campaign)


def mask(*ordinals: int, planned: int = 8) -> Any:
    chosen = np.zeros(planned, dtype=np.bool_)
    chosen[list(ordinals)] = True
    return chosen


def claim(repository: Repository, campaign: str, wanted: WantedBlocks) -> tuple[int, ...] | None:
    block = repository.queue.claim(campaign, wanted, 60.0)
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
    repository: Repository, campaign: str
) -> None:
    wanted = WantedBlocks(mask(1, 2, 6))
    assert claim(repository, campaign, wanted) == (1, 2)
    assert claim(repository, campaign, wanted) == (6,)
    assert claim(repository, campaign, wanted) is None
    rest = [claim(repository, campaign, WantedBlocks()) for _ in range(5)]
    assert sorted(item for item in rest if item) == [(0,), (3,), (4, 5), (7,)]
    assert rest[-1] is None


@pytest.mark.slow
def test_what_is_cut_is_completed_counted_and_covers_the_plan(
    repository: Repository, example: Any, campaign: str
) -> None:
    for wanted in (WantedBlocks(mask(1, 2, 6)), WantedBlocks()):
        while (block := repository.queue.claim(campaign, wanted, 60.0)) is not None:
            assert repository.complete_block(block, example.runs(block))
    assert repository.verify() == ()
    assert repository.progress(campaign).accounted == 8
    assert repository.work_state(campaign).text == "complete"


def test_an_abandoned_block_is_cut_too(repository: Repository, campaign: str) -> None:
    for _ in range(2):
        assert repository.claim_block(lease_s=-1.0, campaign=campaign) is not None
    assert claim(repository, campaign, WantedBlocks(mask(5))) == (5,)


def test_failures_of_a_block_stay_with_its_pieces(repository: Repository, campaign: str) -> None:
    for _ in range(2):
        block = repository.queue.claim(campaign, WantedBlocks(mask(0, 1, 2, 3)), 60.0)
        assert block is not None
        repository.fail_block(block, "broken")
    piece = repository.queue.claim(campaign, WantedBlocks(mask(0)), 60.0)
    assert piece is not None
    # The third failure of one case sets it aside.
    assert repository.fail_block(piece, "broken") == "quarantined"
