"""Quantiles of declared distributions: their own laws, closed forms, and what the ends leave."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import SourceLocation, SweepError
from adeye.sweep.distributions import Law, require_mass

WHERE = SourceLocation("odd.yaml", 9, 7)
SHARES = np.linspace(0.001, 0.999, 999)


def normal_cdf(z: float) -> float:
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


def test_uniform_quantile_is_linear() -> None:
    assert Law("uniform", 2.0, 6.0).quantile(np.array([0.25, 0.5])).tolist() == [3.0, 4.0]


@given(
    low=st.floats(-4.0, 3.0),
    width=st.floats(0.5, 6.0),
    mean=st.floats(-50, 50),
    sd=st.floats(0.1, 20),
)
def test_cut_off_normal_has_the_distribution_it_says(
    low: float, width: float, mean: float, sd: float
) -> None:
    law = Law("normal", mean + low * sd, mean + (low + width) * sd, mean, sd)
    values = law.quantile(SHARES)
    assert (np.diff(values) >= 0.0).all()
    assert (values >= law.low).all()
    assert (values <= law.high).all()
    below, above = normal_cdf(low), normal_cdf(low + width)
    for share, value in zip(SHARES[::111], values[::111], strict=True):
        reached = (normal_cdf((value - mean) / sd) - below) / (above - below)
        assert reached == pytest.approx(share, abs=1e-7)


def test_normal_is_symmetric() -> None:
    law = Law("normal", centre=10.0, spread=3.0)
    assert law.quantile(SHARES) + law.quantile(1.0 - SHARES) == pytest.approx(20.0)
    assert law.quantile(np.array([normal_cdf(1.0)])) == pytest.approx([13.0])


def test_far_tail_is_as_fine_above_the_mean_as_below() -> None:
    above = Law("normal", 6.0, 7.0).quantile(SHARES)
    below = Law("normal", -7.0, -6.0).quantile(SHARES)
    assert above == pytest.approx(-below[::-1], rel=1e-12)
    assert len(set(above.tolist())) == len(SHARES)


def test_lognormal_is_the_exponential_of_the_normal() -> None:
    law = Law("lognormal", 0.0, math.inf, math.log(30.0), 0.5)
    expected = 30.0 * np.exp(0.5 * Law("normal").quantile(SHARES))
    assert law.quantile(SHARES) == pytest.approx(expected)


def test_empirical_values_are_equally_likely() -> None:
    law = Law("empirical", 1.0, 4.0, values=np.array([1.0, 2.0, 2.0, 4.0]))
    assert law.quantile(np.array([0.1, 0.26, 0.6, 0.9])).tolist() == [1.0, 2.0, 2.0, 4.0]


def test_choice_gives_levels_as_often_as_they_weigh() -> None:
    levels = Law("choice", weights=(0.2, 0.7, 0.1)).quantile((np.arange(1000) + 0.5) / 1000)
    assert np.bincount(levels.astype(int)).tolist() == [200, 700, 100]


def test_weights_that_round_below_one_leave_no_share_without_a_level() -> None:
    law = Law("choice", weights=(1 / 3, 1 / 3, 1 / 3 - 1e-12))
    assert law.quantile(np.array([1.0 - 2.0**-53])).tolist() == [2.0]


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (Law("uniform", 2.0, 2.0), "nothing is left"),
        (Law("normal", 20.0, 30.0), "lies between its ends"),
        (Law("lognormal", 1e9, math.inf, 0.0, 0.5), "lies between its ends"),
    ],
)
def test_law_of_which_nothing_is_left_is_refused(law: Law, said: str) -> None:
    with pytest.raises(SweepError, match=said) as caught:
        require_mass(law, "gap", WHERE)
    assert caught.value.where == WHERE


def test_mass_is_what_lies_between_the_ends() -> None:
    assert Law("normal", -1.0, 1.0).mass() == pytest.approx(0.6826894921370859)
    assert Law("lognormal", 1.0, math.inf, 0.0, 2.0).mass() == pytest.approx(0.5)
