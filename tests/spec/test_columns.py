"""Expressions over columns: numbers, truth, text, and what must not be mixed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel.elementary import exp, power, sin
from adeye.spec.expression import Value, evaluated, may_hold
from adeye.spec.grammar import read_steps

NAN = math.nan


def evaluate(text: str, **columns: Value) -> Any:
    return evaluated(read_steps(text), columns)


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("1 + 2 * 3", 7.0),
        ("7 / 2", 3.5),
        ("2 ** 10", 1024.0),
        ("-2 ** 2", -4.0),
        ("(0 - 2) ** 3", -8.0),
        ("abs(-3)", 3.0),
        ("min(3, 1, 2)", 1.0),
        ("max(3, 1, 5)", 5.0),
        ("sqrt(9)", 3.0),
        ("floor(-1.5)", -2.0),
        ("ceil(1.2)", 2.0),
        ("sin(0.5)", sin(0.5)),
        ("exp(1)", exp(1.0)),
        ("2 ** 0.5", power(2.0, 0.5)),
        ("clip(5, 0, 3)", 3.0),
        ("if_(1 < 2, 10, 20)", 10.0),
        ("1 < 2", True),
        ("2 <= 1", False),
        ("1 < 2 and not 2 < 1", True),
        ("1 > 2 or 3 in [1, 2]", False),
        ("3 in [1, 3]", True),
        ("'b' in ['a', 'b']", True),
        ("'a' < 'b'", True),
        ("'a' != 'a'", False),
        ("if_(1 > 2, 'a', 'b')", "b"),
        ("'wet'", "wet"),
        ("60 km/h > 16 m/s", True),
    ],
)
def test_scalar_answer(text: str, answer: object) -> None:
    found = evaluate(text)
    assert found == answer
    assert type(found) is type(answer)


def test_column_goes_through() -> None:
    gap = np.array([5.0, 10.0, 20.0])
    np.testing.assert_array_equal(evaluate("2 * gap + 1", gap=gap), [11.0, 21.0, 41.0])
    np.testing.assert_array_equal(evaluate("gap >= 10", gap=gap), [False, True, True])
    np.testing.assert_array_equal(evaluate("gap ** 2", gap=gap), gap * gap)


def test_columns_and_scalars_are_broadcast() -> None:
    found = evaluate("if_(lead > own, lead, own)", lead=np.array([1.0, 3.0]), own=2.0)
    np.testing.assert_array_equal(found, [2.0, 3.0])


@pytest.mark.parametrize("road", [np.array(["wet", "dry"]), np.array(["wet", "dry"], dtype=object)])
def test_text_column_is_compared(road: Any) -> None:
    np.testing.assert_array_equal(evaluate("road == 'wet'", road=road), [True, False])
    np.testing.assert_array_equal(evaluate("road != 'wet'", road=road), [False, True])
    np.testing.assert_array_equal(evaluate("road in ['ice', 'dry']", road=road), [False, True])


def test_empty_column_stays_empty() -> None:
    assert evaluate("sin(x) ** x + 1", x=np.array([])).shape == (0,)


def test_integers_do_not_wrap_around() -> None:
    assert evaluate("k * k", k=np.array([2**40]))[0] == 2.0**80
    np.testing.assert_array_equal(evaluate("2 ** -k", k=np.array([1, 2])), [0.5, 0.25])


def test_truth_values_add_up_as_numbers() -> None:
    assert evaluate("(1 < 2) + (2 < 3) + (3 < 2)") == 2.0
    assert evaluate("-(1 < 2)") == -1.0


@pytest.mark.parametrize("operator", ["==", "!=", "<", "<=", ">", ">="])
def test_comparison_with_nan_is_false(operator: str) -> None:
    assert evaluate(f"x {operator} 1", x=NAN) is False
    assert evaluate(f"1 {operator} x", x=NAN) is False
    assert evaluate(f"x {operator} x", x=NAN) is False


@pytest.mark.parametrize("text", ["x and true", "x or false", "not x", "x in [1]"])
def test_truth_of_nan_is_false(text: str) -> None:
    assert evaluate(text, x=NAN) is False


@pytest.mark.parametrize(
    "text",
    ["x + 1", "min(x, 1)", "min(1, x)", "max(1, x)", "clip(x, 0, 1)", "if_(x, 1, 2)", "x ** 0"],
)
def test_number_computed_from_nan_is_nan(text: str) -> None:
    assert math.isnan(evaluate(text, x=NAN))


def test_inputs_are_not_changed() -> None:
    found = np.array([0.0, 1.0])
    evaluate("(x in [1, 2]) or x > 3", x=found)
    np.testing.assert_array_equal(found, [0.0, 1.0])


@pytest.mark.parametrize(
    "text",
    [
        "'a' + 1",
        "'a' + 'b'",
        "-'a'",
        "'a' == 1",
        "1 < 'a'",
        "1 in ['a']",
        "'a' and true",
        "not 'a'",
        "if_('a', 1, 2)",
        "if_(true, 'a', 1)",
        "if_(x, 'a', 'b')",
        "abs('a')",
        "min('a', 'b')",
        "sin('a')",
        "'a' ** 2",
    ],
)
def test_text_is_no_number(text: str) -> None:
    with pytest.raises(TypeError):
        evaluate(text, x=NAN)


def test_columns_of_different_length_are_refused() -> None:
    with pytest.raises(ValueError, match="broadcast"):
        evaluate("a + b", a=np.zeros(2), b=np.zeros(3))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("time >= 2", [False, False, True]),
        ("time >= 2 and other > 3", [False, False, True]),
        ("time >= 2 or other > 3", [True, True, True]),
        ("not (time >= 2 or other > 3)", [True, True, False]),
        ("other > 3 or 1 > 2", [True, True, True]),
        ("other > 3 and 1 > 2", [False, False, False]),
        ("other * 0 > 1", [True, True, True]),
        ("if_(time >= 1, time - 1, other)", [True, False, True]),
        ("if_(other > 1, 0, 0)", [True, True, True]),
        ("time in [1, 7]", [False, True, False]),
        ("time in [1, other]", [True, True, True]),
        ("log(time - 1) > 0 and time < 2", [False, False, False]),
    ],
)
def test_what_may_hold_whatever_the_unknown_is(text: str, expected: list[bool]) -> None:
    held = may_hold(read_steps(text), {"time": np.array([0.0, 1.0, 2.0])})
    assert np.broadcast_to(held, 3).tolist() == expected


@pytest.mark.parametrize("other", [-2.0, 0.0, 4.0, NAN])
def test_what_holds_for_a_value_may_hold_without_it(other: float) -> None:
    time = np.array([0.0, 1.0, 2.0])
    for text in ("time >= 2 and other > 3", "other in [time, 4]", "if_(other > 1, time, -other)"):
        held = evaluate(text, time=time, other=other)
        assert np.all(may_hold(read_steps(text), {"time": time}) >= (np.nan_to_num(held) != 0))
