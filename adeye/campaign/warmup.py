"""Compile what a plan needs before it is needed: one test case of each structure, nothing kept."""

from __future__ import annotations

import gc
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.campaign.executors import Processes
from adeye.campaign.run import Progress
from adeye.campaign.work import BatchTask, compiled_parts, evaluate, execute
from adeye.errors import PlatformError
from adeye.kernel.jit import is_cache_warm, mark_cache_warm
from adeye.kernel.relation import tick_times
from adeye.spec.clock import ticks

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.campaign.plan import CampaignPlan
    from adeye.sweep.case import TestCase


def warm_up(
    plan: CampaignPlan,
    progress: Callable[[Progress], None] | None = None,
    *,
    aside: bool = False,
) -> float:
    """Execute and judge one test case of each structure of a plan, and throw the results away.

    Args:
        plan: A checked plan.
        progress: Called before each structure.
        aside: Whether to compile most of it in processes of their own first.

    Returns:
        How long it took [s].

    Raises:
        PlatformError: A test case could not be executed.
    """
    began = time.monotonic()
    examples = plan.examples()
    if aside and not is_cache_warm(*plan.compiled_parts):
        if progress is not None:
            progress(Progress("compile", 0, len(examples), 0))
        compile_aside(plan)
    for number, case in enumerate(examples):
        if progress is not None:
            progress(Progress("compile", number, len(examples), 0))
        result = execute(BatchTask(0, (case,), (), plan.work))
        if result.failure:
            raise PlatformError(
                f"{case.scenario_id} with {case.architecture.architecture}: {result.failure}"
            )
    return time.monotonic() - began


def compile_aside(plan: CampaignPlan) -> bool:
    """Compile most of what a plan needs in two processes, each on a processor of its own.

    The compiler uses one processor, and memory that it never gives back. One process executes test
    cases, the other judges one in which nothing moves. What this process needs it loads
    afterwards; if something fails aside, it fails here again, where it is reported.

    Args:
        plan: A checked plan.

    Returns:
        Whether both came to their end.
    """
    task = BatchTask(0, tuple(_covering(plan)), (), plan.work)
    processes = Processes(_compile_part, 2)
    parts = ((_drive, task), (_judge, task))
    ended = [done.result is True for done in processes.run(iter(parts))]
    if all(ended):
        mark_cache_warm(*plan.compiled_parts)
    return all(ended)


def _covering(plan: CampaignPlan) -> list[TestCase]:
    """Choose test cases in which every compiled part is used, those with the most parts first."""
    parts = {case.architecture.architecture: case for case in reversed(plan.examples())}
    used = [(compiled_parts(case.architecture, plan.work), case) for case in parts.values()]
    used.sort(key=lambda item: (-len(item[0]), item[1].architecture.architecture))
    chosen, known = [], frozenset[str]()
    for names, case in used:
        if not names <= known:
            chosen.append(case)
            known |= names
    return chosen


def _compile_part(part: tuple[Callable[[BatchTask], None], BatchTask]) -> bool:
    # Collecting the compiler's cyclic rubbish takes longer than its memory is worth here.
    gc.disable()
    function, task = part
    try:
        function(task)
    except Exception:  # noqa: BLE001 - the caller meets it again and reports it
        return False
    return True


def _drive(task: BatchTask) -> None:
    """Execute the test cases of a task."""
    for case in task.execute:
        task.context.drive((case,))


def _judge(task: BatchTask) -> None:
    """Judge the first scene of the first test case of a task as if it lasted until the horizon."""
    work, case = task.context, task.execute[0]
    first = work.drive((case,), most_ticks=0)
    rows = ticks(case.scenario.horizon, case.step, "horizon") + 1
    columns: dict[str, Any] = {
        name: np.repeat(column, rows, axis=1) for name, column in first.columns.items()
    }
    # What is not realised is not judged.
    columns["begun"][:] = 0.0
    trace = replace(
        first,
        time=tick_times(np.arange(rows), case.step),
        length=np.full(1, rows),
        horizon_row=np.full(1, rows - 1),
        complete=np.ones(1, dtype=np.bool_),
        columns=columns,
    )
    trace.digests()
    evaluate(trace, (case,), work.requirements, work.faults)
