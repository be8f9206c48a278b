"""Read campaigns, summaries, runs and test cases."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import select, text

from adeye.errors import InputError, UsageError
from adeye.evaluation.verdict import Verdict
from adeye.store import tables
from adeye.store.found import find_drive, find_fork, find_half_step, fork_of_case, work_state
from adeye.store.metric_ids import CRITICALITY_IDS, FIRST_METRIC_IDS, TIMING_IDS
from adeye.store.plugin_metrics import metric_values, plugin_metrics
from adeye.store.rows import Artifact, EventRecord, MetricValue, VerdictRecord
from adeye.store.stored import CampaignInfo, RunRef, StoredCase, StoredRun
from adeye.trace import split_links

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sqlalchemy import Connection, Row, Table

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
