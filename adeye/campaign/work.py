"""The work of one block: run the closed loop, measure, judge, and describe it for the database."""

from __future__ import annotations

import math
import os
import platform
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from adeye.campaign.happenings import events_of
from adeye.campaign.metrics import plugin_of, use_plugin_metrics
from adeye.engine import run as run_batch
from adeye.errors import AdeyeError
from adeye.evaluation.judge import Evaluation, Judgement, evaluate_trace
from adeye.evaluation.requirements import (
    CheckedRequirement,
    compile_requirement,
    requirement_digest,
)
from adeye.evaluation.source import TraceSignals
from adeye.store.rows import EngineKey, MetricValue, RunRecord, VerdictRecord

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from adeye.ports import MetricColumn
    from adeye.spec.concept import Requirement
    from adeye.spec.odd import Attributes
    from adeye.sweep.case import TestCase
    from adeye.trace import Trace


@dataclass(frozen=True)
class WorkContext:
    """What every block of a campaign shares.

    Attributes:
        backend: Traffic implementation.
        engines: Engine by architecture id.
        folders: Folder of the file that names plug-ins, by architecture id.
        requirements: FSRs of the concept; a worker compiles them once.
        faults: Fault ids of the ODD.
        metrics: Entry points of metrics from outside the package.
        odd_folder: Folder of the ODD's file, where those are looked for.
    """

    backend: str
    engines: Mapping[str, EngineKey]
    folders: Mapping[str, Path]
    requirements: tuple[Requirement, ...]
    faults: tuple[str, ...]
    metrics: tuple[str, ...]
    odd_folder: Path


@dataclass(frozen=True)
class BatchTask:
    """A block of test cases of one structure.

    Attributes:
        block: Id of the block.
        execute: Test cases without a result.
        judge: Test cases whose result lacks verdicts: with its digest and the FSRs that it lacks.
        context: What every block shares.
    """

    block: int
    execute: tuple[TestCase, ...]
    judge: tuple[tuple[TestCase, str, tuple[str, ...]], ...]
    context: WorkContext


@dataclass(frozen=True)
class BatchResult:
    """What came out of a block.

    Attributes:
        runs: Results of what was executed.
        verdicts: Missing verdicts, by result digest.
        judged_traces: Trace digests of the runs that were executed only to judge them.
        failure: Why adeye itself could not execute it; empty if it could.
    """

    runs: tuple[RunRecord, ...] = ()
    verdicts: Mapping[str, Sequence[VerdictRecord]] = field(default_factory=dict)
    judged_traces: Mapping[str, str] = field(default_factory=dict)
    failure: str = ""


def execute(task: BatchTask) -> BatchResult:
    """Execute and judge the test cases of a block.

    Args:
        task: The block.

    Returns:
        Its results; if adeye itself fails, which is no evidence about a channel, the reason.

    Raises:
        AdeyeError: What the user asked for cannot be run.
    """
    try:
        return _execute(task)
    except AdeyeError:
        raise
    except Exception as error:  # noqa: BLE001 - recorded with the block, the campaign goes on
        return BatchResult(failure=f"{type(error).__name__}: {error}")


def _execute(task: BatchTask) -> BatchResult:
    cases = [*task.execute, *(case for case, _, _ in task.judge)]
    if not cases:
        return BatchResult()
    use_plugin_metrics(task.context.metrics, task.context.odd_folder)
    trace = run_batch(cases, backend=task.context.backend, base_dirs=task.context.folders)
    evaluation = evaluate(trace, cases, task.context.requirements, task.context.faults)
    runs = tuple(
        describe(trace, run, evaluation, task.context.engines[case.architecture.architecture])
        for run, case in enumerate(task.execute)
    )
    verdicts: dict[str, list[VerdictRecord]] = {}
    judged: dict[str, str] = {}
    for place, (_, digest, missing) in enumerate(task.judge, start=len(task.execute)):
        records = [_verdict(item) for item in evaluation.judgements[place]]
        verdicts[digest] = [record for record in records if record.fsr_id in missing]
        judged[digest] = trace.digests()[place]
    return BatchResult(runs, verdicts, judged)


