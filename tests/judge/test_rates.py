"""Rates: the exact interval by its definition, and its coverage."""

from __future__ import annotations

import math

import pytest
from scipy import stats

from adeye.judge.statistics import poisson_rate


@pytest.mark.parametrize("events", [0, 1, 3, 10, 200])
def test_poisson_rate_is_the_exact_interval(events: int) -> None:
    found = poisson_rate(events, 2.0, 0.95)
    # Garwood's ends, by the quantiles of the chi-squared distribution.
    low = stats.chi2.ppf(0.025, 2 * events) / 2.0 if events else 0.0
    high = stats.chi2.ppf(0.975, 2 * events + 2) / 2.0
    assert (found.low, found.high) == pytest.approx((low / 2.0, high / 2.0), rel=1e-12)


@pytest.mark.parametrize("mean", [0.5, 2.0, 7.5])
def test_poisson_rate_covers_at_least_as_often_as_it_says(mean: float) -> None:
    counts = range(100)
    covered = [
        stats.poisson.pmf(count, mean)
        for count in counts
        if poisson_rate(count, 1.0, 0.95).low <= mean <= poisson_rate(count, 1.0, 0.95).high
    ]
    assert sum(covered) >= 0.95


@pytest.mark.parametrize(("events", "exposure"), [(-1, 1.0), (1, 0.0), (1, math.inf)])
def test_no_time_has_no_rate(events: int, exposure: float) -> None:
    with pytest.raises(ValueError, match="no rate"):
        poisson_rate(events, exposure, 0.95)
