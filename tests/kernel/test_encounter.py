"""Encounters in the plane: closed forms, laws, and what a search in small steps finds."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from adeye.kernel import encounter
from adeye.kernel.boxes import Extent, Vector, box_distance

CAR = (0.0, 4.0, 2.0)
Pair = tuple[Vector, Vector, Extent, Extent]
bodies = st.tuples(st.floats(-3.2, 3.2), st.floats(1.0, 8.0), st.floats(0.5, 3.0))
placed = st.tuples(
    st.tuples(*[st.floats(-40.0, 40.0)] * 2),
    st.tuples(*[st.floats(-20.0, 20.0)] * 2),
    bodies,
    bodies,
)


def distance_at(pair: Pair, time: float) -> float:
    (dx, dy), (rate_x, rate_y), own, other = pair
    return box_distance((0.0, 0.0, *own), (dx + rate_x * time, dy + rate_y * time, *other))


def test_following_is_the_one_dimensional_time() -> None:
    # Centres 24 m apart, 4 m long: a gap of 20 m that closes with 5 m/s.
    assert encounter.planar_time_to_collision((24.0, 0.0), (-5.0, 0.0), CAR, CAR) == pytest.approx(
        4.0, rel=1e-12
    )
    assert encounter.planar_time_to_collision((24.0, 1.99), (-5.0, 0.0), CAR, CAR) == pytest.approx(
        4.0
    )
    assert encounter.planar_time_to_collision((24.0, 2.01), (-5.0, 0.0), CAR, CAR) == math.inf


def test_turned_box_is_met_at_its_corner() -> None:
    # A square of 2 m turned by 45 degrees reaches sqrt(2) ahead.
    found = encounter.planar_time_to_collision(
        (10.0, 0.0), (-2.0, 0.0), CAR, (math.pi / 4.0, 2.0, 2.0)
    )
    assert found == pytest.approx((10.0 - 2.0 - math.sqrt(2.0)) / 2.0, rel=1e-12)


def test_thin_and_fast_crossing_does_not_tunnel() -> None:
    # 0.1 m wide across the way, 60 m/s: 6 m in a step of 0.1 s, past the ego of 2 m.
    assert encounter.planar_time_to_collision((0.0, -61.05), (0.0, 60.0), CAR, (0.0, 0.1, 0.1)) == (
        pytest.approx(1.0, rel=1e-12)
    )


@pytest.mark.slow
@given(placed)
@settings(max_examples=200, deadline=None)
def test_closest_encounter_is_where_it_says_and_nowhere_nearer(pair: Pair) -> None:
    time, distance = encounter.closest_encounter(*pair)
    assert distance_at(pair, time) == pytest.approx(distance, abs=1e-6 * (1.0 + time))
    for later in np.linspace(0.0, 12.0, 121):
        assert distance <= distance_at(pair, float(later)) + 1e-6
    assert (distance == 0.0) == (encounter.planar_time_to_collision(*pair) < math.inf)


def test_worst_case_head_on_is_a_quadratic() -> None:
    # 100 m less 5 m of both circles: 8 t^2 + 10 t = 95.
    expected = (-10.0 + math.sqrt(100.0 + 4.0 * 8.0 * 95.0)) / 16.0
    assert encounter.worst_time_to_collision(100.0, 0.0, -10.0, 0.0, 5.0, 16.0) == pytest.approx(
        expected, rel=1e-12
    )
    assert encounter.worst_time_to_collision(4.0, 0.0, 10.0, 0.0, 5.0, 16.0) == 0.0
    assert encounter.worst_time_to_collision(100.0, 3.0, -10.0, 50.0, 5.0, 0.0) == math.inf
    # Circles that touch have met, also as they part.
    assert encounter.worst_time_to_collision(5.0, 0.0, 10.0, 0.0, 5.0, 16.0) == 0.0


def test_passing_neighbour_has_its_lateral_distance() -> None:
    time, distance = encounter.closest_encounter((30.0, 3.5), (-10.0, 0.0), CAR, CAR)
    assert time == pytest.approx(2.6, rel=1e-12)
    assert distance == pytest.approx(1.5, rel=1e-12)
    time, distance = encounter.closest_encounter((30.0, 3.5), (10.0, 0.0), CAR, CAR)
    assert time == 0.0
    assert distance == pytest.approx(math.hypot(26.0, 1.5), rel=1e-12)


def test_passing_neighbour_is_nearest_first_on_a_road_of_any_heading() -> None:
    for place in range(315):
        # Sine and cosine of a heading are rounded: no edge is along the motion to the last digit.
        heading = 0.01 * place
        c, s = math.cos(heading), math.sin(heading)
        time, distance = encounter.closest_encounter(
            (50.0 * c - 5.0 * s, 50.0 * s + 5.0 * c), (-10.0 * c, -10.0 * s),
            (heading, 4.0, 2.0), (heading, 2.0, 2.0),
        )  # fmt: skip
        assert time == pytest.approx((50.0 - 2.0 - 1.0) / 10.0, rel=1e-12)
        assert distance == pytest.approx(5.0 - 1.0 - 1.0, rel=1e-12)


# --- What the ego reaches before it stands --------------------------------------------------------

GRAVITY = 9.80665


@pytest.mark.parametrize("speed", [1.0, 15.0, 36.0])
def test_dry_road_allows_emergency_braking(speed: float) -> None:
    way = speed * encounter.REACTION_TIME + speed**2 / (2.0 * encounter.BRAKING)
    assert encounter.reachable_distance(speed, 0.9) == pytest.approx(way)


def test_slippery_road_limits_the_braking() -> None:
    assert encounter.reachable_distance(20.0, 0.3) == pytest.approx(
        20.0 + 400.0 / (2.0 * 0.3 * GRAVITY)
    )


def test_it_grows_with_speed_and_falls_with_friction() -> None:
    by_speed = [encounter.reachable_distance(speed, 0.7) for speed in (0.0, 5.0, 10.0, 30.0)]
    assert by_speed == sorted(by_speed)
    assert by_speed[0] == 0.0
    by_friction = [encounter.reachable_distance(20.0, friction) for friction in (0.1, 0.3, 0.6)]
    assert by_friction == sorted(by_friction, reverse=True)


def test_unknown_speed_is_unknown() -> None:
    assert math.isnan(encounter.reachable_distance(math.nan, 0.5))


# --- Last moments to evade: closed forms, seams, and simulated manoeuvres that begin then ---------

INF = math.inf
BRAKES: list[tuple[tuple[float, ...], float]] = [
    ((20.0, 5.0, 20.0, INF, 8.0), 20.0 / 5.0 - 5.0 / 16.0),
    ((50.0, 30.0, 15.0, INF, 8.0), -INF),
    # He comes 18 m nearer before he is gone; 1.75 m at 2 m/s and 0.25 m of braking are left.
    ((20.0, 8.0, 2.0, 3.0, 8.0), 0.875),
    # 24 m: braking should have begun 2.125 s ago, with the ego 4.25 m farther back.
    ((20.0, 8.0, 2.0, 4.0, 8.0), -2.125),
    ((20.0, 6.0, 0.0, 4.0, 8.0), -INF),
    # No conflict is infinite and contact never.
    ((20.0, 0.0, 20.0, INF, 8.0), INF),
    ((0.0, 5.0, 20.0, INF, 8.0), -INF),
]


def test_braking_has_its_closed_form_and_helps_against_nobody_who_comes() -> None:
    for state, wait in BRAKES:
        assert encounter.time_to_brake(*state) == pytest.approx(wait, rel=1e-12), state


@given(st.floats(1.0, 80.0), st.floats(0.5, 30.0), st.floats(2.0, 10.0))
@settings(max_examples=100, deadline=None)
def test_braking_then_just_touches(gap: float, closing: float, braking: float) -> None:
    wait = encounter.time_to_brake(gap, closing, 40.0, INF, braking)
    assert closing * wait + closing * closing / (2.0 * braking) == pytest.approx(gap, rel=1e-9)
    assert wait <= gap / closing
    assert encounter.time_to_brake(gap + 1.0, closing, 40.0, INF, braking) > wait
    assert encounter.time_to_brake(gap, closing, 40.0, INF, braking + 1.0) > wait
    # Lengths doubled, times kept: speeds and decelerations double as well.
    assert encounter.time_to_brake(2.0 * gap, 2.0 * closing, 80.0, INF, 2.0 * braking) == wait


def test_braking_for_who_crosses_lets_him_pass() -> None:
    # He leaves after 2.5 s; at 10 m/s the gap of 20 m is used up after 2 s.
    wait = encounter.time_to_brake(20.0, 10.0, 10.0, 2.5, 4.0)
    late = 2.5 - wait
    assert 10.0 * 2.5 - 2.0 * late * late == pytest.approx(20.0, rel=1e-12)
    assert wait > encounter.time_to_brake(20.0, 10.0, 10.0, INF, 4.0)
    assert encounter.time_to_brake(20.0, 10.0, 10.0, 1.9, 4.0) == INF


def test_braking_for_who_comes_slowly_tends_to_that_for_who_only_crosses() -> None:
    # The ego stands for him before he has left.
    steady = encounter.time_to_brake(20.0, 5.0, 5.0, 9.0, 8.0)
    slowly = encounter.time_to_brake(20.0, 5.0 + 1e-9, 5.0, 9.0, 8.0)
    assert slowly == pytest.approx(steady, abs=1e-8)


@given(st.floats(5.0, 60.0), st.floats(2.0, 30.0), st.floats(0.5, 8.0), st.floats(1.0, 5.0))
@settings(max_examples=100, deadline=None)
def test_kickdown_then_is_just_past(gap: float, speed: float, enter: float, most: float) -> None:
    wait = encounter.time_to_kickdown(gap, speed, 8.0, enter, most)
    assume(wait < INF)
    late = enter - wait
    assert speed * enter + 0.5 * most * late * late == pytest.approx(gap + 8.0, rel=1e-9)
