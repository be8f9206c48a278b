"""Margins of following and severity: published numbers, seams, laws."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.kernel.criticality import (
    crash_probability,
    deceleration_rate_to_avoid_crash,
    deceleration_to_safety_time,
    fatality_probability,
    margin_to_collision,
    modified_deceleration_rate,
    normal_share,
    proportion_of_stopping_distance,
    safe_distance_ratio,
    speed_change,
)

INF = math.inf
following = st.tuples(st.floats(0.5, 100.0), st.floats(0.01, 40.0))


@pytest.mark.slow
@given(following)
@settings(max_examples=100, deadline=None)
def test_without_delay_or_safety_time_it_is_the_deceleration_rate(
    pair: tuple[float, float],
) -> None:
    gap, closing = pair
    expected = deceleration_rate_to_avoid_crash(gap, closing)
    assert modified_deceleration_rate(gap, closing, 0.0) == pytest.approx(expected, rel=1e-9)
    assert deceleration_to_safety_time(gap, closing, 20.0, 0.0) == pytest.approx(expected)


@given(following, st.floats(0.0, 2.0))
@settings(max_examples=100, deadline=None)
def test_demands_grow_with_the_closing_speed_and_fall_with_the_gap(
    pair: tuple[float, float], time: float
) -> None:
    gap, closing = pair

    def late(gap: float, closing: float) -> float:
        return modified_deceleration_rate(gap, closing, time)

    def apart(gap: float, closing: float) -> float:
        return deceleration_to_safety_time(gap, closing, 10.0, time)

    for demand in (late, apart):
        assert demand(gap, closing) <= demand(gap, 1.1 * closing)
        assert demand(gap, closing) >= demand(1.1 * gap, closing)
        assert demand(gap, 0.0) == demand(gap, -closing) == 0.0


def test_golden_decelerations() -> None:
    # 20 m, 5 m/s: 0.625 m/s² at once; after 1 s only 3 s are left; 10 m/s 1 s ahead leave 10 m.
    assert modified_deceleration_rate(20.0, 5.0, 0.0) == pytest.approx(0.625, rel=1e-12)
    assert modified_deceleration_rate(20.0, 5.0, 1.0) == pytest.approx(5.0 / 6.0, rel=1e-12)
    assert deceleration_to_safety_time(20.0, 5.0, 10.0, 1.0) == pytest.approx(1.25, rel=1e-12)


def test_seams_of_decelerations() -> None:
    assert modified_deceleration_rate(5.0, 5.0, 1.0) == INF
    assert deceleration_to_safety_time(10.0, 5.0, 10.0, 1.0) == INF
    assert deceleration_to_safety_time(10.0, 0.0, 10.0, 1.0) == 0.0


def test_margin_to_collision() -> None:
    # Equal speeds: the gap decides alone; a standing front: gap over the way to standstill.
    assert margin_to_collision(20.0, 20.0, 20.0, 8.0) == pytest.approx(1.0 + 20.0 / 25.0)
    assert margin_to_collision(25.0, 20.0, 0.0, 8.0) == pytest.approx(1.0, rel=1e-12)
    assert margin_to_collision(25.0, 0.0, 0.0, 8.0) == INF
    # Both ways to standstill, 12.5 m and 25 m, just fit.
    towards = margin_to_collision(37.5, 20.0, -math.sqrt(200.0), 8.0)
    assert towards == pytest.approx(1.0, rel=1e-12)
    assert margin_to_collision(1.0, 20.0, -20.0, 8.0) == 0.0


def test_proportion_of_stopping_distance() -> None:
    assert proportion_of_stopping_distance(25.0, 20.0, 8.0) == pytest.approx(1.0, rel=1e-12)
    assert proportion_of_stopping_distance(25.0, 0.0, 8.0) == INF
    assert proportion_of_stopping_distance(0.0, 20.0, 8.0) == 0.0


def test_safe_distance_ratio() -> None:
    assert safe_distance_ratio(30.0, 60.0) == 0.5
    assert safe_distance_ratio(30.0, 0.0) == INF


@pytest.mark.slow
@given(st.floats(-8.0, 8.0))
@settings(max_examples=200, deadline=None)
def test_normal_share_is_that_of_the_error_function(x: float) -> None:
    assert normal_share(x) == pytest.approx(0.5 * math.erfc(-x / math.sqrt(2.0)), abs=1e-15)


def test_normal_share_has_ends() -> None:
    assert (normal_share(-INF), normal_share(INF)) == (0.0, 1.0)


def test_crash_probability_is_that_of_a_cut_normal_distribution() -> None:
    ends = (8.45, 1.40, 4.23, 12.68)
    assert crash_probability(4.23, *ends) == 0.0
    assert crash_probability(12.68, *ends) == 1.0

    def share(x: float) -> float:
        return 0.5 * math.erfc(-(x - 8.45) / 1.40 / math.sqrt(2.0))

    for needed in (5.0, 8.45, 9.9):
        expected = (share(needed) - share(4.23)) / (share(12.68) - share(4.23))
        assert crash_probability(needed, *ends) == pytest.approx(expected, rel=1e-9)


@given(st.floats(50.0, 4e4), st.floats(50.0, 4e4), st.floats(0.0, 60.0))
@settings(max_examples=100, deadline=None)
def test_momentum_is_kept(own: float, other: float, speed: float) -> None:
    first, second = speed_change(own, other, speed), speed_change(other, own, speed)
    assert first + second == pytest.approx(speed, rel=1e-9, abs=1e-12)
    assert own * first == pytest.approx(other * second, rel=1e-9, abs=1e-9)


def test_severity() -> None:
    assert speed_change(1800.0, INF, 10.0) == 10.0
    assert fatality_probability(15.87) == pytest.approx(1.0 / 16.0, rel=1e-12)
    assert fatality_probability(40.0) == 1.0
    assert fatality_probability(0.0) == 0.0


def test_unknown_number_stays_one() -> None:
    nan = math.nan
    assert math.isnan(modified_deceleration_rate(nan, 5.0, 1.0))
    assert math.isnan(deceleration_to_safety_time(20.0, nan, 10.0, 1.0))
    assert math.isnan(margin_to_collision(20.0, 20.0, nan, 8.0))
    assert math.isnan(proportion_of_stopping_distance(20.0, nan, 8.0))
    assert math.isnan(safe_distance_ratio(nan, 8.0))
    assert math.isnan(crash_probability(nan, 8.45, 1.4, 4.23, 12.68))
    assert math.isnan(speed_change(1800.0, 1500.0, nan))
    assert math.isnan(fatality_probability(nan))
    assert math.isnan(normal_share(nan))
