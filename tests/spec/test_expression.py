"""The expression language: grammar, values of columns, dimensions, words."""

import contextlib
import math
import pickle
import time
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from adeye.errors import ExpressionError
from adeye.kernel.elementary import exp, power, sin
from adeye.kernel.postfix import MAX_STACK, run_program
from adeye.spec.expression import (
    Expression,
    Value,
    evaluated,
    may_hold,
    measured,
    parse,
    to_program,
    told,
)
from adeye.spec.grammar import FUNCTIONS, MAX_DEPTH, MAX_LENGTH, POPS, read_steps
from adeye.units import Dimension
from tests.frozen import assert_frozen
from tests.refusals import refused
from tests.stored import known, stored

TABLES = stored("expressions")


# --- The grammar: precedence, units, and that hostile text gives nothing but an ExpressionError ---

WORDS = [
    *("a", "ego.speed", "true", "2", "0", "1.5e3", "2 s", "60 km/h", "'x'", '"y z"'),
    *("+", "-", "*", "/", "**", "==", "!=", "<", "<=", ">", ">=", "and", "or", "not", "in"),
    *("(", ")", "[", "]", ",", "abs(", "min(", "clip(", "if_(", " ", "m", "km/h", "£", "\n", "\0"),
]


def words(text: str) -> str:
    """Write the steps in postfix order, with values in place of numbers, names and texts."""
    return " ".join(
        {"number": f"{step.number:g}", "name": step.text, "text": repr(step.text)}.get(
            step.word, step.word
        )
        for step in read_steps(text)
    )


@pytest.mark.parametrize(("text", "postfix"), TABLES["precedence"])
def test_precedence(text: str, postfix: str) -> None:
    assert words(text) == postfix


def test_number_takes_the_longest_unit() -> None:
    for text, value in (
        ("2 s", 2.0),
        ("2s", 2.0),
        ("60 km/h", 60 / 3.6),
        ("7.5 mm/h", 7.5 / 3_600_000),
        ("3 m/s^2", 3.0),
        ("3 m/s²", 3.0),
        ("50 ms", 0.05),
        ("0.6 /h", 0.6 / 3600),
        ("2 min", 120.0),
        ("10 m", 10.0),
        (".5 m", 0.5),
        ("1e3 m", 1000.0),
    ):
        (step,) = read_steps(text)
        assert (step.word, step.number) == ("number", value), text


def test_quantity_can_be_divided() -> None:
    assert words("10 m/2") == words("10 m / 2") == "10 2 /"
    assert words("10 m / 2 s") == "10 2 /"


def test_unit_that_goes_on_is_no_unit() -> None:
    for text in ("10 m/sec", "10 m/gap", "60 kmh", "10 mi", "10 m_x", "2 m.x"):
        refused(ExpressionError, read_steps, text, says=r"there is no unit|follows")


def test_unknown_unit_is_named_with_a_suggestion() -> None:
    caught = refused(ExpressionError, read_steps, "gap > 60 kmh")
    assert caught.message == "'gap > 60 kmh', character 10: there is no unit 'kmh'"
    assert caught.remedy == "Did you mean 'km/h'?"


def test_bare_zero_fits_anything_and_a_zero_with_a_unit_does_not() -> None:
    assert read_steps("0")[0].exponents is None
    assert read_steps("0 m")[0].exponents == (1, 0, 0)
    assert read_steps("1")[0].exponents == (0, 0, 0)


def test_text_outside_the_grammar_is_refused_with_its_position() -> None:
    for text, message in TABLES["text outside the grammar is refused with its position"]:
        refused(ExpressionError, read_steps, text, says=message)


def test_misspelt_function_is_suggested() -> None:
    caught = refused(ExpressionError, read_steps, "sqrrt(2)")
    assert caught.remedy == "Did you mean 'sqrt'?"


def test_length_is_capped() -> None:
    assert len(read_steps("1" + " " * (MAX_LENGTH - 1))) == 1
    with pytest.raises(ExpressionError, match="2,001 characters, at most 2,000"):
        read_steps("1" + " " * MAX_LENGTH)


def refusal(text: str) -> str:
    """Return the message of the refusal, empty for text that is read."""
    try:
        read_steps(text)
    except ExpressionError as error:
        return str(error)
    return ""


