"""highway-env's own vehicles beside the compiled kernels, in step, from the same start."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from adeye.kernel.traffic import network as n
from adeye.signals import Floats
from benchmarks.support.crash import advance_crashing_reference
from benchmarks.support.highway_scenes import STEP, Advance, Converted, convert

SLOWEST = 0.5
"""Below this speed highway-env's own steering gain is ill-conditioned [m/s]."""


@dataclass
class Comparison:
    """How a scene went.

    Attributes:
        worst: Largest difference in position [m], heading [rad] or speed [m/s].
        steps: Compared before the first vehicle was too slow.
        vehicles: On the road.
        changes: Lanes of a road left for another of it.
        crashed: Vehicles that touched something.
        turned: Largest angle between a vehicle and its lane [rad].
    """

    worst: float
    steps: int
    vehicles: int
    changes: int
    crashed: int
    turned: float


def states_of(road: Any) -> Floats:
    """(N, 4) x, y, heading, speed of highway-env's vehicles in our frame."""
    rows = [[v.position[0], -v.position[1], -v.heading, v.speed] for v in road.vehicles]
    return np.array(rows, dtype=np.float64)


def compare(
    road: Any,
    steps: int = 300,
    *,
    kernel: Advance = advance_crashing_reference,
    disturb: Callable[[Converted], None] | None = None,
) -> Comparison:
    """Step highway-env and a kernel side by side until the first vehicle is too slow."""
    ours = convert(road)
    if disturb is not None:
        disturb(ours)
    worst = turned = 0.0
    changes = done = 0
    numbers = {index: number for number, index in enumerate(road.network.lanes_dict())}
    for _ in range(steps):
        before = [v.lane_index for v in road.vehicles]
        road.act()
        road.step(STEP)
        ours.advance(kernel)
        theirs = states_of(road)
        if (np.abs(theirs[:, 3]) <= SLOWEST).any():
            break
        done += 1
        worst = max(worst, float(np.abs(theirs - ours.states).max()))
        assert np.isfinite(worst)
        if worst <= 1e-9:
            assert ours.own_lanes == [numbers[v.lane_index] for v in road.vehicles]
        for lane, vehicle in zip(before, road.vehicles, strict=True):
            changes += lane != vehicle.lane_index and lane[:2] == vehicle.lane_index[:2]
            turned = max(turned, abs(float(vehicle.lane_offset[2])))
    crashed = sum(bool(v.crashed) for v in road.vehicles)
    if worst <= 1e-9 and done:
        mine = ours.marks[: len(road.vehicles), n.CRASHED].sum()
        assert done < steps or mine == crashed
    return Comparison(worst, done, len(road.vehicles), changes, crashed, turned)
