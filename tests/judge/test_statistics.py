"""Statistics: published values, scipy, laws, and coverage by counting."""

import inspect
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import optimize, stats

from adeye.judge import statistics as s
from adeye.judge.statistics import (
    Interval,
    Stratum,
    bca,
    clopper_pearson,
    holm,
    jeffreys,
    mcnemar_p,
    median_low,
    normal_quantile,
    normal_share,
    paired_difference,
    poisson_rate,
    resampled_sums,
    runs_without_failure,
    scaled_bounds,
    stratified_bound,
    stratified_estimate,
    upper_bound,
    wilson,
    zero_failure_bound,
)
from tests.frozen import assert_frozen
from tests.refusals import refused


def test_intervals_have_the_published_values() -> None:
    for interval, failures, low, high in (
        (wilson, 0, 0.0, 0.001917),
        (wilson, 1, 0.000088, 0.002827),
        (wilson, 5, 0.001068, 0.005839),
        (clopper_pearson, 0, 0.0, 0.001843),
        (clopper_pearson, 1, 0.000013, 0.002783),
        (clopper_pearson, 5, 0.000812, 0.005824),
    ):
        found = interval(failures, 2000, 0.95)
        assert (found.low, found.high) == pytest.approx((low, high), abs=5e-7)
    assert upper_bound(0, 2000, 0.95) == pytest.approx(0.001497, abs=5e-7)
    assert upper_bound(5, 2000, 0.95) == pytest.approx(0.005249, abs=5e-7)
    assert upper_bound(0, 0, 0.95) == 1.0


def test_wilson_is_scipys() -> None:
    for failures in range(8):
        oracle = stats.binomtest(failures, 7).proportion_ci(0.9, method="wilson")
        found = wilson(failures, 7, 0.9)
        assert (found.low, found.high) == pytest.approx((oracle.low, oracle.high), abs=1e-12)


def test_what_is_no_proportion_level_prior_or_count_is_refused() -> None:
    for pair in ((1, 0), (-1, 3), (4, 3)):
        refused(ValueError, wilson, *pair, 0.95, says="no proportion")
    for prior in ((0.0, 1.0), (-1.0, 2.0), (math.nan, 1.0)):
        refused(ValueError, jeffreys, 1, 2, 0.9, prior, says="prior")
    for level in (0.0, 1.0, -1.0, math.nan):
        refused(ValueError, clopper_pearson, 1, 2, level, says="confidence")
        refused(ValueError, runs_without_failure, 0.1, level, says="confidence")
    for share in (0.0, 1.0, math.nan):
        refused(ValueError, runs_without_failure, share, 0.95, says="between 0 and 1")
    for counted in ((-1, 1.0), (1, 0.0), (1, math.inf)):
        refused(ValueError, poisson_rate, *counted, 0.95, says="no rate")
    refused(ValueError, mcnemar_p, -1, 3, says="negative")
    refused(ValueError, bca, 0.5, np.array([math.nan]), np.ones(1), 0.95, says="no number")
    failed = [Stratum(1.0, 1, 10)]
    refused(ValueError, zero_failure_bound, failed, 0.95, says="without a failure")


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


def test_runs_without_failure_golden_values() -> None:
    for level, counts in (
        (0.90, [22, 230, 2302, 23025]),
        (0.95, [29, 299, 2995, 29956]),
        (0.99, [44, 459, 4603, 46050]),
    ):
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


@pytest.mark.parametrize("share", [1e-6, 0.025, 0.5, 0.9, 1.0 - 1e-9])
def test_quantile_and_share_are_scipys_and_each_others_inverse(share: float) -> None:
    quantile = normal_quantile(share)
    assert quantile == pytest.approx(stats.norm.ppf(share), abs=1e-12)
    assert normal_share(quantile) == pytest.approx(share, rel=1e-9)


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


def test_holm_golden_values() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([]) == []
    assert holm([0.7, 0.6]) == [1.0, 1.0]


