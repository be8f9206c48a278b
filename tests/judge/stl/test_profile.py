"""Robustness at every row: against rtamt, and the laws that it keeps."""

import time
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.judge.stl.batch import evaluate_rows
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.series import Series
from tests.judge.stl.batch import Signals, judge, numbers
from tests.judge.stl.random_formulas import Random, text_of, traces

ROWS, BATCH = 40, 4


def at_rows(
    text: str, signals: dict[str, Series], *, horizon: int | None = None, length: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    runs, rows = next(iter(signals.values())).values.shape
    known = length or rows
    last = known - 1 if horizon is None else horizon
    return evaluate_rows(
        parse_formula(text),
        Signals(signals),
        step_s=1.0,
        length=np.full(runs, known),
        horizon=np.full(runs, last),
        complete=np.full(runs, last < known),
    )


# --- rtamt


def rtamt_rows(text: str, signals: dict[str, Series]) -> np.ndarray:
    """Evaluate a formula at every row with rtamt, (B, T)."""
    rtamt = pytest.importorskip("rtamt")
    peer = rtamt.StlDiscreteTimeSpecification()
    for name in signals:
        peer.declare_var(name, "float")
    peer.set_sampling_period(1, "s", 0.1)
    peer.spec = text
    peer.parse()
    runs, rows = next(iter(signals.values())).values.shape
    found = []
    for run in range(runs):
        data = {name: series.values[run].tolist() for name, series in signals.items()}
        found.append([value for _, value in peer.evaluate({"time": list(range(rows)), **data})])
    return np.array(found)


def bodies(random: Random, count: int) -> Iterable[tuple[str, str, int]]:
    """Write formulas for adeye and for rtamt, with the rows that they look ahead."""
    for number in range(count):
        if number % 3:
            body = random.formula(3, past=True)
            outermost = random.pick(
                "always[0{}3]({})", "eventually[2{}5]({})", "not always[0{}0]({})"
            )
        else:
            # Without a window rtamt takes the end of the trace for the end of time: what it
            # encloses must not look beyond.
            body = random.formula(3, past=True, ahead=False)
            outermost = random.pick("always({1})", "eventually({1})", "({1} until c > 0.9)")
        mine = outermost.format(",", text_of(body, ","))
        reach = parse_formula(mine).reach_s
        yield mine, outermost.format(":", of_rtamt(body)), int(reach)


def of_rtamt(node: tuple[Any, ...]) -> str:
    """Write a formula for rtamt: its ``prev`` is true at the first row, ``previous`` false."""
    kind, *parts = node
    if kind == "previous":
        return f"not(prev(not({of_rtamt(parts[0])})))"
    if kind in {"always", "eventually", "once", "historically"}:
        window, operand = parts
        rows = "" if window is None else f"[{window[0]}:{window[1]}]"
        return f"{kind}{rows}({of_rtamt(operand)})"
    if kind in {"until", "since"}:
        window, left, right = parts
        rows = "" if window is None else f"[{window[0]}:{window[1]}]"
        return f"({of_rtamt(left)} {kind}{rows} {of_rtamt(right)})"
    if kind in {"and", "or", "implies"}:
        return f"({of_rtamt(parts[0])} {kind} {of_rtamt(parts[1])})"
    return f"not({of_rtamt(parts[0])})" if kind == "not" else text_of(node, ":")


def compare_with_rtamt(seed: int, count: int) -> int:
    """Compare formulas on 4 traces each at every row whose window lies in the trace."""
    random = Random(seed)
    compared = 0
    for mine, peer, reach in bodies(random, count):
        signals = traces(random, BATCH, ROWS)
        low, high = at_rows(mine, signals)
        whole = slice(0, ROWS - reach)
        expected = rtamt_rows(peer, signals)[:, whole]
        np.testing.assert_allclose(low[:, whole], expected, rtol=0.0, atol=1e-9, err_msg=mine)
        np.testing.assert_allclose(high[:, whole], expected, rtol=0.0, atol=1e-9, err_msg=mine)
        compared += BATCH
    return compared


@pytest.mark.slow
def test_robustness_agrees_with_rtamt_at_every_row() -> None:
    """1,080 pairs of a formula and a trace: past and future, with and without windows, arithmetic.

    Where rtamt (offline, discrete time) differs, on purpose:

    - At the end of a trace rtamt cuts windows off, or answers infinity; a window that reaches
      beyond the trace is open here, with an interval (compared are rows whose window is whole).
    - ``prev`` of rtamt is true at the first row; ``previous`` is false there, as ``once`` is.
    - ``rise`` and ``fall`` of rtamt can be true at the first row, here never: nothing changed.
    - An operator without a window below another one ends with the trace in rtamt; here it is open
      at the end, and an FSR with one is refused.
    - A robustness of 0 leaves truth open in rtamt; here the comparison decides (< or <=).
    - rtamt lets NaN through comparisons; here the run is an error.
    - rtamt does not scale; here each predicate is divided by its signal's scale (1 in a table).
    """
    assert sum(compare_with_rtamt(seed, 90) for seed in range(3)) >= 1_000


@pytest.mark.slow
def test_robustness_agrees_with_rtamt_on_many_pairs() -> None:
    assert sum(compare_with_rtamt(100 + seed, 250) for seed in range(10)) >= 10_000


def test_the_known_differences_from_rtamt() -> None:
    for mine, peer, row, here, there in (
        ("eventually[0,2](a > 5)", "eventually[0:2](a > 5)", 3, (-1.0, np.inf), -1.0),
        ("always[5,6](a > 0)", "always[5:6](a > 0)", 0, (-np.inf, np.inf), np.inf),
        ("always[0,0](previous(a > 0))", "prev(a > 0)", 0, (-np.inf, -np.inf), np.inf),
        ("rise(a > 0)", "rise(a > 0)", 0, (-1.0, -1.0), 1.0),
        ("always[0,0](eventually(a > 5))", "eventually(a > 5)", 0, (-1.0, np.inf), -1.0),
    ):
        signals = {"a": numbers([1.0, 2.0, 3.0, 4.0])}
        low, high = at_rows(mine, signals)
        assert (low[0, row], high[0, row]) == here, mine
        assert rtamt_rows(peer, signals)[0, row] == there, mine


# --- laws


def random_formulas(seed: int, count: int = 40) -> Iterable[tuple[str, dict[str, Series]]]:
    random = Random(seed)
    for _ in range(count):
        yield text_of(random.formula(3, past=True, edges=True), ","), traces(random, BATCH, ROWS)


@pytest.mark.slow
def test_the_first_row_is_what_the_formula_is_on_the_run() -> None:
    for text, signals in random_formulas(11):
        for outermost in ("always({})", "not eventually({})", "({} until a > 1) or b > 1"):
            whole = outermost.format(f"always[0,0]({text})")
            for horizon in (ROWS - 1, 10, ROWS + 4):
                low, high = at_rows(whole, signals, horizon=horizon)
                result = judge(whole, signals, horizon=[horizon] * BATCH, complete=horizon < ROWS)
                assert np.array_equal(low[:, 0], result.robustness_low), whole
                assert np.array_equal(high[:, 0], result.robustness_high), whole


def test_a_row_behind_the_horizon_has_no_robustness() -> None:
    low, high = at_rows("always(a > 0)", {"a": numbers([3.0, 2.0, -1.0])}, horizon=1)
    assert np.array_equal(low, [[2.0, 2.0, np.nan]], equal_nan=True)
    assert np.array_equal(high, low, equal_nan=True)


def test_a_run_with_an_error_has_no_robustness() -> None:
    low, high = at_rows("always(a > 0)", {"a": numbers([[1.0, np.nan], [1.0, 2.0]])})
    assert np.isnan(low[0]).all()
    assert np.isnan(high[0]).all()
    assert low[1].tolist() == [1.0, 2.0]


def test_what_always_holds_never_fails_to() -> None:
    for one, other in (("always", "eventually"), ("historically", "once")):
        for number, (text, signals) in enumerate(random_formulas(12)):
            window = ("", "[0,3]", "[2,7]")[number % 3] if one == "historically" else "[1,6]"
            here = at_rows(f"always[0,0](not {one}{window}({text}))", signals)
            there = at_rows(f"always[0,0]({other}{window}(not ({text})))", signals)
            assert np.array_equal(here, there), text
            if one == "always":
                here = at_rows(f"not always({text})", signals)
                there = at_rows(f"eventually(not ({text}))", signals)
                assert np.array_equal(here, there), text


@pytest.mark.parametrize(("operator", "sign"), [("eventually", 1), ("always", -1),
                                                ("once", 1), ("historically", -1)])  # fmt: skip
def test_a_wider_window_asks_for_less_of_once_and_more_of_always(operator: str, sign: int) -> None:
    for text, signals in random_formulas(13, 20):
        narrow = at_rows(f"always[0,0]({operator}[2,4]({text}))", signals)
        wide = at_rows(f"always[0,0]({operator}[1,7]({text}))", signals)
        for plane in range(2):
            # Lower and upper bounds are ordered each for itself.
            assert np.all(sign * wide[plane] >= sign * narrow[plane])


def test_a_trace_that_begins_later_has_the_same_robustness_later() -> None:
    random = Random(14)
    for _ in range(40):
        text = f"always[0,2]({text_of(random.formula(3), ',')})"
        signals = traces(random, BATCH, ROWS)
        later = {
            name: numbers(np.hstack([random.bits.normal(size=(BATCH, 7)), series.values]))
            for name, series in signals.items()
        }
        assert np.array_equal(at_rows(text, signals), np.array(at_rows(text, later))[:, :, 7:])


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    cut=st.integers(1, 20),
    size=st.sampled_from([0.0, 1e-6, 1.0, 1e6]),
    level=st.sampled_from([-1e3, -1.0, 0.0, 1.0, 1e3]),
)
def test_no_continuation_leaves_the_interval_of_a_trace_that_was_cut(
    seed: int, cut: int, size: float, level: float
) -> None:
    random = Random(seed)
    text = f"always({text_of(random.formula(3, past=True, edges=True), ',')})"
    rows = 21 + int(parse_formula(text).reach_s)
    signals = traces(random, 1, rows)
    low, high = at_rows(text, signals, horizon=20, length=cut)
    tails = size * random.bits.normal(size=(8, rows - cut)) + level
    whole = {
        name: numbers(np.hstack([np.repeat(series.values[:, :cut], 8, axis=0), tails]))
        for name, series in signals.items()
    }
    least, most = at_rows(text, whole, horizon=20)
    assert np.array_equal(least, most, equal_nan=True)
    assert np.all(low[0, :cut] <= least[:, :cut]), text
    assert np.all(most[:, :cut] <= high[0, :cut]), text


@pytest.mark.parametrize("text", [
    "always[0,{w}](a > 0)", "eventually[{h},{w}](a > 0)", "always[0,0](once[0,{w}](a > 0))",
    "always[0,0](historically[{h},{w}](a > 0))", "(a > -9) until[{h},{w}] (a > 9)",
    "always[0,0]((a > -9) since[{h},{w}] (a > 9))",
])  # fmt: skip
def test_cost_is_linear_in_the_trace_and_does_not_depend_on_the_window(text: str) -> None:
    def cost(rows: int, window: int) -> float:
        formula = text.format(w=window, h=window // 2)
        signals = {"a": numbers(Random(1).bits.normal(size=(1, rows)))}
        at_rows(formula, signals)
        spent = []
        for _ in range(7):
            begin = time.thread_time()
            at_rows(formula, signals)
            spent.append(time.thread_time() - begin)
        return min(spent)

    # A loop over the window would cost a thousand times as much; one over all rows, 256 times.
    assert cost(40_000, 10_000) < 10.0 * cost(40_000, 10)
    assert cost(40_000, 10) < 80.0 * cost(2_500, 10)
