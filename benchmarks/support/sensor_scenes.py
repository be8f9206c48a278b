"""Scenes for a sensor on its own: traffic on a motorway, or objects close around the ego."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.random import uniform
from adeye.signals import ILLUMINANCE, OBJECT_CLASSES, Scene, SceneContext, Surroundings
from adeye.testing.scenes import ego_estimate, straight_road

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.signals import Floats

LANE: Final = 3.5

LIGHTS: Final[Mapping[str, Mapping[str, float]]] = {
    "day": {},
    "low sun": {"sun_elevation": 0.17, "sun_azimuth": 0.1},
    "night": {"illuminance": ILLUMINANCE["night"]},
}
"""Conditions by name, as far as they are not those of a clear and overcast day."""


@dataclass(frozen=True)
class World:
    """What the sensors of a light look at.

    Attributes:
        context: Of the scenes.
        scenes: The frames.
    """

    context: SceneContext
    scenes: list[Scene]


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


def scenes_of(context: SceneContext, frames: int, *, is_close: bool = False) -> list[Scene]:
    """Return the frames: the ego at 30 m/s amid traffic on three lanes, at uneven places.

    Args:
        context: Of the scene.
        frames: How many.
        is_close: Whether the ego creeps and the objects stand close around it instead.
    """
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
    if is_close:
        ego[:, 3] = 1.0
        _close_in(ego, objects, of)
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
                ended=np.zeros((runs, 0), dtype=np.bool_),
                contact=np.full(runs, -1, dtype=np.int64),
                impact_speed=np.zeros(runs),
                foreign_contact=np.zeros(runs, dtype=np.bool_),
                running=np.ones(runs, dtype=np.bool_),
            )
        )
    return found


def _close_in(ego: Floats, objects: Floats, draws: Floats) -> None:
    """Stand objects (B, M, 5) ahead of the egos (B, 7), side by side, the first one nearest."""
    for thing in range(objects.shape[1]):
        beside = (thing + 1) // 2 * (1.0 if thing % 2 else -1.0)
        objects[:, thing, 0] = ego[:, 0] + 6.0 + 0.8 * thing + 2.0 * draws[:, thing, 0]
        objects[:, thing, 1] = ego[:, 1] + 2.2 * beside + draws[:, thing, 1] - 0.5
    objects[:, :, 3] = 0.0


def worlds_of(runs: int, frames: int, count: int) -> dict[tuple[str, bool], World]:
    """Return what is looked at with a number of objects, by light and whether they are close."""
    plain = context_of(runs, count)
    scenes = {close: scenes_of(plain, frames, is_close=close) for close in (False, True)}
    found = {}
    for light, conditions in LIGHTS.items():
        columns = {name: np.full(runs, value) for name, value in conditions.items()}
        context = replace(plain, surroundings=replace(plain.surroundings, **columns))
        for close, frames_of_it in scenes.items():
            found[light, close] = World(context, frames_of_it)
    return found
