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
from adeye.judge.stl.table import Reading, judge_table, table_of
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

    The compiler uses one processor, and memory that it never gives back. One process executes a
    test case, the other evaluates a formula and then judges a test case in which nothing moves;
    the first to be free executes and judges the others. What this process needs it loads
    afterwards; if something fails aside, it fails here again, where it is reported.

    Args:
        plan: A checked plan.

    Returns:
        Whether all came to their end.
    """
    first, *others = (BatchTask(0, (case,), (), plan.work) for case in _covering(plan))
    processes = Processes(_compile_part, 2)
    parts: list[tuple[Callable[[BatchTask], object], BatchTask]]
    parts = [(_drive, first), (_evaluate, first), (_judge, first)]
    parts += [(execute, other) for other in others]
    ended = [done.result is True for done in processes.run(iter(parts))]
    if all(ended):
        mark_cache_warm(*plan.compiled_parts)
    return all(ended)


def _covering(plan: CampaignPlan) -> list[TestCase]:
    """Choose test cases of every compiled part, with faults and without, most parts first."""
    used = [
        ({*compiled_parts(case.architecture, plan.work), bool(case.faults)}, case)
        for case in plan.examples()
    ]
    used.sort(key=lambda item: -len(item[0]))
    chosen, known = [], set[object]()
    for needed, case in used:
        if not needed <= known:
            chosen.append(case)
            known |= needed
    return chosen


def _compile_part(part: tuple[Callable[[BatchTask], object], BatchTask]) -> bool:
    # Collecting the compiler's cyclic rubbish takes longer than its memory is worth here.
    gc.disable()
    function, task = part
    try:
        function(task)
    except Exception:  # noqa: BLE001 - the caller meets it again and reports it
        return False
    return True


def _drive(task: BatchTask) -> None:
    """Execute the test case of a task."""
    task.context.drive(task.execute)


def _evaluate(_task: BatchTask) -> None:
    """Evaluate a formula."""
    judge_table("always(v > 0)", table_of({"time": [0, 1], "v": [1, 1]}), Reading())


def _judge(task: BatchTask) -> None:
    """Judge the first scene of the test case of a task as if it lasted until the horizon."""
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
