"""Conformance of sensors, and injectors on their own."""

from dataclasses import replace
from typing import Any

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
        self.number = float(Broken.made)

    def sense(self, scene: Scene) -> Measurement:
        seen = self.inner.sense(scene)
        runs, detections = len(seen.mask), seen.detections
        if self.rule == "alters":
            scene.ego[:] = 0.0
        changes: dict[str, dict[str, Any]] = {
            "late": {"stamp": seen.stamp - 0.05},
            "far": {"detections": detections[:, ::-1]},
            "random": {"detections": detections * [1, 1, 1, 1, self.number, 1, 1]},
            "batch": {"detections": detections * [1, 1, 1, 1, runs, 1, 1]},
            "shape": {"mask": seen.mask[:, :1]},
            "gaps": {"mask": np.array([[False, True, True]] * runs)},
            "twice": {"source": np.zeros_like(seen.source)},
            "nobody": {"source": np.full_like(seen.source, 3)},
            "part of values": {"values": np.array([[np.nan, 1.0]] * runs)},
            "infinite values": {"values": np.full((runs, 2), np.inf)},
            "count of values": {"values": np.ones((7, 2))},
            "random values": {"values": np.full((runs, 2), self.number)},
            "values of a batch": {"values": np.full((runs, 2), float(runs))},
        }
        return replace(seen, **changes.get(self.rule, {}))


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


RULES = {
    "late": "stamp",
    "far": "in order of distance",
    "random": "equal inputs",
    "batch": "other runs of its batch",
    "shape": "source has shape",
    "gaps": "packed",
    "twice": "detected twice",
    "nobody": "names object 3, which is not there",
    "alters": "alters ego",
    "part of values": "neither finite nor all NaN",
    "infinite values": "neither finite nor all NaN",
    "count of values": r"values has shape \(7, 2\)",
    "random values": "equal inputs.*values",
    "values of a batch": "other runs of its batch.*values",
}
OF_JITTER = {
    "never": "jitter is not used",
    "long": "after the jitter",
    "early": "before the latency",
    "back": "overtakes",
    "fresh": "fresh is",
}


@pytest.mark.parametrize("rule", [*RULES, *OF_JITTER])
def test_broken_rule_is_named(rule: str) -> None:
    made, jitter = (Late, 2) if rule in OF_JITTER else (Broken, 0)
    with pytest.raises(AssertionError, match=(RULES | OF_JITTER)[rule]):
        check_sensor(lambda context: made(context, rule), TRUTH, jitter=jitter)


# --- ``plugins``


def test_each_run_may_have_its_own_numbers() -> None:
    assert injector("drop_out", "sensors.front", parameters=[{"duration": "1 s"}, {}])


def test_moment_holds_one_age_for_each_run() -> None:
    active = np.array([True, False])
    now = moment(active, time=2.0, age=0.5)
    assert (now.time, now.age.tolist()) == (2.0, [0.5, 0.5])
