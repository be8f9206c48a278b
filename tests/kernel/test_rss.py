"""RSS distances: published numbers and laws."""

import math

import pytest

from adeye.kernel.criticality import (
    rss_lateral_distance,
    rss_lateral_distance_printed,
    rss_longitudinal_distance,
    rss_opposite_distance,
)

CONSERVATIVE = (1.0, 3.5, 4.0, 8.0)
JRC = (0.75, 3.0, 6.0, 6.0)


@pytest.mark.parametrize(
    ("rear", "front", "conservative", "jrc"),
    [
        (20.0, 20.0, 65.781, 23.766),
        (30.0, 20.0, 147.031, 76.682),
        (30.0, 30.0, 115.781, 35.016),
        (36.111, 0.0, 233.990, 150.558),
    ],
)
def test_longitudinal_golden(rear: float, front: float, conservative: float, jrc: float) -> None:
    for golden, parameters in ((conservative, CONSERVATIVE), (jrc, JRC)):
        rho, acceleration, least, most = parameters
        distance = rss_longitudinal_distance(rear, front, *parameters)
        assert distance == pytest.approx(golden, abs=5.1e-4)
        formula = (
            rear * rho
            + acceleration * rho**2 / 2.0
            + (rear + rho * acceleration) ** 2 / (2.0 * least)
            - front**2 / (2.0 * most)
        )
        assert distance == pytest.approx(formula, rel=1e-12)


def test_lateral_golden() -> None:
    assert rss_lateral_distance(0.0, 0.0, 1.0, 2.0, 0.2, 0.8, 0.1) == pytest.approx(
        0.725, rel=1e-12
    )


def test_faster_front_needs_no_distance() -> None:
    assert rss_longitudinal_distance(5.0, 40.0, *CONSERVATIVE) == 0.0


def test_distance_grows_with_rear_and_falls_with_front_speed() -> None:
    by_rear = [rss_longitudinal_distance(float(v), 20.0, *CONSERVATIVE) for v in range(15, 40)]
    by_front = [rss_longitudinal_distance(20.0, float(v), *CONSERVATIVE) for v in range(20)]
    by_response = [rss_longitudinal_distance(20.0, 20.0, 0.1 * k, 3.5, 4.0, 8.0) for k in range(20)]
    assert by_rear == sorted(by_rear)
    assert by_front == sorted(by_front, reverse=True)
    assert by_response == sorted(by_response)


def test_distance_is_kept_by_the_worst_case() -> None:
    # Rear accelerates for 1 s and brakes at 4, front brakes at 8: they end exactly in touch.
    gap = rss_longitudinal_distance(30.0, 20.0, *CONSERVATIVE)
    rear_end = 30.0 + 0.5 * 3.5 + 33.5**2 / 8.0
    front_end = gap + 20.0**2 / 16.0
    assert front_end == pytest.approx(rear_end, rel=1e-12)


def test_oncoming_distance_is_the_sum_of_both_ways() -> None:
    distance = rss_opposite_distance(20.0, 10.0, 1.0, 3.5, 3.0, 4.0)
    own = 20.0 + 1.75 + 23.5**2 / 6.0
    other = 10.0 + 1.75 + 13.5**2 / 8.0
    assert distance == pytest.approx(own + other, rel=1e-12)


def test_lateral_distance_grows_with_the_approach() -> None:
    ways = [rss_lateral_distance(0.1 * k, 0.0, 1.0, 1.0, 0.2, 0.8, 0.1) for k in range(-2, 20)]
    assert ways == sorted(ways)


def test_who_moves_apart_for_long_enough_needs_no_distance() -> None:
    assert rss_lateral_distance(-3.0, 3.0, 1.0, 1.0, 0.2, 0.8, 0.1) == 0.0
    # Ways of -0.2 m and 0.15 m while they respond, and 0.1 m of swaying of which nothing is left.
    assert rss_lateral_distance(-0.3, 0.25, 1.0, 1.0, 0.2, 0.8, 0.5) == pytest.approx(0.15)


