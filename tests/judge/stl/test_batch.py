"""A formula on runs as columns, and against two oracles: rtamt, and one by the definition."""

import math
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from adeye.errors import ExpressionError
from adeye.judge.stl.batch import (
    SATISFIED,
    UNDECIDED,
    VIOLATED,
    StlColumns,
    evaluate_columns,
    joined_columns,
)
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.series import SampleStatus, Series
from tests.judge.stl.batch import Signals, binding, judge, numbers, standing, truths
from tests.judge.stl.random_formulas import NAMES, Random, Reference, rounded, text_of, traces
from tests.refusals import refused


def on(**rows: str | list[float]) -> Callable[..., str]:
    """Tell what a formula is on one run: each signal is digits of truth, or numbers."""
    signals = {
        name: truths([int(bit) for bit in row]) if isinstance(row, str) else numbers(row)
        for name, row in rows.items()
    }
    return lambda text, **options: standing(judge(text, signals, **options))


def test_until_without_window_must_be_fulfilled_by_the_horizon() -> None:
    told = on(x="11100", y="00010")
    assert told("x until y", horizon=[3]) == "satisfied"
    assert told("x until y", horizon=[2]) == "violated"
    assert told("x until y", length=[3], horizon=[4], complete=False) == "undecided"
    assert told("x until y", length=[3], horizon=[4]) == "violated"
    broken = on(x="10111", y="00001")
    assert broken("x until y", length=[3], complete=False) == "violated"


def test_eventually_ranges_over_the_horizon() -> None:
    told, text = on(standstill="000111"), "eventually always[0 s, 2 s] standstill"
    assert told(text, horizon=[3]) == "satisfied"
    assert told(text, horizon=[2]) == "violated"
    assert told(text, horizon=[5], length=[5]) == "undecided"
    assert told(text, horizon=[5], length=[2], complete=False) == "undecided"


def test_outermost_operators_under_connectives_range_over_the_horizon() -> None:
    told = on(takeover="0100", gap=[5.0, 4.0, 3.0, 2.0])
    text = "(eventually takeover) implies (always gap > 2.5)"
    assert told(text, horizon=[2]) == "satisfied"
    assert told(text) == "violated"
    assert told("not (always gap > 2.5)") == "satisfied"


def test_an_obligation_open_at_contact_is_undecided() -> None:
    cut: dict[str, Any] = {"length": [5], "horizon": [5], "complete": False}
    signals = {"fault": truths([0, 1, 1, 1, 1, 0]), "detected": truths([0] * 6)}
    text = "always (rise(fault) implies eventually[0 s, 4 s] detected)"
    result = judge(text, signals, **cut)
    assert (standing(result), result.robustness_low[0]) == ("undecided", -math.inf)
    assert on(contact="000010")("always not contact", **cut) == "violated"


def test_a_cut_trace_never_passes_an_always_that_should_go_on() -> None:
    told = on(gap=[9.0, 8.0, 7.0, 0.0])
    assert told("always gap > 1", length=[3], horizon=[3]) == "satisfied"
    assert told("always gap > 1", length=[3], horizon=[3], complete=False) == "undecided"
    assert told("always gap > 1", length=[3], horizon=[2], complete=False) == "satisfied"


def test_at_the_threshold_strictness_decides() -> None:
    signals = {"gap": numbers([[3.0, 0.0, 3.0]])}
    at_least, more = judge("always gap >= 0", signals), judge("always gap > 0", signals)
    assert at_least.robustness_low[0] == more.robustness_low[0] == 0.0
    assert standing(at_least) == "satisfied"
    assert standing(more) == "violated"
    assert standing(judge("always not (gap <= 0)", signals)) == "violated"


def test_a_precondition_that_never_holds_is_vacuous() -> None:
    told = on(fault="000", detected="111")
    assert told("always (fault implies detected)") == "vacuous"
    assert told("always (detected implies not fault)") == "satisfied"
    assert told("always (not fault or detected)") == "satisfied"


