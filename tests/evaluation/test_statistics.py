"""Statistics of pairs: published values, scipy's own test, and laws."""

from __future__ import annotations

import inspect
import itertools
import math

import numpy as np
import pytest
from scipy import stats

from adeye.evaluation.statistics import (
    Interval,
    bca,
    holm,
    mcnemar_p,
    median_low,
    paired_difference,
    poisson_rate,
    resampled_sums,
    wilson,
)


@pytest.mark.parametrize(
    ("only_a", "only_b", "p"),
    [(8, 1, 0.0390625), (1, 8, 0.0390625), (0, 0, 1.0), (0, 5, 0.0625), (0, 6, 0.03125)],
)
def test_mcnemar_golden_values(only_a: int, only_b: int, p: float) -> None:
    assert mcnemar_p(only_a, only_b) == pytest.approx(p, rel=1e-12)


def test_mcnemar_is_the_two_sided_binomial_test() -> None:
    for only_a, only_b in itertools.product(range(0, 40, 3), range(0, 300, 17)):
        if only_a + only_b:
            oracle = stats.binomtest(only_a, only_a + only_b, 0.5).pvalue
            assert mcnemar_p(only_a, only_b) == pytest.approx(oracle, rel=1e-9)


def test_mcnemar_refuses_negative_counts() -> None:
    with pytest.raises(ValueError, match="negative"):
        mcnemar_p(-1, 3)


def test_holm_golden_values() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([]) == []
    assert holm([0.7, 0.6]) == [1.0, 1.0]


def test_holm_never_helps_and_keeps_the_order() -> None:
    p = [0.5, 0.001, 0.02, 0.02, 0.9]
    adjusted = holm(p)
    assert all(after >= before for before, after in zip(p, adjusted, strict=True))
    assert np.argsort(adjusted, kind="stable").tolist() == np.argsort(p, kind="stable").tolist()


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


def test_paired_difference_golden_value_of_newcombe() -> None:
    # 36 both, 12 only the one, 2 only the other, 0 neither: 0.20, method 10: 0.0569 to 0.3404.
    interval = paired_difference(36, 2, 12, 0, 0.95)
    assert (interval.low, interval.high) == pytest.approx((0.0569, 0.3404), abs=5e-5)


def test_paired_difference_turns_around_with_the_pair() -> None:
    for counts in itertools.product((0, 1, 4), repeat=4):
        if sum(counts):
            both, only_a, only_b, neither = counts
            one = paired_difference(both, only_a, only_b, neither, 0.9)
            other = paired_difference(both, only_b, only_a, neither, 0.9)
            assert (one.low, one.high) == pytest.approx((-other.high, -other.low), abs=1e-12)
            difference = (only_b - only_a) / sum(counts)
            assert -1.0 <= one.low <= difference <= one.high <= 1.0


def test_paired_difference_covers_the_truth_about_as_often_as_it_says() -> None:
    pairs = 24
    for truth in ((0.1, 0.1, 0.1), (0.3, 0.05, 0.2), (0.0, 0.15, 0.3), (0.5, 0.1, 0.02)):
        covered = 0.0
        for both, only_a, only_b in itertools.product(range(pairs + 1), repeat=3):
            neither = pairs - both - only_a - only_b
            if neither >= 0:
                interval = paired_difference(both, only_a, only_b, neither, 0.95)
                if interval.low <= truth[2] - truth[1] <= interval.high:
                    shares = (*truth, 1.0 - sum(truth))
                    counts = (both, only_a, only_b, neither)
                    covered += stats.multinomial.pmf(counts, pairs, shares)
        assert 0.93 <= covered <= 0.999, truth


def test_resampled_sums_of_ones_are_the_number_of_units() -> None:
    sums = resampled_sums(np.ones((30, 2)), "cut_in", 50)
    assert sums.tolist() == [[30.0, 30.0]] * 50


def test_resampled_sums_do_not_depend_on_other_columns_or_on_order_of_addition() -> None:
    values = np.sin(np.arange(60.0)).reshape(30, 2)
    both = resampled_sums(values, "cut_in", 40)
    assert resampled_sums(values[:, :1], "cut_in", 40)[:, 0].tolist() == both[:, 0].tolist()
    assert resampled_sums(values, "lead_braking", 40).tolist() != both.tolist()
    # Rounded to the resolution, sums are exact: integers say the same.
    steps = np.round(values * 2.0**20)
    exact = resampled_sums(steps, "cut_in", 40) / 2.0**20
    assert exact.tolist() == both.tolist()


def test_resampled_means_spread_like_the_standard_error() -> None:
    values = np.cos(np.arange(200.0) ** 2)
    means = resampled_sums(values[:, np.newaxis], "cut_in")[:, 0] / 200.0
    assert means.mean() == pytest.approx(values.mean(), abs=0.005)
    assert means.std() == pytest.approx(values.std() / math.sqrt(200.0), rel=0.06)


def test_no_units_resample_to_nothing() -> None:
    assert resampled_sums(np.zeros((0, 3)), "cut_in", 4).tolist() == [[0.0] * 3] * 4


def interval_of(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Interval:
    means = resampled_sums(values[:, np.newaxis], "test")[:, 0] / len(values)
    return bca(float(values.mean()), means, values - values.mean(), 0.95)


def test_bca_of_symmetric_values_is_near_the_normal_interval() -> None:
    values = np.round(stats.norm.ppf((np.arange(400) + 0.5) / 400) * 2**20) / 2**20
    found = interval_of(values)
    reach = 1.96 * values.std() / 20.0
    assert (found.low, found.high) == pytest.approx((-reach, reach), abs=0.02)


def test_bca_leans_to_the_long_tail_as_scipys_does() -> None:
    values = np.round(stats.expon.ppf((np.arange(60) + 0.5) / 60) * 2**20) / 2**20
    found = interval_of(values)
    # The name of this argument differs between releases.
    generator = "rng" if "rng" in inspect.signature(stats.bootstrap).parameters else "random_state"
    oracle = stats.bootstrap(
        (values,), np.mean, n_resamples=4000, **{generator: np.random.default_rng(1)}
    )
    wanted = oracle.confidence_interval
    assert (found.low, found.high) == pytest.approx((wanted.low, wanted.high), abs=0.04)
    assert found.high - values.mean() > values.mean() - found.low


def test_bca_of_one_value_is_that_value() -> None:
    found = bca(0.5, np.full(10, 0.5), np.zeros(8), 0.95)
    assert (found.low, found.high) == (0.5, 0.5)


def test_bca_refuses_what_is_no_number() -> None:
    with pytest.raises(ValueError, match="no number"):
        bca(0.5, np.array([math.nan]), np.ones(1), 0.95)


def test_median_of_an_even_number_is_one_of_them() -> None:
    assert median_low(np.array([4.0, 1.0, 3.0, 2.0])) == 2.0
    assert median_low(np.array([5.0])) == 5.0


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
