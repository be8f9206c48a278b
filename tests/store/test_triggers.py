import sqlite3
from typing import Any

import pytest

from adeye.store import tables
from adeye.store.repository import Repository
from adeye.store.triggers import trigger_ddl


@pytest.mark.parametrize("table", [table.name for table in tables.INSERT_ONLY])
@pytest.mark.parametrize("statement", ["UPDATE {} SET row_hash = 'x'", "DELETE FROM {}"])
def test_stored_row_is_never_changed_or_deleted(
    repository: Repository, example: Any, raw: sqlite3.Connection, table: str, statement: str
) -> None:
    example.decompose()
    campaign = example.campaign(repository, 4)
    example.hindsight(repository, campaign)
    example.halved(repository, campaign)
    example.campaign(repository, 2)
    example.campaign(repository, 4)
    example.vouched(repository, campaign)
    count = f"SELECT count(*) FROM {table}"  # noqa: S608 - a table of this package
    before = raw.execute(count).fetchone()
    assert before != (0,)
    with pytest.raises(sqlite3.IntegrityError, match=f"{table} is insert-only"):
        raw.execute(statement.format(table))
    assert raw.execute(count).fetchone() == before
    assert repository.verify() == ()


def test_dialect_without_triggers_is_an_error() -> None:
    with pytest.raises(KeyError):
        trigger_ddl("mysql")
