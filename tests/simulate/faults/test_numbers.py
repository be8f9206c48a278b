"""How far a number is off: closed forms, sample by sample."""

import math
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import EGO_SPEED, EGO_X, EGO_Y, ESTIMATE_PLACE, PLACE_D, PLACE_S
from adeye.signals import IMU_YAW_RATE as YAW_RATE
from adeye.testing.sensors import moment
from tests.simulate.faults.streams import (
    END,
    ONSET,
    STEP,
    at_onset,
    made,
    played,
    same,
    scenes,
    streams,
)


def always(_tick: int) -> Any:
    return np.ones(3, dtype=np.bool_)


def estimates(parameters: dict[str, Any], model: str = "bias", **how: Any) -> list[Any]:
    pairs = played(made(model, "localisation", parameters), "localisation", **how)
    return [(given, faulty) for given, faulty in pairs if given.stamp[0] >= 0.0]


def test_bias_of_the_place_moves_its_place_on_the_road() -> None:
    for signal, x, y in (("ego_x", 3.0, 0.0), ("ego_y", 0.0, 3.0)):
        given, faulty = estimates({"signal": signal, "size": "3 m"})[END - 5]
        off = faulty.estimate - given.estimate
        # The road is straight, along x.
        for column, size in (
            (EGO_X, x),
            (EGO_Y, y),
            (ESTIMATE_PLACE + PLACE_S, x),
            (ESTIMATE_PLACE + PLACE_D, y),
        ):
            assert off[[0, 2], column] == pytest.approx([size, size])
            assert off[1, column] == 0.0


def test_speed_is_never_below_zero() -> None:
    _, faulty = estimates({"signal": "ego_speed", "size": "-100 m/s"})[END - 5]
    assert faulty.estimate[:, EGO_SPEED].tolist() == [0.0, pytest.approx(15.0, abs=1.0), 0.0]


def test_bias_varies_from_run_to_run() -> None:
    sizes = [{"signal": "yaw_rate", "size": f"{run} rad/s"} for run in range(3)]
    given, faulty = played(made("bias", "imu", sizes), "imu", always, onset=0)[20]
    assert faulty.values[:, YAW_RATE] - given.values[:, YAW_RATE] == pytest.approx([0.0, 1.0, 2.0])


def test_scale_multiplies() -> None:
    given, faulty = at_onset("scale", "radar", {"signal": "range", "factor": 0.5})
    x = given.detections[0, :, 0][given.mask[0]] - 2.0
    assert 2.0 + 0.5 * x == pytest.approx(faulty.detections[0, :, 0][faulty.mask[0]])


def test_drift_grows_with_the_age_of_the_sample() -> None:
    fault = made("drift", "localisation", {"signal": "ego_x", "size": "2 m", "over": "10 s"})
    pairs = played(fault, "localisation")
    for tick in range(ONSET, END):
        given, faulty = pairs[tick]
        age = max(0.0, given.stamp[0] - ONSET * STEP)
        off = faulty.estimate[0, EGO_X] - given.estimate[0, EGO_X]
        assert off == pytest.approx(0.2 * age, abs=1e-9)


def test_noise_has_its_deviation_and_stays_with_its_sample() -> None:
    fault = made("noise", "beam_lidar", {"signal": "range", "size": "0.2 m"})
    pairs = played(fault, "beam_lidar")
    given, faulty = pairs[ONSET]
    back = given.points[:, :, 0] > 5.0
    off = (faulty.points - given.points)[:, :, 0]
    count = int(back[[0, 2]].sum())
    assert np.std(off[[0, 2]][back[[0, 2]]]) == pytest.approx(0.2, abs=0.6 / math.sqrt(count))
    assert not off[1].any()
    # The lidar is sampled at every second tick.
    assert np.array_equal(pairs[ONSET + 1][1].points, faulty.points)
    assert not np.array_equal(pairs[ONSET + 2][1].points, faulty.points)


def test_steps_are_multiples() -> None:
    _, faulty = estimates({"signal": "ego_x", "size": "0.5 m"}, "quantise")[END - 5]
    multiple = faulty.estimate[[0, 2], EGO_X] / 0.5
    assert multiple == pytest.approx(np.round(multiple), abs=1e-12)


def test_stuck_value_is_that_value() -> None:
    _, faulty = estimates({"signal": "ego_speed", "value": "36 km/h"}, "stuck_at")[END - 5]
    assert faulty.estimate[[0, 2], EGO_SPEED] == pytest.approx([10.0, 10.0])


def test_stuck_bearing_leaves_the_range() -> None:
    given, faulty = at_onset("stuck_at", "camera", {"signal": "bearing", "value": "30 deg"})
    seat = np.array([2.0, 0.5])
    before = np.linalg.norm(given.detections[0, given.mask[0], :2] - seat, axis=1)
    after = faulty.detections[0, faulty.mask[0], :2] - seat
    assert np.linalg.norm(after, axis=1) == pytest.approx(sorted(before))
    assert np.arctan2(after[:, 1], after[:, 0]) == pytest.approx(math.radians(30.0))


def test_spikes_come_as_often_as_they_should() -> None:
    spike = {"signal": "range", "size": "1 m", "probability": 0.25}
    given, faulty = played(made("spike", "beam_lidar", spike), "beam_lidar")[ONSET]
    back = given.points[[0, 2], :, 0] > 0.0
    off = (faulty.points - given.points)[[0, 2], :, 0][back]
    hit = np.abs(off) > 0.5
    assert off[hit] == pytest.approx(1.0)
    assert not off[~hit].any()
    deviation = math.sqrt(0.25 * 0.75 / len(off))
    assert abs(float(np.mean(hit)) - 0.25) < 4.0 * deviation


def test_flipped_sign_is_the_opposite_and_flipped_twice_nothing() -> None:
    flip = {"signal": "yaw_rate", "bit": 63}
    given, faulty = at_onset("bit_flip", "imu", flip)
    assert faulty.values[0, YAW_RATE] == -given.values[0, YAW_RATE]
    again = made("bit_flip", "imu", flip)
    assert same(again.apply(faulty, moment(np.array([True, False, True]))), given)


def test_flip_of_the_exponent_may_make_no_number_and_the_place_is_nowhere() -> None:
    fault = made("bit_flip", "localisation", {"signal": "ego_x", "bit": 62})
    _, faulty = played(fault, "localisation")[ONSET]
    # An exponent of 1023 + n becomes one of 2047 + n - 1024: huge, infinite or tiny.
    row = faulty.estimate[2]
    assert abs(row[EGO_X]) > 1e7 or abs(row[EGO_X]) < 1e-7
    assert np.isnan(row[ESTIMATE_PLACE + PLACE_S]) == (abs(row[EGO_X]) > 1e7)


def test_half_the_step_leaves_what_a_sample_draws() -> None:
    """The same samples, looked at twice as often, have the same noise."""
    noise = {"signal": "ego_x", "size": "1 m"}
    once = made("noise", "localisation", noise)
    twice = made("noise", "localisation", noise, step=STEP / 2)
    active = np.ones(3, dtype=np.bool_)
    for item, scene in zip(streams()["localisation"], scenes(), strict=True):
        now = moment(active, time=scene.time, age=scene.time)
        one = once.apply(deepcopy(item), now)
        twice.apply(deepcopy(item), now)
        held = replace(item, fresh=np.zeros(3, dtype=np.bool_))
        assert same(replace(one, fresh=held.fresh), twice.apply(held, now))
