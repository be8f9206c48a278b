"""Execute a campaign: plan first, then block by block what is missing, into the database."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING

from adeye.campaign.executors import Done, InProcess, Processes, Threads
from adeye.campaign.halving import HalfStepTasks, Halved
from adeye.campaign.unchanged import Unchanged
from adeye.campaign.work import BatchResult, BatchTask, execute
from adeye.channels.factory import PROCESS
from adeye.channels.process import MOST_PROGRAMS
from adeye.errors import InputError
from adeye.kernel.jit import is_cache_warm
from adeye.recorder import trace_bytes
from adeye.sensors.lidar import sample_bytes
from adeye.store.repository import Repository
from adeye.store.totals import gate_code, totals

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.campaign.plan import CampaignPlan
    from adeye.evaluation.verdict import ExitCode, Verdict
    from adeye.spec.architecture import Architecture
    from adeye.store.stored import Block, CampaignInfo, Plan
    from adeye.sweep.case import TestCase

SMALLEST_BLOCK, LARGEST_BLOCK = 16, 1_024
BLOCKS = 16
"""Blocks that a plan is cut into, if they become neither too small nor too large."""
TRACE_MEMORY = 192 * 2**20
"""Memory for the traces of one block [bytes]: two of them at once leave room below one gigabyte."""
LEASE_S = 600.0


_Parallel = Processes[BatchTask, BatchResult] | Threads[BatchTask, BatchResult]


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is.

    Attributes:
        phase: ``plan``, ``half step`` where the ODD asks for it, ``run`` or ``done``.
        done: Test cases planned, then those executed or judged.
        total: Test cases to plan, then those to execute or judge.
        failures: Runs with a FAIL or ERROR so far.
    """

    phase: str
    done: int
    total: int
    failures: int


@dataclass(frozen=True, slots=True)
class VerdictLine:
    """The verdict of one FSR for one architecture.

    Attributes:
        architecture: Id.
        is_gate: Whether the architecture decides the exit code.
        fsr: Id.
        asil: ASIL of the FSR.
        mandatory: Whether the gate needs it.
        verdict: Folded over all runs; None where the FSR is not applicable.
        exercised: Runs in which its precondition held.
        runs: Runs planned.
        margin: Of the worst run, in ``unit``.
        unit: Of the margin.
        worst_run: Result digest of the worst run.
        text: Text of the requirement.
    """

    architecture: str
    is_gate: bool
    fsr: str
    asil: str
    mandatory: bool
    verdict: Verdict | None
    exercised: int
    runs: int
    margin: float | None
    unit: str
    worst_run: str
    text: str


@dataclass(frozen=True, slots=True)
class CampaignSummary:
    """What came out of a campaign.

    Attributes:
        campaign: Its id.
        planned: Test cases.
        executed: Executed now.
        judged: Judged again now, on results that existed.
        reused: Results that existed.
        exit_code: Of the gate.
        message: Why.
        verdicts: One line per FSR and architecture.
        twins: Twins with half the step that were executed now.
    """

    campaign: str
    planned: int
    executed: int
    judged: int
    reused: int
    exit_code: ExitCode
    message: str
    verdicts: tuple[VerdictLine, ...]
    twins: int = 0


