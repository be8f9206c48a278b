"""Expressions: evaluation and compiled programs agree, errors name text, place and remedy."""

from __future__ import annotations

import contextlib
import math
import pickle

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from adeye.errors import ExpressionError, SourceLocation
from adeye.kernel.postfix import MAX_STACK, run_program
from adeye.spec.expression import Expression, parse, to_program
from adeye.units import Dimension

WHERE = SourceLocation("odd/motorway.yaml", 17, 15)
NAMES = ("a", "b.c", "d")
INDEX = {name: position for position, name in enumerate(NAMES)}


def joined(strategy: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """Combine expressions into larger ones."""
    two = st.tuples(strategy, strategy)
    three = st.tuples(strategy, strategy, strategy)
    operators = ["+", "-", "*", "/", "**", "==", "!=", "<", "<=", ">", ">=", "and", "or"]
    ones = ["-", "not ", "abs", "sqrt", "floor", "ceil", "sin", "cos", "exp", "log"]
    return st.one_of(
        st.tuples(st.sampled_from(operators), two).map(lambda t: f"({t[1][0]} {t[0]} {t[1][1]})"),
        st.tuples(st.sampled_from(ones), strategy).map(lambda t: f"({t[0]}({t[1]}))"),
        st.tuples(st.sampled_from(["min", "max"]), three).map(lambda t: f"{t[0]}{t[1]}"),
        st.tuples(st.sampled_from(["clip", "if_"]), three).map(lambda t: f"{t[0]}{t[1]}"),
        three.map(lambda t: f"({t[0]} in [{t[1]}, {t[2]}])"),
    ).map(lambda text: text.replace("'", ""))


EXPRESSIONS = st.recursive(
    st.sampled_from([*NAMES, "0", "1", "2.5", "10 m", "3 s", "true", "90 deg"]),
    joined,
    max_leaves=8,
)
NUMBERS = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.0, 0.5, math.nan, math.inf, -math.inf, 1e300, 1e-300]),
    st.floats(-100.0, 100.0),
)


def run(expression: Expression, values: list[float]) -> float:
    program = to_program(expression, INDEX)
    return run_program(program.ops, program.args, np.array(values))


@pytest.mark.slow
@settings(max_examples=400)
@given(text=EXPRESSIONS, values=st.lists(NUMBERS, min_size=3, max_size=3))
def test_program_agrees_with_columns(text: str, values: list[float]) -> None:
    expression = parse(text)
    found = run(expression, values)
    try:
        wanted = expression.evaluate(dict(zip(NAMES, values, strict=True)))
    except ExpressionError:
        assert expression.is_truth or not math.isfinite(found)
    else:
        assert found == float(wanted)


@pytest.mark.slow
@settings(max_examples=100)
@given(
    text=EXPRESSIONS, rows=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=1, max_size=5)
)
def test_column_is_its_rows(text: str, rows: list[tuple[float, float, float]]) -> None:
    expression = parse(text)
    singles = []
    for row in rows:
        try:
            singles.append(float(expression.evaluate(dict(zip(NAMES, row, strict=True)))))
        except ExpressionError:
            singles.append(math.nan)
    columns = {name: np.array([row[k] for row in rows]) for k, name in enumerate(NAMES)}
    if np.isnan(singles).any():
        with pytest.raises(ExpressionError, match="is not finite"):
            expression.evaluate(columns)
    else:
        found = np.broadcast_to(expression.evaluate(columns), len(rows))
        np.testing.assert_array_equal(found, singles)


def test_names_and_constants() -> None:
    assert parse("ego.speed * time_gap + abs(ego.speed)").names == {"ego.speed", "time_gap"}
    assert not parse("gap > 1 m").is_constant
    assert parse("2 * 3 m").is_constant
    assert parse("'and' == \"gap\"").names == frozenset()


def test_equal_text_is_an_equal_expression() -> None:
    one, other = parse("gap > 1 m"), parse("gap > 1 m", WHERE)
    assert one == other
    assert hash(one) == hash(other)
    assert one != parse("gap >  1 m")


