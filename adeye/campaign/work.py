"""The work of one block: run the closed loop, measure, judge, and describe it for the database."""

from __future__ import annotations

import json
import math
import os
import platform
import threading
from collections import defaultdict
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from adeye.campaign import debugger
from adeye.campaign.events import happenings
from adeye.campaign.parts import plugin_of, use_plugin_metrics
from adeye.campaign.traces import Keep, keep_traces
from adeye.errors import AdeyeError, PlatformError, PluginError
from adeye.judge.evaluate import Evaluation, JudgementColumns, evaluate_trace
from adeye.judge.extremes import EXTREME, SAMPLES, Extremes
from adeye.judge.metrics import METRICS
from adeye.judge.metrics.registry import status_codes
from adeye.judge.outcome import END_REASONS
from adeye.judge.requirements import JUDGE_VERSION, compile_requirement, requirement_digest
from adeye.judge.trace_signals import TraceSignals
from adeye.kernel.jit import is_cache_warm, mark_cache_warm
from adeye.kernel.relation import tick_times
from adeye.plugin_code import settings_kept
from adeye.simulate.engine import run as run_batch
from adeye.simulate.recorder import Memory
from adeye.spec.channels import Channel, OutsideChannel, RemoteChannel, SafetyChannel
from adeye.spec.sensors import model_name
from adeye.store.block import (
    BasisBlock,
    ExtremeBlock,
    JudgedBlock,
    MetricBlock,
    PluginBlock,
    RunBlock,
    VerdictBlock,
)
from adeye.store.encoding import Dictionary, Texts
from adeye.store.records import RAISED
from adeye.store.tables import METRIC_IDS
from adeye.supervision import is_asked

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.judge.requirements import CheckedRequirement
    from adeye.judge.uncertainty import NumericUncertainty
    from adeye.simulate.channels.pace import Pace
    from adeye.spec.architecture import Architecture
    from adeye.spec.concept import Requirement
    from adeye.spec.odd import Attributes
    from adeye.store.records import EngineKey
    from adeye.sweep.case import TestCase
    from adeye.trace import Trace

T = TypeVar("T")

# --- Between what judging finds in traces and what the database keeps of it to judge again --------


def basis_block(evaluation: Evaluation, files: Sequence[tuple[str, int] | None] = ()) -> BasisBlock:
    """Describe what judging the runs of a batch again depends on.

    Args:
        evaluation: Of the batch.
        files: Where its traces are kept; empty for nowhere.
    """
    frame = evaluation.frame
    parts = list(evaluation.extremes.items())
    counts = [len(item.run) for _, item in parts]
    own = [extremes_of((), {}), *(item for _, item in parts)]
    run, row, value, actor = (
        np.concatenate([getattr(item, name) for item in own])
        for name in ("run", "row", "value", "actor")
    )
    names = Dictionary((*frame.objects, None))
    return BasisBlock(
        version=JUDGE_VERSION,
        uids={name: METRICS[name].uid for name in evaluation.metrics},
        by_contact=frame.by_contact,
        invalid=Texts.of(frame.invalid),
        extremes=ExtremeBlock(
            run=run,
            measure=Texts(
                np.repeat(np.arange(len(parts)), counts), Dictionary([name for name, _ in parts])
            ),
            value=value[:, EXTREME].astype(np.float64),
            time_s=np.where(
                row[:, EXTREME] >= 0, tick_times(row[:, EXTREME], frame.step_s), np.nan
            ),
            actor=Texts(actor[:, EXTREME], names),
            samples=Texts.of(
                [text for _, item in parts for text in _samples_texts(item, frame.objects)]
            ),
        ),
        files=tuple(files),
    )


def _samples_texts(found: Extremes, objects: Sequence[str]) -> list[str]:
    """Write the samples of each run as JSON: row, status, value and actor of each, and the end."""
    texts: list[str] = []
    columns = (found.row, found.status, found.value, found.actor)
    for rows, statuses, values, actors, is_cut in zip(
        *(column.tolist() for column in columns), found.is_cut.tolist(), strict=True
    ):
        samples = [
            None
            if row < 0
            else [
                row,
                status,
                None if math.isnan(value) else value,
                objects[actor] if actor >= 0 else None,
            ]
            for row, status, value, actor in zip(rows, statuses, values, actors, strict=True)
        ]
        texts.append(json.dumps([samples, is_cut], ensure_ascii=False, separators=(",", ":")))
    return texts


