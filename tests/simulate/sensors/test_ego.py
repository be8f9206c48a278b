"""Localisation and ground truth on hand-made scenes."""

import math
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Floats, SceneContext
from adeye.simulate.sensors.ground_truth import GroundTruthSensor, LocalisationSensor
from adeye.spec.sensors import GroundTruth, Localisation
from tests.simulate.sensors.scenes import (
    CAR,
    TRUCK,
    scene,
    scene_context,
    seen,
    sensor_context,
)

EGO = (100.0, 5.25, 0.0, 20.0, -1.0, 0.01, 0.02)
RUNS = 4000
NOISE = {"lateral_noise": "0.1 m", "heading_noise": "0.5 deg", "speed_noise": "0.2 m/s"}


def localisation(**noise: Any) -> Localisation:
    return Localisation.model_validate({"kind": "localisation", "rate": "20 Hz", **noise})


def truth() -> GroundTruth:
    return GroundTruth.model_validate({"kind": "ground_truth", "rate": "20 Hz"})


def estimates(context: SceneContext, *, ego: Any = EGO, **noise: Any) -> Floats:
    sensor = LocalisationSensor(sensor_context(localisation(**noise), context))
    found = sensor.sense(scene(context, [(0.0, 0.0)] * len(context.object_ids), ego=ego))
    assert found.estimate is not None
    return found.estimate


def test_localisation_without_noise_is_the_truth() -> None:
    context = scene_context()
    shown = scene(context, [(0.0, 0.0)], ego=EGO)
    estimate = estimates(context)
    assert np.array_equal(estimate[:, : signals.ESTIMATE_PLACE], shown.ego)
    assert np.array_equal(estimate[:, signals.ESTIMATE_PLACE :], shown.ego_place)


NOISES: list[tuple[tuple[float, ...], int, float, dict[str, str]]] = [
    (EGO, signals.EGO_Y, 0.1, NOISE),
    (EGO, signals.EGO_HEADING, math.radians(0.5), NOISE),
    (EGO, signals.EGO_SPEED, 0.2, NOISE),
    # Of an ego that stands, and of one whose heading is at the end of its range.
    ((0.0, 0.0, 0.0, 0.0), signals.EGO_SPEED, 0.5, {"speed_noise": "0.5 m/s"}),
    ((0.0, 0.0, math.pi, 5.0), signals.EGO_HEADING, math.radians(2.0), {"heading_noise": "2 deg"}),
]


def test_localisation_noise_has_the_stated_deviation() -> None:
    for ego, column, sigma, noise in NOISES:
        values = estimates(scene_context(runs=RUNS), ego=ego, **noise)[:, column]
        error = values - ego[column]
        if column == signals.EGO_HEADING:
            assert np.abs(values).max() <= math.pi
            error = (error + math.pi) % (2.0 * math.pi) - math.pi
        assert error.mean() == pytest.approx(0.0, abs=4.0 * sigma / math.sqrt(RUNS)), (ego, column)
        assert error.std() == pytest.approx(sigma, rel=4.0 / math.sqrt(2.0 * RUNS)), (ego, column)


def test_lateral_noise_is_across_the_lane_and_moves_the_place_on_the_road_with_it() -> None:
    context = scene_context(runs=50)
    estimate = estimates(context, lateral_noise="0.1 m")
    shift = estimate[:, signals.EGO_Y] - EGO[1]
    assert np.ptp(shift) > 0.1
    assert (estimate[:, signals.EGO_X] == EGO[0]).all()
    for column in (signals.PLACE_D, signals.PLACE_OFFSET):
        exact = estimates(context)[:, signals.ESTIMATE_PLACE + column]
        assert estimate[:, signals.ESTIMATE_PLACE + column] - exact == pytest.approx(shift)


def test_one_kind_of_noise_leaves_the_others_as_they_were() -> None:
    context = scene_context(runs=20)
    every, one = estimates(context, **NOISE), estimates(context, speed_noise="0.2 m/s")
    assert np.array_equal(every[:, signals.EGO_SPEED], one[:, signals.EGO_SPEED])
    assert not np.array_equal(every[:, signals.EGO_Y], one[:, signals.EGO_Y])


def test_ground_truth_is_exact_and_complete() -> None:
    context = scene_context([CAR, TRUCK, CAR], kinds=["car", "truck", "pedestrian"])
    # One behind, one hidden behind the other, one far away: it has no field of view.
    shown = scene(
        context,
        [(140.0, 5.25, 0.0, 10.0), (120.0, 5.25, 0.0, 30.0), (-900.0, 5.25, 0.0, 20.0)],
        ego=EGO,
    )
    found = GroundTruthSensor(sensor_context(truth(), context)).sense(shown)
    assert seen(found) == {0: (40.0, 0.0), 1: (20.0, 0.0), 2: (-1000.0, 0.0)}
    assert found.source[0].tolist() == [1, 0, 2]
    assert found.detections[0, :, signals.DETECTION_RANGE_RATE].tolist() == [10.0, -10.0, 0.0]
    assert (found.detections[0, :, signals.DETECTION_HAS_RANGE_RATE] == 1.0).all()
    assert found.detections[0, :, 6].tolist() == [2.0, 0.0, 6.0]
    assert found.estimate is not None
    assert np.array_equal(found.estimate[:, : signals.ESTIMATE_PLACE], shown.ego)


def test_ground_truth_is_in_the_vehicle_frame() -> None:
    context = scene_context()
    ego = (10.0, 20.0, math.pi / 2.0, 0.0)
    shown = scene(context, [(7.0, 50.0)], ego=ego)
    found = GroundTruthSensor(sensor_context(truth(), context)).sense(shown)
    assert seen(found)[0] == pytest.approx((30.0, 3.0))


def test_range_rate_of_what_stands_in_the_ego_is_zero_not_nan() -> None:
    context = scene_context()
    found = GroundTruthSensor(sensor_context(truth(), context)).sense(scene(context, [(0.0, 0.0)]))
    assert found.detections[0, 0, signals.DETECTION_RANGE_RATE] == 0.0
