"""Execute a campaign: plan first, then block by block what is missing, into the database."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from numbers import Integral
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.blocks import block_size, fitting
from adeye.campaign.executors import Done, InProcess, Processes, Threads
from adeye.campaign.halving import HalfStepTasks, Halved
from adeye.campaign.heartbeat import renewing
from adeye.campaign.keeping import Keep
from adeye.campaign.rejudging import VERDICT, Rejudged, rejudge
from adeye.campaign.session import Session
from adeye.campaign.summary import CampaignSummary, summarise
from adeye.campaign.tasks import LEASE_S, Tasks
from adeye.campaign.work import BatchResult, BatchTask, execute
from adeye.errors import ASKED_TO_END, InputError, UsageError
from adeye.evaluation.verdict import ExitCode, exit_code
from adeye.kernel.jit import is_cache_warm
from adeye.notices import notice
from adeye.store.kept_files import folder_of
from adeye.store.repository import Repository
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from adeye.campaign.executor_names import NamedExecutor
    from adeye.campaign.keeping import Wanted
    from adeye.campaign.plan import CampaignPlan
    from adeye.campaign.unchanged import Unchanged
    from adeye.ports import Executor
    from adeye.store.stored import Plan

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
        IntegrityError: A result contradicts one that exists, or a plug-in was changed meanwhile.
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
        IntegrityError: A run does not come out as it was recorded.
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
        planned, size = plan.expansion.count, block_size(plan)
        record = plan.record()
        stored = repository.plan_campaign(
            record,
            plan.planned(),
            block_size=size,
            report=lambda done: self._report(Progress("plan", done, planned, 0)),
        )
        if stored.is_new or stored.to_execute or stored.to_judge:
            repository.evidence.add_session(stored.campaign, record.provenance)
        repository.queue.requeue_quarantined(stored.campaign)
        chosen = self._session.choice.ordinals(repository.queue, stored, size)
        keep = self._context.keep
        traces = None if keep is None else keep.folder
        elsewhere = None if executor is None else executor.open(plan, traces)
        lanes_of = _Lanes(plan, lanes, self._session, elsewhere)
        tasks = Tasks(repository, plan, stored, (executes, replays), self._session)
        tasks.use(self._context)
        tasks.choose(chosen, stored, size)
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
        self, stored: Plan, tasks: Tasks, halved: Halved, again: Rejudged
    ) -> CampaignSummary:
        """Say what came out, with what went wrong in the message."""
        repository, (_, replays) = self._repository, tasks.allowed
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

    def _judging(self, done: int, wanted: int) -> None:
        self._report(Progress("judge", done, wanted, 0))

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
        with self._executing(tasks):
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

    @contextmanager
    def _executing(self, tasks: Tasks) -> Iterator[None]:
        """Keep the leases of what is executed, and leave it in peace when somebody asks to end."""
        with (
            self._session.stop.deferred(),
            renewing(self._repository, tasks.held, LEASE_S),
        ):
            yield


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
                getattr(self._executor, "drop_waiting", _nothing)()

    def close(self) -> None:
        """End what was started."""
        self._executor.close()

    def abandon(self) -> None:
        """Let go of what is being executed; what cannot be ended is not waited for."""
        getattr(self._executor, "abandon", self._executor.close)()


def _nothing() -> None:
    """Leave it to an executor that cannot."""


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
