"""Blocks cover every ordinal once and cross no end of a structure."""

import sqlite3
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import InputError
from adeye.spec.concept import Waiver
from adeye.store.block import PlannedCases
from adeye.store.records import EngineKey
from adeye.store.repository import Repository
from adeye.store.write.planning import Selection, SelectionHash, block_bounds
from tests.store.raw import rows
from tests.store.rows import COLUMNS


def blocks(raw: sqlite3.Connection) -> list[tuple[int, int, str, str]]:
    return raw.execute(
        "SELECT from_ordinal, to_ordinal, kind, state FROM work ORDER BY id"
    ).fetchall()


def test_plan_is_committed_before_anything_runs(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    plan = repository.plan_campaign(example.record(), iter(example.cases(8)), block_size=3)
    assert (plan.planned, plan.to_execute, plan.to_judge, plan.is_new) == (8, 8, 0, True)
    assert blocks(raw) == [
        (0, 3, "execute", "pending"),
        (3, 6, "execute", "pending"),
        (6, 8, "execute", "pending"),
    ]
    assert raw.execute("SELECT count(*) FROM test_case").fetchone() == (8,)
    assert raw.execute("SELECT count(*) FROM scenario").fetchone() == (2,)


@pytest.mark.slow
def test_same_selection_is_the_same_campaign_and_changes_no_row(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    campaign = example.campaign(repository)
    before = rows(raw)
    again = repository.plan_campaign(example.record(), example.cases(8), block_size=5)
    assert again.campaign == campaign
    assert (again.to_execute, again.to_judge, again.is_new) == (0, 0, False)
    assert rows(raw) == before
    assert repository.claim_block(campaign=campaign) is None


@pytest.mark.parametrize(
    "change", ["odd", "threshold", "engine", "order", "fewer", "gate", "inside", "name"]
)
def test_whatever_is_selected_makes_another_campaign(
    repository: Repository, example: Any, change: str
) -> None:
    first = repository.plan_campaign(example.record(), example.cases(4)).campaign
    cases = example.cases(4)
    if change == "odd":
        example.with_odd("2")
    elif change == "threshold":
        example.thresholds["FSR1"] = "3 m"
    elif change == "engine":
        cases = [replace(case, engine=EngineKey("batch", "v", 1)) for case in cases]
    elif change == "order":
        cases.reverse()
    elif change == "fewer":
        cases.pop()
    elif change == "gate":
        example.gate = ("legacy",)
    elif change == "inside":
        cases[0] = replace(cases[0], inside_odd=(False,))
    else:
        cases[0] = replace(cases[0], scenario="cut_in_again")
    assert repository.plan_campaign(example.record(), cases).campaign != first


@pytest.mark.slow
def test_only_what_is_new_is_executed(repository: Repository, example: Any) -> None:
    example.campaign(repository, 8)
    example.with_odd("2")
    plan = repository.plan_campaign(example.record(), example.cases(12), block_size=3)
    assert (plan.planned, plan.reused, plan.to_execute, plan.to_judge) == (12, 8, 4, 0)
    assert example.work_off(repository, plan.campaign) == 4


@pytest.mark.slow
def test_block_without_gaps_is_done_at_once_with_its_tallies(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    example.campaign(repository, 8)
    example.with_odd("2")
    plan = repository.plan_campaign(example.record(), example.cases(12), block_size=8)
    assert blocks(raw)[-2:] == [(0, 8, "reused", "done"), (8, 12, "execute", "pending")]
    counted = raw.execute(
        "SELECT sum(runs) FROM tally WHERE campaign_id = ? AND fsr_id = 'FSR1'", (plan.campaign,)
    )
    assert counted.fetchone() == (8,)


@pytest.mark.slow
def test_changed_plugin_executes_its_runs_and_no_others(
    repository: Repository, example: Any
) -> None:
    example.campaign(repository, 8)
    edited = replace(example.engine, plugins_digest="edited")
    cases = [
        replace(case, engine=edited) if case.architecture == "new" else case
        for case in example.cases(8)
    ]
    plan = repository.plan_campaign(example.record(), cases)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert [case.ordinal for case in block.to_execute] == [1, 3, 5, 7]


def test_blocks_never_mix_structures(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    cases = [
        replace(case, structure="a" if i < 3 else "b") for i, case in enumerate(example.cases(8))
    ]
    repository.plan_campaign(example.record(), cases, block_size=4)
    assert [block[:2] for block in blocks(raw)] == [(0, 3), (3, 7), (7, 8)]


def test_empty_selection_is_refused_and_leaves_nothing(
    repository: Repository, example: Any
) -> None:
    with pytest.raises(InputError, match="no test cases"):
        repository.plan_campaign(example.record(), [])
    assert set(repository.info().rows.values()) == {0}


def test_error_while_expanding_leaves_nothing(repository: Repository, example: Any) -> None:
    def broken() -> Any:
        yield from example.cases(3)
        raise InputError("ego_speed is too high")

    with pytest.raises(InputError, match="too high"):
        repository.plan_campaign(example.record(), broken())
    assert set(repository.info().rows.values()) == {0}
    assert repository.plan_campaign(example.record(), example.cases(3)).is_new


def test_every_fsr_of_the_concept_must_be_judged(repository: Repository, example: Any) -> None:
    record = example.record()
    with pytest.raises(ValueError, match="FSR1"):
        repository.plan_campaign(replace(record, fsrs=record.fsrs[1:]), example.cases(1))


def test_block_size_is_at_least_one(repository: Repository, example: Any) -> None:
    with pytest.raises(ValueError, match="block_size"):
        repository.plan_campaign(example.record(), example.cases(1), block_size=0)


def test_fsrs_are_planned_where_they_apply(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    example.not_applicable = {"FSR2": {"legacy": "it has no radar"}}
    cases = example.cases(8)
    cases[0] = replace(cases[0], inside_odd=(False,))
    repository.plan_campaign(example.record(), cases)
    found = raw.execute(
        "SELECT fsr_id, architecture, scenario, applicable, planned FROM campaign_fsr"
    ).fetchall()
    assert set(found) == {
        ("FSR1", "legacy", "braking", 1, 2),
        ("FSR1", "legacy", "cut_in", 1, 1),
        ("FSR1", "new", "braking", 1, 2),
        ("FSR1", "new", "cut_in", 1, 2),
        ("FSR2", "legacy", "braking", 0, 0),
        ("FSR2", "legacy", "cut_in", 0, 0),
        ("FSR2", "new", "braking", 1, 2),
        ("FSR2", "new", "cut_in", 1, 2),
        ("FSR3", "legacy", "cut_in", 1, 1),
        ("FSR3", "new", "cut_in", 1, 0),
    }


def test_gate_architecture_without_a_run_is_not_forgotten(
    repository: Repository, example: Any
) -> None:
    example.gate = ("absent",)
    plan = repository.plan_campaign(example.record(), example.cases(4))
    absent = [item for item in repository.gate(plan.campaign) if item.architecture == "absent"]
    assert {(item.fsr, str(item.verdict)) for item in absent} == {
        ("FSR1", "NOT_RUN"),
        ("FSR3", "NOT_RUN"),
    }


def test_latest_expiry_of_a_waiver_counts(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    from datetime import date

    example.waivers = tuple(
        Waiver(requirement="FSR1", reason="r", author="a", expires=date(year, 1, 1))
        for year in (2030, 2031, 2029)
    )
    repository.plan_campaign(example.record(), example.cases(4))
    found = raw.execute("SELECT DISTINCT fsr_id, waived_until FROM campaign_fsr ORDER BY 1")
    assert found.fetchall() == [("FSR1", "2031-01-01"), ("FSR2", None), ("FSR3", None)]


@pytest.mark.slow
def test_ten_thousand_cases_are_planned_without_holding_them(
    repository: Repository, example: Any
) -> None:
    plan = repository.plan_campaign(
        example.record(), (example.case(ordinal) for ordinal in range(10_000)), block_size=1000
    )
    assert plan.to_execute == 10_000
    assert repository.work_state(plan.campaign).pending == 10


def test_many_together_are_the_campaign_of_each_alone(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    cases = [example.case(4 * at, structure="a") for at in range(6)]
    one = repository.plan_campaign(example.record(), cases, block_size=4)
    rows = raw.execute("SELECT * FROM test_case ORDER BY digest").fetchall()
    columns: dict[str, Any] = {
        name: [vars(part)[name][0] for part in cases] for name in COLUMNS.values()
    }
    together = replace(cases[0], **columns)
    again = repository.plan_campaign(example.record(), [together], block_size=4)
    assert (again.campaign, again.is_new) == (one.campaign, False)
    assert raw.execute("SELECT * FROM test_case ORDER BY digest").fetchall() == rows
    assert blocks(raw) == [(0, 4, "execute", "pending"), (4, 6, "execute", "pending")]


def test_blocks_never_mix_shapes_of_json(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    cases = [example.case(0), example.case(4), example.case(8, point={"ego_speed": "fast"})]
    repository.plan_campaign(example.record(), cases, block_size=4)
    assert [block[:2] for block in blocks(raw)] == [(0, 2), (2, 3)]


def test_large_plan_tells_how_far_it_is(
    repository: Repository, example: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adeye.store.write.planning._CHUNK", 3)
    seen: list[int] = []
    repository.plan_campaign(example.record(), example.cases(8), report=seen.append)
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


@pytest.mark.parametrize("place", range(6))
def test_every_value_is_in_the_identity(place: int) -> None:
    values: list[Any] = ["t", "r", "cut_in", "new", 1, "{}"]
    one, other = begun(), begun()
    one.add(values)
    values[place] = "other"
    other.add(values)
    assert one.campaign_id != other.campaign_id


def test_values_do_not_run_into_each_other() -> None:
    one, other = begun(), begun()
    one.add(["ab", "c", "s", "a", 1, "{}"])
    other.add(["a", "bc", "s", "a", 1, "{}"])
    assert one.campaign_id != other.campaign_id