def run_campaign(
    plan: CampaignPlan,
    *,
    db: str | Path | None = None,
    workers: int = 1,
    threads: int = 1,
    progress: Callable[[Progress], None] | None = None,
) -> CampaignSummary:
    """Execute what a plan lacks in the database, and judge it.

    The plan is committed before the first run. Whatever dies, the next call goes on where the
    database ends; a finished campaign executes nothing.

    Args:
        plan: A checked plan.
        db: Database, by default ``.adeye/adeye.db``.
        workers: Processes; 1 runs here.
        threads: Threads over blocks, in this process; only where there is one process.
        progress: Called after each block, and now and then while a large plan is saved.

    Raises:
        IntegrityError: A result contradicts one that exists, or a plug-in was changed meanwhile.
        PlatformError: The database cannot be written.
    """
    report = progress or (lambda _: None)
    with Repository.open(db) as repository:
        planned = plan.expansion.count
        stored = repository.plan_campaign(
            plan.record(),
            plan.planned(),
            block_size=block_size(plan),
            report=lambda done: report(Progress("plan", done, planned, 0)),
        )
        repository.requeue_quarantined(stored.campaign)
        executor = _executor(workers, threads)

        def start(wanted: Iterator[BatchTask]) -> Iterator[Done[BatchTask, BatchResult]]:
            if max(workers, threads) > 1 and not is_cache_warm(*plan.compiled_parts):
                # Compiled once here, the kernels are loaded by every worker.
                yield from (Done(task, execute(task)) for task in islice(wanted, 1))
            yield from executor.run(wanted)

        tasks = _Tasks(repository, plan, stored)
        halved = Halved()
        state = Progress("run", 0, stored.to_execute + stored.to_judge, 0)
        try:
            if plan.samples:
                halved = _halve(repository, plan, stored, start, tasks.unchanged, report)
                state = replace(
                    state, total=sum(repository.hindsight.half_steps.count_open(stored.campaign))
                )
            # Without the uncertainty that was asked for nothing can be judged.
            if not halved.failures:
                report(state)
                for done in start(tasks):
                    state = _absorb(repository, tasks, done, state)
                    report(state)
        except InputError:
            # What cannot be used any more was changed after the plan, in whichever block it shows.
            tasks.unchanged.check()
            raise
        finally:
            executor.close()
            tasks.release()
        report(replace(state, phase="done"))
        return _summary(repository, plan, stored, tasks.failures, halved)


def _summary(
    repository: Repository,
    plan: CampaignPlan,
    stored: Plan,
    failures: Sequence[str],
    halved: Halved,
) -> CampaignSummary:
    """Say what came out, with what went wrong in the message."""
    campaign = repository.find_campaign(stored.campaign)
    now = repository.progress(stored.campaign).executed - stored.reused
    summary = summarise(repository, campaign, plan, stored)
    notes = [failed_channels(repository, stored.campaign)]
    if halved.failures:
        notes.append(f"nothing is judged without the twins: {_first_line(halved.failures[-1])}")
    if failures and campaign.work.quarantined:
        last = _first_line(failures[-1])
        notes.append(f"{campaign.work.quarantined} blocks were given up: {last}")
    if any(notes):
        message = "; ".join((summary.message.rstrip("."), *filter(None, notes)))
        summary = replace(summary, message=message)
    return replace(summary, executed=now, twins=halved.twins)


def _first_line(text: str) -> str:
    """An exception of a library may have many lines; the database keeps them all."""
    return text.partition("\n")[0]


def _halve(
    repository: Repository,
    plan: CampaignPlan,
    stored: Plan,
    start: Callable[[Iterator[BatchTask]], Iterator[Done[BatchTask, BatchResult]]],
    unchanged: Unchanged,
    report: Callable[[Progress], None],
) -> Halved:
    """Find the numeric uncertainty unless it is known, and judge with it what is there."""
    half_steps = repository.hindsight.half_steps
    found = Halved()
    if not half_steps.uncertainty(stored.campaign):
        halves = HalfStepTasks(repository, plan, _fitting(plan.examples()))
        report(Progress("half step", 0, halves.total, 0))
        for done in start(halves):
            unchanged.check()
            halves.absorb(done)
            report(Progress("half step", halves.done, halves.total, 0))
        found = Halved(halves.twins, tuple(halves.failures))
        if found.failures:
            return found
        half_steps.save_uncertainty(stored.campaign, halves.found())
        half_steps.judge(stored.campaign)
    elif stored.to_judge:
        half_steps.judge(stored.campaign)
    return found


def block_size(plan: CampaignPlan) -> int:
    """Choose how many test cases a block has at most.

    A small plan has small blocks, so that a kill costs little and every worker has something to
    do; a large one has large blocks, over which compiled code and inserts cost least, as far as
    their traces and the returns of their lidars fit into memory.
    """
    return _block_size(plan.expansion.count, _fitting(plan.examples()))


