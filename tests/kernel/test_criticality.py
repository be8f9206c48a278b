"""Criticality: published numbers, hand-made scenes, seams between branches, and laws."""

import math
from collections.abc import Callable
from typing import Any

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

INF, NAN = math.inf, math.nan
KMH = 1.0 / 3.6
CONSERVATIVE = (1.0, 3.5, 4.0, 8.0)
JRC = (0.75, 3.0, 6.0, 6.0)
BESIDE = (1.0, 2.0, 0.2, 0.8, 0.1)
"""Accelerations and decelerations of two that are side by side, as those of RSS before it."""


def near(value: float) -> Any:
    return pytest.approx(value, rel=1e-12)


def assert_worth(form: Callable[..., float], *scenes: tuple[tuple[float, ...], Any]) -> None:
    """Each scene, the arguments of a form, has its answer."""
    for arguments, expected in scenes:
        assert form(*arguments) == expected, (form.__name__, arguments)


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


# --- times ----------------------------------------------------------------------------------------


def test_time_to_collision_is_infinite_where_nothing_closes_and_zero_in_contact() -> None:
    assert_worth(
        time_to_collision,
        ((20.0, 5.0), 4.0),
        ((20.0, -1.0), INF),
        ((20.0, 0.0), INF),
        ((INF, 5.0), INF),
        ((0.0, -3.0), 0.0),
        ((-0.5, 3.0), 0.0),
    )


def test_modified_time_lets_who_brakes_stop_and_stay() -> None:
    assert (-5.0 + math.sqrt(105.0)) / 2.0 == pytest.approx(2.6235, abs=5e-5)
    assert_worth(
        modified_time_to_collision,
        # Who speeds up behind another meets it earlier.
        ((20.0, 20.0, 15.0, 2.0, 0.0), near((-5.0 + math.sqrt(105.0)) / 2.0)),
        # 30 m/s both, 10 m: the gap closes as 0.5 * 5 t^2.
        ((10.0, 30.0, 30.0, 0.0, -5.0), near(2.0)),
        # It would stop after 10 m and never reaches the standing one 12 m ahead.
        ((12.0, 10.0, 0.0, -5.0, 0.0), INF),
        # 10 m/s each, he brakes with 5 m/s²: stands after 2 s and 10 m, the ego has 20 m of 50 m.
        ((50.0, 10.0, -10.0, 0.0, 5.0), near(4.0)),
        ((40.0, 10.0, -10.0, 0.0, 0.0), near(2.0)),
        # Both brake: 10 m each, and 5 m are left.
        ((25.0, 10.0, -10.0, -5.0, 5.0), INF),
        # Front: 10 m/s, -5 m/s^2, stands after 2 s and 10 m. Rear at 10 m/s covers 30 m in 3 s.
        ((20.0, 10.0, 10.0, 0.0, -5.0), near(3.0)),
        # A standing front with its brake on stays.
        ((20.0, 10.0, 0.0, 0.0, -5.0), near(2.0)),
        # Slower, and faster in time: 0.5 * 2 t^2 - 2 t = 8 at t = 4.
        ((8.0, 10.0, 12.0, 2.0, 0.0), near(4.0)),
        ((0.0, 10.0, 20.0, 0.0, 0.0), 0.0),
        ((INF, 30.0, 0.0, 1.0, 0.0), INF),
    )


def test_modified_time_tends_to_that_without_accelerations() -> None:
    for small in (1e-3, -1e-3, 1e-9, -1e-9, 1e-15, -1e-15):
        found = modified_time_to_collision(20.0, 20.0, 15.0, small, 0.0)
        assert found == pytest.approx(4.0, rel=2.0 * abs(small) + 1e-12)


def test_enhanced_time_is_the_golden_one_and_lets_nobody_stop() -> None:
    assert_worth(
        enhanced_time_to_collision,
        ((20.0, 5.0, 2.0), near((-5.0 + math.sqrt(105.0)) / 2.0)),
        ((20.0, 5.0, 0.0), 4.0),
        # The front brakes to a stop after 2 s; here it goes on into reverse and is met earlier.
        ((20.0, 0.0, 5.0), near(math.sqrt(8.0))),
    )
    assert math.sqrt(8.0) < modified_time_to_collision(20.0, 10.0, 10.0, 0.0, -5.0)


