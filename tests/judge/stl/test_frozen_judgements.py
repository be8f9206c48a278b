"""Formulas of every kind on runs made by hand: verdict, robustness and what binds, pinned."""

from typing import Any

import numpy as np

from adeye.errors import AdeyeError
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.series import SampleStatus, Series
from tests.frozen import assert_frozen
from tests.judge.stl.batch import binding, judge, numbers, standing, truths, words

VALUE, NONE, ABSENT = SampleStatus.VALUE, SampleStatus.NO_CONFLICT, SampleStatus.NOT_APPLICABLE
ROWS = 9

SIGNALS: dict[str, Series] = {
    "a": numbers([[3.0, 2.0, 1.5, 0.5, -1.0, 0.0, 2.5, 4.0, 4.0], [1.0] * ROWS], unit="m"),
    "b": numbers(
        [[0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0, -1.0, -2.0], [2.0, 0.5] + [7.0] * 7],
        unit="m",
        scale=10.0,
    ),
    "n": numbers([[0, 1, 2, 3, 4, 5, 6, 7, 8], [5, 5, 5, 4, 4, 3, 3, 3, 3]]),
    "t": numbers(
        [[np.inf, np.inf, 4.0, 3.0, 2.0, 1.0, 3.0, np.inf, np.inf], [np.inf] * ROWS],
        unit="s",
        cap=10.0,
        status=np.array(
            [[NONE, NONE, VALUE, VALUE, VALUE, VALUE, VALUE, NONE, NONE], [ABSENT] * ROWS],
            dtype=np.int8,
        ),
        actor=np.array([[-1, -1, 0, 0, 1, 1, 0, -1, -1], [-1] * ROWS]),
    ),
    "p": truths([[0, 0, 1, 1, 0, 0, 1, 0, 0], [0] * ROWS]),
    "q": truths([[1, 0, 0, 1, 1, 0, 0, 0, 1], [1] * ROWS]),
    "s": words([[0, 0, 1, 1, 2, 2, 1, 0, 0], [2] * ROWS], "ok", "late", "dead"),
    "time": numbers([np.arange(ROWS, dtype=float)] * 2, unit="s", slack=1e-9),
}
FORMULAS = (
    "always(a > 0 m)", "always(a >= -1 m)", "eventually(a < 0 m)", "a > 2 m", "always(a <= 4 m)",
    "always(a - b < 3 m)", "always(abs(a - b) <= 6 m)", "always(2 * a + b > 0 m)",
    "always(min(a, b) >= -2 m)", "eventually(max(a, b, 3 m) > 3.5 m)", "always(a * n < 5 m)",
    "always(a / b < 4 or b <= 0 m)", "always(a / n < 3 m)", "always(-a < 1 m)",
    "always(n == 3)", "eventually(n == 8)", "always(n != 4)", "always(s != dead)",
    "eventually(s == late)", "always(p implies q)", "always(p implies eventually[0 s, 1 s] q)",
    "always(rise(p) implies eventually[1 s, 2 s] fall(p))", "always(p or q or a > 1 m)",
    "always(not (p and q))", "p until[0 s, 4 s] q", "q until[0 s, 3 s] (a < 2 m)",
    "always[1 s, 3 s](b >= 1 m)", "eventually[2 s, 5 s](a + b < 1 m)",
    "always(q since (p or n <= 1))", "always(once[0 s, 2 s](q) or p)",
    "always(previous(p) or a > -2 m)",
    "always(historically[0 s, 1 s](a > -0.5 m))", "always(q since[1 s, 3 s] p)",
    "always(t > 1.5 s)", "always(t >= 1 s)", "eventually(t < 2 s)", "always(t > 12 s or a < 9 m)",
    "always(time < 6 s or b < 0 m)", "always(p implies always[0 s, 6 s](t > 1 s))",
    "always(p implies (q implies a > 0 m))", "eventually(always[0 s, 2 s](b > 0 m))",
    "always(eventually[0 s, 3 s](p))", "always(0 m < a + 2 m <= 6 m)",
    "always((s == late) implies previous(s != dead))",
    "always(p == q)", "always(p == false or t < 5 s)",
)  # fmt: skip
EXTENTS: dict[str, dict[str, Any]] = {
    "whole": {},
    "horizon 4": {"horizon": [4, 4]},
    "cut at 6": {"length": [6, 5], "horizon": [5, 4], "complete": False},
}


def lines_of(text: str, extent: str) -> list[str]:
    try:
        result = judge(text, SIGNALS, **EXTENTS[extent])
    except AdeyeError as error:
        return [f"  {extent}: {error}"]
    lines = []
    for run in range(2):
        low, high = result.robustness_low[run], result.robustness_high[run]
        told = f"  {extent}, run {run}: {standing(result, run)} {low:.9g} to {high:.9g}"
        if not result.error[run]:
            bound = binding(result, run)
            told += (
                f", {bound.text} of {bound.signal} at {bound.row} for {bound.obligation}: "
                f"{bound.value} against {bound.threshold} [{bound.unit}], by {bound.difference}, "
                f"{bound.status} {bound.actor}"
            )
        lines.append(f"{told} {result.nested[run].tolist()}")
    return lines


def test_judgements_are_frozen() -> None:
    lines = []
    for text in FORMULAS:
        lines.append(text)
        for extent in EXTENTS:
            lines += lines_of(text, extent)
    assert_frozen("judgements.txt", "\n".join([*lines, ""]))


WRONG = (
    "", "a >", "a > 2 and", "always(a > 2 m", "a b", "a > 2 parsec", "always[2 s, 1 s](p)",
    "always[0 s, -1 s](p)", "p until q", "a == 2 m == p", "always(a)", "not 3",
    "min(a)", "abs(a, b)",
    "sin(a) > 2 m", "a > 2 m s", "2 > 3", "p implies", "(p and q", "always p and q",
    "always[0 m, 1 m] p", "eventually[0 s, 1 s", "a > {limit}", "p & q", "a >> 2", "rise p",
    "previous[0 s, 1 s](p)", "x" * 300, "((((((((((p))))))))))", "a > 1e400 m", "a ** 2 > 3 m",
    "true", "p == true == q", "'p'", "since p", "once[1 s, 0 s] p", "a > 2m and b<3.5e0 km",
)  # fmt: skip


def test_what_is_wrong_with_a_text_is_frozen() -> None:
    lines = []
    for text in WRONG:
        try:
            formula = parse_formula(text)
            told = f"{formula.names} {formula.quote(formula.root)}"
        except AdeyeError as error:
            told = str(error)
        lines.append(f"{text[:60]!r}: {told}")
    assert_frozen("formula_errors.txt", "\n".join([*lines, ""]))
