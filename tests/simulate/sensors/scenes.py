"""Hand-made scenes for the tests of sensors: boxes at places, an ego, weather."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from adeye import signals
from adeye.kernel.random import owner_id
from adeye.ports import SensorContext
from adeye.signals import Floats, Measurement, Scene, SceneContext, Surroundings
from adeye.spec.architecture import Architecture
from adeye.spec.sensors import BuiltInSensor
from adeye.testing.scenes import ego_estimate, passenger_car, straight_road

CAR = (4.5, 1.8, 1.5)
TRUCK = (10.0, 2.5, 3.8)
RECORD: TypeAdapter[Any] = TypeAdapter(BuiltInSensor)

EGO = (0.0, 0.0, 0.0, 0.0)
"""x, y, heading, speed: at the origin, so that the map and the vehicle frame are one."""


def scene_context(
    sizes: Sequence[tuple[float, float, float]] = (CAR,),
    *,
    runs: int = 1,
    kinds: Sequence[str] | None = None,
    step: float = 0.05,
    **weather: Any,
) -> SceneContext:
    """Return a context with objects of these sizes, named ``thing_0`` and so on.

    Args:
        sizes: Length, width and height of each object [m].
        runs: B; run k has stream seed k + 1.
        kinds: Class of each object; cars unless given.
        step: Master clock [s].
        weather: Fields of ``Surroundings``, the same for every run.
    """
    clear = replace(Surroundings.clear(runs), fog_visibility=np.full(runs, 1e9))
    classes = [signals.OBJECT_CLASSES.index(kind) for kind in kinds or ["car"] * len(sizes)]
    return SceneContext(
        step=step,
        object_ids=tuple(f"thing_{index}" for index in range(len(sizes))),
        object_classes=np.array(classes, dtype=np.int64),
        actor_count=len(sizes),
        object_sizes=np.tile(np.array(sizes).reshape(1, -1, 3), (runs, 1, 1)),
        object_reflectivity=np.full((runs, len(sizes)), 0.5),
        ego_size=np.tile(CAR, (runs, 1)),
        road=straight_road(runs),
        surroundings=replace(clear, **{name: np.full(runs, v) for name, v in weather.items()}),
        stream_seeds=np.arange(1, runs + 1, dtype=np.uint64),
        event_ids=(),
    )


def scene(
    context: SceneContext,
    objects: Sequence[Sequence[float]],
    *,
    ego: Sequence[float] = EGO,
    tick: int = 0,
) -> Scene:
    """Return the scene of a tick, the same in every run.

    Args:
        context: Of the runs.
        objects: x, y, heading, speed of each object.
        ego: x, y, heading, speed.
        tick: Number of the tick.
    """
    runs = context.runs
    egos = np.zeros((runs, 7))
    egos[:, : len(ego)] = ego
    states = np.zeros((runs, len(objects), 5))
    for index, state in enumerate(objects):
        states[:, index, : len(state)] = state
    return Scene(
        tick=tick,
        time=tick * context.step,
        ego=egos,
        ego_place=ego_estimate(context.road, egos)[:, 7:].copy(),
        objects=states,
        object_places=np.zeros((runs, len(objects), 6)),
        begun=np.zeros((runs, 0)),
        ended=np.zeros((runs, 0), dtype=np.bool_),
        contact=np.full(runs, -1, dtype=np.int64),
        impact_speed=np.zeros(runs),
        foreign_contact=np.zeros(runs, dtype=np.bool_),
        running=np.ones(runs, dtype=np.bool_),
    )


def sensor_spec(model: str, **changes: Any) -> Any:
    """Return the record of a sensor that looks ahead from the origin, twenty times a second.

    Args:
        model: Its kind, with ``/physical`` where it makes what the device makes.
        changes: Fields of the record.
    """
    kind, _, fidelity = model.partition("/")
    fields = {"kind": kind, "mount": {"x": "0 m"}, "rate": "20 Hz"}
    if fidelity:
        fields["fidelity"] = fidelity
    return RECORD.validate_python(fields | changes)


def sensor_context(
    spec: Any,
    context: SceneContext,
    *,
    name: str = "front",
    every: int = 1,
    latency: int = 0,
) -> SensorContext:
    """Return what a sensor of this name is built with."""
    owner = owner_id(f"sensor/{name}")
    return SensorContext(name, [spec] * context.runs, context, every, latency, owner)


def seen(measurement: Measurement, run: int = 0) -> dict[int, tuple[float, float]]:
    """Return the measured place of each detected object in the vehicle frame [m]."""
    rows = np.flatnonzero(measurement.mask[run])
    places = measurement.detections[run]
    return {
        int(measurement.source[run, row]): (
            float(places[row, signals.DETECTION_X]),
            float(places[row, signals.DETECTION_Y]),
        )
        for row in rows
    }


def places(measurement: Measurement, thing: int) -> Floats:
    """Return the measured place (B, 2) of an object that every run detects [m]."""
    return np.array([seen(measurement, run)[thing] for run in range(measurement.mask.shape[0])])


def architecture(sensors: Mapping[str, Any]) -> Architecture:
    """Return an architecture with these sensors and a channel that is linked to all of them."""
    return Architecture.model_validate(
        {
            "architecture": "tested",
            "title": "Sensors under test",
            "vehicle": passenger_car(),
            "sensors": dict(sensors),
            "channels": {"nominal": {"kind": "nominal", "links": list(sensors)}},
            "switch": {"policy": "fixed_priority", "priority": ["nominal"], "default": "nominal"},
        }
    )
