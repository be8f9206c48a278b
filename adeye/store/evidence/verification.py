"""Check that the database still holds what was written to it.

Every insert-only row is hashed again, results are compared with their hash, tallies are counted
again, and plans are compared with the identity of their campaign. What does not agree is named by
table and row. ``balance`` tells what is gone or was never written.

Verdicts are folded from tallies, which are few. Whether the results behind them are as they were
written takes a look at every row, which is what ``verification`` does.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from sqlalchemy import Connection, Table, select, text
from sqlalchemy.exc import DBAPIError, MultipleResultsFound, NoResultFound

from adeye.errors import AdeyeError, IntegrityError
from adeye.notices import doing
from adeye.store import catalogue as catalog
from adeye.store import tables
from adeye.store.accounts import wrong_block, wrong_plans
from adeye.store.cases import gaps_of_done, missing_of_block
from adeye.store.encoding import (
    bulk_hashes,
    chunked,
    hashed_names,
    read_chunks,
    row_hash,
    stored_hashes,
    stored_rows,
    stored_words,
)
from adeye.store.evidence.ledger_check import differing, refuse, unbalanced
from adeye.store.evidence.roots import wrong_roots
from adeye.store.ledger import key_text
from adeye.store.plugin_metrics import plugin_tables
from adeye.store.read.campaigns import progress
from adeye.store.records import EngineKey, Finding, of_row
from adeye.store.schema import created, insert_only_ddl, made
from adeye.store.sql import statement
from adeye.store.views import scenario_views
from adeye.store.write.planning import SelectionHash, judging_hash
from adeye.store.write.results import RUN_HASHED, result_hashes, tally_rows

if TYPE_CHECKING:
    from adeye.store.read.reader import Reader

# --- Content that breaks its reader: a database that somebody else wrote or changed says so -------

UNFORESEEN: Final = (
    ArithmeticError,
    AttributeError,
    LookupError,
    MultipleResultsFound,
    NoResultFound,
    RecursionError,
    TypeError,
    ValueError,
)
"""What readers raise on content that is not of the form in which it is written."""

LOOKED_AT: Final = "The database was verified because of this error."
"""Note on an error whose cause was looked for: of many runs that takes minutes."""


def is_unexplained(raised: object) -> bool:
    """Tell whether an error may come of altered content, and nobody looked yet."""
    return (
        isinstance(raised, UNFORESEEN)
        and not isinstance(raised, AdeyeError)
        and LOOKED_AT not in getattr(raised, "__notes__", ())
    )


def close(repository: Reader, raised: object) -> None:
    """Close a repository; look for the cause if something unforeseen ended its use.

    Args:
        repository: What was used.
        raised: What ended its use; None if nothing did.

    Raises:
        IntegrityError: Something unforeseen was raised, and the database is not as it was written.
    """
    try:
        if isinstance(raised, Exception) and is_unexplained(raised):
            findings: tuple[Finding, ...] = ()
            # Whoever cannot even be verified keeps the error that was there first.
            with suppress(Exception):
                findings = repository.verify()
            raised.add_note(LOOKED_AT)
            if findings:
                first = findings[0]
                raise IntegrityError(
                    f"database {repository.location} is not as it was written: {first.table} "
                    f"{first.row}: {first.problem}. See 'adeye db verify'; restore it from a copy."
                ) from raised
    finally:
        repository.close()


# --- Check that the database still holds what was written to it -----------------------------------

_VALUES: Final = 50_000
"""Values that are looked at together."""


def verify(connection: Connection) -> Iterator[Finding]:
    """Name every row that is not as it was written, every missing and every extra one."""
    # Text that need not be UTF-8 is read slowly. What nobody altered is, and has no findings.
    if not catalog.is_server(connection):
        with suppress(DBAPIError, sqlite3.Error):
            if not list(_findings(connection)):
                return
    with catalog.readable(connection):
        yield from _findings(connection)


def _findings(connection: Connection) -> Iterator[Finding]:
    for line in catalog.damaged_pages(connection):
        yield Finding("database", "", line)
    views: dict[str, str] = {}
    # What they are made from may be altered, which is named below.
    with suppress(DBAPIError, *UNFORESEEN), connection.begin_nested():
        views = scenario_views(connection)
    definitions = tuple(altered_definitions(connection, views))
    yield from definitions
    if any(item.row in tables.metadata.tables for item in definitions):
        # Nothing can be said of the rows of a table that is gone, or is another one.
        return
    everything = (*tables.metadata.sorted_tables, *plugin_tables(connection))
    for name, row, problem in catalog.misplaced(connection, everything):
        yield Finding(name, row, problem)
    yield from _altered(connection)
    checks = {
        "content": _content,
        "database": _missing_references,
        "run": _results,
        "campaign": _plans,
        "campaign_case": wrong_plans,
        "work": _work,
        "ledger": unbalanced,
        "campaign_root": wrong_roots,
    }
    for name, check in checks.items():
        yield from _as_far_as_readable(name, check(connection))


def _altered(
    connection: Connection, campaign: str | None = None, *, has_figures: bool = True
) -> Iterator[Finding]:
    """Name rows that do not have their hash; seals are looked at with the ledger.

    Args:
        connection: In a transaction.
        campaign: Leave out what belongs to others alone.
        has_figures: Whether what was measured is looked at, too.
    """
    for table in tables.INSERT_ONLY:
        if table not in {*tables.RESULTS, tables.seal}:
            is_own = campaign is not None and "campaign_id" in table.columns
            own = ("campaign_id = ?", (campaign,)) if is_own else ()
            yield from altered_rows(table, stored_rows(connection, table, *own))
    runs = _EVERY_RUN if campaign is None else _own_runs(connection, campaign)
    for table in (*tables.RESULTS, *plugin_tables(connection)):
        if has_figures or (table in tables.RESULTS and table not in _FIGURES):
            found = chain.from_iterable(_altered_results(connection, table, part) for part in runs)
            yield from _as_far_as_readable(table.name, found)


_FIGURES: Final = (tables.metric, tables.timing, tables.criticality, tables.extreme)
"""What was measured on runs: most of what a database holds."""
_BY_RUN: Final = (*tables.RESULTS, tables.seal)
"""What there is of runs, by their numbers."""
_EVERY_RUN: Final = ((-(1 << 63), (1 << 63) - 1),)
_APART: Final = 1_000
"""Numbers of others that are rather looked at than asked around."""


def _own_runs(connection: Connection, campaign: str) -> list[tuple[int, int]]:
    """Give the ranges of the numbers of runs that do not belong to other campaigns alone.

    Forks, twins and drives belong to none.
    """
    found = connection.exec_driver_sql(statement("own_runs"), (campaign, campaign)).scalars()
    ranges: list[tuple[int, int]] = []
    for number in found:
        if ranges and number - ranges[-1][1] <= _APART:
            ranges[-1] = ranges[-1][0], number
        else:
            ranges.append((number, number))
    return ranges


def _as_far_as_readable(table: str, findings: Iterator[Finding]) -> Iterator[Finding]:
    """Let content that breaks a check be a finding and not the end of all others."""
    try:
        yield from findings
    except UNFORESEEN as error:
        yield Finding(table, "", f"holds what nobody wrote: {error}")


def altered_definitions(
    connection: Connection, others: Mapping[str, str] | None = None
) -> Iterator[Finding]:
    """Name what is gone or is made in another way, and triggers of nobody here.

    Args:
        connection: In a transaction.
        others: Statements of views that not every database has, by name.
    """
    dialect = connection.dialect
    expected = {**made(dialect), **(others or {})}
    for table in plugin_tables(connection):
        expected[table.name] = created(table, dialect)
        for ddl in insert_only_ddl(table.name, dialect.name):
            # The third word of CREATE TRIGGER name …
            expected[ddl.split(maxsplit=3)[2]] = ddl
    for name, problem in catalog.altered(connection, expected):
        yield Finding("schema", name, problem)


def altered_rows(table: Table, rows: Iterable[tuple[Any, ...]]) -> Iterator[Finding]:
    """Name rows that do not have their hash.

    Args:
        table: An insert-only table that is not written a block at a time.
        rows: Every column of some of its rows.
    """
    for part in chunked(rows):
        try:
            hashes: Sequence[str | None] = stored_hashes(table, part)
        except TypeError:
            hashes = [_hash(table, values) for values in part]
        for values, hashed in zip(part, hashes, strict=True):
            if hashed != values[-1]:
                yield Finding(table.name, key_text(table, values), "altered")


def _altered_results(
    connection: Connection, table: Table, runs: tuple[int, int]
) -> Iterator[Finding]:
    """Name altered rows of some runs in a table that is written a block at a time."""
    key = [column.name for column in table.primary_key.columns][1:]
    names = hashed_names(table)
    read = 0
    for rows in _result_stream(connection, table, runs):
        read += len(rows)
        doing(f"Verifying the database: {table.name}, {read:,} rows")
        stored = [values[-1] for values in rows]
        hashes: Sequence[Any] | None = bulk_hashes(table, rows)
        if hashes == stored:
            continue
        if hashes is None:
            # One row has what was never written: look at each alone.
            alone = [bulk_hashes(table, [values]) for values in rows]
            hashes = [found and found[0] for found in alone]
        for hashed, (number, *values) in zip(hashes, rows, strict=True):
            if hashed != values[-1]:
                run = values[0] or f"number {number}"
                row = " ".join(
                    str(value) for value in (run, *(values[names.index(k)] for k in key))
                )
                yield Finding(table.name, row, "altered")


def _result_stream(
    connection: Connection, table: Table, runs: tuple[int, int]
) -> Iterator[Sequence[Any]]:
    """Read numbers of runs, what is hashed and the hash, by the numbers, many together."""
    names = ", ".join(("result_digest", *(f"t.{name}" for name in hashed_names(table)[1:])))
    source = f"{table.name} t"
    number, *key = (f"t.{column.name}" for column in table.primary_key.columns)
    if table is not tables.run:
        source += f" LEFT JOIN run ON run.number = {number}"
    query = (
        f"SELECT {number}, {names}, t.row_hash "  # noqa: S608 - names of this package
        f"FROM {source} WHERE {number} BETWEEN ? AND ? ORDER BY {', '.join((number, *key))}"
    )
    size = max(1, _VALUES // len(table.columns))
    return read_chunks(connection, query, *runs, size=size)


def _hash(table: Table, values: Sequence[Any]) -> str | None:
    try:
        return row_hash(table, values[:-1])
    except TypeError:
        # A value of a type that was never written, such as a blob.
        return None


def _content(connection: Connection) -> Iterator[Finding]:
    for table in tables.CONTENT.values():
        for digest, _id, _version, content, _hash in stored_rows(connection, table):
            text = str(content).encode("utf-8", "surrogateescape")
            if hashlib.sha256(text).hexdigest() != digest:
                yield Finding(table.name, str(digest), "content does not have this digest")


def _missing_references(connection: Connection) -> Iterator[Finding]:
    for name, row, parent in catalog.dangling(connection, tables.metadata.sorted_tables):
        yield Finding(name, row, f"refers to a row that {parent} does not have")


def _results(connection: Connection) -> Iterator[Finding]:
    """Compare each run with its hash over metrics and events, and with its own identity."""
    names = [column.name for column in tables.run.columns]
    engines: dict[tuple[Any, ...], EngineKey] = {}
    for rows in chunked(stored_rows(connection, tables.run)):
        stored = [dict(zip(names, values, strict=True)) for values in rows]
        digests = [str(item["result_digest"]) for item in stored]
        numbers = {
            int(item["number"]): digest for item, digest in zip(stored, digests, strict=True)
        }
        parts = [_rows_of(connection, table, numbers) for table in (tables.metric, tables.event)]
        hashes = _result_hashes(stored, digests, *parts)
        for place, item in enumerate(stored):
            digest = digests[place]
            hashed = hashes and hashes[place]
            if hashed is None:
                # One run of the chunk has what was never written: look at each alone.
                alone = [{digest: part.get(digest, [])} for part in parts]
                hashed = next(iter(_result_hashes([item], [digest], *alone) or ()), None)
            if hashed != item["result_hash"]:
                yield Finding("run", digest, "metrics, events or trace digest are not its own")
            engine = of_row(EngineKey, item)
            own = [getattr(engine, part.name) for part in fields(engine)]
            # Few engines give many results. What equals 1, and is another type, is another one.
            engine = engines.setdefault((*own, *map(type, own)), engine)
            if _result_digest(engine, item["test_case_digest"]) != item["result_digest"]:
                yield Finding("run", digest, "is not the result of its test case and engine")
    problem = "belongs to no campaign and is no fork, twin or reference drive"
    for digest in connection.exec_driver_sql(statement("unplanned")).scalars().all():
        yield Finding("run", digest, problem)


def _rows_of(
    connection: Connection, table: Table, numbers: Mapping[int, str]
) -> dict[str, list[tuple[Any, ...]]]:
    """Read what is hashed of the rows of some runs, in the order of their key, by result digest."""
    names = ", ".join(hashed_names(table)[1:])
    key = ", ".join(column.name for column in table.primary_key.columns)
    query = (
        f"SELECT run_number, {names} FROM {table.name} "  # noqa: S608 - own names
        f"WHERE run_number IN (SELECT CAST(value AS INTEGER) FROM json_each(?)) ORDER BY {key}"
    )
    rows: dict[str, list[tuple[Any, ...]]] = defaultdict(list)
    for chunk in read_chunks(connection, query, json.dumps(list(numbers))):
        for number, *values in chunk:
            digest = numbers[number]
            rows[digest].append((digest, *values))
    return rows


def _result_hashes(
    stored: Sequence[dict[str, Any]],
    digests: Sequence[str],
    metrics: Mapping[str, Sequence[tuple[Any, ...]]],
    events: Mapping[str, Sequence[tuple[Any, ...]]],
) -> list[str] | None:
    """Hash results; None if one of them has values that were never written."""
    happened = [item for digest in digests for item in events.get(digest, ())]
    run_of_event = [
        run for run, digest in enumerate(digests) for _ in range(len(events.get(digest, ())))
    ]
    measured = [item for digest in digests for item in metrics.get(digest, ())]
    runs = [tuple(item[name] for name in RUN_HASHED) for item in stored]
    try:
        return result_hashes(
            stored_words(tables.run, RUN_HASHED, runs),
            stored_words(tables.metric, hashed_names(tables.metric), measured),
            stored_words(tables.event, hashed_names(tables.event), happened),
            np.array(run_of_event, dtype=np.int64),
        )
    except (TypeError, ValueError, OverflowError):
        return None


def _result_digest(engine: EngineKey, test_case: str) -> str:
    try:
        return engine.result_digest(test_case)
    except ValueError:
        return "not a value that was ever written"


def _plans(connection: Connection) -> Iterator[Finding]:
    for campaign in connection.execute(tables.campaign.select()).all():
        own = "campaign_id = ?", (campaign.id,)
        identity = SelectionHash(
            campaign.odd_digest, campaign.concept_digest, campaign.gate, campaign.judging
        )
        for _, _, *names, inside_odd, point, _ in stored_rows(
            connection, tables.campaign_case, *own
        ):
            identity.add((*names, int(inside_odd), point))
        fsrs = stored_rows(connection, tables.campaign_fsr, *own)
        if (identity.campaign_id, identity.count) != (campaign.id, campaign.planned):
            yield Finding("campaign_case", campaign.id, "cases are not those that were planned")
        if judging_hash(fsrs) != campaign.judging_hash:
            yield Finding("campaign_fsr", campaign.id, "FSRs are not those that were planned")


def _work(
    connection: Connection, campaign: str | None = None, *, has_accounts: bool = True
) -> Iterator[Finding]:
    work, ids = tables.work, tables.campaign.c.id
    asked = work.select().order_by(work.c.campaign_id, work.c.from_ordinal)
    everyone = select(ids)
    if campaign is not None:
        asked = asked.where(work.c.campaign_id == campaign)
        everyone = everyone.where(ids == campaign)
    blocks = connection.execute(asked).all()
    campaigns = connection.execute(everyone).scalars().all()
    covered = dict.fromkeys(campaigns, 0)
    for number, block in enumerate(blocks):
        doing(f"Verifying the database: block {number + 1:,} of {len(blocks):,}")
        if covered.get(block.campaign_id) != block.from_ordinal:
            yield Finding("work", str(block.id), "does not begin where the block before it ends")
        covered[block.campaign_id] = block.to_ordinal
        if has_accounts:
            yield from _tallies(connection, block.id, is_done=block.state == "done")
            yield from wrong_block(connection, block)
    if campaign is None:
        for own in campaigns:
            yield from _lost(connection, own)


def _tallies(connection: Connection, work_id: int, *, is_done: bool) -> Iterator[Finding]:
    stored = set(stored_rows(connection, tables.tally, "work_id = ?", (work_id,)))
    try:
        counted = {tuple(item) for item in tally_rows(connection, work_id)}
    except (TypeError, ValueError) as error:
        yield Finding("tally", str(work_id), f"cannot be counted again ({error})")
        return
    if not is_done:
        # Of a block that is not done, the FSRs count that all of its cases are judged on.
        missing = missing_of_block(connection, work_id) if stored else frozenset()
        begun = {(item[2], *item[4:6]) for item in stored}
        counted = {
            item for item in counted if item[2] not in missing and (item[2], *item[4:6]) in begun
        }
    for item in sorted(stored ^ counted, key=str):
        problem = "is not what its block counts to" if item in stored else "is missing"
        yield Finding("tally", key_text(tables.tally, item), problem)


# --- Check quickly what the summaries of a campaign are read from: its plan, blocks and tallies ---

_TOO_MANY = text(
    "SELECT fsr, architecture, scenario, planned, n_not_run FROM v_fsr_status "
    "WHERE campaign = :campaign AND n_not_run < 0"
)


def unsound(connection: Connection, campaign: str) -> Iterator[Finding]:
    """Name what is not as it was written among all that the summaries of a campaign rest on.

    Args:
        connection: In a transaction.
        campaign: Id of the campaign.
    """
    yield from _unsound_rows(connection, campaign)
    yield from _unindexed(connection)


def _unindexed(connection: Connection) -> Iterator[Finding]:
    """Name rows that an index lacks: they are there, and are not found by what looks for them."""
    few = (table for table in tables.metadata.sorted_tables if table not in _BY_RUN)
    for line in catalog.damaged_pages(connection, few):
        yield Finding("database", "", line)


def _unsound_rows(connection: Connection, campaign: str) -> Iterator[Finding]:
    yield from altered_definitions(connection)
    counted = (tables.tally, tables.case_repeat, tables.never_held)
    for table in (tables.campaign, tables.campaign_fsr, *counted):
        own = "id = ?" if table is tables.campaign else "campaign_id = ?"
        yield from altered_rows(table, stored_rows(connection, table, own, (campaign,)))
    # A withdrawal that is gone lets a result count that is no evidence.
    yield from differing(connection, tables.withdrawal)
    yield from _lost(connection, campaign)
    for name in ("run", "verdict"):
        yield from _counted(connection, name)
    for item in connection.execute(_TOO_MANY, {"campaign": campaign}):
        judged = f"{item.planned - item.n_not_run} verdicts for {item.planned} planned cases"
        yield Finding("tally", f"{item.fsr} {item.architecture} {item.scenario}", judged)
    for item in connection.execute(text(statement("uncounted")), {"campaign": campaign}):
        problem = "what counts once, or never held, is missing"
        yield Finding("case_repeat", f"{item.fsr_id} {item.architecture}", problem)


def require_sound(
    connection: Connection, campaign: str, *, has_figures: bool = True, has_accounts: bool = True
) -> None:
    """Refuse to hand on, or to decide by, what is not as it was written, or is there no more.

    Rows of evidence that are gone are missed wherever they were. What was altered, and accounts
    of cases, are those of this campaign and of runs in no campaign.

    Args:
        connection: In a transaction.
        campaign: Id of the campaign.
        has_figures: Whether anything is told that was measured, and not only what was judged.
        has_accounts: Whether anything is told as tallies and accounts of cases count it, and not
            from each verdict.

    Raises:
        IntegrityError: A row is altered, gone, or was never written by adeye.
    """
    checks = {
        "ledger": unbalanced(connection),
        "work": _work(connection, campaign, has_accounts=has_accounts),
    }
    if has_accounts:
        checks["campaign_case"] = wrong_plans(connection, campaign)
    told = [_as_far_as_readable(name, check) for name, check in checks.items()]
    altered = _altered(connection, campaign, has_figures=has_figures)
    rows = _unsound_rows(connection, campaign)
    refuse("the database", chain(rows, altered, *told, _unindexed(connection)))


def _counted(connection: Connection, table: str) -> Iterator[Finding]:
    """Compare how many rows a table has with how many were written, whoever else may miss them."""
    there, written = connection.exec_driver_sql(
        f"SELECT (SELECT COUNT(*) FROM {table}), COALESCE(SUM(row_count), 0) "  # noqa: S608
        "FROM ledger WHERE table_name = ?",
        (table,),
    ).one()
    if there != written:
        yield Finding(table, "", f"{there} rows are there, {written} were written")


def _lost(connection: Connection, campaign: str) -> Iterator[Finding]:
    """Compare counts of what was planned, of what is in blocks, and of what is there."""
    planned, covered = connection.exec_driver_sql(
        "SELECT planned, (SELECT COALESCE(SUM(to_ordinal - from_ordinal), 0) FROM work "
        "WHERE campaign_id = c.id) FROM campaign c WHERE id = ?",
        (campaign,),
    ).one()
    found = progress(connection, campaign)
    if found.planned != planned:
        problem = f"{found.planned} of {planned} planned cases are there"
        yield Finding("campaign_case", campaign, problem)
    if covered != planned:
        yield Finding("work", campaign, f"blocks cover {covered} of {planned} cases")
    if found.executed < found.accounted:
        problem = f"{found.executed} results are there, blocks of {found.accounted} cases are done"
        yield Finding("run", campaign, problem)
    for number, fsr in gaps_of_done(connection, campaign):
        yield Finding("verdict", f"{number} {fsr}", "is missing, though its block is done")
