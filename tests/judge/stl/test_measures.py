"""Terms and predicates: scales, caps, and what arithmetic makes of samples without a value.

Every sample is judged as a run of one row.
"""

from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.batch import SATISFIED
from adeye.judge.stl.series import SampleStatus, Series
from tests.judge.stl.batch import at_samples, numbers, standing, truths, words
from tests.stored import stored

TABLES = stored("formulas")


NAN, INF = float("nan"), float("inf")


def number(*values: float, **options: Any) -> Series:
    return numbers(values, **options)


def robustness(text: str, **inputs: Series) -> list[float]:
    result = at_samples(text, **inputs)
    assert np.array_equal(result.robustness_low, result.robustness_high, equal_nan=True)
    return [float(value) for value in result.robustness_low]


def standings(text: str, **inputs: Series) -> list[str]:
    result = at_samples(text, **inputs)
    return [standing(result, run) for run in range(len(result.error))]


def holds(text: str, **inputs: Series) -> list[bool]:
    return [code == SATISFIED for code in at_samples(text, **inputs).verdict]


def test_the_margin_is_divided_by_the_signals_scale() -> None:
    gap = number(12.0, 2.0, -3.0, scale=10.0)
    assert robustness("gap > 2", gap=gap) == [1.0, 0.0, -0.5]
    assert robustness("gap < 2", gap=gap) == [-1.0, 0.0, 0.5]
    assert robustness("2 < gap", gap=gap) == [1.0, 0.0, -0.5]


def test_strictness_decides_at_the_threshold() -> None:
    gap = number(2.0)
    truth = {op: holds(f"gap {op} 2", gap=gap)[0] for op in (">", ">=", "<", "<=")}
    assert truth == {">": False, ">=": True, "<": False, "<=": True}


def test_a_factor_on_both_sides_changes_nothing() -> None:
    gap = number(12.0, -3.0, scale=10.0)
    plain = robustness("gap > 2", gap=gap)
    assert robustness("gap * 4 > 8", gap=gap) == plain
    assert robustness("4 * gap > 8", gap=gap) == plain
    assert robustness("gap / 0.25 > 8", gap=gap) == plain
    assert robustness("-gap < -2", gap=gap) == plain
    assert robustness("gap + 1 > 3", gap=gap) == plain


@pytest.mark.parametrize("factor", [0.1, 3.0, 40.0])
def test_a_factor_on_both_sides_shifts_no_binding_predicate(factor: float) -> None:
    gap, speed = number(12.0, 4.0, scale=10.0), number(5.0, 2.0, scale=2.0)
    plain = "gap - 1.5 * speed >= 3 or speed >= 4.76"
    scaled = f"{factor} * gap - {1.5 * factor} * speed >= {3 * factor} or speed >= 4.76"
    one, other = (at_samples(text, gap=gap, speed=speed) for text in (plain, scaled))
    assert other.node.tolist() == one.node.tolist() == [0, 0]
    assert other.robustness_low == pytest.approx(one.robustness_low)


def test_of_two_signals_the_larger_scale_counts() -> None:
    a, b = number(5.0, scale=2.0), number(1.0, scale=8.0)
    assert robustness("a > b", a=a, b=b) == [0.5]
    assert robustness("min(a, b) > 0", a=a, b=b) == [0.125]
    assert robustness("max(a, b) > 0", a=a, b=b) == [0.625]
    assert robustness("a * b > 1", a=a, b=b) == [0.25]
    assert robustness("abs(b - a) > 0", a=a, b=b) == [0.5]


def test_a_scale_of_zero_counts_as_one() -> None:
    assert robustness("gap * 0 > -3", gap=number(7.0)) == [3.0]
    assert standings("gap / (1 - 1) > -3", gap=number(7.0)) == ["error"]


def test_no_conflict_has_the_cap_as_margin_on_either_side() -> None:
    ttc = number(INF, 3.0, scale=2.0, cap=10.0)
    assert robustness("ttc >= 1.5", ttc=ttc) == [5.0, 0.75]
    assert robustness("ttc < 1.5", ttc=ttc) == [-5.0, -0.75]
    assert robustness("ttc - 1 >= 0.5", ttc=ttc) == [5.0, 0.75]
    assert robustness("-ttc <= -1.5", ttc=ttc) == [5.0, 0.75]
    assert robustness("abs(ttc) >= 1.5", ttc=ttc) == [5.0, 0.75]
    assert robustness("ttc * 2 >= 3", ttc=ttc) == [5.0, 0.75]
    assert robustness("2 * ttc >= 3", ttc=ttc) == [5.0, 0.75]


def test_no_conflict_satisfies_a_bound_above_the_cap() -> None:
    ttc = number(INF, cap=10.0)
    assert holds("ttc >= 20", ttc=ttc) == [True]
    assert robustness("ttc >= 20", ttc=ttc) == [10.0]


def test_a_finite_margin_is_never_worth_more_than_no_conflict() -> None:
    ttc = number(500.0, -500.0, cap=10.0)
    assert robustness("ttc >= 2", ttc=ttc) == [10.0, -502.0]
    assert robustness("ttc <= 2", ttc=ttc) == [-10.0, 502.0]


