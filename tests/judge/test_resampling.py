"""Bootstraps: the same draws everywhere, and scipy's own intervals."""

from __future__ import annotations

import inspect
import math

import numpy as np
import pytest
from scipy import stats

from adeye.judge.statistics import (
    Interval,
    bca,
    clustered_share,
    design_effect,
    median_low,
    resampled_sums,
)


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


def test_design_effect_of_independent_runs_is_1() -> None:
    failures = (np.arange(200) % 4 == 0).astype(np.float64)
    assert design_effect(failures, np.ones(200)) == pytest.approx(1.0, rel=0.01)


def test_design_effect_of_runs_that_end_alike_is_the_size_of_the_cluster() -> None:
    failures = 5.0 * (np.arange(400) % 4 == 0)
    assert design_effect(failures, np.full(400, 5.0)) == pytest.approx(5.0, rel=0.01)


def test_design_effect_without_a_difference_says_nothing() -> None:
    assert design_effect(np.zeros(7), np.full(7, 3.0)) == 1.0
    assert design_effect(np.full(7, 3.0), np.full(7, 3.0)) == 1.0


def test_clustered_share_is_wider_than_that_of_independent_runs() -> None:
    alike = 4.0 * (np.arange(60) % 5 == 0)
    spread = clustered_share(alike, np.full(60, 4.0), "test", 0.95)
    single = clustered_share((np.arange(240) % 5 == 0) * 1.0, np.ones(240), "test", 0.95)
    assert spread is not None
    assert single is not None
    assert spread.low < 0.2 < spread.high
    assert spread.high - spread.low > 1.6 * (single.high - single.low)


def test_clustered_share_of_few_or_equal_clusters_is_refused() -> None:
    assert clustered_share(np.array([1.0, 0.0]), np.ones(2), "test", 0.95) is None
    assert clustered_share(np.zeros(50), np.ones(50), "test", 0.95) is None
    assert clustered_share(np.zeros(0), np.zeros(0), "test", 0.95) is None