def test_a_precondition_after_the_horizon_exercises_nothing() -> None:
    told = on(fault="001", ok="111")
    assert told("always (fault implies ok)", horizon=[1]) == "vacuous"
    assert told("always (fault implies ok)", horizon=[2]) == "satisfied"
    assert told("always[0 s, 1 s] (fault implies ok)") == "vacuous"
    assert told("fault implies ok") == "vacuous"


def test_a_rise_at_row_0_is_no_rise() -> None:
    told = on(fault="111", ok="111")
    assert told("always (rise(fault) implies ok)") == "vacuous"
    assert told("eventually rise(fault)") == "violated"
    assert told("eventually fall(not fault)") == "violated"


def test_every_top_level_implication_must_be_exercised() -> None:
    told = on(p="10", q="00", r="11")
    assert told("always (p implies r)") == "satisfied"
    assert told("always ((p implies r) and (q implies r))") == "vacuous"
    assert told("always (p implies (q implies r))") == "vacuous"
    assert told("always (p implies (r implies r))") == "satisfied"
    # A violated implication fails, and is not vacuous.
    assert on(p="10", r="01")("always (p implies r)") == "violated"


def test_nan_is_an_error_of_its_run_only() -> None:
    signals = {"gap": numbers([[1.0, np.nan, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, np.nan]])}
    result = judge("always gap > 0", signals, length=[3, 3, 2])
    assert result.error.tolist() == [True, False, False]
    assert [standing(result, b) for b in range(3)] == ["error", "satisfied", "satisfied"]
    assert np.isnan(result.robustness_low[0])
    assert np.isnan(result.value[0])


def test_no_conflict_counts_with_the_cap() -> None:
    ttc = numbers([[np.inf, np.inf], [np.inf, 3.0]], unit="s", scale=2.0, cap=10.0)
    result = judge("always ttc >= 1.5 s", {"ttc": ttc})
    assert result.robustness_low.tolist() == [5.0, 0.75]
    undeclared = numbers([[np.inf, np.inf]], unit="s")
    assert standing(judge("always ttc >= 1.5 s", {"ttc": undeclared})) == "error"


def test_a_sample_that_does_not_apply_decides_nothing() -> None:
    status = np.array([[0, SampleStatus.NOT_APPLICABLE, 0]], dtype=np.int8)
    gap = Series(np.array([[5.0, np.nan, 5.0]]), 1.0, "m", "number", status=status)
    lead = truths([[1, 0, 1]])
    signals = {"gap": gap, "lead": lead}
    assert standing(judge("always gap > 2 m", signals)) == "undecided"
    assert standing(judge("always (lead implies gap > 2 m)", signals)) == "satisfied"
    assert standing(judge("always gap > 6 m", signals)) == "violated"


def test_windows_count_rows_inside_them() -> None:
    for window, expected in (
        ("[0 s, 0.3 s]", "satisfied"),
        ("[0, 0.29]", "violated"),
        ("[300 ms, 0.3 s]", "satisfied"),
        ("[0.31 s, 0.5 s]", "violated"),
    ):
        assert on(x="000100")(f"eventually{window} x", step_s=0.1) == expected, window


def test_a_formula_without_outermost_operator_is_judged_at_row_0() -> None:
    assert on(x="100")("x") == "satisfied"
    assert on(x="100")("always[1 s, 2 s] x") == "violated"


def test_arrays_that_do_not_fit_are_refused() -> None:
    formula, signals = parse_formula("x"), Signals(x=truths([[1, 0, 0]]))
    fitting = {"length": [3], "horizon": [2], "complete": [True], "chosen": [True]}
    for change in (
        {"length": [0]},
        {"length": [4]},
        {"horizon": [-1]},
        {"horizon": [1, 2]},
        {"complete": [True, True]},
        {"chosen": [True, True]},
        {"length": [3, 3]},
    ):
        arrays: dict[str, Any] = {n: np.array(values) for n, values in (fitting | change).items()}
        refused(ValueError, evaluate_columns, formula, signals, step_s=0.1, **arrays)
    arrays = {name: np.array(values) for name, values in fitting.items()}
    refused(ValueError, evaluate_columns, formula, signals, step_s=0.0, **arrays)


