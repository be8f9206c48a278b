"""Conformance of sensors, and injectors on their own."""

from dataclasses import replace

import numpy as np
import pytest

from adeye.ports import SensorContext
from adeye.signals import Measurement, Scene
from adeye.simulate.sensors.rig import BUILT_IN
from adeye.spec.sensors import (
    GroundTruth,
)
from adeye.testing import check_sensor
from adeye.testing.sensors import injector, moment

# --- ``plugins``


TRUTH = GroundTruth.model_validate({"kind": "ground_truth", "rate": "20 Hz"})


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