def extremes_of(stored: Sequence[Any], objects: dict[str, int]) -> Extremes:
    """Read the samples of runs.

    Args:
        stored: Of each run, as parsed JSON.
        objects: Numbers of objects by name; unknown names are added.
    """
    row = np.full((len(stored), SAMPLES), -1, dtype=np.int64)
    status = np.zeros((len(stored), SAMPLES), dtype=np.int64)
    value = np.full((len(stored), SAMPLES), np.nan)
    actor = np.full((len(stored), SAMPLES), -1, dtype=np.int64)
    for run, (samples, _) in enumerate(stored):
        for place, sample in enumerate(samples):
            if sample is None:
                continue
            row[run, place], status[run, place] = sample[0], sample[1]
            if sample[2] is not None:
                value[run, place] = sample[2]
            if sample[3] is not None:
                actor[run, place] = objects.setdefault(sample[3], len(objects))
    return Extremes(
        run=np.arange(len(stored)),
        row=row,
        value=value,
        status=status,
        actor=actor,
        is_cut=np.array([item[1] for item in stored], dtype=np.bool_),
    )


# --- What is looked at together -------------------------------------------------------------------


def grouped(items: Iterable[T], key: Callable[[T], object], most: int) -> Iterator[list[T]]:
    """Group what has the same key, in groups of a size at most."""
    groups: dict[object, list[T]] = defaultdict(list)
    for item in items:
        groups[key(item)].append(item)
    for group in groups.values():
        for first in range(0, len(group), most):
            yield group[first : first + most]


# --- The work of one block: run the closed loop, measure, judge, and describe it for the database -

SEEN: Final = "first_detection_distance_m"
"""Metric whose object is the one that matters when it is seen."""


@dataclass(frozen=True)
class WorkContext:
    """What every block of a campaign shares.

    Attributes:
        backend: Traffic implementation.
        variant: Its arithmetic; None if this version has another in its place.
        engines: Engine by architecture id.
        folders: Folder of the file that names plug-ins, by architecture id.
        requirements: FSRs of the concept; a worker compiles them once.
        faults: Fault ids of the ODD.
        metrics: Entry points of metrics from outside the package.
        odd_folder: Folder of the ODD's file, where those are looked for.
        keep: Which traces are kept; None for none.
        pace: Of the ticks, where that is not as fast as they go.
    """

    backend: str
    variant: str | None
    engines: Mapping[str, EngineKey]
    folders: Mapping[str, Path]
    requirements: tuple[Requirement, ...]
    faults: tuple[str, ...]
    metrics: tuple[str, ...]
    odd_folder: Path
    keep: Keep | None = None
    pace: Pace | None = None

    def drive(self, cases: Sequence[TestCase], **how: Any) -> Trace:
        """Execute test cases of one structure, see ``simulate.engine.run``."""
        with debugger.executing():
            return run_batch(
                cases,
                backend=self.backend,
                variant=self.variant,
                base_dirs=self.folders,
                pace=self.pace,
                **how,
            )


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
        runs: Results of what was executed; None if nothing was.
        judged: Missing verdicts, with the traces of the runs that were executed only for them.
        failure: Why adeye itself could not execute it; empty if it could.
    """

    runs: RunBlock | None = None
    judged: JudgedBlock | None = None
    failure: str = ""

    @property
    def done(self) -> int:
        """Number of runs that were executed or judged."""
        executed = 0 if self.runs is None else len(self.runs)
        return executed + (0 if self.judged is None else len(self.judged.result_digests))

    @property
    def failures(self) -> int:
        """Number of runs with a FAIL or an ERROR."""
        parts = (self.runs, self.judged)
        return sum(part.verdicts.failures for part in parts if part is not None)


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
        with debugger.executing():
            done = _execute(task)
    except PluginError as error:
        return BatchResult(failure=f"{RAISED}{error}")
    except BaseException as error:
        if isinstance(error, AdeyeError) or is_asked(error):
            raise
        return BatchResult(failure=f"{type(error).__name__}: {error}")
    if task.execute:
        parts = compiled_parts(task.execute[0].architecture, task.context)
        if not is_cache_warm(*parts):
            mark_cache_warm(*parts)
    return done


def compiled_parts(architecture: Architecture, context: WorkContext) -> frozenset[str]:
    """Name what is compiled for an architecture and not for every one.

    Args:
        architecture: Whose sensors and channels are meant.
        context: Tells the traffic and its arithmetic.
    """
    sensors = {f"sensor-{model_name(sensor)}" for sensor in architecture.sensors.values()}
    channels = {f"channel-{_variant(channel)}" for channel in architecture.channels.values()}
    traffic = f"traffic-{context.backend}-{context.variant}"
    # What is not built in is not compiled here.
    return frozenset(name for name in sensors | channels | {traffic} if ":" not in name)


def _variant(channel: Channel) -> str:
    """Name a kind of channel, with what of it is compiled apart."""
    if not isinstance(channel, SafetyChannel):
        return channel.kind
    if channel.parameters.supervisor is not None:
        return "safety-supervised"
    return "safety-planned" if channel.stop == "planned" else "safety"


def _execute(task: BatchTask) -> BatchResult:
    cases = [*task.execute, *(case for case, _, _ in task.judge)]
    if not cases:
        return BatchResult()
    context = task.context
    _require_usual_arithmetic()
    with settings_kept():
        use_plugin_metrics(context.metrics, context.odd_folder)
        trace = context.drive(cases, memory=_memory())
        evaluation = evaluate(trace, cases, context.requirements, context.faults)
    _require_usual_arithmetic()
    engines = [context.engines[case.architecture.architecture] for case in cases]
    files = keep_traces(trace, evaluation, context.keep)
    everything = describe(trace, evaluation, engines, files, paced=context.pace is not None)
    executed = len(task.execute)
    runs = everything.take(np.arange(executed)) if executed else None
    return BatchResult(runs, _judged(task, everything) if task.judge else None)


def _require_usual_arithmetic() -> None:
    """Refuse to compute where this thread does not round to nearest, or flushes small numbers.

    Code from outside can set it (``fesetround``): every bit would be another.

    Raises:
        PlatformError: It does not.
    """
    half, least = math.ldexp(1.0, -53), math.ldexp(1.0, -1022)
    is_nearest = 1.0 + half == 1.0 and -1.0 - half == -1.0 and 1.0 + 1.5 * half != 1.0
    if not is_nearest or 0.5 * least == 0.0:
        raise PlatformError(
            "this process does not round to nearest, or flushes small numbers to zero. What "
            "executes blocks, or a library, has set that: take fesetround or the like out of it."
        )


def has_clock(architecture: Architecture, *, paced: bool) -> bool:
    """Tell whether the answers of a channel may hang on a machine that nothing here knows.

    What is at an address has clocks and a computer of its own; whoever asks for a pace has channels
    in mind that look at the clock, which any code from outside the package may do.

    Args:
        architecture: With the channels.
        paced: Whether a pace was asked for.
    """
    channels = architecture.channels.values()
    return any(isinstance(item, OutsideChannel if paced else RemoteChannel) for item in channels)


_LOCAL = threading.local()


def _memory() -> Memory:
    """Give the memory of this thread's traces: one lives until its block has been described."""
    if not hasattr(_LOCAL, "memory"):
        _LOCAL.memory = Memory()
    memory: Memory = _LOCAL.memory
    return memory


