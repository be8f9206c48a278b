"""Which test cases of a campaign are executed now: a shard, what -k names, what failed last.

Whatever is chosen, it is a part of the same campaign, and what is not chosen stays NOT_RUN.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from adeye.errors import UsageError
from adeye.store.cutting import block_bounds

if TYPE_CHECKING:
    from adeye.campaign.keyword import Keyword
    from adeye.signals import Bools
    from adeye.store.queue import Queue
    from adeye.store.stored import Plan

MOST_SHARDS: Final = 10_000


@dataclass(frozen=True, slots=True)
class Shard:
    """One of several parts that a campaign is divided into, whatever machine executes it.

    Attributes:
        number: From 1.
        of: How many there are.
    """

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read ``2/3``.

        Raises:
            UsageError: It is not a number and a count, or there is no such shard.
        """
        found = re.fullmatch(r"([0-9]{1,5})/([0-9]{1,5})", text.strip())
        if found is None or not 1 <= int(found[1]) <= int(found[2]) <= MOST_SHARDS:
            raise UsageError(
                f"--shard is {text!r}",
                remedy=f"Write which of how many, such as 2/3: from 1/n to n/n, n up to "
                f"{MOST_SHARDS:,}.",
            )
        return cls(int(found[1]), int(found[2]))

    def ordinals(self, planned: Plan, block_size: int) -> Bools:
        """Tell which test cases are of it: every so manieth block, by the plan alone.

        Args:
            planned: The plan.
            block_size: Most test cases in a block.

        Returns:
            (N,) for each ordinal.
        """
        chosen = np.zeros(planned.planned, dtype=np.bool_)
        for place, (first, end) in enumerate(block_bounds(planned.ends, block_size)):
            if place % self.of == self.number - 1:
                chosen[first:end] = True
        return chosen


@dataclass(frozen=True, slots=True)
class Choice:
    """What of a campaign is executed; all of these at once.

    Attributes:
        shard: A part of the blocks; None for all.
        keyword: What the names of a test case must be; None for any.
        last_failed: Only what has no result and failed or was not executed the last time.
    """

    shard: Shard | None = None
    keyword: Keyword | None = None
    last_failed: bool = False

    @property
    def is_everything(self) -> bool:
        """Whether nothing is left out."""
        return self == Choice()

    @property
    def text(self) -> str:
        """The options, for people."""
        parts = [
            self.shard and f"--shard {self.shard.number}/{self.shard.of}",
            self.keyword and f"-k {self.keyword.text!r}",
            self.last_failed and "--last-failed",
        ]
        return " ".join(part for part in parts if part)

    def ordinals(self, queue: Queue, planned: Plan, block_size: int) -> Bools | None:
        """Tell which test cases are chosen.

        Args:
            queue: Of the database.
            planned: The plan, which is saved.
            block_size: Most test cases in a block.

        Returns:
            (N,) for each ordinal; None for all.
        """
        if self.is_everything:
            return None
        chosen = np.ones(planned.planned, dtype=np.bool_)
        if self.shard is not None:
            chosen &= self.shard.ordinals(planned, block_size)
        if self.keyword is not None:
            for ordinal, case, _ in queue.cases(planned.campaign):
                chosen[ordinal] &= self.keyword.matches(case)
        if self.last_failed:
            chosen &= failed_last(queue, planned)
        return chosen


def failed_last(queue: Queue, planned: Plan) -> Bools:
    """Tell which test cases failed the last time that they were executed, or never were.

    A test case with a result in this campaign is what that says. One without is looked up by its
    names in the earlier campaigns of the ODD, the last one first: its content may be another one by
    now, which is why it has no result. It failed if a mandatory FSR has a FAIL or an ERROR.

    Args:
        queue: Of the database.
        planned: The plan, which is saved.

    Returns:
        (N,) for each ordinal.
    """
    chosen = np.zeros(planned.planned, dtype=np.bool_)
    chosen[sorted(queue.failed(planned.campaign))] = True
    unknown = {
        case: ordinal for ordinal, case, has_result in queue.cases(planned.campaign)
        if not has_result
    }  # fmt: skip
    for earlier in queue.earlier(planned.campaign):
        if not unknown:
            break
        failed = queue.failed(earlier)
        for ordinal, case, has_result in queue.cases(earlier):
            if has_result and case in unknown:
                chosen[unknown.pop(case)] = ordinal in failed
    chosen[sorted(unknown.values())] = True
    return chosen
