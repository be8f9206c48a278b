"""Closed forms of manoeuvres: profiles of pace, lateral offsets, ways along curves."""

import math

import numpy as np
import pytest

from adeye.kernel.storyboard import (
    ACROSS,
    ACTOR_WIDTH,
    ALONG,
    LIMIT,
    LINEAR,
    PACE,
    PACE_RATE,
    PATH,
    PHASES,
    SHIFT,
    SHIFT_DURATION,
    SHIFT_SHAPE,
    SINUSOIDAL,
    D,
    Floats,
    S,
    advance,
    pace_at,
    place_actor,
    plan_pace,
    shift_at,
    shift_duration,
)

RADIUS = 200.0
CURVE = np.array(
    [
        [0.0, 0.0, 0.0, 100.0, 0.0],
        [100.0, 0.0, 0.0, 300.0, 1.0 / RADIUS],
        [100.0 + RADIUS * math.sin(1.5), RADIUS * (1 - math.cos(1.5)), 1.5, 1000.0, 0.0],
    ]
)


def planned(pace: float, slope: float, target: float, rate: float, jerk: float) -> Floats:
    row = np.zeros(ACTOR_WIDTH)
    place_actor(row, 0.0, 0.0, 0.0, pace)
    row[PACE_RATE] = slope
    plan_pace(row, 0, target, rate, jerk)
    return row


def duration(row: Floats) -> float:
    return float(row[PHASES : PHASES + 9 : 3].sum())


@pytest.mark.parametrize(
    ("heading", "along", "across"),
    [(0.0, 1.0, 0.0), (math.pi, -1.0, 0.0), (math.pi / 2, 0.0, 1.0), (-math.pi / 2, 0.0, -1.0)],
)
def test_quarter_turns_are_exact(heading: float, along: float, across: float) -> None:
    row = np.zeros(ACTOR_WIDTH)
    place_actor(row, 10.0, 2.0, heading, 5.0)
    assert (row[ALONG], row[ACROSS]) == (along, across)
    assert (row[S], row[D], row[PACE], row[LIMIT]) == (10.0, 2.0, 5.0, math.inf)


@pytest.mark.parametrize("jerk", [2.0, 8.0, math.inf])
@pytest.mark.parametrize("slope", [-5.0, -1.0, 0.0, 1.0, 5.0])
@pytest.mark.parametrize("target", [0.0, 9.5, 10.0, 25.0])
def test_a_profile_ends_at_its_target_without_acceleration(
    target: float, slope: float, jerk: float
) -> None:
    row = planned(10.0, slope, target, 3.0, jerk)
    end = duration(row)
    _, pace, _ = pace_at(row, end * (1.0 - 1e-12))
    assert pace == pytest.approx(target, abs=1e-8)
    assert pace_at(row, end + 1.0)[1:] == (target, 0.0)


@pytest.mark.parametrize("jerk", [2.0, 8.0, math.inf])
@pytest.mark.parametrize("target", [0.0, 9.5, 25.0])
def test_way_is_the_integral_of_pace_and_pace_of_its_rate(target: float, jerk: float) -> None:
    row = planned(10.0, 0.0, target, 3.0, jerk)
    times = np.linspace(0.0, duration(row) + 1.0, 40_001)
    way, pace, slope = np.array([pace_at(row, float(t)) for t in times]).T
    step = times[1]
    ways = np.cumsum(0.5 * (pace[1:] + pace[:-1])) * step
    np.testing.assert_allclose(way[1:], ways, atol=1e-6)
    paces = 10.0 + np.cumsum(0.5 * (slope[1:] + slope[:-1])) * step
    np.testing.assert_allclose(pace[1:], paces, atol=1e-3)


def test_the_rate_is_kept_and_taken_back_when_it_was_greater() -> None:
    row = planned(10.0, 5.0, 40.0, 3.0, 4.0)
    slopes = [pace_at(row, t)[2] for t in np.linspace(0.0, duration(row), 500)]
    assert slopes[0] == 5.0
    assert max(slopes) == 5.0
    after = [pace_at(row, t)[2] for t in np.linspace(0.5, duration(row), 500)]
    assert max(after) == pytest.approx(3.0)


def test_a_triangle_of_jerk_lasts_twice_the_root_of_change_over_jerk() -> None:
    assert duration(planned(10.0, 0.0, 10.5, 3.0, 2.0)) == pytest.approx(2 * math.sqrt(0.5 / 2.0))


def test_nothing_to_change_takes_no_time() -> None:
    for jerk in (4.0, math.inf):
        row = planned(10.0, 0.0, 10.0, 3.0, jerk)
        assert duration(row) == 0.0
        assert pace_at(row, 2.0) == (20.0, 10.0, 0.0)


def test_a_new_plan_keeps_what_is_left_of_the_way_to_a_stop() -> None:
    row = np.zeros(ACTOR_WIDTH)
    place_actor(row, 0.0, 0.0, 0.0, 1.0)
    row[LIMIT] = 7.0
    row[PATH] = 3.0  # way driven so far
    plan_pace(row, 10, 0.0, 1.0, math.inf)
    assert row[LIMIT] == 4.0
    assert row[PATH] == 0.0


def test_the_offset_of_a_lane_change_has_the_rate_and_acceleration_of_its_derivatives() -> None:
    row = np.zeros(ACTOR_WIDTH)
    for shape in (SINUSOIDAL, LINEAR):
        row[SHIFT], row[SHIFT_SHAPE] = -3.5, shape
        row[SHIFT_DURATION] = end = shift_duration(-3.5, 0.8, shape)
        h = 1e-5
        for t in np.linspace(0.1, end - 0.1, 7):
            before, now, after = (shift_at(row, t + d) for d in (-h, 0.0, h))
            assert now[1] == pytest.approx((after[0] - before[0]) / (2 * h), abs=1e-8)
            assert now[2] == pytest.approx((after[1] - before[1]) / (2 * h), abs=1e-8)
            assert abs(now[1]) <= 0.8 + 1e-12
        assert shift_at(row, end) == (-3.5, 0.0, 0.0)


def test_a_lane_change_of_no_distance_takes_no_time() -> None:
    assert shift_duration(0.0, 1.0, SINUSOIDAL) == 0.0
    assert shift_at(np.zeros(ACTOR_WIDTH), 0.0) == (0.0, 0.0, 0.0)


def test_on_the_inside_of_a_curve_the_same_speed_gets_further_along_the_road() -> None:
    assert advance(CURVE, 150.0, 10.0, 19.0) == pytest.approx(150.0 + 20.0)
    assert advance(CURVE, 150.0, -10.0, 21.0) == pytest.approx(150.0 + 20.0)


@pytest.mark.parametrize("way", [1.0, 55.0, 250.0, 400.0, 800.0])
def test_driving_back_the_same_way_ends_where_it_began(way: float) -> None:
    there = advance(CURVE, 60.0, 5.25, way)
    assert there > 60.0
    assert advance(CURVE, there, 5.25, -way) == pytest.approx(60.0, abs=1e-10)
