"""An inertial unit: motion of its place, noise that integrates as it should, bias."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    EGO_YAW_RATE,
    IMU_ACCELERATION_X,
    IMU_ACCELERATION_Y,
    IMU_YAW_RATE,
    Floats,
)
from adeye.simulate.sensors.gnss_imu import ImuSensor
from adeye.spec.sensors import Imu
from adeye.testing.scenes import passenger_car
from tests.simulate.channels.egos import drive
from tests.simulate.sensors.scenes import scene, scene_context, sensor_context

STEP = 0.05
REAR = 0.5 * passenger_car().wheelbase


def unit(**fields: Any) -> Imu:
    return Imu.model_validate({"kind": "imu", "rate": "20 Hz", **fields})


def measured(spec: Imu, states: Sequence[Any] | Floats, *, runs: int = 1, every: int = 1) -> Floats:
    """Return the samples (N, B, 3) of a drive, given by its state at each sample."""
    context = scene_context([], runs=runs, step=STEP)
    made = sensor_context(spec, context, name="imu", every=every)
    sensor = ImuSensor(replace(made, vehicles=[passenger_car()] * runs))
    shown = scene(context, [])
    rows = []
    for number, state in enumerate(states):
        shown.tick = number * every
        shown.time = shown.tick * STEP
        shown.ego[:] = state
        values = sensor.sense(shown).values
        assert values is not None
        rows.append(values.copy())
    return np.array(rows)


def state(**fields: float) -> Floats:
    made = np.zeros(7)
    columns = {
        "heading": EGO_HEADING,
        "speed": EGO_SPEED,
        "acceleration": EGO_ACCELERATION,
        "yaw_rate": EGO_YAW_RATE,
    }
    for name, value in fields.items():
        made[columns[name]] = value
    return made


def standing(spec: Imu, samples: int, runs: int) -> Floats:
    return measured(spec, np.zeros((samples, 7)), runs=runs)


def test_first_sample_is_of_its_moment() -> None:
    first = measured(unit(), [state(speed=20.0, acceleration=-3.0)])[0, 0]
    assert first == pytest.approx([-3.0, 0.0, 0.0])


def test_sample_is_the_mean_of_the_time_before_it_so_the_speed_integrates_without_error() -> None:
    # Braking to standstill, which ends within a tick.
    states = drive(120, 15.0, lambda time: (-8.0 if time > 1.0 else 0.0, 0.0))
    along = measured(unit(), states)[:, 0, IMU_ACCELERATION_X]
    assert 15.0 + np.cumsum(along[1:]) * STEP == pytest.approx(states[1:, EGO_SPEED])
    assert states[-1, EGO_SPEED] == 0.0


def test_yaw_rate_integrates_to_the_heading_without_error() -> None:
    states = drive(200, 15.0, lambda time: (0.0, 0.1 * math.sin(time)))
    rate = measured(unit(), states)[:, 0, IMU_YAW_RATE]
    assert np.cumsum(rate[1:]) * STEP == pytest.approx(np.unwrap(states[1:, EGO_HEADING]))


def test_heading_that_passes_half_a_turn_is_no_fast_turn() -> None:
    states = [state(heading=math.pi - 0.01), state(heading=-math.pi + 0.01)]
    assert measured(unit(), states)[1, 0, IMU_YAW_RATE] == pytest.approx(0.02 / STEP)


def test_in_a_steady_turn_the_mount_is_pulled_to_the_centre_of_the_turn() -> None:
    # 20 m/s and 0.2 rad/s: a radius of 100 m and 4 m/s². The unit is 0.8 m ahead of the rear axle
    # and 0.5 m left of it: 0.032 m/s² backwards, 0.02 m/s² less to the left.
    spec = unit(mount={"x": f"{0.8 - REAR} m", "y": "0.5 m"})
    states = [state(heading=0.2 * STEP * tick, speed=20.0, yaw_rate=0.2) for tick in range(3)]
    expected = [-0.2 * 0.2 * 0.8, 4.0 - 0.2 * 0.2 * 0.5, 0.2]
    for sample in measured(spec, states):
        assert sample[0] == pytest.approx(expected)


def test_when_the_turn_becomes_faster_what_is_ahead_of_the_rear_axle_is_pushed_aside() -> None:
    # From standstill: 0.1 rad/s within a tick, 2 rad/s²; 1 m ahead and 0.5 m left of the axle.
    spec = unit(mount={"x": f"{1.0 - REAR} m", "y": "0.5 m"})
    after = measured(spec, [state(), state(heading=0.0025, yaw_rate=0.1)])[1, 0]
    assert after[IMU_ACCELERATION_Y] == pytest.approx(2.0, abs=0.01)
    assert after[IMU_ACCELERATION_X] == pytest.approx(-1.0, abs=0.01)


def test_slow_unit_gives_the_mean_of_its_whole_period() -> None:
    states = drive(101, 15.0, lambda time: (2.0 * math.sin(time), 0.0))[::4]
    along = measured(unit(rate="5 Hz"), states, every=4)[:, 0, IMU_ACCELERATION_X]
    assert 15.0 + np.cumsum(along[1:]) * 4 * STEP == pytest.approx(states[1:, EGO_SPEED])


@pytest.mark.parametrize(
    ("field", "sigma", "columns"),
    [
        ("acceleration_noise", "0.3 m/s^2", (IMU_ACCELERATION_X, IMU_ACCELERATION_Y)),
        ("acceleration_bias", "0.3 m/s^2", (IMU_ACCELERATION_X, IMU_ACCELERATION_Y)),
        ("yaw_rate_noise", "0.3 rad/s", (IMU_YAW_RATE,)),
        ("yaw_rate_bias", "0.3 rad/s", (IMU_YAW_RATE,)),
    ],
)
def test_error_has_the_stated_deviation_and_touches_nothing_else(
    field: str, sigma: str, columns: tuple[int, ...]
) -> None:
    error = standing(unit(**{field: sigma}), 1, 4000)[0]
    for column in range(3):
        if column in columns:
            assert error[:, column].std() == pytest.approx(0.3, rel=4.0 / math.sqrt(8000.0))
        else:
            assert not error[:, column].any()


def test_white_noise_integrates_to_a_random_walk() -> None:
    ticks = np.array([50, 100, 200, 400])
    times = ticks * STEP
    noise = unit(acceleration_noise="0.1 m/s^2", yaw_rate_noise="0.01 rad/s")
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
    error = standing(unit(yaw_rate_bias="0.05 rad/s", bias_time="4 s"), 1600, 400)
    for ticks in (20, 80, 160, 400):
        ratio = ticks * STEP / correlation
        bracket = 3.0 - 4.0 * math.exp(-ratio) + math.exp(-2.0 * ratio)
        variance = 2.0 * sigma**2 / ratio * (1.0 - bracket / (2.0 * ratio))
        found = allan_deviation(error[:, :, IMU_YAW_RATE], ticks)
        assert found == pytest.approx(math.sqrt(variance), rel=0.06), ticks


def test_white_noise_has_an_allan_deviation_that_falls_with_the_root_of_the_length() -> None:
    error = standing(unit(acceleration_noise="1 m/s^2"), 800, 200)[:, :, IMU_ACCELERATION_Y]
    for length in (1, 4, 16, 64):
        expected = 1.0 / math.sqrt(length)
        assert allan_deviation(error, length) == pytest.approx(expected, rel=0.05)


def test_biases_of_the_three_axes_are_independent() -> None:
    error = standing(unit(acceleration_bias="1 m/s^2", yaw_rate_bias="1 rad/s"), 1, 4000)[0]
    others = np.corrcoef(error.T)[np.triu_indices(3, 1)]
    assert np.abs(others).max() < 4.0 / math.sqrt(4000.0)
