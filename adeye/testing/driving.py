"""A tiny closed loop of one run: channels, faults on commands, a switch, the ego's own dynamics.

for seen in feed("./mine.py:Mine", "shown.jsonl", folder="odd/architectures"):
    print(seen.time, seen.command.acceleration)  # or stop here in a debugger
"""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from pydantic import TypeAdapter

from adeye import signals as columns
from adeye.errors import InputError, SourceLocation
from adeye.kernel.boxes import box_distance
from adeye.kernel.motion import advance_ego
from adeye.kernel.relation import tick_time
from adeye.kernel.road import position
from adeye.ports import ChannelContext, ControlChannel, ScalarFactory, SwitchContext
from adeye.signals import Authority, ControlCommand, Floats, Measurement, Observation, RoadMap
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.process.protocol import PROTOCOL
from adeye.simulate.channels.scalar import ScalarChannel
from adeye.simulate.switch import make_switch
from adeye.spec.architecture import Switch, Vehicle
from adeye.spec.channels import Channel
from adeye.spec.quantity import SI
from adeye.testing.scenes import object_measurement, passenger_car, pose_measurement, straight_road

if TYPE_CHECKING:
    from adeye.trace import ChannelEvent

# --- A tiny closed loop of one run: channels, faults on commands, a switch, the ego's own
# dynamics.

Objects = Callable[[float], Sequence[Sequence[float]]]
"""Time [s] to rows of x, y, heading, speed, acceleration."""

Hook = Callable[[float, list[ControlCommand]], list[ControlCommand]]


@dataclass(frozen=True, slots=True)
class Drive:
    """What happened, one row per tick.

    Attributes:
        time: (T,) [s].
        ego: (T, 7).
        objects: (T, M, 5).
        proposals: (T, C, 2) acceleration [m/s²] and steering angle [rad] of each channel.
        status: (T, C).
        monitors: (T, C) arrays (Q, 2) or None.
        authority: (T,) acting channel.
        reason: (T,).
        distance: (T,) to the nearest object [m], inf for none.
    """

    time: Floats
    ego: Floats
    objects: Floats
    proposals: Floats
    status: np.ndarray[tuple[int, ...], np.dtype[np.int64]]
    monitors: list[list[np.ndarray[tuple[int, ...], np.dtype[np.bool_]] | None]]
    authority: np.ndarray[tuple[int, ...], np.dtype[np.int64]]
    reason: np.ndarray[tuple[int, ...], np.dtype[np.int64]]
    distance: Floats


@dataclass(frozen=True, slots=True)
class World:
    """What the ego drives in.

    Attributes:
        objects: Their states at a time.
        size: Length and width of every object [m].
        object_class: Of every object.
        sight: Range of the sensor ``front`` to an object's centre [m].
        road: The road.
        speed: Of the ego at the start [m/s].
        lane: Lane of the ego at the start.
        offset: From its centre [m].
        friction: Tyre-road friction coefficient.
        latency: Of the sensors in ticks.
    """

    objects: Objects = lambda _time: ()
    size: tuple[float, float] = (4.5, 1.8)
    object_class: int = 0
    sight: float = math.inf
    road: RoadMap | None = None
    speed: float = 30.0
    lane: int = 1
    offset: float = 0.0
    friction: float = 1.0
    latency: int = 0


def drive(  # noqa: PLR0913 - what a loop consists of
    channels: Mapping[str, ControlChannel],
    links: Mapping[str, Sequence[str]],
    world: World,
    *,
    horizon: float,
    step: float = 0.05,
    switch: Switch | None = None,
    on_commands: Hook | None = None,
) -> Drive:
    """Drive one run: sensors ``front``, ``pose`` and ``truth`` without error.

    Args:
        channels: Channels that have been reset with one run; without a switch the first one acts.
        links: What each is linked to.
        world: What the ego drives in.
        horizon: How long [s].
        step: Master clock [s].
        switch: Who acts.
        on_commands: Changes the commands between channels and switch, to make a fault.
    """
    names = tuple(channels)
    spec = switch or Switch(policy="fixed_priority", priority=names[:1], default=names[0])
    arbiter = make_switch(SwitchContext([spec], names, step))
    road = world.road or straight_road()
    ego = _start(world, road)
    commands: dict[str, ControlCommand] = {}
    authority: Authority | None = None
    waiting: list[dict[str, Measurement]] = []
    rows: list[dict[str, object]] = []
    running = np.ones(1, dtype=np.bool_)
    for tick in range(round(horizon / step) + 1):
        time = tick_time(tick, step)
        objects = np.array(world.objects(time), dtype=np.float64).reshape(1, -1, 5)
        waiting.append(_sense(world, road, ego, objects, time))
        readings = waiting[max(0, tick - world.latency)]
        proposals = [
            channel.act(
                observe(links[name], time, readings, commands, authority, running, protect=False)
            )
            for name, channel in channels.items()
        ]
        if on_commands is not None:
            proposals = on_commands(time, proposals)
        command, authority = arbiter.arbitrate(time, proposals)
        commands = {proposal.channel: proposal for proposal in proposals}
        rows.append(
            {
                "time": time,
                "ego": ego.copy(),
                "objects": objects[0],
                "proposals": [[p.acceleration[0], p.steering_angle[0]] for p in proposals],
                "status": [p.status[0] for p in proposals],
                "monitors": [None if p.monitors is None else p.monitors[0] for p in proposals],
                "authority": authority.channel[0],
                "reason": authority.reason[0],
                "distance": _distance(ego, objects[0], world.size),
            }
        )
        _advance(ego, command[0], step, world.friction)
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    monitors = columns.pop("monitors")
    return Drive(monitors=monitors, **{name: np.array(values) for name, values in columns.items()})  # type: ignore[arg-type]


