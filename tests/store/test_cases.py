import sqlite3
from typing import Any

import pytest

from adeye.store.repository import Repository
from tests.store.raw import on_sqlite
from tests.store.rows import result_table_hash


def test_run_that_exists_needs_only_the_verdicts_it_lacks(
    repository: Repository, example: Any
) -> None:
    example.campaign(repository, 4)
    example.thresholds["FSR1"] = "3 m"
    plan = repository.plan_campaign(example.record(), example.cases(4))
    assert (plan.to_execute, plan.to_judge) == (0, 4)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert block.to_execute == ()
    assert {case.missing_fsrs for case in block.to_judge} == {("FSR1",)}


@pytest.mark.slow
def test_new_threshold_adds_rows_and_keeps_the_old_ones(
    repository: Repository, example: Any
) -> None:
    first = example.campaign(repository, 4)
    before = result_table_hash(repository, first)
    example.thresholds["FSR1"] = "3 m"
    second = example.campaign(repository, 4)
    assert repository.info().rows["verdict"] == 4 * 2 + 4
    assert repository.info().rows["run"] == 4
    assert result_table_hash(repository, first) == before
    assert repository.progress(second).accounted == 4
    assert repository.verify() == ()


def test_fsr_that_does_not_apply_is_not_asked_for(repository: Repository, example: Any) -> None:
    example.not_applicable = {"FSR2": {"legacy": "it has no radar"}}
    plan = repository.plan_campaign(example.record(), example.cases(2))
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert [case.missing_fsrs for case in block.cases] == [("FSR1",), ("FSR1", "FSR2")]


def test_case_outside_the_odd_is_asked_for_what_applies_outside(
    repository: Repository, example: Any
) -> None:
    outside = example.case(0, inside_odd=False)
    plan = repository.plan_campaign(example.record(), [outside])
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert block.cases[0].missing_fsrs == ("FSR3",)


def test_gaps_are_the_results_that_lack_verdicts_in_the_order_of_the_plan(
    repository: Repository, example: Any
) -> None:
    campaign = example.campaign(repository, 4)
    assert repository.again.gaps(campaign) == []
    example.thresholds["FSR1"] = "3 m"
    plan = repository.plan_campaign(example.record(), example.cases(6))
    gaps = repository.again.gaps(plan.campaign)
    assert [(item.ordinal, item.fsrs) for item in gaps] == [(n, ("FSR1",)) for n in range(4)]


@on_sqlite
def test_cases_at_the_end_of_a_large_plan_are_found_by_their_index(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(400), block_size=4)
    raw.execute("UPDATE work SET state = 'done' WHERE to_ordinal < 400")
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert [case.ordinal for case in block.cases] == [396, 397, 398, 399]
    steps = raw.execute(
        "EXPLAIN QUERY PLAN SELECT * FROM campaign_case "
        "WHERE campaign_id = 'c' AND ordinal >= 900000 AND ordinal < 901024"
    ).fetchall()
    assert all("SEARCH campaign_case USING INDEX" in step[-1] for step in steps)


def test_half_executed_block_lacks_the_other_half(repository: Repository, example: Any) -> None:
    example.campaign(repository, 6)
    example.with_odd("2")
    example.thresholds["FSR2"] = "2 s"
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=8)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    lacking = [(case.ordinal, case.has_result, case.missing_fsrs) for case in block.cases]
    assert lacking == [
        *[(ordinal, True, ("FSR2",)) for ordinal in range(6)],
        *[(ordinal, False, ("FSR1", "FSR2")) for ordinal in (6, 7)],
    ]
    assert (plan.to_execute, plan.to_judge) == (2, 6)
