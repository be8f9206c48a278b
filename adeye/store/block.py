"""What came out of a block of runs, as columns: cheap to send between processes and to store."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from datetime import datetime
from functools import cached_property
from typing import Any, Final, Self

import numpy as np

from adeye.judge.outcome import OUTCOMES
from adeye.judge.verdict import STATUSES, VERDICTS, Outcome, Verdict
from adeye.signals import Bools, Floats, Ints
from adeye.store.encoding import Dictionary, Texts
from adeye.store.records import ContentRecord, EngineKey, VerdictRecord, require_seed

# --- What came out of a block of runs, as columns: cheap to send between processes and to store ---

NUMBERS: Final = ("robustness_low", "robustness_high", "margin", "time_s", "value", "threshold")
"""Columns of the numbers of a verdict, in their order."""
_TEXTS: Final = ("fsr_id", "fsr_digest", "unit", "signal", "predicate", "actor", "detail")
_VALUE: Final = STATUSES.index("value")
_INCOMPLETE: Final = STATUSES.index("incomplete")
_BAD: Final = (VERDICTS.index(Verdict.FAIL), VERDICTS.index(Verdict.ERROR))


@dataclass(frozen=True)
class Columns:
    """Columns of equal length."""

    def take(self, rows: Any) -> Self:
        """Choose rows of every column."""
        columns = {item.name: getattr(self, item.name) for item in fields(self)}
        chosen: dict[str, Any] = {
            name: column[rows]
            for name, column in columns.items()
            if isinstance(column, np.ndarray | Texts)
        }
        return replace(self, **chosen)


@dataclass(frozen=True)
class OfRuns(Columns):
    """Columns with rows of the runs of a block.

    Attributes:
        run: (R,) row of the block.
    """

    run: Ints

    def take_runs(self, runs: Ints) -> Self:
        """Choose the rows of some runs, each at most once, and number these from 0."""
        rows = np.flatnonzero(np.isin(self.run, runs))
        return replace(self.take(rows), run=np.searchsorted(runs, self.run[rows]))


@dataclass(frozen=True)
class MetricBlock(Columns):
    """K metrics of B runs.

    Attributes:
        ids: K ids.
        value: (B, K) in the metric's unit, NaN unless the status is ``value``, or perhaps
            ``incomplete``.
        status: (B, K) index into the statuses of metrics.
        time_s: (B, K) time of the worst case, NaN for none [s].
        actor: (B, K) index into ``actors``.
        actors: Names of the actors; the last is None.
    """

    ids: tuple[str, ...]
    value: Floats
    status: Ints
    time_s: Floats
    actor: Ints
    actors: Dictionary

    def __post_init__(self) -> None:
        has_value = np.isfinite(self.value)
        is_wrong = (self.status == _VALUE) != has_value
        is_wrong &= ~((self.status == _INCOMPLETE) & has_value)
        is_wrong |= np.isinf(self.value)
        if is_wrong.any():
            run, place = np.argwhere(is_wrong)[0]
            msg = (
                f"metric {self.ids[place]}: value {self.value[run, place]} does not fit status "
                f"{STATUSES[self.status[run, place]]!r}"
            )
            raise ValueError(msg)


@dataclass(frozen=True)
class PluginBlock:
    """Metrics of a plug-in on some runs of a block.

    Attributes:
        plugin: Name of the plug-in.
        run: (R,) rows of the block, ascending.
        metrics: Its metrics on these.
    """

    plugin: str
    run: Ints
    metrics: MetricBlock

    def take(self, runs: Ints) -> PluginBlock:
        """Choose runs of the block and number them from 0."""
        rows = np.flatnonzero(np.isin(self.run, runs))
        return PluginBlock(
            self.plugin, np.searchsorted(runs, self.run[rows]), self.metrics.take(rows)
        )


@dataclass(frozen=True)
class VerdictBlock(OfRuns):
    """R verdicts on runs of a block.

    Attributes:
        fsr_id: Requirements.
        fsr_digest: What was judged.
        verdict: (R,) index into ``judgement.VERDICTS``.
        exercised: (R,).
        numbers: (R, 6) bounds of the robustness, margin, time [s], value and threshold; what is
            not finite becomes NULL.
        unit: Of margin, value and threshold.
        signal: Of the binding predicate.
        predicate: Its text.
        actor: Its actor.
        detail: Why, in words.
    """

    fsr_id: Texts
    fsr_digest: Texts
    verdict: Ints
    exercised: Bools
    numbers: Floats
    unit: Texts
    signal: Texts
    predicate: Texts
    actor: Texts
    detail: Texts

    @property
    def failures(self) -> int:
        """Number of runs with a FAIL or an ERROR."""
        return len(np.unique(self.run[np.isin(self.verdict, _BAD)]))

    @classmethod
    def of(cls, records: Sequence[Sequence[VerdictRecord]]) -> VerdictBlock:
        """Put the verdicts on some runs into columns."""
        pairs = [(run, record) for run, items in enumerate(records) for record in items]
        found = [record for _, record in pairs]
        # Of None becomes NaN.
        numbers = [[getattr(item, name) for name in NUMBERS] for item in found]
        return cls(
            run=np.array([run for run, _ in pairs], dtype=np.int64),
            verdict=np.array([VERDICTS.index(item.verdict) for item in found], dtype=np.int8),
            exercised=np.array([item.is_exercised for item in found], dtype=np.bool_),
            numbers=np.array(numbers, dtype=np.float64).reshape(-1, len(NUMBERS)),
            **{name: Texts.of([getattr(item, name) for item in found]) for name in _TEXTS},
        )


@dataclass(frozen=True)
class EventBlock(OfRuns):
    """E events of the runs of a block, run after run, each in order of time.

    Attributes:
        time_s: (E,) [s].
        kind: What kinds of events.
        subject: Whom they concern.
        text: One line each.
    """

    time_s: Floats
    kind: Texts
    subject: Texts
    text: Texts

    @property
    def seq(self) -> Ints:
        """(E,) number of the event in its run."""
        return np.arange(len(self.run)) - np.searchsorted(self.run, self.run)


@dataclass(frozen=True)
class RunBlock(Columns):
    """The results of B executions, see ``rows.RunRecord`` for what a run has.

    Attributes:
        test_cases: B digests.
        engines: Different engines.
        engine: (B,) index into ``engines``.
        outcome: (B,) index into ``outcome.OUTCOMES``.
        outcome_channel: Channel that caused the outcome.
        outcome_detail: Why, in words.
        trace_rows: (B,).
        duration_s: (B,) [s].
        trace_digests: B digests in hex.
        realised: (B,).
        end_reason: ``contact``, ``goal``, ``horizon`` or ``road_end``.
        machine_dependent: (B,).
        metrics: Every built-in metric.
        verdicts: Verdicts of the campaign's FSRs.
        events: What happened.
        executed_by: Host and process.
        executed_at: UTC time of day.
        plugin_metrics: Metrics of plug-ins.
        chains: B texts of the links before the trace digest; empty where none were made.
        basis: What judging them again depends on.
    """

    test_cases: tuple[str, ...]
    engines: tuple[EngineKey, ...]
    engine: Ints
    outcome: Ints
    outcome_channel: Texts
    outcome_detail: Texts
    trace_rows: Ints
    duration_s: Floats
    trace_digests: tuple[str, ...]
    realised: Bools
    end_reason: Texts
    machine_dependent: Bools
    metrics: MetricBlock
    verdicts: VerdictBlock
    events: EventBlock
    executed_by: Texts
    executed_at: tuple[datetime | None, ...]
    plugin_metrics: tuple[PluginBlock, ...] = ()
    chains: tuple[str, ...] = ()
    basis: BasisBlock | None = None

    def __post_init__(self) -> None:
        if (self.outcome == OUTCOMES.index(Outcome.INFRASTRUCTURE_ERROR)).any():
            raise ValueError("an infrastructure error is no result; fail the block instead")

    def __len__(self) -> int:
        """Count the runs."""
        return len(self.test_cases)

    @cached_property
    def result_digests(self) -> tuple[str, ...]:
        """Identities of the results."""
        return tuple(
            self.engines[engine].result_digest(case)
            for engine, case in zip(self.engine.tolist(), self.test_cases, strict=True)
        )

    @cached_property
    def results(self) -> Dictionary:
        """Identities of the results, as rows refer to them."""
        return Dictionary(self.result_digests, is_clean=True)

    def take(self, runs: Ints) -> Self:
        """Choose runs, each at most once, in ascending order."""
        if len(runs) == len(self):
            return self
        return replace(
            super().take(runs),
            test_cases=tuple(self.test_cases[run] for run in runs),
            trace_digests=tuple(self.trace_digests[run] for run in runs),
            executed_at=tuple(self.executed_at[run] for run in runs),
            chains=tuple(self.chains[run] for run in runs) if self.chains else (),
            metrics=self.metrics.take(runs),
            verdicts=self.verdicts.take_runs(runs),
            events=self.events.take_runs(runs),
            plugin_metrics=tuple(item.take(runs) for item in self.plugin_metrics),
            basis=self.basis and self.basis.take(runs),
        )


@dataclass(frozen=True)
class JudgedBlock:
    """Verdicts on results that exist already.

    Attributes:
        result_digests: The results.
        verdicts: Verdicts on them, by their place.
        trace_digests: Traces that were judged; none if the results were not executed again.
        basis: What judging them again depends on.
    """

    result_digests: tuple[str, ...]
    verdicts: VerdictBlock
    trace_digests: tuple[str, ...] = ()
    basis: BasisBlock | None = None

    @classmethod
    def of(cls, verdicts: Mapping[str, Sequence[VerdictRecord]]) -> JudgedBlock:
        """Put verdicts by result digest into columns."""
        return cls(tuple(verdicts), VerdictBlock.of(list(verdicts.values())))


# --- Consecutive test cases of a plan as columns: what planning saves, without a record for each --


@dataclass(frozen=True)
class PlannedCases:
    """Test cases that share content, faults, clock, engine and structure; N of them.

    Attributes:
        scenario: Id of the scenario in the ODD.
        scenario_content: Executable content of the scenario, overrides applied.
        architecture: Id of the architecture.
        architecture_content: Executable content of the architecture, overrides applied.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        faults: Executable content of the faults of the entry.
        seed: Seed of the ODD.
        step_s: Master clock [s].
        engine: Engine that executes them.
        structure: Test cases of different structure never share a block.
        test_cases: (N,) digests.
        situations: (N,) digests of the situations.
        parameters: (N,) resolved scenario parameters in SI, as JSON.
        points: (N,) swept values in SI by the name that the sweep uses, as JSON.
        replicates: (N,) numbers of the replicates, from 0.
        inside_odd: (N,) whether the planned attributes lie inside the ODD.
        point_index: (N,) places in the plan of the ODD.
    """

    scenario: str
    scenario_content: ContentRecord
    architecture: str
    architecture_content: ContentRecord
    fault_entry: str
    faults: Sequence[Mapping[str, Any]]
    seed: int
    step_s: float
    engine: EngineKey
    structure: str
    test_cases: Sequence[str]
    situations: Sequence[str]
    parameters: Sequence[str]
    points: Sequence[str]
    replicates: Sequence[int]
    inside_odd: Sequence[bool]
    point_index: Sequence[int]

    def __post_init__(self) -> None:
        require_seed(self.seed)

    def __len__(self) -> int:
        """Number of test cases."""
        return len(self.test_cases)


# --- What judging runs of a block again depends on, column by column ------------------------------


@dataclass(frozen=True)
class ExtremeBlock(OfRuns):
    """E sets of samples of the runs of a block.

    Attributes:
        measure: What decides.
        value: (E,) the extreme, NaN for none.
        time_s: (E,) its time, NaN for none [s].
        actor: Its object.
        samples: The samples as JSON, see ``samples_text``.
    """

    measure: Texts
    value: Floats
    time_s: Floats
    actor: Texts
    samples: Texts


@dataclass(frozen=True)
class BasisBlock(Columns):
    """What judging B runs again depends on.

    Attributes:
        version: Of judging.
        uids: Definition of each metric by its id.
        by_contact: (B,) whether a contact ended the run.
        invalid: Why no FSR can be judged; none where they can.
        extremes: Samples of these runs.
        files: Where the trace of each run is kept: name of a file and place in it, None for
            nowhere.
    """

    version: int
    uids: Mapping[str, str]
    by_contact: Bools
    invalid: Texts
    extremes: ExtremeBlock
    files: tuple[tuple[str, int] | None, ...] = ()

    def take(self, runs: Ints) -> Self:
        """Choose runs, each at most once, in ascending order."""
        return replace(
            super().take(runs),
            extremes=self.extremes.take_runs(runs),
            files=tuple(self.files[run] for run in runs) if self.files else (),
        )
