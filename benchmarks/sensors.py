"""What does a frame of each sensor cost?

A sensor alone, in a batch of 1,024 runs on one thread: CPU time per sample of one run, with 2, 5
and 20 objects around the ego on a motorway, none on the centre of its lane; for ultrasonic sensors
close around it, at walking pace. The ratio is the cost at 5 objects over that of the object-level
camera in the same round. Rounds interleaved in one process, warm-up thrown away. A sensor that
detects nothing in more than half of its frames is refused: then nothing that matters was measured.

    python benchmarks/sensors.py            the whole measurement
    python benchmarks/sensors.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from pydantic import TypeAdapter
from support.command import drive, ratios, spread
from support.sensor_scenes import World, worlds_of

from adeye.kernel.random import owner_id
from adeye.ports import SensorContext, SensorModel
from adeye.simulate.channels.perception.clustering import Clustering
from adeye.simulate.sensors.rig import BUILT_IN
from adeye.spec.sensors import PhysicalLidar, Sensor, model_name

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.signals import SceneContext

RUNS: Final = 1024
FRAMES: Final = 20
"""Frames of a round; the scene moves on from one to the next."""

COUNTS: Final = (2, 5, 20)
BASE: Final = "camera, objects"
LIDAR_CASE: Final = "lidar, 900 beams"
CLUSTERS: Final = "clusters of 900 beams"
"""What the channels' perception makes of that lidar, once for all of them."""


@dataclass(frozen=True)
class Case:
    """A sensor that is measured.

    Attributes:
        fields: Its record as in YAML.
        bar: Most that a frame with 5 objects may take [µs], None for no bar.
        light: Of ``LIGHTS``.
        is_close: Whether the objects are close around the ego.
        detects: Whether it detects objects at all.
    """

    fields: Mapping[str, Any]
    bar: float | None = None
    light: str = "day"
    is_close: bool = False
    detects: bool = True


FRONT: Final = {"mount": {"x": "2 m", "z": "0.5 m"}, "rate": "20 Hz"}
ROOF: Final = {"mount": {"x": "0 m", "z": "1.8 m"}, "rate": "10 Hz"}
PICTURE: Final = {
    "kind": "camera",
    "fidelity": "physical",
    "mount": {"x": "1.5 m", "z": "1.3 m"},
    "rate": "20 Hz",
    "field_of_view": "50 deg",
    "columns": 160,
    "rows": 60,
}
DIRT: Final = {"column": 50, "row": 20, "columns": 60, "rows": 25}
LIDAR: Final = {
    "kind": "lidar",
    "fidelity": "physical",
    "mount": {"x": "2 m", "z": "0.6 m"},
    "rate": "10 Hz",
    "field_of_view": "360 deg",
    "range": "150 m",
    "beams": 900,
}
RADAR: Final = {
    "kind": "radar",
    "fidelity": "physical",
    **FRONT,
    "field_of_view": "40 deg",
    "range": "200 m",
}

CASES: Final[dict[str, Case]] = {
    BASE: Case(
        {
            "kind": "camera",
            **FRONT,
            "field_of_view": "50 deg",
            "range": "120 m",
            "bearing_noise": "0.1 deg",
            "distance_noise": 0.02,
        },
        0.3,
    ),
    "radar, objects": Case(
        {
            "kind": "radar",
            **FRONT,
            "field_of_view": "40 deg",
            "range": "200 m",
            "range_noise": "0.3 m",
            "bearing_noise": "0.2 deg",
            "range_rate_noise": "0.1 m/s",
        },
        0.3,
    ),
    "lidar, objects": Case(
        {
            "kind": "lidar",
            **ROOF,
            "field_of_view": "360 deg",
            "range": "120 m",
            "range_noise": "0.05 m",
            "bearing_noise": "0.1 deg",
        },
        0.3,
    ),
    LIDAR_CASE: Case({**LIDAR, "range_noise": "0.03 m", "bearing_noise": "0.05 deg"}, 4.0),
    "lidar, 900 beams, exact": Case(LIDAR),
    "lidar, 16 x 900 beams": Case(
        {**LIDAR, "layers": 16, "vertical_field_of_view": "20 deg", "range_noise": "0.03 m"}
    ),
    "camera, 160 x 60": Case(PICTURE, 10.0),
    "camera, low sun": Case(PICTURE, 10.0, light="low sun"),
    "camera, night": Case(PICTURE, 10.0, light="night"),
    "camera, noise": Case({**PICTURE, "noise": 0.015}, 10.0),
    "camera, noisy patch": Case(
        {**PICTURE, "patches": {"dirt": {**DIRT, "transmission": 0.5, "noise": 0.02}}}, 10.0
    ),
    "radar, cells": Case(RADAR),
    "radar, much clutter": Case({**RADAR, "clutter": 5.0}),
    "ultrasonic": Case(
        {
            "kind": "ultrasonic",
            "mount": {"x": "2.45 m", "z": "0.5 m"},
            "rate": "20 Hz",
            "field_of_view": "60 deg",
            "range": "5 m",
            "range_noise": "0.03 m",
        },
        is_close=True,
    ),
    "gnss": Case(
        {
            "kind": "gnss",
            "rate": "10 Hz",
            "position_noise": "0.5 m",
            "bias": "1 m",
            "speed_noise": "0.05 m/s",
        },
        detects=False,
    ),
    "imu": Case(
        {
            "kind": "imu",
            "rate": "20 Hz",
            "acceleration_noise": "0.05 m/s^2",
            "acceleration_bias": "0.05 m/s^2",
            "yaw_rate_noise": "0.1 deg/s",
            "yaw_rate_bias": "0.05 deg/s",
        },
        detects=False,
    ),
    "localisation": Case(
        {
            "kind": "localisation",
            "rate": "20 Hz",
            "lateral_noise": "0.02 m",
            "heading_noise": "0.05 deg",
            "speed_noise": "0.05 m/s",
        },
        detects=False,
    ),
}
"""What is measured."""


