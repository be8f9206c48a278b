"""Last moments to evade: closed forms, seams, and simulated manoeuvres that begin then."""

import math
from collections.abc import Callable
from typing import Any

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


def assert_worth(form: Callable[..., float], *scenes: tuple[tuple[float, ...], Any]) -> None:
    """Each scene, the arguments of a form, has its answer."""
    for arguments, expected in scenes:
        assert form(*arguments) == expected, (form.__name__, arguments)


def near(value: float) -> Any:
    return pytest.approx(value, rel=1e-12)


def test_braking_has_its_closed_form_and_helps_against_nobody_who_comes() -> None:
    assert_worth(
        time_to_brake,
        ((20.0, 5.0, 20.0, INF, 8.0), near(20.0 / 5.0 - 5.0 / 16.0)),
        ((50.0, 30.0, 15.0, INF, 8.0), -INF),
        # He comes 18 m nearer before he is gone; 1.75 m at 2 m/s and 0.25 m of braking are left.
        ((20.0, 8.0, 2.0, 3.0, 8.0), near(0.875)),
        # 24 m: braking should have begun 2.125 s ago, with the ego 4.25 m farther back.
        ((20.0, 8.0, 2.0, 4.0, 8.0), near(-2.125)),
        ((20.0, 6.0, 0.0, 4.0, 8.0), -INF),
        # No conflict is infinite and contact never.
        ((20.0, 0.0, 20.0, INF, 8.0), INF),
        ((0.0, 5.0, 20.0, INF, 8.0), -INF),
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
    assert 10.0 * 2.5 - 2.0 * late * late == near(20.0)
    assert wait > time_to_brake(20.0, 10.0, 10.0, INF, 4.0)
    assert time_to_brake(20.0, 10.0, 10.0, 1.9, 4.0) == INF


def test_braking_for_who_comes_slowly_tends_to_that_for_who_only_crosses() -> None:
    # The ego stands for him before he has left.
    steady = time_to_brake(20.0, 5.0, 5.0, 9.0, 8.0)
    assert time_to_brake(20.0, 5.0 + 1e-9, 5.0, 9.0, 8.0) == pytest.approx(steady, abs=1e-8)


@given(st.floats(5.0, 60.0), st.floats(2.0, 30.0), st.floats(0.5, 8.0), st.floats(1.0, 5.0))
@settings(max_examples=100, deadline=None)
def test_kickdown_then_is_just_past(gap: float, speed: float, enter: float, most: float) -> None:
    wait = time_to_kickdown(gap, speed, 8.0, enter, most)
    assume(wait < INF)
    late = enter - wait
    assert speed * enter + 0.5 * most * late * late == pytest.approx(gap + 8.0, rel=1e-9)


def test_kickdown_steering_and_the_best_of_all() -> None:
    assert_worth(
        time_to_kickdown,
        ((20.0, -1.0, 8.0, 1.0, 3.0), INF),
        # It never helps against who is there.
        ((20.0, 10.0, 8.0, -1.0, 3.0), -INF),
        ((20.0, 10.0, 8.0, -INF, 3.0), -INF),
        ((20.0, 10.0, 8.0, 3.0, 3.0), INF),
    )
    arrival = math.sqrt(2.0 * 2.0 / 8.0)
    assert_worth(
        time_to_steer,
        ((4.0, 2.0, 8.0), near(4.0 - math.sqrt(0.5))),
        ((INF, 2.0, 8.0), INF),
        ((arrival, 2.0, 8.0), pytest.approx(0.0, abs=1e-12)),
    )
    # It is one at the last moment.
    assert_worth(
        steer_threat_number,
        ((arrival, 2.0, 8.0), near(1.0)),
        ((INF, 2.0, 8.0), 0.0),
        ((0.0, 2.0, 8.0), INF),
    )
    assert time_to_react(1.0, 2.0, -INF) == 2.0


def test_way_aside_of_a_body_straight_ahead_is_both_half_widths() -> None:
    assert_worth(
        evasive_offset, ((0.0, 0.0, 2.0), 2.0), ((0.5, 0.0, 2.0), 1.5), ((2.5, 0.0, 2.0), 0.0)
    )


def test_unknown_number_stays_one() -> None:
    assert math.isnan(time_to_brake(math.nan, 5.0, 20.0, INF, 8.0))
    assert math.isnan(time_to_kickdown(20.0, math.nan, 8.0, 1.0, 3.0))
    assert math.isnan(time_to_steer(math.nan, 2.0, 8.0))
    assert math.isnan(steer_threat_number(1.0, math.nan, 8.0))
    assert math.isnan(time_to_react(1.0, math.nan, 3.0))
