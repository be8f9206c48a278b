"""Verbs that do not have figures verified read none."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from typing import Any

import pytest
from sqlalchemy import event
from sqlalchemy.pool import Pool

from adeye.store.evidence.verification import _FIGURES


@pytest.fixture
def read() -> Iterator[set[tuple[str, str]]]:
    """Note the columns that SQLite reads meanwhile, by table."""
    found: set[tuple[str, str]] = set()

    def ask(action: int, table: str | None, column: str | None, *_: Any) -> int:
        if action == sqlite3.SQLITE_READ:
            found.add((str(table), str(column)))
        return sqlite3.SQLITE_OK

    def listen(connection: Any, _record: object) -> None:
        connection.set_authorizer(ask)

    event.listen(Pool, "connect", listen)
    yield found
    event.remove(Pool, "connect", listen)


@pytest.mark.parametrize("verb", ["check", "coverage"])
def test_verbs_without_figures_read_none(
    adeye: Any, copied: str, read: set[tuple[str, str]], verb: str
) -> None:
    adeye(verb, "--db", copied)
    figures = {table.name for table in _FIGURES}
    # The ledger is compared with the hash of every row.
    told = {"run_number", "row_hash", ""}
    assert ("verdict", "margin") in read
    assert [item for item in read if item[0] in figures and item[1] not in told] == []