def make(fields: Mapping[str, Any], context: SceneContext) -> SensorModel:
    """Build a sensor that samples at every tick and delivers at once."""
    spec: Sensor = TypeAdapter(Sensor).validate_python(dict(fields))
    owner = owner_id("sensor/measured")
    return BUILT_IN[model_name(spec)](
        SensorContext("measured", [spec] * context.runs, context, 1, 0, owner)
    )


def cost(case: Case, world: World) -> float:
    """CPU time of a frame of one run [µs], once the sensor has its memory.

    Raises:
        RuntimeError: It detects next to nothing.
    """
    sensor = make(case.fields, world.context)
    for scene in world.scenes[:2]:
        sensor.sense(scene)
    start = time.process_time()
    for scene in world.scenes:
        found = sensor.sense(scene)
    taken = time.process_time() - start
    seen = found.mask.any(axis=1) if found.hits is None else (found.hits >= 0).any(axis=1)
    if case.detects and seen.mean() < 0.5:
        msg = f"something is detected in {seen.mean():.0%} of the runs with {case.fields}"
        raise RuntimeError(msg)
    return 1e6 * taken / (world.context.runs * len(world.scenes))


def cost_of_clusters(world: World) -> float:
    """CPU time of finding the objects in a frame of the lidar with noise [µs]."""
    fields, context, scenes = CASES[LIDAR_CASE].fields, world.context, world.scenes
    spec = PhysicalLidar.model_validate(dict(fields))
    sensor = make(fields, context)
    clustering = Clustering([spec] * context.runs, len(context.object_ids))
    clustering.detect(sensor.sense(scenes[0]))
    taken = 0.0
    for scene in scenes[1:]:
        found = sensor.sense(scene)
        start = time.process_time()
        clustering.detect(found)
        taken += time.process_time() - start
    return 1e6 * taken / (context.runs * (len(scenes) - 1))


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every case at every number of objects once a round."""
    runs, frames = (8, 2) if smoke else (RUNS, FRAMES)
    worlds = {count: worlds_of(runs, frames, count) for count in COUNTS}
    names = {**{name: case.bar for name, case in CASES.items()}, CLUSTERS: None}
    took: dict[tuple[str, int], list[float]] = {(n, c): [] for n in names for c in COUNTS}
    for number in range(rounds + 1):
        for count, of in worlds.items():
            for name in names:
                if name == CLUSTERS:
                    found = cost_of_clusters(of["day", False])
                else:
                    case = CASES[name]
                    found = cost(case, of[case.light, case.is_close])
                if number:
                    took[name, count].append(found)
    return [
        {
            "sensor": name,
            "bar_us": bar,
            **{f"us_at_{count}": statistics.median(took[name, count]) for count in COUNTS},
            **ratios(list(zip(took[name, 5], took[BASE, 5], strict=True))),
        }
        for name, bar in names.items()
    ]


HEADERS = (
    "sensor",
    *(f"µs at {count}" for count in COUNTS),
    "bar at 5",
    "ratio to the camera (spread)",
)


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    bar = item["bar_us"]
    return [
        item["sensor"],
        *(f"{item[f'us_at_{count}']:.2f}" for count in COUNTS),
        "-" if bar is None else f"{bar:g}",
        spread(item),
    ]


if __name__ == "__main__":
    sys.exit(drive("sensors", __doc__, measure, HEADERS, row))
