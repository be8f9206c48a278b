"""Accounts of cases agree with plan and results whatever way they came about, or are named."""

import random  # noqa: TID251 - tests may draw
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from adeye.judge.stl.batch import NEEDED
from adeye.store import tables
from adeye.store.accounts import CaseGroups
from adeye.store.encoding import row_hash
from adeye.store.repository import Repository
from adeye.store.tables import case_count, case_match, case_repeat, case_run, case_tally, never_held
from tests.store.conftest import Store
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


def interrupted(store: Store) -> str:
    """One block is done, one is pending, one set aside."""
    plan = store.plan(12, block_size=4)
    block = store.claim(plan.campaign)
    assert store.complete(block, verdicts=store.example.judged(block))
    assert store.repository.quarantine_block(store.claim(plan.campaign), "no result")
    return plan.campaign


def test_accounts_tell_the_plan_and_what_is_done(store: Store) -> None:
    interrupted(store)
    told = content(store.repository)
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
    assert store.repository.verify() == ()


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
def test_altered_account_is_named(store: Store, table: Any, column: str, change: Any) -> None:
    if table in {case_repeat, never_held}:
        store.example.repeat(NEEDED)
        store.campaign(8)
    else:
        interrupted(store)
    names = [item.name for item in table.columns]
    key = ", ".join(item.name for item in table.primary_key.columns)
    values = list(store.rows(f"SELECT * FROM {table.name} ORDER BY {key} LIMIT 1")[0])  # noqa: S608
    former = values[-1]
    values[names.index(column)] += change
    values[-1] = row_hash(table, values[:-1])
    with tampering(store.raw):
        assignments = ", ".join(f"{name} = ?" for name in names)
        store.raw.execute(
            f"UPDATE {table.name} SET {assignments} WHERE row_hash = ?",  # noqa: S608
            (*values, former),
        )
    findings = store.repository.verify()
    told = [item for item in findings if item.table == table.name]
    named = [str(values[names.index(item.name)]) for item in table.primary_key.columns]
    assert any(item.row == " ".join(named) for item in told)


def test_what_is_accounted_for_is_no_part_of_the_hash_of_results(store: Store) -> None:
    campaign = store.campaign(8)
    before = store.result_hash(campaign)
    with tampering(store.raw):
        store.raw.execute("DELETE FROM case_tally")
    assert store.result_hash(campaign) == before
    assert set(ACCOUNTS) <= set(tables.INSERT_ONLY)


Case = tuple[str, str, str, str]


def fed(cases: list[Case], part: int = 3) -> CaseGroups:
    """Feed cases one after the other, those of one kind together as far as they are in line."""
    groups = CaseGroups()
    waiting: list[Case] = []
    for case in [*cases, ("", "", "", "")]:
        if waiting and (case[:3] != waiting[0][:3] or len(waiting) == part):
            groups.add(*waiting[0][:3], [item[3] for item in waiting])
            waiting = []
        waiting.append(case)
    return groups


def matched(groups: CaseGroups) -> list[tuple[int, int, str]]:
    return [(item[1], item[2], item[3]) for rows in groups.matches("c") for item in rows]


def compared(cases: list[Case]) -> list[tuple[int, int, str]]:
    """Compare every case with every other one."""
    found = []
    for ordinal, (scenario, _, fault, situation) in enumerate(cases):
        same = [
            (other, case[1])
            for other, case in enumerate(cases)
            if (case[0], case[2], case[3]) == (scenario, fault, situation)
        ]
        if len({architecture for _, architecture in same}) > 1:
            found.append((same[0][0], ordinal, fault))
    return sorted(found)


@pytest.mark.parametrize("seed", range(20))
def test_groups_are_those_that_comparing_every_two_cases_finds(seed: int) -> None:
    picks = random.Random(seed)  # noqa: S311 - made up
    cases = [
        (picks.choice("st"), picks.choice("abc"), picks.choice(["none", "f", "f+g"]), str(number))
        for number in picks.choices(range(8), k=picks.randrange(60))
    ]
    groups = fed(cases)
    assert matched(groups) == compared(cases)
    counts = {item[1:4]: item[4] for item in groups.counts("c")}
    assert counts == {kind: [case[:3] for case in cases].count(kind) for kind in counts}
    assert sum(counts.values()) == len(cases)


def test_one_architecture_has_no_partners() -> None:
    groups = fed([("s", "a", "none", "1"), ("s", "a", "none", "1"), ("s", "a", "none", "2")])
    assert matched(groups) == []


def test_texts_that_join_to_the_same_are_different_groups() -> None:
    cases = [("s", "a", "f", "1"), ("sf", "b", "", "1"), ("s", "b", "", "f1")]
    assert matched(fed(cases)) == []


def test_many_cases_come_in_parts_in_the_order_of_the_plan() -> None:
    situations = [str(number) for number in range(6_000)]
    groups = CaseGroups()
    for architecture in "ab":
        groups.add("s", architecture, "none", situations)
    parts = list(groups.matches("c"))
    assert len(parts) > 1
    found = [(item[1], item[2]) for rows in parts for item in rows]
    assert found == [(n, m) for n in range(6_000) for m in (n, n + 6_000)]
