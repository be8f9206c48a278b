"""What the cases of a block lack: results, verdicts, or nothing."""

import pytest

from tests.store.conftest import Store
from tests.store.raw import on_sqlite


def test_run_that_exists_needs_only_the_verdicts_it_lacks(store: Store) -> None:
    store.campaign(4)
    store.example.thresholds["FSR1"] = "3 m"
    plan = store.plan(4)
    assert (plan.to_execute, plan.to_judge) == (0, 4)
    block = store.claim(plan.campaign)
    assert block.to_execute == ()
    assert {case.missing_fsrs for case in block.to_judge} == {("FSR1",)}


@pytest.mark.slow
def test_new_threshold_adds_rows_and_keeps_the_old_ones(store: Store) -> None:
    first = store.campaign(4)
    before = store.result_hash(first)
    store.example.thresholds["FSR1"] = "3 m"
    second = store.campaign(4)
    assert store.repository.info().rows["verdict"] == 4 * 2 + 4
    assert store.repository.info().rows["run"] == 4
    assert store.result_hash(first) == before
    assert store.repository.progress(second).accounted == 4
    assert store.repository.verify() == ()


def test_fsr_that_does_not_apply_is_not_asked_for(store: Store) -> None:
    store.example.not_applicable = {"FSR2": {"legacy": "it has no radar"}}
    plan = store.plan(2)
    block = store.claim(plan.campaign)
    assert [case.missing_fsrs for case in block.cases] == [("FSR1",), ("FSR1", "FSR2")]


def test_case_outside_the_odd_is_asked_for_what_applies_outside(store: Store) -> None:
    outside = store.example.case(0, inside_odd=False)
    plan = store.plan([outside])
    block = store.claim(plan.campaign)
    assert block.cases[0].missing_fsrs == ("FSR3",)


def test_gaps_are_the_results_that_lack_verdicts_in_the_order_of_the_plan(store: Store) -> None:
    campaign = store.campaign(4)
    assert store.repository.again.gaps(campaign) == []
    store.example.thresholds["FSR1"] = "3 m"
    plan = store.plan(6)
    gaps = store.repository.again.gaps(plan.campaign)
    assert [(item.ordinal, item.fsrs) for item in gaps] == [(n, ("FSR1",)) for n in range(4)]


@on_sqlite
def test_cases_at_the_end_of_a_large_plan_are_found_by_their_index(store: Store) -> None:
    plan = store.plan(400, block_size=4)
    store.raw.execute("UPDATE work SET state = 'done' WHERE to_ordinal < 400")
    block = store.claim(plan.campaign)
    assert [case.ordinal for case in block.cases] == [396, 397, 398, 399]
    steps = store.rows(
        "EXPLAIN QUERY PLAN SELECT * FROM campaign_case "
        "WHERE campaign_id = 'c' AND ordinal >= 900000 AND ordinal < 901024"
    )
    assert all("SEARCH campaign_case USING INDEX" in step[-1] for step in steps)


def test_half_executed_block_lacks_the_other_half(store: Store) -> None:
    store.campaign(6)
    store.example.with_odd("2")
    store.example.thresholds["FSR2"] = "2 s"
    plan = store.plan(8, block_size=8)
    block = store.claim(plan.campaign)
    lacking = [(case.ordinal, case.has_result, case.missing_fsrs) for case in block.cases]
    assert lacking == [
        *[(ordinal, True, ("FSR2",)) for ordinal in range(6)],
        *[(ordinal, False, ("FSR1", "FSR2")) for ordinal in (6, 7)],
    ]
    assert (plan.to_execute, plan.to_judge) == (2, 6)
