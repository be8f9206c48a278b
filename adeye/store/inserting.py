"""The one way for rows of evidence into the database: insert what is new and note it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import Integer

from adeye.store import ledger
from adeye.store.encoding import Row, driver_insert

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sqlalchemy import Connection, Table

_CHUNK: Final = 10_000


def insert_rows(
    connection: Connection, table: Table, rows: Iterable[Row], *, ignore_existing: bool = False
) -> None:
    """Insert rows that have a value for every column, in the order of the columns.

    Args:
        connection: In a transaction of ``Database.write``, whose end writes the ledger.
        table: An insert-only table.
        rows: The rows.
        ignore_existing: Leave out rows whose key is there already; of several with one key the
            first goes in.
    """
    batch = list(rows)
    if ignore_existing:
        batch = _new(connection, table, batch)
    if batch:
        driver_insert(connection, table, batch)
        ledger.note(connection, table, batch)


def _new(connection: Connection, table: Table, rows: list[Row]) -> list[Row]:
    """Choose the rows whose key is not there, each key once."""
    places = ledger.key_places(table)
    found: dict[Any, Row] = {}
    for item in rows:
        found.setdefault(tuple(item[place] for place in places), item)
    for key in _known(connection, table, [item[places[0]] for item in found.values()]):
        found.pop(key, None)
    return list(found.values())


def _known(connection: Connection, table: Table, first: list[Any]) -> Iterable[tuple[Any, ...]]:
    """Read the keys that are there, of rows whose key begins with one of some values."""
    columns = list(table.primary_key.columns)
    names = ", ".join(column.name for column in columns)
    value = "CAST(value AS INTEGER)" if isinstance(columns[0].type, Integer) else "value"
    wanted = sorted(set(first))
    for start in range(0, len(wanted), _CHUNK):
        part = [
            item if isinstance(item, str) else int(item) for item in wanted[start : start + _CHUNK]
        ]
        found = connection.exec_driver_sql(
            f"SELECT {names} FROM {table.name} "  # noqa: S608 - own names
            f"WHERE {columns[0].name} IN (SELECT {value} FROM json_each(?))",
            (json.dumps(part),),
        )
        yield from map(tuple, found)
