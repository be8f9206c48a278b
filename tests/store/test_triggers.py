import sqlite3
from typing import Any

import pytest

from adeye.judge.stl.batch import NEEDED
from adeye.store import tables
from adeye.store.repository import Repository
from adeye.store.schema import trigger_ddl


@pytest.mark.slow
def test_stored_rows_are_never_changed_or_deleted(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    example.decompose()
    campaign = example.campaign(repository, 4)
    example.hindsight(repository, campaign)
    example.halved(repository, campaign)
    example.campaign(repository, 2)
    example.campaign(repository, 4)
    example.vouched(repository, campaign)
    example.repeat(NEEDED)
    example.campaign(repository, 8)
    for table in (item.name for item in tables.INSERT_ONLY):
        count = f"SELECT count(*) FROM {table}"  # noqa: S608 - a table of this package
        before = raw.execute(count).fetchone()
        assert before != (0,), table
        for statement in ("UPDATE {} SET row_hash = 'x'", "DELETE FROM {}"):
            with pytest.raises(sqlite3.IntegrityError, match=f"{table} is insert-only"):
                raw.execute(statement.format(table))
        assert raw.execute(count).fetchone() == before, table
    assert repository.verify() == ()


def test_dialect_without_triggers_is_an_error() -> None:
    with pytest.raises(KeyError):
        trigger_ddl("mysql")