@pytest.mark.slow
def test_modified_time_equals_small_steps() -> None:
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


def test_time_gap_and_headway() -> None:
    assert_worth(time_gap, ((27.0, 15.0), 1.8), ((27.0, 0.0), INF), ((0.0, 0.0), 0.0))
    assert_worth(time_headway, ((27.0, 4.5, 15.0), 2.1))


# --- decelerations --------------------------------------------------------------------------------


def test_deceleration_rate_is_zero_without_closing_and_infinite_in_contact() -> None:
    assert_worth(
        deceleration_rate_to_avoid_crash,
        ((20.0, 5.0), 0.625),
        ((20.0, 0.0), 0.0),
        ((0.0, 0.0), 0.0),
        ((0.0, 1.0), INF),
        ((INF, 1.0), 0.0),
    )


def test_required_deceleration_follows_what_the_front_does() -> None:
    assert_worth(
        required_deceleration,
        ((20.0, 20.0, 15.0, 0.0), 0.625),
        # A braking front that still moves adds its deceleration.
        ((20.0, 30.0, 25.0, -2.0), near(2.625)),
        # One that stops first adds its way: it stands after 4^2 / (2 * 4) = 2 m.
        ((20.0, 10.0, 4.0, -4.0), near(100.0 / 44.0)),
        # One that brakes as fast is followed to its stop.
        ((10.0, 20.0, 20.0, -5.0), near(400.0 / 100.0)),
        # One that speeds up takes from the demand.
        ((20.0, 20.0, 15.0, 0.5), near(0.125)),
        ((20.0, 20.0, 15.0, 1.0), 0.0),
        ((20.0, 10.0, 15.0, 0.0), 0.0),
        # Contact cannot be braked away.
        ((0.0, 10.0, 5.0, 0.0), INF),
        ((0.0, 5.0, 10.0, 0.0), 0.0),
        ((0.0, 0.0, 0.0, -1.0), 0.0),
        ((INF, 30.0, 0.0, -3.0), 0.0),
    )


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
    assert at == near(braking + closing**2 / (2.0 * gap))


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


def test_late_decelerations_are_golden_and_infinite_where_it_is_too_late() -> None:
    # 20 m, 5 m/s: 0.625 m/s² at once; after 1 s only 3 s are left; 10 m/s 1 s ahead leave 10 m.
    assert_worth(
        modified_deceleration_rate,
        ((20.0, 5.0, 0.0), near(0.625)),
        ((20.0, 5.0, 1.0), near(5.0 / 6.0)),
        ((5.0, 5.0, 1.0), INF),
        ((20.0, 0.0, 1.0), 0.0),
    )
    assert_worth(
        deceleration_to_safety_time,
        ((20.0, 5.0, 10.0, 1.0), near(1.25)),
        ((20.0, 5.0, 20.0, 0.0), near(0.625)),
        ((10.0, 5.0, 10.0, 1.0), INF),
        ((10.0, 0.0, 10.0, 1.0), 0.0),
    )


# --- stopping distances ---------------------------------------------------------------------------


def test_stopping_distance_is_the_published_one() -> None:
    for delay, deceleration, *golden in (
        (0.35, 6.0, 20.9, 29.0, 48.9, 74.0, 121.3),
        (0.5, 5.0, 26.2, 36.1, 60.5, 91.0, 148.5),
        (1.0, 4.0, 38.0, 51.4, 84.0, 124.2, 199.1),
    ):
        for kmh, printed in zip((50, 60, 80, 100, 130), golden, strict=True):
            speed = kmh * KMH
            way = stopping_distance(speed, delay, deceleration)
            assert way == pytest.approx(printed, abs=0.0501)
            assert way == near(speed * delay + speed**2 / (2.0 * deceleration))
    assert_worth(stopping_distance, ((0.0, 1.0, 4.0), 0.0), ((10.0, 0.0, 0.0), INF))


# --- RSS distances --------------------------------------------------------------------------------


