"""What sensors of every kind deliver of three runs, and faults applied to it."""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from adeye import signals as s
from adeye.kernel.random import owner_id
from adeye.simulate.faults.injector import InjectorContext, Moment
from adeye.simulate.faults.schedule import make_injector
from adeye.simulate.sensors.rig import Rig
from adeye.spec.architecture import Architecture
from adeye.spec.fault import FAULT
from adeye.testing.sensors import scene_of, three_objects
from tests.motorway import ARCHITECTURE

TICKS = 40
STEP = 0.05
ONSET, END = 12, 24
"""Ticks between which faults are present: at both, every sensor delivers a new sample."""

_AHEAD = {"rate": "10 Hz", "latency": "0.1 s", "mount": {"x": "2 m", "y": "0.5 m", "z": "1.2 m"}}
_WIDE = {**_AHEAD, "field_of_view": "150 deg", "range": "150 m"}
SENSORS: dict[str, dict[str, Any]] = {
    "camera": {"kind": "camera", **_WIDE, "distance_noise": 0.02, "min_visible": 0.1},
    "pixel_camera": {
        "kind": "camera",
        "fidelity": "physical",
        **_AHEAD,
        "field_of_view": "100 deg",
        "columns": 320,
        "rows": 120,
    },
    "radar": {"kind": "radar", **_WIDE, "range_rate_noise": "0.1 m/s", "min_visible": 0.1},
    "cell_radar": {"kind": "radar", "fidelity": "physical", **_WIDE},
    "lidar": {"kind": "lidar", **_WIDE, "min_visible": 0.1},
    "beam_lidar": {"kind": "lidar", "fidelity": "physical", **_WIDE, "beams": 300},
    "ultrasonic": {
        "kind": "ultrasonic",
        **_AHEAD,
        "field_of_view": "60 deg",
        "range": "100 m",
    },
    "gnss": {
        "kind": "gnss",
        "rate": "10 Hz",
        "latency": "0.1 s",
        "position_noise": "0.5 m",
        "speed_noise": "0.2 m/s",
    },
    "imu": {
        "kind": "imu",
        "rate": "20 Hz",
        "acceleration_noise": "0.1 m/s^2",
        "yaw_rate_noise": "1 deg/s",
    },
    "localisation": {"kind": "localisation", "rate": "10 Hz", "lateral_noise": "0.1 m"},
    "truth": {"kind": "ground_truth", "rate": "20 Hz"},
}
SIZELESS = ("cell_radar", "ultrasonic")
"""Sensors that do not tell how large an object is."""

SUITE = Architecture.model_validate(
    {
        **ARCHITECTURE,
        "sensors": SENSORS,
        "channels": {"nominal": {"kind": "nominal", "links": ["truth"]}},
    }
)
CONTEXT = three_objects()
RUNS = CONTEXT.runs


@lru_cache
def scenes() -> tuple[s.Scene, ...]:
    """Ground truth at each tick."""
    made = [scene_of(CONTEXT, tick) for tick in range(TICKS)]
    for scene in made:
        # Nothing is zero, so that a factor shows.
        scene.ego[:, [s.EGO_HEADING, s.EGO_ACCELERATION, s.EGO_YAW_RATE]] = [0.01, 0.7, 0.05]
    return tuple(made)


def make_rig() -> Rig:
    cases: Any = [SimpleNamespace(architecture=SUITE)] * RUNS
    return Rig(cases, CONTEXT, Path())


@lru_cache
def streams() -> Mapping[str, tuple[s.Measurement, ...]]:
    """What each sensor delivers at each tick."""
    rig = make_rig()
    sensed = [copy.deepcopy(rig.sense(copy.deepcopy(scene))) for scene in scenes()]
    return {name: tuple(tick[name] for tick in sensed) for name in SENSORS}


