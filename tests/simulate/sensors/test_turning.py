"""Radial speed: that of every sensor is the change of its own ranges, however the ego turns."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import DETECTION_RANGE_RATE, Floats
from adeye.simulate.sensors.ground_truth import GroundTruthSensor
from adeye.simulate.sensors.radar import RadarSensor
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.spec.sensors import GroundTruth, PhysicalRadar, Radar
from adeye.testing.scenes import passenger_car
from tests.simulate.sensors.scenes import scene, scene_context, sensor_context

POST = (0.02, 0.02, 1.0)
REAR = 0.5 * passenger_car().wheelbase
MOUNT = {"x": "2.3 m", "y": "0.8 m", "yaw": "30 deg"}
SENSORS: dict[str, Any] = {
    "truth": (GroundTruthSensor, GroundTruth, {"kind": "ground_truth"}),
    "radar": (
        RangingSensor,
        Radar,
        {"kind": "radar", "mount": MOUNT, "field_of_view": "360 deg", "range": "200 m"},
    ),
    "physical": (
        RadarSensor,
        PhysicalRadar,
        {
            "kind": "radar", "fidelity": "physical", "mount": MOUNT, "field_of_view": "179 deg",
            "range": "500 m", "range_resolution": "0.01 m", "bearing_resolution": "0.01 deg",
            "range_rate_resolution": "0.005 m/s", "false_alarm_rate": 1e-9, "clutter": 0.0,
            "max_range_rate": "200 m/s",
        },
    ),
}  # fmt: skip


def ego_at(time: float, speed: float, yaw_rate: float) -> list[float]:
    """State of an ego on a circle: its rear axle moves along its heading."""
    turn = yaw_rate * time
    along = speed * time
    if yaw_rate != 0.0:
        along = 2.0 * speed / yaw_rate * math.sin(0.5 * turn)
    x = along * math.cos(0.5 * turn) + REAR * math.cos(turn)
    y = along * math.sin(0.5 * turn) + REAR * math.sin(turn)
    return [x, y, turn, speed, 0.0, 0.0, yaw_rate]


@pytest.mark.parametrize("name", SENSORS)
@pytest.mark.parametrize("yaw_rate", [0.0, 0.3, -0.4])
def test_reported_rate_is_the_difference_of_ranges(name: str, yaw_rate: float) -> None:
    model, record, fields = SENSORS[name]
    context = scene_context([POST], runs=1, kinds=["truck"])
    made = sensor_context(record.model_validate({"rate": "20 Hz", **fields}), context)
    sensor = model(replace(made, vehicles=[passenger_car()]))
    mount = (0.0, 0.0) if name == "truth" else (2.3, 0.8)
    generator = np.random.Generator(np.random.Philox(3))
    compared = 0
    for tick in range(40):
        x, y, heading, other = generator.uniform((8.0, -6.0, -3.0, 0.0), (25.0, 12.0, 3.0, 12.0))
        speed = generator.uniform(2.0, 15.0)

        def true_range(time: float) -> float:
            state: Floats = np.array(ego_at(time, speed, yaw_rate))  # noqa: B023
            c, s = math.cos(state[2]), math.sin(state[2])
            at = x + other * time * math.cos(heading), y + other * time * math.sin(heading)  # noqa: B023
            dx = at[0] - state[0] - (c * mount[0] - s * mount[1])
            dy = at[1] - state[1] - (s * mount[0] + c * mount[1])
            return math.hypot(dx, dy)

        shown = scene(
            context, [(x, y, heading, other)], ego=ego_at(0.0, speed, yaw_rate), tick=tick
        )
        found = sensor.sense(shown)
        rows = np.flatnonzero(found.mask[0] & (found.source[0] == 0))
        if not rows.size:
            continue
        compared += 1
        rate = (true_range(1e-4) - true_range(-1e-4)) / 2e-4
        near = 0.02 if name == "physical" else 1e-5
        assert found.detections[0, rows[0], DETECTION_RANGE_RATE] == pytest.approx(rate, abs=near)
    assert compared > 20
