"""Operators that look back: by their definition, and what they say a violation comes from."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.judge.stl.batch import SATISFIED, UNDECIDED, VIOLATED
from tests.judge.stl.batch import binding, judge, numbers, standing, truths
from tests.judge.stl.random_formulas import Random, Reference, rounded, text_of, traces


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_bounds_on_truncated_traces_agree_with_the_definition(seed: int) -> None:
    random = Random(300 + seed)
    lengths = [1, 4, 9, 14]
    for _ in range(60):
        body = random.formula(3, past=True, edges=True)
        signals = traces(random, 4, 14)
        horizon = int(random.bits.integers(8))
        result = judge(
            f"always {text_of(body, ',')}",
            signals,
            length=lengths,
            horizon=[horizon] * 4,
            complete=False,
        )
        for b, length in enumerate(lengths):
            slow = Reference({n: series.values[b] for n, series in signals.items()}, length)
            for sign, bound in ((-1, result.robustness_low), (1, result.robustness_high)):
                expected = min(slow.bound(body, k, sign) for k in range(horizon + 1))
                assert bound[b] == expected, text_of(body, ",")


@pytest.mark.slow
def test_satisfaction_on_the_threshold_agrees_with_the_boolean_definition() -> None:
    """Whole numbers meet their thresholds often, so robustness is often exactly 0."""
    random = Random(400)
    ties = 0
    for _ in range(150):
        body = rounded(random.formula(2, past=True, edges=True))
        values = {name: random.bits.integers(-1, 2, size=(4, 14)) for name in ("a", "b", "c")}
        signals = {name: numbers(rows) for name, rows in values.items()}
        result = judge(f"always {text_of(body, ',')}", signals, horizon=[6] * 4)
        for b in range(4):
            slow = Reference({n: rows[b] for n, rows in values.items()}, 14, is_boolean=True)
            low, high = (min(slow.bound(body, k, sign) for k in range(7)) for sign in (-1, 1))
            expected = SATISFIED if low > 0.0 else VIOLATED if high < 0.0 else UNDECIDED
            assert result.verdict[b] == expected, text_of(body, ",")
            ties += int(expected != UNDECIDED and result.robustness_low[b] == 0.0)
    assert ties > 20


GAP = numbers([9.0, 5.0, 3.0, 4.0, 8.0], unit="m")


@pytest.mark.parametrize(
    ("text", "row", "value"),
    [
        # Violated: the one sample that would have had to be otherwise.
        ("always(gap < 7 m implies historically[0 s, 2 s](gap > 4 m))", 2, 3.0),
        ("always(gap < 4 m implies once[1 s, 1 s](gap > 6 m))", 1, 5.0),
        ("always[1 s, 4 s](gap > 4.5 m implies previous(gap > 6 m))", 3, 4.0),
        ("eventually(gap > 7 m and once(gap > 10 m))", 0, 9.0),
        ("always(gap > 7 m implies ((gap > 3.5 m) since (gap > 8.6 m)))", 2, 3.0),
    ],
)
def test_binding_predicate_is_found_behind_an_operator_that_looks_back(
    text: str, row: int, value: float
) -> None:
    result = judge(text, {"gap": GAP})
    assert standing(result) == "violated"
    found = binding(result)
    assert (found.row, found.value, found.signal) == (row, value, "gap")
    assert found.difference is not None
    assert found.difference == pytest.approx(result.robustness_low[0])


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
