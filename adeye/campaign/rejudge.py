"""Judge results again without executing them: from metrics, from kept samples, from kept traces.

What a result was judged on before does not count, only what is known of the run. Where that cannot
tell, the run is left to be executed again.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.campaign.traces import judge_kept
from adeye.campaign.work import extremes_of, grouped, verdict_block
from adeye.judge.evaluate import Frame, JudgementColumns
from adeye.judge.extremes import evaluate_extremes, measure_of
from adeye.judge.metrics import METRICS
from adeye.judge.metrics.registry import CODES, StatusColumn
from adeye.judge.outcome import bars
from adeye.judge.requirements import JUDGE_VERSION, CheckedRequirement
from adeye.judge.stl.counterexample import Runs, missing_from
from adeye.ports import MetricColumn
from adeye.store.block import JudgedBlock
from adeye.store.write.results import CHUNK

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.campaign.plan import CampaignPlan
    from adeye.judge.stl.batch import StlColumns
    from adeye.signals import Ints
    from adeye.store.read.rejudging import Again, Gap
    from adeye.store.repository import Repository

METRIC, SAMPLES, TRACE, INVALID, VERDICT = "metric", "samples", "trace", "invalid", "verdict"
"""What told a verdict: the row of a metric, kept samples, a kept trace, that the run is invalid for
every FSR, or the verdict without numeric uncertainty."""
WAYS: Final = (METRIC, SAMPLES, TRACE, INVALID, VERDICT)


@dataclass(frozen=True, slots=True)
class Rejudged:
    """What judging again came to.

    Attributes:
        wanted: Results that lacked a verdict.
        judged: Of these, the ones that lack none any more.
        ways: Results by what told a verdict of theirs.
        left: Results that have to be executed again, with the FSRs that they lack.
    """

    wanted: int
    judged: int
    ways: Mapping[str, int]
    left: Mapping[str, tuple[str, ...]]


def rejudge(
    repository: Repository,
    plan: CampaignPlan,
    campaign: str,
    report: Callable[[int, int], None] | None = None,
) -> Rejudged:
    """Give the verdicts that results of a campaign lack, as far as nothing has to be executed.

    Args:
        repository: The database.
        plan: What the campaign was planned from.
        campaign: Its id.
        report: Called with results done and wanted, now and then.

    Raises:
        IntegrityError: A kept trace is not that of its result.
    """
    again = repository.again
    gaps = again.gaps(campaign)
    tell = report or (lambda _done, _wanted: None)
    ways: Counter[str] = Counter()
    left: dict[str, tuple[str, ...]] = {}
    done = 0
    for part in grouped(gaps, lambda gap: (gap.scenario, gap.architecture), CHUNK):
        open_pairs = _judge_rows(again, plan, part, ways)
        left |= _judge_traces(again, plan, part, open_pairs, ways, repository.location.beside)
        done += len(part)
        tell(done, len(gaps))
    return Rejudged(len(gaps), len(gaps) - len(left), dict(ways), left)


def _judge_rows(
    again: Again, plan: CampaignPlan, gaps: Sequence[Gap], ways: Counter[str]
) -> dict[str, tuple[str, ...]]:
    """Judge results of one scenario and architecture from rows; return what is open."""
    judging = _Judging(again, plan, gaps)
    missing: dict[str, list[int]] = defaultdict(list)
    for place, gap in enumerate(gaps):
        for fsr in gap.fsrs:
            missing[fsr].append(place)
    judged: list[JudgementColumns] = []
    used: dict[str, set[int]] = defaultdict(set)
    told: set[tuple[int, str]] = set()
    for item in plan.requirements:
        wanted = missing.get(item.requirement.id)
        for way, columns in judging.judge(item, wanted) if wanted else ():
            judged.append(columns)
            used[way].update(columns.runs.tolist())
            told.update((run, item.requirement.id) for run in columns.runs.tolist())
    objects = judging.objects
    _save(again, gaps, [replace(item, objects=objects) for item in judged])
    for way, runs in used.items():
        ways[way] += len(runs)
    return _open(gaps, told)


def _open(gaps: Iterable[Gap], told: set[tuple[int, str]]) -> dict[str, tuple[str, ...]]:
    found = {
        gap.result: tuple(fsr for fsr in gap.fsrs if (place, fsr) not in told)
        for place, gap in enumerate(gaps)
    }
    return {result: fsrs for result, fsrs in found.items() if fsrs}


def _save(
    again: Again,
    gaps: Sequence[Gap],
    judged: Sequence[JudgementColumns],
    traces: Sequence[str] = (),
) -> None:
    if judged:
        results = tuple(gap.result for gap in gaps)
        again.add(JudgedBlock(results, verdict_block(judged), tuple(traces)))


class _Judging:
    """Judges results of one scenario and architecture from what the database keeps of them."""

    def __init__(self, again: Again, plan: CampaignPlan, gaps: Sequence[Gap]) -> None:
        self._again = again
        self._numbers = [gap.number for gap in gaps]
        self._bases = again.bases(self._numbers, JUDGE_VERSION)
        self._step_s = plan.files.odd.spec.step
        self._dictionary = plan.judged.dictionary(gaps[0].scenario, gaps[0].architecture)
        lasts = plan.cases[gaps[0].ordinal].scenario
        self._runs = Runs(self._dictionary, self._step_s, lasts.horizon, lasts.tail)
        self._objects: dict[str, int] = {}

    @property
    def objects(self) -> tuple[str, ...]:
        """Names of the objects that the verdicts name, by number."""
        return tuple(self._objects)

    def judge(
        self, item: CheckedRequirement, wanted: Sequence[int]
    ) -> Iterator[tuple[str, JudgementColumns]]:
        """Give verdicts of an FSR on those of some results of which enough is known."""
        known = [run for run in wanted if self._numbers[run] in self._bases]
        invalid = [run for run in known if bars(self._basis(run)[1])]
        yield from self._judged(INVALID, item, invalid, None, {})
        valid = [run for run in known if not bars(self._basis(run)[1])]
        if item.bound is not None:
            yield from self._by_metric(item, valid)
        elif measure_of(item.formula) is not None:
            yield from self._by_samples(item, valid)

    def _basis(self, run: int) -> tuple[bool, str | None, Mapping[str, str]]:
        return self._bases[self._numbers[run]]

    def _by_metric(
        self, item: CheckedRequirement, runs: Sequence[int]
    ) -> Iterator[tuple[str, JudgementColumns]]:
        assert item.bound is not None
        name = item.bound.column
        # A metric that is defined otherwise by now was measured otherwise.
        runs = [run for run in runs if self._basis(run)[2].get(name) == METRICS[name].uid]
        stored = self._again.metric([self._numbers[run] for run in runs], name)
        runs = [run for run in runs if self._numbers[run] in stored]
        rows = [stored[self._numbers[run]] for run in runs]
        column = MetricColumn(
            np.array([np.nan if row[0] is None else row[0] for row in rows], dtype=np.float64),
            StatusColumn(np.array([CODES[row[1]] for row in rows], dtype=np.int8)),
            np.array([np.nan if row[2] is None else row[2] for row in rows], dtype=np.float64),
            np.array([self._object(row[3]) for row in rows], dtype=np.int64),
        )
        yield from self._judged(METRIC, item, runs, None, {name: column})

    def _by_samples(
        self, item: CheckedRequirement, runs: Sequence[int]
    ) -> Iterator[tuple[str, JudgementColumns]]:
        measure = measure_of(item.formula)
        assert measure is not None
        assert item.formula is not None
        if measure.signal not in self._dictionary:
            return
        numbers = [self._numbers[run] for run in runs]
        stored = self._again.extremes(numbers, measure.text, JUDGE_VERSION)
        runs = [run for run in runs if self._numbers[run] in stored]
        if not runs:
            return
        kept = extremes_of([stored[self._numbers[run]] for run in runs], self._objects)
        found = evaluate_extremes(item.formula, kept, self._dictionary, self._step_s)
        certain = np.flatnonzero(found.is_certain)
        columns = found.columns.take(certain)
        yield from self._judged(SAMPLES, item, [runs[place] for place in certain], columns, {})

    def _object(self, name: str | None) -> int:
        return -1 if name is None else self._objects.setdefault(name, len(self._objects))

    def _judged(
        self,
        way: str,
        item: CheckedRequirement,
        runs: Sequence[int],
        evaluated: StlColumns | None,
        metrics: Mapping[str, MetricColumn],
    ) -> Iterator[tuple[str, JudgementColumns]]:
        if not runs:
            return
        bases = [self._basis(run) for run in runs]
        has_objects = any(name.startswith("actor.") for name in self._dictionary)
        frame = Frame(
            step_s=self._step_s,
            objects=self.objects,
            by_contact=np.array([item[0] for item in bases], dtype=np.bool_),
            invalid=tuple(item[1] for item in bases),
            # What is judged by its extremes is a number, which no fault's signal is.
            missing=missing_from(self._dictionary, has_objects=has_objects, faults=None),
            like=self._runs,
        )
        own: Ints = np.arange(len(runs))
        if item.bound is not None and not metrics:
            # Of an invalid run nothing is read.
            nothing = np.full(len(runs), np.nan)
            error = StatusColumn(np.full(len(runs), CODES["error"], dtype=np.int8))
            metrics = {item.bound.column: MetricColumn(nothing, error, nothing, own - own - 1)}
        judged = frame.judge(item, own, evaluated, metrics, None)
        yield way, replace(judged, runs=np.array(runs, dtype=np.int64))


def _judge_traces(
    again: Again,
    plan: CampaignPlan,
    gaps: Sequence[Gap],
    left: dict[str, tuple[str, ...]],
    ways: Counter[str],
    database: Path,
) -> dict[str, tuple[str, ...]]:
    """Judge results of one scenario and architecture from kept traces; return what is open."""
    open_gaps = [replace(gap, fsrs=left[gap.result]) for gap in gaps if gap.result in left]
    if not open_gaps:
        return {}
    for judged in judge_kept(again, plan, open_gaps, database):
        chosen = [open_gaps[place] for place in judged.places]
        _save(again, chosen, judged.columns, judged.trace_digests)
        ways[TRACE] += len(chosen)
        for gap in chosen:
            left.pop(gap.result, None)
    return left