def _judged(task: BatchTask, everything: RunBlock) -> JudgedBlock:
    """Keep the verdicts that the judged results lack."""
    executed = len(task.execute)
    verdicts = everything.verdicts
    wanted = [frozenset(missing) for _, _, missing in task.judge]
    names = verdicts.fsr_id.values()
    chosen = [
        place
        for place, run in enumerate(verdicts.run.tolist())
        if run >= executed and names[place] in wanted[run - executed]
    ]
    kept = verdicts.take(np.array(chosen, dtype=np.int64))
    return JudgedBlock(
        tuple(digest for _, digest, _ in task.judge),
        replace(kept, run=kept.run - executed),
        everything.trace_digests[executed:],
        everything.basis and everything.basis.take(np.arange(executed, len(everything))),
    )


def evaluate(
    trace: Trace,
    cases: Sequence[TestCase],
    requirements: Sequence[Requirement],
    faults: Sequence[str],
    uncertainty: Mapping[str, NumericUncertainty] = MappingProxyType({}),
) -> Evaluation:
    """Measure and judge the runs of a trace.

    Args:
        trace: The batch.
        cases: Its test cases.
        requirements: FSRs.
        faults: Fault ids of the ODD.
        uncertainty: Numeric uncertainty by FSR; a block is judged without, see
            ``store.write.half_steps``.
    """
    compiled = [_compiled(item, cases[0].attributes) for item in requirements]
    return evaluate_trace(signals_of(trace, cases, faults), compiled, uncertainty)


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


