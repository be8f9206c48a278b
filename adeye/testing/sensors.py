"""The conformance suite that every sensor has to pass."""

from __future__ import annotations

import copy
from dataclasses import fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals as columns
from adeye.kernel.random import owner_id
from adeye.kernel.relation import tick_time
from adeye.ports import SensorContext, SensorModel
from adeye.signals import Bools, Floats, Measurement, Scene, SceneContext, Surroundings
from adeye.simulate.faults.injector import InjectorContext, Moment
from adeye.simulate.faults.schedule import make_injector
from adeye.simulate.sensors.rig import malformed
from adeye.spec.fault import FAULT
from adeye.testing.demands import demand, demand_equal
from adeye.testing.scenes import ego_estimate, passenger_car, straight_road

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from adeye.spec.architecture import Architecture
    from adeye.spec.sensors import Sensor

# --- The conformance suite that every sensor has to pass ------------------------------------------

RUNS: Final = 3
TICKS: Final = 24
STEP: Final = 0.05
TOLERANCE: Final = 1e-9


def check_sensor(
    factory: Callable[[SensorContext], SensorModel],
    spec: Sensor,
    *,
    every: int = 2,
    latency: int = 1,
    jitter: int = 0,
) -> None:
    """Check that a sensor keeps the contract of ``ports.SensorModel``.

    Samples come at its rate, after its latency and within its jitter, nearest first, finite, equal
    for equal inputs, independent of the other runs of the batch; ground truth is not altered. Of
    ``values`` a row is finite or all NaN, which is a sample without content.

    Args:
        factory: Makes the sensor from its context.
        spec: Its spec record, the same for every run.
        every: Ticks between two samples.
        latency: Ticks from sample to delivery.
        jitter: Most ticks that a sample comes later than that.

    Raises:
        AssertionError: Names the first rule that it breaks.
    """
    context = SensorContext(
        "tested",
        [spec] * RUNS,
        three_objects(),
        every,
        latency,
        17,
        jitter,
        vehicles=[passenger_car()] * RUNS,
    )
    scenes = [scene_of(context.scene, tick) for tick in range(TICKS)]
    names = [field.name for field in fields(Measurement)]
    demand_alike = partial(demand_equal, names=names, shown=False)
    first = _play(factory(context), scenes)
    _check_samples(context, scenes, first)
    demand_alike(first, _play(factory(context), scenes), rule="equal inputs, other measurements")
    for run in range(RUNS):
        alone = _play(
            factory(
                replace(
                    context,
                    specs=[spec],
                    scene=_one_context(context.scene, run),
                    vehicles=context.vehicles[:1],
                )
            ),
            [_one_scene(scene, run) for scene in scenes],
        )
        part = [_one_measurement(item, run) for item in first]
        demand_alike(part, alone, rule=f"run {run} depends on the other runs of its batch")


def _play(sensor: SensorModel, scenes: Sequence[Scene]) -> list[Measurement]:
    delivered = []
    for scene in scenes:
        shown = copy.deepcopy(scene)
        delivered.append(copy.deepcopy(sensor.sense(shown)))
        for name in ("ego", "ego_place", "objects", "object_places"):
            same = np.array_equal(getattr(shown, name), getattr(scene, name))
            demand(same, f"the sensor alters {name} of the scene")
    return delivered


def _check_samples(
    context: SensorContext, scenes: Sequence[Scene], delivered: Sequence[Measurement]
) -> None:
    for item in delivered:
        _check_form(context.scene, item)
    if context.jitter > 0:
        _check_late(context, scenes, delivered)
        return
    newest = np.full(context.scene.runs, -1.0)
    for scene, item in zip(scenes, delivered, strict=True):
        due = scene.tick - context.latency
        is_new = due >= 0 and due % context.every == 0
        demand(
            bool((item.fresh == is_new).all()),
            f"tick {scene.tick}: fresh is {item.fresh}, a sample is{'' if is_new else ' not'} due",
        )
        if is_new:
            newest[:] = due * context.scene.step
        wrong = np.abs(item.stamp - newest) > TOLERANCE
        demand(
            not wrong.any(),
            f"tick {scene.tick}: stamp {item.stamp}, the sample is of {newest}",
        )


