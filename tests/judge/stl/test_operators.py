"""Operators, ahead and back: laws of truth and of bounds, windows, what lies beyond a trace."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.batch import StlColumns
from adeye.judge.stl.measures import EXACT, OPEN, SIGN
from adeye.judge.stl.operators import Sliding, slide, sliding_maximum
from adeye.judge.stl.program import State
from adeye.judge.stl.series import Series
from tests.judge.stl.batch import binding, judge, numbers, standing, truths
from tests.stored import stored

TABLES = stored("formulas")


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


@pytest.mark.parametrize(("one", "other"), TABLES["equivalent conditions hold at the same rows"])
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


GAP = numbers([9.0, 5.0, 3.0, 4.0, 8.0], unit="m")


def test_binding_predicate_is_found_behind_an_operator_that_looks_back() -> None:
    for text, row, value in (
        # Violated: the one sample that would have had to be otherwise.
        ("always(gap < 7 m implies historically[0 s, 2 s](gap > 4 m))", 2, 3.0),
        ("always(gap < 4 m implies once[1 s, 1 s](gap > 6 m))", 1, 5.0),
        ("always[1 s, 4 s](gap > 4.5 m implies previous(gap > 6 m))", 3, 4.0),
        ("eventually(gap > 7 m and once(gap > 10 m))", 0, 9.0),
        ("always(gap > 7 m implies ((gap > 3.5 m) since (gap > 8.6 m)))", 2, 3.0),
    ):
        result = judge(text, {"gap": GAP})
        assert standing(result) == "violated", text
        found = binding(result)
        assert (found.row, found.value, found.signal) == (row, value, "gap"), text
        assert found.difference is not None, text
        assert found.difference == pytest.approx(result.robustness_low[0]), text


def test_since_of_several_that_decide_alike_is_explained_by_the_latest() -> None:
    result = judge("always[4 s, 4 s]((a > 0) since (b > 0))", {
        "a": numbers([1.0] * 5), "b": numbers([0.5, 0.5, 0.5, 0.5, -1.0]),
    })  # fmt: skip
    assert standing(result) == "satisfied"
    assert binding(result).row == 3


def test_nothing_before_the_first_row_is_named_as_such() -> None:
    result = judge("always(once[2 s, 3 s](gap > 0 m))", {"gap": GAP})
    assert standing(result) == "violated"
    assert result.robustness_low[0] == result.robustness_high[0] == -np.inf
    found = binding(result)
    assert (found.text, found.row, found.status) == ("once[2 s, 3 s](gap > 0 m)", 0, "before_trace")
    assert found.value is None
    assert (
        standing(judge("always(historically[9 s, 9 s](gap > 99 m))", {"gap": GAP})) == "satisfied"
    )


def test_an_implication_whose_past_never_was_is_vacuous() -> None:
    signals = {"gap": GAP, "brake": truths([0, 0, 0, 0, 1])}
    assert standing(judge("always(once[1 s, 2 s](brake) implies gap > 99 m)", signals)) == "vacuous"
    assert standing(judge("always(once(brake) implies gap > 7 m)", signals)) == "satisfied"


def test_a_trace_that_was_cut_leaves_no_past_open() -> None:
    result = judge(
        "always(historically(gap > 2 m))", {"gap": GAP}, length=[4], horizon=[3], complete=False
    )
    assert result.robustness_low[0] == result.robustness_high[0] == 1.0


ROWS_OF_WINDOW, KNOWN = 40, 33


def slid(level: int, state: Any, truth: Any, first: int, last: int, *, always: bool) -> Any:
    """Slide over condition 0 to condition 1."""
    rows = ROWS_OF_WINDOW
    bounds, sign = np.zeros((2, 2, rows)), np.zeros((2, 2, rows), dtype=np.int8)
    bounds[0], sign[0] = state, truth
    exact = np.array([level, OPEN], dtype=np.int8)
    scratch, queue = np.zeros((3, rows)), np.zeros(rows, dtype=np.int64)
    no_terms = np.zeros((0, rows)), np.zeros((0, rows), dtype=np.int8)
    of_run = State(*no_terms, bounds, sign, np.zeros((2, 4)), exact, scratch, queue)
    slide(1, 0, Sliding(always, KNOWN, first, last), of_run)
    return bounds[1, :, :KNOWN], sign[1, :, :KNOWN]


@pytest.mark.slow
@pytest.mark.parametrize("window", [(0, 0), (0, 5), (2, 9), (0, 32), (3, 60), (35, 50)])
@pytest.mark.parametrize("is_last_open", [False, True])
@pytest.mark.parametrize("always", [False, True])
@pytest.mark.parametrize("level", [EXACT, SIGN])
def test_what_is_known_beforehand_changes_nothing(
    window: tuple[int, int], *, is_last_open: bool, always: bool, level: int
) -> None:
    bits = np.random.default_rng(3)
    for share in (0.0, 0.1, 0.5, 0.9, 1.0):
        truth = np.tile(np.where(bits.uniform(size=ROWS_OF_WINDOW) < share, 1, -1), (2, 1)).astype(
            np.int8
        )
        state = truth * (1.0 if level == SIGN else bits.uniform(0.1, 3.0, ROWS_OF_WINDOW))
        if is_last_open:
            state[:, KNOWN - 1], truth[:, KNOWN - 1] = (-np.inf, np.inf), (-1, 1)
        found, sign = slid(level, state, truth, *window, always=always)
        expected, expected_sign = slid(OPEN, state, truth, *window, always=always)
        np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(sign, expected_sign)


def test_last_row_that_is_half_open_is_looked_at() -> None:
    truth = np.full((2, ROWS_OF_WINDOW), -1, dtype=np.int8)
    state = np.full((2, ROWS_OF_WINDOW), -1.0)
    state[0, KNOWN - 1] = -np.inf
    found, _ = slid(SIGN, state, truth, 0, 0, always=False)
    assert found[:, KNOWN - 1].tolist() == [-np.inf, -1.0]


INF = float("inf")


@pytest.mark.parametrize("beyond", [-INF, INF, -1.0])
@pytest.mark.parametrize(("first", "last"), [(0, 0), (0, 3), (2, 2), (1, 6), (9, 12), (0, 40)])
def test_sliding_maximum_is_the_maximum_of_every_window(
    first: int, last: int, beyond: float
) -> None:
    bits = np.random.default_rng(1)
    for length in (1, 2, 7, 12):
        # Small whole numbers, so that equal neighbours occur.
        values = bits.integers(-2, 3, size=12).astype(float)
        out = np.full(12, np.nan)
        queue = np.empty(12, dtype=np.int64)
        sliding_maximum(values, length, first, last, beyond, queue, out)
        padded = np.concatenate([values[:length], np.full(60, beyond)])
        expected = [padded[k + first : k + last + 1].max() for k in range(length)]
        assert out.tolist() == expected + [beyond] * (12 - length)