def test_holm_never_helps_and_keeps_the_order() -> None:
    p = [0.5, 0.001, 0.02, 0.02, 0.9]
    adjusted = holm(p)
    assert all(after >= before for before, after in zip(p, adjusted, strict=True))
    assert np.argsort(adjusted, kind="stable").tolist() == np.argsort(p, kind="stable").tolist()


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


def test_median_of_an_even_number_is_one_of_them() -> None:
    assert median_low(np.array([4.0, 1.0, 3.0, 2.0])) == 2.0
    assert median_low(np.array([5.0])) == 5.0


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
    refused(ValueError, stratified_estimate, seen, says="without runs")


def test_more_runs_never_make_the_bound_worse() -> None:
    for place in range(3):
        runs = [20, 30, 40]
        before = zero_failure_bound(strata(THREE, runs), 0.95)
        runs[place] += 5
        assert zero_failure_bound(strata(THREE, runs), 0.95) <= before + 1e-15


@pytest.mark.parametrize("runs", [(6, 3), (4, 4)])
def test_stratified_bound_covers_at_least_as_often_as_it_says(runs: tuple[int, int]) -> None:
    weights, level, grid = (0.8, 0.2), 0.9, np.linspace(0.0, 1.0, 41)
    outcomes = itertools.product(*(range(count + 1) for count in runs))
    found = [stratified_bound(list(map(Stratum, weights, seen, runs)), level) for seen in outcomes]
    bounds = np.reshape(found, [count + 1 for count in runs])
    # Chances of so many failures, for each share.
    chances = [stats.binom.pmf(np.arange(n + 1)[:, np.newaxis], n, grid) for n in runs]
    for one, other in itertools.product(range(len(grid)), repeat=2):
        covered = bounds >= np.dot(weights, grid[[one, other]]) - 1e-12
        chance = np.outer(chances[0][:, one], chances[1][:, other])
        assert chance[covered].sum() >= level - 1e-9


def test_estimate_weighs_shares_and_variances() -> None:
    found = stratified_estimate([Stratum(0.9, 1, 100), Stratum(0.1, 10, 100)])
    assert found.share == pytest.approx(0.9 * 0.01 + 0.1 * 0.1)
    assert found.variance == pytest.approx(0.81 * 0.01 * 0.99 / 100 + 0.01 * 0.1 * 0.9 / 100)


def test_weights_are_varied_one_by_one() -> None:
    parts = strata((0.5, 0.5), (1000, 10))
    lowered, raised = scaled_bounds(parts, 0.95)[1]
    assert lowered < zero_failure_bound(parts, 0.95) < raised
    assert raised == zero_failure_bound(strata((0.25, 0.75), (1000, 10)), 0.95)


def test_what_is_no_population_is_refused() -> None:
    for parts in (
        [],
        strata((0.5, 0.4), (10, 10)),
        strata((1.5, -0.5), (10, 10)),
        [Stratum(1.0, 3, 2)],
        [Stratum(math.nan, 0, 2)],
    ):
        for function in (zero_failure_bound, stratified_bound):
            refused(ValueError, function, parts, 0.95, says=r"weight|failures|stratum")


COUNTS = ((0, 1), (1, 1), (0, 7), (1, 7), (3, 7), (7, 7), (2, 300), (150, 300), (299, 300))
PAIRS = ((0, 0, 0, 5), (5, 0, 0, 0), (3, 2, 4, 6), (0, 7, 0, 3), (0, 0, 9, 1), (20, 1, 8, 40))
STRATA = (
    (s.Stratum(1.0, 0, 40),),
    (s.Stratum(0.9, 0, 1000), s.Stratum(0.1, 0, 10)),
    (s.Stratum(0.6, 0, 30), s.Stratum(0.4, 0, 0)),
    (s.Stratum(0.7, 2, 50), s.Stratum(0.3, 0, 20)),
    (s.Stratum(0.5, 1, 4), s.Stratum(0.25, 4, 4), s.Stratum(0.25, 0, 9), s.Stratum(0.0, 0, 3)),
)


