"""A parsed formula as others use it, and its check against the dictionary."""

import dataclasses
import itertools

import numpy as np
import pytest

from adeye.errors import ExpressionError, SourceLocation
from adeye.judge.stl import syntax
from adeye.judge.stl.batch import evaluate_rows
from adeye.judge.stl.formula import parse_formula, unit_exponents
from adeye.judge.stl.parser import parse_with
from adeye.signals import SignalType, architecture_signals, scene_signals
from tests.judge.stl.batch import Signals, numbers
from tests.refusals import refused
from tests.stored import stored

TABLES = stored("formulas")


DICTIONARY = {
    "gap": SignalType("m", 10.0, "number", "gap"),
    "a": SignalType("1", 1.0, "boolean", ""),
}


def test_a_formula_knows_its_text_names_and_reach() -> None:
    where = SourceLocation("concept.yaml", 3, 1)
    formula = parse_formula("always (a implies eventually[0 s, 2 s] gap > 2 m)", where)
    assert (formula.names, formula.reach_s, formula.where) == (("a", "gap"), 2.0, where)
    with pytest.raises(dataclasses.FrozenInstanceError):
        formula.text = "a"  # type: ignore[misc]


def test_equal_texts_give_equal_formulas() -> None:
    assert parse_formula("always gap > 2 m") == parse_formula("always gap > 2 m")


def test_a_quote_is_on_one_line() -> None:
    formula = parse_formula("always (gap\n   > 2 m)")
    assert formula.quote(formula.root) == "always (gap > 2 m)"


def test_check_passes_or_refuses_with_the_place() -> None:
    where = SourceLocation("concept.yaml", 3, 1)
    parse_formula("always (a implies gap > 2 m)").check(DICTIONARY)
    with pytest.raises(ExpressionError, match=r"concept\.yaml:3:1"):
        parse_formula("always gapp > 2 m", where).check(DICTIONARY)


def test_looking_back_from_the_first_row_only_is_refused() -> None:
    for text in ("once(a)", "not (b and historically[0 s, 1 s](a))", "previous(a)"):
        caught = refused(
            ExpressionError, parse_formula, text, says="look back from the first row only"
        )
        assert "always(" in caught.remedy


def test_formulas_with_other_values_of_a_parameter_are_not_taken_for_one_another() -> None:
    def judged(limit: float) -> float:
        formula = parse_formula("always(gap > limit)", parameters={"limit": (limit, (1, 0, 0))})
        series = {"gap": numbers([5.0, 4.0], unit="m")}
        low, _ = evaluate_rows(
            formula,
            Signals(series),
            step_s=1.0,
            length=np.array([2]),
            horizon=np.array([1]),
            complete=np.array([True]),
        )
        return float(low[0, 0])

    assert (judged(1.0), judged(3.0)) == (3.0, 1.0)


DICTIONARY_OF_CHECK = {
    **scene_signals(("cutter",), 3),
    **architecture_signals(("camera",), ("nominal", "safety"), ("aeb",), ("out",), ("cutter",)),
    "ttc": SignalType("s", 1.0, "number", "time to collision", cap=10.0),
    "tit": SignalType("s²", 1.0, "number", "time integrated"),
    "force": SignalType("kN", 1.0, "number", "of an unknown unit"),
}


def check(text: str) -> None:
    parse_formula(text).check(DICTIONARY_OF_CHECK)


@pytest.mark.parametrize("text", TABLES["what fits the dictionary passes"])
def test_what_fits_the_dictionary_passes(text: str) -> None:
    check(text)


def test_what_does_not_fit_is_refused_with_a_suggestion() -> None:
    for text, column, what, remedy in TABLES["what does not fit is refused with a suggestion"]:
        caught = refused(ExpressionError, check, text)
        assert f"character {column}: " in caught.message
        assert what in caught.message
        assert remedy in caught.remedy


def test_units_of_signals_are_read_with_their_powers() -> None:
    assert unit_exponents("m/s²") == (1, -2, 0)
    assert unit_exponents("s²") == unit_exponents("s^2") == (0, 2, 0)
    assert unit_exponents("m³") == (3, 0, 0)
    assert unit_exponents("") == unit_exponents("1") == (0, 0, 0)
    assert unit_exponents("kg") is None
    assert unit_exponents("kg²") is None


# --- What can be read off a tree: signals, how far it looks, and its canonical text ---------------


def test_names_come_once_each_in_the_order_of_the_text() -> None:
    root = parse_with({}, "always (b > a and rise(c.d) implies (b < 2) until[0, 1] (e == on))")[0]
    assert syntax.names_in(root) == ("b", "a", "c.d", "e")


def test_a_label_is_no_name_but_a_dotted_word_is() -> None:
    assert syntax.names_in(parse_with({}, "switch.reason == staleness")[0]) == ("switch.reason",)
    assert syntax.names_in(parse_with({}, "a.status != b.status")[0]) == ("a.status", "b.status")


@pytest.mark.parametrize(
    ("text", "reach"), TABLES["reach is the sum of nested windows below the outermost operator"]
)
def test_reach_is_the_sum_of_nested_windows_below_the_outermost_operator(
    text: str, reach: float
) -> None:
    assert syntax.future_reach(parse_with({}, text)[0]) == reach


