"""Motion of the ego: closed forms, friction, standstill and the order of convergence."""

import itertools
import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel import motion

Floats = NDArray[np.float64]

X, Y, HEADING, SPEED, ACCELERATION, STEERING, YAW_RATE = range(7)
WHEELBASE = 2.8


class Ego(NamedTuple):
    """What the tests vary of the ego and its road, in the order in which the kernel takes it."""

    rate: float = 0.6
    lag: float = 0.0
    steering_lag: float = 0.0
    friction: float = 1.0


NIMBLE = Ego()


def start(
    speed: float = 0.0, acceleration: float = 0.0, steering: float = 0.0, heading: float = 0.0
) -> Floats:
    yaw_rate = speed * math.tan(steering) / WHEELBASE
    return np.array([0.0, 0.0, heading, speed, acceleration, steering, yaw_rate])


LIMITS = (WHEELBASE, 1.4, 4.0, 9.0, 0.6)
"""Wheelbase, rear axle to the centre, and what drive, brakes and steering give at most."""


def drive(
    state: Floats,
    acceleration: float,
    steering: float,
    duration: float,
    step: float = 0.05,
    ego: Ego = NIMBLE,
) -> Floats:
    """Advance under one constant command; return every state, the start included."""
    rows = [state.copy()]
    for _ in range(round(duration / step)):
        state = state.copy()
        motion.advance_ego(state, acceleration, steering, step, *LIMITS, *ego, state)
        rows.append(state)
    return np.array(rows)


@pytest.mark.parametrize("speed", [13.9, 27.8, 36.1])
@pytest.mark.parametrize("step", [0.05, 0.1])
def test_straight_stop_is_as_long_as_the_closed_form(speed: float, step: float) -> None:
    rows = drive(start(speed), -4.0, 0.0, 10.0, step)
    assert rows[-1, X] == pytest.approx(speed**2 / 8.0, rel=1e-12)
    assert rows[-1, SPEED] == 0.0
    assert rows[-1, Y] == 0.0


def test_lag_lengthens_the_stop_by_its_closed_form() -> None:
    # a = -b (1 - e^(-t/T)) from v: the way follows from integrating twice, up to v = 0.
    speed, braking, lag = 20.0, 5.0, 0.3
    times = np.linspace(0.0, 6.0, 600001)
    speeds = speed - braking * (times - lag * (1.0 - np.exp(-times / lag)))
    way = np.trapezoid(np.maximum(speeds, 0.0), times)
    rows = drive(start(speed), -braking, 0.0, 6.0, ego=Ego(lag=lag))
    assert rows[-1, X] == pytest.approx(way, abs=2e-6)


def test_standstill_stays_while_the_wheels_turn() -> None:
    rows = drive(start(0.0, steering=0.2, heading=1.0), -3.0, 0.3, 1.0, ego=Ego(lag=0.2))
    assert (rows[1:, [X, Y, SPEED, ACCELERATION, YAW_RATE]] == 0.0).all()
    assert (rows[:, HEADING] == 1.0).all()
    assert rows[-1, STEERING] == 0.3


def test_ego_comes_to_rest_within_a_step_and_does_not_reverse() -> None:
    rows = drive(start(0.1, acceleration=-4.0), -4.0, 0.0, 0.2, ego=Ego(lag=0.2))
    assert rows[1, SPEED] == 0.0
    assert rows[1, ACCELERATION] == 0.0
    assert 0.0 < rows[1, X] < 0.1 * 0.05
    assert (rows[1:] == rows[1]).all()


def test_pulling_away_while_still_braking_passes_through_standstill() -> None:
    rows = drive(start(0.02, acceleration=-4.0), 2.0, 0.0, 1.0, ego=Ego(lag=0.3))
    assert (rows[:, SPEED] >= 0.0).all()
    assert rows[1, SPEED] == 0.0
    assert rows[2, SPEED] > 0.0


def test_speed_never_falls_below_zero_whatever_is_asked() -> None:
    draw = np.random.default_rng(1)
    state = start(5.0)
    for acceleration, steering in draw.uniform([-9.0, -0.6], [4.0, 0.6], (400, 2)):
        state = drive(
            state, acceleration - 1.0, steering, 0.05, ego=Ego(lag=0.15, steering_lag=0.1)
        )[-1]
        assert state[SPEED] >= 0.0
        assert np.isfinite(state).all()


