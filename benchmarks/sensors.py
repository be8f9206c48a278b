"""What does a frame of each sensor cost?

A sensor alone, in a batch of 1,024 runs on one thread: CPU time per sample of one run, with 2, 5
and 20 objects around the ego on a motorway, none on the centre of its lane. The ratio is the cost
at 5 objects over that of the object-level camera in the same round. Rounds interleaved in one
process, warm-up thrown away. A case is a line of ``CASES``; its bar is the most that a frame at 5
objects may take on the reference machine.

    python benchmarks/sensors.py            the whole measurement
    python benchmarks/sensors.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import time
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from pydantic import TypeAdapter
from support.command import drive, ratios, spread

from adeye.channels.clustering import Clustering
from adeye.kernel.random import owner_id, uniform
from adeye.ports import SensorContext, SensorModel
from adeye.sensors.rig import BUILT_IN
from adeye.signals import OBJECT_CLASSES, Scene, SceneContext, Surroundings
from adeye.spec.sensors import PhysicalLidar, Sensor, model_name
from adeye.testing.scenes import ego_estimate, straight_road

if TYPE_CHECKING:
    from collections.abc import Mapping

RUNS: Final = 1024
FRAMES: Final = 20
"""Frames of a round; the scene moves on from one to the next."""

COUNTS: Final = (2, 5, 20)
LANE: Final = 3.5
BASE: Final = "camera, objects"
LIDAR_CASE: Final = "lidar, 900 beams"
CLUSTERS: Final = "clusters of 900 beams"
"""What the channels' perception makes of that lidar, once for all of them."""

FRONT: Final = {"mount": {"x": "2 m", "z": "0.5 m"}, "rate": "20 Hz"}
ROOF: Final = {"mount": {"x": "0 m", "z": "1.8 m"}, "rate": "10 Hz"}
LIDAR: Final = {
    "mount": {"x": "2 m", "z": "0.6 m"},
    "rate": "10 Hz",
    "field_of_view": "360 deg",
    "range": "150 m",
}

CASES: Final[dict[str, tuple[Mapping[str, Any], float | None]]] = {
    BASE: (
        {
            "kind": "camera",
            **FRONT,
            "field_of_view": "50 deg",
            "range": "120 m",
            "bearing_noise": "0.1 deg",
            "distance_noise": 0.02,
        },
        None,
    ),
    "radar, objects": (
        {
            "kind": "radar",
            **FRONT,
            "field_of_view": "40 deg",
            "range": "200 m",
            "range_noise": "0.3 m",
            "bearing_noise": "0.2 deg",
            "range_rate_noise": "0.1 m/s",
        },
        None,
    ),
    "lidar, objects": (
        {
            "kind": "lidar",
            **ROOF,
            "field_of_view": "360 deg",
            "range": "120 m",
            "range_noise": "0.05 m",
            "bearing_noise": "0.1 deg",
        },
        None,
    ),
    LIDAR_CASE: (
        {
            "kind": "lidar",
            "fidelity": "physical",
            **LIDAR,
            "beams": 900,
            "range_noise": "0.03 m",
            "bearing_noise": "0.05 deg",
        },
        4.0,
    ),
    "lidar, 900 beams, exact": (
        {"kind": "lidar", "fidelity": "physical", **LIDAR, "beams": 900},
        None,
    ),
    "lidar, 16 x 900 beams": (
        {
            "kind": "lidar",
            "fidelity": "physical",
            **LIDAR,
            "beams": 900,
            "layers": 16,
            "vertical_field_of_view": "20 deg",
            "range_noise": "0.03 m",
        },
        None,
    ),
    "localisation": (
        {
            "kind": "localisation",
            "rate": "20 Hz",
            "lateral_noise": "0.02 m",
            "heading_noise": "0.05 deg",
            "speed_noise": "0.05 m/s",
        },
        None,
    ),
}
"""What is measured: spec record as in YAML, and the bar [µs per frame] or None."""


def context_of(runs: int, count: int) -> SceneContext:
    """Return what does not change: cars, and every fifth object a truck."""
    is_truck = np.arange(count) % 5 == 4
    sizes = np.where(is_truck[:, np.newaxis], (12.0, 2.5, 3.8), (4.6, 1.85, 1.5))
    classes = np.where(is_truck, OBJECT_CLASSES.index("truck"), OBJECT_CLASSES.index("car"))
    return SceneContext(
        step=0.05,
        object_ids=tuple(f"actor_{index}" for index in range(count)),
        object_classes=classes.astype(np.int64),
        actor_count=count,
        object_sizes=np.tile(sizes, (runs, 1, 1)),
        object_reflectivity=np.full((runs, count), 0.5),
        ego_size=np.tile([4.9, 1.9, 1.6], (runs, 1)),
        road=straight_road(runs),
        surroundings=Surroundings.clear(runs),
        stream_seeds=np.arange(1, runs + 1, dtype=np.uint64),
        event_ids=(),
    )


