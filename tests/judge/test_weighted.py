"""Importance weights: equal ones change nothing, and few effective runs allow no bound."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.judge.statistics import clopper_pearson, importance_estimate
from adeye.kernel.random import owner_id, uniform


def test_equal_weights_are_the_plain_interval() -> None:
    failed = np.arange(200) < 9
    found = importance_estimate(np.full(200, 0.25), failed, 0.95)
    exact = clopper_pearson(9, 200, 0.95)
    assert found.share == pytest.approx(0.045)
    assert found.effective == pytest.approx(200.0)
    assert found.interval is not None
    assert (found.interval.low, found.interval.high) == pytest.approx((exact.low, exact.high))


def test_too_few_effective_runs_allow_no_bound() -> None:
    found = importance_estimate(np.ones(29), np.zeros(29, dtype=bool), 0.95)
    assert found.interval is None
    assert "29 effective runs" in found.refusal


def test_one_heavy_run_allows_no_bound() -> None:
    weights = np.ones(1000)
    weights[0] = 260.0
    found = importance_estimate(weights, np.zeros(1000, dtype=bool), 0.95)
    assert found.effective < 30.0
    weights = np.append(np.ones(4000), 1001.0)
    found = importance_estimate(weights, np.zeros(4001, dtype=bool), 0.95)
    assert found.interval is None


def test_heaviest_run_is_looked_at_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    import adeye.judge.statistics as subject

    monkeypatch.setattr(subject, "MIN_EFFECTIVE", 1.0)
    weights = np.append(np.ones(10), 3.0)
    found = importance_estimate(weights, np.zeros(11, dtype=bool), 0.95)
    assert found.largest == pytest.approx(3.0 / 13.0)
    assert "one run carries 23%" in found.refusal


def test_weights_undo_the_distribution_that_was_drawn_from() -> None:
    # Drawn uniformly, asked for with density 2 x: the share below 0.5 is a quarter.
    owner = np.uint64(owner_id("test"))
    drawn = np.array([uniform(np.uint64(1), owner, number, 0) for number in range(20_000)])
    found = importance_estimate(2.0 * drawn, drawn < 0.5, 0.95)
    assert found.share == pytest.approx(0.25, abs=0.01)
    assert found.effective == pytest.approx(15_000, rel=0.02)
    assert found.interval is not None
    assert found.interval.low < 0.25 < found.interval.high


def test_everything_failed() -> None:
    found = importance_estimate(np.ones(50), np.ones(50, dtype=bool), 0.95)
    assert found.interval is not None
    assert found.interval.high == 1.0


@pytest.mark.parametrize("weights", [[-1.0, 2.0], [0.0, 0.0], [np.nan, 1.0], [np.inf, 1.0]])
def test_what_is_no_weight_is_refused(weights: list[float]) -> None:
    with pytest.raises(ValueError, match="weights"):
        importance_estimate(np.array(weights), np.array([True, False]), 0.95)
