"""Read campaigns, summaries, runs and test cases."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from operator import itemgetter
from typing import Any, Final

from sqlalchemy import Connection, Row, RowMapping, func, select, text

from adeye.errors import InputError, IntegrityError, UsageError, require_known
from adeye.identity import split_links
from adeye.judge.verdict import Verdict
from adeye.notices import notice
from adeye.store import catalogue as catalog
from adeye.store import records, schema
from adeye.store import run_tables as tables
from adeye.store.cases import JUDGED, JUDGED_CASES, TWINS, standing
from adeye.store.location import Location
from adeye.store.owner import clock_now, is_abandoned
from adeye.store.plugin_metrics import ids_of, metric_values, plugin_metrics, plugin_tables
from adeye.store.sql import filled
from adeye.store.table_parts import TABLES, WORK_STATES
from adeye.store.texts import clean_text
from adeye.store.views import COUNTED, MEASURED, WORST_FIRST

# --- What a run is besides a run of a campaign, and how far the blocks of a campaign are ----------


LATEST: Final = "latest"
"""Name of the campaign that was planned last."""
_COUNTED: Final = re.compile(r"@\{-([0-9]{1,6})\}")
_BESIDE: Final = (
    "SELECT origin_digest AS origin, test_case_digest AS test_case FROM fork "
    "WHERE result_digest = ?",
    "SELECT b.result_digest AS origin, r.test_case_digest AS test_case, a.id AS architecture "
    "FROM benchmark b JOIN run r ON r.result_digest = b.drive_digest "
    "JOIN test_case t ON t.digest = r.test_case_digest "
    "JOIN architecture a ON a.digest = t.architecture_digest "
    "WHERE b.drive_digest = ? AND NOT EXISTS "
    "(SELECT 1 FROM campaign_case c WHERE c.result_digest = b.drive_digest) "
    "ORDER BY b.result_digest LIMIT 1",
)
"""Beside which run another one stands, and what it has otherwise than that: a fork, and a drive of
a reference driver that no campaign has planned."""
_TWIN: Final = (
    "SELECT origin_digest AS origin, test_case_digest AS test_case FROM half_step "
    "WHERE result_digest = ?"
)
"""The same of a twin with half the step."""


def _beside(connection: Connection, result_digest: str, *queries: str) -> dict[str, Any]:
    """Return what the first of some queries tells of a run; nothing if none does."""
    for query in queries:
        found = connection.exec_driver_sql(query, (result_digest,)).first()
        if found is not None:
            return dict(found._mapping)
    return {}


def fork_of_case(connection: Connection, test_case: str) -> records.ForkRecord | None:
    """Say what the runs of a test case are forks of; None if it is the case of no fork.

    All forks of one test case have the same authority from the same tick.
    """
    found = connection.exec_driver_sql(
        "SELECT result_digest, test_case_digest, origin_digest, from_tick, authority "
        "FROM fork WHERE test_case_digest = ? ORDER BY result_digest LIMIT 1",
        (test_case,),
    ).first()
    return None if found is None else records.ForkRecord(*found)


def work_state(connection: Connection, campaign_id: str) -> records.WorkState:
    """Count the blocks of a campaign by state; a block whose owner is gone counts as pending."""
    blocks = connection.execute(
        select(tables.work).where(tables.work.c.campaign_id == campaign_id)
    ).all()
    now = clock_now(connection)
    states = [
        "pending" if block.state == "leased" and is_abandoned(block, now) else block.state
        for block in blocks
    ]
    counted = Counter(states)
    return records.WorkState(
        **{state: counted[state] for state in WORK_STATES},
        to_judge=sum(
            block.kind == "judge" and state == "pending"
            for block, state in zip(blocks, states, strict=True)
        ),
    )


# --- Read campaigns, summaries, runs and test cases -----------------------------------------------

MIN_PREFIX: Final = 4
"""Fewest characters of a digest that name a run or campaign."""
_LISTED: Final = 10
_CHUNK: Final = 1000


def campaigns(connection: Connection) -> tuple[records.CampaignInfo, ...]:
    """List campaigns, the newest first."""
    return tuple(_campaigns(connection))


def latest_id(connection: Connection, odd: str | None = None) -> str | None:
    """Return the id of the campaign that was planned last, of one ODD if its id is given."""
    return next(iter(latest_ids(connection, odd, 1)), None)


def latest_ids(
    connection: Connection, odd: str | None = None, limit: int = 1_000_000
) -> tuple[str, ...]:
    """List ids of campaigns, the one first that was planned last.

    Args:
        connection: In a transaction.
        odd: Id of their ODD; None for all.
        limit: Most of them.
    """
    found = connection.exec_driver_sql(
        "SELECT campaign FROM v_campaigns WHERE odd = coalesce(?, odd) ORDER BY recency LIMIT ?",
        (None if odd is None else clean_text(odd), limit),
    )
    return tuple(found.scalars())


def latest_campaign(connection: Connection, odd: str | None = None) -> records.CampaignInfo | None:
    """Return the campaign that was planned last, of one ODD if its id is given."""
    return next(_campaigns(connection, id=latest_id(connection, odd)), None)


def find_campaign(connection: Connection, name: str | None = None) -> records.CampaignInfo:
    """Find a campaign by its number, the beginning of its digest, or as the latest of an ODD.

    Args:
        connection: In a transaction.
        name: Without one, or as ``latest``, the one that was planned last; ``@{-1}`` is the one
            before it of the same ODD, and so on.

    Raises:
        InputError: None or several match; the message names those that there are.
        IntegrityError: One was there, and is gone.
    """
    if name is not None and (counted := _COUNTED.fullmatch(name)):
        return campaign_before(connection, find_campaign(connection), int(counted[1]))
    if name is None or name == LATEST:
        latest = latest_campaign(connection)
        if latest is None:
            from adeye.store.evidence.ledger_check import require_no_campaign_gone

            require_no_campaign_gone(connection)
            raise UsageError("the database has no campaign", remedy="Run an ODD first.")
        return latest
    if name.isascii() and name.isdigit() and len(name) < 10:
        for numbered in _campaigns(connection, number=int(name)):
            return numbered
    of_odd = latest_campaign(connection, name)
    if of_odd is not None:
        return of_odd
    try:
        found = _starting_with(connection, (tables.campaign.c.id,), name, "campaign")
    except InputError as error:
        from adeye.store.evidence.ledger_check import require_no_campaign_gone

        require_no_campaign_gone(connection)
        remedy = f"{error.remedy} {_known_campaigns(connection)}".strip()
        raise InputError(error.message, remedy=remedy) from error
    return next(_campaigns(connection, id=found))


def campaign_before(
    connection: Connection, campaign: records.CampaignInfo, count: int = 1
) -> records.CampaignInfo:
    """Find the campaign that was planned so many before another one, among those of its ODD.

    Raises:
        UsageError: There are fewer.
    """
    others = latest_ids(connection, campaign.odd)
    place = others.index(campaign.id) + count
    if place >= len(others):
        raise UsageError(
            f"{campaign.odd} has no campaign {count} before number {campaign.number}",
            remedy="Name one by its number, see adeye query campaigns; or edit and run it first.",
        )
    return next(_campaigns(connection, id=others[place]))


def _known_campaigns(connection: Connection) -> str:
    """Name the newest campaigns by number, id and ODD."""
    found = connection.exec_driver_sql(
        "SELECT number, id, odd_id FROM campaign ORDER BY number DESC LIMIT ?", (_LISTED + 1,)
    ).all()
    if not found:
        return "The database has no campaign; run an ODD first."
    listed = ", ".join(f"{item.number} ({item.odd_id}, {item.id[:10]})" for item in found[:_LISTED])
    return f"There are: {listed}{', …' if len(found) > _LISTED else ''}."


def _campaigns(connection: Connection, **only: Any) -> Iterator[records.CampaignInfo]:
    """Read the campaigns that have some values, the newest first."""
    query = tables.campaign.select().filter_by(**only).order_by(tables.campaign.c.number.desc())
    for item in connection.execute(query).all():
        yield records.of_row(
            records.CampaignInfo,
            item._mapping,
            odd=item.odd_id,
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


def find_run(connection: Connection, name: str, campaign: str | None = None) -> records.RunRef:
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
    if campaign is not None:
        query = query.where(cases.c.campaign_id == campaign)
    if name.isascii() and name.isdigit() and len(name) < 10 and campaign is not None:
        by_ordinal = connection.execute(query.where(cases.c.ordinal == int(name))).first()
        if by_ordinal is not None:
            return _unless_withdrawn(connection, run_ref(by_ordinal))
    columns = (
        cases.c.result_digest,
        tables.fork.c.result_digest,
        tables.half_step.c.result_digest,
        tables.benchmark.c.drive_digest,
    )
    digest = _starting_with(connection, columns, name, "run")
    own = _beside(connection, digest, *_BESIDE)
    planned = own.pop("origin", digest)
    # A fork may be one of a twin.
    own = _beside(connection, planned, _TWIN) | own
    planned = own.pop("origin", planned)
    recency = text(
        "(SELECT recency FROM v_campaigns v WHERE v.campaign = campaign_case.campaign_id)"
    )
    found = connection.execute(
        query.join(tables.campaign, tables.campaign.c.id == cases.c.campaign_id)
        .where(cases.c.result_digest == planned)
        .order_by(recency, cases.c.ordinal)
    ).first()
    if found is None:
        raise InputError(
            f"run {name!r} is not in campaign {campaign}", remedy="Name the campaign it is in."
        )
    ref = _unless_withdrawn(connection, run_ref(found))
    if not own:
        return ref
    is_drive = "architecture" in own
    return replace(ref, result_digest=digest, is_done=True, is_drive=is_drive, **own)


def _unless_withdrawn(connection: Connection, ref: records.RunRef) -> records.RunRef:
    """Return a reference to a run; whoever asked is told if its result is withdrawn."""
    table = tables.withdrawal
    for item in connection.execute(
        table.select().where(table.c.result_digest == ref.result_digest)
    ):
        told = f"was withdrawn by {item.author}, so it is no evidence: {item.reason}"
        notice(f"run {ref.result_digest[:12]} {told}")
    return ref


def run_ref(item: Row[Any]) -> records.RunRef:
    """Read a reference to a run from a row of ``campaign_case``; done unless it says otherwise."""
    stored = item._mapping
    return records.of_row(
        records.RunRef,
        stored,
        campaign=item.campaign_id,
        test_case=item.test_case_digest,
        inside_odd=bool(item.inside_odd),
        is_done=bool(stored.get("is_done", True)),
        is_drive=False,
        point=json.loads(stored.get("point", "{}")),
    )


def run_row(connection: Connection, result_digest: str) -> records.StoredRun | None:
    """Read a result with its metrics, verdicts and events; None if it was not executed yet.

    Raises:
        IntegrityError: Its metrics are gone.
    """
    query = tables.run.select().where(tables.run.c.result_digest == result_digest)
    found = connection.execute(query).mappings().first()
    if found is None:
        return None
    number = found["number"]

    def rows(table: str) -> list[RowMapping]:
        own = connection.exec_driver_sql(f"SELECT * FROM {table} WHERE run_number = ?", (number,))  # noqa: S608 - own names
        return list(own.mappings())

    measured = rows("metric")
    if len(measured) != 1:
        raise IntegrityError(
            f"run {result_digest[:10]} has {len(measured)} rows of metrics. Restore the database "
            "from a copy; 'adeye db verify' names what is altered."
        )
    metrics = metric_values(measured[0], TABLES["metric"])
    # A run of an older release lacks the others.
    for table in ("timing", "criticality"):
        for later in rows(table):
            metrics |= metric_values(later, TABLES[table])
    verdicts = sorted(rows("verdict"), key=itemgetter("fsr_id", "fsr_digest"))
    events = sorted(rows("event"), key=itemgetter("seq"))
    links = [split_links(item["links"]) for item in rows("chain")]
    return records.StoredRun(
        row=dict(found),
        metrics=metrics,
        verdicts=tuple(map(records.verdict_record, verdicts)),
        events=tuple(records.of_row(records.EventRecord, item) for item in events),
        plugin_metrics=plugin_metrics(connection, number),
        links=links[0] if links else None,
    )


def test_case_row(connection: Connection, test_case: str) -> records.StoredCase:
    """Read a test case with the content that it needs.

    Raises:
        IntegrityError: It, its scenario or its architecture is gone: who asks has read its digest.
    """
    found = connection.exec_driver_sql(
        "SELECT t.*, s.content AS scenario_content, a.content AS architecture_content "
        "FROM test_case t JOIN scenario s ON s.digest = t.scenario_digest "
        "JOIN architecture a ON a.digest = t.architecture_digest WHERE t.digest = ?",
        (test_case,),
    ).first()
    if found is None:
        raise _gone("test case", test_case)
    return records.of_row(
        records.StoredCase,
        found._mapping,
        test_case=found.digest,
        situation=found.situation_digest,
        scenario=json.loads(found.scenario_content),
        architecture=json.loads(found.architecture_content),
        faults=tuple(json.loads(found.faults)),
        parameters=json.loads(found.parameters),
        fork=fork_of_case(connection, found.digest),
    )


def content(connection: Connection, kind: str, digest: str) -> Any:
    """Read the content that a user wrote by its digest.

    Raises:
        IntegrityError: It is gone: who asks has read its digest.
    """
    found = connection.exec_driver_sql(
        f"SELECT content FROM {tables.CONTENT[kind].name} WHERE digest = ?",  # noqa: S608 - own names
        (digest,),
    ).scalar()
    if found is None:
        raise _gone(kind, digest)
    return json.loads(found)


def _gone(kind: str, digest: str) -> IntegrityError:
    return IntegrityError(
        f"{kind} {digest[:12]} is gone, to which the database refers. See 'adeye db verify'; "
        "restore it from a copy."
    )


def plain_digests(connection: Connection, campaign_id: str) -> dict[str, str]:
    """Give the digest of each FSR of a campaign without what half the step told.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
    """
    found = connection.exec_driver_sql(
        "SELECT f.fsr_id, COALESCE(u.fsr_digest, f.fsr_digest) FROM campaign_fsr f "
        "LEFT JOIN uncertainty u ON u.judged_digest = f.fsr_digest WHERE f.campaign_id = ?",
        (campaign_id,),
    )
    return {str(name): str(digest) for name, digest in found}


def judged_digests(
    connection: Connection, run: records.RunRef, stored: records.StoredRun
) -> dict[str, str]:
    """Give the digest of each FSR that a run is judged by, with numeric uncertainty if it was.

    Forks and twins are judged without any.
    """
    found = connection.exec_driver_sql(
        "SELECT DISTINCT name, judged_digest FROM uncertainty "
        "WHERE campaign_id = ? AND scenario = ? AND architecture = ? AND kind = 'fsr' "
        "ORDER BY name, judged_digest",
        (run.campaign, run.scenario, run.architecture),
    ).all()
    judged = {verdict.fsr_digest for verdict in stored.verdicts}
    uncertain = {str(name): str(digest) for name, digest in found if digest in judged}
    return plain_digests(connection, run.campaign) | uncertain


def measures(connection: Connection, concept_digest: str) -> dict[str, str]:
    """Give the measure of each FSR of a concept: its formula or bound, for people.

    Raises:
        IntegrityError: The concept or one of its FSRs is gone.
    """
    concept = content(connection, "concept", concept_digest)
    query = "SELECT id, measure FROM fsr WHERE concept_digest = ?"
    rows = connection.exec_driver_sql(query, (concept_digest,))
    found = {str(item[0]): str(item[1]) for item in rows}
    for item in concept["requirements"]:
        if item["id"] not in found:
            raise _gone(f"{item['id']} of concept", concept_digest)
    return found


# --- Summaries of a campaign: FSR status, gate, worst runs, the table of results and its hash -----

_STATUS: Final = (
    "SELECT * FROM v_fsr_status WHERE campaign = ? ORDER BY fsr, architecture, scenario"
)
_GATE: Final = "SELECT * FROM v_gate WHERE campaign = ? ORDER BY architecture, fsr"
_RESULTS: Final = "SELECT * FROM v_runs WHERE campaign = ? ORDER BY ordinal"


def fsr_status(connection: Connection, campaign_id: str) -> tuple[records.FsrStatus, ...]:
    """Count the verdicts of every FSR by architecture and scenario, from the tallies."""
    found = connection.exec_driver_sql(_STATUS, (campaign_id,))
    return tuple(_status(item, item.scenario, item.verdict) for item in found)


def gate(
    connection: Connection, campaign_id: str, on: date | None = None
) -> tuple[records.FsrStatus, ...]:
    """Fold every mandatory FSR for every architecture, over all scenarios.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
        on: Day on which waivers must still be valid; today without.
    """
    found = connection.exec_driver_sql(_GATE, (campaign_id,))
    day = (on or datetime.now(UTC).date()).isoformat()
    rows: list[records.FsrStatus] = []
    for item in found:
        is_waived = item.waived_until is not None and item.waived_until >= day
        rows.append(_status(item, "", item.verdict_waived if is_waived else item.verdict))
    return tuple(rows)


def never_held(
    connection: Connection, campaign_id: str
) -> dict[tuple[str, str], tuple[records.NeverHeld, ...]]:
    """List the nested implications that no run asked for, by FSR and architecture."""
    from adeye.store.encoding import stored_rows
    from adeye.store.tables import never_held as table

    found: dict[tuple[str, str], tuple[records.NeverHeld, ...]] = {}
    for _, fsr, architecture, _, antecedent, decides, _ in stored_rows(
        connection, table, "campaign_id = ?", (campaign_id,)
    ):
        key = fsr, architecture
        found[key] = (*found.get(key, ()), records.NeverHeld(antecedent, bool(decides)))
    return found


def _status(item: Row[Any], scenario: str, verdict: str | None) -> records.FsrStatus:
    values = item._mapping
    counts = {Verdict(name): int(values[column]) for name, column in COUNTED.items()}
    return records.of_row(
        records.FsrStatus,
        values,
        scenario=scenario,
        is_mandatory=bool(values.get("mandatory", True)),
        is_in_gate=bool(item.in_gate),
        is_applicable=bool(item.applicable),
        counts={**counts, Verdict.NOT_RUN: int(item.n_not_run)},
        repeated_passes=item.repeated_pass,
        verdict=None if verdict is None else Verdict(verdict),
    )


def progress(connection: Connection, campaign_id: str) -> records.Progress:
    """Count planned, executed and accounted test cases.

    A case is accounted for when its block is done: its result, verdicts and tallies are saved.
    """
    planned, executed = connection.exec_driver_sql(
        "SELECT COUNT(*), COUNT(r.number) FROM campaign_case c "
        "LEFT JOIN run r ON r.result_digest = c.result_digest WHERE c.campaign_id = ?",
        (campaign_id,),
    ).one()
    accounted = connection.exec_driver_sql(
        "SELECT COALESCE(SUM(to_ordinal - from_ordinal), 0) FROM work "
        "WHERE campaign_id = ? AND state = 'done'",
        (campaign_id,),
    ).scalar_one()
    return records.Progress(planned=planned, executed=executed, accounted=accounted)


def worst_runs(
    connection: Connection, /, campaign_id: str, fsr: str, *, limit: int = 3, **only: str | None
) -> tuple[tuple[records.RunRef, records.VerdictRecord], ...]:
    """Return the runs with the least margin for an FSR, failed ones first; see ``WORST_FIRST``.

    Without a verdict those of ``MEASURED``: of a run that was not judged nothing is the worst, nor
    of one that is withdrawn.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
        fsr: Id of the FSR.
        limit: Most runs to return.
        only: Restrict ``architecture``, ``scenario`` or ``verdict`` to a value that is not None.
    """
    wanted: dict[str, tuple[str, ...]] = {
        name: (str(value),) for name, value in only.items() if value is not None
    }
    wanted.setdefault("verdict", MEASURED)
    # A run is among the worst n only if its tally is among the n whose worst is worst: each before
    # that one holds a run that is worse, or as bad and of a lesser digest.
    condition, values = _one_of_each(wanted)
    ranges: set[tuple[int, int]] = set()
    # Behind a worst run that is withdrawn anything may come.
    for stands, most in (("", limit), ("NOT ", 2**31)):
        tallies = connection.exec_driver_sql(
            "SELECT w.from_ordinal, w.to_ordinal FROM work w JOIN tally ON tally.work_id = w.id "  # noqa: S608 - own names
            f"WHERE tally.campaign_id = ? AND fsr_id = ?{condition} "
            f"AND {stands}{standing('worst_result_digest')} "
            f"ORDER BY {WORST_FIRST}, w.from_ordinal LIMIT ?",
            (campaign_id, fsr, *values, most),
        )
        ranges |= {(first, end) for first, end in tallies}
    if not ranges:
        return ()
    within = " OR ".join(["c.ordinal >= ? AND c.ordinal < ?"] * len(ranges))
    asked = {f"{'v' if name == 'verdict' else 'c'}.{name}": of for name, of in wanted.items()}
    condition, values = _one_of_each(asked)
    found = connection.exec_driver_sql(
        "SELECT * FROM (SELECT c.campaign_id, c.ordinal, c.result_digest, c.test_case_digest, "  # noqa: S608 - own names
        "c.scenario, c.architecture, c.inside_odd, c.point, v.*, v.margin AS worst_margin, "
        f"c.result_digest AS worst_result_digest FROM {JUDGED_CASES} "
        f"WHERE c.campaign_id = ? AND f.fsr_id = ? AND ({within}){condition} "
        f"AND {standing('c.result_digest')}) AS judged "
        f"ORDER BY {WORST_FIRST}, ordinal LIMIT ?",
        (campaign_id, fsr, *(bound for pair in sorted(ranges) for bound in pair), *values, limit),
    ).all()
    return tuple((run_ref(item), records.verdict_record(item._mapping)) for item in found)


def worst_run(connection: Connection, campaign_id: str, fsr: str | None = None) -> tuple[str, str]:
    """Return the worst run for an FSR, or for the first one that fails, the mandatory ones before.

    Returns:
        Id of the FSR and digest of the run's result.

    Raises:
        UsageError: There is no such FSR, it was measured in no run, or none fails.
    """
    found = fsr_status(connection, campaign_id)
    if fsr is not None:
        known = sorted({item.fsr for item in found})
        require_known((fsr,), known, lambda name: f"the campaign has no FSR {name!r}")
        asked, verdict = [fsr], None
    else:
        failing = {(not item.is_mandatory, item.fsr) for item in found if item.counts[Verdict.FAIL]}
        asked, verdict = [name for _, name in sorted(failing)], Verdict.FAIL
    for name in asked:
        for ref, _ in worst_runs(connection, campaign_id, name, limit=1, verdict=verdict):
            return name, ref.result_digest
    if fsr is None:
        raise UsageError("no run of the campaign fails an FSR", remedy="Name one by its digest.")
    raise UsageError(
        f"{fsr} was measured in no run of the campaign",
        remedy="See 'adeye query unexercised', and 'adeye where' for what became of its runs.",
    )


def _one_of_each(wanted: Mapping[str, Sequence[str]]) -> tuple[str, list[str]]:
    """Write the condition that each of some columns has one of some values, and list these."""
    conditions = [f" AND {name} IN ({', '.join('?' * len(of))})" for name, of in wanted.items()]
    return "".join(conditions), [value for of in wanted.values() for value in of]


def info(connection: Connection, location: Location) -> records.DatabaseInfo:
    """Say what a database holds, without counting each row of it.

    Most tables have as many rows as the ledger says were written; whether these are still there
    is what the verification finds.
    """
    from adeye.store.tables import metadata

    version = schema.read_version(connection) or ""
    size = catalog.size_bytes(connection)
    rows: dict[str, int] = {
        name: int(number)
        for name, number in connection.exec_driver_sql(
            "SELECT table_name, SUM(row_count) FROM ledger GROUP BY table_name"
        )
    }
    rows = {
        table.name: rows.get(table.name)
        or connection.execute(select(func.count()).select_from(table)).scalar_one()
        for table in metadata.sorted_tables
    }
    return records.DatabaseInfo(str(location), version, size, rows)


def failed_among(
    connection: Connection, campaign_id: str, ordinals: Sequence[int]
) -> frozenset[int]:
    """Return those of some runs of a campaign that fail an FSR."""
    found = connection.exec_driver_sql(
        f"SELECT c.ordinal FROM {JUDGED_CASES} WHERE c.campaign_id = ? AND v.verdict = 'FAIL' "  # noqa: S608 - own names
        "AND c.ordinal IN (SELECT CAST(value AS INTEGER) FROM json_each(?))",
        (campaign_id, json.dumps(list(ordinals))),
    )
    return frozenset(found.scalars())


def tried_again(connection: Connection, campaign_id: str) -> dict[str, int]:
    """Count the results of a campaign that came out only when their block was tried again.

    Also if another campaign executed them.

    Returns:
        How many, by what the block failed with the last time.
    """
    found = connection.exec_driver_sql(
        "SELECT w.detail, COUNT(DISTINCT c.result_digest) FROM work w "
        "JOIN campaign_case c ON c.campaign_id = w.campaign_id "
        "AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal "
        "WHERE w.detail IS NOT NULL AND w.state = 'done' AND EXISTS (SELECT 1 FROM campaign_case o "
        "WHERE o.campaign_id = ? AND o.result_digest = c.result_digest) "
        "GROUP BY w.detail ORDER BY w.detail",
        (campaign_id,),
    )
    return {str(detail): int(count) for detail, count in found}


def unmeasured(connection: Connection, campaign_id: str) -> tuple[tuple[str, bool, int], ...]:
    """Count the runs of a campaign in which metrics of plug-ins failed.

    Each raised there, or gave what is no value.

    Returns:
        Id of the metric, whether the runs are twins with half the step, and how many.
    """
    found: Counter[tuple[str, bool]] = Counter()
    for table in plugin_tables(connection):
        for name in ids_of(table):
            for is_twin, rows, digest in (
                (False, "campaign_case c", "c.result_digest"),
                (True, TWINS, "h.result_digest"),
            ):
                found[name, is_twin] += connection.exec_driver_sql(
                    f"SELECT COUNT(DISTINCT r.number) FROM {rows} "  # noqa: S608 - own names
                    f"JOIN run r ON r.result_digest = {digest} "
                    f"JOIN {table.name} m ON m.run_number = r.number "
                    f"WHERE c.campaign_id = ? AND m.{name}_status = 'error'",
                    (campaign_id,),
                ).scalar_one()
    return tuple((*key, count) for key, count in found.items() if count)


def failed_channels(
    connection: Connection, campaign_id: str, about: Sequence[tuple[str, str]] = ()
) -> tuple[tuple[str, str, str, bool, bool, int], ...]:
    """Count the runs in which a channel failed, by architecture, channel and what happened.

    Those that exercise an FSR about the channel, which passes, are counted apart, and so are twins
    with half the step.

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
        name: filled("mastered", judged=JUDGED, about=" OR ".join([pair] * len(about)))
        if about
        else "0"
        for name, pair in (
            ("first", "(f.fsr_id = ? AND c.outcome_channel = ?)"),
            ("later", "(f.fsr_id = ? AND e.subject = ?)"),
        )
    }
    asked = filled("failed_channels", twins=TWINS, **sides)
    found = connection.exec_driver_sql(asked, (campaign_id, campaign_id, *named, *named))
    return tuple((*item[:3], bool(item[3]), bool(item[4]), int(item[5])) for item in found)