def test_series_of_different_lengths_are_refused() -> None:
    signals = {"x": truths([[1, 0, 0]]), "y": truths([[1, 0]])}
    refused(ValueError, judge, "x and y", signals, says="do not fit")


def test_the_wrong_kind_is_refused_at_evaluation_too() -> None:
    with pytest.raises(ExpressionError, match="is a length"):
        judge("always gap > 2 s", {"gap": numbers([[1.0]], unit="m")})


TEXTS = (
    "always (p implies eventually[0, 2] a > 0.3)",
    "always a > -1.5",
    "(a > 0) until (p)",
    "eventually always[0, 3] (a < 0.5 or p)",
    "always[1, 6] (rise(p) implies a - 0.2 > -1)",
)


def columns_of(result: StlColumns) -> dict[str, np.ndarray]:
    return {
        item.name: getattr(result, item.name)
        for item in fields(StlColumns)
        if item.name != "program"
    }


@pytest.mark.parametrize("text", TEXTS)
def test_a_run_has_the_same_columns_alone_in_any_batch_and_in_any_order(text: str) -> None:
    bits = np.random.default_rng(11)
    values, truth = bits.normal(size=(7, 15)), bits.integers(0, 2, size=(7, 15))
    values[3, 4] = np.nan
    actor = bits.integers(-1, 3, size=(7, 15))
    lengths = bits.integers(1, 16, size=7)

    def of(runs: Any, rows: int = 15) -> dict[str, np.ndarray]:
        a = numbers(values[runs, :rows], actor=actor[runs, :rows])
        signals = {"a": a, "p": truths(truth[runs, :rows])}
        length = lengths[runs].tolist()
        horizon = [9] * len(length)
        return columns_of(judge(text, signals, length=length, horizon=horizon, complete=False))

    together, order = of(np.arange(7)), bits.permutation(7)
    mixed = of(order)
    for name, column in together.items():
        assert np.array_equal(mixed[name], column[order], equal_nan=column.dtype == float), name
    for run in range(7):
        # Alone, the arrays end with the run.
        for name, column in of(np.array([run]), int(lengths[run])).items():
            one = together[name][[run]]
            assert np.array_equal(column, one, equal_nan=column.dtype == float), name


def test_parts_joined_are_the_whole() -> None:
    bits = np.random.default_rng(12)
    values = bits.normal(size=(6, 8))
    whole = judge("always a > -1", {"a": numbers(values)})
    parts = [
        judge("always a > -1", {"a": numbers(values[rows])}) for rows in ([0, 1], [2], [3, 4, 5])
    ]
    found = columns_of(joined_columns(parts))
    for name, column in columns_of(whole).items():
        assert np.array_equal(found[name], column, equal_nan=column.dtype == float), name
    assert joined_columns([whole]) is whole


def test_runs_that_are_not_chosen_are_open_and_bind_nowhere() -> None:
    signals = {"a": numbers([[1.0], [np.nan], [1.0]])}
    result = judge("always a > 0", signals, chosen=[True, False, False])
    assert [standing(result, run) for run in range(3)] == ["satisfied", "undecided", "undecided"]
    assert result.row.tolist() == [0, -1, -1]
    assert np.isnan(result.robustness_low).tolist() == [False, True, True]


