"""What is left of a suite when a sensor, an element or a shared resource fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.suite.coverage import anybody
from adeye.evaluation.suite.results import Removal
from adeye.evaluation.suite.speeds import SPEEDS, last_run
from adeye.evaluation.suite.targets import CASES

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from adeye.evaluation.suite.conditions import Condition
    from adeye.evaluation.suite.coverage import Look
    from adeye.signals import Bools
    from adeye.spec.architecture import Architecture

AHEAD = ("front_near", "front_mid", "front_far")
"""Zones of the lane ahead."""


@dataclass(frozen=True)
class Parts:
    """What a suite achieves sensor by sensor, so that parts can be left out.

    Attributes:
        conditions: Weather, light and grip.
        look: The zones' cells.
        sensors: Ids, in the order of the rows of ``seen``.
        seen: (S, K) which sensor detects a car where, by condition.
        chain_sensors: The sensor of each chain.
        supported: Speeds that each chain supports, by condition and case.
    """

    conditions: tuple[Condition, ...]
    look: Look
    sensors: tuple[str, ...]
    seen: Mapping[str, Bools]
    chain_sensors: tuple[str, ...]
    supported: Mapping[tuple[str, str], Sequence[Bools]]


def without(parts: Parts, what: str, kind: str, lost: Collection[str]) -> Removal:
    """Say what is left without some sensors.

    Args:
        parts: The suite.
        what: Name of what fails; empty for nothing.
        kind: ``sensor``, ``element`` or ``resource``.
        lost: Sensors that go with it.
    """
    rows = [row for row, name in enumerate(parts.sensors) if name not in lost]
    look = parts.look
    total = sum(cells.area for cells in look.cells)
    ahead = [number for number, zone in enumerate(look.zones) if zone.id in AHEAD]
    front_total = sum(look.cells[number].area for number in ahead)
    front_seen, seen = {}, {}
    highest: dict[str, float | None] = {}
    least: dict[str, float | None] = {}
    for condition in parts.conditions:
        left = anybody(parts.seen[condition.id][rows])
        front = sum(
            float(look.of_zone(number, left).sum()) * look.cells[number].cell for number in ahead
        )
        front_seen[condition.id] = front / front_total
        seen[condition.id] = look.area(left) / total
        speeds = [_highest(parts, condition.id, case.id, lost) for case in CASES]
        highest[condition.id] = speeds[0]
        least[condition.id] = min((speed or 0.0 for speed in speeds), default=0.0) or None
    return Removal(what, kind, tuple(lost), front_seen, seen, highest, least)


def _highest(parts: Parts, condition: str, case: str, lost: Collection[str]) -> float | None:
    left = [
        ok
        for sensor, ok in zip(parts.chain_sensors, parts.supported[condition, case], strict=True)
        if sensor not in lost
    ]
    run = last_run(np.any(left, axis=0)) if left else None
    return None if run is None else float(SPEEDS[run[1]])


def groups_of(
    architecture: Architecture, sensors: Sequence[str], resources: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """List what may fail: each sensor, each element, each resource that elements share.

    An element that one sensor alone realises under the same name is not listed twice.

    Args:
        architecture: Whose parts say which element they realise.
        sensors: Those that are analysed.
        resources: Of each element, from the concept.

    Yields:
        Name, kind and sensors that go with it.
    """
    elements: dict[str, list[str]] = {}
    shared: dict[str, list[str]] = {}
    for name in sensors:
        yield name, "sensor", (name,)
        element = architecture.sensors[name].realises
        if element is not None:
            elements.setdefault(element, []).append(name)
            for resource in resources.get(element, ()):
                shared.setdefault(resource, []).append(name)
    for element, lost in elements.items():
        if lost != [element]:
            yield element, "element", tuple(lost)
    for resource, lost in shared.items():
        yield resource, "resource", tuple(lost)


def critical_of(whole: Removal, removals: Sequence[Removal]) -> str:
    """Name the sensor whose loss costs most: speed for a stopped car and for all cases, then sight.

    Speeds and shares are added up over the conditions.

    Returns:
        Empty if the loss of no sensor costs anything.
    """
    singles = [item for item in removals if item.kind == "sensor"]
    if not singles:
        return ""
    worst = min(singles, key=_left)
    return worst.what if _left(worst) < _left(whole) else ""


def _left(item: Removal) -> tuple[float, float]:
    speeds = [*item.highest_mps.values(), *item.all_cases_mps.values()]
    return sum(speed or 0.0 for speed in speeds), sum(item.seen.values())
