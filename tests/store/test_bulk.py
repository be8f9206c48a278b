"""Bulk inserts leave the database as single ones would: same indexes, same cache."""

import sqlite3
from typing import Any

import pytest

from adeye.store import encoding as bulk
from adeye.store import tables
from adeye.store.repository import Repository
from tests.store.raw import on_sqlite


def indexes(raw: sqlite3.Connection) -> set[tuple[str, str]]:
    return set(raw.execute("SELECT name, sql FROM sqlite_master WHERE type = 'index'"))


def contents(raw: sqlite3.Connection) -> list[str]:
    """All rows in order, without what stands where in the schema, and without times of day."""
    dumped = [line for line in raw.iterdump() if line.startswith("INSERT")]
    timed = ('"campaign"', "'campaign'")
    return sorted(line for line in dumped if not any(word in line for word in timed))


@on_sqlite
def test_rebuilt_indexes_are_those_that_were_there(
    repository: Repository, example: Any, raw: sqlite3.Connection, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = indexes(raw)
    monkeypatch.setattr(bulk, "MANY_ROWS", 1)
    repository.plan_campaign(example.record(), example.cases(40))
    assert indexes(raw) == before
    assert repository.verify() == ()
    assert raw.execute("PRAGMA integrity_check").fetchall() == [("ok",)]


def test_rebuilding_changes_no_row(
    make_example: Any, empty: bytes, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for many in (1, 10**9):
        monkeypatch.setattr(bulk, "MANY_ROWS", many)
        path = tmp_path / f"{many}.db"
        path.write_bytes(empty)
        example = make_example()
        with Repository.open(path, create=False) as opened:
            opened.plan_campaign(example.record(), example.cases(40))
        found.append(contents(sqlite3.connect(path)))
    assert found[0] == found[1]


@on_sqlite
def test_failure_while_rebuilding_leaves_the_indexes(
    repository: Repository, example: Any, raw: sqlite3.Connection, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = indexes(raw)
    monkeypatch.setattr(bulk, "MANY_ROWS", 1)
    monkeypatch.setattr("adeye.store.write.planning._CHUNK", 1)

    def broken() -> Any:
        yield from example.cases(3)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        repository.plan_campaign(example.record(), broken())
    assert indexes(raw) == before
    assert set(repository.info().rows.values()) == {0}


def test_few_rows_and_rows_into_many_use_the_indexes() -> None:
    assert bulk.is_worth_rebuilding(bulk.MANY_ROWS, 0)
    assert bulk.is_worth_rebuilding(bulk.MANY_ROWS, bulk.MANY_ROWS)
    assert not bulk.is_worth_rebuilding(bulk.MANY_ROWS - 1, 0)
    assert not bulk.is_worth_rebuilding(bulk.MANY_ROWS, bulk.MANY_ROWS + 1)


@on_sqlite
def test_cache_is_large_for_a_while_only(repository: Repository) -> None:
    with repository._database.write() as connection:
        before = connection.exec_driver_sql("PRAGMA cache_size").scalar_one()
        with bulk.large_cache(connection):
            during = connection.exec_driver_sql("PRAGMA cache_size").scalar_one()
        after = connection.exec_driver_sql("PRAGMA cache_size").scalar_one()
        assert (during, after) == (-bulk.CACHE_KIB, before)
        assert bulk.size_of(connection, tables.test_case) == 0
