"""A satellite receiver: where its antenna is, noise, bias, outages."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Floats
from adeye.simulate.sensors.gnss_imu import GnssSensor, share_kept, share_new
from adeye.spec.sensors import Gnss
from adeye.testing.scenes import passenger_car
from tests.simulate.sensors.scenes import scene, scene_context, sensor_context

RUNS = 4000
REAR = -0.5 * passenger_car().wheelbase


def receiver(**fields: Any) -> Gnss:
    return Gnss.model_validate({"kind": "gnss", "rate": "10 Hz", **fields})


def fixes(
    spec: Gnss,
    *,
    runs: int = 1,
    samples: int = 1,
    every: int = 2,
    step: float = 0.05,
    ego: Sequence[float] = (0.0,) * 7,
) -> Floats:
    """Return the fixes (N, B, 4) of an ego that stays as it is."""
    context = scene_context([], runs=runs, step=step)
    made = sensor_context(spec, context, name="gnss", every=every)
    sensor = GnssSensor(replace(made, vehicles=[passenger_car()] * runs))
    rows = []
    for number in range(samples):
        values = sensor.sense(scene(context, [], ego=ego, tick=number * every)).values
        assert values is not None
        rows.append(values.copy())
    return np.array(rows)


def state(**fields: float) -> list[float]:
    values = [0.0] * 7
    for name, value in fields.items():
        column = {
            "x": signals.EGO_X,
            "y": signals.EGO_Y,
            "heading": signals.EGO_HEADING,
            "speed": signals.EGO_SPEED,
        }
        values[column.get(name, signals.EGO_YAW_RATE)] = value
    return values


@pytest.mark.parametrize(
    ("mount", "ego", "expected"),
    [
        (
            {},
            state(x=100.0, y=7.0, heading=0.5, speed=20.0),
            [100.0, 7.0, 20.0 * math.cos(0.5), 20.0 * math.sin(0.5)],
        ),
        # Ahead and left of an ego that heads north.
        (
            {"x": "1 m", "y": "0.5 m"},
            state(x=100.0, y=50.0, heading=math.pi / 2.0),
            [99.5, 51.0, 0.0, 0.0],
        ),
        # Over the rear axle.
        ({"x": f"{REAR} m"}, state(speed=20.0, yaw_rate=0.2), [REAR, 0.0, 20.0, 0.0]),
        # 1 m left: slower by 0.2 m/s; 1.35 m + 0.65 m ahead: 0.4 m/s to the left.
        (
            {"x": "0.65 m", "y": "1 m"},
            state(speed=20.0, yaw_rate=0.2),
            [0.65, 1.0, 19.8, 0.4],
        ),
    ],
)
def test_fix_is_of_the_antenna_that_turns_about_the_rear_axle(
    mount: dict[str, str], ego: list[float], expected: list[float]
) -> None:
    assert fixes(receiver(mount=mount), ego=ego)[0, 0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("field", "sigma", "columns"),
    [
        ("position_noise", "0.7 m", (signals.GNSS_X, signals.GNSS_Y)),
        ("speed_noise", "0.7 m/s", (signals.GNSS_VELOCITY_X, signals.GNSS_VELOCITY_Y)),
        ("bias", "0.7 m", (signals.GNSS_X, signals.GNSS_Y)),
    ],
)
def test_error_has_the_stated_deviation_in_each_axis_and_nowhere_else(
    field: str, sigma: str, columns: tuple[int, int]
) -> None:
    error = fixes(receiver(**{field: sigma}), runs=RUNS)[0]
    for column in range(4):
        if column in columns:
            assert error[:, column].mean() == pytest.approx(0.0, abs=4.0 * 0.7 / math.sqrt(RUNS))
            assert error[:, column].std() == pytest.approx(0.7, rel=4.0 / math.sqrt(2.0 * RUNS))
        else:
            assert not error[:, column].any()
    one, other = columns
    assert abs(np.corrcoef(error[:, one], error[:, other])[0, 1]) < 4.0 / math.sqrt(RUNS)


def test_noise_of_two_samples_is_independent() -> None:
    error = fixes(receiver(position_noise="1 m"), runs=RUNS, samples=2)
    both = np.corrcoef(error[0, :, signals.GNSS_X], error[1, :, signals.GNSS_X])[0, 1]
    assert abs(both) < 4.0 / math.sqrt(RUNS)


def test_bias_keeps_its_deviation_and_forgets_exponentially() -> None:
    bias = fixes(receiver(bias="2 m", bias_time="3 s"), runs=RUNS, samples=61)[:, :, signals.GNSS_Y]
    for sample in (0, 30, 60):
        assert bias[sample].std() == pytest.approx(2.0, rel=4.0 / math.sqrt(2.0 * RUNS))
    for lag in (1, 10, 30, 60):
        correlation = np.corrcoef(bias[0], bias[lag])[0, 1]
        # Samples are 0.1 s apart.
        assert correlation == pytest.approx(math.exp(-0.1 * lag / 3.0), abs=4.0 / math.sqrt(RUNS))


def test_bias_depends_on_the_number_of_the_sample_and_not_on_the_step() -> None:
    # Every second tick of 0.05 s is every tick of 0.1 s.
    one = fixes(receiver(bias="1 m"), runs=3, samples=20, every=2)
    assert fixes(receiver(bias="1 m"), runs=3, samples=20, every=1, step=0.1) == pytest.approx(one)


def test_in_an_outage_there_are_samples_without_a_fix() -> None:
    context = scene_context([])
    spec = receiver(outages={"tunnel": {"begin": "0.2 s", "duration": "0.3 s"}})
    sensor = GnssSensor(sensor_context(spec, context, every=2))
    for number in range(8):
        found = sensor.sense(scene(context, [], tick=2 * number))
        assert found.stamp[0] == pytest.approx(0.1 * number)
        assert found.alive.all()
        assert found.values is not None
        assert np.isnan(found.values).all() == (number in {2, 3, 4})


def test_bias_goes_on_in_an_outage() -> None:
    out = {"outages": {"tunnel": {"begin": "0.2 s", "duration": "0.3 s"}}}
    broken, whole = (
        fixes(receiver(bias="1 m", **extra), runs=3, samples=12) for extra in (out, {})
    )
    assert np.isnan(broken[2:5]).all()
    assert np.array_equal(broken[5:], whole[5:])


# --- A bias that wanders and keeps its deviation --------------------------------------------------


def test_after_the_correlation_time_one_over_e_is_left_and_variances_add_up() -> None:
    assert share_kept(30.0, 30.0) == pytest.approx(1.0 / math.e)
    for period in (1e-3, 0.1, 5.0, 500.0):
        kept = share_kept(period, 10.0)
        assert kept**2 + share_new(kept) ** 2 == pytest.approx(1.0), period
