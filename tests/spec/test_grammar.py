"""The grammar: precedence, units, and that hostile text gives nothing but an ExpressionError."""

from __future__ import annotations

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.errors import ExpressionError
from adeye.spec.grammar import FUNCTIONS, MAX_DEPTH, MAX_LENGTH, POPS, read_steps

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


@pytest.mark.parametrize(
    ("text", "postfix"),
    [
        ("1 + 2 * 3", "1 2 3 * +"),
        ("(1 + 2) * 3", "1 2 + 3 *"),
        ("8 - 4 - 2", "8 4 - 2 -"),
        ("8 / 4 / 2", "8 4 / 2 /"),
        ("2 ** 3 ** 2", "2 3 2 ** **"),
        ("-2 ** 2", "2 2 ** negative"),
        ("2 ** -1", "2 1 negative **"),
        ("--a", "a"),
        ("- + - -a", "a negative"),
        ("a < b and c or d", "a b < c and d or"),
        ("a or b and c", "a b c and or"),
        ("not a == b", "a b == not"),
        ("not not a", "a not not"),
        ("a + 1 < b * 2", "a 1 + b 2 * <"),
        ("a in [1, 2]", "a 0 1 member 2 member found"),
        ("not a in ['x']", "a 0 'x' member found not"),
        ("min(a, b, c)", "a b min c min"),
        ("max(a, b)", "a b max"),
        ("if_(a > 0, b, c)", "a 0 > b c if_"),
        ("clip(a, 1, 2)", "a 1 2 clip"),
        ("true", "1"),
        ("false", "0"),
        ("ego.speed", "ego.speed"),
        ('"it\'s"', '"it\'s"'),
        ("android + orbit + nothing + inner", "android orbit + nothing + inner +"),
    ],
)
def test_precedence(text: str, postfix: str) -> None:
    assert words(text) == postfix


@pytest.mark.parametrize(
    ("text", "value"),
    [
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
    ],
)
def test_number_takes_the_longest_unit(text: str, value: float) -> None:
    (step,) = read_steps(text)
    assert (step.word, step.number) == ("number", value)


def test_quantity_can_be_divided() -> None:
    assert words("10 m/2") == words("10 m / 2") == "10 2 /"
    assert words("10 m / 2 s") == "10 2 /"


@pytest.mark.parametrize("text", ["10 m/sec", "10 m/gap", "60 kmh", "10 mi", "10 m_x", "2 m.x"])
def test_unit_that_goes_on_is_no_unit(text: str) -> None:
    with pytest.raises(ExpressionError, match=r"there is no unit|follows"):
        read_steps(text)


def test_unknown_unit_is_named_with_a_suggestion() -> None:
    with pytest.raises(ExpressionError) as caught:
        read_steps("gap > 60 kmh")
    assert caught.value.message == "'gap > 60 kmh', character 10: there is no unit 'kmh'"
    assert caught.value.remedy == "Did you mean 'km/h'?"


def test_bare_zero_fits_anything_and_a_zero_with_a_unit_does_not() -> None:
    assert read_steps("0")[0].exponents is None
    assert read_steps("0 m")[0].exponents == (1, 0, 0)
    assert read_steps("1")[0].exponents == (0, 0, 0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "an empty expression"),
        ("  ", "an empty expression"),
        ("a +", "character 4: a number, a name or '(' is missing"),
        ("(a", "character 3: ')' is missing"),
        ("a)", "character 2: something follows the end"),
        ("a b", "character 3: something follows the end"),
        ("1 < 2 < 3", "character 7: comparisons cannot be chained"),
        ("a in [1] == b", "character 10: comparisons cannot be chained"),
        ("a in 1", "'in' needs a list"),
        ("a in []", "a number, a name or '(' is missing"),
        ("a in [1", "']' is missing"),
        ("abs()", "a number, a name or '(' is missing"),
        ("abs(1, 2)", "abs takes 1 arguments, not 2"),
        ("min(1)", "min takes 2 to 8 arguments, not 1"),
        ("clip(1, 2)", "clip takes 3 arguments, not 2"),
        ("eval('1')", "character 1: there is no function 'eval'"),
        ("a[0]", "something follows the end"),
        ("a.__class__()", "there is no function 'a.__class__'"),
        ("lambda: 1", "':' cannot be read here"),
        ("a = 1", "character 3: '=' cannot be read here"),
        ("a && b", "'&' cannot be read here"),
        ("'open", '"\'" cannot be read here'),
        ("1e999", "'1e999' is not a finite number"),
        ("1e308 km", "'1e308' is not a finite number"),
        ("and", "a number, a name or '(' is missing"),
    ],
)
def test_text_outside_the_grammar_is_refused_with_its_position(text: str, message: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        read_steps(text)
    assert message in str(caught.value)


def test_misspelt_function_is_suggested() -> None:
    with pytest.raises(ExpressionError) as caught:
        read_steps("sqrrt(2)")
    assert caught.value.remedy == "Did you mean 'sqrt'?"


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


@pytest.mark.parametrize(
    "text",
    [
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
    ],
)
def test_hostile_text_is_read_or_refused_at_once(text: str) -> None:
    begin = time.process_time()
    message = refusal(text)
    assert time.process_time() - begin < 0.2
    assert len(message) < 400


def test_nested_membership_stays_small() -> None:
    text = "x"
    for _ in range(MAX_DEPTH - 1):
        text = f"({text} in [1, 1])"
    assert len(read_steps(text)) < len(text)


@pytest.mark.slow
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
    with pytest.raises(ExpressionError, match="there is no function 'since'"):
        read_steps("since(2 s)")
