"""Criticality: published numbers, hand-made scenes, seams between branches, and laws."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.kernel import criticality as subject

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


def random_following(count: int) -> list[tuple[float, ...]]:
    draw = np.random.default_rng(3)
    low, high = [2.0, 0.0, 0.0, -6.0, -6.0], [60.0, 35.0, 35.0, 1.5, 1.5]
    return [tuple(row) for row in draw.uniform(low, high, (count, 5)).tolist()]


# --- times ----------------------------------------------------------------------------------------


def test_modified_time_lets_who_brakes_stop_and_stay() -> None:
    assert (-5.0 + math.sqrt(105.0)) / 2.0 == pytest.approx(2.6235, abs=5e-5)
    assert_worth(
        subject.modified_time_to_collision,
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


def test_modified_time_equals_small_steps() -> None:
    met = 0
    for state in random_following(25):
        stepped, _ = simulate(*state)
        exact = subject.modified_time_to_collision(*state)
        if stepped < math.inf:
            met += 1
            assert stepped - 1.1e-3 <= exact <= stepped + 1e-9
        else:
            assert exact > 39.9
    assert met > 5


# --- decelerations --------------------------------------------------------------------------------


def test_required_deceleration_follows_what_the_front_does() -> None:
    assert_worth(
        subject.required_deceleration,
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
        subject.required_deceleration(gap, front + shift + closing, front + shift, -braking)
        for shift in (-1e-9, 0.0, 1e-9)
    )
    assert below == pytest.approx(at, rel=1e-9)
    assert above == pytest.approx(at, rel=1e-9)
    assert at == near(braking + closing**2 / (2.0 * gap))


def test_required_deceleration_is_enough_and_no_more() -> None:
    tried = 0
    for gap, rear, front, _, front_a in random_following(25):
        demand = subject.required_deceleration(gap, rear, front, front_a)
        if demand < 0.05:
            continue
        tried += 1
        _, least = simulate(gap, rear, front, -demand * (1.0 + 1e-6), front_a, 800.0)
        _, touching = simulate(gap, rear, front, -demand * 0.98, front_a, 800.0)
        assert least >= -1e-6
        assert touching <= 1e-6
    assert tried > 8


# --- stopping distances ---------------------------------------------------------------------------


def test_stopping_distance_is_the_published_one() -> None:
    for delay, deceleration, *golden in (
        (0.35, 6.0, 20.9, 29.0, 48.9, 74.0, 121.3),
        (0.5, 5.0, 26.2, 36.1, 60.5, 91.0, 148.5),
        (1.0, 4.0, 38.0, 51.4, 84.0, 124.2, 199.1),
    ):
        for kmh, printed in zip((50, 60, 80, 100, 130), golden, strict=True):
            speed = kmh * KMH
            way = subject.stopping_distance(speed, delay, deceleration)
            assert way == pytest.approx(printed, abs=0.0501)
            assert way == near(speed * delay + speed**2 / (2.0 * deceleration))
    assert_worth(subject.stopping_distance, ((0.0, 1.0, 4.0), 0.0), ((10.0, 0.0, 0.0), INF))


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
            distance = subject.rss_longitudinal_distance(rear, front, *parameters)
            assert distance == pytest.approx(printed, abs=5.1e-4)
            faster = rear + rho * acceleration
            own = rear * rho + acceleration * rho**2 / 2.0 + faster**2 / (2.0 * least)
            assert distance == near(own - front**2 / (2.0 * most))


def test_longitudinal_distance_of_rss_is_kept_by_the_worst_case() -> None:
    # Rear accelerates for 1 s and brakes at 4, front brakes at 8: they end exactly in touch.
    gap = subject.rss_longitudinal_distance(30.0, 20.0, *CONSERVATIVE)
    assert gap + 20.0**2 / 16.0 == near(30.0 + 0.5 * 3.5 + 33.5**2 / 8.0)


def test_rss_within_its_limits() -> None:
    # Up to 21 m/s in 2/7 s, the rest of the second at 21 m/s, then 21^2 / 8 to standstill.
    way = 20.5 * 2.0 / 7.0 + 21.0 * 5.0 / 7.0 + 21.0**2 / 8.0
    assert_worth(
        subject.rss_longitudinal_distance,
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
    assert subject.rss_longitudinal_distance(20.0, 0.0, 1.0, 3.5, 4.0, 0.0) > 0.0
    own, other = 20.0 + 1.75 + 23.5**2 / 6.0, 10.0 + 1.75 + 13.5**2 / 8.0
    assert_worth(
        subject.rss_opposite_distance,
        ((20.0, 10.0, 1.0, 3.5, 3.0, 4.0), near(own + other)),
        ((20.0, 20.0, 1.0, 3.5, 4.0, 4.0, 3.0, 21.0), pytest.approx(2.0 * way + 3.0)),
    )


def test_printed_definition_is_the_same_for_who_comes_nearer_and_never_asks_for_less() -> None:
    for speeds in ((0.0, 0.0), (1.3, 0.0), (0.7, -0.4), (0.0, 0.2)):
        state = (*speeds, *BESIDE)
        assert subject.rss_lateral_distance(*state) == subject.rss_lateral_distance(*state, True)  # noqa: FBT003
    more = 0
    for one in range(-30, 31):
        for two in range(-30, 31):
            state = (0.1 * one, 0.1 * two, *BESIDE)
            reference, printed = (
                subject.rss_lateral_distance(*state),
                subject.rss_lateral_distance(*state, True),  # noqa: FBT003
            )
            assert printed >= reference
            more += printed > reference + 1.0
    assert more > 100


# --- margins of following and severity ------------------------------------------------------------


@given(st.floats(-8.0, 8.0))
@settings(max_examples=200, deadline=None)
def test_normal_share_is_that_of_the_error_function(x: float) -> None:
    assert subject.normal_share(x) == pytest.approx(0.5 * math.erfc(-x / math.sqrt(2.0)), abs=1e-15)


@given(st.floats(50.0, 4e4), st.floats(50.0, 4e4), st.floats(0.0, 60.0))
@settings(max_examples=100, deadline=None)
def test_momentum_is_kept(own: float, other: float, speed: float) -> None:
    first, second = subject.speed_change(own, other, speed), subject.speed_change(other, own, speed)
    assert first + second == pytest.approx(speed, rel=1e-9, abs=1e-12)
    assert own * first == pytest.approx(other * second, rel=1e-9, abs=1e-9)