def test_limits_of_the_vehicle_hold() -> None:
    assert drive(start(10.0), 50.0, 0.0, 0.05)[-1, ACCELERATION] == 4.0
    assert drive(start(10.0), -50.0, 0.0, 0.05)[-1, ACCELERATION] == -9.0
    rows = drive(start(10.0), 0.0, 5.0, 2.0)
    assert rows[-1, STEERING] == 0.6
    assert np.diff(rows[:, STEERING]).max() <= 0.6 * 0.05 + 1e-12


def test_lag_is_the_exact_exponential_for_any_step() -> None:
    for step in (0.01, 0.05, 0.2):
        rows = drive(start(20.0), 2.0, 0.0, 0.4, step, ego=Ego(lag=0.25))
        assert rows[-1, ACCELERATION] == pytest.approx(2.0 * (1.0 - math.exp(-1.6)), rel=1e-12)


def test_circle_has_the_radius_of_the_steering_angle() -> None:
    steering = 0.1
    rear = WHEELBASE / math.tan(steering)
    rows = drive(start(8.0, steering=steering), 0.0, steering, 30.0)
    # The centre of the circle lies beside the rear axle.
    radii = np.hypot(rows[:, X] + 1.4, rows[:, Y] - rear)
    assert radii == pytest.approx(math.hypot(rear, 1.4), rel=1e-6)
    assert rows[:, YAW_RATE] == pytest.approx(8.0 / rear, rel=1e-12)


def test_heading_stays_within_half_a_turn() -> None:
    rows = drive(start(10.0, steering=0.3), 0.0, 0.3, 20.0)
    assert np.abs(rows[:, HEADING]).max() <= math.pi
    assert np.abs(np.diff(rows[:, HEADING])).max() > 6.0


@pytest.mark.parametrize("friction", [0.2, 0.5, 1.0])
def test_skid_pad_never_exceeds_the_grip(friction: float) -> None:
    rows = drive(start(5.0), 3.0, 0.25, 15.0, ego=Ego(lag=0.2, steering_lag=0.1, friction=friction))
    lateral = np.abs(rows[:, SPEED] * rows[:, YAW_RATE])
    assert lateral.max() <= friction * motion.GRAVITY * (1.0 + 1e-12)
    assert lateral.max() > 0.9 * friction * motion.GRAVITY


def test_cornering_leaves_the_rest_of_the_friction_circle() -> None:
    assert motion.friction_limited_acceleration(0.0, 0.5) == 0.5 * motion.GRAVITY
    assert motion.friction_limited_acceleration(3.0, 0.5) == pytest.approx(
        math.sqrt((0.5 * motion.GRAVITY) ** 2 - 9.0), rel=1e-12
    )
    assert motion.friction_limited_acceleration(6.0, 0.5) == 0.0


def test_slippery_road_lengthens_the_stop() -> None:
    way = drive(start(20.0), -8.0, 0.0, 20.0, ego=Ego(friction=0.3))[-1, X]
    assert way == pytest.approx(400.0 / (2.0 * 0.3 * motion.GRAVITY), rel=1e-12)


def test_braking_in_a_curve_is_weaker_than_straight_on() -> None:
    straight = drive(start(15.0), -6.0, 0.0, 0.05, ego=Ego(friction=0.6))
    curve = drive(start(15.0, steering=0.04), -6.0, 0.04, 0.05, ego=Ego(friction=0.6))
    assert straight[-1, ACCELERATION] == pytest.approx(-0.6 * motion.GRAVITY)
    assert straight[-1, ACCELERATION] < curve[-1, ACCELERATION] < 0.0


def test_without_grip_the_ego_slides_straight_on() -> None:
    rows = drive(start(10.0, steering=0.2), -6.0, 0.2, 1.0, ego=Ego(friction=0.0))
    assert rows[-1, X] == pytest.approx(10.0, rel=1e-12)
    assert rows[-1, HEADING] == 0.0
    assert rows[-1, SPEED] == 10.0


