"""Execute a campaign: plan first, then block by block what is missing, into the database."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING

from adeye.campaign.blocks import block_size, fitting
from adeye.campaign.executors import Done, InProcess, Processes, Threads
from adeye.campaign.halving import HalfStepTasks, Halved
from adeye.campaign.keeping import Keep, folder_of
from adeye.campaign.rejudging import VERDICT, Rejudged, rejudge
from adeye.campaign.summary import CampaignSummary, failed_channels, summarise
from adeye.campaign.unchanged import Unchanged
from adeye.campaign.work import BatchResult, BatchTask, execute
from adeye.errors import InputError
from adeye.kernel.jit import is_cache_warm
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.campaign.executor_names import NamedExecutor
    from adeye.campaign.keeping import Wanted
    from adeye.campaign.plan import CampaignPlan
    from adeye.campaign.work import WorkContext
    from adeye.ports import Executor
    from adeye.store.stored import Block, Plan
    from adeye.sweep.case import TestCase

LEASE_S = 600.0


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is.

    Attributes:
        phase: ``plan``, ``half step`` where the ODD asks for it, ``judge``, ``run`` or ``done``.
        done: Test cases planned, then those executed or judged.
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
) -> CampaignSummary:
    """Execute what a plan lacks in the database, and judge it.

    The plan is committed before the first run. Whatever dies, the next call goes on where the
    database ends; a finished campaign executes nothing. Results that lack verdicts are judged from
    what is kept of them; only where that is not enough are they executed again.

    Args:
        plan: A checked plan.
        db: Database, by default ``.adeye/adeye.db``.
        workers: Processes; 1 runs here.
        threads: Threads over blocks, in this process; only where there is one process.
        executor: Executor in place of threads and processes; None for these.
        progress: Called after each block, and now and then while a large plan is saved.
        traces: Which traces of what is executed are kept.

    Raises:
        IntegrityError: A result contradicts one that exists, or a plug-in was changed meanwhile.
        PlatformError: The database cannot be written, or the executor cannot go on.
    """
    with Repository.open(db) as repository:
        campaign = _Campaign(repository, plan, progress, traces)
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
        IntegrityError: A run does not come out as it was recorded.
        PlatformError: The database cannot be written.
    """
    with Repository.open(db, create=False) as repository:
        campaign = _Campaign(repository, plan, progress, "none")
        return campaign.finish((workers, threads), executes=False, replays=replay)


class _Campaign:
    """A campaign from its plan to its summary."""

    def __init__(
        self,
        repository: Repository,
        plan: CampaignPlan,
        progress: Callable[[Progress], None] | None,
        traces: Wanted,
    ) -> None:
        self._repository, self._plan = repository, plan
        self._report = progress or (lambda _: None)
        keep = Keep(traces, folder_of(repository.path))
        self._context = plan.work if traces == "none" else replace(plan.work, keep=keep)

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
        planned = plan.expansion.count
        stored = repository.plan_campaign(
            plan.record(),
            plan.planned(),
            block_size=block_size(plan),
            report=lambda done: self._report(Progress("plan", done, planned, 0)),
        )
        repository.requeue_quarantined(stored.campaign)
        keep = self._context.keep
        traces = None if keep is None else keep.folder
        lanes_of = _Lanes(plan, lanes, None if executor is None else executor.open(plan, traces))
        tasks = _Tasks(repository, plan, stored, self._context, (executes, replays))
        halved, again = Halved(), Rejudged(0, 0, {}, {})
        state = Progress("run", 0, 0, 0)
        try:
            if plan.samples:
                halved = self._halve(lanes_of, tasks.unchanged, stored, executes=executes)
            # Without the uncertainty that was asked for nothing can be judged.
            if not halved.failures:
                again = rejudge(repository, plan, stored.campaign, self._judging)
                if plan.samples:
                    repository.hindsight.half_steps.judge(stored.campaign)
                state = self._work_off(tasks, lanes_of, again, stored)
        except InputError:
            # What cannot be used any more was changed after the plan, in whichever block it shows.
            tasks.unchanged.check()
            raise
        finally:
            lanes_of.close()
            tasks.release()
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
        halves = HalfStepTasks(self._repository, self._plan, fitting(self._plan.examples()))
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
        self, stored: Plan, tasks: _Tasks, halved: Halved, again: Rejudged
    ) -> CampaignSummary:
        """Say what came out, with what went wrong in the message."""
        repository, (_, replays) = self._repository, tasks.allowed
        campaign = repository.find_campaign(stored.campaign)
        now = repository.progress(stored.campaign).executed - stored.reused
        ways = dict(again.ways)
        if self._plan.samples and not halved.failures and stored.to_judge > again.wanted:
            ways[VERDICT] = stored.to_judge - again.wanted
        summary = replace(
            summarise(repository, campaign, self._plan, stored),
            executed=now,
            judged=(again.wanted if replays else again.judged) + ways.get(VERDICT, 0),
            replayed=len(again.left) if replays else 0,
            ways=ways,
            to_replay=0 if replays else len(again.left),
            to_execute=stored.to_execute - now,
            twins=halved.twins,
        )
        notes = [failed_channels(repository, stored.campaign)]
        if halved.failures:
            notes.append(f"nothing is judged without the twins: {_first_line(halved.failures[-1])}")
        if tasks.failures and campaign.work.quarantined:
            last = _first_line(tasks.failures[-1])
            notes.append(f"{campaign.work.quarantined} blocks were given up: {last}")
        if any(notes):
            message = "; ".join((summary.message.rstrip("."), *filter(None, notes)))
            summary = replace(summary, message=message)
        return summary

    def _judging(self, done: int, wanted: int) -> None:
        self._report(Progress("judge", done, wanted, 0))

    def _work_off(self, tasks: _Tasks, lanes: _Lanes, again: Rejudged, stored: Plan) -> Progress:
        executes, replays = tasks.allowed
        to_execute = stored.to_execute
        if self._plan.samples:
            to_execute, _ = self._repository.hindsight.half_steps.count_open(stored.campaign)
        total = to_execute * executes + len(again.left) * replays
        state = Progress("run", 0, total, 0)
        self._report(state)
        for done in lanes.start(tasks):
            state = _absorb(self._repository, tasks, done, state)
            self._report(state)
        return state


