"""Metrics of plug-ins: a wide table for each plug-in and set of metric ids.

A plug-in that changes its metrics gets another table, so that no stored row ever changes. These
rows are hashed and insert-only like all others, but are in no result hash: another campaign may
add them to a result later.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, Final

from sqlalchemy import Connection, MetaData, Table

from adeye.errors import IntegrityError
from adeye.identity import digest
from adeye.judge.verdict import STATUSES
from adeye.store import catalogue as catalog
from adeye.store.block import MetricBlock, RunBlock
from adeye.store.encoding import Column, Dictionary, Row, Texts, hash_words, run_numbers, table_rows
from adeye.store.ledger import insert_new
from adeye.store.records import MetricValue
from adeye.store.schema import insert_only_ddl
from adeye.store.tables import make_metric_table, metadata
from adeye.store.views import identifier

PREFIX: Final = "metric_"
_METRIC_ID: Final = re.compile(r"[a-z][a-z0-9_]{0,63}")
_STATUS: Final = "_status"


@cache
def _reserved() -> frozenset[str]:
    from sqlalchemy.dialects import postgresql, sqlite

    return frozenset(
        {
            *sqlite.dialect.preparer.reserved_words,
            *postgresql.dialect.preparer.reserved_words,
            *metadata.tables,
            *(column.name for table in metadata.tables.values() for column in table.columns),
        }
    )


def is_free(name: str) -> bool:
    """Tell whether a metric may have a name: no word of SQL, and of nothing in the database."""
    return _METRIC_ID.fullmatch(name) is not None and name not in _reserved()


def metric_columns(
    results: Texts, metrics: MetricBlock, ids: Sequence[str] | None = None
) -> list[Column]:
    """List the columns of a wide metric table, without the hash.

    Args:
        results: Result digests of the runs.
        metrics: Their metrics.
        ids: Those of the table; None for all.
    """
    columns: list[Column] = [results]
    statuses = Dictionary(STATUSES)
    for place in [metrics.ids.index(name) for name in metrics.ids if ids is None or name in ids]:
        columns += [
            metrics.value[:, place],
            Texts(metrics.status[:, place], statuses),
            metrics.time_s[:, place],
            Texts(metrics.actor[:, place], metrics.actors),
        ]
    return columns


def metric_values(stored: Mapping[Any, Any], ids: Iterable[str]) -> dict[str, MetricValue]:
    """Read the metrics of a row of a wide metric table."""
    return {
        name: MetricValue(
            value=stored[name],
            status=stored[f"{name}{_STATUS}"],
            time_s=stored[f"{name}_time_s"],
            actor=stored[f"{name}_actor"],
        )
        for name in ids
    }


def record_plugin_metrics(
    connection: Connection, block: RunBlock, differing: frozenset[str]
) -> None:
    """Save the metrics of plug-ins that are not there yet; make their tables if needed.

    Args:
        connection: In a write transaction.
        block: Results; the results themselves are in the database.
        differing: Results that were there with another trace, which have no other metrics.

    Raises:
        IntegrityError: A result has other values of the same plug-in.
        ValueError: The id of a metric is not a lower-case identifier.
    """
    for item in block.plugin_metrics:
        table = _ensure_table(connection, item.plugin, item.metrics.ids)
        columns = metric_columns(Texts(item.run, block.results), item.metrics)
        results = [block.result_digests[run] for run in item.run]
        stored = [run_numbers(connection, results), *columns[1:]]
        made = table_rows(stored, hash_words(columns), table)
        of_number = {new[0]: result for new, result in zip(made, results, strict=True)}

        def refuse(new: Row, of: Mapping[int, str] = of_number, plugin: str = item.plugin) -> None:
            raise IntegrityError(
                f"run {of[new[0]][:12]}: plug-in {plugin!r} measured something else before. "
                "Its metrics must depend on the trace only; a changed metric needs another id."
            )

        # Of a result that came twice the first execution counts.
        once = {new[0]: new for new in reversed(made) if of_number[new[0]] not in differing}
        insert_new(connection, table, reversed(once.values()), refuse)


def plugin_metrics(connection: Connection, run_number: int) -> dict[str, dict[str, MetricValue]]:
    """Read the metrics of all plug-ins for a run, by table and metric id."""
    measured: dict[str, dict[str, MetricValue]] = {}
    for table in plugin_tables(connection):
        found = connection.execute(table.select().where(table.c.run_number == run_number)).first()
        if found is not None:
            measured[table.name] = metric_values(found._mapping, _ids(table))
    return measured


def plugin_tables(connection: Connection) -> tuple[Table, ...]:
    """Describe the tables of plug-ins that the database has."""
    names = [name for name in catalog.table_names(connection) if name.startswith(PREFIX)]
    # Four columns for each metric stand between the key and the hash.
    return tuple(_table(name, catalog.column_names(connection, name)[1:-1:4]) for name in names)


def _table(name: str, ids: Sequence[str]) -> Table:
    return make_metric_table(name, MetaData(naming_convention=metadata.naming_convention), ids)


def _ids(table: Table) -> list[str]:
    return [column.name for column in table.columns][1:-1:4]


def _ensure_table(connection: Connection, plugin: str, ids: tuple[str, ...]) -> Table:
    for name in ids:
        if _METRIC_ID.fullmatch(name) is None:
            msg = f"plug-in {plugin!r}: metric id {name!r} is not a lower-case identifier"
            raise ValueError(msg)
    table = _table(f"{PREFIX}{identifier(plugin)[:40]}_{digest([plugin, ids])[:6]}", ids)
    _create(connection, table)
    return table


def ensure_same_table(connection: Connection, table: Table) -> None:
    """Make the table of a plug-in that another database has.

    Args:
        connection: In a write transaction.
        table: As ``plugin_tables`` describes it.

    Raises:
        IntegrityError: It is not one that a plug-in can have, or other metrics have its name.
    """
    if any(_METRIC_ID.fullmatch(name) is None for name in _ids(table)):
        raise IntegrityError(f"table {table.name} has columns that no metric of a plug-in has")
    here = {item.name: item for item in plugin_tables(connection)}.get(table.name, table)
    if here.columns.keys() != table.columns.keys():
        raise IntegrityError(f"table {table.name} has other columns in the other database")
    _create(connection, table)


def _create(connection: Connection, table: Table) -> None:
    """Make a table unless it is there."""
    if table.name not in catalog.table_names(connection):
        table.create(connection)
        for statement in insert_only_ddl(table.name, connection.dialect.name):
            connection.exec_driver_sql(statement)
