"""Parts of an architecture by themselves: each number that goes in or comes out has a name.

What a part is told lies in arrays, as between the stages of a run; a name stands for a place in
one. A step of a part from a tick to the next does what the run does at the tick: it takes what is
told then, and what comes out is what holds until the next one. Of a vehicle that is its state at
the next tick.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye import signals as columns
from adeye.errors import UsageError, require_known
from adeye.kernel.motion import FRICTION
from adeye.kernel.relation import tick_time
from adeye.ports import SwitchContext
from adeye.signals import Authority, ControlCommand, Measurement, SwitchFaults
from adeye.simulate.channels.factory import BUILT_IN
from adeye.simulate.channels.links import SWITCH, View, health_of, linked_channels, no_command
from adeye.simulate.channels.rack import ChannelRack
from adeye.simulate.mirror import as_driven
from adeye.simulate.sensors.rig import BUILT_IN as SENSORS
from adeye.simulate.sensors.rig import Rig
from adeye.simulate.switch import make_switch
from adeye.simulate.traffic import make_traffic
from adeye.simulate.traffic.stage import locate_all, move_egos, vehicle_limits
from adeye.spec.architecture import HEALTH
from adeye.spec.sensors import model_name

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from numpy.typing import NDArray

    from adeye.signals import Scene
    from adeye.spec.architecture import Architecture
    from adeye.sweep.case import TestCase

LEAST_ROWS: Final = 16
"""Detections that a channel can be told of each sensor, at least: elsewhere there is more to see
than in the scenario that it is made with."""

_NO_PLACE: Final = Path()
"""Parts of the package name no files."""

_UNITS: Final[Mapping[str, str]] = {
    **dict.fromkeys(("x", "y", "s", "d", "offset", "length", "width"), "m"),
    **dict.fromkeys(("stamp", "delay"), "s"),
    **dict.fromkeys(("speed", "range_rate", "velocity_x", "velocity_y"), "m/s"),
    **dict.fromkeys(("acceleration", "acceleration_x", "acceleration_y"), "m/s2"),
    **dict.fromkeys(("heading", "road_heading", "steering_angle"), "rad"),
    "yaw_rate": "rad/s",
    "curvature": "1/m",
}
"""Of what is called so; everything else is a plain number."""

# --- Names of the numbers that lie in arrays ------------------------------------------------------


class Value(NamedTuple):
    """A number by name.

    Attributes:
        name: With dots, and places of rows from 1 in brackets.
        array: Where it lies.
        at: Its place there.
        text: What it means; empty where its name says it.
    """

    name: str
    array: NDArray[Any]
    at: tuple[int, ...]
    text: str = ""

    @property
    def unit(self) -> str:
        """Its unit; empty for a plain number."""
        return _UNITS.get(self.name.rpartition(".")[2], "")

    def get(self) -> Any:
        """Return it as it is now."""
        return self.array[self.at].item()

    def set(self, value: Any) -> None:
        """Change it."""
        self.array[self.at] = value


def _row(prefix: str, array: NDArray[Any], at: tuple[int, ...], names: Any) -> Iterator[Value]:
    for place, name in enumerate(names):
        yield Value(f"{prefix}{name}", array, (*at, place))


def measurement_values(name: str, item: Measurement) -> Iterator[Value]:
    """Name the numbers of a measurement of one run, but for the returns of a lidar's beams."""
    yield Value(f"{name}.stamp", item.stamp, (0,), "time of the sample, -1 before the first")
    yield Value(f"{name}.fresh", item.fresh, (0,), "delivered at this tick")
    yield Value(f"{name}.alive", item.alive, (0,), "it delivers at all")
    for row in range(item.mask.shape[1]):
        place = f"{name}.detections[{row + 1}]"
        yield Value(f"{place}.present", item.mask, (0, row))
        yield from _row(f"{place}.", item.detections, (0, row), columns.DETECTION_COLUMNS)
    if item.estimate is not None:
        yield from _row(f"{name}.estimate.", item.estimate, (0,), columns.ESTIMATE_COLUMNS)
    if item.values is not None:
        is_imu = item.values.shape[1] == len(columns.IMU_COLUMNS)
        names = columns.IMU_COLUMNS if is_imu else columns.GNSS_COLUMNS
        yield from _row(f"{name}.", item.values, (0,), names)


def command_values(prefix: str, item: ControlCommand, monitors: tuple[str, ...]) -> list[Value]:
    """Name the numbers of a command of one run.

    Args:
        prefix: What the names begin with.
        item: The command.
        monitors: Names of its monitors, if it has any.
    """
    found = [
        Value(f"{prefix}acceleration", item.acceleration, (0,)),
        Value(f"{prefix}steering_angle", item.steering_angle, (0,)),
        Value(f"{prefix}stamp", item.stamp, (0,), "time of what it answers, -1 for none"),
        Value(f"{prefix}status", item.status, (0,), _listed(columns.STATUS_LABELS)),
    ]
    for row, name in enumerate(monitors):
        for place, state in enumerate(("raw", "confirmed")):
            assert item.monitors is not None
            found.append(Value(f"{prefix}monitors.{name}.{state}", item.monitors, (0, row, place)))
    return found


