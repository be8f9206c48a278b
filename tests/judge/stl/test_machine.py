"""The compiled evaluation against two oracles: rtamt, and a slow one by the definition."""

from __future__ import annotations

import re

import numpy as np
import pytest

from adeye.judge.stl.batch import SATISFIED, UNDECIDED, VIOLATED
from tests.judge.stl.batch import judge, numbers
from tests.judge.stl.random_formulas import (
    NAMES,
    Random,
    Reference,
    rounded,
    text_of,
    traces,
)


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
        mine = (
            f"always[1, {last}] {text_of(body, ',')}" if edges else f"always {text_of(body, ',')}"
        )
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
def test_bounds_on_truncated_traces_agree_with_the_definition(seed: int) -> None:
    random = Random(100 + seed)
    rows = 14
    for _ in range(60):
        body = random.formula(3, edges=True)
        signals = traces(random, 4, rows)
        lengths = [1, 4, 9, rows]
        horizon = int(random.bits.integers(8))
        for complete in (True, False):
            result = judge(
                f"always {text_of(body, ',')}",
                signals,
                length=lengths,
                horizon=[horizon] * 4,
                complete=complete,
            )
            for b, length in enumerate(lengths):
                values = {name: series.values[b] for name, series in signals.items()}
                slow = Reference(values, length)
                last = min(horizon, length - 1) if complete else horizon
                for sign, bound in ((-1, result.robustness_low), (1, result.robustness_high)):
                    expected = min(slow.bound(body, k, sign) for k in range(last + 1))
                    assert bound[b] == expected, text_of(body, ",")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_satisfaction_on_the_threshold_agrees_with_the_boolean_definition(seed: int) -> None:
    """Whole numbers meet their thresholds often, so robustness is often exactly 0."""
    random = Random(200 + seed)
    ties = 0
    for _ in range(150):
        body = random.formula(2, edges=True)
        values = {name: random.bits.integers(-1, 2, size=(4, 14)) for name in NAMES}
        text = re.sub(r"0\.\d+", lambda found: str(round(float(found[0]))), text_of(body, ","))
        whole = rounded(body)
        lengths, signals = [1, 5, 9, 14], {name: numbers(v) for name, v in values.items()}
        result = judge(f"always {text}", signals, length=lengths, horizon=[6] * 4)
        for b, length in enumerate(lengths):
            slow = Reference({n: v[b] for n, v in values.items()}, length, is_boolean=True)
            rows = range(min(6, length - 1) + 1)
            low, high = (min(slow.bound(whole, k, sign) for k in rows) for sign in (-1, 1))
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
        result = judge(
            f"always {text_of(body, ',')}",
            signals,
            length=list(range(1, rows + 1)),
            horizon=[6] * rows,
            complete=False,
        )
        low, high = result.robustness_low, result.robustness_high
        assert np.all(low[1:] >= low[:-1])
        assert np.all(high[1:] <= high[:-1])
        assert result.robustness_low[-1] == result.robustness_high[-1]


def test_a_run_is_judged_alike_alone_and_in_any_batch() -> None:
    random = Random(8)
    for _ in range(20):
        text = f"always {text_of(random.formula(3, edges=True), ',')}"
        signals = traces(random, 5, 20)
        lengths = [3, 20, 11, 7, 20]
        together = judge(text, signals, length=lengths, horizon=[9] * 5, complete=False)
        for b, length in enumerate(lengths):
            # Alone, the arrays end with the run.
            alone_signals = {n: numbers(s.values[b, :length]) for n, s in signals.items()}
            alone = judge(text, alone_signals, horizon=[9], complete=False)
            assert alone.robustness_low[0] == together.robustness_low[b]
            assert alone.robustness_high[0] == together.robustness_high[b]
            assert alone.verdict[0] == together.verdict[b]
            assert alone.vacuous[0] == together.vacuous[b]
