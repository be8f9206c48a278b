"""One seeing sensor and a nominal channel that hears nothing else: what it has tracks of."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from adeye.signals import DETECTION_X, DETECTION_Y, Floats, Measurement
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.perception.clustering import Clustering
from adeye.simulate.sensors.rig import Rig, mounts
from adeye.spec.channels import NominalParameters
from adeye.spec.sensors import PhysicalLidar
from adeye.sweep.case import TestCase
from adeye.testing.scenes import channel_context
from tests.simulate.sensors.scenes import CAR, architecture, scene, scene_context

EGO = (100.0, 5.25)
"""Where the ego is at first; it drives along x."""
SPEED = 10.0
STEP = 0.05
WALL = (0.2, 3.0, 3.0)
TRUCK = (10.0, 2.5, 3.8)
PERSON = (0.5, 0.6, 1.75)

Size = tuple[float, float, float]
Place = tuple[float, float]


@dataclass(frozen=True)
class Eye:
    """A sensor at the origin of the vehicle frame, and what it is shown.

    Attributes:
        record: Its record without mount.
        hider: Size of what stands before the actor.
        hider_x: How far ahead its centre is [m].
        actor: Size of the actor.
        actor_x: How far ahead its centre is [m].
        half_view: Half of its field of view [rad].
        tells_bearing: Whether it knows where in its field of view something is.
        misses: Samples that it may miss although it can see: signals fluctuate.
        error: How far from its object a track may be [m].
    """

    record: Mapping[str, Any]
    hider: Size = TRUCK
    hider_x: float = 16.0
    actor: Size = CAR
    actor_x: float = 32.0
    tells_bearing: bool = True
    misses: int = 0
    error: float = 3.0

    @property
    def half_view(self) -> float:
        """Half of its field of view [rad]."""
        return math.radians(float(str(self.record["field_of_view"]).removesuffix(" deg"))) / 2.0


VIEW = {"field_of_view": "50 deg", "range": "100 m"}
EYES = {
    "camera": Eye(VIEW),
    "camera/physical": Eye({"field_of_view": "50 deg", "columns": 640, "rows": 160}, error=5.0),
    "radar": Eye(VIEW),
    "radar/physical": Eye(VIEW | {"clutter": 0}, misses=2),
    "lidar": Eye(VIEW),
    "lidar/physical": Eye(VIEW),
    "ultrasonic": Eye(
        {"field_of_view": "50 deg", "range": "10 m"}, WALL, 2.0, PERSON, 8.0, tells_bearing=False
    ),
}
"""Sensors without noise; the error is that of pixels, beams and signals."""


def record_of(model: str, *, yaw: float = 0.0, **changes: Any) -> dict[str, Any]:
    """Return the record of a sensor that looks in a direction [deg], with some fields changed."""
    kind, _, fidelity = model.partition("/")
    return {
        "kind": kind,
        **({"fidelity": fidelity} if fidelity else {}),
        "mount": {"x": "0 m", "z": "1.3 m", "yaw": f"{yaw} deg"},
        "rate": "20 Hz",
        **EYES[model].record,
        **changes,
    }


@dataclass(frozen=True)
class Seen:
    """What came of one drive.

    Attributes:
        tracks: Of each tick, places (N, 2) of the confirmed tracks in the vehicle frame [m].
        detections: Of each tick, places (N, 2) of the detections.
    """

    tracks: list[Floats]
    detections: list[Floats]


def drive(
    record: Mapping[str, Any],
    sizes: Sequence[Size],
    places: Callable[[float], Sequence[Place]],
    ticks: int,
    *,
    headings: Callable[[float], Sequence[float]] | None = None,
    closing: float = 0.0,
    **weather: Any,
) -> Seen:
    """Let a nominal channel with this sensor and a localisation watch objects.

    Args:
        record: Of the sensor.
        sizes: Of the objects.
        places: Where they are in the vehicle frame at a time [s].
        ticks: How long.
        headings: Of the objects in the vehicle frame [rad]; along the ego's unless given.
        closing: How much slower than the ego they drive [m/s], as a radar measures it.
        weather: Fields of ``Surroundings``.
    """
    suite = {"eye": dict(record), "pose": {"kind": "localisation", "rate": "20 Hz"}}
    made = SimpleNamespace(architecture=architecture(suite))
    cases = cast("list[TestCase]", [made])
    kinds = {CAR: "car", TRUCK: "truck", PERSON: "pedestrian", WALL: "barrier"}
    context = scene_context(sizes, kinds=[kinds.get(size, "car") for size in sizes], **weather)
    rig = Rig(cases, context, Path())
    spec = made.architecture.sensors["eye"]
    clustering = Clustering([spec], len(sizes)) if isinstance(spec, PhysicalLidar) else None
    channel = NominalChannel()
    listened = channel_context(
        NominalParameters(),
        links=("eye", "pose"),
        sensors={"eye": spec.kind, "pose": "localisation"},
        road=context.road,
        step=STEP,
    )
    channel.reset(replace(listened, mounts=mounts(cases)))
    seen = Seen([], [])
    for tick in range(ticks):
        time = tick * STEP
        ego = (EGO[0] + SPEED * time, EGO[1], 0.0, SPEED)
        turned = headings(time) if headings is not None else [0.0] * len(sizes)
        things = [
            (ego[0] + x, ego[1] + y, heading, SPEED - closing)
            for (x, y), heading in zip(places(time), turned, strict=True)
        ]
        readings = dict(rig.sense(scene(context, things, ego=ego, tick=tick)))
        if clustering is not None:
            readings["eye"] = clustering.detect(readings["eye"])
        running = np.ones(1, dtype=np.bool_)
        shown = observe(("eye", "pose"), time, readings, {}, None, running, protect=False)
        tracks = channel.act(shown).tracks
        assert tracks is not None
        seen.tracks.append(tracks[0][np.isfinite(tracks[0, :, 0]), :2])
        seen.detections.append(found(readings["eye"]))
    return seen


def found(reading: Measurement) -> Floats:
    """Return the places (N, 2) of the detections of the first run [m]."""
    rows: Floats = reading.detections[0, reading.mask[0]][:, [DETECTION_X, DETECTION_Y]]
    return rows.copy()


def knows(eye: Eye, tracks: Floats, place: Place) -> bool:
    """Tell whether one of the tracks (N, 2) is that of an actor at a place [m]."""
    if not eye.tells_bearing:
        # It lies on the axis of the cone, at the distance of the actor.
        away = np.abs(np.hypot(tracks[:, 0], tracks[:, 1]) - math.hypot(*place))
    else:
        away = np.hypot(tracks[:, 0] - place[0], tracks[:, 1] - place[1])
    return bool((away < eye.error).any())