def _check_late(
    context: SensorContext, scenes: Sequence[Scene], delivered: Sequence[Measurement]
) -> None:
    step, every = context.scene.step, context.every
    newest: Floats = np.full(context.scene.runs, -1.0)
    is_late = False
    for scene, item in zip(scenes, delivered, strict=True):
        place = f"tick {scene.tick}"
        changed = np.abs(item.stamp - newest) > TOLERANCE
        demand(bool((item.stamp >= newest).all()), f"{place}: a sample overtakes")
        same = np.array_equal(changed, item.fresh)
        demand(same, f"{place}: fresh is {item.fresh}, new is {changed}")
        newest = item.stamp.copy()
        made = np.where(newest < 0.0, -every, np.round(newest / step))
        early = newest > (scene.tick - context.latency) * step + TOLERANCE
        demand(not early.any(), f"{place}: stamp {newest}, before the latency")
        due = scene.tick - context.latency - context.jitter - made
        demand(bool((due < every).all()), f"{place}: stamp {newest}, after the jitter")
        is_late |= bool((scene.tick - context.latency - made >= every).any())
    demand(is_late, "no sample comes later than its latency: the jitter is not used")


def _check_form(scene: SceneContext, item: Measurement) -> None:
    runs = scene.runs
    said = malformed(item, runs, len(scene.object_ids))
    demand(not said, said)
    if item.points is not None:
        demand(bool(np.isfinite(item.points).all()), "a point is not finite")
    if item.estimate is not None:
        demand(bool(np.isfinite(item.estimate).all()), "the estimate is not finite")
    if item.values is not None:
        whole = np.isfinite(item.values).all(axis=1) | np.isnan(item.values).all(axis=1)
        demand(bool(whole.all()), "a row of values is neither finite nor all NaN")
    for run in range(runs):
        _check_detections(item.mask[run], item.detections[run], item.source[run])


def _check_detections(mask: Floats, detections: Floats, source: Floats) -> None:
    found = int(np.count_nonzero(mask))
    demand(bool(mask[:found].all()), "detections are not packed to the front")
    seen = detections[:found]
    distance = np.hypot(seen[:, columns.DETECTION_X], seen[:, columns.DETECTION_Y])
    nearest_first = bool((np.diff(distance) >= -TOLERANCE).all())
    demand(nearest_first, "detections are not in order of distance")
    known = source[:found][source[:found] >= 0]
    demand(len(set(known.tolist())) == len(known), "an object is detected twice")


def three_objects() -> SceneContext:
    """Return the context of three runs with a lead, a neighbour and a wall."""
    return SceneContext(
        step=STEP,
        object_ids=("lead", "neighbour", "wall"),
        object_classes=np.array([0, 2, 9], dtype=np.int64),
        actor_count=2,
        object_sizes=np.tile([[4.5, 1.8, 1.5], [12.0, 2.5, 3.8], [3.0, 1.0, 1.0]], (RUNS, 1, 1)),
        object_reflectivity=np.full((RUNS, 3), 0.5),
        ego_size=np.tile([4.5, 1.8, 1.5], (RUNS, 1)),
        road=straight_road(RUNS),
        surroundings=Surroundings.clear(RUNS),
        stream_seeds=np.arange(11, 11 + RUNS, dtype=np.uint64),
        event_ids=(),
    )


