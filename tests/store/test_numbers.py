"""Numbers of runs follow the order in which runs came in, and nothing else depends on them."""

import sqlite3
from typing import Any

import pytest

from adeye.errors import IntegrityError
from adeye.store.encoding import next_number, run_numbers
from adeye.store.repository import Repository
from tests.store.raw import on_sqlite


def test_runs_are_numbered_from_one_without_gaps(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    with repository._database.read() as connection:
        assert next_number(connection) == 1
    example.campaign(repository, 8)
    numbers = [item[0] for item in raw.execute("SELECT number FROM run ORDER BY number")]
    assert numbers == list(range(1, 9))
    with repository._database.read() as connection:
        assert next_number(connection) == 9


def test_numbers_come_in_the_order_that_was_asked_for(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    example.campaign(repository, 8)
    stored = dict(raw.execute("SELECT result_digest, number FROM run"))
    asked = sorted(stored, reverse=True)
    with repository._database.read() as connection:
        assert run_numbers(connection, asked).tolist() == [stored[digest] for digest in asked]
        assert run_numbers(connection, []).tolist() == []


def test_run_that_was_never_executed_has_no_number(repository: Repository, example: Any) -> None:
    example.campaign(repository, 4)
    with (
        repository._database.read() as connection,
        pytest.raises(IntegrityError, match=r"run f{12} is not in the database"),
    ):
        run_numbers(connection, ["f" * 64])


@on_sqlite
def test_rows_of_one_block_lie_one_after_the_other(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    example.campaign(repository, 8)
    for table in ("metric", "verdict", "event"):
        found = raw.execute(f"SELECT DISTINCT run_number FROM {table}").fetchall()  # noqa: S608
        assert [item[0] for item in found] == list(range(1, 9)), table
