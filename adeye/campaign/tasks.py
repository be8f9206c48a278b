"""The blocks of a campaign on their way to an executor and back into the database."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.campaign.unchanged import Unchanged
from adeye.campaign.work import BatchTask
from adeye.store.cutting import block_bounds
from adeye.store.wanted import Wanted

if TYPE_CHECKING:
    from adeye.campaign.plan import CampaignPlan
    from adeye.campaign.session import Session
    from adeye.campaign.work import BatchResult, WorkContext
    from adeye.signals import Bools
    from adeye.store.repository import Repository
    from adeye.store.stored import Block, Plan
    from adeye.sweep.case import TestCase

LEASE_S: Final = 120.0
"""How long a block stays with a runner that does not renew its lease [s]."""


class Tasks(Iterator[BatchTask]):
    """Claims blocks as workers ask for them; asked again after its end, it looks again.

    Blocks of which only a part is wanted are cut, so they may be short: what is left of one block
    of the plan is executed together, each piece being leased, failed and completed by itself.

    Attributes:
        allowed: Whether what has no result may be executed, and what has one again.
        executed: Test cases that got their result here.
        failures: What adeye itself failed with.
        dropped: Blocks that were taken over by others before they were completed.
        completed: Blocks that were completed here.
        met_others: Whether other runners executed blocks of the campaign meanwhile.
        chosen: How many test cases were chosen; None for all.
        unchanged: Notices what is changed after the plan.
        session: What was asked for.
    """

    def __init__(
        self,
        repository: Repository,
        plan: CampaignPlan,
        stored: Plan,
        allowed: tuple[bool, bool],
        session: Session,
    ) -> None:
        """Prepare; the first block is claimed when it is asked for.

        Args:
            repository: The database; the campaign is planned.
            plan: What was planned.
            stored: What planning found.
            allowed: Whether what has no result is executed, and what has one again.
            session: What was asked for.
        """
        self.allowed = allowed
        self.session = session
        self.executed = 0
        self.completed = 0
        self.failures: list[str] = []
        self.dropped = 0
        self.met_others = False
        self.chosen: int | None = None
        self.unchanged = Unchanged(plan)
        self._repository = repository
        self._campaign = stored.campaign
        self._planned = stored.planned
        self._cases: Sequence[TestCase] = plan.cases
        self._context = plan.work
        self._wanted = Wanted()
        self._ends: list[int] = []
        self._held: dict[int, list[Block]] = {}
        self._given: dict[int, float] = {}
        self._next: Block | None = None
        self._alone: set[int] = set()
        self._done_before = repository.work_state(stored.campaign).done

    def use(self, context: WorkContext) -> None:
        """Execute blocks in another context than that of the plan."""
        self._context = context

    def choose(self, ordinals: Bools | None, stored: Plan, block_size: int) -> None:
        """Claim only some test cases.

        Args:
            ordinals: (N,) whether each is wanted; None for all.
            stored: What planning found.
            block_size: Most test cases that are executed together.
        """
        self._wanted.ordinals = ordinals
        self.chosen = None if ordinals is None else int(ordinals.sum())
        self._ends = [end for _, end in block_bounds(stored.ends, block_size)]

    def __next__(self) -> BatchTask:
        """Claim what is executed together next.

        Raises:
            StopIteration: Nothing is free, or nothing may be begun any more.
        """
        limits, stop = self.session.limits, self.session.stop
        while stop.asked is None and not limits.reached:
            block, self._next = self._next or self._claim(self._wanted), None
            if block is None:
                break
            # From here on it is held, so that whatever happens it is given back.
            self._held[block.id] = [block]
            if not self._needs(block) and block.cases:
                self._set_aside(block)
                continue
            blocks = self._gather(block)
            self._held[block.id] = blocks
            if not limits.allow(sum(map(self._needs, blocks))):
                self._give_back(block.id)
                break
            self._given[block.id] = time.monotonic()
            return self._task(blocks)
        raise StopIteration

    def held(self) -> list[Block]:
        """List the blocks that are leased here; may be called from another thread."""
        return [block for blocks in list(self._held.values()) for block in blocks]

    def open_elsewhere(self) -> int:
        """Count the wanted test cases that are left to other runners, when none is free here."""
        mine = {block.id for block in self.held()}
        count = self._repository.queue.open_elsewhere(self._campaign, self._wanted, mine)
        self.met_others |= count > 0
        return count

    def look_back(self) -> None:
        """Tell by the blocks that are done whether others were there, who may have left by now."""
        done = self._repository.work_state(self._campaign).done - self._done_before
        self.met_others |= done > self.completed

    def notes(self, remaining: int) -> list[str]:
        """Say what of the campaign was not executed, and why.

        Args:
            remaining: Test cases of the campaign without a result.
        """
        notes = []
        choice, limits = self.session.choice, self.session.limits
        if self.chosen is not None:
            notes.append(f"{choice.text} chose {self.chosen:,} of {self._planned:,} test cases")
        if self.chosen == 0:
            notes.append("an empty selection is no success")
        if limits.reached and remaining:
            notes.append(
                f"ended early, {limits.reached}; {remaining:,} test cases remain, "
                "the same command goes on"
            )
        if self.dropped:
            blocks = f"{self.dropped:,} block{'' if self.dropped == 1 else 's'}"
            notes.append(
                f"{blocks} had been taken over by another runner when they were done here, so what "
                "was executed here does not count"
            )
        return notes

    def complete(self, task: BatchTask, result: BatchResult) -> int:
        """Save what came out of a task.

        Returns:
            Test cases that were executed or judged by it; not those of blocks that were taken over.
        """
        done, first = 0, 0
        for block in list(self._held[task.block]):
            end = first + len(block.to_execute)
            part = result
            if len(self._held[task.block]) > 1 and result.runs is not None:
                part = replace(result, runs=result.runs.take(np.arange(first, end)))
            first = end
            if self._save(block, part):
                done += part.done
                self.completed += 1
                self.executed += sum(not case.has_result for case in block.cases)
            else:
                self.dropped += 1
                self.met_others = True
        elapsed = time.monotonic() - self._given.pop(task.block)
        self.session.limits.measure(sum(map(self._needs, self._held.pop(task.block))), elapsed)
        return done

    def fail(self, task: BatchTask, detail: str) -> None:
        """Take note that adeye itself failed in a task; it is tried again, piece by piece."""
        for block in self._held[task.block]:
            self._repository.fail_block(block, detail)
            self._alone.add(block.id)
        self._given.pop(task.block, None)
        del self._held[task.block]
        self.failures.append(detail)

    def release(self) -> None:
        """Give back what was claimed and not completed."""
        for number in list(self._held):
            self._give_back(number)
        if self._next is not None:
            self._repository.release_block(self._next)
            self._next = None

    def _save(self, block: Block, result: BatchResult) -> bool:
        if not block.to_execute or self.allowed[0]:
            return self._repository.complete_block(block, result.runs, result.judged)
        # It still lacks what may not be executed now.
        if result.judged is not None:
            self._repository.again.add(result.judged)
        self._set_aside(replace(block, cases=block.to_execute), is_held=False)
        return True

    def _claim(self, wanted: Wanted) -> Block | None:
        return self._repository.queue.claim(self._campaign, wanted, LEASE_S)

    def _needs(self, block: Block) -> int:
        """Count the test cases of a block that are executed, for a result or to be judged."""
        executes, replays = self.allowed
        return len(block.to_execute) * executes + len(block.to_judge) * replays

    def _gather(self, first: Block) -> list[Block]:
        """Claim the other pieces of the block of the plan that a piece is of, if it is one."""
        blocks = [first]
        if self._wanted.ordinals is None or first.id in self._alone or first.to_judge:
            return blocks
        place = bisect_right(self._ends, first.bounds[0])
        whole = self._ends[place - 1] if place else 0, self._ends[place]
        near = Wanted(self._wanted.ordinals, self._wanted.aside | self._alone, whole)
        while (more := self._claim(near)) is not None:
            if more.to_judge or not more.cases:
                self._next = more
                break
            blocks.append(more)
        return blocks

    def _task(self, blocks: Sequence[Block]) -> BatchTask:
        executes, replays = self.allowed
        to_execute = [case for block in blocks for case in block.to_execute] if executes else []
        to_judge = blocks[0].to_judge if replays else ()
        return BatchTask(
            block=blocks[0].id,
            execute=tuple(self._cases[item.ordinal] for item in to_execute),
            judge=tuple(
                (self._cases[item.ordinal], item.result_digest, item.missing_fsrs)
                for item in to_judge
            ),
            context=self._context,
        )

    def _set_aside(self, block: Block, *, is_held: bool = True) -> None:
        """Leave a block that still lacks something, but count what it does not lack."""
        self._repository.again.tally(block)
        self._wanted.aside.add(block.id)
        if is_held:
            self._give_back(block.id)
        else:
            self._repository.release_block(block)

    def _give_back(self, number: int) -> None:
        for block in self._held.pop(number, ()):
            self._repository.release_block(block)
        self._given.pop(number, None)