def authority_values(prefix: str, item: Authority, channels: tuple[str, ...]) -> list[Value]:
    """Name who has authority, and why."""
    who = f"-1 nobody, {_listed(channels)}"
    return [
        Value(f"{prefix}authority", item.channel, (0,), who),
        Value(f"{prefix}reason", item.reason, (0,), _listed(columns.REASON_LABELS)),
    ]


def _listed(labels: tuple[str, ...]) -> str:
    return ", ".join(f"{number} {label}" for number, label in enumerate(labels))


def _take(into: Any, found: Any) -> None:
    """Copy the arrays of one record into those of another of its kind."""
    for item in fields(into):
        here = getattr(into, item.name)
        if isinstance(here, np.ndarray):
            here[...] = getattr(found, item.name)


# --- The parts ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Part:
    """A part of an architecture by itself, in one run.

    Attributes:
        step: From a tick to the next [s].
        inputs: What it is told at each tick.
        outputs: What it answers.
        act: Does what it does at a tick, told its number.
        parameters: What it is told once, before the first tick.
        begin: Takes the parameters; what comes out before the first step is what they say.
    """

    step: float
    inputs: list[Value]
    outputs: list[Value]
    act: Callable[[int], None]
    parameters: tuple[Value, ...] = ()
    begin: Callable[[], None] = lambda: None


def vehicle_part(architecture: Architecture, step: float) -> Part:
    """Make the built-in vehicle: a command in, the state of the ego at the next tick out.

    Args:
        architecture: Its vehicle counts.
        step: From a tick to the next [s].

    Raises:
        UsageError: An FMU moves the vehicle.
    """
    vehicle = architecture.vehicle
    if vehicle.plant is not None:
        raise UsageError(
            f"the vehicle of {architecture.architecture} is an FMU already",
            remedy=f"Use {vehicle.plant.file}.",
        )
    limits = np.array([vehicle_limits(vehicle, 1.0, step)])
    command, start = np.zeros((1, 2)), np.zeros((1, len(columns.EGO_COLUMNS)))
    states, running = start.copy(), np.ones(1, dtype=np.bool_)

    def begin() -> None:
        states[:] = start

    def act(_tick: int) -> None:
        move_egos(running, command, limits, step, states)

    begins = columns.EGO_COLUMNS[: columns.EGO_SPEED + 1]
    return Part(
        step,
        [
            *_row("command.", command, (0,), ("acceleration", "steering_angle")),
            Value("friction", limits, (0, FRICTION), "of the tyres"),
        ],
        list(_row("", states, (0,), columns.EGO_COLUMNS)),
        act,
        tuple(_row("start.", start, (0,), begins)),
        begin,
    )


def switch_part(architecture: Architecture, step: float) -> Part:
    """Make the switch: a command of each channel in, the acting one and whose it is out.

    Args:
        architecture: Its switch and the names of its channels count.
        step: From a tick to the next [s].
    """
    channels = tuple(architecture.channels)
    switch = make_switch(SwitchContext([architecture.switch], channels, step))
    proposals = {name: no_command(name, 1) for name in channels}
    faults = SwitchFaults.none(1)
    command = np.zeros((1, 2))
    authority = Authority(np.full(1, columns.NO_CHANNEL), np.zeros(1, dtype=np.int64))

    def act(tick: int) -> None:
        given = [item.copy() for item in proposals.values()]
        acting, decided = switch.arbitrate(tick_time(tick, step), given, faults)
        command[:] = acting
        _take(authority, decided)

    told = [
        value
        for name, item in proposals.items()
        for value in command_values(f"{name}.", item, monitors=())
    ]
    return Part(
        step,
        [
            *told,
            Value("faults.stuck", faults.stuck, (0,), "a fault keeps the switch where it lies"),
            Value("faults.delay", faults.delay, (0,), "so much later a fault makes it change"),
        ],
        [
            *_row("", command, (0,), ("acceleration", "steering_angle")),
            *authority_values("", authority, channels),
        ],
        act,
    )


