"""A satellite receiver: where its antenna is, noise, bias, outages."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    EGO_YAW_RATE,
    GNSS_VELOCITY_X,
    GNSS_VELOCITY_Y,
    GNSS_X,
    GNSS_Y,
    Floats,
)
from adeye.simulate.sensors.gnss_imu import GnssSensor, next_bias, share_kept, share_new
from adeye.spec.sensors import Gnss
from adeye.testing.scenes import passenger_car
from tests.simulate.sensors.scenes import CAR, scene, scene_context, sensor_context

if TYPE_CHECKING:
    from collections.abc import Sequence

RUNS = 4000


def receiver(**fields: Any) -> Gnss:
    return Gnss.model_validate({"kind": "gnss", "rate": "10 Hz", **fields})


def fixes(
    *specs: Gnss,
    runs: int = 1,
    samples: int = 1,
    every: int = 2,
    ego: Sequence[float] = (0.0,) * 7,
    objects: int = 0,
) -> Floats:
    """Return the fixes (N, B, 4) of an ego that stays as it is."""
    context = scene_context([CAR] * objects, runs=runs)
    made = sensor_context(specs[0], context, name="gnss", every=every)
    listed = list(specs) if len(specs) > 1 else list(specs) * runs
    sensor = GnssSensor(replace(made, specs=listed, vehicles=[passenger_car()] * runs))
    shown = scene(context, [(50.0, 0.0)] * objects, ego=ego)
    rows = []
    for number in range(samples):
        shown.tick = number * every
        shown.time = shown.tick * context.step
        values = sensor.sense(shown).values
        assert values is not None
        rows.append(values.copy())
    return np.array(rows)


def state(**fields: float) -> list[float]:
    values = [0.0] * 7
    for name, value in fields.items():
        column = {"x": EGO_X, "y": EGO_Y, "heading": EGO_HEADING, "speed": EGO_SPEED}
        values[column.get(name, EGO_YAW_RATE)] = value
    return values


def test_without_error_a_fix_is_the_truth() -> None:
    ego = state(x=100.0, y=7.0, heading=0.5, speed=20.0)
    assert fixes(receiver(), ego=ego)[0, 0] == pytest.approx(
        [100.0, 7.0, 20.0 * math.cos(0.5), 20.0 * math.sin(0.5)]
    )


def test_antenna_ahead_and_left_of_an_ego_that_heads_north_is_north_and_west_of_it() -> None:
    ego = state(x=100.0, y=50.0, heading=math.pi / 2.0)
    found = fixes(receiver(mount={"x": "1 m", "y": "0.5 m"}), ego=ego)[0, 0]
    assert found[[GNSS_X, GNSS_Y]] == pytest.approx([99.5, 51.0])


def test_antenna_over_the_rear_axle_moves_along_the_heading_however_the_ego_turns() -> None:
    ego = state(speed=20.0, yaw_rate=0.2)
    rear = -0.5 * passenger_car().wheelbase
    found = fixes(receiver(mount={"x": f"{rear} m"}), ego=ego)[0, 0]
    assert found[[GNSS_VELOCITY_X, GNSS_VELOCITY_Y]] == pytest.approx([20.0, 0.0])


def test_antenna_elsewhere_turns_about_the_rear_axle() -> None:
    # 1 m left: slower by 0.2 m/s in a turn to the left; 1.35 m + 0.65 m ahead: 0.4 m/s to the left.
    ego = state(speed=20.0, yaw_rate=0.2)
    found = fixes(receiver(mount={"x": "0.65 m", "y": "1 m"}), ego=ego)[0, 0]
    assert found[[GNSS_VELOCITY_X, GNSS_VELOCITY_Y]] == pytest.approx([19.8, 0.4])


@pytest.mark.parametrize(
    ("field", "sigma", "columns"),
    [
        ("position_noise", "0.7 m", (GNSS_X, GNSS_Y)),
        ("speed_noise", "0.7 m/s", (GNSS_VELOCITY_X, GNSS_VELOCITY_Y)),
        ("bias", "0.7 m", (GNSS_X, GNSS_Y)),
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
    both = np.corrcoef(error[0, :, GNSS_X], error[1, :, GNSS_X])[0, 1]
    assert abs(both) < 4.0 / math.sqrt(RUNS)


def test_bias_keeps_its_deviation_and_forgets_exponentially() -> None:
    bias = fixes(receiver(bias="2 m", bias_time="3 s"), runs=RUNS, samples=61)[:, :, GNSS_Y]
    for sample in (0, 30, 60):
        assert bias[sample].std() == pytest.approx(2.0, rel=4.0 / math.sqrt(2.0 * RUNS))
    for lag in (1, 10, 30, 60):
        correlation = np.corrcoef(bias[0], bias[lag])[0, 1]
        # Samples are 0.1 s apart.
        assert correlation == pytest.approx(math.exp(-0.1 * lag / 3.0), abs=4.0 / math.sqrt(RUNS))


def test_bias_depends_on_the_number_of_the_sample_and_not_on_the_step() -> None:
    # Every second tick of 0.05 s is every tick of 0.1 s.
    one = fixes(receiver(bias="1 m"), runs=3, samples=20, every=2)
    context = scene_context([], runs=3, step=0.1)
    sensor = GnssSensor(sensor_context(receiver(bias="1 m"), context, name="gnss"))
    for number in range(20):
        values = sensor.sense(scene(context, [], tick=number)).values
        assert values == pytest.approx(one[number])


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


def test_each_run_has_its_own_outages() -> None:
    specs = [
        receiver(outages={"a": {"begin": f"{begin} s", "duration": "0.2 s"}})
        for begin in (0.0, 0.2)
    ]
    found = fixes(*specs, runs=2, samples=5)
    assert np.isnan(found[:, :, 0]).T.astype(int).tolist() == [[1, 1, 0, 0, 0], [0, 0, 1, 1, 0]]


def test_objects_leave_the_errors_as_they_were() -> None:
    spec = receiver(position_noise="1 m", bias="1 m", speed_noise="1 m/s")
    assert np.array_equal(fixes(spec, samples=3), fixes(spec, samples=3, objects=2))


def test_run_that_has_ended_has_no_fix() -> None:
    context = scene_context([], runs=2)
    sensor = GnssSensor(sensor_context(receiver(), context))
    shown = scene(context, [])
    shown.running[1] = False
    values = sensor.sense(shown).values
    assert values is not None
    assert np.isnan(values).all(axis=1).tolist() == [False, True]


def test_it_detects_nothing_and_gives_no_estimate() -> None:
    context = scene_context([CAR])
    found = GnssSensor(sensor_context(receiver(), context)).sense(scene(context, [(20.0, 0.0)]))
    assert not found.mask.any()
    assert found.estimate is None


# --- A bias that wanders and keeps its deviation --------------------------------------------------


def test_after_the_correlation_time_a_share_of_one_over_e_is_left() -> None:
    assert share_kept(30.0, 30.0) == pytest.approx(1.0 / math.e)


def test_two_periods_leave_what_each_leaves() -> None:
    assert share_kept(0.3, 7.0) == pytest.approx(share_kept(0.1, 7.0) * share_kept(0.2, 7.0))


@pytest.mark.parametrize("period", [1e-3, 0.1, 5.0, 500.0])
def test_variance_of_what_is_left_and_of_what_is_new_add_up(period: float) -> None:
    kept = share_kept(period, 10.0)
    assert kept**2 + share_new(kept) ** 2 == pytest.approx(1.0)


def test_first_bias_is_drawn_from_the_deviation_it_keeps() -> None:
    assert next_bias(99.0, 2.0, 0.9, 0.1, 1.5, is_first=True) == 3.0


def test_later_bias_goes_on_from_the_one_before() -> None:
    assert next_bias(1.0, 2.0, 0.9, 0.1, 1.5, is_first=False) == pytest.approx(0.9 + 0.3)


def test_bias_without_deviation_is_none() -> None:
    assert next_bias(0.0, 0.0, 0.9, 0.1, 1.5, is_first=False) == 0.0
