"""What a suite of sensors can see and how fast it lets the vehicle go, without a simulation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.analysis.suite import conditions, speeds
from adeye.analysis.suite.conditions import CASES, DEFAULTS, TARGETS
from adeye.analysis.suite.coverage import anybody, blind_bearings, blind_spots, coverage, look_of
from adeye.analysis.suite.geometry import reach_of, view_of, zones_of
from adeye.analysis.suite.records import NotAnalysed, Removal, Suite, SuiteReach, SuiteSensor
from adeye.packaged import packaged_yaml
from adeye.spec.sensors import FmuSensor, PluginSensor, model_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from adeye.analysis.suite.conditions import Condition
    from adeye.analysis.suite.coverage import Look
    from adeye.analysis.suite.geometry import Reach, View
    from adeye.analysis.suite.records import (
        BlindBearing,
        BlindSpot,
        Slack,
        SpeedRange,
        ZoneCoverage,
    )
    from adeye.signals import Bools
    from adeye.spec.architecture import Architecture

# --- What is left of a suite when a sensor, an element or a shared resource fails -----------------

AHEAD = ("front_near", "front_mid", "front_far")
"""Zones of the lane ahead."""


def without(bench: _Bench, what: str, kind: str, lost: Collection[str]) -> Removal:
    """Say what is left without some sensors.

    Args:
        bench: The suite.
        what: Name of what fails; empty for nothing.
        kind: ``sensor``, ``element`` or ``resource``.
        lost: Sensors that go with it.
    """
    rows = [row for row, name in enumerate(bench.eyes) if name not in lost]
    look = bench.look
    total = sum(cells.area for cells in look.cells)
    ahead = [number for number, zone in enumerate(look.zones) if zone.id in AHEAD]
    front_total = sum(look.cells[number].area for number in ahead)
    front_seen, seen = {}, {}
    highest: dict[str, float | None] = {}
    least: dict[str, float | None] = {}
    for condition in bench.conditions:
        left = anybody(bench.seen[condition.id, "car"][rows])
        front = sum(
            float(look.of_zone(number, left).sum()) * look.cells[number].cell for number in ahead
        )
        front_seen[condition.id] = front / front_total
        seen[condition.id] = look.area(left) / total
        speeds = [_highest(bench, condition.id, case.id, lost) for case in CASES]
        highest[condition.id] = speeds[0]
        least[condition.id] = min((speed or 0.0 for speed in speeds), default=0.0) or None
    return Removal(what, kind, tuple(lost), front_seen, seen, highest, least)


def _highest(bench: _Bench, condition: str, case: str, lost: Collection[str]) -> float | None:
    left = [
        ok
        for path, ok in zip(bench.paths, bench.supported[condition, case], strict=True)
        if path.chain.sensor not in lost
    ]
    run = speeds.last_run(np.any(left, axis=0)) if left else None
    return None if run is None else float(speeds.SPEEDS[run[1]])


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


# --- Analyse the suite of an architecture: coverage, blind spots, range slack, loss of parts ------

_NOTES: Final[dict[str, Any]] = packaged_yaml("adeye.analysis.suite", "notes.yaml")
NOTES: Final[tuple[str, ...]] = tuple(_NOTES["always"])


def analyse(
    architecture: Architecture,
    conditions: Sequence[Condition] = DEFAULTS,
    *,
    odd_speed: float | None = None,
    resources: Mapping[str, Sequence[str]] | None = None,
) -> Suite:
    """Analyse what the sensors of an architecture see, without a simulation.

    Args:
        architecture: Vehicle, sensors, channels and switch.
        conditions: Weather, light and grip, the reference first.
        odd_speed: Highest speed of the ODD [m/s].
        resources: What each element of the concept shares with others.
    """
    bench = _Bench(architecture, tuple(conditions))
    whole = without(bench, "", "sensor", ())
    removals = tuple(
        without(bench, what, kind, lost)
        for what, kind, lost in groups_of(architecture, list(bench.eyes), resources or {})
    )
    vehicle = architecture.vehicle
    return Suite(
        architecture=architecture.architecture,
        title=architecture.title,
        cost=architecture.cost,
        sensor_cost=sum(sensor.cost for sensor in architecture.sensors.values()),
        length_m=vehicle.length,
        width_m=vehicle.width,
        height_m=vehicle.height,
        odd_speed_mps=odd_speed,
        sensors=tuple(bench.sensors()),
        not_analysed=tuple(bench.left_out()),
        conditions=bench.conditions,
        zones=bench.look.zones,
        coverage=tuple(bench.coverage()),
        blind_spots=tuple(bench.blind_spots()),
        bearings=tuple(bench.bearings()),
        chains=tuple(path.chain for path in bench.paths),
        slacks=tuple(bench.slacks(odd_speed)),
        speeds=tuple(bench.speeds()),
        forward=tuple(
            speeds.forward_range(bench.paths, condition, bench.front, odd_speed)
            for condition in bench.conditions
        ),
        whole=whole,
        removals=removals,
        critical=critical_of(whole, removals),
        notes=tuple(bench.notes()),
    )


@dataclass(frozen=True)
class _Bench:
    """One architecture with what several parts of its analysis need."""

    architecture: Architecture
    conditions: tuple[Condition, ...]

    @cached_property
    def eyes(self) -> dict[str, dict[tuple[str, str], Reach]]:
        """Reaches by condition and target of each sensor that looks around."""
        found: dict[str, dict[tuple[str, str], Reach]] = {}
        targets = {kind: conditions.target(kind) for kind in TARGETS}
        for name, sensor in self.architecture.sensors.items():
            reaches = {
                (condition.id, kind): reach_of(sensor, look, condition)
                for condition in self.conditions
                for kind, look in targets.items()
            }
            known = {key: reach for key, reach in reaches.items() if reach is not None}
            if known:
                found[name] = known
        return found

    @cached_property
    def views(self) -> dict[str, View]:
        """Where each of them looks."""
        vehicle = self.architecture.vehicle
        return {name: view_of(self.architecture.sensors[name], vehicle) for name in self.eyes}

    @property
    def size(self) -> tuple[float, float]:
        """Length and width of the ego [m]."""
        return self.architecture.vehicle.length, self.architecture.vehicle.width

    @property
    def front(self) -> float:
        """Of the ego, from its box centre [m]."""
        return 0.5 * self.size[0]

    @cached_property
    def look(self) -> Look:
        """The zones as the sensors look at them."""
        kinds = [str(self.architecture.sensors[name].kind) for name in self.eyes]
        return look_of(zones_of(*self.size), self.size, self.views, kinds)

    @cached_property
    def seen(self) -> dict[tuple[str, str], Bools]:
        """Which sensor detects the target where, by condition and target."""
        return {
            (condition.id, target): self.look.seen(
                [reaches[condition.id, target] for reaches in self.eyes.values()]
            )
            for condition, target in product(self.conditions, TARGETS)
        }

    @cached_property
    def paths(self) -> tuple[speeds.Path, ...]:
        """Ways from these sensors to the brakes."""
        return tuple(
            speeds.Path(chain, self.views[chain.sensor], self.eyes[chain.sensor])
            for chain in speeds.chains_of(self.architecture)
            if chain.sensor in self.eyes
        )

    @cached_property
    def supported(self) -> dict[tuple[str, str], list[Bools]]:
        """Speeds that each path supports, by condition and case."""
        return {
            (condition.id, case.id): [
                speeds.supported(path, condition, case, self.front) for path in self.paths
            ]
            for condition in self.conditions
            for case in CASES
        }

    def sensors(self) -> Iterator[SuiteSensor]:
        """Describe the sensors that look around."""
        for name, reaches in self.eyes.items():
            sensor = self.architecture.sensors[name]
            mount = sensor.mount  # type: ignore[union-attr]
            yield SuiteSensor(
                id=name,
                kind=str(sensor.kind),
                fidelity=str(getattr(sensor, "fidelity", "object")),
                x_m=mount.x,
                y_m=mount.y,
                z_m=mount.z,
                yaw_rad=mount.yaw,
                field_of_view_rad=sensor.field_of_view,  # type: ignore[union-attr]
                body_m=self.views[name].body,
                realises=sensor.realises,
                cost=sensor.cost,
                reaches=tuple(SuiteReach(*key, *reach) for key, reach in reaches.items()),
            )

    def left_out(self) -> Iterator[NotAnalysed]:
        """List the sensors of which nothing can be said, and why."""
        for name, sensor in self.architecture.sensors.items():
            if name in self.eyes:
                continue
            why = "do not look around"
            if isinstance(sensor, PluginSensor):
                why = "plug-ins, whose field of view and range are unknown"
            elif isinstance(sensor, FmuSensor):
                why = "FMUs, whose field of view and range are unknown"
            elif sensor.kind == "ground_truth":
                why = "no devices"
            yield NotAnalysed(name, str(sensor.kind), why)

    def coverage(self) -> Iterator[ZoneCoverage]:
        """Measure what is seen of each zone."""
        for condition, target in product(self.conditions, TARGETS):
            yield from coverage(self.look, self.seen[condition.id, target], target, condition)

    def blind_spots(self) -> Iterator[BlindSpot]:
        """Measure what is blind of each zone."""
        for condition, target in product(self.conditions, TARGETS):
            yield from blind_spots(self.look, self.seen[condition.id, target], target, condition)

    def bearings(self) -> Iterator[BlindBearing]:
        """Look for the nearest blind place in each direction."""
        views = list(self.views.values())
        for condition in self.conditions:
            reaches = [reaches[condition.id, "car"] for reaches in self.eyes.values()]
            yield from blind_bearings(views, reaches, self.size, condition)

    def slacks(self, odd_speed: float | None) -> Iterator[Slack]:
        """Compare range and need at round speeds and at the ODD's highest."""
        shown = {speed / 3.6 for speed in speeds.SHOWN}
        shown |= set() if odd_speed is None else {odd_speed}
        for condition, case, speed in product(self.conditions, CASES, sorted(shown)):
            yield speeds.slack_at(self.paths, condition, case, speed, self.front)

    def speeds(self) -> Iterator[SpeedRange]:
        """Find the speeds that the suite supports."""
        for condition, case in product(self.conditions, CASES):
            oks = self.supported[condition.id, case.id]
            yield speeds.speed_range(self.paths, oks, condition, case)

    def notes(self) -> Iterator[str]:
        """Say what is left out or assumed."""
        yield from NOTES
        has_sun = any(item.sun_elevation_rad is not None for item in self.conditions)
        yield _NOTES["low_sun" if has_sun else "no_sun"]
        sensors = self.architecture.sensors
        if any(model_name(sensors[name]) == "radar/physical" for name in self.eyes):
            yield _NOTES["radar_ahead"]
        assumed = sorted({path.chain.channel for path in self.paths if path.chain.is_assumed})
        if assumed:
            yield (
                f"Channels that do not state confirmation and braking ({', '.join(assumed)}) are "
                "taken to have those of the built-in nominal channel."
            )
        unlinked = sorted(set(self.eyes) - {path.chain.sensor for path in self.paths})
        if unlinked:
            yield f"Linked to no channel, so without a say in speed: {', '.join(unlinked)}."
