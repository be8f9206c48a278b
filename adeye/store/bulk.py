"""Many inserts into a table with digests for keys: with room for its indexes, or without them.

A digest falls anywhere into an index, so that an insert touches a page of its own. A larger cache
keeps these pages; an index that gets more entries than it had is cheaper built again at the end.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from adeye.store.catalog import is_server

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Table

CACHE_KIB: Final = 131_072
MANY_ROWS: Final = 20_000
"""Rows from which on an index is built again."""


@contextmanager
def large_cache(connection: Connection) -> Iterator[None]:
    """Let SQLite keep more pages in memory for a while; it takes them as it needs them."""
    if is_server(connection):
        yield
        return
    before = connection.exec_driver_sql("PRAGMA cache_size").scalar_one()
    connection.exec_driver_sql(f"PRAGMA cache_size = -{CACHE_KIB}")
    try:
        yield
    finally:
        connection.exec_driver_sql(f"PRAGMA cache_size = {before}")


@contextmanager
def rebuilt_indexes(connection: Connection, table: Table) -> Iterator[None]:
    """Insert without the table's own indexes and make them at the end.

    Args:
        connection: In a write transaction, which takes everything back if an insert fails.
        table: Where rows are inserted.
    """
    if is_server(connection):
        # A server has others who need its indexes meanwhile.
        yield
        return
    found = connection.exec_driver_sql(
        "SELECT name, sql FROM sqlite_master WHERE type = 'index' AND tbl_name = ? "
        "AND sql IS NOT NULL ORDER BY rowid",
        (table.name,),
    ).all()
    for name, _ in found:
        connection.exec_driver_sql(f"DROP INDEX {name}")
    yield
    for _, ddl in found:
        connection.exec_driver_sql(ddl)


def is_worth_rebuilding(rows: int, size: int) -> bool:
    """Tell whether making the indexes of a table again is cheaper than inserting into them.

    Args:
        rows: How many are inserted.
        size: How many there were before.
    """
    return rows >= MANY_ROWS and rows >= size


def size_of(connection: Connection, table: Table) -> int:
    """Count the rows of an insert-only table, whose row numbers have no gaps."""
    counted = "count(*)" if is_server(connection) else "max(rowid)"
    found = connection.exec_driver_sql(f"SELECT {counted} FROM {table.name}")  # noqa: S608 - own names
    return int(found.scalar() or 0)