@dataclass(frozen=True, slots=True)
class Executed:
    """A run of a campaign that has a result.

    Attributes:
        run: Where it stands.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        machine_dependent: Whether a deadline, limit or clock of a machine had a part in it.
        contact: Whether the ego touched something; None if it is not known.
        required_mps2: Largest required deceleration [m/s²]; None if it has none.
    """

    run: records.RunRef
    fault_entry: str
    machine_dependent: bool
    contact: bool | None = None
    required_mps2: float | None = None

    @property
    def stratum(self) -> tuple[str, str, str]:
        """Scenario, architecture and fault entry."""
        return self.run.scenario, self.run.architecture, self.fault_entry


def executed_once(connection: Connection, campaign_id: str) -> list[Executed]:
    """List the executed runs of a campaign, each once, in the order of the plan; none withdrawn."""
    found = connection.exec_driver_sql(
        "SELECT c.*, t.fault_entry, r.realised, r.machine_dependent, m.contact, m.contact_status, "  # noqa: S608 - own names
        "m.max_required_deceleration_mps2 FROM campaign_case c "
        "JOIN test_case t ON t.digest = c.test_case_digest "
        "JOIN run r ON r.result_digest = c.result_digest "
        "JOIN metric m ON m.run_number = r.number "
        f"WHERE c.campaign_id = ? AND {standing('c.result_digest')} ORDER BY c.ordinal",
        (campaign_id,),
    )
    runs: dict[str, Row[Any]] = {}
    for item in found:
        # Of several test cases with one result the first of the plan counts.
        runs.setdefault(item.result_digest, item)
    return [
        Executed(
            run_ref(item),
            item.fault_entry,
            bool(item.machine_dependent),
            contact_of(item.contact, item.contact_status, item.realised),
            item.max_required_deceleration_mps2,
        )
        for item in runs.values()
    ]


