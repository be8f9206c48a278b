"""Read campaigns, summaries, runs and test cases."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import and_, between, case, func, or_, select, text

from adeye.errors import InputError, UsageError
from adeye.judge.verdict import Verdict
from adeye.store import catalogue as catalog
from adeye.store import schema, tables
from adeye.store.cases import JUDGED, is_judged
from adeye.store.owner import clock_now, is_abandoned
from adeye.store.plugin_metrics import metric_values, plugin_metrics
from adeye.store.records import (
    Artifact,
    CampaignInfo,
    DatabaseInfo,
    EventRecord,
    ForkRecord,
    FsrStatus,
    MetricValue,
    NeverHeld,
    Progress,
    ResultTable,
    RunRef,
    StoredCase,
    StoredRun,
    VerdictRecord,
    WorkState,
)
from adeye.store.tables import CRITICALITY_IDS, FIRST_METRIC_IDS, TIMING_IDS, work
from adeye.store.views import COUNTED, MEASURED
from adeye.trace import split_links

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from datetime import date

    from sqlalchemy import Connection, Row, Select, Table

    from adeye.store.location import Location

# --- What a run is besides a run of a campaign, and how far the blocks of a campaign are ----------


def find_fork(connection: Connection, result_digest: str) -> ForkRecord | None:
    """Say what a run is a fork of; None if it is none."""
    table = tables.fork
    found = connection.execute(table.select().where(table.c.result_digest == result_digest)).first()
    return None if found is None else _fork(found)


@dataclass(frozen=True, slots=True)
class DriveRef:
    """A drive of a reference driver that no campaign has planned.

    Attributes:
        origin: Result digest of a run that it is held against.
        test_case: Of the drive.
        architecture: Id of the architecture that the driver is.
    """

    origin: str
    test_case: str
    architecture: str


def find_drive(connection: Connection, result_digest: str) -> DriveRef | None:
    """Say what a run is held against; None if it is no drive, or a run of a campaign too."""
    found = connection.exec_driver_sql(
        "SELECT b.result_digest, r.test_case_digest, a.id FROM benchmark b "
        "JOIN run r ON r.result_digest = b.drive_digest "
        "JOIN test_case t ON t.digest = r.test_case_digest "
        "JOIN architecture a ON a.digest = t.architecture_digest "
        "WHERE b.drive_digest = ? AND NOT EXISTS "
        "(SELECT 1 FROM campaign_case c WHERE c.result_digest = b.drive_digest) "
        "ORDER BY b.result_digest LIMIT 1",
        (result_digest,),
    ).first()
    return None if found is None else DriveRef(*found)


def fork_of_case(connection: Connection, test_case: str) -> ForkRecord | None:
    """Say what the runs of a test case are forks of; None if it is the case of no fork.

    All forks of one test case have the same authority from the same tick.
    """
    table = tables.fork
    found = connection.execute(
        table.select()
        .where(table.c.test_case_digest == test_case)
        .order_by(table.c.result_digest)
        .limit(1)
    ).first()
    return None if found is None else _fork(found)


def _fork(found: Row[Any]) -> ForkRecord:
    return ForkRecord(
        found.result_digest,
        found.test_case_digest,
        found.origin_digest,
        found.from_tick,
        found.authority,
    )


def find_half_step(connection: Connection, result_digest: str) -> tuple[str, str] | None:
    """Give test case and run with the whole step of a twin; None if it is none."""
    table = tables.half_step
    found = connection.execute(table.select().where(table.c.result_digest == result_digest)).first()
    return None if found is None else (found.test_case_digest, found.origin_digest)


def work_state(connection: Connection, campaign_id: str) -> WorkState:
    """Count the blocks of a campaign by state; a block whose owner is gone counts as pending."""
    blocks = connection.execute(select(work).where(work.c.campaign_id == campaign_id)).all()
    now = clock_now(connection)
    counted = Counter(
        "pending" if block.state == "leased" and is_abandoned(block, now) else block.state
        for block in blocks
    )
    return WorkState(
        pending=counted["pending"],
        leased=counted["leased"],
        done=counted["done"],
        quarantined=counted["quarantined"],
    )


# --- Read campaigns, summaries, runs and test cases -----------------------------------------------

MIN_PREFIX: Final = 4
"""Fewest characters of a digest that name a run or campaign."""
_LISTED: Final = 10
_CHUNK: Final = 1000


def campaigns(connection: Connection) -> tuple[CampaignInfo, ...]:
    """List campaigns, the newest first."""
    table = tables.campaign
    found = connection.execute(table.select().order_by(table.c.number.desc())).all()
    return tuple(_campaign(connection, item) for item in found)


def latest_id(connection: Connection, odd: str | None = None) -> str | None:
    """Return the id of the campaign that was planned last, of one ODD if its id is given."""
    found = connection.exec_driver_sql(
        "SELECT campaign FROM v_campaigns WHERE odd = coalesce(?, odd) ORDER BY recency LIMIT 1",
        (odd,),
    )
    return found.scalar()


def latest_campaign(connection: Connection, odd: str | None) -> CampaignInfo | None:
    """Return the campaign that was planned last, of one ODD if its id is given."""
    table, latest = tables.campaign, latest_id(connection, odd)
    if latest is None:
        return None
    return _campaign(
        connection, connection.execute(table.select().where(table.c.id == latest)).one()
    )


def find_campaign(connection: Connection, name: str | None = None) -> CampaignInfo:
    """Find a campaign by its id, the beginning of it, or its number; without a name the latest.

    Raises:
        InputError: None or several match; the message names those that there are.
    """
    if name is None:
        latest = latest_campaign(connection, None)
        if latest is None:
            raise UsageError("the database has no campaign", remedy="Run an ODD first.")
        return latest
    table = tables.campaign
    if name.isascii() and name.isdigit() and len(name) < 10:
        numbered = connection.execute(table.select().where(table.c.number == int(name))).first()
        if numbered is not None:
            return _campaign(connection, numbered)
    try:
        ids = _starting_with(connection, (table.c.id,), name, "campaign")
    except InputError as error:
        remedy = f"{error.remedy} {_known_campaigns(connection)}".strip()
        raise InputError(error.message, remedy=remedy) from error
    found = connection.execute(table.select().where(table.c.id == ids)).one()
    return _campaign(connection, found)


def _known_campaigns(connection: Connection) -> str:
    """Name the newest campaigns by number, id and ODD."""
    table = tables.campaign
    found = connection.execute(
        select(table.c.number, table.c.id, table.c.odd_id)
        .order_by(table.c.number.desc())
        .limit(_LISTED + 1)
    ).all()
    if not found:
        return "The database has no campaign; run an ODD first."
    listed = ", ".join(f"{item.number} ({item.odd_id}, {item.id[:10]})" for item in found[:_LISTED])
    return f"There are: {listed}{', …' if len(found) > _LISTED else ''}."


def _campaign(connection: Connection, item: Row[Any]) -> CampaignInfo:
    return CampaignInfo(
        id=item.id,
        number=item.number,
        created_at=item.created_at,
        odd=item.odd_id,
        odd_digest=item.odd_digest,
        concept_digest=item.concept_digest,
        title=item.title,
        planned=item.planned,
        gate=tuple(json.loads(item.gate)),
        factors=json.loads(item.factors),
        provenance=json.loads(item.provenance),
        work=work_state(connection, item.id),
    )


def _starting_with(connection: Connection, columns: Sequence[Any], prefix: str, what: str) -> str:
    """Find the one value of some digest columns that begins with a prefix."""
    if len(prefix) < MIN_PREFIX or not set(prefix) <= set("0123456789abcdef"):
        number = "no number of one and " if what == "campaign" else ""
        raise InputError(
            f"{what} {prefix!r}: {number}not the beginning of a digest",
            remedy=f"Give at least {MIN_PREFIX} of its characters (0-9, a-f).",
        )
    matches = sorted(
        {
            str(match)
            for column in columns
            for match in connection.execute(
                select(column)
                .where(column >= prefix, column < prefix + "g")
                .distinct()
                .order_by(column)
                .limit(_LISTED + 1)
            ).scalars()
        }
    )
    if not matches:
        raise InputError(
            f"{what} {prefix!r}: there is none",
            remedy="" if what == "campaign" else "Runs are in the view v_runs: see 'adeye query'.",
        )
    if len(matches) > 1:
        listed = ", ".join(item[: len(prefix) + 8] for item in matches[:_LISTED])
        more = ", …" if len(matches) > _LISTED else ""
        raise InputError(
            f"{what} {prefix!r} is ambiguous: {listed}{more}", remedy="Give more characters."
        )
    return matches[0]


def find_run(connection: Connection, name: str, campaign_id: str | None) -> RunRef:
    """Find a run by the beginning of its result digest, or by its ordinal in a campaign.

    A fork stands where the run stands that it is a fork of, and so does a twin with half the step;
    a reference drive where one stands that it is held against.

    Raises:
        InputError: None or several match, or an ordinal comes without a campaign.
    """
    cases = tables.campaign_case
    query = select(cases, tables.run.c.number.is_not(None).label("is_done")).outerjoin(
        tables.run, tables.run.c.result_digest == cases.c.result_digest
    )
    if campaign_id is not None:
        query = query.where(cases.c.campaign_id == campaign_id)
    if name.isascii() and name.isdigit() and len(name) < 10 and campaign_id is not None:
        by_ordinal = connection.execute(query.where(cases.c.ordinal == int(name))).first()
        if by_ordinal is not None:
            return run_ref(by_ordinal)
    columns = (
        cases.c.result_digest,
        tables.fork.c.result_digest,
        tables.half_step.c.result_digest,
        tables.benchmark.c.drive_digest,
    )
    digest = _starting_with(connection, columns, name, "run")
    fork, drive = find_fork(connection, digest), find_drive(connection, digest)
    planned = digest if fork is None else fork.origin
    planned = planned if drive is None else drive.origin
    twin = find_half_step(connection, planned)
    recency = text(
        "(SELECT recency FROM v_campaigns v WHERE v.campaign = campaign_case.campaign_id)"
    )
    found = connection.execute(
        query.join(tables.campaign, tables.campaign.c.id == cases.c.campaign_id)
        .where(cases.c.result_digest == (planned if twin is None else twin[1]))
        .order_by(recency, cases.c.ordinal)
    ).first()
    if found is None:
        raise InputError(
            f"run {name!r} is not in campaign {campaign_id}", remedy="Name the campaign it is in."
        )
    ref = run_ref(found)
    if drive is not None:
        return replace(
            ref,
            result_digest=digest,
            test_case=drive.test_case,
            architecture=drive.architecture,
            is_done=True,
            is_drive=True,
        )
    if fork is not None:
        return replace(ref, result_digest=digest, test_case=fork.test_case, is_done=True)
    if twin is not None:
        return replace(ref, result_digest=digest, test_case=twin[0], is_done=True)
    return ref


def run_ref(item: Row[Any]) -> RunRef:
    """Read a reference to a run from a row of ``campaign_case``; done unless it says otherwise."""
    return RunRef(
        campaign=item.campaign_id,
        ordinal=item.ordinal,
        result_digest=item.result_digest,
        test_case=item.test_case_digest,
        scenario=item.scenario,
        architecture=item.architecture,
        inside_odd=bool(item.inside_odd),
        is_done=bool(item._mapping.get("is_done", True)),
        point=json.loads(item._mapping.get("point", "{}")),
    )


def run_row(connection: Connection, result_digest: str) -> StoredRun | None:
    """Read a result with its metrics, verdicts and events; None if it was not executed yet."""
    run, metric, verdict, event = tables.run, tables.metric, tables.verdict, tables.event
    found = connection.execute(run.select().where(run.c.result_digest == result_digest)).first()
    if found is None:
        return None
    number = found.number
    metrics = connection.execute(metric.select().where(metric.c.run_number == number)).one()
    verdicts = connection.execute(
        verdict.select()
        .where(verdict.c.run_number == number)
        .order_by(verdict.c.fsr_id, verdict.c.fsr_digest)
    )
    events = connection.execute(
        event.select().where(event.c.run_number == number).order_by(event.c.seq)
    )
    return StoredRun(
        row=dict(found._mapping),
        metrics={
            **metric_values(metrics._mapping, FIRST_METRIC_IDS),
            **_later(connection, number, tables.timing, TIMING_IDS),
            **_later(connection, number, tables.criticality, CRITICALITY_IDS),
        },
        verdicts=tuple(verdict_record(item) for item in verdicts),
        events=tuple(
            EventRecord(item.time_s, item.kind, item.subject, item.text) for item in events
        ),
        plugin_metrics=plugin_metrics(connection, number),
        links=_links(connection, number),
    )


def _later(
    connection: Connection, number: int, table: Table, ids: Sequence[str]
) -> dict[str, MetricValue]:
    """Read the metrics that a run of an older release lacks."""
    found = connection.execute(table.select().where(table.c.run_number == number)).first()
    return {} if found is None else metric_values(found._mapping, ids)


def _links(connection: Connection, number: int) -> tuple[str, ...] | None:
    """Read the links of the digest chain of a run before its trace digest."""
    table = tables.chain
    found = connection.execute(select(table.c.links).where(table.c.run_number == number)).scalar()
    return None if found is None else split_links(found)


def verdict_record(item: Row[Any]) -> VerdictRecord:
    """Read a verdict from a row of ``verdict``."""
    return VerdictRecord(
        fsr_id=item.fsr_id,
        fsr_digest=item.fsr_digest,
        verdict=Verdict(item.verdict),
        is_exercised=bool(item.exercised),
        robustness_low=item.robustness_low,
        robustness_high=item.robustness_high,
        margin=item.margin,
        unit=item.unit,
        signal=item.signal,
        predicate=item.predicate,
        time_s=item.time_s,
        actor=item.actor,
        value=item.value,
        threshold=item.threshold,
        detail=item.detail,
    )


def test_case_row(connection: Connection, test_case: str) -> StoredCase:
    """Read a test case with the content that it needs.

    Raises:
        InputError: There is no such test case.
    """
    cases, scenario, architecture = tables.test_case, tables.scenario, tables.architecture
    found = connection.execute(
        select(
            cases,
            scenario.c.content.label("scenario_content"),
            architecture.c.content.label("architecture_content"),
        )
        .join(scenario, scenario.c.digest == cases.c.scenario_digest)
        .join(architecture, architecture.c.digest == cases.c.architecture_digest)
        .where(cases.c.digest == test_case)
    ).first()
    if found is None:
        raise InputError(f"test case {test_case!r}: there is none", remedy="Plan its ODD first.")
    return StoredCase(
        test_case=found.digest,
        situation=found.situation_digest,
        scenario=json.loads(found.scenario_content),
        architecture=json.loads(found.architecture_content),
        faults=tuple(json.loads(found.faults)),
        fault_entry=found.fault_entry,
        parameters=json.loads(found.parameters),
        replicate=found.replicate,
        seed=found.seed,
        step_s=found.step_s,
        odd_digest=found.odd_digest,
        point_index=found.point_index,
        fork=fork_of_case(connection, found.digest),
    )


def content(connection: Connection, kind: str, digest: str) -> Any:
    """Read the content that a user wrote by its digest.

    Raises:
        InputError: There is none.
    """
    table = {
        "odd": tables.odd,
        "scenario": tables.scenario,
        "architecture": tables.architecture,
        "concept": tables.concept,
    }[kind]
    found = connection.execute(select(table.c.content).where(table.c.digest == digest)).scalar()
    if found is None:
        raise InputError(f"{kind} {digest!r}: there is none", remedy="Plan its ODD first.")
    return json.loads(found)


def artifacts(connection: Connection, result_digest: str) -> tuple[Artifact, ...]:
    """List the kept files of a run."""
    table = tables.artifact
    found = connection.execute(
        table.select().where(table.c.result_digest == result_digest).order_by(table.c.digest)
    )
    return tuple(Artifact(item.digest, item.kind, item.result_digest, item.bytes) for item in found)


# --- Summaries of a campaign: FSR status, gate, worst runs, the table of results and its hash -----

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
