"""The library of stops: their ways, their limits, and how their ends are rated."""

import math
from itertools import pairwise

import numpy as np
import pytest

from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_ROW,
    PATH_TARGET,
    PROFILE_ROW,
    PROFILE_S,
    PROFILE_SPEED,
    at_path,
)
from adeye.kernel.stops import (
    DEFAULT_RULES,
    IN_LANE,
    LAID_PATHS,
    LATERAL_ACCELERATION,
    LATERAL_JERK,
    ONSET_JERK,
    REFUGE,
    RIGHT_LANE,
    SHOULDER,
    STOP_INTERVAL,
    STOP_LEVELS,
    STOP_SAMPLES,
    STRAIGHT,
    fill_stop,
    fits_limits,
    lateral_movement,
    lay_stops,
    rate_stop,
    stands_at,
    stop_jerk,
    stop_level,
)
from adeye.signals import Floats, parameter_record

RECORD = parameter_record(
    {
        "stop_deceleration": [4.0],
        "emergency_deceleration": 8.0,
        "lane_width": 3.5,
        "lanes": 3.0,
        "shoulder": 2.5,
        "verge": 0.0,
        "length": 4.5,
        "width": 1.8,
        "max_curvature": 0.25,
        "speed_limit": 36.1,
    }
)[0]
ROAD = np.array([[0.0, 0.0, 0.0, 2000.0, 0.0]])
NONE = np.zeros((0, 5))
RULES = np.array(DEFAULT_RULES)


def stop(
    speed: float, deceleration: float, *, jerk: float = ONSET_JERK, wait: float = 0.0
) -> Floats:
    profile = np.zeros((STOP_SAMPLES, PROFILE_ROW))
    fill_stop(speed, 0.0, deceleration, jerk, wait, profile)
    return profile


def paths(
    d: float, speed: float, *, lane: int, curvature: float = 0.0, slope: float = 0.0
) -> Floats:
    made, driven = np.zeros((LAID_PATHS, PATH_ROW)), np.full(PATH_ROW, np.nan)
    lay_stops(RECORD, 0.0, d, slope, 0.0, speed, 3.5 * (lane + 0.5), curvature, driven, made)
    return made


@pytest.mark.parametrize(
    ("kmh", "way"), [(60.0, 34.7), (80.0, 61.7), (100.0, 96.5), (130.0, 163.0)]
)
def test_stop_at_4_mps2_takes_the_way_of_the_closed_form(kmh: float, way: float) -> None:
    speed = kmh / 3.6
    assert speed * speed / 8.0 == pytest.approx(way, abs=0.05)
    # Ramp of t = a / j: the speed falls by a t / 2, the way is v t - a t² / 6.
    ramp = 4.0 / ONSET_JERK
    later = speed - 2.0 * ramp
    exact = speed * ramp - 4.0 * ramp * ramp / 6.0 + later * later / 8.0
    assert stop(speed, 4.0)[-1, PROFILE_S] == pytest.approx(exact, rel=1e-12)
    assert stop(speed, 4.0, jerk=1e9)[-1, PROFILE_S] == pytest.approx(way, abs=0.05)


def test_way_while_waiting_is_added() -> None:
    for wait in (0.0, 0.1, 0.3, 0.5):
        longer = stop(25.0, 4.0, wait=wait)
        assert longer[-1, PROFILE_S] - stop(25.0, 4.0)[-1, PROFILE_S] == pytest.approx(25.0 * wait)
        assert (np.diff(longer[:, PROFILE_S]) >= 0.0).all()
        assert longer[0, PROFILE_S] <= 25.0 * STOP_INTERVAL + 1e-9


def test_who_stands_while_waiting_stays() -> None:
    profile = np.zeros((STOP_SAMPLES, PROFILE_ROW))
    fill_stop(0.4, -4.0, 4.0, ONSET_JERK, 0.5, profile)
    assert profile[:, PROFILE_S] == pytest.approx(0.4 * 0.4 / 8.0)
    assert stands_at(profile) == 0


def test_levels_rise_from_gentle_to_emergency() -> None:
    assert [stop_level(RECORD, level) for level in range(STOP_LEVELS)] == [2.4, 4.0, 6.0, 8.0]
    assert [stop_jerk(level) > 20.0 for level in range(STOP_LEVELS)] == [False, False, True, True]