def scene_of(context: SceneContext, tick: int) -> Scene:
    """Return the scene of ``three_objects`` at a tick: three ego speeds, constant velocities."""
    runs, time = context.runs, tick_time(tick, context.step)
    ego = np.zeros((runs, 7))
    ego[:, columns.EGO_SPEED] = 10.0 + 5.0 * np.arange(runs)
    ego[:, columns.EGO_X] = ego[:, columns.EGO_SPEED] * time
    ego[:, columns.EGO_Y] = 5.25
    objects = np.zeros((runs, 3, 5))
    objects[:, 0, :4] = [40.0 + 8.0 * time, 5.25, 0.0, 8.0]
    objects[:, 1, :4] = [30.0 + 20.0 * time, 8.75, 0.0, 20.0]
    objects[:, 2, :4] = [70.0, 1.75, 0.3, 0.0]
    places = np.zeros((runs, 3, 6))
    places[:, :, 0], places[:, :, 1] = objects[:, :, 0], objects[:, :, 1]
    estimate = ego_estimate(context.road, ego)
    return Scene(
        tick=tick,
        time=time,
        ego=ego,
        ego_place=estimate[:, 7:].copy(),
        objects=objects,
        object_places=places,
        begun=np.zeros((runs, 0)),
        ended=np.zeros((runs, 0), dtype=np.bool_),
        contact=np.full(runs, -1, dtype=np.int64),
        impact_speed=np.zeros(runs),
        foreign_contact=np.zeros(runs, dtype=np.bool_),
        running=np.ones(runs, dtype=np.bool_),
    )


def _one_context(context: SceneContext, run: int) -> SceneContext:
    part = slice(run, run + 1)
    return replace(
        context,
        object_sizes=context.object_sizes[part],
        object_reflectivity=context.object_reflectivity[part],
        ego_size=context.ego_size[part],
        road=context.road.of(part),
        surroundings=context.surroundings.of(part),
        stream_seeds=context.stream_seeds[part],
    )


def _one_scene(scene: Scene, run: int) -> Scene:
    part = slice(run, run + 1)
    arrays = {field.name: getattr(scene, field.name) for field in fields(Scene)[2:]}
    return Scene(scene.tick, scene.time, **{name: array[part] for name, array in arrays.items()})


def _one_measurement(item: Measurement, run: int) -> Measurement:
    return item.map(lambda array: array[run : run + 1])


# --- Fakes for those who write faults: an injector on its own, and the tick that it is told -------


def injector(  # noqa: PLR0913 - all but two have a default
    model: str,
    target: str,
    *,
    runs: int = 3,
    context: SceneContext | None = None,
    step: float = 0.05,
    parameters: Sequence[Mapping[str, Any]] | None = None,
    architecture: Architecture | None = None,
) -> Any:
    """Make the injector of one fault.

    Args:
        model: Of the fault.
        target: What fails.
        runs: B.
        context: Objects, sizes and seeds of the batch; ``three_objects`` unless given.
        step: Master clock [s].
        parameters: What the model has beside, as in YAML, for each run.
        architecture: Has the target; models that look at it need one.
    """
    fixed = {"id": "tested", "target": target, "model": model, "onset": {"at": "0 s"}}
    specs = [FAULT.validate_python({**fixed, **dict(item)}) for item in parameters or [{}] * runs]
    owner = np.uint64(owner_id("fault/tested"))
    scene = context or three_objects()
    architectures = [] if architecture is None else [architecture] * len(specs)
    return make_injector(InjectorContext(specs, scene, step, owner, architectures))


def moment(
    active: Bools,
    *,
    time: float = 0.0,
    age: float | Floats = 0.0,
    ego: Floats | None = None,
) -> Moment:
    """Return a tick at which a fault is active in some runs.

    Args:
        active: (B,).
        time: [s].
        age: Time since its onset [s], one or (B,).
        ego: (B, 7) states; at rest in the origin unless given.
    """
    ages = np.broadcast_to(np.asarray(age, dtype=np.float64), active.shape).copy()
    states = np.zeros((len(active), len(columns.EGO_COLUMNS))) if ego is None else ego
    return Moment(time, active, ages, states)
