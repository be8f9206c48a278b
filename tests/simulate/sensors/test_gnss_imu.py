"""A satellite receiver and an inertial unit: where they are, noise, bias, outages, integrals."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import EGO_SPEED, IMU_ACCELERATION_X, IMU_ACCELERATION_Y, IMU_YAW_RATE, Floats
from adeye.simulate.sensors.gnss_imu import GnssSensor, ImuSensor, share_kept, share_new
from adeye.spec.sensors import Gnss, Imu
from adeye.testing.scenes import passenger_car
from tests.simulate.channels.egos import drive, gnss, imu
from tests.simulate.sensors.scenes import scene, scene_context, sensor_context

RUNS = 4000
STEP = 0.05
REAR = -0.5 * passenger_car().wheelbase


def state(x: float = 0.0, y: float = 0.0, heading: float = 0.0, **more: float) -> Floats:
    made = np.array([x, y, heading, 0.0, 0.0, 0.0, 0.0])
    for name, value in more.items():
        made[getattr(signals, f"EGO_{name.upper()}")] = value
    return made


def measured(
    spec: Gnss | Imu,
    states: Sequence[Any] | Floats,
    *,
    runs: int = 1,
    every: int = 1,
    step: float = STEP,
) -> Floats:
    """Return the samples (N, B, ...) of a drive, given by its state at each sample."""
    context = scene_context([], runs=runs, step=step)
    about = replace(sensor_context(spec, context, every=every), vehicles=[passenger_car()] * runs)
    sensor = GnssSensor(about) if isinstance(spec, Gnss) else ImuSensor(about)
    rows = []
    for number, ego in enumerate(states):
        found = sensor.sense(scene(context, [], ego=ego, tick=number * every))
        # In an outage there are samples without a fix.
        assert found.values is not None
        assert found.alive.all()
        assert np.allclose(found.stamp, number * every * step)
        rows.append(found.values.copy())
    return np.array(rows)


def standing(spec: Gnss | Imu, samples: int, runs: int, **more: Any) -> Floats:
    return measured(spec, np.zeros((samples, 7)), runs=runs, **more)


OVER_AXLE = {"x": f"{REAR} m"}
TURNING = state(speed=20.0, yaw_rate=0.2)
FIXES: list[tuple[dict[str, str], Floats, list[float]]] = [
    (
        {},
        state(100.0, 7.0, 0.5, speed=20.0),
        [100.0, 7.0, 20.0 * math.cos(0.5), 20.0 * math.sin(0.5)],
    ),
    # Ahead and left of an ego that heads north; over the rear axle.
    ({"x": "1 m", "y": "0.5 m"}, state(100.0, 50.0, math.pi / 2.0), [99.5, 51.0, 0.0, 0.0]),
    (OVER_AXLE, TURNING, [REAR, 0.0, 20.0, 0.0]),
    # 1 m left: slower by 0.2 m/s; 1.35 m + 0.65 m ahead: 0.4 m/s to the left.
    ({"x": "0.65 m", "y": "1 m"}, TURNING, [0.65, 1.0, 19.8, 0.4]),
]


def test_fix_is_of_the_antenna_that_turns_about_the_rear_axle() -> None:
    for mount, ego, expected in FIXES:
        found = measured(gnss(mount=mount), [ego], every=2)[0, 0]
        assert found == pytest.approx(expected, abs=1e-9), mount


ERRORS: list[tuple[Any, str, str, list[int]]] = [
    (gnss, "position_noise", "m", [signals.GNSS_X, signals.GNSS_Y]),
    (gnss, "speed_noise", "m/s", [signals.GNSS_VELOCITY_X, signals.GNSS_VELOCITY_Y]),
    (gnss, "bias", "m", [signals.GNSS_X, signals.GNSS_Y]),
    (imu, "acceleration_noise", "m/s^2", [IMU_ACCELERATION_X, IMU_ACCELERATION_Y]),
    (imu, "acceleration_bias", "m/s^2", [IMU_ACCELERATION_X, IMU_ACCELERATION_Y]),
    (imu, "yaw_rate_noise", "rad/s", [IMU_YAW_RATE]),
    (imu, "yaw_rate_bias", "rad/s", [IMU_YAW_RATE]),
]


def test_error_has_the_stated_deviation_in_each_axis_and_touches_nothing_else() -> None:
    for device, field, unit, columns in ERRORS:
        error = standing(device(**{field: f"0.3 {unit}"}), 1, RUNS)[0]
        own = error[:, columns]
        assert own.mean(axis=0) == pytest.approx(0.0, abs=4.0 * 0.3 / math.sqrt(RUNS)), field
        assert own.std(axis=0) == pytest.approx(0.3, rel=4.0 / math.sqrt(2.0 * RUNS)), field
        assert not np.delete(error, columns, axis=1).any(), field


def test_errors_of_samples_and_axes_are_independent() -> None:
    fixes = standing(gnss(position_noise="1 m"), 2, RUNS, every=2)
    biases = standing(imu(acceleration_bias="1 m/s^2", yaw_rate_bias="1 rad/s"), 1, RUNS)[0]
    for error in (np.hstack(list(fixes[:, :, :2])), biases):
        others = np.corrcoef(error.T)[np.triu_indices(error.shape[1], 1)]
        assert np.abs(others).max() < 4.0 / math.sqrt(RUNS)


def test_bias_of_a_fix_keeps_its_deviation_and_forgets_exponentially() -> None:
    bias = standing(gnss(bias="2 m", bias_time="3 s"), 61, RUNS, every=2)[:, :, signals.GNSS_Y]
    for sample in (0, 30, 60):
        assert bias[sample].std() == pytest.approx(2.0, rel=4.0 / math.sqrt(2.0 * RUNS))
    for lag in (1, 10, 30, 60):
        correlation = np.corrcoef(bias[0], bias[lag])[0, 1]
        # Samples are 0.1 s apart.
        assert correlation == pytest.approx(math.exp(-0.1 * lag / 3.0), abs=4.0 / math.sqrt(RUNS))


def test_bias_depends_on_the_number_of_the_sample_and_not_on_the_step() -> None:
    # Every second tick of 0.05 s is every tick of 0.1 s.
    one = standing(gnss(bias="1 m"), 20, 3, every=2)
    assert standing(gnss(bias="1 m"), 20, 3, every=1, step=0.1) == pytest.approx(one)


def test_in_an_outage_there_are_samples_without_a_fix_and_the_bias_goes_on() -> None:
    out = {"outages": {"tunnel": {"begin": "0.2 s", "duration": "0.3 s"}}}
    broken, whole = (standing(gnss(bias="1 m", **it), 12, 3, every=2) for it in (out, {}))
    assert np.isnan(broken[2:5]).all()
    assert np.array_equal(broken[[0, 1, *range(5, 12)]], whole[[0, 1, *range(5, 12)]])


def test_after_the_correlation_time_one_over_e_is_left_and_variances_add_up() -> None:
    assert share_kept(30.0, 30.0) == pytest.approx(1.0 / math.e)
    for period in (1e-3, 0.1, 5.0, 500.0):
        kept = share_kept(period, 10.0)
        assert kept**2 + share_new(kept) ** 2 == pytest.approx(1.0), period


# --- inertia --------------------------------------------------------------------------------------


def test_first_sample_is_of_its_moment() -> None:
    first = measured(imu(), [state(speed=20.0, acceleration=-3.0)])[0, 0]
    assert first == pytest.approx([-3.0, 0.0, 0.0])


def test_sample_is_the_mean_of_the_time_before_it_so_the_speed_integrates_without_error() -> None:
    # Braking to standstill, which ends within a tick; and a slow unit.
    stop = drive(120, 15.0, lambda time: (-8.0 if time > 1.0 else 0.0, 0.0))
    waves = drive(101, 15.0, lambda time: (2.0 * math.sin(time), 0.0))[::4]
    assert stop[-1, EGO_SPEED] == 0.0
    for unit, states, every in ((imu(), stop, 1), (imu(rate="5 Hz"), waves, 4)):
        along = measured(unit, states, every=every)[:, 0, IMU_ACCELERATION_X]
        assert 15.0 + np.cumsum(along[1:]) * every * STEP == pytest.approx(states[1:, EGO_SPEED])


def test_yaw_rate_integrates_to_the_heading_without_error() -> None:
    states = drive(200, 15.0, lambda time: (0.0, 0.1 * math.sin(time)))
    rate = measured(imu(), states)[:, 0, IMU_YAW_RATE]
    assert np.cumsum(rate[1:]) * STEP == pytest.approx(np.unwrap(states[1:, signals.EGO_HEADING]))
    # A heading that passes half a turn is no fast turn.
    seam = [state(heading=math.pi - 0.01), state(heading=-math.pi + 0.01)]
    assert measured(imu(), seam)[1, 0, IMU_YAW_RATE] == pytest.approx(0.02 / STEP)


def test_in_a_steady_turn_the_mount_is_pulled_to_the_centre_of_the_turn() -> None:
    # 20 m/s and 0.2 rad/s: a radius of 100 m and 4 m/s². The unit is 0.8 m ahead of the rear axle
    # and 0.5 m left of it: 0.032 m/s² backwards, 0.02 m/s² less to the left.
    spec = imu(mount={"x": f"{0.8 + REAR} m", "y": "0.5 m"})
    states = [state(heading=0.2 * STEP * tick, speed=20.0, yaw_rate=0.2) for tick in range(3)]
    expected = [-0.2 * 0.2 * 0.8, 4.0 - 0.2 * 0.2 * 0.5, 0.2]
    for sample in measured(spec, states):
        assert sample[0] == pytest.approx(expected)


def test_when_the_turn_becomes_faster_what_is_ahead_of_the_rear_axle_is_pushed_aside() -> None:
    # From standstill: 0.1 rad/s within a tick, 2 rad/s²; 1 m ahead and 0.5 m left of the axle.
    spec = imu(mount={"x": f"{1.0 + REAR} m", "y": "0.5 m"})
    after = measured(spec, [state(), state(heading=0.0025, yaw_rate=0.1)])[1, 0]
    assert after[IMU_ACCELERATION_Y] == pytest.approx(2.0, abs=0.01)
    assert after[IMU_ACCELERATION_X] == pytest.approx(-1.0, abs=0.01)


def test_white_noise_integrates_to_a_random_walk() -> None:
    ticks = np.array([50, 100, 200, 400])
    times = ticks * STEP
    noise = imu(acceleration_noise="0.1 m/s^2", yaw_rate_noise="0.01 rad/s")
    error = standing(noise, 401, 2000)[1:]
    speed = np.cumsum(error[:, :, IMU_ACCELERATION_X], axis=0) * STEP
    # The variance is sigma² T t³ / 3 of the place, sigma² T t of the heading.
    place = (np.cumsum(speed, axis=0) * STEP)[ticks - 1].std(axis=1)
    assert place == pytest.approx(0.1 * np.sqrt(STEP * times**3 / 3.0), rel=0.07)
    heading = (np.cumsum(error[:, :, IMU_YAW_RATE], axis=0) * STEP)[ticks - 1].std(axis=1)
    assert heading == pytest.approx(0.01 * np.sqrt(STEP * times), rel=0.07)


def allan_deviation(series: Floats, length: int) -> float:
    """Return the Allan deviation of (N, B) samples for means over a number of them."""
    whole = series[: series.shape[0] // length * length]
    means = whole.reshape(-1, length, series.shape[1]).mean(axis=1)
    return float(np.sqrt(0.5 * (np.diff(means, axis=0) ** 2).mean()))


def test_bias_has_the_allan_deviation_of_a_gauss_markov_process() -> None:
    # IEEE Std 952-1997, annex C, exponentially correlated noise with q_c² = 2 sigma² / T_c.
    sigma, correlation = 0.05, 4.0
    error = standing(imu(yaw_rate_bias="0.05 rad/s", bias_time="4 s"), 1600, 400)
    for ticks in (20, 80, 160, 400):
        ratio = ticks * STEP / correlation
        bracket = 3.0 - 4.0 * math.exp(-ratio) + math.exp(-2.0 * ratio)
        variance = 2.0 * sigma**2 / ratio * (1.0 - bracket / (2.0 * ratio))
        found = allan_deviation(error[:, :, IMU_YAW_RATE], ticks)
        assert found == pytest.approx(math.sqrt(variance), rel=0.06), ticks


def test_white_noise_has_an_allan_deviation_that_falls_with_the_root_of_the_length() -> None:
    error = standing(imu(acceleration_noise="1 m/s^2"), 800, 200)[:, :, IMU_ACCELERATION_Y]
    for length in (1, 4, 16, 64):
        expected = 1.0 / math.sqrt(length)
        assert allan_deviation(error, length) == pytest.approx(expected, rel=0.05)
