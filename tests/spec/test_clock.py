"""Durations and rates in ticks of the master clock."""

from __future__ import annotations

import pytest

from adeye.errors import SpecError
from adeye.spec.clock import period_ticks, ticks


def test_whole_numbers_of_steps() -> None:
    assert ticks(0.15, 0.05, "latency") == 3
    assert ticks(0.0, 0.05, "latency") == 0
    assert ticks(25.0, 0.05, "horizon") == 500
    assert period_ticks(20.0, 0.05, "rate") == 1
    assert period_ticks(2.5, 0.05, "rate") == 8


def test_other_durations_name_the_nearest() -> None:
    with pytest.raises(SpecError, match=r"latency: 0.12 s .* 0.1 s and 0.15 s"):
        ticks(0.12, 0.05, "latency")


@pytest.mark.parametrize(
    ("rate", "nearest"), [(15.0, "10 Hz and 20 Hz"), (40.0, "10 Hz and 20 Hz")]
)
def test_other_rates_name_the_nearest(rate: float, nearest: str) -> None:
    with pytest.raises(SpecError, match=nearest):
        period_ticks(rate, 0.05, "rate")