def _fitting(examples: Sequence[TestCase]) -> int:
    """Count the runs that fit into memory together, and whose programs may run at once."""
    largest = max(trace_bytes(case) + sample_bytes(case.architecture) for case in examples)
    fitting = TRACE_MEMORY // largest
    programs = max(_programs(case.architecture) for case in examples)
    return min(fitting, max(1, MOST_PROGRAMS // programs)) if programs else fitting


def _programs(architecture: Architecture) -> int:
    """Count the channels that have a program of their own in each run."""
    return sum(channel.kind == PROCESS for channel in architecture.channels.values())


def _block_size(planned: int, fitting: int) -> int:
    """Choose the size for some planned test cases of which some fit into memory together.

    >>> [_block_size(planned, 2_000) for planned in (28, 1_000, 8_000, 65_536, 1_000_000)]
    [16, 62, 500, 1024, 1024]
    >>> _block_size(1_000_000, 640)
    640
    """
    wanted = min(max(planned // BLOCKS, SMALLEST_BLOCK), LARGEST_BLOCK)
    return max(1, min(wanted, fitting))


def _executor(workers: int, threads: int) -> InProcess[BatchTask, BatchResult] | _Parallel:
    if workers > 1:
        return Processes(execute, workers)
    return InProcess(execute) if threads == 1 else Threads(execute, threads)


class _Tasks(Iterator[BatchTask]):
    """Claims blocks as workers ask for them; asked again after its end, it looks again."""

    def __init__(self, repository: Repository, plan: CampaignPlan, stored: Plan) -> None:
        self._repository = repository
        self._plan = plan
        self._campaign = stored.campaign
        self._cases: Sequence[TestCase] = plan.cases
        self._held: dict[int, Block] = {}
        self.failures: list[str] = []
        self.unchanged = Unchanged(plan)

    def __next__(self) -> BatchTask:
        block = self._repository.claim_block(lease_s=LEASE_S, campaign=self._campaign)
        if block is None:
            raise StopIteration
        self._held[block.id] = block
        return BatchTask(
            block=block.id,
            execute=tuple(self._cases[item.ordinal] for item in block.to_execute),
            judge=tuple(
                (self._cases[item.ordinal], item.result_digest, item.missing_fsrs)
                for item in block.to_judge
            ),
            context=self._plan.work,
        )

    def take(self, task: BatchTask) -> Block:
        """Return the block behind a task; it is no longer held."""
        return self._held.pop(task.block)

    def release(self) -> None:
        """Give back what was claimed and not completed."""
        for block in self._held.values():
            self._repository.release_block(block)
        self._held.clear()


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
    repository.complete_block(block, result.runs, result.judged)
    return replace(state, done=state.done + result.done, failures=state.failures + result.failures)


def failed_channels(repository: Repository, campaign: str) -> str:
    """Say in how many runs which channel failed; empty if none did.

    A mastered failure of a channel can PASS, but it never goes unmentioned.

    Args:
        repository: The database.
        campaign: Id of the campaign.
    """
    return "; ".join(
        f"{outcome} of channel {channel} in {count:,} runs of {architecture}"
        for architecture, channel, outcome, count in repository.failed_channels(campaign)
    )


def summarise(
    repository: Repository, campaign: CampaignInfo, plan: CampaignPlan, stored: Plan
) -> CampaignSummary:
    """Read what a campaign came to from the database."""
    code, message = gate_code(repository, campaign)
    texts = {item.id: item.text.strip() for item in plan.files.concept.spec.requirements}
    lines = [
        VerdictLine(
            architecture=item.architecture,
            is_gate=item.is_in_gate,
            fsr=item.fsr,
            asil=item.asil,
            mandatory=item.is_mandatory,
            verdict=item.verdict,
            exercised=item.exercised,
            runs=item.runs,
            margin=item.worst[1].margin if item.worst else None,
            unit=(item.worst[1].unit or "") if item.worst else "",
            worst_run=item.worst[0].result_digest if item.worst else "",
            text=texts[item.fsr],
        )
        for item in totals(repository, campaign)
    ]
    return CampaignSummary(
        campaign=campaign.id,
        planned=stored.planned,
        executed=repository.progress(campaign.id).executed - stored.reused,
        judged=stored.to_judge,
        reused=stored.reused,
        exit_code=code,
        message=message,
        verdicts=tuple(lines),
    )
