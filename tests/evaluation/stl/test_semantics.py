"""Interval semantics: laws of the operators, unknown rows, windows in rows."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.errors import ExpressionError
from adeye.evaluation.stl.parser import parse_text
from adeye.evaluation.stl.semantics import (
    HIGH,
    LOW,
    UNKNOWN,
    Batch,
    Semantics,
    implication,
    negate,
    window_rows,
)
from adeye.evaluation.stl.series import Series
from adeye.evaluation.stl.syntax import Window

ROWS = 12


def batch(*, complete: bool = False) -> Batch:
    bits = np.random.default_rng(5)
    inputs = {name: Series(bits.normal(size=(3, ROWS)), 1.0, "1", "number") for name in "ab"}
    return Batch(
        inputs,
        0.5,
        length=np.array([ROWS, 7, 1]),
        horizon=np.array([8, 8, 8]),
        is_complete=np.full(3, complete),
        rows=ROWS,
    )


def states(text: str) -> np.ndarray:
    return Semantics(batch()).at_every_row(parse_text(text))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("not (a > 0 and b > 0)", "not a > 0 or not b > 0"),
        ("a > 0 implies b > 0", "not a > 0 or b > 0"),
        ("not always[0, 2] a > 0", "eventually[0, 2] not a > 0"),
        ("not always a > 0", "eventually not a > 0"),
        ("always[0, 1] always[0.5, 1] a > 0", "always[0.5, 2] a > 0"),
        ("eventually[0.5, 1] a > 0", "(a > -1 or a <= -1) until[0.5, 1] a > 0"),
        ("fall(a > 0)", "rise(not a > 0)"),
        ("not not a > 0", "a > 0"),
    ],
)
def test_equivalent_formulas_have_equal_truth(one: str, other: str) -> None:
    # Robustness may differ: a tautology such as x or not x has a finite one.
    assert np.array_equal(states(one)[2:], states(other)[2:])


@pytest.mark.parametrize(
    "text", ["a > 0", "always[0, 1] a > 0", "a > 0 until b > 0", "rise(a > 0)", "fall(b > 0)"]
)
def test_rows_beyond_a_run_are_unknown_for_every_operator(text: str) -> None:
    state = states(text)
    assert np.array_equal(state[:, 1, 7:], np.tile(UNKNOWN[:, None], (1, ROWS - 7)))
    assert np.all(state[LOW] <= state[HIGH])
    assert np.all(state[2] <= state[3])


def test_negation_is_its_own_inverse_and_swaps_the_bounds() -> None:
    state = states("always[0, 2] a > 0")
    assert np.array_equal(negate(negate(state)), state)
    assert np.array_equal(negate(state)[LOW], -state[HIGH])
    assert np.array_equal(implication(state, state), np.maximum(negate(state), state))


def test_an_edge_is_false_at_row_0() -> None:
    assert states("rise(a > -100)")[:, 0, 0].tolist() == [-1.0] * 4
    assert states("fall(a > 100)")[:, 0, 0].tolist() == [-1.0] * 4


def test_an_outermost_always_is_open_where_the_trace_was_cut_short() -> None:
    root = parse_text("always a > -100")
    cut = Semantics(batch()).at_start(root)
    assert np.isneginf(cut[LOW]).tolist() == [False, True, True]
    over = Semantics(batch(complete=True)).at_start(root)
    assert np.array_equal(over[LOW], over[HIGH])


def test_only_what_is_asked_for_is_remembered() -> None:
    root = parse_text("always a > 0")
    forgetful, mindful = Semantics(batch(), frozenset()), Semantics(batch())
    assert forgetful.at_every_row(root) is not forgetful.at_every_row(root)
    assert mindful.at_every_row(root) is mindful.at_every_row(root)


def test_conditions_hold_together_at_one_row_or_not_at_all() -> None:
    ramp = Series(np.arange(4.0)[None, :], 1.0, "1", "number")
    one = Batch({"a": ramp}, 1.0, np.array([4]), np.array([3]), np.array([True]), rows=4)
    early, late = parse_text("a < 1"), parse_text("a > 2")
    semantics = Semantics(one)
    assert semantics.held((early,), 0, np.array([3])).tolist() == [True]
    assert semantics.held((early,), 1, np.array([3])).tolist() == [False]
    assert semantics.held((late,), 0, np.array([2])).tolist() == [False]
    assert semantics.held((early, late), 0, np.array([3])).tolist() == [False]


@pytest.mark.parametrize(
    ("first_s", "last_s", "step_s", "rows"),
    [
        (0.0, 2.0, 0.05, (0, 40)),
        (0.0, 0.3, 0.1, (0, 3)),
        (0.3, 0.7, 0.1, (3, 7)),
        (0.05, 0.12, 0.05, (1, 2)),
        (0.0, 0.0, 0.05, (0, 0)),
    ],
)
def test_a_window_has_the_rows_that_lie_inside_it(
    first_s: float, last_s: float, step_s: float, rows: tuple[int, int]
) -> None:
    assert window_rows(Window(first_s, last_s), step_s) == rows


def test_a_window_between_two_rows_is_refused() -> None:
    with pytest.raises(ExpressionError, match="contains no row"):
        window_rows(Window(0.11, 0.14), 0.05)