def test_longitudinal_distance_of_rss_is_the_published_one() -> None:
    for rear, front, *golden in (
        (20.0, 20.0, 65.781, 23.766),
        (30.0, 20.0, 147.031, 76.682),
        (30.0, 30.0, 115.781, 35.016),
        (36.111, 0.0, 233.990, 150.558),
    ):
        for printed, parameters in zip(golden, (CONSERVATIVE, JRC), strict=True):
            rho, acceleration, least, most = parameters
            distance = rss_longitudinal_distance(rear, front, *parameters)
            assert distance == pytest.approx(printed, abs=5.1e-4)
            faster = rear + rho * acceleration
            own = rear * rho + acceleration * rho**2 / 2.0 + faster**2 / (2.0 * least)
            assert distance == near(own - front**2 / (2.0 * most))


def test_longitudinal_distance_of_rss_is_kept_by_the_worst_case() -> None:
    # Rear accelerates for 1 s and brakes at 4, front brakes at 8: they end exactly in touch.
    gap = rss_longitudinal_distance(30.0, 20.0, *CONSERVATIVE)
    assert gap + 20.0**2 / 16.0 == near(30.0 + 0.5 * 3.5 + 33.5**2 / 8.0)


def test_rss_within_its_limits() -> None:
    # Up to 21 m/s in 2/7 s, the rest of the second at 21 m/s, then 21^2 / 8 to standstill.
    way = 20.5 * 2.0 / 7.0 + 21.0 * 5.0 / 7.0 + 21.0**2 / 8.0
    assert_worth(
        rss_longitudinal_distance,
        ((5.0, 40.0, *CONSERVATIVE), 0.0),
        ((20.0, 0.0, *CONSERVATIVE, 0.0, 21.0), pytest.approx(way)),
        ((20.0, 0.0, *CONSERVATIVE, 3.0, 21.0), pytest.approx(way + 3)),
        # Who is faster keeps its speed; who needs no distance keeps the least one.
        ((20.0, 0.0, *CONSERVATIVE, 0.0, 9.0), 20.0 + 50.0),
        ((5.0, 40.0, *CONSERVATIVE, 2.0, 9.0), 2.0),
        # Without brakes no distance is safe; a front that cannot brake needs none.
        ((20.0, 20.0, 1.0, 3.5, 0.0, 8.0), INF),
        ((20.0, 20.0, 1.0, 3.5, 4.0, 0.0), 0.0),
    )
    assert rss_longitudinal_distance(20.0, 0.0, 1.0, 3.5, 4.0, 0.0) > 0.0
    own, other = 20.0 + 1.75 + 23.5**2 / 6.0, 10.0 + 1.75 + 13.5**2 / 8.0
    assert_worth(
        rss_opposite_distance,
        ((20.0, 10.0, 1.0, 3.5, 3.0, 4.0), near(own + other)),
        ((20.0, 20.0, 1.0, 3.5, 4.0, 4.0, 3.0, 21.0), pytest.approx(2.0 * way + 3.0)),
    )


def test_lateral_distance_of_rss_asks_for_nothing_of_who_moves_apart_long_enough() -> None:
    assert_worth(
        rss_lateral_distance,
        ((0.0, 0.0, *BESIDE), near(0.725)),
        ((-3.0, 3.0, 1.0, 1.0, 0.2, 0.8, 0.1), 0.0),
        # Ways of -0.2 m and 0.15 m while they respond, and 0.1 m of swaying of which none is left.
        ((-0.3, 0.25, 1.0, 1.0, 0.2, 0.8, 0.5), pytest.approx(0.15)),
        ((0.0, 0.0, 1.0, 1.0, 0.2, 0.0, 0.1), INF),
    )


def test_printed_definition_is_the_same_for_who_comes_nearer_and_never_asks_for_less() -> None:
    for speeds in ((0.0, 0.0), (1.3, 0.0), (0.7, -0.4), (0.0, 0.2)):
        state = (*speeds, *BESIDE)
        assert rss_lateral_distance(*state) == rss_lateral_distance_printed(*state)
    more = 0
    for one in range(-30, 31):
        for two in range(-30, 31):
            state = (0.1 * one, 0.1 * two, *BESIDE)
            reference, printed = rss_lateral_distance(*state), rss_lateral_distance_printed(*state)
            assert printed >= reference
            more += printed > reference + 1.0
    assert more > 100


# --- margins of following and severity ------------------------------------------------------------