def _start(world: World, road: RoadMap) -> Floats:
    ego = np.zeros(7)
    d = road.centers(np.array([world.lane]), np.zeros(1))[0] + world.offset
    ego[columns.EGO_X], ego[columns.EGO_Y], ego[columns.EGO_HEADING] = position(
        road.segments[0], 0.0, d
    )
    ego[columns.EGO_SPEED] = world.speed
    return ego


def _sense(
    world: World, road: RoadMap, ego: Floats, objects: Floats, time: float
) -> dict[str, Measurement]:
    state = ego[np.newaxis].copy()
    front = object_measurement(
        state,
        objects,
        time,
        size=world.size,
        object_class=world.object_class,
        sight=world.sight,
    )
    truth = object_measurement(
        state, objects, time, road=road, size=world.size, object_class=world.object_class
    )
    return {"front": front, "pose": pose_measurement(road, state, time), "truth": truth}


def _distance(ego: Floats, objects: Floats, size: tuple[float, float]) -> float:
    car = passenger_car()
    own = ego[columns.EGO_X], ego[columns.EGO_Y], ego[columns.EGO_HEADING], car.length, car.width
    distances = (box_distance(own, (*item[:3], *size)) for item in objects)
    return min(distances, default=math.inf)


def _advance(ego: Floats, command: Floats, step: float, friction: float) -> None:
    car = passenger_car()
    advance_ego(
        ego,
        command[0],
        command[1],
        step,
        car.wheelbase,
        0.5 * car.wheelbase,
        car.max_acceleration,
        car.max_deceleration,
        car.max_steering_angle,
        car.max_steering_rate,
        car.acceleration_lag,
        car.steering_lag,
        friction,
        ego,
    )


# --- Feeds a channel again with what it was shown in a run: one observation at a time, no
# simulator.


@dataclass(frozen=True, slots=True)
class Fed:
    """One observation that a channel was fed with, and its answer.

    Attributes:
        tick: Number of the observation in its run.
        time: Of the observation [s].
        shown: The observation as the file has it.
        observation: The same as arrays of a batch of one run.
        command: What the channel answered.
        failure: The channel's first failure up to now, or None.
    """

    tick: int
    time: float
    shown: dict[str, Any]
    observation: Observation
    command: ControlCommand
    failure: ChannelEvent | None


def feed(
    channel: Any, file: str | Path, *, folder: str | Path = ".", parameters: Any = None
) -> Iterator[Fed]:
    """Feed a channel with what ``adeye replay --channel --dump`` has saved.

    It is given the same values, so a deterministic channel answers as it did in the run. Nothing of
    its own is caught but what its kind contains in a run, too.

    Args:
        channel: Its kind, such as ``nominal`` or ``./file.py:Class``; or a class, one object per
            run or on the batch; or a channel on the batch.
        file: The saved lines.
        folder: Folder that a kind ``./file.py:Class`` or a program is looked for in.
        parameters: Its parameters; those of the run unless given.

    Yields:
        Each observation in turn, with the answer.

    Raises:
        InputError: The file cannot be read or is none of these.
    """
    path = Path(file)
    try:
        lines = path.read_text("utf-8").splitlines()
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path} cannot be read: {error}",
            remedy="Name a file that `adeye replay --dump` wrote.",
        ) from error
    contents = [_line(path, number, line) for number, line in enumerate(lines, 1)]
    if not contents or contents[0].get("hello") != PROTOCOL:
        raise InputError(
            f"its first line does not say hello {PROTOCOL!r}",
            where=SourceLocation(str(path), 1, 1),
            remedy="Save it again with `adeye replay RUN --channel ID --dump FILE`.",
        )
    made, given = _channel(channel, contents[0], Path(folder), parameters)
    made.reset(context_of(contents[0], given))
    try:
        for number, content in enumerate(contents[1:], 2):
            try:
                observation = observation_of(content)
            except (KeyError, TypeError, ValueError) as error:
                raise _no_observation(path, number, error) from error
            command = made.act(observation)
            events = getattr(made, "events", [None])
            yield Fed(content["tick"], observation.time, content, observation, command, events[0])
    finally:
        close = getattr(made, "close", None)
        if close is not None:
            close()


