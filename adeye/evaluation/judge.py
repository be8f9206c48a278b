"""Judge FSRs on recorded runs: one judgement per run and FSR, with its margin and its reason."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from adeye.evaluation.metrics import compute_metrics
from adeye.evaluation.metrics.registry import (
    ERROR,
    INCOMPLETE,
    NO_CONFLICT,
    NOT_APPLICABLE,
    UNDEFINED,
)
from adeye.evaluation.outcome import (
    RunOutcome,
    ended_by_contact,
    invalid_reasons,
    obligation_rows,
    outcome,
)
from adeye.evaluation.source import TraceSignals
from adeye.evaluation.stl.robustness import StlResult, evaluate
from adeye.evaluation.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.evaluation.requirements import Bound, CheckedRequirement
    from adeye.evaluation.stl.binding import BindingPredicate, Value
    from adeye.ports import MetricColumn
    from adeye.signals import Bools
    from adeye.spec.odd import Attributes
    from adeye.trace import Trace


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict of one FSR on one run with its binding predicate.

    Attributes:
        fsr_id: Id of the requirement.
        fsr_digest: Identity of what was judged.
        verdict: What the run means for the FSR; never NOT_RUN.
        is_exercised: Whether the precondition held.
        robustness_low: Lower end of the robustness, None where there is none; may be infinite.
        robustness_high: Upper end.
        margin: Distance to the threshold in ``unit``, negative when violated; None if nothing is
            measured.
        unit: Unit of margin, value and threshold.
        signal: Signal or metric of the binding predicate.
        predicate: Its text.
        time_s: Its time [s].
        actor: Its object, by name.
        value: Its value; a truth value is 0 or 1.
        threshold: Its threshold.
        detail: Why, in words.
    """

    fsr_id: str
    fsr_digest: str
    verdict: Verdict
    is_exercised: bool
    robustness_low: float | None = None
    robustness_high: float | None = None
    margin: float | None = None
    unit: str | None = None
    signal: str | None = None
    predicate: str | None = None
    time_s: float | None = None
    actor: str | None = None
    value: float | None = None
    threshold: float | None = None
    detail: str | None = None


@dataclass(frozen=True)
class Evaluation:
    """What the runs of a trace mean.

    Attributes:
        outcomes: What happened to each run.
        metrics: Metrics of the runs, by column.
        judgements: For each run, the judgements of the FSRs that concern it, in their order.
        not_applicable: FSRs without judgements because the runs lack a signal: why, by id.
    """

    outcomes: tuple[RunOutcome, ...]
    metrics: Mapping[str, MetricColumn]
    judgements: tuple[tuple[Judgement, ...], ...]
    not_applicable: Mapping[str, str]


def evaluate_trace(
    signals: TraceSignals,
    requirements: Sequence[CheckedRequirement],
    uncertainty: Mapping[str, float] = MappingProxyType({}),
) -> Evaluation:
    """Compute the metrics of a trace and judge the FSRs on it.

    Args:
        signals: The runs with what is known about the ODD.
        requirements: FSRs.
        uncertainty: Numeric uncertainty of the margin in its own unit, by FSR id; default 0.
    """
    trace = signals.trace
    metrics = compute_metrics(trace, signals.measured)
    judge = _Judge(signals, metrics, uncertainty)
    rows: list[list[Judgement]] = [[] for _ in range(trace.runs)]
    not_applicable: dict[str, str] = {}
    for item in requirements:
        missing = judge.missing_signals(item)
        if missing:
            reason = f"the runs have no signal {', '.join(missing)}"
            not_applicable[item.requirement.id] = reason
            continue
        for run, judgement in judge.judge(item).items():
            rows[run].append(judgement)
    outcomes = tuple(outcome(trace, run) for run in range(trace.runs))
    return Evaluation(outcomes, metrics, tuple(tuple(row) for row in rows), not_applicable)


def judge(
    trace: Trace,
    requirements: Sequence[CheckedRequirement],
    inside_odd: Bools,
    attributes: Attributes | None = None,
    *,
    faults: Sequence[str] = (),
    uncertainty: Mapping[str, float] = MappingProxyType({}),
) -> Evaluation:
    """Judge the FSRs of a concept on the runs of a trace.

    Args:
        trace: The runs, all of one scenario.
        requirements: FSRs.
        inside_odd: (B,) whether the planned attributes lie inside the ODD.
        attributes: Attributes of the ODD, for leaving it during a run.
        faults: Fault ids of the ODD beside those of the trace.
        uncertainty: Numeric uncertainty of the margin in its own unit, by FSR id; default 0.
    """
    return evaluate_trace(
        TraceSignals(trace, inside_odd, attributes, faults), requirements, uncertainty
    )


