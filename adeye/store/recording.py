"""Write results: runs with metrics and events, verdicts, and the tallies over a block."""

from __future__ import annotations

import hashlib
import json
import math
from typing import TYPE_CHECKING, Any

from sqlalchemy import text

from adeye.errors import IntegrityError
from adeye.store import tables
from adeye.store.encoding import Row, chunks, clean_text, insert_rows, row, utc_text
from adeye.store.plugin_metrics import metric_row, record_plugin_metrics
from adeye.store.views import WORST_FIRST

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from sqlalchemy import Connection

    from adeye.store.rows import Artifact, RunRecord, VerdictRecord

RUN_HASHED = tuple(
    column.name
    for column in tables.run.columns
    if column.name not in {"result_hash", *tables.NONDETERMINISTIC["run"]}
)
"""Columns of ``run`` that the result hash covers."""

_TALLY = text(
    f"""
    WITH judged AS (
        SELECT w.campaign_id, f.fsr_id, f.fsr_digest, c.architecture, c.scenario, v.verdict,
            v.exercised, v.robustness_low AS worst_robustness, v.margin AS worst_margin,
            v.unit AS worst_unit, v.result_digest AS worst_result_digest
        FROM work w
        JOIN campaign_case c ON c.campaign_id = w.campaign_id
            AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal
        JOIN campaign_fsr f ON f.campaign_id = c.campaign_id
            AND f.architecture = c.architecture AND f.scenario = c.scenario AND f.applicable
            AND CASE f.applies WHEN 'everywhere' THEN 1 WHEN 'inside' THEN c.inside_odd
                ELSE NOT c.inside_odd END
        JOIN verdict v ON v.result_digest = c.result_digest AND v.fsr_digest = f.fsr_digest
        WHERE w.id = :work_id),
    ranked AS (
        SELECT *, ROW_NUMBER() OVER same AS place, COUNT(*) OVER whole AS runs,
            SUM(exercised) OVER whole AS exercised_runs
        FROM judged
        WINDOW whole AS (PARTITION BY fsr_id, architecture, scenario, verdict),
            same AS (whole ORDER BY {WORST_FIRST}))
    SELECT :work_id, campaign_id, fsr_id, fsr_digest, architecture, scenario, verdict, runs,
        exercised_runs, worst_robustness, worst_margin, worst_unit, worst_result_digest
    FROM ranked WHERE place = 1 ORDER BY fsr_id, architecture, scenario, verdict
    """  # noqa: S608 - the order is a constant of this package
)


def tally_rows(connection: Connection, work_id: int) -> list[Row]:
    """Count the verdicts of a block from the verdict rows, worst first within each count."""
    return [
        row(tables.tally, tuple(counted))
        for counted in connection.execute(_TALLY, {"work_id": work_id})
    ]


def write_tallies(connection: Connection, work_id: int) -> None:
    """Save the tallies of a block whose cases all have their verdicts."""
    insert_rows(connection, tables.tally, tally_rows(connection, work_id))


def result_hash(run: Sequence[Any], metrics: Sequence[Any], events: Sequence[Row]) -> str:
    """Hash a result: trace digest, outcome, metrics and events (sha256 in hex).

    Args:
        run: Values of the columns ``RUN_HASHED``.
        metrics: Values of the metric row without its hash.
        events: Values of the event rows without their hashes, in order.
    """
    plain = [list(run), list(metrics), [list(item) for item in events]]
    content = json.dumps(plain, ensure_ascii=True, separators=(",", ":"))
    return hashlib.sha256(content.encode()).hexdigest()


def record_runs(connection: Connection, records: Iterable[RunRecord]) -> frozenset[str]:
    """Save results that are not there yet, without their verdicts.

    A result that exists must have the same trace: a test case has one result for each engine.

    Returns:
        Digests of results that exist and may differ, because they depend on the machine.

    Raises:
        IntegrityError: Two executions of one test case gave different traces.
    """
    by_digest: dict[str, RunRecord] = {}
    differing: set[str] = set()
    everything = list(records)
    for record in everything:
        known = by_digest.setdefault(record.result_digest, record)
        if _differs(record, known.trace_digest, is_excused=known.is_machine_dependent):
            differing.add(record.result_digest)
    existing = _existing(connection, list(by_digest))
    for digest, (trace_digest, machine_dependent) in existing.items():
        if _differs(by_digest[digest], trace_digest, is_excused=bool(machine_dependent)):
            differing.add(digest)
    runs: list[Row] = []
    metrics: list[Row] = []
    events: list[Row] = []
    for digest, record in by_digest.items():
        if digest in existing:
            continue
        measured = _metric_row(record)
        event_rows = _event_rows(record)
        runs.append(_run_row(record, measured, event_rows))
        metrics.append(measured)
        events += event_rows
    insert_rows(connection, tables.run, runs)
    insert_rows(connection, tables.metric, metrics)
    insert_rows(connection, tables.event, events)
    record_plugin_metrics(connection, everything, frozenset(differing))
    return frozenset(differing)


