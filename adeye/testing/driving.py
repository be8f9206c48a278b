"""A tiny closed loop of one run: channels, faults on commands, a switch, the ego's own dynamics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from adeye.channels.links import observe
from adeye.kernel.clock import tick_time
from adeye.kernel.geometry import box_distance
from adeye.kernel.motion import advance_ego
from adeye.kernel.road import position
from adeye.ports import ControlChannel, SwitchContext
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    OBJECT_HEADING,
    OBJECT_X,
    OBJECT_Y,
    Authority,
    ControlCommand,
    Floats,
    Measurement,
    RoadMap,
)
from adeye.spec.switch import Switch
from adeye.switch import make_switch
from adeye.testing.scenes import object_measurement, passenger_car, pose_measurement, straight_road

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
    d = (world.lane + 0.5) * road.lane_width[0] + world.offset
    ego[EGO_X], ego[EGO_Y], ego[EGO_HEADING] = position(road.segments[0], 0.0, d)
    ego[EGO_SPEED] = world.speed
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
    return min(
        (
            box_distance(
                ego[EGO_X],
                ego[EGO_Y],
                ego[EGO_HEADING],
                car.length,
                car.width,
                item[OBJECT_X],
                item[OBJECT_Y],
                item[OBJECT_HEADING],
                size[0],
                size[1],
            )
            for item in objects
        ),
        default=math.inf,
    )


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
