"""Save the metrics of plug-ins: make their tables, and add what is not there yet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sqlalchemy import Connection, Table

from adeye.errors import IntegrityError
from adeye.identity import digest
from adeye.judge.verdict import STATUSES
from adeye.store import catalogue as catalog
from adeye.store.block import MetricBlock, RunBlock
from adeye.store.encoding import Column, Dictionary, Row, Texts, hash_words, run_numbers, table_rows
from adeye.store.ledger import insert_new
from adeye.store.plugin_metrics import METRIC_ID, PREFIX, described, ids_of, plugin_tables
from adeye.store.schema import insert_only_ddl
from adeye.store.views import identifier


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


def _ensure_table(connection: Connection, plugin: str, ids: tuple[str, ...]) -> Table:
    for name in ids:
        if METRIC_ID.fullmatch(name) is None:
            msg = f"plug-in {plugin!r}: metric id {name!r} is not a lower-case identifier"
            raise ValueError(msg)
    table = described(f"{PREFIX}{identifier(plugin)[:40]}_{digest([plugin, ids])[:6]}", ids)
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
    if any(METRIC_ID.fullmatch(name) is None for name in ids_of(table)):
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