def test_needed_time_counts_the_horizon_only_for_outermost_operators() -> None:
    for text, time in (
        ("always (a implies eventually[0, 2] b)", 12.0),
        ("always[0, 3] a", 3.0),
        ("(always eventually[0, 1] a) and (eventually[0, 14] b)", 14.0),
        ("x > 1", 0.0),
        ("rise(eventually[0, 1] a)", 1.0),
        ("a until eventually[0, 1] b", 11.0),
        ("always(once[2, 4](eventually[0, 3] a))", 11.0),
        ("always(once[4, 4](eventually[0, 3] a))", 10.0),
        ("always(historically(eventually[0, 3] a))", 13.0),
        ("always(previous(eventually[0, 3] a))", 13.0),
        # What has to hold since is read up to the row itself, whatever the window.
        ("always((eventually[0, 3] a) since[2, 4] b)", 13.0),
        ("always(a since[2, 4] (eventually[0, 3] b))", 11.0),
    ):
        assert syntax.needed_time(parse_with({}, text)[0], 10.0) == time


@pytest.mark.parametrize(
    ("first_s", "last_s", "step_s", "rows"), TABLES["a window has the rows that lie inside it"]
)
def test_a_window_has_the_rows_that_lie_inside_it(
    first_s: float, last_s: float, step_s: float, rows: list[int]
) -> None:
    assert syntax.window_rows(syntax.Window(first_s, last_s), step_s) == tuple(rows)


def test_a_window_between_two_rows_is_refused() -> None:
    with pytest.raises(ExpressionError, match="contains no row"):
        syntax.window_rows(syntax.Window(0.11, 0.14), 0.05)


def test_implications_count_at_the_top_and_under_one_always_only() -> None:
    root = parse_with({}, "always ((p implies (q implies r)) and (s implies t)) and (u implies v)")[
        0
    ]
    found = [(len(parts), isinstance(operator, syntax.Temporal)) for parts, operator in
             syntax.find_implications(root)]  # fmt: skip
    assert found == [(2, True), (1, True), (1, False)]
    nested = parse_with({}, "always (eventually (p implies q) or (r implies s))")[0]
    assert list(syntax.find_implications(nested)) == []


@pytest.mark.parametrize(
    ("text", "channels"), TABLES["formula is about the channels whose silence implies something"]
)
def test_formula_is_about_the_channels_whose_silence_implies_something(
    text: str, channels: list[str]
) -> None:
    assert syntax.silence_of(parse_with({}, text)[0]) == tuple(channels)


SAME = [
    ("always(gap>=1 m)", "always ( ( gap )\n >= 100 cm )"),
    ("always(gap >= 0.1 m)", "always(gap >= 10 cm)"),
    ("always[0 s, 0.3 s](contact)", "always[0 ms,300 ms] contact"),
    ("always(ego.speed <= 10 m/s)", "always(ego.speed <= 36 km/h)"),
    ("always(a or b and c)", "always(a or (b and c))"),
    ("always(1 m < gap < 2 m)", "always(1 m < gap and gap < 2 m)"),
    ("always(gap > -0 m)", "always(gap > 0 m)"),
    ("always(gap > 1e3 m)", "always(gap > 1 km)"),
]


@pytest.mark.parametrize(("one", "other"), SAME)
def test_spellings_of_one_formula_are_equal(one: str, other: str) -> None:
    assert syntax.canonical(parse_formula(one).root) == syntax.canonical(parse_formula(other).root)


def test_formulas_that_ask_for_something_else_differ() -> None:
    texts = [
        *("always(gap > 1 m)", "always(gap >= 1 m)", "always(gap < 1 m)", "eventually(gap > 1 m)"),
        *("always(gap > 1.0000000000000002 m)", "always(gap > 1 s)", "always(gap > -1 m)"),
        *("always[0 s, 1 s](gap > 1 m)", "always[0 s, 2 s](gap > 1 m)", "always(1 m > gap)"),
        *("always(abs(gap) > 1 m)", "always(-gap > 1 m)", "always(gap + x > 1 m)"),
        *("always(gap - x > 1 m)", "always(x - gap > 1 m)", "always(min(gap, x) > 1 m)"),
        *("always(mode == on)", "always(mode != on)", "always(a)", "always(not a)"),
        *("always(a and b or c)", "always(a and (b or c))", "always(a implies b)", "a until b"),
        *("always(a since b)", "always(once a)", "always(historically a)", "always(previous(a))"),
        *("always(rise(a))", "always(fall(a))", "always(once[0 s, 1 s] a)", "b until a"),
    ]
    written = [syntax.canonical(parse_formula(text).root) for text in texts]
    for (one, left), (other, right) in itertools.combinations(zip(texts, written, strict=True), 2):
        assert left != right, (one, other)


def test_longest_formula_has_a_canonical_text() -> None:
    text = "always(" + " and ".join(["a"] * 195) + ")"
    assert syntax.canonical(parse_formula(text).root).count("(and ") == 194
