"""Pairs of results, and who is worth choosing."""

import itertools
import math

import numpy as np
import pytest

from adeye.judge import pairing
from adeye.judge.verdict import ERROR, FAIL, INCONCLUSIVE, INVALID, PASS, VACUOUS
from tests.refusals import refused


def test_rows_meet_by_key_whatever_their_order() -> None:
    for one, other, pairs in (
        ([7, 3, 9, 5], [5, 7, 1, 3], [(0, 1), (1, 3), (3, 0)]),
        # A row with several partners is in several pairs.
        ([1, 2], [2, 1, 1], [(0, 1), (0, 2), (1, 0)]),
        ([1], [], []),
    ):
        first, second = pairing.pair_up(np.array(one), np.array(other, dtype=np.int64))
        assert list(zip(first.tolist(), second.tolist(), strict=True)) == pairs


def test_rows_get_one_number_exactly_where_all_columns_agree() -> None:
    codes = pairing.number_rows(
        np.array([1, 1, 2, 1]), np.array([5, 6, 5, 5]), np.array([-1, -1, -1, -1])
    )
    assert codes[0] == codes[3]
    assert len(set(codes.tolist())) == 3


def test_only_fail_fails_and_only_pass_and_vacuous_hold() -> None:
    codes = np.array(
        [PASS, FAIL, INCONCLUSIVE, VACUOUS, INVALID, ERROR, pairing.NOT_RUN, pairing.NOT_JUDGED]
    )
    held, open_ = pairing.HELD, pairing.UNDECIDED
    expected = [held, pairing.FAILED, open_, held, open_, open_, open_, pairing.NOT_JUDGED]
    assert pairing.severities(codes).tolist() == expected


def test_every_pair_is_counted_once() -> None:
    codes = np.arange(-1, pairing.NOT_RUN + 1)
    a, b = (item.ravel() for item in np.meshgrid(codes, codes))
    counts = pairing.counts_of(pairing.verdict_table(a, b))
    # Seven verdicts each; what is not judged is no pair.
    assert counts.pairs == 49
    assert (counts.both_pass, counts.only_a_fails, counts.only_b_fails, counts.both_fail) == (
        1, 2, 2, 1,
    )  # fmt: skip
    assert (counts.neutral, counts.undecided) == (3, 40)


def test_vacuous_is_no_pass() -> None:
    counts = pairing.counts_of(
        pairing.verdict_table(np.array([VACUOUS, PASS]), np.array([PASS, VACUOUS]))
    )
    assert (counts.both_pass, counts.neutral) == (0, 2)


def test_groups_keep_the_worst_and_the_mean_of_what_there_is() -> None:
    groups = pairing.Groups.of(np.array([5, 3, 5, 3]))
    assert groups.keys.tolist() == [3, 5]
    severity = np.array([[pairing.HELD], [pairing.UNDECIDED], [pairing.FAILED], [pairing.HELD]])
    assert groups.worst(severity).tolist() == [[pairing.UNDECIDED], [pairing.FAILED]]
    mean = groups.mean(np.array([1.0, math.nan, 4.0, math.nan]))
    assert math.isnan(mean[0])
    assert mean[1] == 2.5


BOTH = (pairing.Objective("failures", "lower"), pairing.Objective("cost", "lower"))


def test_dearer_and_no_better_is_dominated_by_the_cheaper() -> None:
    found = pairing.dominators({"dear": (2, 9), "cheap": (2, 5), "good": (0, 7)}, BOTH)
    assert found == {"dear": "good", "cheap": None, "good": None}


def test_better_may_mean_higher() -> None:
    objectives = (pairing.Objective("availability", "higher"), pairing.Objective("cost", "lower"))
    found = pairing.dominators({"a": (0.9, 5), "b": (0.5, 5)}, objectives)
    assert found == {"a": None, "b": "a"}


def test_equals_stay_both_and_the_first_name_dominates_others() -> None:
    found = pairing.dominators({"z": (1, 1), "b": (1, 1), "c": (2, 1)}, BOTH)
    assert found == {"z": None, "b": None, "c": "b"}


def test_order_of_candidates_does_not_matter() -> None:
    candidates = {"a": (3, 1), "b": (1, 3), "c": (3, 3), "d": (2, 2), "e": (2, 2), "f": (4, 2)}
    wanted = pairing.dominators(candidates, BOTH)
    for order in itertools.permutations(candidates):
        assert pairing.dominators({name: candidates[name] for name in order}, BOTH) == wanted


def test_difference_within_epsilon_does_not_keep_a_dear_one() -> None:
    exact = pairing.dominators({"a": (3, 100), "b": (2, 190)}, BOTH)
    rough = pairing.dominators(
        {"a": (3, 100), "b": (2, 190)},
        (pairing.Objective("failures", "lower", 5.0), pairing.Objective("cost", "lower")),
    )
    assert (exact, rough) == ({"a": None, "b": None}, {"a": None, "b": "a"})


def test_within_one_box_the_exact_values_decide() -> None:
    objectives = (
        pairing.Objective("failures", "lower", 10.0),
        pairing.Objective("cost", "lower", 10.0),
    )
    assert pairing.dominators({"a": (1, 1), "b": (2, 2)}, objectives) == {"a": None, "b": "a"}


@pytest.mark.parametrize("epsilon", [0.0, 1.0, 3.0])
def test_every_dominator_is_on_the_front(epsilon: float) -> None:
    objectives = [pairing.Objective(name, "lower", epsilon) for name in "xyz"]
    values = itertools.product((0, 1, 2, 5), repeat=3)
    candidates = {str(number): point for number, point in enumerate(values) if sum(point) > 3}
    found = pairing.dominators(candidates, objectives)
    front = {name for name, by in found.items() if by is None}
    assert front
    assert {by for by in found.values() if by is not None} <= front


def test_value_that_is_no_number_is_refused() -> None:
    for value in (math.nan, math.inf):
        refused(ValueError, pairing.dominators, {"a": (0, value)}, BOTH, says="a: cost is")


def test_negative_epsilon_is_refused() -> None:
    with pytest.raises(ValueError, match="epsilon"):
        pairing.dominators({"a": (0,)}, (pairing.Objective("cost", "lower", -1.0),))
