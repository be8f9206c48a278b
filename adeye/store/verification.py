"""Check that the database still holds what was written to it.

Every insert-only row is hashed again, results are compared with their hash, tallies are counted
again, and plans are compared with the identity of their campaign. What does not agree is named by
table and row. ``result_table_hash`` gives one hash for the results of a campaign.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

from sqlalchemy import Table, select

from adeye.store import tables
from adeye.store.encoding import row_hash
from adeye.store.planning import SelectionHash, judging_hash
from adeye.store.plugin_metrics import plugin_tables
from adeye.store.recording import RUN_HASHED, result_hash, tally_rows
from adeye.store.rows import EngineKey
from adeye.store.stored import Finding
from adeye.store.triggers import trigger_ddl
from adeye.store.views import view_ddl

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sqlalchemy import Connection

_CHUNK = 1000


def verify(connection: Connection) -> Iterator[Finding]:
    """Name every row that is not as it was written, every missing and every extra one."""
    driver: Any = connection.connection.dbapi_connection
    # A damaged text may not be UTF-8; it must be named, not end the check.
    normal = driver.text_factory
    driver.text_factory = lambda raw: raw.decode("utf-8", "surrogateescape")
    try:
        yield from _pages(connection)
        yield from _definitions(connection)
        for table in (*tables.INSERT_ONLY, *plugin_tables(connection)):
            yield from _altered_rows(connection, table)
        yield from _content(connection)
        yield from _missing_references(connection)
        yield from _results(connection)
        yield from _plans(connection)
        yield from _work(connection)
    finally:
        driver.text_factory = normal


def _stream(connection: Connection, table: Table) -> Iterator[tuple[Any, ...]]:
    names = ", ".join(column.name for column in table.columns)
    key = ", ".join(column.name for column in table.primary_key.columns)
    found = connection.exec_driver_sql(
        f"SELECT {names} FROM {table.name} ORDER BY {key}",  # noqa: S608 - names of this package
        execution_options={"yield_per": _CHUNK},
    )
    for item in found:
        yield tuple(item)


def _key(table: Table, values: Sequence[Any]) -> str:
    names = [column.name for column in table.columns]
    key = [str(values[names.index(column.name)]) for column in table.primary_key.columns]
    return " ".join(key)


def _pages(connection: Connection) -> Iterator[Finding]:
    for line in connection.exec_driver_sql("PRAGMA integrity_check").scalars().all():
        if line != "ok":
            yield Finding("database", "", str(line))


def _definitions(connection: Connection) -> Iterator[Finding]:
    """Name triggers and views that are gone or say something else."""
    expected = {_second_name(ddl): ddl for ddl in (*trigger_ddl(), *view_ddl().values())}
    stored = connection.exec_driver_sql(
        "SELECT name, sql FROM sqlite_master WHERE type IN ('trigger', 'view')"
    )
    present = {item.name: item.sql for item in stored}
    for name, ddl in expected.items():
        if name not in present:
            yield Finding("schema", name, "is missing")
        elif present[name] != ddl:
            yield Finding("schema", name, "is not as this release makes it")


def _second_name(ddl: str) -> str:
    """Return the name in ``CREATE VIEW name …``."""
    return ddl.split(maxsplit=3)[2]


def _altered_rows(connection: Connection, table: Table) -> Iterator[Finding]:
    for values in _stream(connection, table):
        try:
            is_same = row_hash(table, values[:-1]) == values[-1]
        except TypeError:
            # A value of a type that was never written, such as a blob.
            is_same = False
        if not is_same:
            yield Finding(table.name, _key(table, values), "altered")


def _content(connection: Connection) -> Iterator[Finding]:
    for table in (tables.odd, tables.scenario, tables.architecture, tables.concept):
        for digest, _id, _version, content, _hash in _stream(connection, table):
            text = str(content).encode("utf-8", "surrogateescape")
            if hashlib.sha256(text).hexdigest() != digest:
                yield Finding(table.name, str(digest), "content does not have this digest")


def _missing_references(connection: Connection) -> Iterator[Finding]:
    for name, row_id, parent, _ in connection.exec_driver_sql("PRAGMA foreign_key_check").all():
        yield Finding(name, f"rowid {row_id}", f"refers to a row that {parent} does not have")


def _results(connection: Connection) -> Iterator[Finding]:
    """Compare each run with its hash over metrics and events, and with its own identity."""
    names = [column.name for column in tables.run.columns]
    metric_of, events_of = _rows_of(tables.metric), _rows_of(tables.event)
    for values in _stream(connection, tables.run):
        stored = dict(zip(names, values, strict=True))
        digest = stored["result_digest"]
        metric = connection.exec_driver_sql(metric_of, (digest,)).first() or ()
        events = connection.exec_driver_sql(events_of, (digest,)).all()
        hashed = _result_hash([stored[name] for name in RUN_HASHED], metric, events)
        if hashed != stored["result_hash"]:
            yield Finding("run", str(digest), "metrics, events or trace digest are not its own")
        engine = EngineKey(
            stored["backend"],
            stored["variant"],
            stored["numerics_version"],
            stored["plugins_digest"],
        )
        if _result_digest(engine, stored["test_case_digest"]) != digest:
            yield Finding("run", str(digest), "is not the result of its test case and engine")
    yield from _unplanned(connection)


def _rows_of(table: Table) -> str:
    """Write the query of a run's rows without their hashes; plain text, as it runs for each."""
    names = ", ".join(column.name for column in table.columns if column.name != "row_hash")
    key = ", ".join(column.name for column in table.primary_key.columns)
    return (
        f"SELECT {names} FROM {table.name} "  # noqa: S608 - names of this package
        f"WHERE result_digest = ? ORDER BY {key}"
    )