def test_the_smaller_of_no_conflict_and_a_value_is_the_value() -> None:
    ttc, headway = number(INF, INF, cap=10.0), number(3.0, INF, cap=4.0)
    assert robustness("min(ttc, headway) > 1", ttc=ttc, headway=headway) == [2.0, 10.0]


def test_the_inverse_of_no_conflict_is_zero() -> None:
    ttc = number(INF, 2.0, cap=10.0)
    assert robustness("1 / ttc < 1", ttc=ttc) == [1.0, 0.5]


@pytest.mark.parametrize(("text", "values"), TABLES["arithmetic without a result is an error"])
def test_arithmetic_without_a_result_is_an_error(text: str, values: tuple[float, float]) -> None:
    a, b = (number(value, cap=10.0) for value in values)
    assert standings(text, a=a, b=b) == ["error"]


def test_a_sample_that_does_not_apply_is_unknown_and_no_error() -> None:
    status = np.array([[SampleStatus.NOT_APPLICABLE, SampleStatus.VALUE]], dtype=np.int8)
    a = Series(np.array([[NAN, 1.0]]), 1.0, "1", "number", status=status)
    for text in ("a > 0", "1 / a > 0", "min(a, 2) > 0", "a == 1"):
        result = at_samples(text, a=a)
        assert result.robustness_low[0] == -INF
        assert result.robustness_high[0] == INF
        assert [standing(result, run) == "undecided" for run in (0, 1)] == [True, False]


def test_truth_values_and_labels_are_worth_one_scale() -> None:
    contact, status = truths([1, 0]), words([0, 1], "ok", "silent")
    assert robustness("contact", contact=contact) == [1.0, -1.0]
    assert robustness("contact == true", contact=contact) == [1.0, -1.0]
    assert robustness("contact == false", contact=contact) == [-1.0, 1.0]
    assert robustness("contact != false", contact=contact) == [1.0, -1.0]
    assert robustness("status == silent", status=status) == [-1.0, 1.0]


def test_signals_of_words_are_compared_sample_by_sample() -> None:
    first, second = words([0, 1], "ok", "silent"), words([0, 0], "ok", "silent")
    inputs = {"a.s": first, "b.s": second}
    assert robustness("a.s == b.s", **inputs) == [1.0, -1.0]
    assert robustness("a.s != b.s", **inputs) == [-1.0, 1.0]


def test_equal_whole_numbers_have_margin_zero_and_the_distance_otherwise() -> None:
    lane = number(2.0, 0.0, scale=2.0)
    assert robustness("lane == 2", lane=lane) == [0.0, -1.0]
    assert holds("lane == 2", lane=lane) == [True, False]
    assert robustness("lane != 2", lane=lane) == [0.0, 1.0]
    assert holds("lane != 2", lane=lane) == [False, True]
    assert robustness("lane * 0 == 3", lane=lane) == [-3.0, -3.0]


# --- what a sample is


def statuses(*codes: int) -> np.ndarray:
    return np.array([codes], dtype=np.int8)


def test_without_a_cap_every_value_that_is_not_finite_is_an_error() -> None:
    found = standings("a > 0", a=number(1.0, NAN, INF, -INF))
    assert found == ["satisfied", "error", "error", "error"]


def test_a_cap_declares_plus_infinity_and_nothing_else() -> None:
    found = standings("a > 0", a=number(1.0, NAN, INF, -INF, cap=10.0))
    assert found == ["satisfied", "error", "satisfied", "error"]


def test_a_status_says_what_a_sample_is_whatever_its_value() -> None:
    codes = statuses(
        SampleStatus.VALUE,
        SampleStatus.NO_CONFLICT,
        SampleStatus.NOT_APPLICABLE,
        SampleStatus.ERROR,
        7,
        -2,
    )
    a = number(1.0, NAN, NAN, 1.0, 1.0, 1.0, cap=10.0, status=codes)
    found = standings("a > 0", a=a)
    assert found == ["satisfied", "satisfied", "undecided", "error", "error", "error"]


def test_an_infinite_value_with_status_value_is_an_error() -> None:
    assert standings("a > 0", a=number(INF, cap=10.0, status=statuses(0))) == ["error"]


def test_no_conflict_without_a_cap_is_an_error() -> None:
    assert standings("a > 0", a=number(INF, status=statuses(1))) == ["error"]


def test_a_truth_value_is_0_or_1() -> None:
    assert standings("p", p=truths([True, False])) == ["satisfied", "violated"]
    odd = truths([0.0, 2.0, NAN, INF], cap=1.0)
    assert standings("p", p=odd) == ["violated", "error", "error", "error"]
    assert standings("p", p=truths([NAN], status=statuses(2))) == ["undecided"]


def test_a_code_has_a_label() -> None:
    found = standings("s.x == ok", **{"s.x": words([0.0, 1.0, 2.0, -1.0, 0.5], "ok", "silent")})
    assert found == ["satisfied", "violated", "error", "error", "error"]


def test_reading_leaves_the_series_as_it_was() -> None:
    a = number(NAN, 1.0)
    at_samples("a > 0", a=a)
    assert np.isnan(a.values[0, 0])


def test_a_zero_of_either_sign_is_the_same_zero() -> None:
    a = number(0.0, -0.0)
    assert standings("a >= 0", a=a) == ["satisfied", "satisfied"]
    assert standings("a > 0", a=a) == ["violated", "violated"]
