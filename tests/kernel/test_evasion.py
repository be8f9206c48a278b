"""Last moments to evade: closed forms, seams, and simulated manoeuvres that begin then."""

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from adeye.kernel.encounter import (
    evasive_offset,
    steer_threat_number,
    time_to_brake,
    time_to_kickdown,
    time_to_react,
    time_to_steer,
)

INF = math.inf


def test_braking_behind_a_steady_front_has_its_closed_form() -> None:
    assert time_to_brake(20.0, 5.0, 20.0, INF, 8.0) == pytest.approx(
        20.0 / 5.0 - 5.0 / 16.0, rel=1e-12
    )


@given(st.floats(1.0, 80.0), st.floats(0.5, 30.0), st.floats(2.0, 10.0))
@settings(max_examples=100, deadline=None)
def test_braking_then_just_touches(gap: float, closing: float, braking: float) -> None:
    wait = time_to_brake(gap, closing, 40.0, INF, braking)
    assert closing * wait + closing * closing / (2.0 * braking) == pytest.approx(gap, rel=1e-9)
    assert wait <= gap / closing
    assert time_to_brake(gap + 1.0, closing, 40.0, INF, braking) > wait
    assert time_to_brake(gap, closing, 40.0, INF, braking + 1.0) > wait
    # Lengths doubled, times kept: speeds and decelerations double as well.
    assert time_to_brake(2.0 * gap, 2.0 * closing, 80.0, INF, 2.0 * braking) == wait


def test_braking_for_who_crosses_lets_him_pass() -> None:
    # He leaves after 2.5 s; at 10 m/s the gap of 20 m is used up after 2 s.
    wait = time_to_brake(20.0, 10.0, 10.0, 2.5, 4.0)
    late = 2.5 - wait
    assert 10.0 * 2.5 - 2.0 * late * late == pytest.approx(20.0, rel=1e-12)
    assert wait > time_to_brake(20.0, 10.0, 10.0, INF, 4.0)
    assert time_to_brake(20.0, 10.0, 10.0, 1.9, 4.0) == INF


def test_braking_does_not_help_against_who_comes() -> None:
    assert time_to_brake(50.0, 30.0, 15.0, INF, 8.0) == -INF


def test_ego_that_stands_in_time_lets_him_pass_who_comes_and_crosses() -> None:
    # He comes 18 m nearer before he is gone; 1.75 m at 2 m/s and 0.25 m of braking are left.
    assert time_to_brake(20.0, 8.0, 2.0, 3.0, 8.0) == pytest.approx(0.875, rel=1e-12)
    # 24 m: braking should have begun 2.125 s ago, with the ego 4.25 m farther back.
    assert time_to_brake(20.0, 8.0, 2.0, 4.0, 8.0) == pytest.approx(-2.125, rel=1e-12)
    assert time_to_brake(20.0, 6.0, 0.0, 4.0, 8.0) == -INF


def test_braking_for_who_comes_slowly_tends_to_that_for_who_only_crosses() -> None:
    # The ego stands for him before he has left.
    steady = time_to_brake(20.0, 5.0, 5.0, 9.0, 8.0)
    assert time_to_brake(20.0, 5.0 + 1e-9, 5.0, 9.0, 8.0) == pytest.approx(steady, abs=1e-8)


def test_no_conflict_is_infinite_and_contact_never() -> None:
    assert time_to_brake(20.0, 0.0, 20.0, INF, 8.0) == INF
    assert time_to_brake(0.0, 5.0, 20.0, INF, 8.0) == -INF
    assert time_to_kickdown(20.0, -1.0, 8.0, 1.0, 3.0) == INF
    assert time_to_steer(INF, 2.0, 8.0) == INF


@given(st.floats(5.0, 60.0), st.floats(2.0, 30.0), st.floats(0.5, 8.0), st.floats(1.0, 5.0))
@settings(max_examples=100, deadline=None)
def test_kickdown_then_is_just_past(gap: float, speed: float, enter: float, most: float) -> None:
    wait = time_to_kickdown(gap, speed, 8.0, enter, most)
    assume(wait < INF)
    late = enter - wait
    assert speed * enter + 0.5 * most * late * late == pytest.approx(gap + 8.0, rel=1e-9)


def test_kickdown_never_helps_against_who_is_there() -> None:
    assert time_to_kickdown(20.0, 10.0, 8.0, -1.0, 3.0) == -INF
    assert time_to_kickdown(20.0, 10.0, 8.0, -INF, 3.0) == -INF
    assert time_to_kickdown(20.0, 10.0, 8.0, 3.0, 3.0) == INF


def test_steering_has_its_closed_form() -> None:
    assert time_to_steer(4.0, 2.0, 8.0) == pytest.approx(4.0 - math.sqrt(0.5), rel=1e-12)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
@settings(max_examples=100, deadline=None)
def test_way_aside_is_the_same_on_a_mirrored_road(beside: float, drift: float) -> None:
    assert evasive_offset(beside, drift, 2.0) == evasive_offset(-beside, -drift, 2.0)
    assert evasive_offset(beside, drift, 2.0) >= evasive_offset(beside, 0.0, 2.0) - 1e-12 or (
        abs(beside + drift) > abs(beside)
    )


def test_way_aside_of_a_body_straight_ahead_is_both_half_widths() -> None:
    assert evasive_offset(0.0, 0.0, 2.0) == 2.0
    assert evasive_offset(0.5, 0.0, 2.0) == 1.5
    assert evasive_offset(2.5, 0.0, 2.0) == 0.0


def test_best_manoeuvre_counts() -> None:
    assert time_to_react(1.0, 2.0, -INF) == 2.0
    assert math.isnan(time_to_react(1.0, math.nan, 3.0))


def test_steer_threat_number_is_one_at_the_last_moment() -> None:
    arrival = math.sqrt(2.0 * 2.0 / 8.0)
    assert time_to_steer(arrival, 2.0, 8.0) == pytest.approx(0.0, abs=1e-12)
    assert steer_threat_number(arrival, 2.0, 8.0) == pytest.approx(1.0, rel=1e-12)
    assert steer_threat_number(INF, 2.0, 8.0) == 0.0
    assert steer_threat_number(0.0, 2.0, 8.0) == INF


def test_unknown_number_stays_one() -> None:
    assert math.isnan(time_to_brake(math.nan, 5.0, 20.0, INF, 8.0))
    assert math.isnan(time_to_kickdown(20.0, math.nan, 8.0, 1.0, 3.0))
    assert math.isnan(time_to_steer(math.nan, 2.0, 8.0))
    assert math.isnan(steer_threat_number(1.0, math.nan, 8.0))
