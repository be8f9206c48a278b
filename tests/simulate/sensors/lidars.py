"""Physical lidars for tests, and what came back to them."""

import math
from typing import Any

from adeye.signals import POINT_RANGE, Floats, Ints, Measurement, Scene, SceneContext
from adeye.simulate.sensors.lidar import LidarSensor
from adeye.spec.sensors import PhysicalLidar
from tests.simulate.sensors.scenes import sensor_context, sensor_spec

DEGREE = math.pi / 180.0
WALL = (0.2, 400.0, 3.0)


def spec(**changes: Any) -> PhysicalLidar:
    fields = {"field_of_view": "360 deg", "beams": 720, "range": "150 m", "rate": "10 Hz"}
    mount = {"mount": {"z": "0.8 m"}}
    made: PhysicalLidar = sensor_spec("lidar/physical", **(fields | mount | changes))
    return made


def sensor(context: SceneContext, *, name: str = "front", **changes: Any) -> LidarSensor:
    return LidarSensor(sensor_context(spec(**changes), context, name=name))


def look(context: SceneContext, shown: Scene, **changes: Any) -> Measurement:
    """Sample one scene with one new lidar."""
    return sensor(context, **changes).sense(shown)


def returns(found: Measurement, thing: int | None = None, run: int = 0) -> Floats:
    """Return the rows of one run that are returns, of one object or of all."""
    points, hits = parts(found)
    there = points[run, :, POINT_RANGE] > 0.0
    if thing is not None:
        there &= hits[run] == thing
    found_there: Floats = points[run, there]
    return found_there


def parts(found: Measurement) -> tuple[Floats, Ints]:
    assert found.points is not None
    assert found.hits is not None
    return found.points, found.hits
