"""Blocks cover every ordinal once and cross no end of a structure."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import InputError
from adeye.spec.concept import Waiver
from adeye.store.block import PlannedCases
from adeye.store.records import EngineKey
from adeye.store.write.planning import Selection, SelectionHash, block_bounds
from tests.store.conftest import Example, Store
from tests.store.raw import on_sqlite, rows
from tests.store.rows import COLUMNS, PlannedCase


def blocks(store: Store) -> list[tuple[int, int, str, str]]:
    return store.rows("SELECT from_ordinal, to_ordinal, kind, state FROM work ORDER BY id")


def test_plan_is_committed_before_anything_runs(store: Store) -> None:
    plan = store.plan(iter(store.example.cases(8)), block_size=3)
    assert (plan.planned, plan.to_execute, plan.to_judge, plan.is_new) == (8, 8, 0, True)
    assert blocks(store) == [
        (0, 3, "execute", "pending"),
        (3, 6, "execute", "pending"),
        (6, 8, "execute", "pending"),
    ]
    counted = store.repository.info().rows
    assert (counted["test_case"], counted["scenario"]) == (8, 2)


def test_same_selection_is_the_same_campaign_and_changes_no_row(store: Store) -> None:
    campaign = store.campaign()
    before = rows(store.raw)
    again = store.plan(8, block_size=5)
    assert again.campaign == campaign
    assert (again.to_execute, again.to_judge, again.is_new) == (0, 0, False)
    assert rows(store.raw) == before
    assert store.repository.claim_block(campaign=campaign) is None


def test_whatever_is_selected_makes_another_campaign(store: Store) -> None:
    def planned(change: Callable[[Example, list[PlannedCase]], object]) -> str:
        example = Example()
        cases = example.cases(4)
        change(example, cases)
        return store.repository.plan_campaign(example.record(), cases).campaign

    def with_first(cases: list[PlannedCase], **changes: Any) -> None:
        cases[0] = replace(cases[0], **changes)

    other = EngineKey("batch", "v", 1)
    changes: dict[str, Callable[[Example, list[PlannedCase]], object]] = {
        "nothing": lambda _, __: None,
        "odd": lambda example, _: example.with_odd("2"),
        "threshold": lambda example, _: example.thresholds.update(FSR1="3 m"),
        "engine": lambda _, cases: with_first(cases, engine=other),
        "order": lambda _, cases: cases.reverse(),
        "fewer": lambda _, cases: cases.pop(),
        "gate": lambda example, _: setattr(example, "gate", ("legacy",)),
        "inside": lambda _, cases: with_first(cases, inside_odd=(False,)),
        "name": lambda _, cases: with_first(cases, scenario="cut_in_again"),
    }
    campaigns = {name: planned(change) for name, change in changes.items()}
    assert len(set(campaigns.values())) == len(changes), campaigns


def test_only_what_is_new_is_executed(store: Store) -> None:
    store.campaign(8)
    store.example.with_odd("2")
    plan = store.plan(12, block_size=8)
    assert (plan.planned, plan.reused, plan.to_execute, plan.to_judge) == (12, 8, 4, 0)
    assert blocks(store)[-2:] == [(0, 8, "reused", "done"), (8, 12, "execute", "pending")]
    tallies = "SELECT sum(runs) FROM tally WHERE campaign_id = ? AND fsr_id = 'FSR1'"
    assert store.rows(tallies, (plan.campaign,)) == [(8,)]
    assert store.work_off(plan.campaign) == 4


def test_changed_plugin_executes_its_runs_and_no_others(store: Store) -> None:
    store.campaign(8)
    edited = replace(store.example.engine, plugins_digest="edited")
    cases = [
        replace(case, engine=edited) if case.architecture == "new" else case
        for case in store.example.cases(8)
    ]
    plan = store.plan(cases)
    block = store.claim(plan.campaign)
    assert [case.ordinal for case in block.to_execute] == [1, 3, 5, 7]


def test_blocks_never_mix_structures_or_shapes_of_json(store: Store) -> None:
    cases = [
        replace(case, structure="a" if at < 3 else "b")
        for at, case in enumerate(store.example.cases(8))
    ]
    store.plan(cases, block_size=4)
    assert [block[:2] for block in blocks(store)] == [(0, 3), (3, 7), (7, 8)]
    shapes = [store.example.case(at) for at in (0, 4)]
    store.plan([*shapes, store.example.case(8, point={"ego_speed": "fast"})], block_size=4)
    assert [block[:2] for block in blocks(store)[3:]] == [(0, 2), (2, 3)]


def test_what_cannot_be_planned_leaves_nothing(store: Store) -> None:
    def broken() -> Any:
        yield from store.example.cases(3)
        raise InputError("ego_speed is too high")

    for cases, said in (([], "no test cases"), (broken(), "too high")):
        with pytest.raises(InputError, match=said):
            store.plan(cases)
    record = store.example.record()
    with pytest.raises(ValueError, match="FSR1"):
        store.repository.plan_campaign(
            replace(record, fsrs=record.fsrs[1:]), store.example.cases(1)
        )
    assert set(store.repository.info().rows.values()) == {0}
    assert store.plan(3).is_new


def test_fsrs_are_planned_where_they_apply(store: Store) -> None:
    store.example.not_applicable = {"FSR2": {"legacy": "it has no radar"}}
    cases = store.example.cases(8)
    cases[0] = replace(cases[0], inside_odd=(False,))
    store.plan(cases)
    found = store.rows(
        "SELECT fsr_id, architecture, scenario, applicable, planned FROM campaign_fsr"
    )
    assert set(found) == {
        *((fsr, "new", name, 1, 2) for fsr in ("FSR1", "FSR2") for name in ("braking", "cut_in")),
        *(("FSR2", "legacy", name, 0, 0) for name in ("braking", "cut_in")),
        ("FSR1", "legacy", "braking", 1, 2),
        ("FSR1", "legacy", "cut_in", 1, 1),
        ("FSR3", "legacy", "cut_in", 1, 1),
        ("FSR3", "new", "cut_in", 1, 0),
    }


def test_gate_architecture_without_a_run_is_not_forgotten(store: Store) -> None:
    store.example.gate = ("absent",)
    plan = store.plan(4)
    gate = store.repository.gate(plan.campaign)
    absent = {(item.fsr, str(item.verdict)) for item in gate if item.architecture == "absent"}
    assert absent == {("FSR1", "NOT_RUN"), ("FSR3", "NOT_RUN")}


def test_latest_expiry_of_a_waiver_counts(store: Store) -> None:
    from datetime import date

    store.example.waivers = tuple(
        Waiver(requirement="FSR1", reason="r", author="a", expires=date(year, 1, 1))
        for year in (2030, 2031, 2029)
    )
    store.plan(4)
    found = store.raw.execute("SELECT DISTINCT fsr_id, waived_until FROM campaign_fsr ORDER BY 1")
    assert found.fetchall() == [("FSR1", "2031-01-01"), ("FSR2", None), ("FSR3", None)]


@pytest.mark.slow
def test_ten_thousand_cases_are_planned_without_holding_them(store: Store) -> None:
    plan = store.plan((store.example.case(ordinal) for ordinal in range(10_000)), block_size=1000)
    assert plan.to_execute == 10_000
    assert store.repository.work_state(plan.campaign).pending == 10


def test_many_together_are_the_campaign_of_each_alone(store: Store) -> None:
    cases = [store.example.case(4 * at, structure="a") for at in range(6)]
    one = store.plan(cases, block_size=4)
    rows = store.rows("SELECT * FROM test_case ORDER BY digest")
    columns: dict[str, Any] = {
        name: [vars(part)[name][0] for part in cases] for name in COLUMNS.values()
    }
    together = replace(cases[0], **columns)
    again = store.plan([together], block_size=4)
    assert (again.campaign, again.is_new) == (one.campaign, False)
    assert store.rows("SELECT * FROM test_case ORDER BY digest") == rows
    assert blocks(store) == [(0, 4, "execute", "pending"), (4, 6, "execute", "pending")]


def test_large_plan_tells_how_far_it_is(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("adeye.store.write.planning._CHUNK", 3)
    seen: list[int] = []
    store.plan(8, report=seen.append)
    assert seen == [3, 6]


def test_blocks_end_where_structures_do() -> None:
    assert list(block_bounds([3, 8], 4)) == [(0, 3), (3, 7), (7, 8)]


@given(steps=st.lists(st.integers(1, 30), min_size=1, max_size=8), size=st.integers(1, 12))
def test_blocks_cover_every_ordinal_once(steps: list[int], size: int) -> None:
    ends = [sum(steps[: at + 1]) for at in range(len(steps))]
    blocks = list(block_bounds(ends, size))
    assert [at for first, end in blocks for at in range(first, end)] == list(range(ends[-1]))
    assert all(end - first <= size for first, end in blocks)
    assert {end for _, end in blocks} >= set(ends)


def test_block_has_at_least_one_ordinal() -> None:
    with pytest.raises(ValueError, match="block_size is 0"):
        list(block_bounds([3], 0))


PAYLOADS = ["{}", '{"a":"\\n\\u2028"}', '{"a":"\u2028\x85"}', '{"a":1.5}']


def begun() -> SelectionHash:
    return SelectionHash("o", "c", "[]", "[]")


def part(example: Any, count: int = 3, **changes: Any) -> PlannedCases:
    one: PlannedCases = example.case(0)
    columns: dict[str, Any] = {
        "test_cases": [f"{at:064x}" for at in range(count)],
        "situations": ["s"] * count,
        "parameters": ["{}"] * count,
        "points": (PAYLOADS * count)[:count],
        "replicates": [0] * count,
        "inside_odd": [at % 2 == 0 for at in range(count)],
        "point_index": range(count),
    }
    return replace(one, **{**columns, **changes})


def test_cases_come_out_as_they_went_in(example: Any) -> None:
    one, other = part(example, 4), part(example, 2, scenario="braking", structure="b")
    with Selection.begin(begun()) as selection:
        selection.add(one)
        selection.add(other)
        first, second = selection.parts()
        assert list(selection.parts()) == [first, second]
    results = example.engine.result_digests(one.test_cases)
    columns = (one.test_cases, results, "cut_in", "legacy", [1, 0, 1, 0], PAYLOADS)
    assert first == (range(4), columns)
    assert (second[0], second[1][2]) == (range(4, 6), "braking")


def test_counts_and_ends_are_those_of_the_cases(example: Any) -> None:
    with Selection.begin(begun()) as selection:
        for structure, points in (("a", ["{}"]), ("a", ["{}"]), ("b", ["{}"]), ("b", ['{"a":1}'])):
            selection.add(part(example, 1, structure=structure, points=points))
        assert selection.ends == [2, 3, 4]
        assert selection.counted == {("legacy", "cut_in", True): 4}
        assert selection.identity.count == 4


def test_identity_is_the_same_however_the_cases_come(example: Any) -> None:
    whole = part(example, 4)
    with Selection.begin(begun()) as together:
        together.add(whole)
        ((_, (tests, results, scenario, architecture, inside, points)),) = together.parts()
    alone = begun()
    for test, result, side, point in zip(tests, results, inside, points, strict=True):
        alone.add((test, result, scenario, architecture, side, point))
    assert alone.campaign_id == together.identity.campaign_id
    assert alone.count == 4


def test_every_value_is_in_the_identity_and_none_runs_into_another() -> None:
    values: list[Any] = ["ab", "c", "cut_in", "new", 1, "{}"]
    changed = [[*values[:place], "other", *values[place + 1 :]] for place in range(6)]
    identities = set()
    for item in (values, ["a", "bc", *values[2:]], *changed):
        one = begun()
        one.add(item)
        identities.add(one.campaign_id)
    assert len(identities) == 8


# --- what the cases of a block lack: results, verdicts, or nothing


def test_run_that_exists_needs_only_the_verdicts_it_lacks(store: Store) -> None:
    store.campaign(4)
    store.example.thresholds["FSR1"] = "3 m"
    plan = store.plan(4)
    assert (plan.to_execute, plan.to_judge) == (0, 4)
    block = store.claim(plan.campaign)
    assert block.to_execute == ()
    assert {case.missing_fsrs for case in block.to_judge} == {("FSR1",)}


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
