"""A selection comes out of its file as it went in, and its identity covers all of it."""

from dataclasses import replace
from typing import Any

import pytest

from adeye.store.block import PlannedCases
from adeye.store.write.planning import SelectedCases, Selection, SelectionHash

PAYLOADS = ["{}", '{"a":"\\n\\u2028"}', '{"a":"\u2028\x85"}', '{"a":1.5}']


def begun() -> SelectionHash:
    return SelectionHash("o", "c", "[]", "[]")


def part(example: Any, count: int = 3, **changes: Any) -> PlannedCases:
    one = PlannedCases.of(example.case(0))
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
    assert (first.first, first.scenario, first.inside) == (0, "cut_in", [1, 0, 1, 0])
    assert (second.first, second.scenario) == (4, "braking")
    assert first.points == PAYLOADS
    assert first.test_cases == one.test_cases
    assert first.results == example.engine.result_digests(one.test_cases)


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
        (selected,) = together.parts()
    alone = begun()
    for values in selected.identities():
        alone.add(values)
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


def test_identities_are_in_the_order_of_the_cases() -> None:
    cases = SelectedCases(7, "s", "a", [1, 0], ["t1", "t2"], ["r1", "r2"], ["{}", "[]"])
    assert list(cases.identities()) == [
        ("t1", "r1", "s", "a", "1", "{}"),
        ("t2", "r2", "s", "a", "0", "[]"),
    ]
