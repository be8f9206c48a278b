"""Criticality: published numbers, seams between branches, and laws."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.kernel.criticality import (
    crash_probability,
    deceleration_rate_to_avoid_crash,
    deceleration_to_safety_time,
    enhanced_time_to_collision,
    fatality_probability,
    margin_to_collision,
    modified_deceleration_rate,
    modified_time_to_collision,
    normal_share,
    proportion_of_stopping_distance,
    required_deceleration,
    rss_lateral_distance,
    rss_lateral_distance_printed,
    rss_longitudinal_distance,
    rss_opposite_distance,
    safe_distance_ratio,
    speed_change,
    stopping_distance,
    time_gap,
    time_headway,
    time_to_collision,
)

NAN = math.nan
KMH = 1.0 / 3.6


def simulate(
    gap: float, rear: float, front: float, rear_a: float, front_a: float, horizon: float = 40.0
) -> tuple[float, float]:
    """Step two vehicles that stop and stay; return the first contact and the least gap."""

    def way(speed: float, acceleration: float, time: float) -> float:
        if acceleration < 0.0:
            time = min(time, speed / -acceleration)
        return time * (speed + 0.5 * acceleration * time)

    least = gap
    for k in range(40001):
        time = horizon * k / 40000.0
        now = gap + way(front, front_a, time) - way(rear, rear_a, time)
        least = min(least, now)
        if now <= 0.0:
            return time, least
    return math.inf, least


def random_following(count: int) -> list[tuple[float, float, float, float, float]]:
    draw = np.random.default_rng(3)
    low = [2.0, 0.0, 0.0, -6.0, -6.0]
    high = [60.0, 35.0, 35.0, 1.5, 1.5]
    return [
        (float(row[0]), float(row[1]), float(row[2]), float(row[3]), float(row[4]))
        for row in draw.uniform(low, high, (count, 5))
    ]


# --- time to collision -------------------------------------------------------


def test_closing_5_mps_over_20_m_takes_4_s() -> None:
    assert time_to_collision(20.0, 5.0) == 4.0


def test_opening_gap_has_infinite_ttc() -> None:
    assert time_to_collision(20.0, -1.0) == math.inf
    assert time_to_collision(20.0, 0.0) == math.inf
    assert time_to_collision(math.inf, 5.0) == math.inf


def test_contact_has_zero_ttc() -> None:
    assert time_to_collision(0.0, -3.0) == 0.0
    assert time_to_collision(-0.5, 3.0) == 0.0


def test_ttc_grows_with_the_gap_and_falls_with_the_closing_speed() -> None:
    gaps = [time_to_collision(float(gap), 5.0) for gap in range(1, 50)]
    speeds = [time_to_collision(20.0, float(v)) for v in range(1, 50)]
    assert gaps == sorted(gaps)
    assert speeds == sorted(speeds, reverse=True)


def test_slower_time_scales_ttc() -> None:
    assert time_to_collision(20.0, 5.0 / 2.0) == 2.0 * time_to_collision(20.0, 5.0)


# --- modified time to collision ----------------------------------------------


def test_accelerating_follower_meets_earlier() -> None:
    expected = (-5.0 + math.sqrt(105.0)) / 2.0
    assert modified_time_to_collision(20.0, 20.0, 15.0, 2.0, 0.0) == pytest.approx(
        expected, rel=1e-12
    )
    assert expected == pytest.approx(2.6235, abs=5e-5)


def test_mttc_without_accelerations_is_ttc() -> None:
    for gap, rear, front, _, _ in random_following(50):
        assert modified_time_to_collision(gap, rear, front, 0.0, 0.0) == pytest.approx(
            time_to_collision(gap, rear - front), rel=1e-12
        )


@pytest.mark.parametrize("small", [1e-3, -1e-3, 1e-9, -1e-9, 1e-15, -1e-15])
def test_mttc_tends_to_ttc(small: float) -> None:
    assert modified_time_to_collision(20.0, 20.0, 15.0, small, 0.0) == pytest.approx(
        4.0, rel=2.0 * abs(small) + 1e-12
    )


def test_equal_speed_behind_a_braking_front_is_a_conflict() -> None:
    # 30 m/s both, 10 m: the gap closes as 0.5 * 5 t^2.
    assert modified_time_to_collision(10.0, 30.0, 30.0, 0.0, -5.0) == pytest.approx(2.0, rel=1e-12)


def test_braking_follower_stops_short() -> None:
    # It would stop after 10 m and never reaches the standing one 12 m ahead.
    assert modified_time_to_collision(12.0, 10.0, 0.0, -5.0, 0.0) == math.inf


def test_who_comes_towards_and_brakes_stops_and_stays() -> None:
    # 10 m/s each, he brakes with 5 m/s²: stands after 2 s and 10 m, the ego has 20 m of 50 m.
    assert modified_time_to_collision(50.0, 10.0, -10.0, 0.0, 5.0) == pytest.approx(4.0, rel=1e-12)
    assert modified_time_to_collision(40.0, 10.0, -10.0, 0.0, 0.0) == pytest.approx(2.0, rel=1e-12)
    # Both brake: 10 m each, and 5 m are left.
    assert modified_time_to_collision(25.0, 10.0, -10.0, -5.0, 5.0) == math.inf


def test_enhanced_time_is_the_golden_one_and_lets_nobody_stop() -> None:
    expected = (-5.0 + math.sqrt(105.0)) / 2.0
    assert enhanced_time_to_collision(20.0, 5.0, 2.0) == pytest.approx(expected, rel=1e-12)
    assert enhanced_time_to_collision(20.0, 5.0, 0.0) == time_to_collision(20.0, 5.0)
    # The front brakes to a stop after 2 s; here it goes on into reverse and is met earlier.
    reversing = enhanced_time_to_collision(20.0, 0.0, 5.0)
    assert reversing == pytest.approx(math.sqrt(8.0), rel=1e-12)
    assert reversing < modified_time_to_collision(20.0, 10.0, 10.0, 0.0, -5.0)
    assert math.isnan(enhanced_time_to_collision(20.0, NAN, 0.0))


def test_front_that_stopped_does_not_reverse() -> None:
    # Front: 10 m/s, -5 m/s^2, stands after 2 s and 10 m. Rear at 10 m/s covers 30 m in 3 s.
    assert modified_time_to_collision(20.0, 10.0, 10.0, 0.0, -5.0) == pytest.approx(3.0, rel=1e-12)


def test_standing_front_with_its_brake_on_stays() -> None:
    assert modified_time_to_collision(20.0, 10.0, 0.0, 0.0, -5.0) == pytest.approx(2.0, rel=1e-12)


def test_slower_follower_that_speeds_up() -> None:
    # 0.5 * 2 t^2 - 2 t = 8 at t = 4.
    assert modified_time_to_collision(8.0, 10.0, 12.0, 2.0, 0.0) == pytest.approx(4.0, rel=1e-12)


@pytest.mark.slow
def test_mttc_equals_small_steps() -> None:
    met = 0
    for state in random_following(25):
        stepped, _ = simulate(*state)
        exact = modified_time_to_collision(*state)
        if stepped < math.inf:
            met += 1
            assert stepped - 1.1e-3 <= exact <= stepped + 1e-9
        else:
            assert exact > 39.9
    assert met > 5


def test_mttc_in_contact_is_zero_and_far_away_infinite() -> None:
    assert modified_time_to_collision(0.0, 10.0, 20.0, 0.0, 0.0) == 0.0
    assert modified_time_to_collision(math.inf, 30.0, 0.0, 1.0, 0.0) == math.inf


# --- time gap, headway -------------------------------------------------------


def test_time_gap_and_headway() -> None:
    assert time_gap(27.0, 15.0) == 1.8
    assert time_headway(27.0, 4.5, 15.0) == 2.1
    assert time_gap(27.0, 0.0) == math.inf
    assert time_gap(0.0, 0.0) == 0.0


# --- decelerations -----------------------------------------------------------


def test_drac_golden() -> None:
    assert deceleration_rate_to_avoid_crash(20.0, 5.0) == 0.625


def test_drac_without_closing_is_zero_and_in_contact_infinite() -> None:
    assert deceleration_rate_to_avoid_crash(20.0, 0.0) == 0.0
    assert deceleration_rate_to_avoid_crash(0.0, 0.0) == 0.0
    assert deceleration_rate_to_avoid_crash(0.0, 1.0) == math.inf
    assert deceleration_rate_to_avoid_crash(math.inf, 1.0) == 0.0


def test_unbraked_front_asks_for_drac() -> None:
    assert required_deceleration(20.0, 20.0, 15.0, 0.0) == deceleration_rate_to_avoid_crash(
        20.0, 5.0
    )


def test_braking_front_that_still_moves_adds_its_deceleration() -> None:
    assert required_deceleration(20.0, 30.0, 25.0, -2.0) == pytest.approx(2.625, rel=1e-12)


def test_front_that_stops_first_adds_its_way() -> None:
    # It stands after 4^2 / (2 * 4) = 2 m.
    assert required_deceleration(20.0, 10.0, 4.0, -4.0) == pytest.approx(100.0 / 44.0, rel=1e-12)


def test_front_that_brakes_as_fast_must_be_followed_to_its_stop() -> None:
    assert required_deceleration(10.0, 20.0, 20.0, -5.0) == pytest.approx(400.0 / 100.0, rel=1e-12)


def test_branches_meet_at_the_seam() -> None:
    # Equal speeds exactly when the front comes to rest: v_l = 2 b d / dv.
    gap, closing, braking = 10.0, 5.0, 3.0
    front = 2.0 * braking * gap / closing
    below, at, above = (
        required_deceleration(gap, front + shift + closing, front + shift, -braking)
        for shift in (-1e-9, 0.0, 1e-9)
    )
    assert below == pytest.approx(at, rel=1e-9)
    assert above == pytest.approx(at, rel=1e-9)
    assert at == pytest.approx(braking + closing**2 / (2.0 * gap), rel=1e-12)


def test_accelerating_front_takes_from_the_demand() -> None:
    assert required_deceleration(20.0, 20.0, 15.0, 0.5) == pytest.approx(0.125, rel=1e-12)
    assert required_deceleration(20.0, 20.0, 15.0, 1.0) == 0.0
    assert required_deceleration(20.0, 10.0, 15.0, 0.0) == 0.0


def test_contact_cannot_be_braked_away() -> None:
    assert required_deceleration(0.0, 10.0, 5.0, 0.0) == math.inf
    assert required_deceleration(0.0, 5.0, 10.0, 0.0) == 0.0
    assert required_deceleration(0.0, 0.0, 0.0, -1.0) == 0.0
    assert required_deceleration(math.inf, 30.0, 0.0, -3.0) == 0.0


@pytest.mark.slow
def test_required_deceleration_is_enough_and_no_more() -> None:
    tried = 0
    for gap, rear, front, _, front_a in random_following(25):
        demand = required_deceleration(gap, rear, front, front_a)
        if demand < 0.05:
            continue
        tried += 1
        _, least = simulate(gap, rear, front, -demand * (1.0 + 1e-6), front_a, 800.0)
        _, touching = simulate(gap, rear, front, -demand * 0.98, front_a, 800.0)
        assert least >= -1e-6
        assert touching <= 1e-6
    assert tried > 8


# --- stopping distances ------------------------------------------------------


@pytest.mark.parametrize(
    ("delay", "deceleration", "golden"),
    [
        (0.35, 6.0, (20.9, 29.0, 48.9, 74.0, 121.3)),
        (0.5, 5.0, (26.2, 36.1, 60.5, 91.0, 148.5)),
        (1.0, 4.0, (38.0, 51.4, 84.0, 124.2, 199.1)),
    ],
)
def test_stopping_distance_golden(
    delay: float, deceleration: float, golden: tuple[float, ...]
) -> None:
    for kmh, printed in zip((50, 60, 80, 100, 130), golden, strict=True):
        speed = kmh * KMH
        way = stopping_distance(speed, delay, deceleration)
        assert way == pytest.approx(printed, abs=0.0501)
        assert way == pytest.approx(speed * delay + speed**2 / (2.0 * deceleration), rel=1e-12)


def test_standstill_needs_no_way() -> None:
    assert stopping_distance(0.0, 1.0, 4.0) == 0.0


def test_without_brakes_there_is_no_stop() -> None:
    assert stopping_distance(10.0, 0.0, 0.0) == math.inf


# --- missing is never safe ---------------------------------------------------


@pytest.mark.parametrize("place", range(5))
def test_nan_in_gives_nan_out(place: int) -> None:
    def spoil(*values: float) -> list[float]:
        spoilt = list(values)
        spoilt[min(place, len(values) - 1)] = NAN
        return spoilt

    assert math.isnan(time_to_collision(*spoil(20.0, -5.0)))
    assert math.isnan(time_headway(*spoil(20.0, 4.0, 5.0)))
    assert math.isnan(modified_time_to_collision(*spoil(20.0, 5.0, 9.0, 0.0, 0.0)))
    assert math.isnan(deceleration_rate_to_avoid_crash(*spoil(20.0, -5.0)))
    assert math.isnan(required_deceleration(*spoil(20.0, 5.0, 9.0, 0.0)))
    assert math.isnan(stopping_distance(*spoil(0.0, 1.0, 5.0)))


# --- RSS distances: published numbers and laws ----------------------------------------------------

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


# --- Margins of following and severity: published numbers, seams, laws ----------------------------

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
