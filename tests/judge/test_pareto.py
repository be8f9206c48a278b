"""Who is worth choosing: laws of dominance, ties, epsilon."""

from __future__ import annotations

import itertools
import math

import pytest

from adeye.judge.pairing import Objective, dominators

BOTH = (Objective("failures", "lower"), Objective("cost", "lower"))


def test_dearer_and_no_better_is_dominated_by_the_cheaper() -> None:
    found = dominators({"dear": (2, 9), "cheap": (2, 5), "good": (0, 7)}, BOTH)
    assert found == {"dear": "good", "cheap": None, "good": None}


def test_better_may_mean_higher() -> None:
    objectives = (Objective("availability", "higher"), Objective("cost", "lower"))
    found = dominators({"a": (0.9, 5), "b": (0.5, 5)}, objectives)
    assert found == {"a": None, "b": "a"}


def test_equals_stay_both_and_the_first_name_dominates_others() -> None:
    found = dominators({"z": (1, 1), "b": (1, 1), "c": (2, 1)}, BOTH)
    assert found == {"z": None, "b": None, "c": "b"}


def test_order_of_candidates_does_not_matter() -> None:
    candidates = {"a": (3, 1), "b": (1, 3), "c": (3, 3), "d": (2, 2), "e": (2, 2), "f": (4, 2)}
    wanted = dominators(candidates, BOTH)
    for order in itertools.permutations(candidates):
        assert dominators({name: candidates[name] for name in order}, BOTH) == wanted


def test_difference_within_epsilon_does_not_keep_a_dear_one() -> None:
    exact = dominators({"a": (3, 100), "b": (2, 190)}, BOTH)
    rough = dominators(
        {"a": (3, 100), "b": (2, 190)},
        (Objective("failures", "lower", 5.0), Objective("cost", "lower")),
    )
    assert (exact, rough) == ({"a": None, "b": None}, {"a": None, "b": "a"})


def test_within_one_box_the_exact_values_decide() -> None:
    objectives = (Objective("failures", "lower", 10.0), Objective("cost", "lower", 10.0))
    assert dominators({"a": (1, 1), "b": (2, 2)}, objectives) == {"a": None, "b": "a"}


@pytest.mark.parametrize("epsilon", [0.0, 1.0, 3.0])
def test_every_dominator_is_on_the_front(epsilon: float) -> None:
    objectives = [Objective(name, "lower", epsilon) for name in "xyz"]
    values = itertools.product((0, 1, 2, 5), repeat=3)
    candidates = {str(number): point for number, point in enumerate(values) if sum(point) > 3}
    found = dominators(candidates, objectives)
    front = {name for name, by in found.items() if by is None}
    assert front
    assert {by for by in found.values() if by is not None} <= front


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_value_that_is_no_number_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="a: cost is"):
        dominators({"a": (0, value)}, BOTH)


def test_negative_epsilon_is_refused() -> None:
    with pytest.raises(ValueError, match="epsilon"):
        dominators({"a": (0,)}, (Objective("cost", "lower", -1.0),))
