from dataclasses import replace

import numpy as np
import pytest

from adeye.ports import SensorContext
from adeye.sensors.rig import BUILT_IN
from adeye.signals import Measurement, Scene
from adeye.spec.sensors import (
    Camera,
    GroundTruth,
    Lidar,
    Localisation,
    PhysicalRadar,
    Radar,
    Sensor,
    Ultrasonic,
    model_name,
)
from adeye.testing import check_sensor

TRUTH = GroundTruth.model_validate({"kind": "ground_truth", "rate": "20 Hz"})
RANGING = {
    "rate": "10 Hz",
    "mount": {"x": "2 m"},
    "field_of_view": "90 deg",
    "range": "150 m",
    "bearing_noise": "0.2 deg",
}

PHYSICAL_RADAR = {
    "kind": "radar",
    "fidelity": "physical",
    "rate": "10 Hz",
    "mount": {"x": "2 m"},
    "field_of_view": "90 deg",
    "range": "150 m",
}


@pytest.mark.parametrize(
    "spec",
    [
        TRUTH,
        Localisation.model_validate(
            {"kind": "localisation", "rate": "20 Hz", "lateral_noise": "5 cm"}
        ),
        Camera.model_validate({"kind": "camera", **RANGING, "distance_noise": 0.05}),
        Radar.model_validate({"kind": "radar", **RANGING, "range_noise": "0.3 m"}),
        Lidar.model_validate({"kind": "lidar", **RANGING, "range_noise": "0.1 m"}),
        PhysicalRadar.model_validate({**PHYSICAL_RADAR, "clutter": 3.0}),
        PhysicalRadar.model_validate({**PHYSICAL_RADAR, "clutter": 0.0}),
        Ultrasonic.model_validate(
            {
                "kind": "ultrasonic",
                "rate": "10 Hz",
                "mount": {"x": "2 m"},
                "field_of_view": "60 deg",
                "range": "40 m",
                "range_noise": "1 cm",
            }
        ),
    ],
    ids=model_name,
)
def test_built_in_sensors_conform(spec: Sensor) -> None:
    check_sensor(BUILT_IN[model_name(spec)], spec)
    check_sensor(BUILT_IN[model_name(spec)], spec, every=1, latency=0)


class Broken:
    """A ground truth with one rule broken."""

    made = 0

    def __init__(self, context: SensorContext, rule: str) -> None:
        self.inner = BUILT_IN["ground_truth"](context)
        self.rule = rule
        Broken.made += 1
        self.number = Broken.made

    def sense(self, scene: Scene) -> Measurement:
        seen = replace(self.inner.sense(scene))
        detections = seen.detections.copy()
        seen.detections = detections
        if self.rule == "late":
            seen.stamp = seen.stamp - 0.05
        if self.rule == "far":
            detections[:] = detections[:, ::-1]
        if self.rule == "random":
            detections[:, :, 4] = self.number
        if self.rule == "batch":
            detections[:, :, 4] = detections.shape[0]
        if self.rule == "shape":
            seen.mask = seen.mask[:, :1]
        if self.rule == "gaps":
            seen.mask = np.array([[False, True, True]] * seen.mask.shape[0])
        if self.rule == "twice":
            seen.source = np.zeros_like(seen.source)
        if self.rule == "nobody":
            seen.source = np.full_like(seen.source, 3)
        if self.rule == "alters":
            scene.ego[:] = 0.0
        return seen


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ("late", "stamp"),
        ("far", "in order of distance"),
        ("random", "equal inputs"),
        ("batch", "other runs of its batch"),
        ("shape", "detections has shape"),
        ("gaps", "packed"),
        ("twice", "detected twice"),
        ("nobody", "names an object that is not there"),
        ("alters", "alters ego"),
    ],
)
def test_broken_rule_is_named(rule: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_sensor(lambda context: Broken(context, rule), TRUTH)