def test_gentlest_stop_from_130_kmh_stands_within_the_horizon() -> None:
    assert stands_at(stop(130.0 / 3.6, 2.4)) < STOP_SAMPLES
    assert stands_at(stop(60.0, 2.4)) == STOP_SAMPLES


@pytest.mark.slow
@pytest.mark.parametrize("speed", [3.0, 8.0, 15.0, 25.0, 36.1])
@pytest.mark.parametrize("level", range(STOP_LEVELS))
def test_no_stop_to_the_side_leaves_its_lateral_limits(speed: float, level: int) -> None:
    """At ten times as many places as the planner looks at."""
    acceleration = stop_level(RECORD, level)
    for row in (IN_LANE, RIGHT_LANE, SHOULDER):
        path = paths(5.5, speed, lane=1)[row]
        for share in np.linspace(0.0, 1.0, 800, endpoint=False):
            now = speed * math.sqrt(1.0 - share)
            way = share * speed * speed / (2.0 * acceleration)
            aside, jerk = lateral_movement(path, way, now, -acceleration)
            assert abs(aside) <= LATERAL_ACCELERATION
            assert abs(jerk) <= LATERAL_JERK
        assert fits_limits(RECORD, NONE, path, 0.0, stop(speed, acceleration), 5.5)


def test_turned_hard_aside_no_stop_to_the_shoulder_is_within_the_limits() -> None:
    path = paths(1.75, 25.0, lane=0, slope=0.3)[SHOULDER]
    assert not fits_limits(RECORD, NONE, path, 0.0, stop(25.0, 4.0), 1.75)


def test_shoulder_and_right_lane_are_where_they_are() -> None:
    made = paths(5.25, 20.0, lane=1)
    assert made[SHOULDER, PATH_TARGET] == -1.25
    assert made[RIGHT_LANE, PATH_TARGET] == 1.75
    assert paths(1.75, 20.0, lane=0)[RIGHT_LANE, PATH_EXISTS] == 0.0


def test_narrow_shoulder_is_none() -> None:
    narrow = RECORD.copy()
    narrow["shoulder"] = 1.5
    made = np.zeros((LAID_PATHS, PATH_ROW))
    lay_stops(narrow, 0.0, 1.75, 0.0, 0.0, 20.0, 1.75, 0.0, np.full(PATH_ROW, np.nan), made)
    assert [made[row, PATH_EXISTS] for row in range(REFUGE)] == [1.0, 1.0, 0.0, 0.0]


@pytest.mark.slow
def test_in_a_curve_the_lane_is_followed_and_straight_on_leaves_the_road() -> None:
    made = paths(1.75, 30.0, lane=0, curvature=1.0 / 300.0)
    assert at_path(made[IN_LANE], 100.0)[0] == pytest.approx(1.75)
    assert at_path(made[STRAIGHT], 60.0)[0] == pytest.approx(1.75 - 60.0**2 / 600.0)
    profile = stop(30.0, 4.0)
    assert fits_limits(RECORD, NONE, made[IN_LANE], 0.0, profile, 1.75)
    assert not fits_limits(RECORD, NONE, made[STRAIGHT], 0.0, profile, 1.75)


def test_ends_are_rated_by_their_place() -> None:
    profile = stop(20.0, 2.4)
    made = paths(1.75, 20.0, lane=0)
    rated = [rate_stop(RECORD, RULES, ROAD, NONE, 0.0, made[row], profile) for row in range(REFUGE)]
    assert (rated[IN_LANE], rated[STRAIGHT], rated[SHOULDER]) == (3.0, 3.0, 1.0)
    assert (
        rate_stop(RECORD, RULES, ROAD, NONE, 0.0, paths(5.25, 20.0, lane=1)[IN_LANE], profile)
        == 5.0
    )


def test_stop_that_ends_half_way_to_the_shoulder_is_rated_by_the_lane() -> None:
    path, hard = paths(1.75, 30.0, lane=0)[SHOULDER], stop(30.0, 8.0, jerk=100.0)
    d = at_path(path, hard[-1, PROFILE_S])[0]
    assert -1.0 < d < 1.0
    assert rate_stop(RECORD, RULES, ROAD, NONE, 0.0, path, hard) == 3.0


def test_speed_falls_and_the_way_ends_with_it() -> None:
    profile = stop(20.0, 6.0)
    assert all(later <= sooner for sooner, later in pairwise(profile[:, PROFILE_SPEED]))
    first = stands_at(profile)
    assert (profile[first:, PROFILE_S] == profile[first, PROFILE_S]).all()
