"""What is chosen of a campaign: shards, words, and what failed last."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.campaign.selection import Choice, Keyword, Shard, failed_last
from adeye.errors import UsageError
from adeye.store.records import Plan
from adeye.store.write.queue import NamedCase

if TYPE_CHECKING:
    from collections.abc import Iterator

PLAN = Plan("new", 10, 10, 0, is_new=True, ends=(4, 10))


class Campaigns:
    """Campaigns with their test cases, as the queue of a database tells them."""

    def __init__(self, **campaigns: dict[str, str]) -> None:
        """Take the verdict of each test case by name: ``pass``, ``fail``, or empty for none."""
        self.all = campaigns

    def cases(self, campaign: str) -> Iterator[tuple[int, NamedCase, bool]]:
        for ordinal, (name, verdict) in enumerate(self.all[campaign].items()):
            yield ordinal, NamedCase(name, "x", "none", 0, "{}"), bool(verdict)

    def failed(self, campaign: str) -> frozenset[int]:
        verdicts = enumerate(self.all[campaign].values())
        return frozenset(ordinal for ordinal, verdict in verdicts if verdict == "fail")

    def earlier(self, campaign: str) -> list[str]:
        return [name for name in self.all if name != campaign]


def chosen(campaigns: Campaigns, **choice: Any) -> list[int]:
    planned = len(campaigns.all["new"])
    plan = Plan("new", planned, planned, 0, is_new=True, ends=(planned,))
    found = Choice(**choice).ordinals(campaigns, plan, 2)  # type: ignore[arg-type]
    assert found is not None
    return np.flatnonzero(found).tolist()


@pytest.mark.parametrize("of", [1, 2, 3, 5, 7])
def test_every_test_case_is_of_one_shard(of: int) -> None:
    shards = [Shard(number, of).ordinals(PLAN, 2) for number in range(1, of + 1)]
    assert (np.sum(shards, axis=0) == 1).all()


def test_shards_are_made_of_whole_blocks_in_turn() -> None:
    # Blocks of at most 3 that cross no end: 0-2, 3, 4-6, 7-9.
    first, second = (np.flatnonzero(Shard(place, 2).ordinals(PLAN, 3)) for place in (1, 2))
    assert first.tolist() == [0, 1, 2, 4, 5, 6]
    assert second.tolist() == [3, 7, 8, 9]


def test_more_shards_than_blocks_leave_some_empty() -> None:
    assert not Shard(9, 9).ordinals(PLAN, 3).any()


@pytest.mark.parametrize("text", ["", "1", "0/3", "4/3", "1/0", "a/b", "-1/3", "1/2/3", "1/99999"])
def test_no_such_shard(text: str) -> None:
    with pytest.raises(UsageError, match="--shard"):
        Shard.parse(text)


def test_shard_is_read() -> None:
    assert Shard.parse(" 2/3 ") == Shard(2, 3)


def test_nothing_asked_for_is_everything() -> None:
    assert Choice().is_everything
    assert Choice().ordinals(Campaigns(), PLAN, 2) is None  # type: ignore[arg-type]


def test_all_that_is_asked_for_counts_at_once() -> None:
    campaigns = Campaigns(new={"a1": "", "a2": "", "b1": "", "b2": "", "a3": ""})
    word = Keyword.parse("a")
    assert chosen(campaigns, keyword=word) == [0, 1, 4]
    assert chosen(campaigns, keyword=word, shard=Shard(1, 2)) == [0, 1, 4]
    assert chosen(campaigns, keyword=word, shard=Shard(2, 2)) == []
    text = Choice(shard=Shard(2, 2), keyword=word, last_failed=True).text
    assert text == "--shard 2/2 -k 'a' --last-failed"


def test_failed_last_is_what_failed_here_or_has_no_result_anywhere() -> None:
    campaigns = Campaigns(new={"a": "pass", "b": "fail", "c": ""})
    assert chosen(campaigns, last_failed=True) == [1, 2]


def test_what_passed_before_an_edit_is_not_executed_for_it() -> None:
    campaigns = Campaigns(
        new={"a": "", "b": "", "c": "pass", "d": ""},
        before={"b": "fail", "a": "pass", "c": "fail"},
    )
    assert chosen(campaigns, last_failed=True) == [1, 3]


def test_last_campaign_in_which_it_was_executed_counts() -> None:
    campaigns = Campaigns(
        new={"a": "", "b": ""},
        before={"a": "", "b": "pass"},
        first={"a": "fail", "b": "fail"},
    )
    plan = Plan("new", 2, 2, 0, is_new=True, ends=(2,))
    assert failed_last(campaigns, plan).tolist() == [True, False]  # type: ignore[arg-type]