def test_who_comes_nearer_is_measured_alike_by_both_readings() -> None:
    for speed_1, speed_2 in ((0.0, 0.0), (1.3, 0.0), (0.7, -0.4), (0.0, 0.2)):
        state = (speed_1, speed_2, 1.0, 2.0, 0.2, 0.8, 0.1)
        assert rss_lateral_distance(*state) == rss_lateral_distance_printed(*state)


def test_printed_definition_never_asks_for_less() -> None:
    more = 0
    for one in range(-30, 31):
        for two in range(-30, 31):
            state = (0.1 * one, 0.1 * two, 1.0, 2.0, 0.2, 0.8, 0.1)
            reference, printed = rss_lateral_distance(*state), rss_lateral_distance_printed(*state)
            assert printed >= reference
            more += printed > reference + 1.0
    assert more > 100


def test_limits_of_the_response_are_kept() -> None:
    # Up to 21 m/s in 2/7 s, the rest of the second at 21 m/s, then 21^2 / 8 to standstill.
    way = 20.5 * 2.0 / 7.0 + 21.0 * 5.0 / 7.0 + 21.0**2 / 8.0
    assert rss_longitudinal_distance(20.0, 0.0, *CONSERVATIVE, 0.0, 21.0) == pytest.approx(way)
    assert rss_longitudinal_distance(20.0, 0.0, *CONSERVATIVE, 3.0, 21.0) == pytest.approx(way + 3)
    # Who is faster keeps its speed; who needs no distance keeps the least one.
    assert rss_longitudinal_distance(20.0, 0.0, *CONSERVATIVE, 0.0, 9.0) == 20.0 + 50.0
    assert rss_longitudinal_distance(5.0, 40.0, *CONSERVATIVE, 2.0, 9.0) == 2.0
    both = rss_opposite_distance(20.0, 20.0, 1.0, 3.5, 4.0, 4.0, 3.0, 21.0)
    assert both == pytest.approx(2.0 * way + 3.0)


def test_mirrored_scene_has_the_same_lateral_distance() -> None:
    assert rss_lateral_distance(0.5, -0.3, 1.0, 2.0, 0.2, 0.8, 0.1) == pytest.approx(
        rss_lateral_distance(0.3, -0.5, 2.0, 1.0, 0.2, 0.8, 0.1), rel=1e-12
    )


def test_without_brakes_no_distance_is_safe() -> None:
    assert rss_longitudinal_distance(20.0, 20.0, 1.0, 3.5, 0.0, 8.0) == math.inf
    assert rss_lateral_distance(0.0, 0.0, 1.0, 1.0, 0.2, 0.0, 0.1) == math.inf


def test_front_that_cannot_brake_needs_no_distance() -> None:
    assert rss_longitudinal_distance(20.0, 20.0, 1.0, 3.5, 4.0, 0.0) == 0.0
    assert rss_longitudinal_distance(20.0, 0.0, 1.0, 3.5, 4.0, 0.0) > 0.0


def test_nan_is_never_safe() -> None:
    nan = math.nan
    assert math.isnan(rss_longitudinal_distance(nan, 20.0, *CONSERVATIVE))
    assert math.isnan(rss_longitudinal_distance(20.0, nan, *CONSERVATIVE))
    assert math.isnan(rss_longitudinal_distance(20.0, 20.0, 1.0, 3.5, nan, 8.0))
    assert math.isnan(rss_longitudinal_distance(20.0, 20.0, *CONSERVATIVE, nan))
    assert math.isnan(rss_longitudinal_distance(20.0, 20.0, *CONSERVATIVE, 0.0, nan))
    assert math.isnan(rss_lateral_distance(nan, 0.0, 1.0, 1.0, 0.2, 0.8, 0.1))
    assert math.isnan(rss_lateral_distance(0.0, 0.0, 1.0, 1.0, 0.2, nan, 0.1))
