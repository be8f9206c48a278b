"""Judge FSRs on recorded runs: one judgement per run and FSR, with its margin and its reason."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import IntegrityError
from adeye.judge import outcome
from adeye.judge.extremes import Extremes, find_extremes, measure_of
from adeye.judge.metrics import METRICS, MetricDefinition, compute_metrics
from adeye.judge.metrics import registry as statuses
from adeye.judge.metrics.registry import CODES as _CODES
from adeye.judge.metrics.registry import joined, status_codes
from adeye.judge.stl.batch import (
    HELD,
    NEEDED,
    SPARE,
    StlColumns,
    evaluate_columns,
    joined_columns,
)
from adeye.judge.stl.counterexample import NO_OBJECT, Runs, asks_nothing, missing_from
from adeye.judge.stl.descent import BINDING_STATUSES
from adeye.judge.stl.program import KIND, WORD
from adeye.judge.trace_signals import TraceSignals
from adeye.judge.uncertainty import is_uncertain, uncertain_detail
from adeye.judge.verdict import (
    ERROR,
    FAIL,
    INCONCLUSIVE,
    INVALID,
    PASS,
    STATUSES,
    VACUOUS,
    VERDICTS,
    Judgement,
)
from adeye.kernel.relation import tick_times

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from adeye.judge.requirements import Bound, CheckedRequirement
    from adeye.judge.stl.formula import Formula
    from adeye.judge.stl.program import Words
    from adeye.judge.uncertainty import NumericUncertainty
    from adeye.ports import MetricColumn
    from adeye.signals import Bools, Floats, Ints

# --- The verdicts of one FSR on a batch of runs, as columns ------------

LOW, HIGH, MARGIN, TIME, VALUE, THRESHOLD = range(6)
"""Columns of ``JudgementColumns.numbers``."""

Binding = tuple[str | None, str | None, str | None]
"""Unit, signal and predicate."""


@dataclass(frozen=True, slots=True)
class JudgementColumns:
    """The verdicts of one FSR on the runs that it concerns.

    Attributes:
        fsr_id: Id of the requirement.
        fsr_digest: Identity of what was judged.
        runs: (R,) rows of the trace, ascending.
        verdict: (R,) index into ``VERDICTS``.
        exercised: (R,) whether the precondition held.
        numbers: (R, 6) see ``LOW`` and its neighbours; NaN for none.
        actor: (R,) index of the object, -1 for none.
        binding: (R,) index into ``bindings``.
        bindings: Unit, signal and predicate.
        detail: (R,) index into ``details``.
        details: Why, in words.
        objects: Names of the objects.
    """

    fsr_id: str
    fsr_digest: str
    runs: Ints
    verdict: Ints
    exercised: Bools
    numbers: Floats
    actor: Ints
    binding: Ints
    bindings: tuple[Binding, ...]
    detail: Ints
    details: tuple[str | None, ...]
    objects: tuple[str, ...]

    def of_run(self, run: int) -> Judgement | None:
        """Give the verdict on a run; None if the FSR does not concern it."""
        place = int(np.searchsorted(self.runs, run))
        if place == len(self.runs) or self.runs[place] != run:
            return None
        unit, signal, predicate = self.bindings[self.binding[place]]
        low, high, margin, time_s, value, threshold = (
            None if math.isnan(number) else number for number in self.numbers[place].tolist()
        )
        actor = int(self.actor[place])
        return Judgement(
            self.fsr_id,
            self.fsr_digest,
            VERDICTS[self.verdict[place]],
            bool(self.exercised[place]),
            robustness_low=low,
            robustness_high=high,
            margin=margin,
            unit=unit,
            signal=signal,
            predicate=predicate,
            time_s=time_s,
            actor=self.objects[actor] if actor >= 0 else None,
            value=value,
            threshold=threshold,
            detail=self.details[self.detail[place]],
        )


# --- From a formula or a metric to the verdicts of its FSR on many runs, with margin and reason ---

_OPEN: Final = {
    "beyond_trace": "an obligation is open where the trace ends",
    "not_applicable": "a signal does not apply where it would decide",
}
_STATUS_WORDS: Final = {
    statuses.ERROR: "the metric has no finite value that it may have",
    statuses.NO_CONFLICT: "no conflict",
    statuses.NOT_APPLICABLE: "the metric does not apply to this run",
    statuses.UNDEFINED: "the metric is undefined in this run",
    statuses.INCOMPLETE: "the run ended before the metric was complete",
}
_NO_CONFLICT, _NOT_APPLICABLE, _BEYOND, _BEFORE = (
    BINDING_STATUSES.index(word)
    for word in ("no_conflict", "not_applicable", "beyond_trace", "before_trace")
)
_KINDS: Final = len(BINDING_STATUSES)
_AS_FOUND, _BY_CONTACT, _UNCERTAIN = range(3)
"""What the rules about contact and numeric uncertainty did to a verdict."""


@dataclass(frozen=True, slots=True)
class _Ruling:
    """Verdicts on R runs before the rules about contact and uncertainty.

    Attributes:
        verdict: (R,) index into ``judgement.VERDICTS``.
        exercised: (R,).
        numbers: (R, 6), see ``judgement``.
        actor: (R,).
        binding: (R,) index into ``bindings``.
        bindings: Unit, signal and predicate.
        reason: (R,) what the detail depends on.
        explain: Gives the detail for such a reason.
    """

    verdict: Ints
    exercised: Bools
    numbers: Floats
    actor: Ints
    binding: Ints
    bindings: tuple[Binding, ...]
    reason: Ints
    explain: Callable[[int], str | None]


@dataclass(frozen=True, slots=True)
class Frame:
    """What is the same for every FSR on one trace.

    Attributes:
        step_s: Time between rows [s].
        objects: Names of the objects.
        by_contact: (B,) whether a contact ended the run.
        invalid: B reasons why FSRs cannot be judged, None where they can; see
            ``outcome.invalid_reasons`` for those that spare what fails.
        missing: Objects, if there are none, and faults that are not injected, by the signal that
            depends on them: what only these decide tests nothing.
        like: What the runs are like; None where nobody asks what is missing.
    """

    step_s: float
    objects: tuple[str, ...]
    by_contact: Bools
    invalid: tuple[str | None, ...]
    missing: Mapping[str, str] = field(default_factory=dict)
    like: Runs | None = None

    @property
    def is_invalid(self) -> Bools:
        """(B,) whether no FSR can be judged."""
        return np.array([outcome.bars(reason) for reason in self.invalid], dtype=np.bool_)

    def judge(
        self,
        item: CheckedRequirement,
        runs: Ints,
        evaluated: StlColumns | None,
        metrics: Mapping[str, MetricColumn],
        uncertainty: NumericUncertainty | None,
    ) -> JudgementColumns:
        """Judge an FSR on the runs that it concerns.

        Args:
            item: The FSR.
            runs: (R,) rows of the trace.
            evaluated: Its formula on the trace; None for a bound.
            metrics: Metrics of the trace.
            uncertainty: Numeric uncertainty of its margins; None for none.
        """
        if item.bound is not None:
            found = self._by_bound(item.bound, metrics[item.bound.column], runs)
        elif evaluated is not None:
            found = self._by_formula(evaluated, runs, item.formula)
        else:
            # Every run is invalid, so that nothing was evaluated.
            found = _nothing(len(runs))
        units = [binding[0] for binding in found.bindings]
        least = np.zeros(len(units)) if uncertainty is None else uncertainty.of(units)
        digest = item.digest if uncertainty is None else uncertainty.digest
        requirement = item.requirement
        return self._columns(found, runs, least, requirement.id, digest, requirement.on_contact)

    def judge_formula(self, evaluated: StlColumns, name: str) -> JudgementColumns:
        """Judge a formula that belongs to no FSR, on all runs.

        Args:
            evaluated: The formula on the runs.
            name: What stands in the place of the FSR's id.
        """
        runs = np.arange(len(evaluated.verdict))
        found = self._by_formula(evaluated, runs)
        least = np.zeros(len(found.bindings))
        return self._columns(found, runs, least, name, "", "inconclusive")

    def _columns(
        self,
        found: _Ruling,
        runs: Ints,
        least: Floats,
        fsr_id: str,
        fsr_digest: str,
        fails: str,
    ) -> JudgementColumns:
        verdict, override = self._settled(found, runs, least, fails=fails)
        # Invalid runs have reasons of their own, in front of the others.
        own = sorted({reason for run in runs if (reason := self.invalid[run]) is not None})
        keys = (found.reason * len(found.bindings) + found.binding) * 3 + override
        place = {reason: number for number, reason in enumerate(own)}
        chosen = np.array([place.get(self.invalid[run] or "", -1) for run in runs])
        stands = ~self.is_invalid[runs] & np.isin(verdict, (FAIL, ERROR))
        chosen = np.where(stands, -1, chosen)
        unique, detail = np.unique(keys, return_inverse=True)
        details = [self._detail(found, int(key), least) for key in unique]
        judged = JudgementColumns(
            fsr_id=fsr_id,
            fsr_digest=fsr_digest,
            runs=runs,
            verdict=verdict,
            exercised=found.exercised,
            numbers=found.numbers,
            actor=found.actor,
            binding=found.binding,
            bindings=found.bindings,
            detail=np.where(chosen >= 0, chosen, detail + len(own)),
            details=(*own, *details),
            objects=self.objects,
        )
        return _without_invalid(judged, chosen >= 0) if own else judged

    def _settled(
        self, found: _Ruling, runs: Ints, least: Floats, *, fails: str
    ) -> tuple[Ints, Ints]:
        """Apply the rules about contact and numeric uncertainty."""
        is_open = (found.verdict == INCONCLUSIVE) & self.by_contact[runs]
        is_small = is_uncertain(
            found.verdict == PASS, found.numbers[:, MARGIN], least[found.binding]
        )
        verdict = np.where(is_small, INCONCLUSIVE, found.verdict)
        if fails == "fail":
            verdict = np.where(is_open, FAIL, verdict)
        override = np.select([is_open, is_small], [_BY_CONTACT, _UNCERTAIN], _AS_FOUND)
        return verdict, override

    @staticmethod
    def _detail(found: _Ruling, key: int, least: Floats) -> str | None:
        rest, override = divmod(key, 3)
        reason, binding = divmod(rest, len(found.bindings))
        if override == _UNCERTAIN:
            return uncertain_detail(float(least[binding]), found.bindings[binding][0])
        detail = found.explain(reason)
        return _and("ended by contact", detail) if override == _BY_CONTACT else detail

    def _by_formula(
        self, result: StlColumns, runs: Ints, formula: Formula | None = None
    ) -> _Ruling:
        words = result.program.words
        node, status, error = result.node[runs], result.status[runs], result.error[runs]
        # What only holds because no row lies as far back as it looks was asked of nothing.
        is_unasked = (status == _BEFORE) & (result.verdict[runs] > 0)
        is_vacuous = result.vacuous[runs] | is_unasked
        is_idle = (result.verdict[runs] > 0) & ~is_vacuous
        lacking = None
        if formula and self.like and is_idle.any():
            lacking = asks_nothing(formula, self.like, self.missing)
        is_idle &= lacking is not None
        is_vacuous |= is_idle
        satisfied = np.where(is_vacuous, VACUOUS, PASS)
        decided = np.array([INCONCLUSIVE, 0, FAIL])[result.verdict[runs]]
        verdict = np.where(result.verdict[runs] > 0, satisfied, decided)
        verdict = np.where(error, ERROR, verdict)
        kinds = result.program.tables.nodes[:, KIND]
        row = result.row[runs]
        numbers = np.stack(
            [
                result.robustness_low[runs],
                result.robustness_high[runs],
                result.difference[runs],
                np.where(row >= 0, tick_times(row, self.step_s), np.nan),
                _shown(result.value[runs], node, [item.is_value_shown for item in words]),
                _shown(result.threshold[runs], node, [item.is_threshold_shown for item in words]),
            ],
            axis=1,
        )
        # What was never asked for was not met by any distance.
        numbers[verdict == VACUOUS, MARGIN] = np.nan
        # The last binding is that of an error: none.
        binding = np.where(error, _KINDS * len(words), _KINDS * node + status)
        bindings = tuple(_binding(item, code) for item in words for code in range(_KINDS))
        # A word is part of the reason; where a sample does not apply there is none.
        code = np.where((kinds[node] == WORD) & (status == 0), result.value[runs] + 1.0, 0.0)
        widest = 1 + max((len(item.values) for item in words), default=0)
        patterns, pattern = _patterns(result.nested[runs])
        reason = (
            verdict * (_KINDS * len(words)) + _KINDS * node + status
        ) * widest + np.nan_to_num(code).astype(np.int64)
        reason = (reason * len(patterns) + pattern) * 2 + is_idle

        def explain(key: int) -> str | None:
            key, lacks = divmod(key, 2)
            if lacks:
                return lacking
            key, which = divmod(key, len(patterns))
            rest, word = divmod(key, widest)
            kind, place = divmod(rest, _KINDS * len(words))
            said = _reason(kind, words[place // _KINDS], place % _KINDS, word)
            return _and(said, never_held(patterns[which].tolist()))

        return _Ruling(
            verdict,
            ~is_vacuous & ~error,
            np.where(error[:, np.newaxis], np.nan, numbers),
            np.where(error, -1, result.actor[runs]),
            binding,
            (*bindings, (None, None, None)),
            reason,
            explain,
        )

    def _by_bound(self, bound: Bound, column: MetricColumn, runs: Ints) -> _Ruling:
        metric = bound.metric
        status = status_codes(column.status)[runs]
        if NO_OBJECT in self.missing.values() and metric.of_objects:
            error = _CODES[statuses.ERROR]
            status = np.where(status == error, error, _CODES[statuses.NOT_APPLICABLE])
        is_free = status == _CODES[statuses.NO_CONFLICT]
        value = np.asarray(column.value, dtype=np.float64)[runs]
        # The worst so far can only get worse, which a bound on the other side would call better.
        is_so_far = (status == _CODES[statuses.INCOMPLETE]) & np.isfinite(value)
        is_so_far &= bound.is_lower is (metric.worse == "lower")
        has_value = is_free | (status == _CODES[statuses.VALUE]) | is_so_far
        is_finite = is_free | np.isfinite(value)
        margin, is_free = bound.margins(value, is_free)
        is_error = (status == _CODES[statuses.ERROR]) | (
            has_value & ~(is_finite & np.isfinite(margin))
        )
        status = np.where(has_value & is_free, _CODES[statuses.NO_CONFLICT], status)
        has_value &= ~is_error
        by_contact = self.by_contact[runs]
        is_open = ((by_contact & (not metric.settles)) | is_so_far) & (margin >= 0.0)
        status = np.where(is_so_far & ~is_open, _CODES[statuses.VALUE], status)
        # What never applied might have, had the contact not ended the run.
        is_vacuous = (status == _CODES[statuses.NOT_APPLICABLE]) & ~by_contact
        verdict = np.select(
            [is_error, has_value & is_open, has_value & (margin < 0.0), has_value, is_vacuous],
            [ERROR, INCONCLUSIVE, FAIL, PASS, VACUOUS],
            INCONCLUSIVE,
        )
        is_unbounded = ~has_value & ~is_error & ~is_vacuous
        robustness = np.where(has_value, margin / metric.scale, np.nan)
        low = np.where((has_value & is_open) | is_unbounded, -np.inf, robustness)
        times = np.asarray(column.time, dtype=np.float64)[runs]
        numbers = np.full((len(runs), 6), np.nan)
        numbers[:, LOW] = low
        numbers[:, HIGH] = np.where(is_unbounded, np.inf, robustness)
        numbers[:, MARGIN] = np.where(has_value, margin, np.nan)
        numbers[:, TIME] = np.where(has_value & np.isfinite(times), times, np.nan)
        numbers[:, VALUE] = np.where(has_value & np.isfinite(value), value, np.nan)
        numbers[:, THRESHOLD] = bound.limit
        actor = np.asarray(column.actor, dtype=np.int64)[runs]
        return _Ruling(
            verdict,
            has_value | (status == _CODES[statuses.INCOMPLETE]),
            numbers,
            np.where(has_value, actor, -1),
            np.zeros(len(runs), dtype=np.int64),
            ((metric.unit, metric.column, bound.text),),
            np.where(is_error, _CODES[statuses.ERROR], status),
            lambda code: _STATUS_WORDS.get(STATUSES[code]),
        )


def _nothing(runs: int) -> _Ruling:
    none = np.zeros(runs, dtype=np.int64)
    return _Ruling(
        none + ERROR,
        none != 0,
        np.full((runs, 6), np.nan),
        none - 1,
        none,
        ((None, None, None),),
        none,
        lambda _: None,
    )


def _without_invalid(judged: JudgementColumns, is_invalid: Bools) -> JudgementColumns:
    """Say of invalid runs that they are, and nothing else."""
    nothing = len(judged.bindings)
    return replace(
        judged,
        verdict=np.where(is_invalid, INVALID, judged.verdict),
        exercised=judged.exercised & ~is_invalid,
        numbers=np.where(is_invalid[:, np.newaxis], np.nan, judged.numbers),
        actor=np.where(is_invalid, -1, judged.actor),
        binding=np.where(is_invalid, nothing, judged.binding),
        bindings=(*judged.bindings, (None, None, None)),
    )


def _shown(values: Floats, node: Ints, shown: list[bool]) -> Floats:
    return np.where(np.array(shown)[node], values, np.nan)


def _binding(words: Words, status: int) -> Binding:
    unit = words.unit
    if status == _NOT_APPLICABLE:
        unit = words.empty_unit
    elif status in {_BEYOND, _BEFORE}:
        unit = ""
    return unit or None, words.signal, words.text


def _reason(verdict: int, words: Words, status: int, word: int) -> str | None:
    if verdict == ERROR:
        return "a signal has a sample that is not a finite number"
    detail = None
    if verdict == INCONCLUSIVE:
        detail = _OPEN.get(BINDING_STATUSES[status], "the trace does not decide it")
    elif verdict == VACUOUS and status != _BEFORE:
        detail = "the precondition never held"
    if status == _NO_CONFLICT:
        return _and(detail, "no conflict")
    if status == _BEFORE:
        return _and(detail, "nothing lies that far back")
    if word and words.values:
        return _and(detail, f"{words.signal} is {words.values[word - 1].lower()}")
    return detail


_NEVER_HELD: Final = {
    NEEDED: "the antecedent of nested implication {} never held",
    SPARE: "the antecedent of nested implication {} never held, and it was not needed",
}


def _patterns(nested: Ints) -> tuple[Ints, Ints]:
    """Number the different rows (R, J): each once, and the number of each row."""
    if not nested.any():
        return np.zeros((1, nested.shape[1]), dtype=np.int64), np.zeros(len(nested), dtype=np.int64)
    patterns, pattern = np.unique(nested, axis=0, return_inverse=True)
    return patterns, pattern.reshape(-1)


def never_held(nested: Sequence[int]) -> str | None:
    """Name the nested implications, from 1, whose antecedent held nowhere.

    Args:
        nested: What became of each: ``HELD``, ``NEEDED`` or ``SPARE``.
    """
    numbered = enumerate(nested, start=1)
    return _and(*(_NEVER_HELD[kind].format(at) for at, kind in numbered if kind != HELD))


def read_never_held(detail: str | None, count: int) -> tuple[int, ...]:
    """Read from the detail of a verdict what became of each of its nested implications."""
    parts = set((detail or "").split("; "))
    return tuple(
        next((kind for kind, text in _NEVER_HELD.items() if text.format(at) in parts), HELD)
        for at in range(1, count + 1)
    )


def _and(*parts: str | None) -> str | None:
    return "; ".join(part for part in parts if part) or None


# --- Judge FSRs on recorded runs: one judgement per run and FSR, with its margin and its reason ---

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

    happened: outcome.OutcomeColumns
    metrics: Mapping[str, MetricColumn]
    judged: tuple[JudgementColumns, ...]
    not_applicable: Mapping[str, str]
    frame: Frame
    extremes: Mapping[str, Extremes]

    @cached_property
    def outcomes(self) -> tuple[outcome.RunOutcome, ...]:
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
    happened = outcome.outcomes(trace)
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
    layout, context = trace.layout, trace.layout.context
    return Frame(
        step_s=context.step,
        objects=context.object_ids,
        by_contact=outcome.ended_by_contact(trace),
        invalid=outcome.invalid_reasons(trace),
        missing=missing_from(
            signals.dictionary, has_objects=bool(context.object_ids), faults=layout.faults
        ),
        like=Runs(signals.dictionary, context.step, layout.horizon, layout.tail),
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
    horizon = outcome.obligation_rows(signals.trace)
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
        {name: joined_columns(parts) for name, parts in evaluated.items() if parts},
        {name: joined_columns(extremes[name]) for name in sorted(extremes)},
    )