def contact_of(value: Any, status: str, realised: Any) -> bool | None:
    """Read whether there was a contact; None where that says nothing about the situation."""
    if status != "value" or value not in {0.0, 1.0} or not realised:
        return None
    return bool(value)


def contacts(connection: Connection, campaign_id: str) -> dict[str, int]:
    """Count the runs that a contact ended, by architecture; none withdrawn."""
    found = connection.exec_driver_sql(
        "SELECT c.architecture, COUNT(*) "  # noqa: S608 - own names
        "FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest "
        f"WHERE r.end_reason = 'contact' AND c.campaign_id = ? AND {standing('c.result_digest')} "
        "GROUP BY 1 ORDER BY 1",
        (campaign_id,),
    )
    return {item[0]: int(item[1]) for item in found}


def results(connection: Connection, campaign_id: str) -> records.ResultTable:
    """Return every executed run of a campaign as ``v_runs`` shows it."""
    found = connection.exec_driver_sql(_RESULTS, (campaign_id,))
    return records.ResultTable(tuple(found.keys()), tuple(tuple(item) for item in found))


# --- What a certificate found to come out otherwise -----------------------------------------------

_NAMED: Final = 3
"""Results that came out otherwise whose digests are listed; the certificate has all."""


def contested(connection: Connection, campaign: str) -> dict[str, str]:
    """Find the results of a campaign that came out otherwise for a certificate, with its last day.

    A certificate of any campaign that has the result tells of it, for good: that it came out as
    it is another time, too, does not say what else it comes out as.

    Args:
        connection: To the database.
        campaign: Id of the campaign.
    """
    found: dict[str, str] = {}
    for at, findings in connection.exec_driver_sql("SELECT at, findings FROM certificate"):
        for item in json.loads(findings):
            found[item["run"]] = max(at[:10], found.get(item["run"], ""))
    if not found:
        return {}
    results = connection.exec_driver_sql(
        "SELECT DISTINCT result_digest FROM campaign_case WHERE campaign_id = ? "
        "ORDER BY result_digest",
        (campaign,),
    ).scalars()
    return {run: found[run] for run in results if run in found}


def uncertified(connection: Connection, campaign: str) -> str:
    """Name the contested results of a campaign that stand; empty for none. See ``contested``."""
    found = contested(connection, campaign)
    if not found:
        return ""
    standing_ones = connection.exec_driver_sql(
        "SELECT DISTINCT c.result_digest FROM campaign_case c "  # noqa: S608 - own words
        f"WHERE c.campaign_id = ? AND {standing('c.result_digest')}",
        (campaign,),
    )
    runs = sorted(found.keys() & set(standing_ones.scalars()))
    if not runs:
        return ""
    count = "1 result" if len(runs) == 1 else f"{len(runs)} results"
    names = ", ".join(run[:10] for run in runs[:_NAMED]) + (", …" if len(runs) > _NAMED else "")
    return (
        f"{count} came out otherwise when adeye certify executed runs again on "
        f"{max(found[run] for run in runs)}: {names}"
    )
