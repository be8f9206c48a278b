"""Ledger and seals: what a transaction wrote is counted, what is gone afterwards is named."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import MetaData

from adeye.errors import IntegrityError
from adeye.store import ledger, tables
from adeye.store.database import Database
from adeye.store.encoding import row
from adeye.store.ledger import insert_rows
from adeye.store.repository import Repository
from tests.refusals import refused
from tests.store.conftest import Example, Store
from tests.store.raw import on_sqlite, unguarded

HASHES = [f"{value:032x}" for value in (5, 2**128 - 1, 2**64 + 7)]


def test_sum_does_not_depend_on_the_order() -> None:
    assert ledger.hash_sum(HASHES) == ledger.hash_sum(HASHES[::-1]) == 2**64 + 11
    assert ledger.hash_sum([]) == 0


def test_seal_sums_the_low_bits_by_run() -> None:
    runs, sums = ledger.by_run(np.array([4, 2, 4]), ledger.words_of(HASHES))
    assert runs.tolist() == [2, 4]
    assert sums.tolist() == [2**48 - 1, 12]


def test_tables_of_runs_are_sealed_and_others_are_listed() -> None:
    plugin = tables.make_metric_table("metric_x", MetaData(), ["a"])
    names = [ledger.sealed_name(item) for item in (tables.run, tables.metric, plugin)]
    assert names == ["run", "metric", "plugin"]
    assert ledger.sealed_name(tables.campaign_case) is None


def test_entry_belongs_to_its_place_and_list() -> None:
    given = (1, 2, "odd", "detail")
    others = [(2, 2, "odd", "detail"), (1, 3, "odd", "detail"), (1, 2, "fsr", "detail")]
    assert len({ledger.offset(*item) for item in (given, *others, (1, 2, "odd", "other"))}) == 5


def content(name: str, said: str | None = None) -> Any:
    return row(tables.CONTENT["odd"], (name * 64, said or name, "", "{}"))


@pytest.fixture
def database(repository: Repository) -> Iterator[Database]:
    opened = Database(repository.location)
    yield opened
    opened.close()


def test_transaction_that_fails_leaves_no_entry(store: Store, database: Database) -> None:
    def fail() -> None:
        with database.write() as connection:
            insert_rows(connection, tables.CONTENT["odd"], [content("a")])
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    entries = "SELECT number, place, row_count, is_last FROM ledger"
    assert store.rows(entries) == []
    with database.write() as connection:
        insert_rows(connection, tables.CONTENT["odd"], [content("b")])
    assert store.rows(entries) == [(1, 0, 1, 1)]


@on_sqlite
@pytest.mark.parametrize("table", ["withdrawal", "ledger"])
def test_what_the_database_drops_without_a_word_is_not_said_to_be_written(
    store: Store, table: str
) -> None:
    run = store.repository.find_run("0", campaign=store.campaign(4)).result_digest
    kept = f"SELECT * FROM {table}"  # noqa: S608 - names of this test
    before = store.rows(kept)
    drop = f"CREATE TRIGGER z BEFORE INSERT ON {table} BEGIN SELECT RAISE(IGNORE); END"
    store.raw.execute(drop)
    evidence = store.repository.evidence

    def withdraw() -> None:
        evidence.withdraw(run, author="me", reason="wrong map")

    refused(IntegrityError, withdraw, says=f"kept 0 of 1 rows of table {table}")
    assert store.rows(kept) == before
    assert evidence.withdrawals() == ()
    store.raw.execute("DROP TRIGGER z")
    assert evidence.withdraw(run, author="me", reason="wrong map")


def test_entries_are_written_early(
    store: Store, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ledger, "DETAILED", 2)
    monkeypatch.setattr(ledger, "_WAITING", 1)
    with database.write() as connection:
        for name in "abcdefg":
            insert_rows(connection, tables.CONTENT["odd"], [content(name)])
        assert connection.exec_driver_sql("SELECT count(*) FROM ledger").scalar_one() > 0
    found = store.rows("SELECT place, row_count, is_last FROM ledger ORDER BY place")
    assert found == [(0, 2, 0), (1, 2, 0), (2, 2, 0), (3, 1, 1)]


@pytest.mark.slow
def test_entries_of_blocks_do_not_depend_on_their_order(tmp_path: Path) -> None:
    totals = set()
    for size in (1, 3, 8):
        path = tmp_path / f"{size}.db"
        with Repository.open(path) as repository:
            Example().campaign(repository, 8, block_size=size)
            assert repository.verify() == ()
        with closing(sqlite3.connect(path)) as raw:
            counted = "SELECT sum(row_count) FROM ledger WHERE table_name = 'verdict'"
            totals.add(raw.execute(counted).fetchone())
    assert len(totals) == 1


def test_known_rows_stay_and_of_one_key_the_first_goes_in(store: Store, database: Database) -> None:
    with database.write() as connection:
        insert_rows(connection, tables.CONTENT["odd"], [content("a", "first")])
    with database.write() as connection:
        again = [content("a", "second"), content("b", "third"), content("b", "fourth")]
        insert_rows(connection, tables.CONTENT["odd"], again, ignore_existing=True)
        insert_rows(connection, tables.CONTENT["odd"], [], ignore_existing=True)
    assert store.rows("SELECT id FROM odd ORDER BY digest") == [("first",), ("third",)]
    assert store.rows("SELECT sum(row_count) FROM ledger") == [(2,)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("table", "condition", "row"),
    [
        *(
            (table, "run_number = 4", "RUN")
            for table in ("timing", "criticality", "chain", "basis", "extreme")
        ),
        ("safety_goal", "true", "SG1"),
        ("ledger", "number = 2 AND place = 0", "2 0"),
    ],
)
def test_deleted_row_is_named(store: Store, table: str, condition: str, row: str) -> None:
    campaign = store.campaign()
    unguarded(store.raw)
    (digest,) = store.rows("SELECT result_digest FROM run WHERE number = 4")[0]
    assert store.repository.find_run(digest, campaign=campaign).is_done
    store.raw.execute(f"DELETE FROM {table} WHERE {condition}")  # noqa: S608
    expected = row.replace("RUN", digest)
    found = store.repository.verify()
    assert any(item.table == table and expected in item.row for item in found)


@pytest.mark.parametrize(
    "gone", ["seal WHERE run_number = 4", "ledger WHERE number = (SELECT max(number) FROM ledger)"]
)
def test_seal_or_last_entry_that_is_gone_is_told_from_the_rows(store: Store, gone: str) -> None:
    store.campaign()
    unguarded(store.raw)
    store.raw.execute(f"DELETE FROM {gone}")  # noqa: S608
    found = {item.table for item in store.repository.verify()} - {"schema"}
    assert (found == {"seal"}) if gone.startswith("seal") else found
