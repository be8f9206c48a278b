"""What can be read off a tree: signals, how far it looks, and its canonical text."""

from __future__ import annotations

import itertools

import pytest

from adeye.errors import ExpressionError
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.parser import parse_text
from adeye.judge.stl.syntax import (
    Temporal,
    Window,
    canonical,
    find_implications,
    future_reach,
    names_in,
    needed_time,
    silence_of,
    window_rows,
)
from tests.stored import stored

TABLES = stored("formulas")


def test_names_come_once_each_in_the_order_of_the_text() -> None:
    root = parse_text("always (b > a and rise(c.d) implies (b < 2) until[0, 1] (e == on))")
    assert names_in(root) == ("b", "a", "c.d", "e")


def test_a_label_is_no_name_but_a_dotted_word_is() -> None:
    assert names_in(parse_text("switch.reason == staleness")) == ("switch.reason",)
    assert names_in(parse_text("a.status != b.status")) == ("a.status", "b.status")


@pytest.mark.parametrize(
    ("text", "reach"), TABLES["reach is the sum of nested windows below the outermost operator"]
)
def test_reach_is_the_sum_of_nested_windows_below_the_outermost_operator(
    text: str, reach: float
) -> None:
    assert future_reach(parse_text(text)) == reach


@pytest.mark.parametrize(
    ("text", "time"),
    [
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
    ],
)
def test_needed_time_counts_the_horizon_only_for_outermost_operators(
    text: str, time: float
) -> None:
    assert needed_time(parse_text(text), 10.0) == time


@pytest.mark.parametrize(
    ("first_s", "last_s", "step_s", "rows"), TABLES["a window has the rows that lie inside it"]
)
def test_a_window_has_the_rows_that_lie_inside_it(
    first_s: float, last_s: float, step_s: float, rows: list[int]
) -> None:
    assert window_rows(Window(first_s, last_s), step_s) == tuple(rows)


def test_a_window_between_two_rows_is_refused() -> None:
    with pytest.raises(ExpressionError, match="contains no row"):
        window_rows(Window(0.11, 0.14), 0.05)


def test_implications_count_at_the_top_and_under_one_always_only() -> None:
    root = parse_text("always ((p implies (q implies r)) and (s implies t)) and (u implies v)")
    found = [(len(parts), isinstance(operator, Temporal)) for parts, operator in
             find_implications(root)]  # fmt: skip
    assert found == [(2, True), (1, True), (1, False)]
    nested = parse_text("always (eventually (p implies q) or (r implies s))")
    assert list(find_implications(nested)) == []


@pytest.mark.parametrize(
    ("text", "channels"), TABLES["formula is about the channels whose silence implies something"]
)
def test_formula_is_about_the_channels_whose_silence_implies_something(
    text: str, channels: list[str]
) -> None:
    assert silence_of(parse_text(text)) == tuple(channels)


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
    assert canonical(parse_formula(one).root) == canonical(parse_formula(other).root)


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
    written = [canonical(parse_formula(text).root) for text in texts]
    for (one, left), (other, right) in itertools.combinations(zip(texts, written, strict=True), 2):
        assert left != right, (one, other)


def test_longest_formula_has_a_canonical_text() -> None:
    text = "always(" + " and ".join(["a"] * 195) + ")"
    assert canonical(parse_formula(text).root).count("(and ") == 194