def nested(kind: str, depth: int) -> str:
    if kind == "**":
        return "**".join(["1"] * (depth + 1))
    return f"{kind}(" * depth + "1" + ")" * depth


@pytest.mark.parametrize("kind", ["", "abs", "**"])
def test_depth_is_capped(kind: str) -> None:
    # The whole expression is the first level.
    assert read_steps(nested(kind, MAX_DEPTH - 1))
    with pytest.raises(ExpressionError, match=f"nested more than {MAX_DEPTH} deep"):
        read_steps(nested(kind, MAX_DEPTH))


def test_hostile_text_is_read_or_refused_at_once() -> None:
    for text in (
        "(" * 2_000,
        "abs(" * 500,
        "1**" * 666 + "1",
        "-" * 1_999 + "1",
        "not " * 499 + "1",
        "a+" * 999 + "a",
        "a or " * 399 + "a",
        "a in [" + "1," * 900 + "1]",
        "1 " * 1_000,
        "'" * 2_000,
        "." * 2_000,
        "9" * 2_000,
        "1e" + "9" * 1_990,
    ):
        begin = time.process_time()
        message = refusal(text)
        assert time.process_time() - begin < 0.2, text
        assert len(message) < 400, text


def test_nested_membership_stays_small() -> None:
    text = "x"
    for _ in range(MAX_DEPTH - 1):
        text = f"({text} in [1, 1])"
    assert len(read_steps(text)) < len(text)


@settings(max_examples=300)
@given(st.text(max_size=60) | st.lists(st.sampled_from(WORDS), max_size=25).map(" ".join))
def test_any_text_is_steps_or_an_expression_error(text: str) -> None:
    message = refusal(text)
    if message:
        assert message.isprintable()
        return
    height = 0
    for step in read_steps(text):
        height -= POPS[step.word]
        assert height >= 0
        height += 1
    assert height == 1


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_leaves_one_value(name: str) -> None:
    for count in FUNCTIONS[name]:
        steps = read_steps(f"{name}({', '.join(['a'] * count)})")
        assert sum(1 - POPS[step.word] for step in steps) == 1


def test_what_is_asked_of_an_event_is_a_variable_of_it() -> None:
    (since,) = read_steps("since(cut_in)")
    assert (since.word, since.text) == ("name", "cut_in.since")
    assert read_steps("ended(cut_in)")[0].text == "cut_in.ended"
    refused(ExpressionError, read_steps, "since(2 s)", says="there is no function 'since'")


# --- Expressions: evaluation and compiled programs agree, errors name text, place and remedy ------

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
        refused(ExpressionError, expression.evaluate, columns, says="is not finite")
    else:
        found = np.broadcast_to(expression.evaluate(columns), len(rows))
        np.testing.assert_array_equal(found, singles)


def test_names_and_constants() -> None:
    assert parse("ego.speed * time_gap + abs(ego.speed)").names == {"ego.speed", "time_gap"}
    assert not parse("gap > 1 m").is_constant
    assert parse("2 * 3 m").is_constant
    assert parse("'and' == \"gap\"").names == frozenset()


def test_equal_text_is_an_equal_expression() -> None:
    one, other = parse("gap > 1 m"), parse("gap > 1 m")
    assert one == other
    assert hash(one) == hash(other)
    assert one != parse("gap >  1 m")


