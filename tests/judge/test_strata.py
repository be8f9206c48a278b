"""Strata: published values, the maximum by another way, and coverage by counting."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import optimize, stats

from adeye.judge.statistics import (
    Stratum,
    scaled_bounds,
    stratified_bound,
    stratified_estimate,
    upper_bound,
    zero_failure_bound,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

THREE = (0.9, 0.09, 0.01)


def strata(weights: Sequence[float], runs: Sequence[int], failures: int = 0) -> list[Stratum]:
    return [Stratum(weight, failures, count) for weight, count in zip(weights, runs, strict=True)]


def test_zero_failure_bound_golden_values() -> None:
    alike = zero_failure_bound(strata(THREE, (1000, 1000, 1000)), 0.95)
    assert alike == pytest.approx(0.002692, abs=5e-7)
    in_proportion = zero_failure_bound(strata(THREE, (2700, 270, 30)), 0.95)
    assert in_proportion == pytest.approx(upper_bound(0, 3000, 0.95), abs=2e-6)


@given(
    parts=st.lists(st.tuples(st.integers(1, 50), st.integers(1, 400)), min_size=1, max_size=4),
    level=st.sampled_from([0.8, 0.95, 0.99]),
)
def test_zero_failure_bound_is_the_constrained_maximum(
    parts: list[tuple[int, int]], level: float
) -> None:
    total = sum(part for part, _ in parts)
    weights = np.array([part / total for part, _ in parts])
    runs = np.array([count for _, count in parts], dtype=np.float64)

    # With u = -ln(1 - p): maximise the weighted shares where sum(n u) is at most -ln(alpha).
    def excess(price: float) -> float:
        u = np.maximum(0.0, np.log(weights / (price * runs)))
        return float((runs * u).sum() + math.log(1.0 - level))

    price = optimize.brentq(excess, 1e-12, float((weights / runs).max()), xtol=1e-16)
    oracle = float((weights * -np.expm1(-np.maximum(0.0, np.log(weights / (price * runs))))).sum())
    found = zero_failure_bound(strata(weights.tolist(), runs.astype(int).tolist()), level)
    assert found == pytest.approx(oracle, rel=1e-6, abs=1e-9)


def test_one_stratum_is_the_plain_bound() -> None:
    for runs, failures in itertools.product((1, 10, 500), (0, 1)):
        found = stratified_bound([Stratum(1.0, failures, runs)], 0.9)
        assert found == pytest.approx(upper_bound(failures, runs, 0.9), rel=1e-12)


def test_a_stratum_without_runs_can_be_anything() -> None:
    seen = strata((0.7, 0.3), (1000, 0))
    assert zero_failure_bound(seen, 0.95) >= 0.3
    assert stratified_bound([Stratum(0.7, 1, 1000), Stratum(0.3, 0, 0)], 0.95) >= 0.3
    with pytest.raises(ValueError, match="without runs"):
        stratified_estimate(seen)


def test_more_runs_never_make_the_bound_worse() -> None:
    for place in range(3):
        runs = [20, 30, 40]
        before = zero_failure_bound(strata(THREE, runs), 0.95)
        runs[place] += 5
        assert zero_failure_bound(strata(THREE, runs), 0.95) <= before + 1e-15


@pytest.mark.slow
@pytest.mark.parametrize("runs", [(6, 3), (4, 4)])
def test_stratified_bound_covers_at_least_as_often_as_it_says(runs: tuple[int, int]) -> None:
    weights, level = (0.8, 0.2), 0.9
    outcomes = list(itertools.product(*(range(count + 1) for count in runs)))
    bounds = np.array(
        [
            stratified_bound(
                [
                    Stratum(weight, failed, count)
                    for weight, failed, count in zip(weights, outcome, runs, strict=True)
                ],
                level,
            )
            for outcome in outcomes
        ]
    )
    for shares in itertools.product(np.linspace(0.0, 1.0, 41), repeat=2):
        truth = weights[0] * shares[0] + weights[1] * shares[1]
        chance = np.array(
            [
                math.prod(
                    stats.binom.pmf(failed, count, share)
                    for failed, count, share in zip(outcome, runs, shares, strict=True)
                )
                for outcome in outcomes
            ]
        )
        assert chance[bounds >= truth - 1e-12].sum() >= level - 1e-9


def test_estimate_weighs_shares_and_variances() -> None:
    found = stratified_estimate([Stratum(0.9, 1, 100), Stratum(0.1, 10, 100)])
    assert found.share == pytest.approx(0.9 * 0.01 + 0.1 * 0.1)
    assert found.variance == pytest.approx(0.81 * 0.01 * 0.99 / 100 + 0.01 * 0.1 * 0.9 / 100)


def test_weights_are_varied_one_by_one() -> None:
    parts = strata((0.5, 0.5), (1000, 10))
    lowered, raised = scaled_bounds(parts, 0.95)[1]
    assert lowered < zero_failure_bound(parts, 0.95) < raised
    assert raised == zero_failure_bound(strata((0.25, 0.75), (1000, 10)), 0.95)


@pytest.mark.parametrize(
    "parts",
    [
        [],
        strata((0.5, 0.4), (10, 10)),
        strata((1.5, -0.5), (10, 10)),
        [Stratum(1.0, 3, 2)],
        [Stratum(math.nan, 0, 2)],
    ],
)
def test_what_is_no_population_is_refused(parts: list[Stratum]) -> None:
    for function in (zero_failure_bound, stratified_bound):
        with pytest.raises(ValueError, match=r"weight|failures|stratum"):
            function(parts, 0.95)


def test_zero_failure_bound_refuses_a_failure() -> None:
    with pytest.raises(ValueError, match="without a failure"):
        zero_failure_bound([Stratum(1.0, 1, 10)], 0.95)
