"""What sensors see of a car in any weather, and the speed that they give it."""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import DETECTION_RANGE_RATE, ILLUMINANCE, Bools, Floats
from adeye.simulate.channels.perception.clustering import Clustering
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.sensors.rig import BUILT_IN
from adeye.simulate.world.weather import MM_PER_HOUR, camera_range, glare_contrast, lidar_range
from adeye.spec.sensors import (
    GroundTruth,
    model_name,
)
from adeye.testing.scenes import passenger_car
from tests.simulate.sensors import scenes
from tests.simulate.sensors.scenes import scene, scene_context, sensor_context, sensor_spec

CONDITIONS: dict[str, list[dict[str, Any]]] = {
    "rain": [{"rain": rate * MM_PER_HOUR} for rate in (0.0, 0.5, 2.5, 7.5, 40.0)],
    "fog": [{"fog_visibility": visibility} for visibility in (1e5, 1000.0, 200.0, 50.0)],
    "darkness": [{"illuminance": ILLUMINANCE[light]} for light in ILLUMINANCE],
    "sun": [{"sun_elevation": math.radians(degrees)} for degrees in (80, 40, 20, 10, 5, 2, 0)],
}
"""From good to bad."""

MATTERS: dict[str, set[str]] = {
    "camera": {"rain", "fog", "darkness", "sun"},
    "lidar": {"rain", "fog"},
    "radar": set(),
}
"""What shortens the range of a sensor; the others leave it as it is."""


def reach(kind: str, bearing: float = 0.0, *, sees: dict[str, Any], **weather: Any) -> float:
    """Distance of the nearest point from which on a car at a bearing is not reported [m]."""
    context = scenes.scene_context(**weather)
    fields = {"field_of_view": "360 deg", "range": "100 m"} | sees
    sensor = RangingSensor(scenes.sensor_context(scenes.sensor_spec(kind, **fields), context))
    low, high, tick = 1e-3, 200.0, 0
    while high - low > 1e-6:
        centre = 0.5 * (low + high) + 0.5 * scenes.CAR[0]
        place = (centre * math.cos(bearing), centre * math.sin(bearing), bearing)
        found = scenes.seen(sensor.sense(scenes.scene(context, [place], tick=tick)))
        low, high = (0.5 * (low + high), high) if found else (low, 0.5 * (low + high))
        tick += 1
    return low


NIGHT = {"night_range": 0.5}
BRIGHT = {"range": "150 m", "reference_reflectivity": 0.9}
RAIN: dict[str, Any] = {"rain": 7.5 * MM_PER_HOUR, "fog_visibility": 10_000.0}


def test_range_is_that_of_the_formula() -> None:
    low = math.radians(10.0)
    table: list[tuple[str, dict[str, Any], dict[str, Any], float]] = [
        ("lidar", BRIGHT, RAIN, lidar_range(150.0, 0.5, 0.9, *RAIN.values())),
        ("camera", {}, RAIN, camera_range(100.0, RAIN["rain"], RAIN["fog_visibility"], 1.0)),
        ("camera", NIGHT, {"night": True, "illuminance": ILLUMINANCE["night"]}, 50.0),
        ("radar", {}, {"rain": 40.0 * MM_PER_HOUR}, 100.0),
        # The sun takes its contrast, and nothing from below the horizon.
        (
            "camera",
            {},
            {"sun_elevation": low},
            100.0 * glare_contrast(math.cos(low), ILLUMINANCE["day"]),
        ),
        ("camera", {}, {"sun_elevation": -0.01}, 100.0),
    ]
    for kind, sees, weather, expected in table:
        found = reach(kind, sees=sees, **weather)
        assert found == pytest.approx(expected, abs=1e-4), (kind, weather)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_range_falls_as_a_condition_gets_worse(condition: str) -> None:
    for kind, matters in MATTERS.items():
        night = NIGHT if kind == "camera" else {}
        ranges = [reach(kind, sees=night, **weather) for weather in CONDITIONS[condition]]
        assert ranges == sorted(ranges, reverse=True), kind
        assert len(set(ranges)) == (len(ranges) if condition in matters else 1), kind


def test_low_sun_takes_less_the_farther_an_object_is_from_its_bearing() -> None:
    sun = {"sun_elevation": math.radians(5.0), "sun_azimuth": math.radians(30.0)}
    bearings = [math.radians(30 + away) for away in (0, 10, -30, 60, 91)]
    ranges = [reach("camera", bearing, sees={}, **sun) for bearing in bearings]
    assert ranges == sorted(ranges)
    assert ranges[0] < 20.0
    assert ranges[-1] == pytest.approx(100.0, abs=1e-4)


# --- sensors that make what the device makes ------------------------------------------------------

LOOK: dict[str, Any] = {"mount": {"z": "1.3 m"}, "field_of_view": "50 deg"}
# The camera needs much contrast and has pixels enough, so that it is the weather that decides.
PIXELS = {"contrast_threshold": 0.35, "columns": 320, "rows": 120}
PHYSICAL: dict[str, Any] = {
    "camera": scenes.sensor_spec("camera/physical", **LOOK, **PIXELS),
    "lidar": scenes.sensor_spec("lidar/physical", **LOOK, range="100 m"),
    "radar": scenes.sensor_spec("radar/physical", **LOOK, range="100 m"),
    "ultrasonic": scenes.sensor_spec("ultrasonic", **LOOK, range="100 m"),
}
PHYSICS: dict[str, set[str]] = {
    "camera": {"rain", "fog", "darkness", "sun"},
    "lidar": {"rain", "fog"},
    "radar": {"rain"},
    "ultrasonic": set(),
}
"""What a sensor suffers from. A radar of 77 GHz loses in rain, and fog drops are too small for it;
what ultrasound loses in rain over its few metres is left out."""
DISTANCES = np.arange(6.0, 180.0, 2.0)


def detected(kind: str, **weather: Any) -> Bools:
    """Tell at which distances, in which run (D, B), a car ahead is detected."""
    runs = 40 if kind == "radar" else 1
    # Parked, because the lamps of a car that drives are seen from afar by night.
    context = scenes.scene_context(kinds=["parked_car"], runs=runs, **weather)
    spec = PHYSICAL[kind]
    sensor = BUILT_IN[model_name(spec)](scenes.sensor_context(spec, context))
    clustering = Clustering([spec] * runs, 1) if kind == "lidar" else None
    found = []
    for tick, distance in enumerate(DISTANCES):
        sample = sensor.sense(
            scenes.scene(context, [(distance + 0.5 * scenes.CAR[0], 0.0)], tick=tick)
        )
        if clustering is not None:
            sample = clustering.detect(sample)
        found.append((sample.mask & (sample.source == 0)).any(axis=1))
    return np.array(found)


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("kind", PHYSICAL)
def test_what_a_sensor_detects_it_detects_in_better_conditions(kind: str, condition: str) -> None:
    # Random numbers are common to all conditions, so this holds for every sample of every run.
    # The sun stands beside the car, which would shade the lens.
    aside = {"sun_azimuth": math.radians(12.0)}
    steps = [detected(kind, **aside, **weather) for weather in CONDITIONS[condition]]
    assert steps[0].any()
    for better, worse in itertools.pairwise(steps):
        assert not (worse & ~better).any()
    assert (steps[-1].sum() < steps[0].sum()) == (condition in PHYSICS[kind])
    assert np.array_equal(steps[-1], steps[0]) == (condition not in PHYSICS[kind])


# --- Radial speed: that of every sensor is the change of its own ranges, however the ego turns ----

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
