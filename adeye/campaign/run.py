"""Execute a campaign: plan first, then block by block what is missing, into the database.

Three things do: somebody asks for it (Ctrl-C, SIGTERM), the time that it was given is over, or as
many runs failed as were to be seen. In each case no block is begun any more, the blocks that are
being executed are completed as far as they can be, and all that is left stays to be done.
"""

from __future__ import annotations

import math
import threading
import time
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import islice
from numbers import Integral
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.campaign.executors import Done, InProcess, Processes, Threads
from adeye.campaign.parts import Unchanged
from adeye.campaign.rejudge import VERDICT, Rejudged, rejudge
from adeye.campaign.selection import Choice
from adeye.campaign.studies.half_step import HalfStepTasks, Halved
from adeye.campaign.summary import CampaignSummary, summarise
from adeye.campaign.traces import Keep, Wanted
from adeye.campaign.work import BatchResult, BatchTask, WorkContext, execute
from adeye.errors import ASKED_TO_END, AdeyeError, InputError, UsageError, amount
from adeye.judge.verdict import ExitCode, exit_code
from adeye.kernel.jit import is_cache_warm
from adeye.notices import meanwhile, notice
from adeye.simulate.bridges.middleware import COUNTS_AS, MIDDLEWARE
from adeye.simulate.channels.factory import HOSTED
from adeye.simulate.channels.process.channel import MOST_PROGRAMS
from adeye.simulate.recorder import trace_bytes
from adeye.simulate.sensors.lidar import sample_bytes
from adeye.store.evidence.ledger_check import refuse
from adeye.store.evidence.roots import folder_of
from adeye.store.repository import Repository
from adeye.store.write.planning import block_bounds
from adeye.store.write.queue import WantedBlocks
from adeye.units import shown

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.campaign.executor_names import NamedExecutor
    from adeye.campaign.plan import CampaignPlan
    from adeye.ports import Executor
    from adeye.signals import Bools
    from adeye.simulate.channels.pace import Pace
    from adeye.store.records import Block, Plan
    from adeye.sweep.case import TestCase

