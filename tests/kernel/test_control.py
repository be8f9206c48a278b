"""Control laws: equilibria, signs, and convergence in closed loop with the motion of the ego."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel import motion as control
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.motion import advance_ego
from adeye.kernel.road import local, offset_curvature, position

Floats = NDArray[np.float64]

STRAIGHT = np.array([[0.0, 0.0, 0.0, 5000.0, 0.0]])
IDM = (30.0, 1.5, 2.0, 1.4, 2.0, 4.0, 9.0)
GAINS = (2.8, 1.4, 0.8, 6.0)
"""Wheelbase, rear axle to the centre, and gains of the law."""
VEHICLE = (2.8, 1.4, 4.0, 9.0, 0.6, 0.6, 0.2, 0.1, 1.0)


def keep_lane(segments: Floats, speed: float, d: float, start: Floats, duration: float) -> Floats:
    """Drive at constant speed; return the lateral error of every tick."""
    state = start.copy()
    errors = []
    for _ in range(round(duration / 0.05)):
        s, now, heading, curvature = local(segments, state[0], state[1])
        assert s < 5000.0
        errors.append(now - d)
        turned, bend = wrap_to_pi(state[2] - heading), offset_curvature(curvature, d)
        steering = control.lane_keeping_steering(now - d, turned, bend, speed, *GAINS, 4.0, 0.6)
        advance_ego(state, 0.0, steering, 0.05, *VEHICLE, state)
    return np.array(errors)


def at(segments: Floats, s: float, d: float, speed: float, turn: float = 0.0) -> Floats:
    x, y, heading = position(segments, s, d)
    return np.array([x, y, heading + turn, speed, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("speed", [5.0, 15.0, 30.0, 45.0, 60.0])
def test_lane_is_reached_without_much_overshoot(speed: float) -> None:
    errors = keep_lane(STRAIGHT, speed, 1.75, at(STRAIGHT, 0.0, 2.75, speed), 15.0)
    assert errors[0] == 1.0
    assert abs(errors[-1]) < 1e-3
    assert errors.min() > -0.05


@pytest.mark.parametrize("speed", [5.0, 15.0, 30.0, 60.0])
def test_heading_error_is_damped(speed: float) -> None:
    errors = keep_lane(STRAIGHT, speed, 1.75, at(STRAIGHT, 0.0, 1.75, speed, 0.02), 15.0)
    assert abs(errors[-1]) < 1e-3
    assert errors.min() > -0.05
    assert errors.max() < 0.02 * max(speed, 10.0)


@pytest.mark.parametrize(("speed", "radius"), [(5.0, 20.0), (15.0, 100.0), (30.0, -400.0)])
def test_curve_is_held_without_standing_error(speed: float, radius: float) -> None:
    curve = np.array([[0.0, 0.0, 0.0, 5000.0, 1.0 / radius]])
    errors = keep_lane(curve, speed, 1.75, at(curve, 0.0, 1.75, speed), 12.0)
    assert abs(errors[-1]) < 1e-3
    assert np.abs(errors).max() < 0.35


def test_far_from_the_lane_the_approach_is_bounded() -> None:
    errors = keep_lane(STRAIGHT, 10.0, 1.75, at(STRAIGHT, 0.0, 41.75, 10.0), 40.0)
    assert np.diff(errors).min() > -10.0 * 0.05 * math.sin(0.32)
    assert abs(errors[-1]) < 1e-3
    assert errors.min() > -0.05


def test_steering_is_straight_on_the_path_and_back_to_it_within_its_limits() -> None:
    assert control.lane_keeping_steering(0.0, 0.0, 0.0, 20.0, *GAINS, 4.0, 0.6) == 0.0
    right = control.lane_keeping_steering(0.5, 0.0, 0.0, 20.0, *GAINS, 4.0, 0.6)
    left = control.lane_keeping_steering(-0.5, 0.0, 0.0, 20.0, *GAINS, 4.0, 0.6)
    assert left == -right > 0.0
    angle = control.lane_keeping_steering(-9.0, -1.0, 0.0, 30.0, *GAINS, 3.0, 0.6)
    assert 900.0 * math.tan(angle) / 2.8 == pytest.approx(3.0, rel=1e-12)
    assert control.lane_keeping_steering(-9.0, -1.0, 0.2, 2.0, *GAINS, 30.0, 0.6) == 0.6


def test_unknown_number_gives_no_angle_and_no_acceleration() -> None:
    for place in range(4):
        seen = [0.1, 0.0, 0.001, 20.0]
        seen[place] = math.nan
        error, heading, curvature, speed = seen
        angle = control.lane_keeping_steering(error, heading, curvature, speed, *GAINS, 4.0, 0.6)
        assert math.isnan(angle)
    for place in range(3):
        followed = [10.0, 30.0, 10.0]
        followed[place] = math.nan
        speed, gap, front = followed
        assert math.isnan(control.idm_acceleration(speed, gap, front, *IDM))


def test_idm_equals_its_formula() -> None:
    desired = 2.0 + 20.0 * 1.5 + 20.0 * 5.0 / (2.0 * math.sqrt(1.4 * 2.0))
    following = 1.4 * (1.0 - (20.0 / 30.0) ** 4 - (desired / 80.0) ** 2)
    # A faster front does not shorten the gap of standstill.
    behind_faster = 1.4 * (1.0 - (10.0 / 30.0) ** 4 - (2.0 / 20.0) ** 2)
    at_rest = (0.0, *IDM[1:])
    for state, expected in (
        ((0.0, math.inf, 0.0, *IDM), 1.4),
        ((30.0, math.inf, 0.0, *IDM), 0.0),
        ((15.0, math.inf, 0.0, *IDM), pytest.approx(1.4 * (1.0 - 0.5**4))),
        ((20.0, 80.0, 15.0, *IDM), pytest.approx(following, rel=1e-12)),
        ((10.0, 20.0, 60.0, *IDM), pytest.approx(behind_faster, rel=1e-12)),
        # Contact, and no desired speed, are full braking.
        ((10.0, 0.0, 10.0, *IDM), -9.0),
        ((10.0, -1.0, 10.0, *IDM), -9.0),
        ((10.0, math.inf, 0.0, *at_rest), -9.0),
        ((0.0, math.inf, 0.0, *at_rest), 0.0),
    ):
        assert control.idm_acceleration(*state) == expected, state


def test_idm_brakes_more_the_nearer_and_the_faster() -> None:
    gaps = [control.idm_acceleration(20.0, float(gap), 15.0, *IDM) for gap in range(20, 200)]
    speeds = [control.idm_acceleration(float(v), 60.0, 15.0, *IDM) for v in range(40)]
    assert gaps == sorted(gaps)
    assert speeds == sorted(speeds, reverse=True)


def test_idm_stops_behind_a_standing_vehicle() -> None:
    state = at(STRAIGHT, 0.0, 1.75, 25.0)
    gaps = []
    for _ in range(1200):
        gaps.append(200.0 - state[0])
        wanted = control.idm_acceleration(state[3], gaps[-1], 0.0, *IDM)
        advance_ego(state, wanted, 0.0, 0.05, *VEHICLE, state)
    assert min(gaps) > 1.5
    assert gaps[-1] == pytest.approx(2.0, abs=0.5)
    assert state[3] < 0.05


def test_jerk_is_limited_both_ways() -> None:
    assert control.limit_jerk(0.0, 5.0, 10.0, 0.05) == 0.5
    assert control.limit_jerk(0.0, -5.0, 10.0, 0.05) == -0.5
    assert control.limit_jerk(0.0, 0.2, 10.0, 0.05) == 0.2
    assert math.isnan(control.limit_jerk(0.0, math.nan, 10.0, 0.05))