def test_expression_is_frozen_and_survives_pickling() -> None:
    expression = parse("+".join(["gap"] * 500), WHERE)
    with pytest.raises(AttributeError):
        expression.text = "1"  # type: ignore[misc]
    copy = pickle.loads(pickle.dumps(expression))  # noqa: S301 - our own bytes
    assert copy == expression
    assert copy.evaluate({"gap": 1.0}) == 500.0


def test_long_chain_of_operators_needs_no_recursion() -> None:
    expression = parse("+".join(["a"] * 1_000))
    assert expression.evaluate({"a": 1.0}) == 1_000.0
    assert run(expression, [1.0, 0.0, 0.0]) == 1_000.0
    assert to_program(expression, INDEX).stack == 2


def test_unknown_name_is_named_with_a_suggestion() -> None:
    for refuse in (
        lambda: parse("gapp > 1", WHERE).evaluate({"gap": 1.0, "speed": 2.0}),
        lambda: to_program(parse("gapp > 1", WHERE), {"gap": 0, "speed": 1}),
    ):
        with pytest.raises(ExpressionError) as caught:
            refuse()
        assert str(caught.value) == (
            "ExpressionError: odd/motorway.yaml:17:15: 'gapp > 1' uses 'gapp', "
            "which does not exist here. Did you mean 'gap'?"
        )


def test_name_of_a_column_that_is_not_used_does_not_matter() -> None:
    assert parse("a").evaluate({"a": 1.0, "b": "text"}) == 1.0


@pytest.mark.parametrize("text", ["1 / x", "log(x)", "x / x", "10 ** 400", "sqrt(x - 1)"])
def test_result_that_is_not_finite_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match="is not finite for some values"):
        parse(text).evaluate({"x": np.array([1.0, 0.0])})


def test_a_relation_that_divides_by_zero_names_the_point() -> None:
    with pytest.raises(ExpressionError, match=r"divides by zero .* where gap = 0 and rain = 2 in"):
        parse("1 / gap > rain").evaluate({"gap": np.array([1.0, 0.0]), "rain": 2.0})
    for guarded in ("gap == 0 or 1 / gap > 2", "gap != 0 and 1 / gap > 2"):
        assert parse(guarded).evaluate({"gap": 0.0}) is ("or" in guarded)


# --- what lies on a limit


DECIMALS = st.integers(-20, 40).map(lambda count: 5 * count)


@pytest.mark.slow
@given(parts=st.lists(DECIMALS, min_size=1, max_size=4), unit=st.sampled_from(["km/h", "m", "deg"]))
@example(parts=[20, 45], unit="km/h")
def test_a_sum_of_decimals_on_a_limit_counts_as_on_it(parts: list[int], unit: str) -> None:
    terms = " + ".join(f"{part} {unit}" for part in parts)
    names = " + ".join([NAMES[0], *(f"{part} {unit}" for part in parts[1:])])
    values = dict.fromkeys(NAMES, 0.0) | {
        NAMES[0]: parse(f"{parts[0]} {unit}").evaluate({}) if parts[0] else 0.0
    }
    limit = f"{sum(parts)} {unit}"
    for text in (terms, names):
        told = {
            relation: parse(f"{text} {relation} {limit}")
            for relation in ("<=", ">=", "==", "<", ">", "!=")
        }
        for relation, expression in told.items():
            expected = "=" in relation and relation != "!="
            assert expression.evaluate(values) is expected
            assert run(expression, [values[name] for name in NAMES]) == float(expected)
        assert parse(f"{text} - {limit} <= 0").evaluate(values) is True


def test_a_difference_that_people_see_is_none_of_rounding() -> None:
    assert parse("a <= 65 km/h").evaluate({"a": 65.000001 / 3.6}) is False
    assert parse("a > 0 mm/h").evaluate({"a": 1e-6 / 3.6e6}) is True


