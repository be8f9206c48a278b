"""Intervals and bounds of one proportion: published values, scipy, and coverage by counting."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from adeye.judge.statistics import (
    clopper_pearson,
    jeffreys,
    runs_for_proportion,
    runs_without_failure,
    upper_bound,
    wilson,
)


@pytest.mark.parametrize(
    ("failures", "low", "high"),
    [(0, 0.0, 0.001917), (1, 0.000088, 0.002827), (5, 0.001068, 0.005839)],
)
def test_wilson_golden_values(failures: int, low: float, high: float) -> None:
    interval = wilson(failures, 2000, 0.95)
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=5e-7)


def test_wilson_is_scipys() -> None:
    for failures in range(8):
        oracle = stats.binomtest(failures, 7).proportion_ci(0.9, method="wilson")
        found = wilson(failures, 7, 0.9)
        assert (found.low, found.high) == pytest.approx((oracle.low, oracle.high), abs=1e-12)


@pytest.mark.parametrize(("failures", "runs"), [(1, 0), (-1, 3), (4, 3)])
def test_wilson_refuses_what_is_no_proportion(failures: int, runs: int) -> None:
    with pytest.raises(ValueError, match="no proportion"):
        wilson(failures, runs, 0.95)


GOLDEN = [(0, 0.0, 0.001843), (1, 0.000013, 0.002783), (5, 0.000812, 0.005824)]


@pytest.mark.parametrize(("failures", "low", "high"), GOLDEN)
def test_clopper_pearson_golden_values(failures: int, low: float, high: float) -> None:
    interval = clopper_pearson(failures, 2000, 0.95)
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=5e-7)


@pytest.mark.slow
def test_clopper_pearson_is_scipys() -> None:
    for runs, level in itertools.product((1, 2, 7, 300), (0.5, 0.9, 0.999)):
        for failures in range(min(runs, 9) + 1):
            oracle = stats.binomtest(failures, runs).proportion_ci(level, method="exact")
            found = clopper_pearson(failures, runs, level)
            assert (found.low, found.high) == pytest.approx((oracle.low, oracle.high), abs=1e-12)


def test_upper_bound_is_scipys() -> None:
    for runs, level in itertools.product((1, 2, 7, 300), (0.5, 0.9, 0.999)):
        for failures in range(min(runs, 9) + 1):
            test = stats.binomtest(failures, runs, alternative="less")
            oracle = test.proportion_ci(level, method="exact").high
            assert upper_bound(failures, runs, level) == pytest.approx(oracle, abs=1e-12)


def test_upper_bound_golden_values() -> None:
    assert upper_bound(0, 2000, 0.95) == pytest.approx(0.001497, abs=5e-7)
    assert upper_bound(5, 2000, 0.95) == pytest.approx(0.005249, abs=5e-7)
    assert upper_bound(0, 0, 0.95) == 1.0


@pytest.mark.parametrize("level", [0.8, 0.95])
@pytest.mark.parametrize("runs", [1, 5, 30])
def test_exact_bounds_cover_at_least_as_often_as_they_say(runs: int, level: float) -> None:
    two_sided = [clopper_pearson(failures, runs, level) for failures in range(runs + 1)]
    one_sided = [upper_bound(failures, runs, level) for failures in range(runs + 1)]
    for share in np.linspace(0.0, 1.0, 401):
        chance = stats.binom.pmf(np.arange(runs + 1), runs, share)
        inside = [item.low <= share <= item.high for item in two_sided]
        assert chance[inside].sum() >= level - 1e-12
        assert chance[np.array(one_sided) >= share].sum() >= level - 1e-12


def test_jeffreys_is_the_quantile_of_the_posterior() -> None:
    assert jeffreys(0, 2000, 0.95).high == pytest.approx(0.001255, abs=5e-7)
    for failures in range(1, 7):
        found = jeffreys(failures, 7, 0.9, prior=(2.0, 3.0))
        posterior = stats.beta(failures + 2.0, 10.0 - failures)
        assert posterior.cdf([found.low, found.high]) == pytest.approx([0.05, 0.95], abs=1e-12)
    assert (jeffreys(0, 7, 0.9).low, jeffreys(7, 7, 0.9).high) == (0.0, 1.0)


@pytest.mark.parametrize("prior", [(0.0, 1.0), (-1.0, 2.0), (math.nan, 1.0)])
def test_a_prior_is_a_distribution(prior: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="prior"):
        jeffreys(1, 2, 0.9, prior)


@pytest.mark.parametrize(
    ("level", "counts"),
    [
        (0.90, [22, 230, 2302, 23025]),
        (0.95, [29, 299, 2995, 29956]),
        (0.99, [44, 459, 4603, 46050]),
    ],
)
def test_runs_without_failure_golden_values(level: float, counts: list[int]) -> None:
    assert [runs_without_failure(10.0**-k, level) for k in (1, 2, 3, 4)] == counts
    for k, count in zip((1, 2, 3, 4), counts, strict=True):
        assert upper_bound(0, count, level) <= 10.0**-k < upper_bound(0, count - 1, level)


@pytest.mark.parametrize("level", [5e-324, 1e-17, 0.5, 1.0 - 1e-9, 1.0 - 2.0**-53])
def test_every_level_between_0_and_1_has_bounds(level: float) -> None:
    for failures, runs in ((0, 1), (0, 10), (3, 10), (10, 10), (7, 10**6)):
        share = failures / runs
        for interval in (clopper_pearson, wilson):
            found = interval(failures, runs, level)
            assert 0.0 <= found.low <= share <= found.high <= 1.0
        assert 0.0 <= upper_bound(failures, runs, level) <= 1.0
    for target in (5e-324, 1e-300, 1e-17, 0.5, 1.0 - 2.0**-53):
        assert runs_without_failure(target, level) >= 1
    assert runs_without_failure(5e-324, 0.95) > 10**322


def test_runs_for_proportion_golden_values() -> None:
    assert runs_for_proportion(0.05, 0.95) == 385
    assert runs_for_proportion(0.01, 0.95) == 9604
    # A population that is not much larger than the sample needs fewer.
    assert runs_for_proportion(0.05, 0.95, population=1000) == 278
    assert runs_for_proportion(0.05, 0.95, population=10**9) == 385
    assert runs_for_proportion(0.05, 0.95, population=1) == 1


@pytest.mark.parametrize("level", [0.0, 1.0, -1.0, math.nan])
def test_a_confidence_lies_between_0_and_1(level: float) -> None:
    with pytest.raises(ValueError, match="confidence"):
        clopper_pearson(1, 2, level)
    with pytest.raises(ValueError, match="confidence"):
        runs_without_failure(0.1, level)
    with pytest.raises(ValueError, match="confidence"):
        runs_for_proportion(0.1, level)


@pytest.mark.parametrize("share", [0.0, 1.0, math.nan])
def test_sample_sizes_refuse_what_is_no_share(share: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        runs_without_failure(share, 0.95)
    with pytest.raises(ValueError, match="between 0 and 1"):
        runs_for_proportion(0.1, 0.95, share=share)