def test_the_actor_is_that_of_the_first_signal_which_is_about_one() -> None:
    nobody, somebody = np.array([[-1, -1]]), np.array([[4, 5]])
    a, b = numbers([2.0, 1.0], actor=nobody), numbers([0.0, 0.0], actor=somebody)
    assert binding(judge("always a > b", {"a": a, "b": b})).actor == 5
    assert binding(judge("always a > 0", {"a": a})).actor is None
    both = {"a": numbers([2.0, 1.0], actor=np.array([[7, 7]])), "b": b}
    assert binding(judge("always a > b", both)).actor == 7


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_robustness_agrees_with_rtamt(seed: int) -> None:
    """100 pairs a seed: 25 formulas on 4 traces each."""
    rtamt = pytest.importorskip("rtamt")
    random = Random(seed)
    rows, last = 60, 20
    for number in range(25):
        # At its first row rtamt lets a condition rise from nothing, so edges begin at row 1.
        edges = number % 2 == 1
        body = random.formula(3, edges=edges)
        signals = traces(random, 4, rows)
        window = f"[1, {last}]" if edges else ""
        mine = f"always{window} {text_of(body, ',')}"
        result = judge(mine, signals, horizon=[last] * 4)
        peer = rtamt.StlDiscreteTimeSpecification()
        for name in NAMES:
            peer.declare_var(name, "float")
        peer.set_sampling_period(1, "s", 0.1)
        peer.spec = f"always[{int(edges)}:{last}]({text_of(body, ':')})"
        peer.parse()
        for b in range(4):
            data = {name: signals[name].values[b].tolist() for name in NAMES}
            expected = peer.evaluate({"time": list(range(rows)), **data})[0][1]
            assert result.robustness_low[b] == pytest.approx(expected, abs=1e-9), mine
            assert result.robustness_high[b] == pytest.approx(expected, abs=1e-9), mine


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("past", [False, True])
def test_bounds_on_truncated_traces_agree_with_the_definition(seed: int, *, past: bool) -> None:
    random = Random(100 + seed + 200 * past)
    rows = 14
    for _ in range(60):
        body = random.formula(3, edges=True, past=past)
        signals = traces(random, 4, rows)
        lengths = [1, 4, 9, rows]
        horizon = int(random.bits.integers(8))
        for complete in (True, False):
            ends: dict[str, Any] = {"length": lengths, "horizon": [horizon] * 4}
            result = judge(f"always {text_of(body, ',')}", signals, complete=complete, **ends)
            for b, length in enumerate(lengths):
                values = {name: series.values[b] for name, series in signals.items()}
                slow = Reference(values, length)
                last = min(horizon, length - 1) if complete else horizon
                for sign, bound in ((-1, result.robustness_low), (1, result.robustness_high)):
                    expected = min(slow.bound(body, k, sign) for k in range(last + 1))
                    assert bound[b] == expected, text_of(body, ",")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("past", [False, True])
def test_satisfaction_on_the_threshold_agrees_with_the_boolean_definition(
    seed: int, *, past: bool
) -> None:
    """Whole numbers meet their thresholds often, so robustness is often exactly 0."""
    random = Random(200 + seed + 200 * past)
    ties = 0
    for _ in range(150):
        body = rounded(random.formula(2, edges=True, past=past))
        values = {name: random.bits.integers(-1, 2, size=(4, 14)) for name in NAMES}
        lengths, signals = [1, 5, 9, 14], {name: numbers(v) for name, v in values.items()}
        text = f"always {text_of(body, ',')}"
        result = judge(text, signals, length=lengths, horizon=[6] * 4)
        for b, length in enumerate(lengths):
            slow = Reference({n: v[b] for n, v in values.items()}, length, is_boolean=True)
            rows = range(min(6, length - 1) + 1)
            low, high = (min(slow.bound(body, k, sign) for k in rows) for sign in (-1, 1))
            expected = SATISFIED if low > 0.0 else VIOLATED if high < 0.0 else UNDECIDED
            assert result.verdict[b] == expected, text
            ties += int(expected != UNDECIDED and result.robustness_low[b] == 0.0)
    assert ties > 20


def test_a_longer_trace_narrows_the_bounds_around_the_robustness() -> None:
    random = Random(7)
    rows = 30
    for _ in range(40):
        body = random.formula(3, edges=True)
        one = traces(random, 1, rows)
        signals = {n: numbers(np.repeat(s.values, rows, axis=0)) for n, s in one.items()}
        ends: dict[str, Any] = {"length": list(range(1, rows + 1)), "horizon": [6] * rows}
        result = judge(f"always {text_of(body, ',')}", signals, complete=False, **ends)
        low, high = result.robustness_low, result.robustness_high
        assert np.all(low[1:] >= low[:-1])
        assert np.all(high[1:] <= high[:-1])
        assert result.robustness_low[-1] == result.robustness_high[-1]
