"""Conformance of sensors, and injectors on their own."""

from dataclasses import replace

import numpy as np
import pytest

from adeye.ports import SensorContext
from adeye.signals import Measurement, Scene
from adeye.simulate.sensors.rig import BUILT_IN
from adeye.spec.sensors import (
    Camera,
    Gnss,
    GroundTruth,
    Imu,
    Lidar,
    Localisation,
    PhysicalRadar,
    Radar,
    Sensor,
    Ultrasonic,
    model_name,
)
from adeye.testing import check_sensor
from adeye.testing.sensors import injector, moment

# --- ``plugins``


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


@pytest.mark.slow
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
        Gnss.model_validate(
            {
                "kind": "gnss",
                "rate": "10 Hz",
                "mount": {"x": "0.5 m"},
                "position_noise": "0.5 m",
                "bias": "1 m",
                "outages": {"tunnel": {"begin": "0.5 s", "duration": "0.3 s"}},
            }
        ),
        Imu.model_validate(
            {"kind": "imu", "rate": "20 Hz", "yaw_rate_noise": "0.1 deg/s", "bias_time": "5 s"}
        ),
    ],
    ids=model_name,
)
def test_built_in_sensors_conform(spec: Sensor) -> None:
    check_sensor(BUILT_IN[model_name(spec)], spec)
    check_sensor(BUILT_IN[model_name(spec)], spec, every=1, latency=0)
    check_sensor(BUILT_IN[model_name(spec)], spec, jitter=2)
    check_sensor(BUILT_IN[model_name(spec)], spec, every=1, latency=0, jitter=3)


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


class Late:
    """A ground truth whose delivery breaks a rule of jitter."""

    def __init__(self, context: SensorContext, rule: str) -> None:
        jitter = {"never": 0, "long": context.jitter + 4}.get(rule, context.jitter)
        latency = context.latency - 1 if rule == "early" else context.latency
        self.inner = BUILT_IN["ground_truth"](replace(context, jitter=jitter, latency=latency))
        self.rule = rule
        self.seen: list[Measurement] = []

    def sense(self, scene: Scene) -> Measurement:
        newest = self.inner.sense(scene).copy()
        self.seen.append(newest)
        if self.rule == "back" and scene.tick == 15:
            newest = self.seen[8].copy()
        if self.rule == "fresh":
            newest.fresh[:] = True
        return newest


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ("never", "jitter is not used"),
        ("long", "after the jitter"),
        ("early", "before the latency"),
        ("back", "overtakes"),
        ("fresh", "fresh is"),
    ],
)
def test_broken_rule_of_jitter_is_named(rule: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_sensor(lambda context: Late(context, rule), TRUTH, jitter=2)


class Odd:
    """A ground truth with values that break a rule."""

    made = 0

    def __init__(self, context: SensorContext, rule: str) -> None:
        self.inner = BUILT_IN["ground_truth"](context)
        Odd.made += 1
        runs = context.scene.runs
        self.values = {
            "part": np.array([[np.nan, 1.0]] * runs),
            "inf": np.full((runs, 2), np.inf),
            "count": np.ones((7, 2)),
            "random": np.full((runs, 2), float(Odd.made)),
            "batch": np.full((runs, 2), float(runs)),
        }[rule]

    def sense(self, scene: Scene) -> Measurement:
        return replace(self.inner.sense(scene), values=self.values)


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ("part", "neither finite nor all NaN"),
        ("inf", "neither finite nor all NaN"),
        ("count", r"values have shape \(7, 2\)"),
        ("random", "equal inputs.*values"),
        ("batch", "other runs of its batch.*values"),
    ],
)
def test_broken_rule_of_values_is_named(rule: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_sensor(lambda context: Odd(context, rule), TRUTH)


# --- ``plugins``


def test_injector_stands_alone() -> None:
    fault = injector("silent", "channels.nominal")
    assert callable(fault.apply)


def test_each_run_may_have_its_own_numbers() -> None:
    assert injector("drop_out", "sensors.front", parameters=[{"duration": "1 s"}, {}])


def test_moment_holds_one_age_for_each_run() -> None:
    active = np.array([True, False])
    now = moment(active, time=2.0, age=0.5)
    assert (now.time, now.age.tolist()) == (2.0, [0.5, 0.5])
