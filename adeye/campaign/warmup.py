"""Compile what a plan needs before it is needed: one test case of each structure, nothing kept."""

from __future__ import annotations

import gc
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from adeye.campaign.executors import Processes
from adeye.campaign.run import Progress
from adeye.campaign.work import BatchTask, compiled_parts, evaluate, execute
from adeye.errors import PlatformError
from adeye.judge.metrics import METRICS, compute_metrics
from adeye.judge.stl.table import Reading, judge_table, table_of
from adeye.kernel.jit import mark_cache_warm
from adeye.kernel.relation import tick_times
from adeye.simulate.world.clock import ticks

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.campaign.plan import CampaignPlan
    from adeye.sweep.case import TestCase
    from adeye.trace import Trace

Part: TypeAlias = "tuple[Callable[[Any], object], BatchTask | None]"
"""A function and what it is called with, in a process that compiles."""
_MOST_ASIDE: Final = 4


def warm_up(plan: CampaignPlan, progress: Callable[[Progress], None] | None = None) -> None:
    """Execute and judge one test case of each structure of a plan, and throw the results away.

    Args:
        plan: A checked plan.
        progress: Called before each structure.

    Raises:
        PlatformError: A test case could not be executed.
    """
    examples = plan.examples()
    for number, case in enumerate(examples):
        if progress is not None:
            progress(Progress("compile", number, len(examples), 0))
        result = execute(BatchTask(0, (case,), (), plan.work))
        if result.failure:
            raise PlatformError(
                f"{case.scenario_id} with {case.architecture.architecture}: {result.failure}"
            )


def begin_aside(processors: int) -> Processes[Part, bool]:
    """Begin to compile what every plan needs, in one process; others get ready.

    Args:
        processors: For how many processes there are processors; of more than four, some would wait.
    """
    count = min(processors, _MOST_ASIDE)
    processes = Processes(_compile_part, count)
    processes.begin(_EVALUATING)
    for _ in range(1, count):
        processes.begin((_get_ready, None))
    return processes


def compile_meanwhile(plan: CampaignPlan, processes: Processes[Part, bool]) -> None:
    """Begin with what needs a plan; wait for the evaluation of formulas, which it needs itself.

    Args:
        plan: A plan whose formulas are not searched yet.
        processes: Those that have begun.
    """
    first = BatchTask(0, (_covering(plan)[0],), (), plan.work)
    processes.begin((_drive, first))
    processes.finish(_EVALUATING)
    processes.begin((_measure, first))


def compile_aside(plan: CampaignPlan, processes: Processes[Part, bool]) -> bool:
    """Compile most of what a plan needs in processes that have a processor each.

    The compiler uses one processor, and memory that it never gives back. One process executes a
    test case, another computes the metrics of one in which nothing moves, then judges it. Who is
    free executes and judges the others. What this process needs it loads afterwards; if something
    fails aside, it fails here again, where it is reported.

    Args:
        plan: A checked plan.
        processes: Those that have begun.

    Returns:
        Whether all came to their end.
    """
    first, *others = (BatchTask(0, (case,), (), plan.work) for case in _covering(plan))
    parts: list[Part] = [(_judge, first), *((execute, other) for other in others)]
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


def _compile_part(part: Part) -> bool:
    # Collecting the compiler's cyclic rubbish takes longer than its memory is worth here.
    gc.disable()
    function, task = part
    try:
        function(task)
    except Exception:  # noqa: BLE001 - the caller meets it again and reports it
        return False
    return True


def _get_ready(_nothing: None) -> None:
    """Do nothing; what is imported for it is what takes time."""


def _evaluate(_nothing: None) -> None:
    """Evaluate a formula."""
    judge_table("always(v > 0)", table_of({"time": [0, 1], "v": [1, 1]}), Reading())


_EVALUATING: Final[Part] = (_evaluate, None)


def _drive(task: BatchTask) -> None:
    """Execute the test case of a task."""
    task.context.drive(task.execute)


def _judge(task: BatchTask) -> None:
    """Judge the test case of a task by its first scene."""
    evaluate(_standing(task), task.execute, task.context.requirements, task.context.faults)


def _measure(task: BatchTask) -> None:
    """Compute the built-in metrics of the first scene, the last one first."""
    compute_metrics(_standing(task), metrics=dict(reversed(METRICS.items())))


def _standing(task: BatchTask) -> Trace:
    """Return the first scene of the test case of a task as if it lasted until the horizon."""
    (case,) = task.execute
    first = task.context.drive((case,), most_ticks=0)
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
    return trace