def test_margins_of_following() -> None:
    assert_worth(
        margin_to_collision,
        # Equal speeds: the gap decides alone; a standing front: gap over the way to standstill.
        ((20.0, 20.0, 20.0, 8.0), pytest.approx(1.0 + 20.0 / 25.0)),
        ((25.0, 20.0, 0.0, 8.0), near(1.0)),
        ((25.0, 0.0, 0.0, 8.0), INF),
        # Both ways to standstill, 12.5 m and 25 m, just fit.
        ((37.5, 20.0, -math.sqrt(200.0), 8.0), near(1.0)),
        ((1.0, 20.0, -20.0, 8.0), 0.0),
    )
    assert_worth(
        proportion_of_stopping_distance,
        ((25.0, 20.0, 8.0), near(1.0)),
        ((25.0, 0.0, 8.0), INF),
        ((0.0, 20.0, 8.0), 0.0),
    )
    assert_worth(safe_distance_ratio, ((30.0, 60.0), 0.5), ((30.0, 0.0), INF))


@pytest.mark.slow
@given(st.floats(-8.0, 8.0))
@settings(max_examples=200, deadline=None)
def test_normal_share_is_that_of_the_error_function(x: float) -> None:
    assert normal_share(x) == pytest.approx(0.5 * math.erfc(-x / math.sqrt(2.0)), abs=1e-15)


def test_crash_probability_is_that_of_a_cut_normal_distribution() -> None:
    assert (normal_share(-INF), normal_share(INF)) == (0.0, 1.0)

    def share(x: float) -> float:
        return 0.5 * math.erfc(-(x - 8.45) / 1.40 / math.sqrt(2.0))

    ends = (8.45, 1.40, 4.23, 12.68)
    assert_worth(crash_probability, ((4.23, *ends), 0.0), ((12.68, *ends), 1.0))
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
    assert_worth(speed_change, ((1800.0, INF, 10.0), 10.0))
    assert_worth(fatality_probability, ((15.87,), near(1.0 / 16.0)), ((40.0,), 1.0), ((0.0,), 0.0))


# --- missing is never safe ------------------------------------------------------------------------


def test_unknown_number_is_never_a_known_answer() -> None:
    whole: dict[Callable[..., float], tuple[float, ...]] = {
        time_to_collision: (20.0, -5.0),
        time_headway: (20.0, 4.0, 5.0),
        modified_time_to_collision: (20.0, 5.0, 9.0, 0.0, 0.0),
        deceleration_rate_to_avoid_crash: (20.0, -5.0),
        required_deceleration: (20.0, 5.0, 9.0, 0.0),
        stopping_distance: (0.0, 1.0, 5.0),
    }
    some: list[tuple[Callable[..., float], tuple[float, ...]]] = [
        (enhanced_time_to_collision, (NAN, 0.0, 0.0)),
        (enhanced_time_to_collision, (20.0, NAN, 0.0)),
        (rss_longitudinal_distance, (NAN, 20.0, *CONSERVATIVE)),
        (rss_longitudinal_distance, (20.0, NAN, *CONSERVATIVE)),
        (rss_longitudinal_distance, (20.0, 20.0, 1.0, 3.5, NAN, 8.0)),
        (rss_longitudinal_distance, (20.0, 20.0, *CONSERVATIVE, NAN)),
        (rss_longitudinal_distance, (20.0, 20.0, *CONSERVATIVE, 0.0, NAN)),
        (rss_lateral_distance, (NAN, 0.0, 1.0, 1.0, 0.2, 0.8, 0.1)),
        (rss_lateral_distance, (0.0, 0.0, 1.0, 1.0, 0.2, NAN, 0.1)),
        (modified_deceleration_rate, (NAN, 5.0, 1.0)),
        (deceleration_to_safety_time, (20.0, NAN, 10.0, 1.0)),
        (margin_to_collision, (20.0, 20.0, NAN, 8.0)),
        (proportion_of_stopping_distance, (20.0, NAN, 8.0)),
        (safe_distance_ratio, (NAN, 8.0)),
        (crash_probability, (NAN, 8.45, 1.4, 4.23, 12.68)),
        (speed_change, (1800.0, 1500.0, NAN)),
        (fatality_probability, (NAN,)),
        (normal_share, (NAN,)),
    ]
    spoilt = [
        (form, (*state[:place], NAN, *state[place + 1 :]))
        for form, state in whole.items()
        for place in range(len(state))
    ]
    for form, state in (*spoilt, *some):
        assert math.isnan(form(*state)), (form.__name__, state)
