"""From a formula or a metric to the verdicts of its FSR on many runs, with margin and reason."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.judgement import (
    ERROR,
    FAIL,
    HIGH,
    INCONCLUSIVE,
    INVALID,
    LOW,
    MARGIN,
    PASS,
    THRESHOLD,
    TIME,
    VACUOUS,
    VALUE,
    Binding,
    JudgementColumns,
)
from adeye.evaluation.metrics import statuses
from adeye.evaluation.metrics.statuses import CODES as _CODES
from adeye.evaluation.metrics.statuses import STATUSES, status_codes
from adeye.evaluation.outcome import bars
from adeye.evaluation.stl.columns import HELD, NEEDED, SPARE
from adeye.evaluation.stl.descent import BINDING_STATUSES
from adeye.evaluation.stl.program import KIND, WORD
from adeye.evaluation.uncertainty import is_uncertain, uncertain_detail
from adeye.kernel.clock import tick_times

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from adeye.evaluation.bounds import Bound
    from adeye.evaluation.requirements import CheckedRequirement
    from adeye.evaluation.stl.columns import StlColumns
    from adeye.evaluation.stl.program import Words
    from adeye.evaluation.uncertainty import NumericUncertainty
    from adeye.ports import MetricColumn
    from adeye.signals import Bools, Floats, Ints

_OPEN: Final = {
    "beyond_trace": "an obligation is open where the trace ends",
    "not_applicable": "a signal does not apply where it would decide",
}
_STATUS_WORDS: Final = {
    statuses.ERROR: "the metric has no finite value",
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
    """

    step_s: float
    objects: tuple[str, ...]
    by_contact: Bools
    invalid: tuple[str | None, ...]

    @property
    def is_invalid(self) -> Bools:
        """(B,) whether no FSR can be judged."""
        return np.array([bars(reason) for reason in self.invalid], dtype=np.bool_)

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
            found = self._by_formula(evaluated, runs)
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

    def _by_formula(self, result: StlColumns, runs: Ints) -> _Ruling:
        words = result.program.words
        node, status, error = result.node[runs], result.status[runs], result.error[runs]
        is_vacuous = result.vacuous[runs]
        satisfied = np.where(is_vacuous, VACUOUS, PASS)
        decided = np.array([INCONCLUSIVE, 0, FAIL])[result.verdict[runs]]
        verdict = np.where(result.verdict[runs] > 0, satisfied, decided)
        verdict = np.where(error, ERROR, verdict)
        kinds = result.program.nodes[:, KIND]
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
        reason = reason * len(patterns) + pattern

        def explain(key: int) -> str | None:
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
        is_free = status == _CODES[statuses.NO_CONFLICT]
        has_value = is_free | (status == _CODES[statuses.VALUE])
        value = np.asarray(column.value, dtype=np.float64)[runs]
        is_finite = is_free | np.isfinite(value)
        margin, is_free = bound.margins(value, is_free)
        is_error = (status == _CODES[statuses.ERROR]) | (
            has_value & ~(is_finite & np.isfinite(margin))
        )
        status = np.where(has_value & is_free, _CODES[statuses.NO_CONFLICT], status)
        has_value &= ~is_error
        by_contact = self.by_contact[runs]
        is_open = by_contact & (not metric.settles) & (margin >= 0.0)
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
    elif verdict == VACUOUS:
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