def evaluate(
    trace: Trace,
    cases: Sequence[TestCase],
    requirements: Sequence[Requirement],
    faults: Sequence[str],
) -> Evaluation:
    """Measure and judge the runs of a trace."""
    compiled = [_compiled(item, cases[0].attributes) for item in requirements]
    return evaluate_trace(signals_of(trace, cases, faults), compiled)


_COMPILED: dict[str, CheckedRequirement] = {}


def _compiled(requirement: Requirement, attributes: Attributes) -> CheckedRequirement:
    key = requirement_digest(requirement, attributes) + requirement.model_dump_json()
    if key not in _COMPILED:
        _COMPILED[key] = compile_requirement(requirement, attributes=attributes)
    return _COMPILED[key]


def signals_of(trace: Trace, cases: Sequence[TestCase], faults: Sequence[str]) -> TraceSignals:
    """Return the signals of a trace by name."""
    inside = np.array([case.inside_odd for case in cases], dtype=np.bool_)
    return TraceSignals(trace, inside, cases[0].attributes, faults=faults)


def describe(trace: Trace, run: int, evaluation: Evaluation, key: EngineKey) -> RunRecord:
    """Describe one run for the database.

    Args:
        trace: The batch that it is in.
        run: Its row in the batch.
        evaluation: Of the batch.
        key: Engine that executed it.
    """
    happened = evaluation.outcomes[run]
    rows = int(trace.length[run])
    return RunRecord(
        test_case=trace.case_digests[run],
        engine=key,
        outcome=happened.outcome,
        trace_rows=rows,
        duration_s=float(trace.time[rows - 1]),
        trace_digest=trace.digests()[run],
        is_realised=happened.is_realised,
        end_reason=happened.end_reason,
        metrics={
            name: _metric(trace, column, run)
            for name, column in evaluation.metrics.items()
            if plugin_of(name) is None
        },
        verdicts=[_verdict(item) for item in evaluation.judgements[run]],
        events=events_of(trace, run),
        outcome_channel=happened.channel,
        outcome_detail=happened.detail,
        executed_by=f"{platform.node()}:{os.getpid()}",
        executed_at=datetime.now(UTC),
        plugin_metrics=_plugin_metrics(trace, run, evaluation),
    )


def _plugin_metrics(
    trace: Trace, run: int, evaluation: Evaluation
) -> dict[str, dict[str, MetricValue]]:
    found: dict[str, dict[str, MetricValue]] = {}
    for name, column in evaluation.metrics.items():
        plugin = plugin_of(name)
        if plugin is not None:
            found.setdefault(plugin, {})[name] = _metric(trace, column, run)
    return found


def _metric(trace: Trace, column: MetricColumn, run: int) -> MetricValue:
    status = column.status[run]
    time, actor = float(column.time[run]), int(column.actor[run])
    return MetricValue(
        value=float(column.value[run]) if status == "value" else None,
        status=status,
        time_s=time if math.isfinite(time) else None,
        actor=trace.layout.context.object_ids[actor] if actor >= 0 else None,
    )


def _verdict(item: Judgement) -> VerdictRecord:
    return VerdictRecord(
        fsr_id=item.fsr_id,
        fsr_digest=item.fsr_digest,
        verdict=item.verdict,
        is_exercised=item.is_exercised,
        robustness_low=item.robustness_low,
        robustness_high=item.robustness_high,
        margin=item.margin,
        unit=item.unit,
        signal=item.signal,
        predicate=item.predicate,
        time_s=item.time_s,
        actor=item.actor,
        value=item.value,
        threshold=item.threshold,
        detail=item.detail,
    )
