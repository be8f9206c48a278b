"""A bias that wanders and keeps its deviation."""

import math

import pytest

from adeye.simulate.sensors.gnss_imu import next_bias, share_kept, share_new


def test_after_the_correlation_time_a_share_of_one_over_e_is_left() -> None:
    assert share_kept(30.0, 30.0) == pytest.approx(1.0 / math.e)


def test_two_periods_leave_what_each_leaves() -> None:
    assert share_kept(0.3, 7.0) == pytest.approx(share_kept(0.1, 7.0) * share_kept(0.2, 7.0))


@pytest.mark.parametrize("period", [1e-3, 0.1, 5.0, 500.0])
def test_variance_of_what_is_left_and_of_what_is_new_add_up(period: float) -> None:
    kept = share_kept(period, 10.0)
    assert kept**2 + share_new(kept) ** 2 == pytest.approx(1.0)


def test_first_bias_is_drawn_from_the_deviation_it_keeps() -> None:
    assert next_bias(99.0, 2.0, 0.9, 0.1, 1.5, is_first=True) == 3.0


def test_later_bias_goes_on_from_the_one_before() -> None:
    assert next_bias(1.0, 2.0, 0.9, 0.1, 1.5, is_first=False) == pytest.approx(0.9 + 0.3)


def test_bias_without_deviation_is_none() -> None:
    assert next_bias(0.0, 0.0, 0.9, 0.1, 1.5, is_first=False) == 0.0
