"""Series, and scale, cap and unit of terms before any sample."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.parser import parse_with
from adeye.judge.stl.series import Scale, Series, combined, label_code, unit_of
from adeye.judge.stl.syntax import PREDICATES
from tests.judge.stl.batch import numbers, truths, words
from tests.refusals import refused
from tests.stored import known

NAN, INF = float("nan"), float("inf")


def series(values: list[Any], **options: Any) -> Series:
    arguments: dict[str, Any] = {"scale": 1.0, "unit": "s", "kind": "number", **options}
    return Series(np.array([values]), **arguments)


@pytest.mark.parametrize(
    "options",
    [{"scale": 0.0}, {"scale": NAN}, {"scale": INF}, {"cap": 0.0}, {"cap": INF}, {"cap": -1.0}],
)
def test_scale_and_cap_are_finite_and_positive(options: dict[str, float]) -> None:
    refused(ValueError, series, [1.0], **options, says="finite and above 0")


def test_shapes_must_agree() -> None:
    refused(ValueError, Series, np.array([1.0]), 1.0, "s", "number", says=r"not \(B, T\)")
    refused(ValueError, series, [1.0, 2.0], status=np.array([[0]], dtype=np.int8), says="differs")
    refused(ValueError, series, [1.0, 2.0], actor=np.array([[1]]), says="differs")


def test_in_a_sum_the_larger_scale_counts_and_a_constant_has_no_say() -> None:
    near, far, limit = Scale(1.0), Scale(10.0), Scale(1.0, 500.0)
    assert combined("+", near, far).size == 10.0
    assert combined("-", near, limit).size == 1.0
    assert combined("min", limit, far).size == 10.0


def test_in_a_product_scales_and_caps_are_multiplied() -> None:
    speed, time = Scale(10.0), Scale(2.0, caps=(8.0, None))
    product = combined("*", speed, time)
    assert (product.size, product.caps) == (20.0, (80.0, 80.0))
    quotient = combined("/", time, speed)
    assert (quotient.size, quotient.caps) == (0.2, (0.8, 0.8))
    assert combined("/", speed, Scale(1.0, 0.0)).divisor == 1.0


def test_a_constant_factor_is_no_scale_and_what_all_have_is_divided_out() -> None:
    gap, speed, factor = Scale(10.0, caps=(200.0, None)), Scale(5.0), Scale(1.0, -3.0)
    assert combined("-", gap, combined("*", speed, factor)).divisor == 10.0
    tripled = combined("*", factor, gap)
    assert (tripled.divisor, tripled.caps) == (30.0, (600.0, 600.0))
    assert combined("-", tripled, combined("*", speed, Scale(1.0, 4.5))).divisor == 30.0
    assert combined("/", gap, Scale(1.0, 4.0)).divisor == 2.5


def test_a_negated_term_becomes_minus_infinity_where_it_was_plus_infinity() -> None:
    ttc = Scale(1.0, caps=(10.0, None))
    assert ttc.opposite.caps == (None, 10.0)
    assert ttc.opposite.opposite == ttc
    assert ttc.magnitude.caps == ttc.opposite.magnitude.caps == (10.0, None)
    assert combined("-", Scale(1.0), ttc).caps == (None, 10.0)


@pytest.mark.parametrize(
    ("operator", "value"),
    [("+", 5.0), ("-", 1.0), ("min", 2.0), ("max", 3.0), ("*", 6.0), ("/", 1.5)],
)
def test_constants_are_calculated(operator: str, value: float) -> None:
    assert combined(operator, Scale(1.0, 3.0), Scale(1.0, 2.0)).value == value


def test_a_constant_without_a_value_is_no_number() -> None:
    zero = combined("-", Scale(1.0, 1.0), Scale(1.0, 1.0))
    assert zero.value == 0.0
    found = known(combined("/", Scale(1.0, 1.0), zero).value)
    assert math.isnan(found)


def test_a_label_has_the_place_of_its_word() -> None:
    assert label_code(words([0], "ok", "silent"), "silent") == 1
    assert label_code(truths([0]), "true") == 1


def test_both_sides_of_a_predicate_have_the_unit_of_a_signal() -> None:
    for text, unit in (
        ("gap > speed * 2 s", "m"),
        ("gap - speed * 2 s > 0", "m"),
        ("speed * 2 s > 0 m", "SI"),
        ("abs(speed) < 3 m/s", "m/s"),
        ("2 * (3 + 1) * gap > 6 m", "m"),
        ("gap / 2 - 0.5 * gap > 6 m", "m"),
        ("2 / gap < 3 / 1 m", "SI"),
        ("gap * gap > gap * 3 m", "SI"),
        ("contact", "1"),
    ):
        inputs: dict[str, Series] = {
            "gap": numbers([0.0], unit="m"),
            "speed": numbers([0.0], unit="m/s"),
            "contact": truths([0]),
        }
        predicate = parse_with({}, text)[0]
        assert isinstance(predicate, PREDICATES), text
        assert unit_of(predicate, inputs) == unit, text
