"""Operators: laws of truth and of bounds, and what lies beyond a trace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.judge.stl.batch import judge, numbers, standing

if TYPE_CHECKING:
    from adeye.judge.stl.batch import StlColumns
    from adeye.judge.stl.series import Series

ROWS = 12
LENGTHS = [ROWS, 7, 1, 4]


def signals() -> dict[str, Series]:
    bits = np.random.default_rng(5)
    return {name: numbers(bits.normal(size=(len(LENGTHS), ROWS))) for name in "ab"}


def at_row(text: str, row: int) -> StlColumns:
    """Judge a condition at one row of runs that were cut short."""
    horizon = [ROWS - 1] * len(LENGTHS)
    window = f"eventually[{0.5 * row}, {0.5 * row}] ({text})"
    return judge(window, signals(), step_s=0.5, length=LENGTHS, horizon=horizon, complete=False)


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
def test_equivalent_conditions_hold_at_the_same_rows(one: str, other: str) -> None:
    # Robustness may differ: a tautology such as x or not x has a finite one.
    for row in range(ROWS):
        assert np.array_equal(at_row(one, row).verdict, at_row(other, row).verdict), row


@pytest.mark.parametrize(
    "text", ["a > 0", "always[0, 1] a > 0", "a > 0 until b > 0", "rise(a > 0)", "fall(b > 0)"]
)
def test_rows_beyond_a_run_are_unknown_for_every_operator(text: str) -> None:
    for row in range(ROWS):
        result = at_row(text, row)
        assert (result.robustness_low <= result.robustness_high).all()
        beyond = row >= np.array(LENGTHS)
        assert (result.robustness_low[beyond] == -np.inf).all()
        assert (result.robustness_high[beyond] == np.inf).all()
        assert not result.verdict[beyond].any()


@pytest.mark.parametrize("text", ["always[0, 2] a > 0", "a > 0 until[0, 2] b > 0", "rise(b > 0)"])
def test_negation_swaps_the_bounds_and_is_its_own_inverse(text: str) -> None:
    for row in range(ROWS):
        plain, negated = at_row(text, row), at_row(f"not ({text})", row)
        assert np.array_equal(negated.robustness_low, -plain.robustness_high)
        assert np.array_equal(negated.robustness_high, -plain.robustness_low)
        assert np.array_equal(negated.verdict, -plain.verdict)
        twice = at_row(f"not not ({text})", row)
        assert np.array_equal(twice.robustness_low, plain.robustness_low)


def test_an_edge_is_false_at_row_0_whatever_the_sample() -> None:
    for text in ("rise(a > -100)", "fall(a > 100)"):
        result = at_row(text, 0)
        assert result.robustness_low.tolist() == [-1.0] * len(LENGTHS)
        assert result.robustness_high.tolist() == [-1.0] * len(LENGTHS)


@pytest.mark.parametrize("text", ["always a > -100", "not eventually not a > -100"])
def test_an_outermost_operator_is_open_where_the_trace_was_cut_short(text: str) -> None:
    options: dict[str, Any] = {"length": LENGTHS, "horizon": [8] * len(LENGTHS)}
    cut = judge(text, signals(), complete=False, **options)
    assert np.isneginf(cut.robustness_low).tolist() == [False, True, True, True]
    over = judge(text, signals(), complete=True, **options)
    assert np.array_equal(over.robustness_low, over.robustness_high)


def test_an_implication_is_exercised_where_all_its_conditions_hold_at_one_row() -> None:
    ramp = {"a": numbers([0.0, 1.0, 2.0, 3.0]), "b": numbers([9.0] * 4)}

    def standing_of(text: str, horizon: int = 3) -> str:
        return standing(judge(text, ramp, horizon=[horizon]))

    assert standing_of("always (a < 1 implies b > 0)") == "satisfied"
    assert standing_of("always[1, 3] (a < 1 implies b > 0)") == "vacuous"
    assert standing_of("always (a > 2 implies b > 0)") == "satisfied"
    assert standing_of("always (a > 2 implies b > 0)", 2) == "vacuous"
    assert standing_of("always (a < 1 implies (a > 2 implies b > 0))") == "vacuous"
    assert standing_of("always (a < 2 implies (a > 0 implies b > 0))") == "satisfied"


def test_a_window_that_ends_with_the_trace_is_decided_by_it() -> None:
    ramp = {"a": numbers([0.0, 1.0, 2.0, 3.0])}
    options: dict[str, Any] = {"length": [4], "horizon": [0]}
    assert standing(judge("always[0, 3] a >= 0", ramp, **options)) == "satisfied"
    assert standing(judge("always[0, 4] a >= 0", ramp, **options)) == "undecided"
    assert standing(judge("always[0, 4] a >= 1", ramp, **options)) == "violated"
    assert standing(judge("eventually[0, 4] a >= 3", ramp, **options)) == "satisfied"
    assert standing(judge("eventually[0, 3] a > 3", ramp, **options)) == "violated"