def _result_hash(run: Sequence[Any], metric: Sequence[Any], events: Sequence[Any]) -> str:
    try:
        return result_hash(run, metric, events)
    except TypeError:
        return "not a value that was ever written"


def _result_digest(engine: EngineKey, test_case: str) -> str:
    try:
        return engine.result_digest(test_case)
    except ValueError:
        return "not a value that was ever written"


def _unplanned(connection: Connection) -> Iterator[Finding]:
    case = tables.campaign_case
    extra = connection.execute(
        select(tables.run.c.result_digest)
        .outerjoin(case, case.c.result_digest == tables.run.c.result_digest)
        .where(case.c.campaign_id.is_(None))
        .order_by(tables.run.c.result_digest)
    )
    for digest in extra.scalars().all():
        yield Finding("run", digest, "belongs to no campaign")


def _plans(connection: Connection) -> Iterator[Finding]:
    cases = tables.campaign_case
    for campaign in connection.execute(tables.campaign.select()).all():
        identity = SelectionHash(
            campaign.odd_digest, campaign.concept_digest, campaign.gate, campaign.judging
        )
        selected = connection.execute(
            select(*list(cases.c)[2:-1])
            .where(cases.c.campaign_id == campaign.id)
            .order_by(cases.c.ordinal),
            execution_options={"yield_per": _CHUNK},
        )
        for *names, inside_odd, point in selected:
            identity.add((*names, int(inside_odd), point))
        fsrs = connection.execute(
            tables.campaign_fsr.select().where(tables.campaign_fsr.c.campaign_id == campaign.id)
        ).all()
        if (identity.campaign_id, identity.count) != (campaign.id, campaign.planned):
            yield Finding("campaign_case", campaign.id, "cases are not those that were planned")
        if judging_hash(fsrs) != campaign.judging_hash:
            yield Finding("campaign_fsr", campaign.id, "FSRs are not those that were planned")


def _work(connection: Connection) -> Iterator[Finding]:
    blocks = connection.execute(
        tables.work.select().order_by(tables.work.c.campaign_id, tables.work.c.from_ordinal)
    ).all()
    planned = {item.id: item.planned for item in connection.execute(tables.campaign.select()).all()}
    covered: dict[str, int] = dict.fromkeys(planned, 0)
    for block in blocks:
        if covered.get(block.campaign_id) != block.from_ordinal:
            yield Finding("work", str(block.id), "does not begin where the block before it ends")
        covered[block.campaign_id] = block.to_ordinal
        yield from _tallies(connection, block.id, is_done=block.state == "done")
    for campaign, end in covered.items():
        if end != planned.get(campaign):
            yield Finding("work", campaign, f"blocks cover {end} of {planned.get(campaign)} cases")


def _tallies(connection: Connection, work_id: int, *, is_done: bool) -> Iterator[Finding]:
    stored = {
        tuple(item)
        for item in connection.execute(
            tables.tally.select().where(tables.tally.c.work_id == work_id)
        )
    }
    counted = {tuple(item) for item in tally_rows(connection, work_id)} if is_done else set()
    for item in sorted(stored ^ counted, key=str):
        problem = "is not what its block counts to" if item in stored else "is missing"
        yield Finding("tally", _key(tables.tally, item), problem)
