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

from adeye.store import catalogue as catalog
from adeye.store.records import MetricValue
from adeye.store.run_tables import make_metric_table
from adeye.store.table_parts import metadata

PREFIX: Final = "metric_"
METRIC_ID: Final = re.compile(r"[a-z][a-z0-9_]{0,63}")
_STATUS: Final = "_status"


@cache
def _reserved() -> frozenset[str]:
    from sqlalchemy.dialects import postgresql, sqlite

    from adeye.store.tables import metadata

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
    return METRIC_ID.fullmatch(name) is not None and name not in _reserved()


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


def plugin_metrics(connection: Connection, run_number: int) -> dict[str, dict[str, MetricValue]]:
    """Read the metrics of all plug-ins for a run, by table and metric id."""
    measured: dict[str, dict[str, MetricValue]] = {}
    for table in plugin_tables(connection):
        found = connection.execute(table.select().where(table.c.run_number == run_number)).first()
        if found is not None:
            measured[table.name] = metric_values(found._mapping, ids_of(table))
    return measured


def plugin_tables(connection: Connection) -> tuple[Table, ...]:
    """Describe the tables of plug-ins that the database has."""
    names = [name for name in catalog.table_names(connection) if name.startswith(PREFIX)]
    # Four columns for each metric stand between the key and the hash.
    return tuple(described(name, catalog.column_names(connection, name)[1:-1:4]) for name in names)


def described(name: str, ids: Sequence[str]) -> Table:
    """Describe the table of a plug-in by its name and metrics."""
    return make_metric_table(name, MetaData(naming_convention=metadata.naming_convention), ids)


def ids_of(table: Table) -> list[str]:
    """List the metrics of a table."""
    return [column.name for column in table.columns][1:-1:4]
