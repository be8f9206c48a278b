"""Judge FSRs on recorded runs: one judgement per run and FSR, with its margin and its reason."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import IntegrityError
from adeye.evaluation.extremes import Extremes, find_extremes, measure_of
from adeye.evaluation.extremes import joined as joined_extremes
from adeye.evaluation.judgement import Judgement, JudgementColumns
from adeye.evaluation.metrics import METRICS, MetricDefinition, compute_metrics
from adeye.evaluation.metrics.registry import joined
from adeye.evaluation.outcome import (
    OutcomeColumns,
    RunOutcome,
    ended_by_contact,
    invalid_reasons,
    obligation_rows,
    outcomes,
)
from adeye.evaluation.rulings import Frame
from adeye.evaluation.source import TraceSignals
from adeye.evaluation.stl.columns import StlColumns, evaluate_columns
from adeye.evaluation.stl.columns import joined as joined_formulas

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from adeye.evaluation.requirements import CheckedRequirement
    from adeye.evaluation.uncertainty import NumericUncertainty
    from adeye.ports import MetricColumn
    from adeye.signals import Bools
    from adeye.spec.odd import Attributes
    from adeye.trace import Trace

__all__ = ["Evaluation", "Judgement", "evaluate_trace", "judge"]

PART_RUNS: Final = 256
"""Runs that are measured together: what is calculated of them stays in the processor's cache."""


@dataclass(frozen=True)
class Evaluation:
    """What the runs of a trace mean.

    Attributes:
        happened: What happened to the runs, as columns.
        metrics: Metrics of the runs, by column.
        judged: Verdicts of the FSRs that can be judged, in their order, as columns.
        not_applicable: FSRs without judgements because the runs lack a signal: why, by id.
        frame: What is the same for every FSR.
        extremes: Samples that decide formulas of one comparison, by what decides; of the runs on
            which an FSR can be judged.
    """

    happened: OutcomeColumns
    metrics: Mapping[str, MetricColumn]
    judged: tuple[JudgementColumns, ...]
    not_applicable: Mapping[str, str]
    frame: Frame
    extremes: Mapping[str, Extremes]

    @cached_property
    def outcomes(self) -> tuple[RunOutcome, ...]:
        """What happened to each run, as records."""
        return tuple(self.happened.run(run) for run in range(len(self.happened.code)))

    @cached_property
    def judgements(self) -> tuple[tuple[Judgement, ...], ...]:
        """For each run, the judgements of the FSRs that concern it, in their order, as records."""
        rows = (
            (columns.of_run(run) for columns in self.judged)
            for run in range(len(self.happened.code))
        )
        return tuple(tuple(item for item in row if item is not None) for row in rows)


def evaluate_trace(
    signals: TraceSignals,
    requirements: Sequence[CheckedRequirement],
    uncertainty: Mapping[str, NumericUncertainty] = MappingProxyType({}),
    metrics: Mapping[str, MetricDefinition] = METRICS,
) -> Evaluation:
    """Compute the metrics of a trace and judge the FSRs on it.

    Metrics from outside the package come last, when all is judged and hashed that does not hang on
    them; each is shown a copy.

    Args:
        signals: The runs with what is known about the ODD.
        requirements: FSRs.
        uncertainty: Numeric uncertainty of the margins, by FSR id; default none.
        metrics: Which are computed; those of the bounds must be among them.

    Raises:
        IntegrityError: After a metric from outside the package the trace is another one.
    """
    trace = signals.trace
    frame = _frame(signals)
    not_applicable: dict[str, str] = {}
    concerned: list[tuple[CheckedRequirement, Bools]] = []
    for item in requirements:
        names = () if item.formula is None else item.formula.names
        missing = [name for name in names if name not in signals.dictionary]
        if missing:
            reason = f"the runs have no signal {', '.join(missing)}"
            not_applicable[item.requirement.id] = reason
        else:
            concerned.append((item, _concerned(item, signals)))
    formulas = [(item, runs & ~frame.is_invalid) for item, runs in concerned if item.formula]
    outside = {name: metric for name, metric in metrics.items() if metric.plugin}
    own = {name: metric for name, metric in metrics.items() if not metric.plugin}
    measured, evaluated, extremes = _measured(signals, formulas, ~frame.is_invalid, own)
    happened = outcomes(trace)
    judged: dict[int, JudgementColumns] = {}

    def judge_all_but(unmeasured: Collection[str]) -> None:
        """Judge the FSRs that are left, but for bounds on metrics that are not measured yet."""
        for place, (item, runs) in enumerate(concerned):
            waits = item.bound is not None and item.bound.column in unmeasured
            if place not in judged and not waits and runs.any():
                found = evaluated.get(item.requirement.id)
                least = uncertainty.get(item.requirement.id)
                judged[place] = frame.judge(item, np.flatnonzero(runs), found, measured, least)

    judge_all_but(outside)
    if outside:
        measured |= _measured_outside(signals, outside)
        judge_all_but(())
    columns = tuple(judged[place] for place in sorted(judged))
    return Evaluation(happened, measured, columns, not_applicable, frame, extremes)