def context_of(hello: dict[str, Any], parameters: Any) -> ChannelContext:
    """Return what a channel is built with, for a batch of one run.

    Args:
        hello: First line.
        parameters: Its parameters.
    """
    sensors, road = hello["sensors"], hello["road"]
    return ChannelContext(
        channel_id=hello["channel"],
        parameters=[parameters],
        links=tuple(hello["links"]),
        sensors={name: item["kind"] for name, item in sensors.items()},
        mounts={name: _array(item["mount"]) for name, item in sensors.items() if item["mount"]},
        vehicles=[Vehicle.model_validate(hello["vehicle"], context=SI)],
        road=RoadMap(
            _array(road["segments"]),
            _array(road["lane_width"]),
            road["lanes"],
            _array(road["shoulder"]),
            _array(road["speed_limit"]),
            _array(road.get("verge", 0.0)),
            _refuges(road.get("refuges", [])),
            _array(sum(segment[3] for segment in road["segments"])),
            left_hand=road.get("left_hand", False),
        ),
        desired_speed=_array(hello["desired_speed"]),
        step=hello["step"],
        period=hello["period"],
        data_sheets={
            name: {field: _array(value) for field, value in item["data_sheet"].items()}
            for name, item in sensors.items()
            if item["data_sheet"] is not None
        },
        models={name: item["model"] for name, item in sensors.items()},
    )


def observation_of(content: dict[str, Any]) -> Observation:
    """Return the observation of a line, for a batch of one run.

    Args:
        content: The line.
    """
    switch = content["switch"]
    authority = None
    if switch is not None:
        reason = columns.REASON_LABELS.index(switch["reason"])
        authority = Authority(np.array([switch["authority"]]), np.array([reason]))
    return Observation(
        time=content["time"],
        measurements={name: _measurement(item) for name, item in content["sensors"].items()},
        commands={name: _command(name, item) for name, item in content["channels"].items()},
        authority=authority,
        running=np.ones(1, dtype=np.bool_),
    )


def _line(path: Path, number: int, text: str) -> dict[str, Any]:
    try:
        content = json.loads(text)
    except ValueError as error:
        raise _no_observation(path, number, error) from error
    if not isinstance(content, dict):
        raise _no_observation(path, number, TypeError("it is no object"))
    return content


def _no_observation(path: Path, number: int, error: Exception) -> InputError:
    text = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
    return InputError(
        f"line {number} is no observation: {text}",
        where=SourceLocation(str(path), number, 1),
        remedy="Save it again with `adeye replay RUN --channel ID --dump FILE`.",
    )


def _channel(
    channel: Any, hello: dict[str, Any], folder: Path, parameters: Any
) -> tuple[ControlChannel, Any]:
    """Make the channel and give it its parameters as it wants them."""
    values = hello["parameters"] if parameters is None else parameters
    if isinstance(channel, str):
        record: Any = TypeAdapter(Channel).validate_python(
            {"kind": channel, "parameters": values}, context=SI
        )
        return make_channel(channel, folder), record.parameters
    model = getattr(channel, "Parameters", None)
    if model is not None and isinstance(values, dict):
        values = model.model_validate(values)
    if inspect.isclass(channel) and not hasattr(channel, "reset"):
        return ScalarChannel(cast("ScalarFactory", channel)), values
    made: Any = channel() if inspect.isclass(channel) else channel
    return made, values


def _array(values: Any) -> Floats:
    """Return the numbers of one run with the run as first axis; null is NaN."""
    return np.array([values], dtype=np.float64)


def _refuges(rows: list[Any]) -> Floats:
    return _array(rows).reshape(1, len(rows), len(columns.REFUGE_COLUMNS))


def _measurement(item: dict[str, Any]) -> Measurement:
    most, seen = item["most"], item["detections"]
    mask = np.zeros((1, most), dtype=np.bool_)
    detections = np.zeros((1, most, len(columns.DETECTION_COLUMNS)))
    mask[0, : len(seen)] = True
    for place, row in enumerate(seen):
        detections[0, place] = np.array(row, dtype=np.float64)
    extras: dict[str, Any] = {
        name: _array(item[name]) for name in ("estimate", "points", "values") if name in item
    }
    return Measurement(
        stamp=_array(item["stamp"]),
        fresh=np.array([item["fresh"]], dtype=np.bool_),
        alive=np.array([item["alive"]], dtype=np.bool_),
        mask=mask,
        detections=detections,
        source=np.full((1, most), -1, dtype=np.int64),
        **extras,
    )


def _command(name: str, item: dict[str, Any]) -> ControlCommand:
    monitors = item.get("monitors")
    return ControlCommand(
        name,
        _array(item["acceleration"]),
        _array(item["steering_angle"]),
        _array(item["stamp"]),
        np.array([columns.STATUS_LABELS.index(item["status"])], dtype=np.int64),
        plan=_array(item["plan"]) if "plan" in item else None,
        monitors=None if monitors is None else np.array([monitors], dtype=np.bool_),
        tracks=_array(item["tracks"]) if "tracks" in item else None,
    )