def scenes_of(context: SceneContext, frames: int) -> list[Scene]:
    """Return the frames: the ego at 30 m/s amid traffic on three lanes, at uneven places."""
    runs, count = context.runs, len(context.object_ids)
    draws = np.array(
        [
            [uniform(np.uint64(run), np.uint64(1), 0, index) for index in range(4 * count + 1)]
            for run in range(runs)
        ]
    )
    ego = np.zeros((runs, 7))
    ego[:, 1] = 1.5 * LANE + 0.4 * (draws[:, -1] - 0.5)
    ego[:, 3] = 30.0
    objects = np.zeros((runs, count, 5))
    of = draws[:, :-1].reshape(runs, count, 4)
    # One lane after the other, 30 m to 50 m from row to row as at 30 m/s; two thirds are ahead.
    lane, row = np.arange(count) % 3, np.arange(count) // 3
    apart = np.where(lane == 1, 12.0, -10.0)
    objects[:, :, 0] = apart + (row - count // 9) * 40.0 + 20.0 * (of[:, :, 0] - 0.5)
    objects[:, 0, 0] = 25.0 + 50.0 * of[:, 0, 0]
    objects[:, :, 1] = (np.array([1, 2, 0])[lane] + 0.5) * LANE + 0.6 * (of[:, :, 1] - 0.5)
    objects[:, :, 2] = 0.05 * (of[:, :, 2] - 0.5)
    objects[:, :, 3] = 25.0 + 10.0 * of[:, :, 3]
    found = []
    for tick in range(frames):
        time_s = tick * context.step
        moved, seen = ego.copy(), objects.copy()
        moved[:, 0] += time_s * ego[:, 3]
        seen[:, :, 0] += time_s * objects[:, :, 3]
        found.append(
            Scene(
                tick=tick,
                time=time_s,
                ego=moved,
                ego_place=ego_estimate(context.road, moved)[:, 7:].copy(),
                objects=seen,
                object_places=np.zeros((runs, count, 6)),
                begun=np.zeros((runs, 0)),
                contact=np.full(runs, -1, dtype=np.int64),
                impact_speed=np.zeros(runs),
                foreign_contact=np.zeros(runs, dtype=np.bool_),
                running=np.ones(runs, dtype=np.bool_),
            )
        )
    return found


def make(fields: Mapping[str, Any], context: SceneContext) -> SensorModel:
    """Build a sensor that samples at every tick and delivers at once."""
    spec: Sensor = TypeAdapter(Sensor).validate_python(dict(fields))
    owner = owner_id("sensor/measured")
    return BUILT_IN[model_name(spec)](
        SensorContext("measured", [spec] * context.runs, context, 1, 0, owner)
    )


def cost(fields: Mapping[str, Any], context: SceneContext, scenes: list[Scene]) -> float:
    """CPU time of a frame of one run [µs], once the sensor has its memory."""
    sensor = make(fields, context)
    for scene in scenes[:2]:
        sensor.sense(scene)
    start = time.process_time()
    for scene in scenes:
        sensor.sense(scene)
    return 1e6 * (time.process_time() - start) / (context.runs * len(scenes))


def cost_of_clusters(context: SceneContext, scenes: list[Scene]) -> float:
    """CPU time of finding the objects in a frame of the lidar with noise [µs]."""
    fields = CASES[LIDAR_CASE][0]
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
    worlds = {}
    for count in COUNTS:
        context = context_of(runs, count)
        worlds[count] = (context, scenes_of(context, frames))
    names = {**{name: bar for name, (_, bar) in CASES.items()}, CLUSTERS: None}
    took: dict[tuple[str, int], list[float]] = {(n, c): [] for n in names for c in COUNTS}
    for number in range(rounds + 1):
        for count, (context, scenes) in worlds.items():
            for name in names:
                if name == CLUSTERS:
                    found = cost_of_clusters(context, scenes)
                else:
                    found = cost(CASES[name][0], context, scenes)
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