def made(
    model: str,
    sensor: str,
    parameters: Sequence[Mapping[str, Any]] | Mapping[str, Any] | None = None,
    *,
    runs: Sequence[int] = (0, 1, 2),
    step: float = STEP,
) -> Any:
    """Make an injector for some of the runs; parameters of each run, or of all."""
    given: Any = parameters if isinstance(parameters, list) else [parameters or {}] * RUNS
    fixed = {"id": "tested", "target": f"sensors.{sensor}", "model": model, "onset": {"at": "0 s"}}
    specs = [FAULT.validate_python({**fixed, **dict(given[run])}) for run in runs]
    owner = np.uint64(owner_id("fault/tested"))
    context = CONTEXT if len(runs) == RUNS else of_runs(CONTEXT, runs)
    return make_injector(InjectorContext(specs, context, step, owner, [SUITE] * len(specs)))


def of_runs(context: s.SceneContext, runs: Sequence[int]) -> s.SceneContext:
    rows = list(runs)
    return replace(
        context,
        object_sizes=context.object_sizes[rows],
        object_reflectivity=context.object_reflectivity[rows],
        ego_size=context.ego_size[rows],
        road=context.road.of(rows),
        surroundings=context.surroundings.of(rows),
        stream_seeds=context.stream_seeds[rows],
    )


def window(tick: int, onset: int = ONSET, end: int = END) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Active in runs 0 and 2 between two ticks."""
    return np.array([True, False, True]) & (onset <= tick < end)


def played(
    injector: Any,
    sensor: str,
    active: Callable[[int], Any] = window,
    *,
    onset: int = ONSET,
    runs: Sequence[int] = (0, 1, 2),
) -> list[tuple[Any, Any]]:
    """Apply an injector tick by tick; return what was given and what became of it."""
    pairs: list[tuple[Any, Any]] = []
    rows = list(runs)
    for tick, (scene, delivered) in enumerate(zip(scenes(), streams()[sensor], strict=True)):
        given = copy.deepcopy(delivered.map(lambda array: array[rows]))
        age = np.full(len(rows), scene.time - onset * STEP if tick >= onset else np.nan)
        moment = Moment(scene.time, active(tick)[rows], age, scene.ego[rows])
        faulty = injector.apply(given, moment)
        # Kept as it is now: an injector may touch neither what it was given nor what it handed out.
        pairs.append((given, faulty if faulty is given else copy.deepcopy(faulty)))
        check_form(faulty)
    return pairs


def at_onset(model: str, sensor: str, parameters: Mapping[str, Any]) -> tuple[Any, Any]:
    """Return what was given at the onset of a fault, and what became of it."""
    return played(made(model, sensor, parameters), sensor)[ONSET]


def check_form(item: s.Measurement) -> None:
    """Demand that lists are packed and sorted and that empty rows are empty."""
    for mask, rows, source in zip(item.mask, item.detections, item.source, strict=True):
        found = int(np.count_nonzero(mask))
        assert mask[:found].all()
        assert (rows[found:] == 0.0).all()
        assert (source[found:] == -1).all()
        with np.errstate(all="ignore"):
            place = rows[:found, 0] ** 2 + rows[:found, 1] ** 2
        place = place[np.isfinite(place)]
        assert (np.diff(place) >= -1e-9).all()
        known = source[source >= 0]
        assert len(set(known.tolist())) == len(known)


def same(one: s.Measurement, other: s.Measurement, run: int | slice = slice(None)) -> bool:
    """Whether two measurements are equal bit for bit in a run; rows that are empty do not count."""
    for field in fields(s.Measurement):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if (a is None) != (b is None):
            return False
        if a is None:
            continue
        if field.name in ("mask", "detections", "source"):
            size = min(a.shape[1], b.shape[1])
            rest = one.mask if a.shape[1] > size else other.mask
            if rest[run][..., size:].any():
                return False
            a, b = a[:, :size], b[:, :size]
        if a[run].tobytes() != b[run].tobytes():
            return False
    return True
