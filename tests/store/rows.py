"""Runs and test cases one by one, as tests write them, and the columns that they become."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np

from adeye.judge.outcome import OUTCOMES
from adeye.judge.verdict import STATUSES, Outcome
from adeye.store.block import (
    EventBlock,
    JudgedBlock,
    MetricBlock,
    PlannedCases,
    PluginBlock,
    RunBlock,
    VerdictBlock,
)
from adeye.store.database import Database
from adeye.store.encoding import Dictionary, Texts
from adeye.store.evidence.roots import computed_root
from adeye.store.records import Block, EngineKey, EventRecord, MetricValue, VerdictRecord
from adeye.store.repository import Repository
from adeye.store.tables import METRIC_IDS
from adeye.store.texts import json_text

Verdicts = Mapping[str, Sequence[VerdictRecord]]
"""By result digest."""
COLUMNS = {
    "test_case": "test_cases",
    "situation": "situations",
    "parameters": "parameters",
    "point": "points",
    "replicate": "replicates",
    "inside_odd": "inside_odd",
    "point_index": "point_index",
}
"""Column of planned cases by what one case calls it."""


class PlannedCase(PlannedCases):
    """A part of a plan with one test case."""

    @property
    def test_case(self) -> str:
        return self.test_cases[0]

    @property
    def situation(self) -> str:
        return self.situations[0]

    @property
    def result_digest(self) -> str:
        return self.engine.result_digest(self.test_case)


def planned_case(**told: Any) -> PlannedCase:
    """Make a part of a plan from what one test case is; the others are as all parts have them."""
    values = {"structure": ""} | {COLUMNS.get(name, name): value for name, value in told.items()}
    for name, column in COLUMNS.items():
        is_json = name in {"parameters", "point"}
        values[column] = (json_text(dict(told[name])) if is_json else told[name],)
    return PlannedCase(**values)


@dataclass(frozen=True)
class RunRecord:
    """The result of one execution, by the names of ``RunBlock``."""

    test_case: str
    engine: EngineKey
    outcome: Outcome
    trace_rows: int
    duration_s: float
    trace_digest: str
    is_realised: bool
    end_reason: str
    metrics: Mapping[str, MetricValue]
    verdicts: Sequence[VerdictRecord]
    events: Sequence[EventRecord] = ()
    outcome_channel: str | None = None
    outcome_detail: str | None = None
    is_machine_dependent: bool = False
    executed_by: str = ""
    executed_at: datetime | None = None
    plugin_metrics: Mapping[str, Mapping[str, MetricValue]] = field(default_factory=dict)
    chain: str = ""

    @property
    def result_digest(self) -> str:
        return self.engine.result_digest(self.test_case)


def metric_block(ids: Sequence[str], records: Sequence[Mapping[str, MetricValue]]) -> MetricBlock:
    """Put the metrics of some runs into columns."""
    cells = [record[name] for record in records for name in ids]
    actors = Texts.of([cell.actor for cell in cells])

    def column(values: Sequence[Any], kind: Any) -> Any:
        return np.array(values, kind).reshape(len(records), len(ids))

    return MetricBlock(
        tuple(ids),
        column([np.nan if cell.value is None else cell.value for cell in cells], np.float64),
        column([STATUSES.index(cell.status) for cell in cells], np.int8),
        column([np.nan if cell.time_s is None else cell.time_s for cell in cells], np.float64),
        column(actors.codes.tolist(), np.int64),
        Dictionary((*actors.dictionary.words, None)),
    )


def event_block(records: Sequence[Sequence[EventRecord]]) -> EventBlock:
    """Put the events of some runs into columns."""
    pairs = [(run, record) for run, items in enumerate(records) for record in items]
    return EventBlock(
        np.array([run for run, _ in pairs], dtype=np.int64),
        np.array([item.time_s for _, item in pairs], dtype=np.float64),
        *(
            Texts.of([getattr(item, name) for _, item in pairs])
            for name in ("kind", "subject", "text")
        ),
    )


def run_block(records: Sequence[RunRecord]) -> RunBlock:
    """Put results that come one by one into columns."""
    engines = tuple(dict.fromkeys(record.engine for record in records))
    ids = tuple(records[0].metrics) if records else METRIC_IDS
    sets = {(name, tuple(of)) for item in records for name, of in item.plugin_metrics.items()}
    plugins = []
    for name, own in sorted(sets):
        runs = [
            at for at, item in enumerate(records) if tuple(item.plugin_metrics.get(name, ())) == own
        ]
        measured = metric_block(own, [records[run].plugin_metrics[name] for run in runs])
        plugins.append(PluginBlock(name, np.array(runs, dtype=np.int64), measured))

    def texts(name: str) -> Texts:
        return Texts.of([getattr(record, name) for record in records])

    def numbers(values: Sequence[Any], kind: Any = np.int64) -> Any:
        return np.array(values, dtype=kind)

    return RunBlock(
        tuple(record.test_case for record in records),
        engines,
        numbers([engines.index(record.engine) for record in records]),
        numbers([OUTCOMES.index(record.outcome) for record in records]),
        texts("outcome_channel"),
        texts("outcome_detail"),
        numbers([record.trace_rows for record in records]),
        numbers([record.duration_s for record in records], np.float64),
        tuple(record.trace_digest for record in records),
        numbers([record.is_realised for record in records], np.bool_),
        texts("end_reason"),
        numbers([record.is_machine_dependent for record in records], np.bool_),
        metric_block(ids, [record.metrics for record in records]),
        VerdictBlock.of([record.verdicts for record in records]),
        event_block([record.events for record in records]),
        texts("executed_by"),
        tuple(record.executed_at for record in records),
        tuple(plugins),
        tuple(record.chain for record in records),
    )


def complete_block(
    repository: Repository,
    block: Block,
    runs: Sequence[RunRecord],
    verdicts: Verdicts | None = None,
) -> bool:
    """Complete a block with results, and verdicts by result digest; whether it was still held."""
    return repository.complete_block(block, run_block(runs), JudgedBlock.of(verdicts or {}))


def add_verdicts(repository: Repository, verdicts: Verdicts) -> int:
    """Add verdicts to results that exist; return how many were new."""
    return repository.again.add(JudgedBlock.of(verdicts))


def result_table_hash(repository: Repository, campaign: str) -> str:
    """Hash all that came of a campaign: equal for every execution of one plan."""
    database = Database(repository.location)
    try:
        with database.read() as connection:
            root = computed_root(connection, campaign).root
            counted = connection.exec_driver_sql(
                "SELECT fsr_id, architecture, scenario, verdict, SUM(runs), SUM(exercised) "
                "FROM tally WHERE campaign_id = ? GROUP BY 1, 2, 3, 4 ORDER BY 1, 2, 3, 4",
                (campaign,),
            ).all()
    finally:
        database.close()
    return hashlib.sha256(
        f"{root} {[tuple(map(str, item)) for item in counted]}".encode()
    ).hexdigest()