class _Judge:
    """What is the same for every FSR on one trace."""

    def __init__(
        self,
        signals: TraceSignals,
        metrics: Mapping[str, MetricColumn],
        uncertainty: Mapping[str, float],
    ) -> None:
        trace = signals.trace
        self._signals = signals
        self._metrics = metrics
        self._uncertainty = uncertainty
        self._invalid = invalid_reasons(trace)
        self._by_contact = ended_by_contact(trace)
        self._obligations = obligation_rows(trace)
        self._objects = trace.layout.context.object_ids

    def missing_signals(self, item: CheckedRequirement) -> list[str]:
        """List the signals of a formula that the runs lack."""
        names = () if item.formula is None else item.formula.names
        return [name for name in names if name not in self._signals.dictionary]

    def judge(self, item: CheckedRequirement) -> dict[int, Judgement]:
        """Judge an FSR on the runs that it concerns, by number of the run."""
        scenario, inside = self._signals.trace.layout.scenario, self._signals.inside_odd
        runs = [
            run
            for run in range(len(self._invalid))
            if item.concerns(scenario, is_inside=bool(inside[run]))
        ]
        result = self._evaluated(item) if runs else None
        judgements: dict[int, Judgement] = {}
        for run in runs:
            empty = Judgement(item.requirement.id, item.digest, Verdict.ERROR, is_exercised=False)
            reason = self._invalid[run]
            if reason is not None:
                judgements[run] = replace(empty, verdict=Verdict.INVALID, detail=reason)
                continue
            if item.bound is not None:
                found = self._by_bound(empty, item.bound, run)
            else:
                found = self._by_formula(empty, result, run)
            judgements[run] = self._settled(found, item, run)
        return judgements

    def _evaluated(self, item: CheckedRequirement) -> StlResult | None:
        if item.formula is None:
            return None
        trace = self._signals.trace
        return evaluate(
            item.formula,
            self._signals,
            step_s=trace.layout.context.step,
            length=trace.length,
            horizon=self._obligations,
            complete=trace.complete,
        )

    def _settled(self, found: Judgement, item: CheckedRequirement, run: int) -> Judgement:
        """Apply the rules about contact and numeric uncertainty."""
        if found.verdict is Verdict.INCONCLUSIVE and self._by_contact[run]:
            fails = item.requirement.on_contact == "fail"
            verdict = Verdict.FAIL if fails else Verdict.INCONCLUSIVE
            return replace(found, verdict=verdict, detail=_joined("ended by contact", found.detail))
        least = self._uncertainty.get(found.fsr_id, 0.0)
        if found.verdict is Verdict.PASS and found.margin is not None and found.margin < least:
            detail = f"margin below the numeric uncertainty of {least:g} {found.unit}"
            return replace(found, verdict=Verdict.INCONCLUSIVE, detail=detail)
        return found

    def _by_formula(self, empty: Judgement, result: StlResult | None, run: int) -> Judgement:
        binding = None if result is None else result.binding(run)
        if result is None or binding is None:
            return replace(empty, detail="a signal has a sample that is not a finite number")
        verdict = result.verdict_of(run)
        detail = None
        if verdict is Verdict.INCONCLUSIVE:
            detail = _OPEN.get(binding.status, "the trace does not decide it")
        elif verdict is Verdict.VACUOUS:
            detail = "the precondition never held"
        return replace(
            empty,
            verdict=verdict,
            is_exercised=not bool(result.vacuous[run]),
            robustness_low=float(result.robustness_low[run]),
            robustness_high=float(result.robustness_high[run]),
            margin=binding.difference,
            unit=binding.unit or None,
            signal=binding.signal,
            predicate=binding.text,
            time_s=binding.time_s,
            actor=self._name(binding.actor),
            value=_number(binding.value),
            threshold=_number(binding.threshold),
            detail=_joined(detail, _words(binding)),
        )

    def _by_bound(self, empty: Judgement, bound: Bound, run: int) -> Judgement:
        metric = bound.metric
        column = self._metrics[metric.column]
        status = column.status[run]
        named = replace(
            empty,
            unit=metric.unit,
            signal=metric.column,
            predicate=bound.text,
            threshold=bound.limit,
            detail=_STATUS_WORDS.get(status),
        )
        if status in {ERROR, NOT_APPLICABLE, UNDEFINED, INCOMPLETE}:
            return self._without_value(named, status, run)
        value = float(column.value[run])
        margin = bound.margin(value, is_free=status == NO_CONFLICT)
        if not math.isfinite(margin):
            return replace(named, detail=_STATUS_WORDS[ERROR])
        robustness = margin / metric.scale
        # A metric that may still get worse leaves a bound open that holds so far.
        is_open = bool(self._by_contact[run]) and not metric.settles and margin >= 0.0
        verdict = Verdict.FAIL if margin < 0.0 else Verdict.PASS
        return replace(
            named,
            verdict=Verdict.INCONCLUSIVE if is_open else verdict,
            is_exercised=True,
            robustness_low=-math.inf if is_open else robustness,
            robustness_high=robustness,
            margin=margin,
            time_s=_finite(float(column.time[run])),
            actor=self._name(int(column.actor[run])),
            value=_finite(value),
        )

    def _without_value(self, named: Judgement, status: str, run: int) -> Judgement:
        if status == ERROR:
            return named
        # What never applied might have, had the contact not ended the run.
        is_vacuous = status == NOT_APPLICABLE and not self._by_contact[run]
        return replace(
            named,
            verdict=Verdict.VACUOUS if is_vacuous else Verdict.INCONCLUSIVE,
            is_exercised=status == INCOMPLETE,
            robustness_low=None if is_vacuous else -math.inf,
            robustness_high=None if is_vacuous else math.inf,
        )

    def _name(self, actor: int | None) -> str | None:
        return self._objects[actor] if actor is not None and actor >= 0 else None


_OPEN = {
    "beyond_trace": "an obligation is open where the trace ends",
    "not_applicable": "a signal does not apply where it would decide",
}
_STATUS_WORDS = {
    ERROR: "the metric has no finite value",
    NO_CONFLICT: "no conflict",
    NOT_APPLICABLE: "the metric does not apply to this run",
    UNDEFINED: "the metric is undefined in this run",
    INCOMPLETE: "the run ended before the metric was complete",
}


def _joined(*parts: str | None) -> str | None:
    return "; ".join(part for part in parts if part) or None


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _number(value: Value) -> float | None:
    return None if isinstance(value, str) or value is None else float(value)


def _words(binding: BindingPredicate) -> str | None:
    """Say what a table of numbers cannot: labels, truth values and "no conflict"."""
    if binding.status == "no_conflict":
        return "no conflict"
    if isinstance(binding.value, bool | str):
        return f"{binding.signal} is {str(binding.value).lower()}"
    return None
