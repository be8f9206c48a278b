"""What sensors see of a car: rain, fog, darkness and a low sun take from it and add nothing."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye.signals import ILLUMINANCE, Bools
from adeye.simulate.channels.perception.clustering import Clustering
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.sensors.rig import BUILT_IN
from adeye.simulate.world.weather import MM_PER_HOUR, camera_range, glare_contrast, lidar_range
from adeye.spec.sensors import (
    model_name,
)
from tests.simulate.sensors.scenes import (
    CAR,
    scene,
    scene_context,
    seen,
    sensor_context,
    sensor_spec,
)

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
    context = scene_context(**weather)
    fields = {"field_of_view": "360 deg", "range": "100 m"} | sees
    sensor = RangingSensor(sensor_context(sensor_spec(kind, **fields), context))
    low, high, tick = 1e-3, 200.0, 0
    while high - low > 1e-6:
        centre = 0.5 * (low + high) + 0.5 * CAR[0]
        place = (centre * math.cos(bearing), centre * math.sin(bearing), bearing)
        found = seen(sensor.sense(scene(context, [place], tick=tick)))
        low, high = (0.5 * (low + high), high) if found else (low, 0.5 * (low + high))
        tick += 1
    return low


NIGHT = {"night_range": 0.5}
BRIGHT = {"range": "150 m", "reference_reflectivity": 0.9}
RAIN: dict[str, Any] = {"rain": 7.5 * MM_PER_HOUR, "fog_visibility": 10_000.0}


@pytest.mark.parametrize(
    ("kind", "sees", "weather", "expected"),
    [
        ("lidar", BRIGHT, RAIN, lidar_range(150.0, 0.5, 0.9, *RAIN.values())),
        ("camera", {}, RAIN, camera_range(100.0, RAIN["rain"], RAIN["fog_visibility"], 1.0)),
        ("camera", NIGHT, {"night": True, "illuminance": ILLUMINANCE["night"]}, 50.0),
        ("radar", {}, {"rain": 40.0 * MM_PER_HOUR}, 100.0),
        # The sun takes its contrast, and nothing from below the horizon.
        (
            "camera",
            {},
            {"sun_elevation": math.radians(10.0)},
            100.0 * glare_contrast(math.cos(math.radians(10.0)), ILLUMINANCE["day"]),
        ),
        ("camera", {}, {"sun_elevation": -0.01}, 100.0),
    ],
)
def test_range_is_that_of_the_formula(
    kind: str, sees: dict[str, Any], weather: dict[str, Any], expected: float
) -> None:
    assert reach(kind, sees=sees, **weather) == pytest.approx(expected, abs=1e-4)


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
    "camera": sensor_spec("camera/physical", **LOOK, **PIXELS),
    "lidar": sensor_spec("lidar/physical", **LOOK, range="100 m"),
    "radar": sensor_spec("radar/physical", **LOOK, range="100 m"),
    "ultrasonic": sensor_spec("ultrasonic", **LOOK, range="100 m"),
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
    context = scene_context(kinds=["parked_car"], runs=runs, **weather)
    spec = PHYSICAL[kind]
    sensor = BUILT_IN[model_name(spec)](sensor_context(spec, context))
    clustering = Clustering([spec] * runs, 1) if kind == "lidar" else None
    found = []
    for tick, distance in enumerate(DISTANCES):
        sample = sensor.sense(scene(context, [(distance + 0.5 * CAR[0], 0.0)], tick=tick))
        if clustering is not None:
            sample = clustering.detect(sample)
        found.append((sample.mask & (sample.source == 0)).any(axis=1))
    return np.array(found)


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("kind", PHYSICAL)
def test_what_a_physical_sensor_detects_in_worse_conditions_it_detects_in_better_ones(
    kind: str, condition: str
) -> None:
    # Random numbers are common to all conditions, so this holds for every sample of every run.
    # The sun stands beside the car, which would shade the lens.
    aside = {"sun_azimuth": math.radians(12.0)}
    steps = [detected(kind, **aside, **weather) for weather in CONDITIONS[condition]]
    assert steps[0].any()
    for better, worse in itertools.pairwise(steps):
        assert not (worse & ~better).any()
    assert (steps[-1].sum() < steps[0].sum()) == (condition in PHYSICS[kind])
    assert np.array_equal(steps[-1], steps[0]) == (condition not in PHYSICS[kind])
