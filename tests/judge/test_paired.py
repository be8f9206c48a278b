"""Statistics of pairs: published values, scipy's own test, and laws."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import stats

from adeye.judge.statistics import holm, mcnemar_p, paired_difference


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


@pytest.mark.slow
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