def _measured_outside(
    signals: TraceSignals, metrics: Mapping[str, MetricDefinition]
) -> dict[str, MetricColumn]:
    """Compute the metrics from outside the package, with nothing left that they could move."""
    trace = signals.trace
    before = tuple(trace.digests())
    measured: dict[str, MetricColumn] = {}
    for name, metric in metrics.items():
        alone = {name: metric}
        parts = [compute_metrics(part.trace, None, alone)[name] for _, part in _parts(signals)]
        measured[name] = joined(parts)
        if not trace.still_has(before):
            raise IntegrityError(
                f"metric plug-in {metric.plugin} ({name}) altered the trace that is judged. "
                "Nothing of the block is kept; a metric reads, correct it or leave it out."
            )
    return measured


def _parts(signals: TraceSignals) -> Iterator[tuple[slice, TraceSignals]]:
    """Cut the runs into what is measured together."""
    runs = signals.trace.runs
    for first in range(0, runs, PART_RUNS):
        chosen = slice(first, min(first + PART_RUNS, runs))
        yield chosen, signals if runs <= PART_RUNS else signals.part(chosen.start, chosen.stop)


def _frame(signals: TraceSignals) -> Frame:
    trace = signals.trace
    context = trace.layout.context
    return Frame(
        step_s=context.step,
        objects=context.object_ids,
        by_contact=ended_by_contact(trace),
        invalid=invalid_reasons(trace),
    )


def _concerned(item: CheckedRequirement, signals: TraceSignals) -> Bools:
    """Tell which runs (B,) an FSR is judged on."""
    scenario = signals.trace.layout.scenario
    inside, outside = (item.concerns(scenario, is_inside=place) for place in (True, False))
    return np.where(signals.inside_odd, inside, outside)


def _measured(
    signals: TraceSignals,
    formulas: Sequence[tuple[CheckedRequirement, Bools]],
    valid: Bools,
    definitions: Mapping[str, MetricDefinition],
) -> tuple[dict[str, MetricColumn], dict[str, StlColumns], dict[str, Extremes]]:
    """Compute metrics, formulas and what decides them part by part, and join the parts."""
    metrics: list[dict[str, MetricColumn]] = []
    evaluated: dict[str, list[StlColumns]] = {item.requirement.id: [] for item, _ in formulas}
    measures = {measure_of(item.formula) for item, _ in formulas} - {None}
    extremes: dict[str, list[Extremes]] = {}
    horizon = obligation_rows(signals.trace)
    for chosen, part in _parts(signals):
        trace = part.trace
        metrics.append(compute_metrics(trace, part.measured, definitions))
        for item, wanted in formulas:
            if item.formula is not None and wanted.any():
                evaluated[item.requirement.id].append(
                    evaluate_columns(
                        item.formula,
                        part,
                        step_s=trace.layout.context.step,
                        length=trace.length,
                        horizon=horizon[chosen],
                        complete=trace.complete,
                        chosen=wanted[chosen],
                    )
                )
        for measure in measures:
            assert measure is not None
            found = find_extremes(
                measure,
                part.series(measure.signal),
                length=trace.length,
                horizon=horizon[chosen],
                complete=trace.complete,
                chosen=valid[chosen],
            )
            extremes.setdefault(measure.text, []).append(
                replace(found, run=found.run + chosen.start)
            )
    whole = {name: joined([part[name] for part in metrics]) for name in metrics[0]}
    return (
        whole,
        {name: joined_formulas(parts) for name, parts in evaluated.items() if parts},
        {name: joined_extremes(extremes[name]) for name in sorted(extremes)},
    )


def judge(
    trace: Trace,
    requirements: Sequence[CheckedRequirement],
    inside_odd: Bools,
    attributes: Attributes | None = None,
    *,
    faults: Sequence[str] = (),
    uncertainty: Mapping[str, NumericUncertainty] = MappingProxyType({}),
) -> Evaluation:
    """Judge the FSRs of a concept on the runs of a trace.

    Args:
        trace: The runs, all of one scenario.
        requirements: FSRs.
        inside_odd: (B,) whether the planned attributes lie inside the ODD.
        attributes: Attributes of the ODD, for leaving it during a run.
        faults: Fault ids of the ODD beside those of the trace.
        uncertainty: Numeric uncertainty of the margins, by FSR id; default none.
    """
    return evaluate_trace(
        TraceSignals(trace, inside_odd, attributes, faults), requirements, uncertainty
    )
