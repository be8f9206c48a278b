"""Parts of a formula that no signal decides."""

from __future__ import annotations

import pytest

from adeye.judge.stl.constancy import first_constant
from adeye.judge.stl.formula import parse_formula


@pytest.mark.parametrize(
    ("text", "part", "held"),
    [
        ("always(time >= 0 s)", "time >= 0 s", True),
        ("not eventually(time < 0 s)", "time < 0 s", False),
        ("always(v <= v)", "v <= v", True),
        ("always(v > v)", "v > v", False),
        ("always(v - v <= 0 m/s)", "v - v <= 0 m/s", True),
        ("always(abs(a) >= 0 m/s^2)", "abs(a) >= 0 m/s^2", True),
        ("always(abs(n) != -1)", "abs(n) != -1", True),
        ("always(max(v, 0 m/s) >= 0 m/s)", "max(v, 0 m/s) >= 0 m/s", True),
        ("always(min(v, 1 m/s) < 2 m/s)", "min(v, 1 m/s) < 2 m/s", True),
        ("always(n * n >= 0)", "n * n >= 0", True),
        ("always(0 * v + time >= 0)", "0 * v + time >= 0", True),
        ("always(1 s / (time + 1 s) >= 0)", "1 s / (time + 1 s) >= 0", True),
        ("always(-abs(v) <= 0 m/s)", "-abs(v) <= 0 m/s", True),
        ("always(d <= 1e308 m)", "d <= 1e308 m", True),
        ("always(ch.age <= 1e9 s)", "ch.age <= 1e9 s", True),
        ("always(v >= -1e9 m/s)", "v >= -1e9 m/s", True),
        ("always(d < -1e308 m)", "d < -1e308 m", False),
        ("always(ch.x == ch.x)", "ch.x == ch.x", True),
        ("always(p or not p)", "p or not p", True),
        ("always(p or q or p == false)", "p or q or p == false", True),
        ("always((p and q) implies p)", "(p and q) implies p", True),
        ("always(p implies p)", "p implies p", True),
        ("always(v < 5 m/s or v >= 5 m/s)", "v < 5 m/s or v >= 5 m/s", True),
        ("always((time >= 1 s and time < 1 s) implies p)", "time >= 1 s and time < 1 s", False),
        ("always(q implies (rise(p) or not rise(p)))", "rise(p) or not rise(p)", True),
    ],
)
def test_what_no_signal_decides_is_found(text: str, part: str, *, held: bool) -> None:
    formula = parse_formula(text)
    found = first_constant(formula.root)
    assert found is not None
    assert formula.quote(found[0]).strip("()") == part.strip("()")
    assert found[1] is held


@pytest.mark.parametrize(
    "text",
    [
        "always(time > 0 s)",
        "always(time <= 1e5 s)",
        "eventually(time >= 1 s)",
        "always(v <= w)",
        "always(abs(v) > 0 m/s)",
        "always(abs(v) <= 3 m/s)",
        "always(abs(v) - abs(v - w) >= 0 m/s)",
        "always(max(v, 0 m/s) > 0 m/s)",
        "always(min(v, w) >= 0 m/s)",
        "always(n * k >= 0)",
        "always(n * n > 0)",
        "always(v / w >= 0)",
        "always(v / v >= 0)",
        "always(0 * v + time > 0)",
        "always(v >= -1e5 m/s)",
        "always(n != 1)",
        "always(p == q)",
        "always(p or not q)",
        "always(p implies (p and q))",
        "always(v < 5 m/s or v > 5 m/s)",
        "always(v <= 5 m/s and v >= 5 m/s)",
        "always(s == ok or s != degraded)",
        "always(p or not previous(p))",
        "always(rise(p) implies eventually[0 s, 1 s] p)",
    ],
)
def test_what_some_value_decides_is_not_found(text: str) -> None:
    assert first_constant(parse_formula(text).root) is None