class _Lanes:
    """Where blocks are executed."""

    def __init__(
        self,
        plan: CampaignPlan,
        lanes: tuple[int, int],
        executor: Executor[BatchTask, BatchResult] | None,
    ) -> None:
        self._plan = plan
        # Workers elsewhere compile for themselves.
        self._count = max(lanes) if executor is None else 1
        self._executor = executor or _executor(*lanes)

    def start(self, wanted: Iterator[BatchTask]) -> Iterator[Done[BatchTask, BatchResult]]:
        """Execute blocks as they are asked for."""
        if self._count > 1 and not is_cache_warm(*self._plan.compiled_parts):
            # Compiled once here, the kernels are loaded by every worker.
            yield from (Done(task, execute(task)) for task in islice(wanted, 1))
        yield from self._executor.run(wanted)

    def close(self) -> None:
        """End what was started."""
        self._executor.close()


def _first_line(text: str) -> str:
    """An exception of a library may have many lines; the database keeps them all."""
    return text.partition("\n")[0]


def _executor(workers: int, threads: int) -> Executor[BatchTask, BatchResult]:
    if workers > 1:
        return Processes(execute, workers)
    return InProcess(execute) if threads == 1 else Threads(execute, threads)


class _Tasks(Iterator[BatchTask]):
    """Claims blocks as workers ask for them; asked again after its end, it looks again.

    Attributes:
        allowed: Whether what has no result may be executed, and what has one again.
        failures: What adeye itself failed with.
        unchanged: Notices what is changed after the plan.
    """

    def __init__(
        self,
        repository: Repository,
        plan: CampaignPlan,
        stored: Plan,
        context: WorkContext,
        allowed: tuple[bool, bool],
    ) -> None:
        self._repository = repository
        self._context = context
        self._campaign = stored.campaign
        self._cases: Sequence[TestCase] = plan.cases
        self._held: dict[int, Block] = {}
        self._kept: list[Block] = []
        self.allowed = allowed
        self.failures: list[str] = []
        self.unchanged = Unchanged(plan)

    def __next__(self) -> BatchTask:
        executes, replays = self.allowed
        while True:
            block = self._repository.claim_block(lease_s=LEASE_S, campaign=self._campaign)
            if block is None:
                raise StopIteration
            to_execute = block.to_execute if executes else ()
            to_judge = block.to_judge if replays else ()
            if to_execute or to_judge or not block.cases:
                break
            self.keep(block)
        self._held[block.id] = block
        return BatchTask(
            block=block.id,
            execute=tuple(self._cases[item.ordinal] for item in to_execute),
            judge=tuple(
                (self._cases[item.ordinal], item.result_digest, item.missing_fsrs)
                for item in to_judge
            ),
            context=self._context,
        )

    def keep(self, block: Block) -> None:
        """Leave a block that still lacks something, but count what it does not lack."""
        self._repository.again.tally(block)
        self._kept.append(block)

    def take(self, task: BatchTask) -> Block:
        """Return the block behind a task; it is no longer held."""
        return self._held.pop(task.block)

    def release(self) -> None:
        """Give back what was claimed and not completed."""
        for block in (*self._held.values(), *self._kept):
            self._repository.release_block(block)
        self._held.clear()
        self._kept.clear()


def _absorb(
    repository: Repository,
    tasks: _Tasks,
    done: Done[BatchTask, BatchResult],
    state: Progress,
) -> Progress:
    """Save what came back for a block, unless its code is not that of the plan."""
    # Before it is taken: a block whose code is another one is given back.
    tasks.unchanged.check()
    block = tasks.take(done.task)
    if done.result is None or done.result.failure:
        detail = done.lost if done.result is None else done.result.failure
        repository.fail_block(block, detail)
        tasks.failures.append(detail)
        return state
    result = done.result
    if block.to_execute and not tasks.allowed[0]:
        if result.judged is not None:
            repository.again.add(result.judged)
        tasks.keep(replace(block, cases=block.to_execute))
    else:
        repository.complete_block(block, result.runs, result.judged)
    return replace(state, done=state.done + result.done, failures=state.failures + result.failures)