def shown(found: Any) -> str:
    """Write a result with nine digits, or why there is none."""
    if isinstance(found, s.Interval):
        return f"{found.low:.9g} to {found.high:.9g} at {found.confidence:g}"
    if isinstance(found, s.Estimate):
        return f"{found.share:.9g} with {found.variance:.9g}"
    if isinstance(found, list | tuple):
        return "; ".join(shown(item) for item in found)
    return f"{found:.9g}"


def asked(function: Callable[..., Any], *arguments: Any) -> str:
    try:
        answer = shown(function(*arguments))
    except ValueError as error:
        answer = str(error)
    given = ", ".join(
        " + ".join(f"{i.weight:g} ({i.failures}/{i.runs})" for i in item)
        if isinstance(item, tuple) and item and isinstance(item[0], s.Stratum)
        else f"{item}"
        for item in arguments
    )
    return f"{function.__name__}({given}): {answer}"


def test_answers_are_frozen() -> None:
    """Each function at small and large numbers, at its ends, and what it refuses."""
    lines = [
        asked(function, *counts, confidence)
        for function in (s.clopper_pearson, s.upper_bound, s.jeffreys, s.wilson)
        for counts in (*COUNTS, (0, 0), (3, 2), (-1, 4))
        for confidence in (0.8, 0.95)
    ]
    lines += [asked(s.wilson, 1, 7, level) for level in (0.0, 1.0, 1e-9, 1.0 - 1e-12)]
    lines += [asked(s.jeffreys, 1, 7, 0.9, prior) for prior in ((1.0, 1.0), (2, 5), (0.0, 1.0))]
    lines += [
        asked(s.runs_without_failure, share, level)
        for share in (0.5, 0.01, 1e-7, 1e-300, 0.0, 1.0)
        for level in (0.5, 0.99, 1.0)
    ]
    lines += [asked(s.mcnemar_p, *pair) for pair in ((0, 0), (1, 0), (3, 3), (8, 1), (0, -1))]
    lines += [asked(s.holm, list(given)) for given in ((), (0.2,), (0.5, 0.01, 0.9, 0.02, 0.02))]
    lines += [asked(s.paired_difference, *pairs, level) for pairs in PAIRS for level in (0.8, 0.95)]
    lines += [
        asked(s.poisson_rate, events, exposure, 0.95)
        for events in (0, 1, 12)
        for exposure in (0.5, 40.0, 0.0, math.inf)
    ]
    for strata in STRATA:
        lines += [
            asked(function, strata, 0.95)
            for function in (s.zero_failure_bound, s.stratified_bound, s.scaled_bounds)
        ]
        lines.append(asked(s.stratified_estimate, strata))
    for wrong in ((s.Stratum(0.5, 0, 1),), (s.Stratum(1.5, 0, 1),), (s.Stratum(1.0, 2, 1),)):
        lines.append(asked(s.stratified_bound, wrong, 0.9))
    values = np.array([[0.5, -1.0], [2.25, 0.0], [0.5, 4.0], [-3.0, 1.0], [1.0, 1.0]])
    sums = s.resampled_sums(values, "units", 200)
    lines.append(f"resampled: {shown(tuple(sums[:6].ravel().tolist()))}")
    for column in (0, 1):
        observed = float(values[:, column].sum())
        influence = values[:, column] - values[:, column].mean()
        lines += [
            f"bca {level}: {shown(s.bca(observed, sums[:, column], influence, level))}"
            for level in (0.5, 0.9, 0.95)
        ]
    lines.append(f"no spread: {shown(s.bca(2.0, np.full(9, 2.0), np.zeros(5), 0.9))}")
    lines.append(
        f"medians: {[s.median_low(np.arange(float(count))[::-1]) for count in range(1, 7)]}"
    )
    assert_frozen("statistics.txt", "\n".join([*lines, ""]))
