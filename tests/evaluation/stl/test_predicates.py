"""Margins of predicates: scales, caps, and what arithmetic makes of samples without a value."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.evaluation.stl.parser import parse_text
from adeye.evaluation.stl.predicates import Margins, predicate_margins, term_values
from adeye.evaluation.stl.series import SampleStatus, Series
from adeye.evaluation.stl.syntax import PREDICATES, Comparison, Equality, Signal

NAN, INF = float("nan"), float("inf")


def number(*values: float, **options: Any) -> Series:
    return Series(np.array([values]), options.pop("scale", 1.0), "1", "number", **options)


def measure(text: str, **inputs: Series) -> Margins:
    predicate = parse_text(text)
    assert isinstance(predicate, PREDICATES)
    return predicate_margins(predicate, inputs, next(iter(inputs.values())).values.shape)


def robustness(text: str, **inputs: Series) -> list[float]:
    return [float(value) for value in measure(text, **inputs).robustness[0]]


def test_the_margin_is_divided_by_the_signals_scale() -> None:
    gap = number(12.0, 2.0, -3.0, scale=10.0)
    assert robustness("gap > 2", gap=gap) == [1.0, 0.0, -0.5]
    assert robustness("gap < 2", gap=gap) == [-1.0, 0.0, 0.5]
    assert robustness("2 < gap", gap=gap) == [1.0, 0.0, -0.5]


def test_strictness_decides_at_the_threshold() -> None:
    gap = number(2.0)
    truth = {
        op: bool(measure(f"gap {op} 2", gap=gap).is_true[0, 0]) for op in (">", ">=", "<", "<=")
    }
    assert truth == {">": False, ">=": True, "<": False, "<=": True}


def test_a_factor_on_both_sides_changes_nothing() -> None:
    gap = number(12.0, -3.0, scale=10.0)
    plain = robustness("gap > 2", gap=gap)
    assert robustness("gap * 4 > 8", gap=gap) == plain
    assert robustness("4 * gap > 8", gap=gap) == plain
    assert robustness("gap / 0.25 > 8", gap=gap) == plain
    assert robustness("-gap < -2", gap=gap) == plain
    assert robustness("gap + 1 > 3", gap=gap) == plain


def test_of_two_signals_the_larger_scale_counts() -> None:
    a, b = number(5.0, scale=2.0), number(1.0, scale=8.0)
    assert robustness("a > b", a=a, b=b) == [0.5]
    assert robustness("min(a, b) > 0", a=a, b=b) == [0.125]
    assert robustness("max(a, b) > 0", a=a, b=b) == [0.625]
    assert robustness("a * b > 1", a=a, b=b) == [0.25]
    assert robustness("abs(b - a) > 0", a=a, b=b) == [0.5]


def test_a_scale_of_zero_counts_as_one() -> None:
    assert robustness("gap * 0 > -3", gap=number(7.0)) == [3.0]
    assert measure("gap / (1 - 1) > -3", gap=number(7.0)).is_error[0, 0]


def test_no_conflict_has_the_cap_as_margin_on_either_side() -> None:
    ttc = number(INF, 3.0, scale=2.0, cap=10.0)
    assert robustness("ttc >= 1.5", ttc=ttc) == [5.0, 0.75]
    assert robustness("ttc < 1.5", ttc=ttc) == [-5.0, -0.75]
    assert robustness("ttc - 1 >= 0.5", ttc=ttc) == [5.0, 0.75]
    assert robustness("-ttc <= -1.5", ttc=ttc) == [5.0, 0.75]
    assert robustness("abs(ttc) >= 1.5", ttc=ttc) == [5.0, 0.75]
    assert robustness("ttc * 2 >= 3", ttc=ttc) == [5.0, 0.75]
    assert robustness("2 * ttc >= 3", ttc=ttc) == [5.0, 0.75]
    assert not measure("ttc >= 1.5", ttc=ttc).is_error.any()


def test_no_conflict_satisfies_a_bound_above_the_cap() -> None:
    margins = measure("ttc >= 20", ttc=number(INF, cap=10.0))
    assert (margins.is_true[0, 0], margins.margin[0, 0]) == (True, 10.0)


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


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a / b > 1", (1.0, 0.0)),
        ("a / b > 1", (INF, 0.0)),
        ("a - b > 1", (INF, INF)),
        ("a >= b", (INF, INF)),
        ("a == b", (INF, 1.0)),
        ("a * b > 1", (INF, 0.0)),
        ("a * b > 1", (1e200, 1e200)),
        ("a + b > 1", (NAN, 1.0)),
    ],
)
def test_arithmetic_without_a_result_is_an_error(text: str, values: tuple[float, float]) -> None:
    a, b = (number(value, cap=10.0) for value in values)
    assert measure(text, a=a, b=b).is_error[0, 0]


def test_a_sample_that_does_not_apply_is_unknown_and_no_error() -> None:
    status = np.array([[SampleStatus.NOT_APPLICABLE, SampleStatus.VALUE]], dtype=np.int8)
    a = Series(np.array([[NAN, 1.0]]), 1.0, "1", "number", status=status)
    for text in ("a > 0", "1 / a > 0", "min(a, 2) > 0", "a == 1"):
        margins = measure(text, a=a)
        assert margins.is_unknown.tolist() == [[True, False]]
        assert not margins.is_error.any()


def test_truth_values_and_labels_are_worth_one_scale() -> None:
    contact = Series(np.array([[1, 0]]), 5.0, "1", "boolean")
    status = Series(np.array([[0, 1]]), 5.0, "1", "enumeration", ("ok", "silent"))
    assert robustness("contact", contact=contact) == [1.0, -1.0]
    assert robustness("contact == true", contact=contact) == [1.0, -1.0]
    assert robustness("contact == false", contact=contact) == [-1.0, 1.0]
    assert robustness("contact != false", contact=contact) == [1.0, -1.0]
    assert robustness("status == silent", status=status) == [-1.0, 1.0]


def test_signals_of_words_are_compared_sample_by_sample() -> None:
    first = Series(np.array([[0, 1]]), 1.0, "1", "enumeration", ("ok", "silent"))
    second = Series(np.array([[0, 0]]), 1.0, "1", "enumeration", ("ok", "silent"))
    predicate = parse_text("a.s == b.s")
    assert isinstance(predicate, Equality)
    margins = predicate_margins(predicate, {"a.s": first, "b.s": second}, (1, 2))
    assert margins.robustness.tolist() == [[1.0, -1.0]]


def test_equal_whole_numbers_have_margin_zero_and_the_distance_otherwise() -> None:
    lane = number(2.0, 0.0, scale=2.0)
    same, other = measure("lane == 2", lane=lane), measure("lane != 2", lane=lane)
    assert (same.robustness.tolist(), same.is_true.tolist()) == ([[0.0, -1.0]], [[True, False]])
    assert (other.robustness.tolist(), other.is_true.tolist()) == ([[0.0, 1.0]], [[False, True]])
    assert robustness("lane * 0 == 3", lane=lane) == [-3.0, -3.0]


def test_a_calculation_is_no_name() -> None:
    status = Series(np.array([[0]]), 1.0, "1", "boolean")
    left = Signal((0, 1), "a")
    comparison = parse_text("b + 1 > 0")
    assert isinstance(comparison, Comparison)
    with pytest.raises(TypeError, match="not the name of a signal"):
        predicate_margins(
            Equality((0, 1), left, comparison.left, is_negated=False), {"a": status}, (1, 1)
        )


def test_a_term_gives_its_values() -> None:
    comparison = parse_text("a * 2 - 1 > 0")
    assert isinstance(comparison, Comparison)
    operand = term_values(comparison.left, {"a": number(3.0)}, (1, 1))
    assert operand.values.tolist() == [[5.0]]
    assert not operand.is_constant
