"""The exact interval: against the binomial distribution, and where there is nothing to say."""

import pytest
from scipy.stats import binom

from adeye.evaluation.exact import clopper_pearson


@pytest.mark.parametrize(("successes", "trials"), [(3, 10), (63, 64), (1, 2)])
def test_ends_are_where_what_was_seen_is_as_rare_as_half_of_the_rest(
    successes: int, trials: int
) -> None:
    found = clopper_pearson(successes, trials, 0.9)
    assert binom.sf(successes - 1, trials, found.low) == pytest.approx(0.05)
    assert binom.cdf(successes, trials, found.high) == pytest.approx(0.05)


def test_all_or_none_reach_the_end() -> None:
    assert clopper_pearson(64, 64, 0.95).high == 1.0
    assert clopper_pearson(64, 64, 0.95).low == pytest.approx(0.025 ** (1 / 64))
    assert clopper_pearson(0, 64, 0.95).low == 0.0


@pytest.mark.parametrize(("successes", "trials"), [(2, 1), (-1, 3), (0, 0)])
def test_what_is_no_proportion_is_refused(successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match="is no proportion"):
        clopper_pearson(successes, trials, 0.95)
