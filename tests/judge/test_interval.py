"""The normal distribution that intervals need is scipy's."""

from __future__ import annotations

import pytest
from scipy import stats

from adeye.judge.statistics import normal_quantile, normal_share


@pytest.mark.parametrize("share", [1e-6, 0.025, 0.5, 0.9, 1.0 - 1e-9])
def test_quantile_and_share_are_scipys_and_each_others_inverse(share: float) -> None:
    quantile = normal_quantile(share)
    assert quantile == pytest.approx(stats.norm.ppf(share), abs=1e-12)
    assert normal_share(quantile) == pytest.approx(share, rel=1e-9)
