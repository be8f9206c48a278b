"""What came out of a block of runs, as columns: cheap to send between processes and to store."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.judge.evaluate import VERDICTS
from adeye.judge.metrics.registry import STATUSES
from adeye.judge.outcome import OUTCOMES
from adeye.judge.verdict import Outcome, Verdict
from adeye.store.encoding import Dictionary, Texts, json_text
from adeye.store.records import require_seed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from datetime import datetime

    from adeye.signals import Bools, Floats, Ints
    from adeye.store.records import (
        ContentRecord,
        EngineKey,
        EventRecord,
        MetricValue,
        PlannedCase,
        RunRecord,
        VerdictRecord,
    )

# --- What came out of a block of runs, as columns: cheap to send between processes and to store ---

_VALUE: Final = STATUSES.index("value")
_BAD: Final = (VERDICTS.index(Verdict.FAIL), VERDICTS.index(Verdict.ERROR))


@dataclass(frozen=True)
class MetricBlock:
    """K metrics of B runs.

    Attributes:
        ids: K ids.
        value: (B, K) in the metric's unit, NaN unless the status is ``value``.
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
        if ((self.status == _VALUE) != has_value).any() or np.isinf(self.value).any():
            run, place = np.argwhere(((self.status == _VALUE) != has_value) | np.isinf(self.value))[
                0
            ]
            msg = (
                f"metric {self.ids[place]}: value {self.value[run, place]} does not fit status "
                f"{STATUSES[self.status[run, place]]!r}"
            )
            raise ValueError(msg)

    def take(self, rows: Any) -> MetricBlock:
        """Choose runs."""
        return replace(
            self,
            value=self.value[rows],
            status=self.status[rows],
            time_s=self.time_s[rows],
            actor=self.actor[rows],
        )

    @classmethod
    def of(cls, ids: Sequence[str], records: Sequence[Mapping[str, MetricValue]]) -> MetricBlock:
        """Put the metrics of some runs into columns."""
        cells = [[record[name] for name in ids] for record in records]
        shape = (len(records), len(ids))
        names = sorted({cell.actor for row in cells for cell in row if cell.actor is not None})
        codes = {name: code for code, name in enumerate(names)}

        def column(read: Any, kind: Any) -> Any:
            return np.array([[read(cell) for cell in row] for row in cells], kind).reshape(shape)

        return cls(
            tuple(ids),
            column(lambda cell: np.nan if cell.value is None else cell.value, np.float64),
            column(lambda cell: STATUSES.index(cell.status), np.int8),
            column(lambda cell: np.nan if cell.time_s is None else cell.time_s, np.float64),
            column(lambda cell: -1 if cell.actor is None else codes[cell.actor], np.int64),
            Dictionary((*names, None)),
        )


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
class VerdictBlock:
    """R verdicts on runs of a block.

    Attributes:
        run: (R,) row of the block.
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

    run: Ints
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

    def take(self, rows: Any) -> VerdictBlock:
        """Choose verdicts."""
        return VerdictBlock(**{item.name: getattr(self, item.name)[rows] for item in fields(self)})

    @property
    def failures(self) -> int:
        """Number of runs with a FAIL or an ERROR."""
        return len(np.unique(self.run[np.isin(self.verdict, _BAD)]))

    @classmethod
    def of(cls, records: Sequence[Sequence[VerdictRecord]]) -> VerdictBlock:
        """Put the verdicts on some runs into columns."""
        pairs = [(run, record) for run, items in enumerate(records) for record in items]
        found = [record for _, record in pairs]

        def number(value: float | None) -> float:
            return np.nan if value is None else value

        numbers = [
            (
                number(item.robustness_low),
                number(item.robustness_high),
                number(item.margin),
                number(item.time_s),
                number(item.value),
                number(item.threshold),
            )
            for item in found
        ]
        return cls(
            np.array([run for run, _ in pairs], dtype=np.int64),
            Texts.of([item.fsr_id for item in found]),
            Texts.of([item.fsr_digest for item in found]),
            np.array([VERDICTS.index(item.verdict) for item in found], dtype=np.int8),
            np.array([item.is_exercised for item in found], dtype=np.bool_),
            np.array(numbers, dtype=np.float64).reshape(-1, 6),
            Texts.of([item.unit for item in found]),
            Texts.of([item.signal for item in found]),
            Texts.of([item.predicate for item in found]),
            Texts.of([item.actor for item in found]),
            Texts.of([item.detail for item in found]),
        )


@dataclass(frozen=True)
class EventBlock:
    """E events of the runs of a block, run after run, each in order of time.

    Attributes:
        run: (E,) row of the block, ascending.
        time_s: (E,) [s].
        kind: What kinds of events.
        subject: Whom they concern.
        text: One line each.
    """

    run: Ints
    time_s: Floats
    kind: Texts
    subject: Texts
    text: Texts

    @property
    def seq(self) -> Ints:
        """(E,) number of the event in its run."""
        return np.arange(len(self.run)) - np.searchsorted(self.run, self.run)

    def take(self, runs: Ints) -> EventBlock:
        """Choose runs and number them from 0; each at most once, in ascending order."""
        rows = np.flatnonzero(np.isin(self.run, runs))
        run = np.searchsorted(runs, self.run[rows])
        return EventBlock(
            run, self.time_s[rows], self.kind[rows], self.subject[rows], self.text[rows]
        )

    @classmethod
    def of(cls, records: Sequence[Sequence[EventRecord]]) -> EventBlock:
        """Put the events of some runs into columns."""
        pairs = [(run, record) for run, items in enumerate(records) for record in items]
        return cls(
            np.array([run for run, _ in pairs], dtype=np.int64),
            np.array([item.time_s for _, item in pairs], dtype=np.float64),
            Texts.of([item.kind for _, item in pairs]),
            Texts.of([item.subject for _, item in pairs]),
            Texts.of([item.text for _, item in pairs]),
        )


@dataclass(frozen=True)
class RunBlock:
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
            msg = "an infrastructure error is no result; fail the block instead"
            raise ValueError(msg)

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

    def take(self, runs: Ints) -> RunBlock:
        """Choose runs, each at most once, in ascending order."""
        if len(runs) == len(self):
            return self
        is_kept = np.isin(self.verdicts.run, runs)
        verdicts = self.verdicts.take(np.flatnonzero(is_kept))
        chosen = {
            item.name: getattr(self, item.name)[runs]
            for item in fields(self)
            if isinstance(getattr(self, item.name), np.ndarray | Texts)
        }
        return replace(
            self,
            **chosen,
            test_cases=tuple(self.test_cases[run] for run in runs),
            trace_digests=tuple(self.trace_digests[run] for run in runs),
            executed_at=tuple(self.executed_at[run] for run in runs),
            chains=tuple(self.chains[run] for run in runs) if self.chains else (),
            metrics=self.metrics.take(runs),
            verdicts=replace(verdicts, run=np.searchsorted(runs, verdicts.run)),
            events=self.events.take(runs),
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


def run_block(records: Sequence[RunRecord], metric_ids: Sequence[str]) -> RunBlock:
    """Put results that come one by one into columns.

    Raises:
        ValueError: A result lacks a metric or has another one.
    """
    for record in records:
        unknown = sorted(set(record.metrics) ^ set(metric_ids))
        if unknown:
            msg = f"metrics {unknown} are missing from the result or unknown to the database"
            raise ValueError(msg)
    engines = tuple(dict.fromkeys(record.engine for record in records))
    plugins: list[PluginBlock] = []
    for name, ids in sorted(
        {(name, tuple(sorted(of))) for item in records for name, of in item.plugin_metrics.items()}
    ):
        runs = [
            run
            for run, item in enumerate(records)
            if tuple(sorted(item.plugin_metrics.get(name, ()))) == ids
        ]
        block = MetricBlock.of(ids, [records[run].plugin_metrics[name] for run in runs])
        plugins.append(PluginBlock(name, np.array(runs, dtype=np.int64), block))
    return RunBlock(
        tuple(record.test_case for record in records),
        engines,
        np.array([engines.index(record.engine) for record in records], dtype=np.int64),
        np.array([OUTCOMES.index(record.outcome) for record in records], dtype=np.int64),
        Texts.of([record.outcome_channel for record in records]),
        Texts.of([record.outcome_detail for record in records]),
        np.array([record.trace_rows for record in records], dtype=np.int64),
        np.array([record.duration_s for record in records], dtype=np.float64),
        tuple(record.trace_digest for record in records),
        np.array([record.is_realised for record in records], dtype=np.bool_),
        Texts.of([record.end_reason for record in records]),
        np.array([record.is_machine_dependent for record in records], dtype=np.bool_),
        MetricBlock.of(metric_ids, [record.metrics for record in records]),
        VerdictBlock.of([record.verdicts for record in records]),
        EventBlock.of([record.events for record in records]),
        Texts.of([record.executed_by for record in records]),
        tuple(record.executed_at for record in records),
        tuple(plugins),
        tuple(record.chain for record in records),
    )


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

    @classmethod
    def of(cls, case: PlannedCase) -> PlannedCases:
        """Take one test case."""
        return cls(
            scenario=case.scenario,
            scenario_content=case.scenario_content,
            architecture=case.architecture,
            architecture_content=case.architecture_content,
            fault_entry=case.fault_entry,
            faults=case.faults,
            seed=case.seed,
            step_s=case.step_s,
            engine=case.engine,
            structure=case.structure,
            test_cases=(case.test_case,),
            situations=(case.situation,),
            parameters=(json_text(dict(case.parameters)),),
            points=(json_text(dict(case.point)),),
            replicates=(case.replicate,),
            inside_odd=(case.inside_odd,),
            point_index=(case.point_index,),
        )


# --- What judging runs of a block again depends on, column by column ------------------------------


@dataclass(frozen=True)
class ExtremeBlock:
    """E sets of samples of the runs of a block.

    Attributes:
        run: (E,) row of the block.
        measure: What decides.
        value: (E,) the extreme, NaN for none.
        time_s: (E,) its time, NaN for none [s].
        actor: Its object.
        samples: The samples as JSON, see ``samples_text``.
    """

    run: Ints
    measure: Texts
    value: Floats
    time_s: Floats
    actor: Texts
    samples: Texts

    def take(self, runs: Ints) -> ExtremeBlock:
        """Choose runs of the block and number them from 0."""
        rows = np.flatnonzero(np.isin(self.run, runs))
        return ExtremeBlock(
            np.searchsorted(runs, self.run[rows]),
            self.measure[rows],
            self.value[rows],
            self.time_s[rows],
            self.actor[rows],
            self.samples[rows],
        )


@dataclass(frozen=True)
class BasisBlock:
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

    def take(self, runs: Ints) -> BasisBlock:
        """Choose runs, each at most once, in ascending order."""
        return replace(
            self,
            by_contact=self.by_contact[runs],
            invalid=self.invalid[runs],
            extremes=self.extremes.take(runs),
            files=tuple(self.files[run] for run in runs) if self.files else (),
        )