def test_gentle_curvature_is_not_cut() -> None:
    assert motion.coupled_curvature(20.0, 0.028, WHEELBASE, 1.0) == 0.01
    assert motion.coupled_curvature(20.0, 2.8, WHEELBASE, 1.0) == motion.GRAVITY / 400.0
    assert motion.coupled_curvature(20.0, -2.8, WHEELBASE, 1.0) == -motion.GRAVITY / 400.0
    assert motion.coupled_curvature(0.0, 2.8, WHEELBASE, 0.0) == 1.0


def test_convergence_is_at_least_of_second_order() -> None:
    def end(step: float) -> Floats:
        row = drive(
            start(12.0), 1.5, 0.06, 3.2, step, ego=Ego(lag=0.4, steering_lag=0.3, rate=50.0)
        )[-1]
        return np.asarray(row[[X, Y, HEADING]])

    exact = end(0.0025)
    errors = [float(np.abs(end(step) - exact).max()) for step in (0.4, 0.2, 0.1)]
    orders = [math.log2(coarse / fine) for coarse, fine in itertools.pairwise(errors)]
    assert min(orders) > 2.0
    assert errors[-1] < 1e-4


def test_mirrored_command_gives_the_mirrored_way() -> None:
    left = drive(start(12.0), 1.0, 0.1, 4.0, ego=Ego(lag=0.2, steering_lag=0.1))[-1]
    right = drive(start(12.0), 1.0, -0.1, 4.0, ego=Ego(lag=0.2, steering_lag=0.1))[-1]
    assert (left[[X, SPEED]] == right[[X, SPEED]]).all()
    assert (left[[Y, HEADING, YAW_RATE]] == -right[[Y, HEADING, YAW_RATE]]).all()


def test_turned_map_turns_the_way() -> None:
    along = drive(start(12.0), 1.0, 0.1, 4.0)[-1]
    turned = drive(start(12.0, heading=2.0), 1.0, 0.1, 4.0)[-1]
    c, s = math.cos(2.0), math.sin(2.0)
    assert turned[X] == pytest.approx(along[X] * c - along[Y] * s, abs=1e-9)
    assert turned[Y] == pytest.approx(along[X] * s + along[Y] * c, abs=1e-9)


@pytest.mark.parametrize("command", [(math.nan, 0.1), (1.0, math.nan)])
def test_unknown_command_gives_an_unknown_state(command: tuple[float, float]) -> None:
    assert np.isnan(drive(start(10.0), *command, 0.05, ego=Ego(lag=0.2))[-1]).all()


def test_unknown_state_stays_unknown() -> None:
    state = start(10.0)
    state[SPEED] = math.nan
    assert np.isnan(drive(state, -1.0, 0.0, 0.05)[-1]).all()


def test_limited_steering_equals_small_steps() -> None:
    angle, time = -0.3, 0.0
    while time < 1.5 - 1e-9:
        assert motion.lagged_steering(-0.3, 0.4, 0.8, 0.2, time) == pytest.approx(angle, abs=2e-4)
        angle += 1e-4 * motion.clip((0.4 - angle) / 0.2, -0.8, 0.8)
        time += 1e-4


def test_steering_in_two_halves_is_steering_at_once() -> None:
    for time in (0.1, 0.5, 0.9, 2.0):
        half = motion.lagged_steering(-0.3, 0.4, 0.8, 0.2, 0.5 * time)
        assert motion.lagged_steering(half, 0.4, 0.8, 0.2, 0.5 * time) == pytest.approx(
            motion.lagged_steering(-0.3, 0.4, 0.8, 0.2, time), abs=1e-12
        )


def test_steering_without_lag_arrives() -> None:
    assert motion.lagged_steering(0.0, 0.1, 0.8, 0.0, 0.2) == 0.1
    assert motion.lagged_steering(0.0, -0.4, 0.8, 0.0, 0.25) == -0.2


def test_clip_passes_nan_on() -> None:
    assert (
        motion.clip(2.0, 0.0, 1.0),
        motion.clip(-2.0, 0.0, 1.0),
        motion.clip(0.5, 0.0, 1.0),
    ) == (1.0, 0.0, 0.5)
    assert math.isnan(motion.clip(math.nan, 0.0, 1.0))


def test_an_error_fades_to_its_eth_part_in_a_lag_and_at_once_without_one() -> None:
    assert motion.fade(0.3, 0.3) == pytest.approx(math.exp(-1.0), rel=1e-15)
    assert motion.fade(0.3, 0.0) == 0.0
