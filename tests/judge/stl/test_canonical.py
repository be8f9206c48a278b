"""The canonical text of a formula: equal for spellings, different for what differs."""

from __future__ import annotations

import itertools

import pytest

from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.syntax import canonical

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
