"""Radial speed: that of every sensor is the change of its own ranges, however the ego turns."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import DETECTION_RANGE_RATE, Floats
from adeye.simulate.sensors.rig import BUILT_IN
from adeye.spec.sensors import GroundTruth, model_name
from adeye.testing.scenes import passenger_car
from tests.simulate.sensors.scenes import scene, scene_context, sensor_context, sensor_spec

POST = (0.02, 0.02, 1.0)
REAR = 0.5 * passenger_car().wheelbase
MOUNT = {"x": "2.3 m", "y": "0.8 m", "yaw": "30 deg"}
VIEW = {"mount": MOUNT, "field_of_view": "179 deg", "range": "500 m"}
CELLS = {
    "range_resolution": "0.01 m",
    "bearing_resolution": "0.01 deg",
    "range_rate_resolution": "0.005 m/s",
    "false_alarm_rate": 1e-9,
    "clutter": 0.0,
    "max_range_rate": "200 m/s",
}
SENSORS: dict[str, Any] = {
    "truth": GroundTruth.model_validate({"kind": "ground_truth", "rate": "20 Hz"}),
    "radar": sensor_spec("radar", **{**VIEW, "field_of_view": "360 deg"}),
    "physical": sensor_spec("radar/physical", **VIEW, **CELLS),
}


def ego_at(time: float, speed: float, yaw_rate: float) -> list[float]:
    """State of an ego on a circle: its rear axle moves along its heading."""
    turn = yaw_rate * time
    along = speed * time
    if yaw_rate != 0.0:
        along = 2.0 * speed / yaw_rate * math.sin(0.5 * turn)
    x = along * math.cos(0.5 * turn) + REAR * math.cos(turn)
    y = along * math.sin(0.5 * turn) + REAR * math.sin(turn)
    return [x, y, turn, speed, 0.0, 0.0, yaw_rate]


def range_of(post: Floats, ego: list[float], time: float, mount: tuple[float, float]) -> float:
    """Distance from a sensor of an ego to a post that goes on straight for some time [m]."""
    x, y, heading, speed = post
    c, s = math.cos(ego[2]), math.sin(ego[2])
    dx = x + speed * time * math.cos(heading) - ego[0] - (c * mount[0] - s * mount[1])
    dy = y + speed * time * math.sin(heading) - ego[1] - (s * mount[0] + c * mount[1])
    return math.hypot(dx, dy)


@pytest.mark.parametrize("name", SENSORS)
@pytest.mark.parametrize("yaw_rate", [0.0, 0.3, -0.4])
def test_reported_rate_is_the_difference_of_ranges(name: str, yaw_rate: float) -> None:
    spec = SENSORS[name]
    context = scene_context([POST], runs=1, kinds=["truck"])
    made = sensor_context(spec, context)
    sensor = BUILT_IN[model_name(spec)](replace(made, vehicles=[passenger_car()]))
    mount = (0.0, 0.0) if name == "truth" else (2.3, 0.8)
    near = 0.02 if name == "physical" else 1e-5
    generator = np.random.Generator(np.random.Philox(3))
    compared = 0
    for tick in range(40):
        post = generator.uniform((8.0, -6.0, -3.0, 0.0), (25.0, 12.0, 3.0, 12.0))
        speed = generator.uniform(2.0, 15.0)
        before, now, after = (ego_at(time, speed, yaw_rate) for time in (-1e-4, 0.0, 1e-4))
        found = sensor.sense(scene(context, [post.tolist()], ego=now, tick=tick))
        rows = np.flatnonzero(found.mask[0] & (found.source[0] == 0))
        if not rows.size:
            continue
        compared += 1
        rate = (range_of(post, after, 1e-4, mount) - range_of(post, before, -1e-4, mount)) / 2e-4
        assert found.detections[0, rows[0], DETECTION_RANGE_RATE] == pytest.approx(rate, abs=near)
    assert compared > 20