def _differs(record: RunRecord, trace_digest: str, *, is_excused: bool) -> bool:
    if trace_digest == record.trace_digest:
        return False
    if is_excused or record.is_machine_dependent:
        return True
    raise IntegrityError(
        f"run {record.result_digest[:12]}: two executions of one test case differ, traces "
        f"{trace_digest} and {record.trace_digest}. Something in it is not deterministic: look "
        "for time, threads or unseeded randomness in its channels and sensors."
    )


def _existing(connection: Connection, digests: Sequence[str]) -> dict[str, tuple[str, int]]:
    found: dict[str, tuple[str, int]] = {}
    table = tables.run
    for part in chunks(digests):
        rows = connection.execute(
            table.select()
            .with_only_columns(
                table.c.result_digest, table.c.trace_digest, table.c.machine_dependent
            )
            .where(table.c.result_digest.in_(part))
        )
        found.update({item[0]: (item[1], item[2]) for item in rows})
    return found


def _run_row(record: RunRecord, measured: Row, event_rows: Sequence[Row]) -> Row:
    engine = record.engine
    values = (
        record.result_digest,
        record.test_case,
        engine.backend,
        engine.variant,
        engine.numerics_version,
        engine.plugins_digest,
        str(record.outcome),
        record.outcome_channel,
        record.outcome_detail,
        record.trace_rows,
        record.duration_s,
        record.trace_digest,
        record.is_realised,
        record.end_reason,
        record.is_machine_dependent,
    )
    # Through a row and back, so that the hash covers the values as they will be read.
    late = ("", clean_text(record.executed_by), utc_text(record.executed_at))
    plain = row(tables.run, (*values, *late))[: len(values)]
    hashed = result_hash(plain, measured[:-1], [item[:-1] for item in event_rows])
    return row(tables.run, (*values, hashed, *late[1:]))


def _metric_row(record: RunRecord) -> Row:
    unknown = sorted(set(record.metrics) ^ set(tables.METRIC_IDS))
    if unknown:
        msg = f"metrics {unknown} are missing from the result or unknown to the database"
        raise ValueError(msg)
    return metric_row(tables.metric, record.result_digest, tables.METRIC_IDS, record.metrics)


def _event_rows(record: RunRecord) -> list[Row]:
    return [
        row(
            tables.event,
            (record.result_digest, seq, item.time_s, item.kind, item.subject, item.text),
        )
        for seq, item in enumerate(record.events)
    ]


def record_verdicts(
    connection: Connection,
    verdicts: Mapping[str, Sequence[VerdictRecord]],
    *,
    differing: frozenset[str] = frozenset(),
) -> int:
    """Save verdicts that are not there yet.

    Args:
        connection: In a write transaction.
        verdicts: Verdicts by result digest.
        differing: Results whose second execution may be judged differently.

    Returns:
        Number of rows added.

    Raises:
        IntegrityError: A result has another verdict for the same FSR already.
    """
    known: dict[tuple[str, str], str] = {}
    table = tables.verdict
    for part in chunks(list(verdicts)):
        rows = connection.execute(
            table.select()
            .with_only_columns(table.c.result_digest, table.c.fsr_digest, table.c.row_hash)
            .where(table.c.result_digest.in_(part))
        )
        known.update({(item[0], item[1]): item[2] for item in rows})
    added: list[Row] = []
    for digest, records in verdicts.items():
        for record in records:
            new = _verdict_row(digest, record)
            existing = known.get((digest, record.fsr_digest))
            if existing is None:
                known[digest, record.fsr_digest] = new[-1]
                added.append(new)
            elif existing != new[-1] and digest not in differing:
                raise IntegrityError(
                    f"run {digest[:12]}: FSR {record.fsr_id} was judged differently before. "
                    f"Judging must be deterministic; a changed FSR has another digest."
                )
    insert_rows(connection, table, added)
    return len(added)


def _verdict_row(digest: str, record: VerdictRecord) -> Row:
    return row(
        tables.verdict,
        (
            digest,
            record.fsr_digest,
            record.fsr_id,
            str(record.verdict),
            _finite(record.robustness_low),
            _finite(record.robustness_high),
            _finite(record.margin),
            record.unit,
            record.signal,
            record.predicate,
            _finite(record.time_s),
            record.actor,
            _finite(record.value),
            _finite(record.threshold),
            record.is_exercised,
            record.detail,
        ),
    )


def _finite(value: float | None) -> float | None:
    """Infinite, or NaN of an ERROR, is NULL: the verdict says what it means."""
    return value if value is not None and math.isfinite(value) else None


def record_artifact(connection: Connection, artifact: Artifact) -> None:
    """Note a kept file unless it is noted already; its name is its digest, never a path."""
    values = {
        "digest": artifact.digest,
        "kind": clean_text(artifact.kind),
        "result_digest": artifact.result_digest,
        "bytes": artifact.size_bytes,
        "created_at": utc_text(None),
    }
    known = tables.artifact.select().where(tables.artifact.c.digest == artifact.digest)
    if connection.execute(known).first() is None:
        connection.execute(tables.artifact.insert().values(**values))