def describe(
    trace: Trace,
    evaluation: Evaluation,
    engines: Sequence[EngineKey],
    files: Sequence[tuple[str, int] | None] = (),
    *,
    paced: bool = False,
) -> RunBlock:
    """Describe the runs of a batch for the database.

    Args:
        trace: The batch.
        evaluation: Of the batch.
        engines: B engines that executed them.
        files: Where their traces are kept; empty for nowhere.
        paced: Whether they were executed at a pace.
    """
    happened = evaluation.happened
    different = tuple(dict.fromkeys(engines))
    codes = {engine: code for code, engine in enumerate(different)}
    runs = range(trace.runs)
    rows = np.asarray(trace.length, dtype=np.int64)
    plugins: dict[str, list[str]] = {}
    for name in evaluation.metrics:
        plugin = plugin_of(name)
        if plugin is not None:
            plugins.setdefault(plugin, []).append(name)
    return RunBlock(
        test_cases=trace.case_digests,
        engines=different,
        engine=np.array([codes[engine] for engine in engines], dtype=np.int64),
        outcome=happened.code,
        outcome_channel=Texts.of([happened.channels.get(run) for run in runs]),
        outcome_detail=Texts.of([happened.details.get(run) for run in runs]),
        trace_rows=rows,
        duration_s=trace.time[rows - 1],
        trace_digests=tuple(trace.digests()),
        realised=happened.realised,
        end_reason=Texts(happened.end_reason, Dictionary(END_REASONS)),
        machine_dependent=np.array(
            [
                has_clock(architecture, paced=paced)
                or (event is not None and event.is_machine_dependent)
                for architecture, event in zip(
                    trace.layout.architectures, trace.channel_events, strict=True
                )
            ],
            dtype=np.bool_,
        ),
        metrics=_metrics(trace, evaluation, METRIC_IDS),
        verdicts=verdict_block(evaluation.judged),
        events=happenings(trace, np.asarray(evaluation.metrics[SEEN].actor, dtype=np.int64)),
        executed_by=Texts.same(f"{platform.node()}:{os.getpid()}", trace.runs),
        executed_at=(datetime.now(UTC),) * trace.runs,
        plugin_metrics=tuple(
            PluginBlock(plugin, np.arange(trace.runs), _metrics(trace, evaluation, sorted(names)))
            for plugin, names in sorted(plugins.items())
        ),
        chains=tuple("".join(chain[:-1]) for chain in trace.chains()),
        basis=basis_block(evaluation, files),
    )


def _metrics(trace: Trace, evaluation: Evaluation, ids: Sequence[str]) -> MetricBlock:
    columns = [evaluation.metrics[name] for name in ids]
    times = np.stack([column.time for column in columns], axis=1)
    status = np.stack([status_codes(column.status) for column in columns], axis=1).astype(np.int64)
    value = np.stack([column.value for column in columns], axis=1)
    return MetricBlock(
        tuple(ids),
        np.where(status == 0, value, np.nan),
        status,
        np.where(np.isfinite(times), times, np.nan),
        np.array([column.actor for column in columns], dtype=np.int64).T,
        Dictionary((*trace.layout.context.object_ids, None)),
    )


def verdict_block(judged: Sequence[JudgementColumns]) -> VerdictBlock:
    """Join the columns of the FSRs, run by run."""
    if not judged:
        return VerdictBlock.of(())
    run = np.concatenate([item.runs for item in judged])
    order = np.argsort(run, kind="stable")
    fsr = np.repeat(np.arange(len(judged)), [len(item.runs) for item in judged])[order]

    def joined(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.generic]]:
        return np.concatenate([getattr(item, name) for item in judged])[order]

    def texts(code: str, words: Sequence[Sequence[str | None]]) -> Texts:
        """Join columns of codes, each with a dictionary of its own."""
        sizes = np.cumsum([0, *(len(item) for item in words)])
        codes = [getattr(item, code) + sizes[place] for place, item in enumerate(judged)]
        everything = [word for item in words for word in item]
        return Texts(np.concatenate(codes)[order], Dictionary(everything))

    def of_binding(place: int) -> Texts:
        return texts("binding", [[words[place] for words in item.bindings] for item in judged])

    return VerdictBlock(
        run=run[order],
        fsr_id=Texts(fsr, Dictionary([item.fsr_id for item in judged])),
        fsr_digest=Texts(fsr, Dictionary([item.fsr_digest for item in judged], is_clean=True)),
        verdict=joined("verdict").astype(np.int8),
        exercised=joined("exercised").astype(np.bool_),
        numbers=joined("numbers").astype(np.float64),
        unit=of_binding(0),
        signal=of_binding(1),
        predicate=of_binding(2),
        actor=Texts(joined("actor").astype(np.int64), Dictionary((*judged[0].objects, None))),
        detail=texts("detail", [item.details for item in judged]),
    )
