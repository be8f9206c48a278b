"""Range of object-level sensors: it falls with rain, fog, darkness and a low sun, never rises."""

from __future__ import annotations

import math
from typing import Any

import pytest

from adeye.sensors.ranging import RangingSensor
from adeye.signals import ILLUMINANCE, SceneContext
from adeye.spec.sensors import Camera, Lidar, Radar
from adeye.world.weather import MM_PER_HOUR, glare_contrast
from tests.sensors.scenes import CAR, scene, scene_context, seen, sensor_context

KINDS: dict[str, Any] = {"camera": Camera, "radar": Radar, "lidar": Lidar}
FIELDS: dict[str, Any] = {
    "mount": {"x": "0 m"},
    "field_of_view": "360 deg",
    "range": "100 m",
    "rate": "20 Hz",
}

CONDITIONS: dict[str, list[dict[str, Any]]] = {
    "rain": [{"rain": rate * MM_PER_HOUR} for rate in (0.0, 0.5, 2.5, 7.5, 40.0)],
    "fog": [{"fog_visibility": visibility} for visibility in (1e5, 1000.0, 200.0, 50.0)],
    "darkness": [{"illuminance": ILLUMINANCE[light]} for light in ILLUMINANCE],
    "sun": [{"sun_elevation": math.radians(degrees)} for degrees in (80, 40, 20, 10, 5, 2, 0)],
}
"""From good to bad."""

MATTERS = {
    "camera": {"rain", "fog", "darkness", "sun"},
    "lidar": {"rain", "fog"},
    "radar": set(),
}
"""What shortens the range of a sensor; the others leave it as it is."""


def reach(kind: str, context: SceneContext, bearing: float = 0.0) -> float:
    """Distance of the nearest point from which on a car at a bearing is not reported [m]."""
    night = {"night_range": 0.5} if kind == "camera" else {}
    spec = KINDS[kind].model_validate({"kind": kind, **FIELDS, **night})
    sensor = RangingSensor(sensor_context(spec, context))
    low, high, tick = 1e-3, 200.0, 0
    while high - low > 1e-6:
        centre = 0.5 * (low + high) + 0.5 * CAR[0]
        place = (centre * math.cos(bearing), centre * math.sin(bearing), bearing)
        found = seen(sensor.sense(scene(context, [place], tick=tick)))
        low, high = (0.5 * (low + high), high) if found else (low, 0.5 * (low + high))
        tick += 1
    return low


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("kind", KINDS)
def test_range_falls_as_a_condition_gets_worse(kind: str, condition: str) -> None:
    ranges = [reach(kind, scene_context(**weather)) for weather in CONDITIONS[condition]]
    assert ranges == sorted(ranges, reverse=True)
    matters = condition in MATTERS[kind]
    assert len(set(ranges)) == (len(ranges) if matters else 1)


def test_low_sun_takes_the_range_of_its_contrast() -> None:
    elevation = math.radians(10.0)
    context = scene_context(sun_elevation=elevation)
    contrast = glare_contrast(math.cos(elevation), ILLUMINANCE["day"])
    assert reach("camera", context) == pytest.approx(100.0 * contrast, abs=1e-4)


def test_low_sun_takes_less_the_farther_an_object_is_from_its_bearing() -> None:
    context = scene_context(sun_elevation=math.radians(5.0), sun_azimuth=math.radians(30.0))
    ranges = [reach("camera", context, math.radians(30 + away)) for away in (0, 10, -30, 60, 91)]
    assert ranges == sorted(ranges)
    assert ranges[0] < 20.0
    assert ranges[-1] == pytest.approx(100.0, abs=1e-4)


def test_sun_below_the_horizon_blinds_nobody() -> None:
    context = scene_context(sun_elevation=-0.01)
    assert reach("camera", context) == pytest.approx(100.0, abs=1e-4)
