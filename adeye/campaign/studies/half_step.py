"""Execute a sample of situations with the step and with half of it, and compare.

The sample of a scenario and an architecture are the situations with the smallest digests: a digest
is as good as a draw, and no edit of another scenario, architecture, fault or FSR changes it. Each
is executed without a fault and, where it has any, with one of its fault entries: that of the test
case with the smallest digest, so that the entries are spread over the situations.

The twin of a run has the same situation, so the same noise, and half the step; rates, delays, times
of faults and all others are seconds and stay. What is one tick by definition is half as long: the
delay of a link to a channel or to the switch, the time between two looks of traffic, storyboard and
switch, and the row in which a metric finds its worst case. These are part of the uncertainty.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from adeye.campaign.naming import find_called
from adeye.campaign.plan import CampaignPlan, Sample, concerns
from adeye.campaign.work import BatchResult, BatchTask
from adeye.errors import InputError
from adeye.judge import uncertainty
from adeye.judge.metrics import METRICS
from adeye.judge.uncertainty import Difference, Sampled
from adeye.store.records import RAISED
from adeye.store.repository import Repository
from adeye.store.write.half_steps import HalfStepRecord, UncertaintyRecord
from adeye.sweep.case import TestCase, structure_key

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.campaign.executors import Done
    from adeye.campaign.work import WorkContext
    from adeye.judge.requirements import CheckedRequirement
    from adeye.store.records import MetricValue, StoredRun

# --- Execute a sample of situations with the step and with half of it, and compare ----------------

MOST_TRIES: Final = 3
"""Executions of a run before it is given up."""
_BATCH: Final = 64

Report = Callable[[int, int], None]
"""Is told how many runs are done, of how many."""


def twin_of(case: TestCase) -> TestCase:
    """Give the test case that is the same but for its step, which is half as long."""
    return replace(case, step=case.step / 2.0)


@dataclass(frozen=True)
class _Pair:
    """A run of a sample and its twin."""

    case: TestCase
    twin: TestCase
    result: str
    twin_result: str

    @property
    def record(self) -> HalfStepRecord:
        return HalfStepRecord(
            self.twin_result, self.twin.digest, self.result, self.case.digest, self.twin.step
        )


@dataclass(frozen=True)
class _Batch:
    """Runs that are executed together: of one structure, and all with the step or with half."""

    pairs: tuple[_Pair, ...]
    is_twin: bool
    tries: int = 0

    @property
    def cases(self) -> tuple[TestCase, ...]:
        return tuple(pair.twin if self.is_twin else pair.case for pair in self.pairs)


@dataclass(frozen=True)
class Halved:
    """What came of the twins with half the step.

    Attributes:
        twins: How many were executed now.
        failures: Why some could not be executed.
    """

    twins: int = 0
    failures: tuple[str, ...] = ()


class HalfStepTasks(Iterator[BatchTask]):
    """What a plan's samples still need, batch by batch; asked again after its end, it looks again.

    Attributes:
        failures: Why runs were given up.
        twins: Twins that were executed.
    """

    def __init__(
        self, repository: Repository, plan: CampaignPlan, fitting: int, context: WorkContext
    ) -> None:
        """Look up what is there already.

        Args:
            repository: The database; the campaign is planned.
            plan: A checked plan that asks for the uncertainty.
            fitting: Most runs whose traces fit into memory together.
            context: What runs are executed with, also which of their traces are kept. Twins have
                none that is kept: nothing judges them again, they are executed anew.
        """
        self._repository, self._plan = repository, plan
        self._context = context
        self._pairs = {sample: pairs_of(plan, sample) for sample in plan.samples}
        self._waiting = deque(self._open(fitting))
        self._given: dict[int, _Batch] = {}
        self._count = 0
        self.failures: list[str] = []
        self.twins = 0
        self.total = sum(len(batch.pairs) for batch in self._waiting)
        self.done = 0

    def __next__(self) -> BatchTask:
        if not self._waiting:
            raise StopIteration
        batch = self._waiting.popleft()
        self._count += 1
        self._given[self._count] = batch
        context = self._plan.work if batch.is_twin else self._context
        return BatchTask(self._count, batch.cases, (), context)

    def absorb(self, done: Done[BatchTask, BatchResult]) -> None:
        """Save what came back; what failed is tried again, at last run by run."""
        batch = self._given.pop(done.task.block)
        runs = None if done.result is None else done.result.runs
        if runs is None:
            self._again(batch, done.lost if done.result is None else done.result.failure)
            return
        if batch.is_twin:
            self._repository.hindsight.half_steps.save_twins(
                [pair.record for pair in batch.pairs], runs
            )
            self.twins += len(batch.pairs)
        else:
            self._repository.hindsight.half_steps.save_runs(runs)
        self.done += len(batch.pairs)

    def found(self) -> list[UncertaintyRecord]:
        """Compare the runs of every sample with their twins, as the database holds them."""
        return [
            record
            for sample, pairs in self._pairs.items()
            for record in _compared(self._repository, self._plan, sample, pairs)
        ]

    def _again(self, batch: _Batch, why: str) -> None:
        middle = len(batch.pairs) // 2
        # What code from outside raised is told at once: it may not raise another time.
        is_raised = why.startswith(RAISED)
        if middle and not is_raised:
            parts = (batch.pairs[:middle], batch.pairs[middle:])
            self._waiting.extend(replace(batch, pairs=part) for part in parts)
        elif batch.tries + 1 < MOST_TRIES and not is_raised:
            self._waiting.append(replace(batch, tries=batch.tries + 1))
        else:
            what = "twin with half the step" if batch.is_twin else "run"
            self.failures.append(f"a {what} of {batch.pairs[0].case.scenario_id}: {why}")

    def _open(self, fitting: int) -> Iterator[_Batch]:
        pairs = [pair for found in self._pairs.values() for pair in found]
        half_steps = self._repository.hindsight.half_steps
        results = [digest for pair in pairs for digest in (pair.result, pair.twin_result)]
        known, judged = half_steps.known(results), half_steps.judged(results)
        groups: dict[tuple[str, bool], list[_Pair]] = defaultdict(list)
        for pair in pairs:
            wanted = self._wanted(pair.case)
            key = structure_key(pair.case)
            for is_twin, digest in ((False, pair.result), (True, pair.twin_result)):
                if digest not in known or any((digest, fsr) not in judged for fsr in wanted):
                    groups[key, is_twin].append(pair)
        for (_, is_twin), found in groups.items():
            # A twin has twice as many rows.
            size = max(1, min(_BATCH, fitting // 2 if is_twin else fitting))
            for first in range(0, len(found), size):
                yield _Batch(tuple(found[first : first + size]), is_twin)

    def _wanted(self, case: TestCase) -> list[str]:
        """List the FSRs that a run is judged on."""
        return [
            item.digest
            for item in self._plan.requirements
            if case.architecture.architecture not in item.not_applicable
            and item.concerns(case.scenario_id, is_inside=case.inside_odd)
        ]


def pairs_of(plan: CampaignPlan, sample: Sample) -> list[_Pair]:
    """Return the runs of a sample with their twins."""
    cases = [plan.cases[ordinal] for ordinal in sample.ordinals]
    twins = [twin_of(case) for case in cases]
    engine = plan.engines[sample.architecture]
    digests = engine.result_digests([twin.digest for twin in twins])
    return [
        _Pair(case, twin, result, digest)
        for case, twin, result, digest in zip(cases, twins, sample.results, digests, strict=True)
    ]


def _compared(
    repository: Repository, plan: CampaignPlan, sample: Sample, pairs: Sequence[_Pair]
) -> Iterator[UncertaintyRecord]:
    runs = [
        (repository.run_row(pair.result), repository.run_row(pair.twin_result)) for pair in pairs
    ]
    metrics = [(_metrics(first), _metrics(second)) for first, second in runs]
    names = {name: None for pair in metrics for side in pair for name in side}
    for name in names:
        sampled = [(_sampled(name, first), _sampled(name, second)) for first, second in metrics]
        for found in uncertainty.differences("metric", name, sampled):
            yield UncertaintyRecord(sample.scenario, sample.architecture, found)
    for item in plan.requirements:
        if not concerns(item, sample):
            continue
        margins = [
            pair
            for pair in ((_margin(item, first), _margin(item, second)) for first, second in runs)
            if pair != (None, None)
        ]
        name = item.requirement.id
        nothing = Difference("fsr", name, "", 0, 0, None, None, 0, {})
        judged = uncertainty.judged_digest(item.digest, sample.results)
        for found in uncertainty.differences("fsr", name, margins) or [nothing]:
            yield UncertaintyRecord(
                sample.scenario, sample.architecture, found, item.digest, judged
            )


def _metrics(run: StoredRun | None) -> dict[str, MetricValue]:
    if run is None:
        return {}
    plugins = {name: value for of in run.plugin_metrics.values() for name, value in of.items()}
    return {**run.metrics, **plugins}


def _sampled(name: str, metrics: Mapping[str, MetricValue]) -> Sampled | None:
    found = metrics.get(name)
    if found is None:
        return None
    unit, cap = (METRICS[name].unit, METRICS[name].cap) if name in METRICS else ("", None)
    return uncertainty.sampled_metric(name, found.value, found.status, unit, cap)


def _margin(item: CheckedRequirement, run: StoredRun | None) -> Sampled | None:
    verdicts = () if run is None else run.verdicts
    for verdict in verdicts:
        if verdict.fsr_digest == item.digest:
            return uncertainty.sampled_margin(
                verdict.verdict, verdict.margin, verdict.unit, verdict.signal, verdict.detail
            )
    return None


# --- Read what halving the step changed in a campaign ---------------------------------------------


@dataclass(frozen=True)
class UncertaintyTable:
    """What halving the step changed in a campaign.

    Attributes:
        campaign: Id.
        odd: Id of its ODD.
        step_s: Its step [s].
        lines: By scenario, architecture, metric or FSR, and unit.
    """

    campaign: str
    odd: str
    step_s: float
    lines: tuple[UncertaintyRecord, ...]


def uncertainty_table(db: str | Path | None, what: str | None = None) -> UncertaintyTable:
    """Read the numeric uncertainty of a campaign.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        what: A campaign, or an ODD's file or id; None for the latest campaign.

    Raises:
        InputError: There is no such campaign, or it has no uncertainty.
    """
    with Repository.open(db, create=False) as repository:
        info = find_called(repository, what, may_be_edited=True)
        repository.require_sound(info.id)
        odd = repository.content("odd", info.odd_digest)["odd"]
        lines = repository.hindsight.half_steps.uncertainty(info.id)
    if odd.get("uncertainty") is None:
        raise InputError(
            f"campaign {info.id[:12]} of {info.odd} was judged without numeric uncertainty",
            remedy="Write `uncertainty: {situations: 20}` into the ODD and run it again.",
        )
    if not lines:
        raise InputError(
            f"campaign {info.id[:12]} of {info.odd} has no numeric uncertainty yet",
            remedy="Its twins with half the step are not all executed; run it again to go on.",
        )
    return UncertaintyTable(info.id, info.odd, float(odd["step"]), lines)
