"""Summaries of a campaign: FSR status, gate, worst runs, the table of results and its hash."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import and_, between, case, func, or_, select, text

from adeye.evaluation.verdict import Verdict
from adeye.store import catalog, schema, tables
from adeye.store.pending import JUDGED, is_judged
from adeye.store.reading import run_ref, verdict_record
from adeye.store.stored import (
    DatabaseInfo,
    FsrStatus,
    NeverHeld,
    Progress,
    ResultTable,
    RunRef,
)
from adeye.store.views import COUNTED, MEASURED

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from datetime import date

    from sqlalchemy import Connection, Row, Select, Table

    from adeye.store.location import Location
    from adeye.store.rows import VerdictRecord

_CHUNK: Final = 1000

_STATUS: Final = text(
    "SELECT * FROM v_fsr_status WHERE campaign = :campaign ORDER BY fsr, architecture, scenario"
)
_GATE: Final = text("SELECT * FROM v_gate WHERE campaign = :campaign ORDER BY architecture, fsr")
_RESULTS: Final = text("SELECT * FROM v_runs WHERE campaign = :campaign ORDER BY ordinal")


def fsr_status(connection: Connection, campaign_id: str) -> tuple[FsrStatus, ...]:
    """Count the verdicts of every FSR by architecture and scenario, from the tallies."""
    found = connection.execute(_STATUS, {"campaign": campaign_id})
    return tuple(_status(item, item.scenario, item.verdict) for item in found)


def gate(connection: Connection, campaign_id: str, on: date) -> tuple[FsrStatus, ...]:
    """Fold every mandatory FSR for every architecture, over all scenarios.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
        on: Day on which waivers must still be valid.
    """
    found = connection.execute(_GATE, {"campaign": campaign_id})
    rows: list[FsrStatus] = []
    for item in found:
        is_waived = item.waived_until is not None and item.waived_until >= on.isoformat()
        rows.append(_status(item, "", item.verdict_waived if is_waived else item.verdict))
    return tuple(rows)


def never_held(
    connection: Connection, campaign_id: str
) -> dict[tuple[str, str], tuple[NeverHeld, ...]]:
    """List the nested implications that no run asked for, by FSR and architecture."""
    found: dict[tuple[str, str], tuple[NeverHeld, ...]] = {}
    query = tables.never_held.select().where(tables.never_held.c.campaign_id == campaign_id)
    for item in connection.execute(query.order_by(*tables.never_held.primary_key.columns)):
        key = item.fsr_id, item.architecture
        found[key] = (*found.get(key, ()), NeverHeld(item.antecedent, bool(item.decides)))
    return found


def _status(item: Row[Any], scenario: str, verdict: str | None) -> FsrStatus:
    values = item._mapping
    counts = {Verdict(name): int(values[column]) for name, column in COUNTED.items()}
    return FsrStatus(
        fsr=item.fsr,
        architecture=item.architecture,
        scenario=scenario,
        asil=item.asil,
        is_mandatory=bool(values.get("mandatory", True)),
        is_in_gate=bool(item.in_gate),
        is_applicable=bool(item.applicable),
        reason=item.reason,
        counts={**counts, Verdict.NOT_RUN: int(item.n_not_run)},
        exercised=item.exercised,
        runs_exercised=item.runs_exercised,
        repeated=item.repeated,
        repeated_passes=item.repeated_pass,
        planned=item.planned,
        min_exercised=item.min_exercised,
        waived_until=item.waived_until,
        worst_margin=item.worst_margin,
        worst_robustness=item.worst_robustness,
        unit=item.unit,
        worst_run=item.worst_run,
        verdict=None if verdict is None else Verdict(verdict),
    )


def progress(connection: Connection, campaign_id: str) -> Progress:
    """Count planned, executed and accounted test cases.

    A case is accounted for when its block is done: its result, verdicts and tallies are saved.
    """
    cases, run, work = tables.campaign_case, tables.run, tables.work
    planned, executed = connection.execute(
        select(func.count(), func.count(run.c.number))
        .select_from(cases.outerjoin(run, run.c.result_digest == cases.c.result_digest))
        .where(cases.c.campaign_id == campaign_id)
    ).one()
    accounted = connection.execute(
        select(func.coalesce(func.sum(work.c.to_ordinal - work.c.from_ordinal), 0)).where(
            work.c.campaign_id == campaign_id, work.c.state == "done"
        )
    ).scalar_one()
    return Progress(planned=planned, executed=executed, accounted=accounted)


def worst_runs(
    connection: Connection, campaign_id: str, fsr: str, *, limit: int, **only: str | None
) -> tuple[tuple[RunRef, VerdictRecord], ...]:
    """Return the runs with the least margin for an FSR, failed ones first; see ``WORST_FIRST``.

    Without a verdict those of ``MEASURED``: of a run that was not judged nothing is the worst.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
        fsr: Id of the FSR.
        limit: Most runs to return.
        only: Restrict ``architecture``, ``scenario`` or ``verdict`` to a value that is not None.
    """
    cases, judged = tables.campaign_case, tables.verdict
    wanted: dict[str, tuple[str, ...]] = {
        name: (value,) for name, value in only.items() if value is not None
    }
    wanted.setdefault("verdict", MEASURED)
    ranges = _blocks_of_worst(connection, campaign_id, fsr, limit, wanted)
    if not ranges:
        return ()
    columns = {
        "architecture": cases.c.architecture,
        "scenario": cases.c.scenario,
        "verdict": judged.c.verdict,
    }
    query = (
        _judged_cases(cases, judged)
        .where(
            cases.c.campaign_id == campaign_id,
            tables.campaign_fsr.c.fsr_id == fsr,
            or_(*(between(cases.c.ordinal, first, end - 1) for first, end in ranges)),
            *(columns[name].in_(values) for name, values in wanted.items()),
        )
        .order_by(
            *_worst_first(judged.c.verdict, judged.c.margin), cases.c.result_digest, cases.c.ordinal
        )
        .limit(limit)
    )
    return tuple((run_ref(item), verdict_record(item)) for item in connection.execute(query))


def info(connection: Connection, location: Location) -> DatabaseInfo:
    """Say what a database holds."""
    version = schema.read_version(connection) or ""
    size = catalog.size_bytes(connection)
    return DatabaseInfo(str(location), version, size, row_counts(connection))


def row_counts(connection: Connection) -> dict[str, int]:
    """Count the rows of every table."""
    return {
        table.name: connection.execute(select(func.count()).select_from(table)).scalar_one()
        for table in tables.metadata.sorted_tables
    }


def _blocks_of_worst(
    connection: Connection,
    campaign_id: str,
    fsr: str,
    limit: int,
    wanted: Mapping[str, tuple[str, ...]],
) -> list[tuple[int, int]]:
    """Find the ordinals among which the worst runs are, from the worst run of each tally.

    A run is among the worst n only if its tally is among the n whose worst is worst: each of those
    before holds a run that is worse, or as bad and of a lesser digest.
    """
    tally, work = tables.tally, tables.work
    query = (
        select(work.c.from_ordinal, work.c.to_ordinal)
        .join(tally, tally.c.work_id == work.c.id)
        .where(
            tally.c.campaign_id == campaign_id,
            tally.c.fsr_id == fsr,
            *(tally.c[name].in_(values) for name, values in wanted.items()),
        )
        .order_by(
            *_worst_first(tally.c.verdict, tally.c.worst_margin),
            tally.c.worst_result_digest,
            work.c.from_ordinal,
        )
        .limit(limit)
    )
    return sorted({(item.from_ordinal, item.to_ordinal) for item in connection.execute(query)})


def _worst_first(verdict: Any, margin: Any) -> tuple[Any, Any, Any]:
    """Order by badness: none, NULL, is the worst of a FAIL, else the best."""
    failed = verdict == Verdict.FAIL.value
    return (
        case((failed, 0), else_=1),
        case((margin.is_(None) == failed, 0), else_=1),
        margin,
    )


def _judged_cases(*columns: Any) -> Select[Any]:
    """Join the cases of campaigns with the verdicts that the campaigns ask for."""
    cases, fsrs = tables.campaign_case, tables.campaign_fsr
    run, judged = tables.run, tables.verdict
    return (
        select(*columns)
        .select_from(cases)
        .join(fsrs, is_judged())
        .join(run, run.c.result_digest == cases.c.result_digest)
        .join(
            judged,
            and_(judged.c.run_number == run.c.number, judged.c.fsr_digest == fsrs.c.fsr_digest),
        )
    )


def failed_among(
    connection: Connection, campaign_id: str, ordinals: Sequence[int]
) -> frozenset[int]:
    """Return those of some runs of a campaign that fail an FSR."""
    cases = tables.campaign_case
    query = _judged_cases(cases.c.ordinal).where(
        cases.c.campaign_id == campaign_id,
        cases.c.ordinal.in_(ordinals),
        tables.verdict.c.verdict == Verdict.FAIL.value,
    )
    return frozenset(connection.execute(query).scalars())


_FAILURES: Final = """SELECT architecture, channel, told, mastered, COUNT(*) FROM (
    SELECT c.architecture AS architecture, r.outcome_channel AS channel,
        r.outcome || ': ' || COALESCE(r.outcome_detail, '') AS told, {first} AS mastered
    FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest
    WHERE r.outcome_channel IS NOT NULL AND c.campaign_id = ?
    UNION ALL
    SELECT c.architecture, e.subject, e.text, {later}
    FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest
    JOIN event e ON e.run_number = r.number
    WHERE r.outcome_channel IS NOT NULL AND c.campaign_id = ? AND e.kind = 'channel'
        AND e.subject <> r.outcome_channel AND SUBSTR(e.text, 1, 8) = 'channel_'
) AS failed GROUP BY 1, 2, 3, 4 ORDER BY 1, 2, 3, 4"""
_MASTERED: Final = """CASE WHEN EXISTS (
    SELECT 1 FROM campaign_fsr f
    JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
    WHERE {judged} AND v.verdict = 'PASS' AND ({about})) THEN 1 ELSE 0 END"""


def failed_channels(
    connection: Connection, campaign_id: str, about: Sequence[tuple[str, str]] = ()
) -> tuple[tuple[str, str, str, bool, int], ...]:
    """Count the runs in which a channel failed, by architecture, channel and what happened.

    Those in which an FSR about the channel passes are counted apart.

    Few of many runs have such an outcome, so the runs are read as they lie in the file, and only
    for those the cases are looked up. The outcome is that of the channel that failed first; those
    that failed after it are among the events.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
        about: Pairs of an FSR and the channel that it is about.
    """
    named = [value for pair in about for value in pair]
    sides = {
        name: _MASTERED.format(
            judged=JUDGED, about=" OR ".join([f"(f.fsr_id = ? AND {column} = ?)"] * len(about))
        )
        if about
        else "0"
        for name, column in (("first", "r.outcome_channel"), ("later", "e.subject"))
    }
    found = connection.exec_driver_sql(
        _FAILURES.format(**sides), (*named, campaign_id, *named, campaign_id)
    )
    return tuple((item[0], item[1], item[2], bool(item[3]), int(item[4])) for item in found)


def contacts(connection: Connection, campaign_id: str) -> dict[str, int]:
    """Count the runs that a contact ended, by architecture."""
    found = connection.exec_driver_sql(
        "SELECT c.architecture, COUNT(*) "
        "FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest "
        "WHERE r.end_reason = 'contact' AND c.campaign_id = ? GROUP BY 1 ORDER BY 1",
        (campaign_id,),
    )
    return {item[0]: int(item[1]) for item in found}


def results(connection: Connection, campaign_id: str) -> ResultTable:
    """Return every executed run of a campaign as ``v_runs`` shows it."""
    found = connection.execute(_RESULTS, {"campaign": campaign_id})
    return ResultTable(tuple(found.keys()), tuple(tuple(item) for item in found))


def result_table_hash(connection: Connection, campaign_id: str) -> str:
    """Hash the results of a campaign in the order of its plan (sha256 in hex).

    Covered are plan, runs, metrics, events, verdicts of the campaign's FSRs, and the tallies summed
    over blocks; not covered are the columns ``NONDETERMINISTIC``. Two executions of one plan, with
    whatever workers, blocks, order and interruptions, have one hash.
    """
    state = hashlib.sha256()
    for name, query in _hashed(campaign_id):
        found = connection.execute(query, execution_options={"yield_per": _CHUNK})
        for item in found:
            values = [int(value) if isinstance(value, bool) else value for value in item]
            line = json.dumps([name, values], ensure_ascii=True, separators=(",", ":"))
            state.update(line.encode())
    return state.hexdigest()


def _hashed(campaign_id: str) -> Iterator[tuple[str, Select[Any]]]:
    cases = tables.campaign_case
    of_campaign = cases.c.campaign_id == campaign_id
    yield "case", select(cases).where(of_campaign).order_by(cases.c.ordinal)
    run = tables.run
    of_run = cases.join(run, run.c.result_digest == cases.c.result_digest)
    yield (
        "run",
        select(cases.c.ordinal, *_deterministic(run))
        .select_from(of_run)
        .where(of_campaign)
        .order_by(cases.c.ordinal),
    )
    for table in (tables.metric, tables.event):
        key = list(table.primary_key.columns)[1:]
        yield (
            table.name,
            select(cases.c.ordinal, *_deterministic(table))
            .select_from(of_run.join(table, table.c.run_number == run.c.number))
            .where(of_campaign)
            .order_by(cases.c.ordinal, *key),
        )
    judged = tables.verdict
    yield (
        "verdict",
        _judged_cases(cases.c.ordinal, *_deterministic(judged))
        .where(of_campaign)
        .order_by(cases.c.ordinal, judged.c.fsr_id),
    )
    tally = tables.tally
    key = [tally.c.fsr_id, tally.c.architecture, tally.c.scenario, tally.c.verdict]
    yield (
        "tally",
        select(*key, func.sum(tally.c.runs), func.sum(tally.c.exercised))
        .where(tally.c.campaign_id == campaign_id)
        .group_by(*key)
        .order_by(*key),
    )


def _deterministic(table: Table) -> list[Any]:
    """List columns that are the same in every database; a run goes by its digest."""
    excluded = ("run_number", *tables.NONDETERMINISTIC.get(table.name, ()))
    digest = [] if table is tables.run else [tables.run.c.result_digest]
    return [*digest, *(column for column in table.columns if column.name not in excluded)]