# --- The blocks of a campaign on their way to an executor and back into the database --------------

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
        context: WorkContext | None = None,
    ) -> None:
        """Prepare; the first block is claimed when it is asked for.

        Args:
            repository: The database; the campaign is planned.
            plan: What was planned.
            stored: What planning found.
            allowed: Whether what has no result is executed, and what has one again.
            session: What was asked for.
            context: In which blocks are executed; None for that of the plan.
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
        self._context = context or plan.work
        self._wanted = WantedBlocks()
        self._ends: list[int] = []
        self._held: dict[int, list[Block]] = {}
        self._given: dict[int, float] = {}
        self._next: Block | None = None
        self._alone: set[int] = set()
        self._done_before = repository.work_state(stored.campaign).done

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
                f"ended early, {limits.reached}; "
                f"{amount(remaining, 'test case remains', 'test cases remain')}, "
                "the same command goes on"
            )
        if self.dropped:
            blocks = amount(self.dropped, "block")
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
        # What has been completed before a worker died is held no longer.
        for block in self._held.pop(task.block, ()):
            self._repository.fail_block(block, detail)
            self._alone.add(block.id)
        self._given.pop(task.block, None)
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

    def _claim(self, wanted: WantedBlocks) -> Block | None:
        return self._repository.claim_block(lease_s=LEASE_S, campaign=self._campaign, wanted=wanted)

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
        near = WantedBlocks(self._wanted.ordinals, self._wanted.aside | self._alone, whole)
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


# --- A wish to end a campaign: what ends it early, and how it ends then ---------------------------

_REMEMBERED: Final = 8
"""Blocks whose pace tells that of the next one."""


@dataclass
class Stop:
    """Whether somebody asked a campaign to end.

    Attributes:
        asked: What was asked, as the exception that it is outside of blocks; None for nothing.
        is_deferred: Whether who asks leaves it to the campaign when to end.
    """

    asked: type[BaseException] | None = None
    is_deferred: bool = False

    def ask(self, kind: type[BaseException]) -> None:
        """Ask for the end.

        Raises:
            BaseException: At once, where nothing is being executed that could be completed.
        """
        self.asked = kind
        if not self.is_deferred:
            raise kind

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """Execute blocks: whoever asks for the end inside does not interrupt.

        Raises:
            BaseException: At the end, what was asked meanwhile.
        """
        self.is_deferred = True
        try:
            yield
        finally:
            self.is_deferred = False
        self.check()

    def check(self) -> None:
        """Raise what was asked.

        Raises:
            BaseException: If something was.
        """
        if self.asked is not None:
            raise self.asked


@dataclass
class Limits:
    """How long a campaign may take now, and how many failures are enough.

    Attributes:
        budget_s: Time from the moment that this is made [s].
        most_failures: Runs with a FAIL or ERROR after which no block is begun; None for no limit.
        reached: What ended it, in words; empty as long as nothing did.
    """

    budget_s: float = math.inf
    most_failures: int | None = None
    reached: str = ""
    _began: float = field(init=False)
    _paces: deque[float] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))

    def __post_init__(self) -> None:
        self._began = time.monotonic()

    @property
    def left_s(self) -> float:
        """Time that is left [s]."""
        return self.budget_s - (time.monotonic() - self._began)

    def count(self, failures: int) -> None:
        """Take note of the runs with a FAIL or ERROR so far."""
        if self.most_failures is not None and failures >= self.most_failures:
            runs = amount(failures, "run")
            self.reached = self.reached or f"{runs} with a FAIL or an ERROR, as --maxfail asks"

    def measure(self, cases: int, seconds: float) -> None:
        """Take note of how long a block took from when it was given to when it was saved.

        Args:
            cases: Its test cases.
            seconds: Elapsed time [s], also what it waited for others.
        """
        if cases:
            self._paces.append(seconds / cases)

    def allow(self, cases: int) -> bool:
        """Tell whether a block may be begun: there is time for it, by the slowest of the last ones.

        As long as none is done, any may begin that has time at all.
        """
        if self.reached:
            return False
        needed = cases * max(self._paces, default=0.0)
        if self.left_s > needed:
            return True
        self.reached = "the time that --budget gives is over"
        if self.left_s > 0.0:
            self.reached = "no block would end in the time that --budget gives"
        return False


# --- What is asked of one execution of a campaign: how much of it, and what ends it ---------------

DEADLINE_S: Final = 3_600.0
"""How long a worker process may take for one block unless said otherwise [s]."""


@dataclass(frozen=True, slots=True)
class Session:
    """One execution.

    Attributes:
        choice: Which test cases are executed.
        limits: After how much of it no block is begun any more.
        stop: Whether somebody asked it to end.
        deadline_s: How long a worker process may take for one block [s].
        pace: Of the ticks; None for as fast as they go. It is measured in this process only.
    """

    choice: Choice = field(default_factory=Choice)
    limits: Limits = field(default_factory=Limits)
    stop: Stop = field(default_factory=Stop)
    deadline_s: float = DEADLINE_S
    pace: Pace | None = None

    @property
    def has_ended(self) -> bool:
        """Whether something ended it before all was done."""
        return self.stop.asked is not None or bool(self.limits.reached)


# --- Renew leases while their holder lives: slow blocks keep theirs, a stopped runner loses them --

BEATS_PER_LEASE = 4
"""Renewals in the time of a lease: some may fail before it ends."""


@contextmanager
def renewing(
    repository: Repository, held: Callable[[], Iterable[Block]], lease_s: float
) -> Iterator[None]:
    """Renew the leases of blocks from a thread of its own.

    A lease that cannot be renewed, because the database is busy or somebody took the block over, is
    left as it is: who completes a block is told by the database.

    Args:
        repository: The database.
        held: Gives the blocks that are held now; called from the thread.
        lease_s: For how long they are leased from each renewal on [s].
    """

    def beat(over: threading.Event) -> None:
        while not over.wait(lease_s / BEATS_PER_LEASE):
            for block in held():
                if over.is_set():
                    return
                try:
                    repository.renew_lease(block, lease_s)
                except AdeyeError:
                    # The next beat tries again; the lease tells everybody else how long to wait.
                    continue

    with meanwhile(beat, "heartbeat"):
        yield


# --- How many test cases are executed together ----------------------------------------------------

SMALLEST_BLOCK, LARGEST_BLOCK = 16, 1_024
BLOCKS = 16
"""Blocks that a plan is cut into, if they become neither too small nor too large."""
TRACE_MEMORY = 192 * 2**20
"""Memory for the traces of one block [bytes]: two of them at once leave room below one gigabyte."""


def block_size(plan: CampaignPlan) -> int:
    """Choose how many test cases a block has at most.

    A small plan has small blocks, so that a kill costs little and every worker has something to
    do; a large one has large blocks, over which compiled code and inserts cost least, as far as
    their traces and the returns of their lidars fit into memory.
    """
    return _block_size(plan.expansion.count, fitting(plan.examples()))


def fitting(examples: Sequence[TestCase]) -> int:
    """Count the runs that fit into memory together, and whose programs may run at once."""
    largest = max(trace_bytes(case) + sample_bytes(case.architecture) for case in examples)
    most = TRACE_MEMORY // largest
    programs = max(_programs(case) for case in examples)
    return min(most, max(1, MOST_PROGRAMS // programs)) if programs else most


def _programs(case: TestCase) -> int:
    """Count the programs of a run: those of channels that have one of their own, other FMUs."""
    kinds = [channel.kind for channel in case.architecture.channels.values()]
    own = sum(COUNTS_AS if kind in MIDDLEWARE else kind in HOSTED for kind in kinds)
    return own + case.fmus


def _block_size(planned: int, most: int) -> int:
    """Choose the size for some planned test cases of which some fit into memory together.

    >>> [_block_size(planned, 2_000) for planned in (28, 1_000, 8_000, 65_536, 1_000_000)]
    [16, 62, 500, 1024, 1024]
    >>> _block_size(1_000_000, 640)
    640
    """
    wanted = min(max(planned // BLOCKS, SMALLEST_BLOCK), LARGEST_BLOCK)
    return max(1, min(wanted, most))


# --- Execute a campaign: plan first, then block by block what is missing, into the database -------

MOST_LANES: Final = 4096
"""Threads or processes that can be asked for; more are a slip."""
POLL_S: Final = 1.0
"""Between two looks at what other runners have leased [s]."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is.

    Attributes:
        phase: ``plan``, ``half step`` where the ODD asks for it, ``judge``, ``run``, ``wait`` while
            other runners execute the last blocks, or ``done``.
        done: Test cases planned, then those executed or judged here.
        total: Test cases to plan, then those to execute or judge.
        failures: Runs with a FAIL or ERROR so far.
    """

    phase: str
    done: int
    total: int
    failures: int


def run_campaign(  # noqa: PLR0913 - all but the plan has a default
    plan: CampaignPlan,
    *,
    db: str | Path | None = None,
    workers: int = 1,
    threads: int = 1,
    executor: NamedExecutor | None = None,
    progress: Callable[[Progress], None] | None = None,
    traces: Wanted = "none",
    session: Session | None = None,
) -> CampaignSummary:
    """Execute what a plan lacks in the database, and judge it.

    The plan is committed before the first run. Whatever dies, the next call goes on where the
    database ends; a finished campaign executes nothing. Results that lack verdicts are judged from
    what is kept of them; only where that is not enough are they executed again.

    Any number of runners may share a campaign: each waits at the end for the blocks that others are
    executing, or takes them over if these have died, so that all end with the same verdict.

    Args:
        plan: A checked plan.
        db: Database, by default ``.adeye/adeye.db``.
        workers: Processes; 1 runs here.
        threads: Threads over blocks, in this process; only where there is one process.
        executor: Executor in place of threads and processes; None for these.
        progress: Called after each block, and now and then while a large plan is saved.
        traces: Which traces of what is executed are kept.
        session: Which part is executed and what ends it; None for all of it.

    Raises:
        UsageError: Workers or threads are no number of them.
        IntegrityError: A result contradicts one that exists, one that was judged lacks verdicts, or
            a plug-in was changed meanwhile.
        PlatformError: The database cannot be written, or the executor cannot go on.
    """
    _require_counts(workers, threads)
    with Repository.open(db) as repository:
        campaign = _Campaign(repository, plan, progress, traces, session)
        return campaign.finish((workers, threads), executor)


def judge_campaign(
    plan: CampaignPlan,
    *,
    db: str | Path | None = None,
    replay: bool = False,
    workers: int = 1,
    threads: int = 1,
    progress: Callable[[Progress], None] | None = None,
) -> CampaignSummary:
    """Judge the results that a plan has in the database, as it asks for now.

    Test cases without a result stay without one.

    Args:
        plan: A checked plan.
        db: Database, by default ``.adeye/adeye.db``; it has to exist.
        replay: Execute those again of which too little is kept.
        workers: Processes; 1 runs here.
        threads: Threads over blocks, in this process; only where there is one process.
        progress: Called now and then.

    Raises:
        InputError: There is no database.
        IntegrityError: A run does not come out as it was recorded, or verdicts are gone.
        PlatformError: The database cannot be written.
    """
    _require_counts(workers, threads)
    with Repository.open(db, create=False) as repository:
        campaign = _Campaign(repository, plan, progress, "none")
        return campaign.finish((workers, threads), executes=False, replays=replay)


def _require_counts(workers: int, threads: int) -> None:
    count: Any
    for name, count in (("workers", workers), ("threads", threads)):
        is_count = isinstance(count, Integral) and not isinstance(count, bool)
        if not is_count or not 1 <= count <= MOST_LANES:
            raise UsageError(
                f"{name} is {shown(count)}", remedy=f"Give a whole number from 1 to {MOST_LANES:,}."
            )


class _Campaign:
    """A campaign from its plan to its summary."""

    def __init__(
        self,
        repository: Repository,
        plan: CampaignPlan,
        progress: Callable[[Progress], None] | None,
        traces: Wanted,
        session: Session | None = None,
    ) -> None:
        self._session = session or Session()
        self._repository, self._plan = repository, plan
        self._report = progress or (lambda _: None)
        keep = Keep(traces, folder_of(repository.location.beside))
        self._context = replace(
            plan.work, keep=None if traces == "none" else keep, pace=self._session.pace
        )

    def finish(
        self,
        lanes: tuple[int, int],
        executor: NamedExecutor | None = None,
        *,
        executes: bool = True,
        replays: bool = True,
    ) -> CampaignSummary:
        """Save the plan, judge what is there, execute the rest if asked to, and read the result.

        Args:
            lanes: Processes and threads.
            executor: What is used in place of them; None for these.
            executes: Whether what has no result is executed.
            replays: Whether results of which too little is kept are executed again.
        """
        repository, plan = self._repository, self._plan
        planned, size = plan.expansion.count, block_size(plan)
        # A bench has one of each, and answers would wait for those of other runs.
        together = 1 if self._session.pace else size
        record = plan.record()
        stored = repository.plan_campaign(
            record,
            plan.planned(),
            block_size=together,
            report=lambda done: self._report(Progress("plan", done, planned, 0)),
        )
        if stored.to_judge:
            # What is gone would be judged anew from what is kept, and look as if it had been.
            refuse("the database", repository.unsound(stored.campaign))
        known = repository.evidence.sessions(stored.campaign)
        # Who executes nothing, but asks from a copy of the project, is another one, too.
        is_elsewhere = all(
            item.provenance.get("odd_place") != record.provenance["odd_place"] for item in known
        )
        if stored.is_new or stored.to_execute or stored.to_judge or is_elsewhere:
            repository.evidence.add_session(stored.campaign, record.provenance)
        repository.queue.requeue_quarantined(stored.campaign)
        chosen = self._session.choice.ordinals(repository.queue, stored, size, plan.tags)
        keep = self._context.keep
        traces = None if keep is None else keep.folder
        elsewhere = None if executor is None else executor.open(plan, traces)
        lanes_of = _Lanes(plan, lanes, self._session, elsewhere)
        allowed = executes, replays
        tasks = Tasks(repository, plan, stored, allowed, self._session, self._context)
        tasks.choose(chosen, stored, together)
        halved, again = Halved(), Rejudged(0, 0, {}, {})
        state = Progress("run", 0, 0, 0)
        try:
            # Who chose nothing has nothing to do, not even what the others need.
            if plan.samples and tasks.chosen != 0:
                halved = self._halve(lanes_of, tasks.unchanged, stored, executes=executes)
            # Without the uncertainty that was asked for nothing can be judged.
            if not halved.failures:
                again = rejudge(
                    repository,
                    plan,
                    stored.campaign,
                    lambda done, wanted: self._report(Progress("judge", done, wanted, 0)),
                )
                if plan.samples:
                    repository.hindsight.half_steps.judge(stored.campaign)
                state = self._work_off(tasks, lanes_of, again, stored)
        except InputError:
            # What cannot be used any more was changed after the plan, in whichever block it shows.
            tasks.unchanged.check()
            raise
        except ASKED_TO_END:
            lanes_of.abandon()
            raise
        finally:
            lanes_of.close()
            tasks.release()
        repository.evidence.record_root(stored.campaign)
        self._report(replace(state, phase="done"))
        return self._summary(stored, tasks, halved, again)

    def _halve(
        self, lanes: _Lanes, unchanged: Unchanged, stored: Plan, *, executes: bool
    ) -> Halved:
        """Find the numeric uncertainty unless it is known, and judge with it what is there."""
        half_steps = self._repository.hindsight.half_steps
        found = Halved()
        if half_steps.uncertainty(stored.campaign):
            if stored.to_judge:
                half_steps.judge(stored.campaign)
            return found
        if not executes:
            return Halved(0, ("they were not executed; `adeye run` executes them",))
        fit = fitting(self._plan.examples())
        context = replace(self._context, pace=None)
        halves = HalfStepTasks(self._repository, self._plan, fit, context)
        self._report(Progress("half step", 0, halves.total, 0))
        for done in lanes.start(halves):
            unchanged.check()
            halves.absorb(done)
            self._report(Progress("half step", halves.done, halves.total, 0))
        found = Halved(halves.twins, tuple(halves.failures))
        if not found.failures:
            half_steps.save_uncertainty(stored.campaign, halves.found())
            half_steps.judge(stored.campaign)
        return found

    def _summary(
        self, stored: Plan, tasks: Tasks, halved: Halved, again: Rejudged
    ) -> CampaignSummary:
        """Say what came out, with what went wrong in the message."""
        repository, (_, replays) = self._repository, tasks.allowed
        repository.reopen()
        campaign = repository.find_campaign(stored.campaign)
        now = repository.progress(stored.campaign).executed - stored.reused
        ways = dict(again.ways)
        if self._plan.samples and not halved.failures and stored.to_judge > again.wanted:
            ways[VERDICT] = stored.to_judge - again.wanted
        tasks.look_back()
        executed = tasks.executed if tasks.met_others else now
        summary = replace(
            summarise(repository, campaign, self._plan, stored),
            executed=executed,
            elsewhere=max(0, now - executed),
            judged=(again.wanted if replays else again.judged) + ways.get(VERDICT, 0),
            replayed=len(again.left) if replays else 0,
            ways=ways,
            to_replay=0 if replays else len(again.left),
            to_execute=stored.to_execute - now,
            twins=halved.twins,
        )
        notes = []
        if halved.failures:
            notes.append(f"nothing is judged without the twins: {_first_line(halved.failures[-1])}")
        if tasks.failures and campaign.work.quarantined:
            last = _first_line(tasks.failures[-1])
            notes.append(f"{campaign.work.quarantined} blocks were given up: {last}")
        notes += tasks.notes(summary.to_execute)
        if notes:
            message = "; ".join((summary.message.rstrip("."), *notes))
            summary = replace(summary, message=message)
        if tasks.chosen == 0:
            # An empty selection is no success, whatever the verdict of the campaign is.
            code = exit_code([summary.exit_code, ExitCode.INCOMPLETE])
            summary = replace(summary, exit_code=code)
        return replace(summary, selected=tasks.chosen)

    def _work_off(self, tasks: Tasks, lanes: _Lanes, again: Rejudged, stored: Plan) -> Progress:
        """Execute blocks until none is left to anybody, or something ends it before."""
        executes, replays = tasks.allowed
        to_execute = stored.to_execute
        if self._plan.samples:
            to_execute, _ = self._repository.hindsight.half_steps.count_open(stored.campaign)
        total = to_execute * executes + len(again.left) * replays
        state = Progress("run", 0, total, 0)
        self._report(state)
        others: int | None = None
        # Leases are kept meanwhile, and whoever asks for the end does not interrupt.
        with self._session.stop.deferred(), renewing(self._repository, tasks.held, LEASE_S):
            # Nobody held anything before the last look at what is free: then all is done.
            while others != 0:
                for done in lanes.start(tasks):
                    state = _absorb(tasks, done, state)
                    self._session.limits.count(state.failures)
                    self._report(state)
                if self._session.has_ended:
                    break
                others = tasks.open_elsewhere() if executes else 0
                if others and self._session.limits.allow(0):
                    self._report(replace(state, phase="wait"))
                    time.sleep(POLL_S)
        return state


class _Lanes:
    """Where blocks are executed."""

    def __init__(
        self,
        plan: CampaignPlan,
        lanes: tuple[int, int],
        session: Session,
        executor: Executor[BatchTask, BatchResult] | None,
    ) -> None:
        self._plan = plan
        # Workers elsewhere compile for themselves.
        self._count = max(lanes) if executor is None else 1
        self._stop = session.stop
        self._executor = executor or _executor(*lanes, session.deadline_s)

    def start(self, wanted: Iterator[BatchTask]) -> Iterator[Done[BatchTask, BatchResult]]:
        """Execute blocks as they are asked for."""
        if self._count > 1 and not is_cache_warm(*self._plan.compiled_parts):
            # Compiled once here, the kernels are loaded by every worker.
            yield from (Done(task, execute(task)) for task in islice(wanted, 1))
        for done in self._executor.run(wanted):
            yield done
            if self._stop.asked is not None:
                # What waits for a thread is not begun any more.
                getattr(self._executor, "drop_waiting", lambda: None)()

    def close(self) -> None:
        """End what was started."""
        self._executor.close()

    def abandon(self) -> None:
        """Let go of what is being executed; what cannot be ended is not waited for."""
        getattr(self._executor, "abandon", self._executor.close)()


def _first_line(text: str) -> str:
    """An exception of a library may have many lines; the database keeps them all."""
    return text.partition("\n")[0]


def _executor(workers: int, threads: int, deadline_s: float) -> Executor[BatchTask, BatchResult]:
    if workers > 1:
        return Processes(execute, workers, deadline_s)
    return InProcess(execute) if threads == 1 else Threads(execute, threads)


def _absorb(tasks: Tasks, done: Done[BatchTask, BatchResult], state: Progress) -> Progress:
    """Save what came back for a block, unless its code is not that of the plan."""
    # Before it is taken: a block whose code is another one is given back.
    tasks.unchanged.check()
    if done.result is None:
        notice(f"block {done.task.block} was lost: {done.lost}")
    if done.result is None or done.result.failure:
        tasks.fail(done.task, done.lost if done.result is None else done.result.failure)
        return state
    saved = tasks.complete(done.task, done.result)
    failures = done.result.failures if saved else 0
    return replace(state, done=state.done + saved, failures=state.failures + failures)
