import sqlite3
from typing import Any

import numpy as np
import pytest
from sqlalchemy import MetaData

from adeye.store import ledger, tables
from adeye.store.database import Database
from adeye.store.encoding import row
from adeye.store.ledger import insert_rows
from adeye.store.repository import Repository
from tests.store.raw import unguarded

HASHES = [f"{value:032x}" for value in (5, 2**128 - 1, 2**64 + 7)]


def test_sum_does_not_depend_on_the_order() -> None:
    assert ledger.hash_sum(HASHES) == ledger.hash_sum(HASHES[::-1]) == 2**64 + 11
    assert ledger.hash_sum([]) == 0


def test_seal_sums_the_low_bits_by_run() -> None:
    runs, sums = ledger.by_run(np.array([4, 2, 4]), HASHES)
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


def content(name: str) -> Any:
    return row(tables.odd, (name * 64, name, "", "{}"))


def test_transaction_that_fails_leaves_no_entry(
    repository: Repository, raw: sqlite3.Connection
) -> None:
    database = Database(repository.location)

    def fail() -> None:
        with database.write() as connection:
            insert_rows(connection, tables.odd, [content("a")])
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert raw.execute("SELECT count(*) FROM ledger").fetchone() == (0,)
    with database.write() as connection:
        insert_rows(connection, tables.odd, [content("b")])
    database.close()
    (entry,) = raw.execute("SELECT number, place, row_count, is_last FROM ledger").fetchall()
    assert entry == (1, 0, 1, 1)


def test_many_entries_are_written_before_the_end(
    repository: Repository, raw: sqlite3.Connection, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ledger, "DETAILED", 2)
    monkeypatch.setattr(ledger, "_WAITING", 1)
    database = Database(repository.location)
    with database.write() as connection:
        for name in "abcdefg":
            insert_rows(connection, tables.odd, [content(name)])
        assert connection.exec_driver_sql("SELECT count(*) FROM ledger").scalar_one() > 0
    database.close()
    found = raw.execute("SELECT place, row_count, is_last FROM ledger ORDER BY place").fetchall()
    assert found == [(0, 2, 0), (1, 2, 0), (2, 2, 0), (3, 1, 1)]


@pytest.mark.slow
def test_entries_of_blocks_do_not_depend_on_their_order(make_example: Any, tmp_path: Any) -> None:
    totals = set()
    for size in (1, 3, 8):
        example = make_example()
        with Repository.open(tmp_path / f"{size}.db") as repository:
            example.campaign(repository, 8, block_size=size)
            assert repository.verify() == ()
            read = sqlite3.connect(tmp_path / f"{size}.db")
            totals.add(read.execute("SELECT sum(row_count) FROM ledger "
                "WHERE table_name = 'verdict'").fetchone())  # fmt: skip
            read.close()
    assert len(totals) == 1


def test_known_rows_stay_and_of_one_key_the_first_goes_in(repository: Repository) -> None:
    def made(key: str, name: str) -> tuple[object, ...]:
        return row(tables.odd, (key * 64, name, "", "{}"))

    database = Database(repository.location)
    with database.write() as connection:
        insert_rows(connection, tables.odd, [made("a", "first")])
    with database.write() as connection:
        again = [made("a", "second"), made("b", "third"), made("b", "fourth")]
        insert_rows(connection, tables.odd, again, ignore_existing=True)
        insert_rows(connection, tables.odd, [], ignore_existing=True)
    with database.read() as connection:
        found = connection.exec_driver_sql("SELECT id FROM odd ORDER BY digest").scalars().all()
        counted = connection.exec_driver_sql("SELECT sum(row_count) FROM ledger").scalar_one()
    database.close()
    assert (found, counted) == (["first", "third"], 2)


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    return str(example.campaign(repository, 8))


def found(repository: Repository) -> set[tuple[str, str]]:
    return {(item.table, item.row) for item in repository.verify() if item.table != "schema"}


@pytest.mark.slow
@pytest.mark.parametrize("table", ["timing", "criticality", "chain", "basis", "extreme"])
def test_deleted_derived_row_is_named_by_its_run(
    repository: Repository, campaign: str, raw: sqlite3.Connection, table: str
) -> None:
    digest = repository.find_run("3", campaign=campaign).result_digest
    unguarded(raw)
    number = "(SELECT number FROM run WHERE result_digest = ?)"
    raw.execute(f"DELETE FROM {table} WHERE run_number = {number}", (digest,))  # noqa: S608
    assert (table, digest) in found(repository)


@pytest.mark.slow
def test_deleted_listed_row_is_named_by_its_key(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    assert campaign
    unguarded(raw)
    raw.execute("DELETE FROM safety_goal")
    assert any(table == "safety_goal" and "SG1" in row for table, row in found(repository))


@pytest.mark.slow
def test_last_entry_that_is_gone_leaves_rows_without_one(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    assert campaign
    unguarded(raw)
    raw.execute("DELETE FROM ledger WHERE number = (SELECT max(number) FROM ledger)")
    assert found(repository) != set()


@pytest.mark.slow
def test_entry_in_the_middle_that_is_gone_is_named(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    assert campaign
    unguarded(raw)
    raw.execute("DELETE FROM ledger WHERE number = 2 AND place = 0")
    assert ("ledger", "2 0") in found(repository)


@pytest.mark.slow
def test_seal_that_is_gone_is_told_from_the_rows(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    assert campaign
    unguarded(raw)
    raw.execute("DELETE FROM seal WHERE run_number = 4")
    assert {table for table, _ in found(repository)} == {"seal"}
