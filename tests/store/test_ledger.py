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