@pytest.mark.parametrize(
    "text",
    [
        "(a - d)**2 <= 0",
        "(a - d)**0.5 == 0",
        "sqrt(a - d) == 0",
        "sqrt(d - a) == 0",
        "ceil(a / 0.1) == 3",
        "floor(d / 0.1) == 3",
        "log(1 + a - d) == 0",
        "sin((1 + a - d) * 180 deg) == 0",
        "cos((1 + a - d) * 90 deg) <= 0",
        "(a + 1)**-2 == (d + 1)**-2",
    ],
)
def test_a_function_of_a_sum_on_a_limit_is_that_of_the_limit(text: str) -> None:
    # 0.1 + 0.2 is not the float 0.3.
    values = {"a": 0.1 + 0.2, "d": 0.3}
    assert parse(text).evaluate(values) is True
    columns = {name: np.array([value]) for name, value in values.items()}
    assert np.all(parse(text).evaluate(columns))
    assert run(parse(text), [values["a"], 0.0, values["d"]]) == 1.0


@pytest.mark.parametrize("text", ["1 / (a - d) > 0", "(a - d)**-1 < 9", "log(a - d) < 0"])
def test_a_sum_that_is_zero_but_for_rounding_divides_by_zero(text: str) -> None:
    with pytest.raises(ExpressionError, match="divides by zero or is not finite"):
        parse(text).evaluate({"a": 0.1 + 0.2, "d": 0.3})


def test_text_and_numbers_are_not_mixed() -> None:
    with pytest.raises(ExpressionError, match="mixes text and numbers"):
        parse("weather > 2").evaluate({"weather": "rain"})


def test_columns_of_different_length_are_refused() -> None:
    with pytest.raises(ExpressionError, match="joins columns of different length"):
        parse("a + b").evaluate({"a": np.zeros(2), "b": np.zeros(3)})


def test_dimension_error_has_its_place() -> None:
    with pytest.raises(ExpressionError) as caught:
        parse("gap + speed", WHERE).dimension({"gap": Dimension.LENGTH, "speed": Dimension.SPEED})
    assert str(caught.value) == (
        "ExpressionError: odd/motorway.yaml:17:15: 'gap + speed' puts a length and a speed "
        "together. Check the units."
    )
    assert (
        parse("gap / speed").dimension({"gap": Dimension.LENGTH, "speed": Dimension.SPEED})
        is Dimension.TIME
    )


def test_grammar_error_has_its_place_every_time() -> None:
    for _ in range(2):
        with pytest.raises(ExpressionError) as caught:
            parse("gap > ", WHERE)
        assert str(caught.value).startswith("ExpressionError: odd/motorway.yaml:17:15: 'gap > ', ")


def test_text_is_not_known_during_a_run() -> None:
    with pytest.raises(ExpressionError, match="uses text, which is not known during a run"):
        to_program(parse("a == 'wet'"), INDEX)


def pending(depth: int) -> str:
    """Nest so that five values wait for each inner bracket."""
    return "(a or a and a < a + a * " * depth + "a" + ")" * depth


def test_program_that_holds_too_many_values_is_refused() -> None:
    fits = to_program(parse(pending(25)), INDEX)
    assert fits.stack == 126
    assert run_program(fits.ops, fits.args, np.ones(3)) == 1.0
    with pytest.raises(ExpressionError, match="holds 131 values at once, at most 128 can be"):
        to_program(parse(pending(26)), INDEX)


def test_stack_of_a_program_is_exact() -> None:
    assert to_program(parse("a"), INDEX).stack == 1
    assert to_program(parse("a + (a + (a + a))"), INDEX).stack == 4
    assert to_program(parse("clip(a, d, a)"), INDEX).stack == 3
    assert to_program(parse("a in [1, 2, 3]"), INDEX).stack == 3


@pytest.mark.slow
@settings(max_examples=300)
@given(st.text("abx.()[]<>=+-*/'\" 0123456789mskh^²,eEnotrd_if", max_size=40))
def test_any_text_gives_an_answer_or_an_expression_error(text: str) -> None:
    with contextlib.suppress(ExpressionError):
        expression = parse(text)
        names = sorted(expression.names)
        program = to_program(expression, {name: k for k, name in enumerate(names)})
        assert 1 <= program.stack <= MAX_STACK
        expression.evaluate(dict.fromkeys(names, 1.0))
        expression.dimension({})
