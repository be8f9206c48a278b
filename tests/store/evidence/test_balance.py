import sqlite3
from typing import Any

import pytest

from adeye.store.repository import Repository
from tests.store.raw import unguarded


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