def channel_part(case: TestCase, name: str) -> Part:
    """Make a channel of the package, at its own rate and with its delay.

    Args:
        case: Its architecture has the channel; its scenario says which road it knows, and how fast
            the ego is to drive.
        name: Of the channel.

    Raises:
        UsageError: There is no such channel, or it is not of the package.
    """
    (case,) = as_driven([case])
    architecture = case.architecture
    require_known([name], architecture.channels, lambda item: f"there is no channel {item!r}")
    spec = architecture.channels[name]
    _require_own(spec.kind, spec.kind in BUILT_IN, f"channel {name}")
    linked = [link.removeprefix(HEALTH) for link in spec.links]
    context, scene = _begun(case)
    blank = _blank(case, {link for link in linked if link in architecture.sensors})
    rack = ChannelRack([case], context, _NO_PLACE, only={name})
    seen = {link: blank[link] for link in spec.links if link in blank}
    health = {
        link: health_of(blank[link.removeprefix(HEALTH)]).copy()
        for link in spec.links
        if link.startswith(HEALTH)
    }
    heard = {other: no_command(other, 1) for other in linked_channels(spec.links)}
    authority = Authority(np.full(1, columns.NO_CHANNEL), np.zeros(1, dtype=np.int64))
    answer = no_command(name, 1)
    if rack.monitor_ids:
        answer.monitors = np.zeros((1, len(rack.monitor_ids), 2), dtype=np.bool_)

    def act(tick: int) -> None:
        # It is told copies: what it keeps of a tick stays as it was.
        decided = Authority(authority.channel.copy(), authority.reason.copy())
        shown = View(
            _copies(seen),
            _copies(heard),
            decided if decided.reason[0] != columns.REASON_NONE else None,
            _copies(health),
        )
        now = replace(scene, tick=tick, time=tick_time(tick, case.step))
        (given,) = rack.act(now, {}, lambda _name, _view: shown)
        _take(answer, given)

    inputs = [
        value
        for link, item in (*seen.items(), *health.items())
        for value in measurement_values(link, item)
    ]
    for other, item in heard.items():
        inputs += command_values(f"channels.{other}.", item, monitors=())
    if SWITCH in spec.links:
        inputs += authority_values(f"{SWITCH}.", authority, tuple(architecture.channels))
    return Part(case.step, inputs, command_values("", answer, rack.monitor_ids), act)


def sensor_part(case: TestCase, name: str) -> Part:
    """Make a sensor of the package: the scene in, its newest delivered measurement out.

    Args:
        case: Its architecture has the sensor; its scenario says what there is to be seen.
        name: Of the sensor.

    Raises:
        UsageError: There is no such sensor, or it is not of the package.
    """
    (case,) = as_driven([case])
    sensors = case.architecture.sensors
    require_known([name], sensors, lambda item: f"there is no sensor {item!r}")
    item = _blank(case, {name}, least=0)[name]
    context, scene = _begun(case)
    rig = Rig([case], context, _NO_PLACE, only={name})
    clustering = ChannelRack([case], context, _NO_PLACE, only=())
    grounds = context.road.grounds()
    ego, objects = scene.ego.copy(), scene.objects.copy()
    unknown, near = np.zeros((1, 0, 6)), np.zeros((1, 1 + objects.shape[1]), dtype=np.int64)

    def act(tick: int) -> None:
        now = replace(scene, tick=tick, time=tick_time(tick, case.step)).copy()
        now.ego[:], now.objects[:] = ego, objects
        places = now.ego_place, now.object_places
        locate_all(now.running, ego, objects, grounds, unknown, near, *places)
        _take(item, clustering.detect(rig.sense(now))[name])

    inputs = list(_row("ego.", ego, (0,), columns.EGO_COLUMNS))
    for row, thing in enumerate(context.object_ids):
        inputs += _row(f"objects.{thing}.", objects, (0, row), columns.OBJECT_COLUMNS)
    outputs = [
        value._replace(name=value.name.removeprefix(f"{name}."))
        for value in measurement_values(name, item)
    ]
    return Part(case.step, inputs, outputs, act)


def _begun(case: TestCase) -> tuple[columns.SceneContext, Scene]:
    return make_traffic("batch").reset([case])


def _copies(items: Mapping[str, Any]) -> dict[str, Any]:
    return {name: item.copy() for name, item in items.items()}


def _require_own(kind: str, is_own: bool, what: str) -> None:  # noqa: FBT001 - its only question
    if not is_own:
        raise UsageError(
            f"{what} is of kind {kind}, no part of the package",
            remedy="Parts of the package can be exported; others are their makers' to hand on.",
        )


def _blank(
    case: TestCase, names: Collection[str], least: int = LEAST_ROWS
) -> dict[str, Measurement]:
    """Return what sensors say before they have said anything, in the form that they have.

    Args:
        case: Test case.
        names: Of the sensors.
        least: Detections that there is room for, at least.
    """
    context, scene = _begun(case)
    for name in names:
        sensor = case.architecture.sensors[name]
        _require_own(sensor.kind, model_name(sensor) in SENSORS, f"sensor {name}")
    rig = Rig([case], context, _NO_PLACE, only=names)
    found = ChannelRack([case], context, _NO_PLACE, only=()).detect(rig.sense(scene))
    return {name: _emptied(item, least) for name, item in found.items()}


def _emptied(item: Measurement, least: int) -> Measurement:
    rows = max(item.mask.shape[1], least)
    return Measurement(
        stamp=np.full(1, -1.0),
        fresh=np.zeros(1, dtype=np.bool_),
        alive=np.ones(1, dtype=np.bool_),
        mask=np.zeros((1, rows), dtype=np.bool_),
        detections=np.zeros((1, rows, len(columns.DETECTION_COLUMNS))),
        source=np.full((1, rows), -1, dtype=np.int64),
        estimate=None if item.estimate is None else np.zeros_like(item.estimate),
        values=None if item.values is None else np.zeros_like(item.values),
    )
