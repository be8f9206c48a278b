"""The filter's steps: derivatives, the matrix form of a correction, the first fix."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from adeye.signals import Floats, parameter_record
from adeye.simulate.channels.perception.localisation import (
    ACCELERATION_BIAS,
    COURSE,
    HEADING,
    MAP_HEADING,
    SCRATCH,
    SPEED,
    STATES,
    YAW_RATE_BIAS,
    X,
    Y,
    begin,
    carry,
    correct,
    lateral_variance,
    predict,
)
from adeye.testing.scenes import straight_road

STATE = np.array([10.0, -4.0, 0.6, 18.0, 0.2, -0.03])
TIME = 0.05


def record(**changes: float) -> Any:
    fields = {
        "acceleration_density": 0.0,
        "yaw_rate_density": 0.0,
        "acceleration_bias": 0.0,
        "yaw_rate_bias": 0.0,
        "bias_time": 50.0,
        "lever_x": 1.9,
        "lever_y": 0.4,
        "place_variance": 0.09,
        "velocity_variance": 0.01,
    }
    return parameter_record({name: np.array([v]) for name, v in (fields | changes).items()})[0]


def after(state: Floats) -> Floats:
    moved = state.copy()
    predict(record(), moved, np.zeros((STATES, STATES)), 1.5, 0.3, TIME)
    return moved


def spread(seed: int = 0) -> Floats:
    """Return a made-up covariance: symmetric and positive."""
    root = np.array([[math.sin(seed + 1.7 * i + 0.9 * j * j) for j in range(6)] for i in range(6)])
    scales = np.diag([1.0, 1.0, 0.05, 0.5, 0.1, 0.02])
    made: Floats = scales @ (root @ root.T + np.eye(6)) @ scales
    return 0.5 * (made + made.T)


def jacobian(function: Any, count: int) -> Floats:
    columns = []
    for index in range(STATES):
        nudge = np.zeros(STATES)
        nudge[index] = 1e-5
        columns.append((function(STATE + nudge) - function(STATE - nudge)) / 2e-5)
    made: Floats = np.array(columns).T
    assert made.shape == (count, STATES)
    return made


def fix_of(state: Floats, rate: float = 0.3) -> Floats:
    """Return the fix without error of a state."""
    c, s = math.cos(state[HEADING]), math.sin(state[HEADING])
    turn = rate - state[YAW_RATE_BIAS]
    arm_x, arm_y = c * 1.9 - s * 0.4, s * 1.9 + c * 0.4
    return np.array(
        [
            state[X] + arm_x,
            state[Y] + arm_y,
            state[SPEED] * c - turn * arm_y,
            state[SPEED] * s + turn * arm_x,
        ]
    )


def test_straight_ahead_the_way_is_that_of_constant_acceleration() -> None:
    x, y, heading, speed = carry(1.0, 2.0, 0.0, 10.0, 2.0, 0.0, 3.0)
    assert (x, y, heading, speed) == pytest.approx((1.0 + 39.0, 2.0, 0.0, 16.0))


def test_steady_turn_stays_on_its_circle() -> None:
    # 10 m/s and 0.5 rad/s: a radius of 20 m.
    x, y, heading, speed = 20.0, 0.0, 0.5 * math.pi, 10.0
    for _ in range(200):
        x, y, heading, speed = carry(x, y, heading, speed, 0.0, 0.5, 0.05)
    assert math.hypot(x, y) == pytest.approx(20.0, abs=1e-4)


def test_biases_are_taken_away_and_fade() -> None:
    moved = after(STATE)
    assert moved[SPEED] == pytest.approx(18.0 + (1.5 - 0.2) * TIME)
    assert moved[HEADING] == pytest.approx(0.6 + (0.3 + 0.03) * TIME)
    assert moved[ACCELERATION_BIAS] == pytest.approx(0.2 * math.exp(-TIME / 50.0))


def test_covariance_moves_with_the_derivatives_of_the_state() -> None:
    slopes = jacobian(after, STATES)
    covariance = spread()
    expected = slopes @ covariance @ slopes.T
    predict(record(), STATE.copy(), covariance, 1.5, 0.3, TIME)
    assert covariance == pytest.approx(expected, rel=1e-5, abs=1e-7)


def test_noise_of_the_unit_adds_to_speed_and_heading_only() -> None:
    covariance = np.zeros((STATES, STATES))
    noisy = record(acceleration_density=0.04, yaw_rate_density=0.0003)
    predict(noisy, STATE.copy(), covariance, 0.0, 0.0, TIME)
    expected = np.zeros(STATES)
    expected[SPEED], expected[HEADING] = 0.04 * TIME, 0.0003 * TIME
    assert covariance == pytest.approx(np.diag(expected))


@pytest.mark.slow
def test_bias_that_is_as_unknown_as_ever_stays_so() -> None:
    covariance = np.zeros((STATES, STATES))
    covariance[YAW_RATE_BIAS, YAW_RATE_BIAS] = 0.02**2
    for _ in range(40):
        predict(record(yaw_rate_bias=0.02, bias_time=3.0), STATE.copy(), covariance, 0, 0, TIME)
    assert covariance[YAW_RATE_BIAS, YAW_RATE_BIAS] == pytest.approx(0.02**2)


@pytest.mark.slow
def test_correction_is_that_of_the_matrix_form() -> None:
    slopes = jacobian(fix_of, 4)
    covariance, state = spread(3), STATE.copy()
    rest = np.array([0.4, -0.3, 0.15, 0.2])
    noise = np.diag([0.09, 0.09, 0.01, 0.01])
    expected = slopes @ covariance @ slopes.T + noise
    gain = covariance @ slopes.T @ np.linalg.inv(expected)
    wanted_state = state + gain @ rest
    wanted = covariance - gain @ slopes @ covariance
    scratch = np.full(SCRATCH, 77.0)
    total = correct(record(), state, covariance, fix_of(STATE) + rest, 0.3, scratch)
    assert state == pytest.approx(wanted_state, rel=1e-6)
    assert covariance == pytest.approx(wanted, rel=1e-6, abs=1e-9)
    assert np.array_equal(covariance, covariance.T)
    assert total == pytest.approx(rest @ np.linalg.inv(expected) @ rest, rel=1e-6)


def test_fix_that_is_as_expected_changes_no_state() -> None:
    state, covariance = STATE.copy(), spread()
    before = np.diag(covariance).copy()
    assert correct(record(), state, covariance, fix_of(STATE), 0.3, np.zeros(SCRATCH)) < 1e-20
    assert state == pytest.approx(STATE)
    assert (np.diag(covariance) < before).all()


def begun(fix: Floats, rate: float = 0.0, **changes: float) -> tuple[Floats, Floats]:
    state, covariance = np.full(STATES, 9.0), np.full((STATES, STATES), 9.0)
    begin(record(**changes), straight_road().segments[0], state, covariance, fix, rate)
    return state, covariance


def test_moving_ego_heads_where_it_moves_and_slips_with_the_turn() -> None:
    wanted = np.array([3.0, 5.0, 0.4, 20.0, 0.0, 0.0])
    state, covariance = begun(fix_of(wanted, 0.2), 0.2)
    # The slip is taken as a small angle.
    assert state == pytest.approx(wanted, abs=2e-3)
    assert covariance[HEADING, HEADING] == pytest.approx(COURSE**2 + 0.01 / 20.0**2, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.0, 0.4])
def test_standing_ego_heads_along_its_lane(speed: float) -> None:
    # What little moves is noise, here to the left.
    state, covariance = begun(np.array([50.0, 5.0, 0.0, speed]))
    assert state[HEADING] == 0.0
    assert state[SPEED] == 0.0
    assert covariance[HEADING, HEADING] == pytest.approx(MAP_HEADING**2)


def test_noise_that_looks_like_motion_gives_no_heading() -> None:
    # 3 m/s of a receiver with 1 m/s of noise.
    assert begun(np.array([50.0, 5.0, 0.0, 3.0]), velocity_variance=1.0)[0][HEADING] == 0.0


@pytest.mark.slow
def test_first_state_knows_the_antenna_as_well_as_the_fix_whatever_its_heading() -> None:
    state, covariance = begun(np.array([50.0, 5.0, 0.0, 0.0]), bias=0.0)
    slopes = np.zeros((2, STATES))
    slopes[0, X] = slopes[1, Y] = 1.0
    c, s = math.cos(state[HEADING]), math.sin(state[HEADING])
    slopes[0, HEADING], slopes[1, HEADING] = -(s * 1.9 + c * 0.4), c * 1.9 - s * 0.4
    assert slopes @ covariance @ slopes.T == pytest.approx(0.09 * np.eye(2))


def test_lateral_deviation_is_that_across_the_heading() -> None:
    covariance = np.diag([4.0, 0.25, 0.0, 0.0, 0.0, 0.0])
    state = np.array([0.0, 0.0, 0.0, 20.0, 0.0, 0.0])
    assert lateral_variance(state, covariance, 1.4, 0.0) == pytest.approx(0.25)
    state[HEADING] = 0.5 * math.pi
    assert lateral_variance(state, covariance, 1.4, 0.0) == pytest.approx(4.0)


@pytest.mark.slow
def test_lateral_deviation_is_what_it_is_after_the_way() -> None:
    # Carried on for half a second, the covariance says the same as the shortcut.
    state, covariance = np.array([0.0, 0.0, 0.7, 20.0, 0.0, 0.0]), spread(5)
    covariance[YAW_RATE_BIAS] = covariance[:, YAW_RATE_BIAS] = 0.0
    covariance[YAW_RATE_BIAS, YAW_RATE_BIAS] = 0.01**2
    ahead = lateral_variance(state, covariance, 0.0, 0.5)
    predict(record(bias_time=1e6), state, covariance, 0.0, 0.0, 0.5)
    assert lateral_variance(state, covariance, 0.0, 0.0) == pytest.approx(ahead, rel=1e-6)
