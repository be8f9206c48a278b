"""Criticality: published numbers, seams between branches, and laws."""

import math

import numpy as np
import pytest

from adeye.kernel.criticality import (
    brake_threat_number,
    deceleration_rate_to_avoid_crash,
    enhanced_time_to_collision,
    modified_time_to_collision,
    ramped_stopping_distance,
    required_deceleration,
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


def test_threat_number_is_one_at_the_last_moment() -> None:
    assert brake_threat_number(6.0, 6.0) == 1.0
    assert brake_threat_number(0.0, 0.0) == 0.0
    assert brake_threat_number(0.1, 0.0) == math.inf
    assert brake_threat_number(math.inf, 6.0) == math.inf


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


@pytest.mark.parametrize(
    ("kmh", "printed"), [(50, 26.0), (60, 34.3), (80, 54.0), (100, 77.7), (130, 120.9)]
)
def test_careful_driver_golden(kmh: int, printed: float) -> None:
    way = ramped_stopping_distance(kmh * KMH, 0.75, 0.4, 12.65, 0.774 * 9.81)
    assert way == pytest.approx(printed, abs=0.06)


def test_standstill_needs_no_way() -> None:
    assert stopping_distance(0.0, 1.0, 4.0) == 0.0
    assert ramped_stopping_distance(0.0, 1.0, 0.0, 10.0, 4.0) == 0.0


def test_without_brakes_there_is_no_stop() -> None:
    assert stopping_distance(10.0, 0.0, 0.0) == math.inf
    assert ramped_stopping_distance(10.0, 0.0, 0.0, 10.0, 0.0) == math.inf
    assert ramped_stopping_distance(10.0, 0.0, 0.0, 0.0, 6.0) == math.inf


@pytest.mark.slow
def test_steep_ramp_tends_to_a_step() -> None:
    assert ramped_stopping_distance(30.0, 0.5, 0.0, 1e9, 6.0) == pytest.approx(
        stopping_distance(30.0, 0.5, 6.0), rel=1e-7
    )


@pytest.mark.parametrize("speed", [0.05, 0.2, 1.0, 2.2, 2.4, 10.0, 40.0])
@pytest.mark.parametrize("coasting", [0.0, 0.4])
def test_ramp_equals_small_steps_wherever_the_stop_falls(speed: float, coasting: float) -> None:
    way, now, step = 0.0, speed, 1e-4
    time = 0.0
    while now > 0.0:
        middle = time + 0.5 * step
        braking = coasting if middle < 0.75 else min(6.0, coasting + 12.65 * (middle - 0.75))
        way += step * (now - 0.5 * braking * step)
        now -= braking * step
        time += step
    assert ramped_stopping_distance(speed, 0.75, coasting, 12.65, 6.0) == pytest.approx(
        way, abs=1e-3
    )


def test_ramped_way_grows_with_speed_without_a_jump() -> None:
    speeds = np.linspace(0.0, 6.0, 601)
    ways = [ramped_stopping_distance(float(v), 0.75, 0.4, 12.65, 6.0) for v in speeds]
    assert (np.diff(ways) > 0.0).all()
    assert np.diff(ways).max() < 0.02


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
    assert math.isnan(brake_threat_number(*spoil(0.0, 5.0)))
    assert math.isnan(stopping_distance(*spoil(0.0, 1.0, 5.0)))
    assert math.isnan(ramped_stopping_distance(*spoil(0.0, 1.0, 0.0, 12.0, 5.0)))