def test_expression_is_frozen_and_survives_pickling() -> None:
    expression = parse("+".join(["gap"] * 500))
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
        lambda: parse("gapp > 1").evaluate({"gap": 1.0, "speed": 2.0}),
        lambda: to_program(parse("gapp > 1"), {"gap": 0, "speed": 1}),
    ):
        caught = refused(ExpressionError, refuse)
        assert str(caught) == (
            "ExpressionError: 'gapp > 1' uses 'gapp', "
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


@pytest.mark.parametrize("text", TABLES["a function of a sum on a limit is that of the limit"])
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


def test_dimension_error_names_both() -> None:
    with pytest.raises(ExpressionError) as caught:
        parse("gap + speed").dimension({"gap": Dimension.LENGTH, "speed": Dimension.SPEED})
    assert str(caught.value) == (
        "ExpressionError: 'gap + speed' puts a length and a speed together. Check the units."
    )
    assert (
        parse("gap / speed").dimension({"gap": Dimension.LENGTH, "speed": Dimension.SPEED})
        is Dimension.TIME
    )


def test_grammar_error_is_the_same_every_time() -> None:
    for _ in range(2):
        caught = refused(ExpressionError, parse, "gap > ")
        assert str(caught).startswith("ExpressionError: 'gap > ', ")


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


# --- Expressions over columns: numbers, truth, text, and what must not be mixed -------------------

NAN = math.nan


def evaluate(text: str, **columns: Value) -> Any:
    return evaluated(read_steps(text), columns)


def test_scalar_answer() -> None:
    computed = [["sin(0.5)", sin(0.5)], ["exp(1)", exp(1.0)], ["2 ** 0.5", power(2.0, 0.5)]]
    for text, answer in TABLES["scalar answer"] + computed:
        found = evaluate(text)
        assert found == answer, text
        assert type(found) is type(answer), text


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


def test_text_is_no_number() -> None:
    for text in TABLES["text is no number"]:
        refused(TypeError, evaluate, text, x=NAN)


@pytest.mark.parametrize(("text", "expected"), TABLES["what may hold whatever the unknown is"])
def test_what_may_hold_whatever_the_unknown_is(text: str, expected: list[bool]) -> None:
    held = may_hold(read_steps(text), {"time": np.array([0.0, 1.0, 2.0])})
    assert np.broadcast_to(held, 3).tolist() == expected


@pytest.mark.parametrize("other", [-2.0, 0.0, 4.0, NAN])
def test_what_holds_for_a_value_may_hold_without_it(other: float) -> None:
    time = np.array([0.0, 1.0, 2.0])
    for text in ("time >= 2 and other > 3", "other in [time, 4]", "if_(other > 1, time, -other)"):
        held = evaluate(text, time=time, other=other)
        assert np.all(may_hold(read_steps(text), {"time": time}) >= (np.nan_to_num(held) != 0))


# --- Dimensions of expressions: what fits together, what does not ---------------------------------

DIMS = {
    "speed": Dimension.SPEED,
    "gap": Dimension.LENGTH,
    "time": Dimension.TIME,
    "braking": Dimension.ACCELERATION,
    "heading": Dimension.ANGLE,
    "yaw_rate": Dimension.ANGULAR_RATE,
    "bend": Dimension.CURVATURE,
    "rain": Dimension.RAIN_RATE,
    "ratio": Dimension.NONE,
    "open": None,
}


def dimension(text: str) -> Dimension | None:
    return measured(read_steps(text), DIMS, text)


def test_dimension() -> None:
    for text, name in TABLES["dimension of what is written"]:
        assert dimension(text) is (None if name is None else Dimension[name]), text


def test_mismatch_is_named() -> None:
    for text, message in TABLES["mismatch is named"]:
        caught = refused(ExpressionError, dimension, text)
        assert message in caught.message


def test_long_chain_needs_no_recursion() -> None:
    assert dimension("+".join(["gap"] * 400)) is Dimension.LENGTH


@given(
    left=st.sampled_from(sorted(DIMS.keys() - {"open"})),
    right=st.sampled_from(sorted(DIMS.keys() - {"open"})),
)
def test_sum_is_defined_exactly_for_equal_exponents(left: str, right: str) -> None:
    one, other = DIMS[left], DIMS[right]
    if known(one).exponents == known(other).exponents:
        assert dimension(f"{left} + {right}") is not None
    else:
        refused(ExpressionError, dimension, f"{left} + {right}", says="together")


@given(left=st.sampled_from(sorted(DIMS)), right=st.sampled_from(sorted(DIMS)))
def test_order_of_comparison_does_not_matter(left: str, right: str) -> None:
    def answer(text: str) -> object:
        try:
            return dimension(text)
        except ExpressionError:
            return "refused"

    assert answer(f"{left} < {right}") == answer(f"{right} > {left}")


# --- Numbers: values, where they are defined, what may hold, dimensions ---------------------------

COLUMNS: dict[str, Value] = {
    "a": np.array([0.0, 1.0, -2.0, 3.5, math.inf, math.nan]),
    "b": np.array([0.0, 0.1 + 0.2, 2.0, -3.5, 1.0, 4.0]),
    "c": 0.3,
    "w": np.array(["x", "y", "x", "z", "x", "y"]),
}
VALUES = (
    "a + b", "a - b", "a * b", "a / b", "a ** 2", "2 ** b", "a ** b", "-a", "abs(a)",
    "sqrt(abs(b))", "min(a, b)", "max(a, b, 1)", "clip(a, -1, 2)", "if_(a > b, a, b)",
    "if_(w == 'x', 1, a)", "floor(b)", "ceil(b)", "round(b)", "exp(b)", "log(abs(b) + 1)",
    "sin(b)", "cos(b)", "b == c", "b != c", "b < c", "b <= c", "b > c", "b >= c", "a == a",
    "a > 0 and b > 0", "a > 0 or b > 0", "not a > 0", "b in [0.3, 2]", "w in ['x', 'z']",
    "not w == 'x'", "w != 'y'", "a + 0.1 == b", "3 * c == 0.9", "c * 3 - 0.9 == 0",
    "0.1 + 0.2 == c", "a / 0 > 1", "0 * a == 0", "b - 0.3 == 0", "floor(3 * c * 10) == 9",
    "round(c * 10) == 3", "a * 1e200 * 1e200 > 1", "true", "w", "1 / 3 + 1 / 3 + 1 / 3 == 1",
    "a < 1 or b / a > 1", "a > 1 and sqrt(a) < 2", "(a > 1) + 1", "min(b, c) == c",
    "max(b, c) <= c", "clip(b, 0, c) == c", "if_(b == c, 1, 0)", "abs(b - c) < 0",
)  # fmt: skip
DIMENSIONS = {
    "a": Dimension.LENGTH,
    "b": Dimension.TIME,
    "c": Dimension.NONE,
    "v": Dimension.SPEED,
    "w": None,
}
MEASURED = (
    "a / b", "a * a", "a + b", "v * b - a", "a / v", "v ** 2 / a", "v ** c", "v ** 0.5",
    "(a * a) ** 0.5", "sqrt(a * a)", "sqrt(a)", "abs(v)", "min(a, b)", "max(a, 2 m)",
    "clip(v, 1 m/s, 3 m/s)", "a > b", "a > 2 m", "a > 2", "c > 2", "if_(a > 1 m, v, v)",
    "if_(a > 1 m, v, a)", "sin(a)", "sin(c)", "exp(b)", "floor(a)", "round(c)", "w == 'x'",
    "w > 1", "a in [1 m, 2 m]", "a in [1 s]", "not a", "not c > 1", "a ** b", "a ** 20",
    "a ** 0", "c ** 150", "a ** 100", "a ** 101", "a ** -101", "1 / b",
    "a * b * v", "-v", "a == a and v", "c + true", "a ** (1 / 3)",
)  # fmt: skip


def shown(value: Any) -> str:
    values = np.atleast_1d(np.asarray(value))
    return " ".join(str(item) if item.dtype.kind in "bU" else f"{item:.9g}" for item in values)


def asked(call: Any, *given: Any) -> str:
    try:
        return str(call(*given))
    except (ExpressionError, TypeError, ValueError) as error:
        return f"{type(error).__name__}: {error}"


def test_answers_are_frozen() -> None:
    """Values with rounding and infinity, where a truth is certain, and dimensions."""
    lines = []
    for text in VALUES:
        try:
            steps = read_steps(text)
        except ExpressionError as error:
            lines.append(f"{text}: {error}")
            continue
        known_ones = {name: COLUMNS[name] for name in ("a", "c")}
        lines += [
            f"{text}",
            f"  = {asked(lambda s: shown(evaluated(s, COLUMNS)), steps)}",
            f"  defined {asked(lambda s: shown(told(s, COLUMNS)[1]), steps)}",
            f"  without b {asked(lambda s, k: shown(may_hold(s, k)), steps, known_ones)}",
        ]
    for text in MEASURED:
        found = asked(lambda t: measured(read_steps(t), DIMENSIONS, t), text)
        lines.append(f"{text} is {found}")
    assert_frozen("expressions.txt", "\n".join([*lines, ""]))
