"""Accounts of cases agree with plan and results whatever way they came about, or are named."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from adeye.judge.stl.batch import NEEDED
from adeye.store import tables
from adeye.store.encoding import row_hash
from adeye.store.repository import Repository
from adeye.store.tables import case_count, case_match, case_repeat, case_run, case_tally, never_held
from tests.store.raw import guarded, unguarded

ACCOUNTS = (case_count, case_match, case_run, case_tally, case_repeat, never_held)


@contextmanager
def tampering(raw: sqlite3.Connection) -> Iterator[None]:
    """Do what the triggers forbid."""
    unguarded(raw)
    yield
    guarded(raw)


def content(repository: Repository) -> dict[str, list[Any]]:
    with repository._database.read() as connection:
        return {
            table.name: sorted(map(tuple, connection.execute(table.select()))) for table in ACCOUNTS
        }


def interrupted(repository: Repository, example: Any) -> str:
    """One block is done, one is pending, one set aside."""
    plan = repository.plan_campaign(example.record(), example.cases(12), block_size=4)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert repository.complete_block(block, example.runs(block), example.judged(block))
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert repository.quarantine_block(block, "no result")
    return str(plan.campaign)


@pytest.mark.slow
def test_accounts_tell_the_plan_and_what_is_done(repository: Repository, example: Any) -> None:
    interrupted(repository, example)
    told = content(repository)
    assert [item[1:5] for item in told["case_count"]] == [
        (scenario, architecture, "none", 3)
        for scenario in ("braking", "cut_in")
        for architecture in ("legacy", "new")
    ]
    assert [item[1:4] for item in told["case_match"]] == [
        (ordinal - ordinal % 2, ordinal, "none") for ordinal in range(12)
    ]
    assert [item[1] for item in told["case_run"]] == [0, 1, 2, 3]
    assert [item[5:7] for item in told["case_tally"]] == [(1, 1)] * 4
    assert repository.verify() == ()


CHANGES = [
    (case_count, "planned", 1),
    (case_count, "fault_entry", "x"),
    (case_match, "ordinal", 90),
    (case_match, "fault_entry", "x"),
    (case_run, "run_number", 1),
    (case_run, "ordinal", 90),
    (case_tally, "runs", 1),
    (case_tally, "exercised", -1),
    (case_tally, "scenario", "x"),
    (case_repeat, "passed", 1),
    (case_repeat, "unheld", -1),
    (case_repeat, "scenario", "x"),
    (never_held, "antecedent", "x"),
    (never_held, "decides", -1),
]


@pytest.mark.slow
@pytest.mark.parametrize(("table", "column", "change"), CHANGES, ids=str)
def test_altered_account_is_named_even_with_a_hash_that_fits(
    repository: Repository,
    example: Any,
    raw: sqlite3.Connection,
    table: Any,
    column: str,
    change: Any,
) -> None:
    if table in {case_repeat, never_held}:
        example.repeat(NEEDED)
        example.campaign(repository, 8)
    else:
        interrupted(repository, example)
    names = [item.name for item in table.columns]
    key = ", ".join(item.name for item in table.primary_key.columns)
    values = list(raw.execute(f"SELECT * FROM {table.name} ORDER BY {key} LIMIT 1").fetchone())  # noqa: S608
    former = values[-1]
    values[names.index(column)] += change
    values[-1] = row_hash(table, values[:-1])
    with tampering(raw):
        assignments = ", ".join(f"{name} = ?" for name in names)
        raw.execute(
            f"UPDATE {table.name} SET {assignments} WHERE row_hash = ?",  # noqa: S608
            (*values, former),
        )
    findings = repository.verify()
    told = [item for item in findings if item.table == table.name]
    named = [str(values[names.index(item.name)]) for item in table.primary_key.columns]
    assert any(item.row == " ".join(named) for item in told)


@pytest.mark.slow
def test_what_is_accounted_for_is_no_part_of_the_hash_of_results(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    campaign = example.campaign(repository, 8)
    before = repository.result_table_hash(campaign)
    with tampering(raw):
        raw.execute("DELETE FROM case_tally")
    assert repository.result_table_hash(campaign) == before
    assert set(ACCOUNTS) <= set(tables.INSERT_ONLY)
