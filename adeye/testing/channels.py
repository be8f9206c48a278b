"""A scripted channel, and the conformance suite that every channel has to pass."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, Final, cast

import numpy as np

from adeye import signals as columns
from adeye.kernel.relation import tick_time
from adeye.ports import ChannelContext, ControlChannel, ScalarFactory
from adeye.signals import (
    Authority,
    Bools,
    ControlCommand,
    Floats,
    Ints,
    Measurement,
    Observation,
    RoadMap,
)
from adeye.simulate.channels.links import CHANNEL_PREFIX, observe
from adeye.simulate.channels.scalar import ScalarChannel
from adeye.testing.demands import demand, demand_equal
from adeye.testing.scenes import channel_context, object_measurement

RUNS: Final = 3
TICKS: Final = 40
OUTAGE: Final = range(20, 28)
"""Ticks at which the first sensor does not deliver and the linked channels are silent."""


_COMPARED: Final = (
    *("acceleration", "steering_angle", "status", "monitors", "tracks", "plan"),
    *("candidates", "candidate_costs", "chosen"),
)


class ScriptedChannel:
    """Gives commands from a script, whatever it sees; the last one stays."""

    monitor_ids: tuple[str, ...] = ()

    def __init__(
        self,
        acceleration: Sequence[float] | Floats,
        steering_angle: Sequence[float] | Floats = (0.0,),
        status: Sequence[int] | Ints = (columns.OK,),
    ) -> None:
        """Take the script.

        Args:
            acceleration: (T,) for every run, or (B, T) [m/s²].
            steering_angle: (T,) or (B, T) [rad].
            status: (T,) or (B, T), index into ``signals.STATUS_LABELS``.
        """
        self._acceleration = np.atleast_2d(np.asarray(acceleration, dtype=np.float64))
        self._steering_angle = np.atleast_2d(np.asarray(steering_angle, dtype=np.float64))
        self._status = np.atleast_2d(np.asarray(status, dtype=np.int64))
        self._channel_id = ""
        self._runs = 0
        self._tick = 0

    def reset(self, context: ChannelContext) -> None:
        """Start the script again."""
        self._channel_id = context.channel_id
        self._runs = context.runs
        self._tick = 0

    def act(self, observation: Observation) -> ControlCommand:
        """Give the next command of the script."""
        command = ControlCommand(
            self._channel_id,
            self._row(self._acceleration),
            self._row(self._steering_angle),
            np.full(self._runs, observation.time),
            self._row(self._status),
        )
        self._tick += 1
        return command

    def _row(self, script: np.ndarray[Any, np.dtype[Any]]) -> np.ndarray[Any, np.dtype[Any]]:
        column = script[:, min(self._tick, script.shape[1] - 1)]
        return np.broadcast_to(column, (self._runs,)).copy()


@dataclass(frozen=True, slots=True)
class _Tick:
    time: float
    readings: dict[str, Measurement]
    commands: dict[str, ControlCommand]
    authority: Authority
    running: Bools


def check_channel(
    factory: Callable[..., Any],
    parameters: Any = None,
    *,
    links: Sequence[str] = ("front", "pose"),
    sensors: Mapping[str, str] | None = None,
) -> None:
    """Check that a channel keeps the contract of ``ports.ControlChannel``.

    Its commands are finite and of the right shape and state, equal for equal inputs, independent
    of the other runs of the batch and of earlier batches; it alters nothing that it is shown, and
    goes on while sensors and linked channels do not answer.

    Args:
        factory: Makes a channel on the batch; or a class of which one object per run is made.
        parameters: Its validated parameters.
        links: Ids of what is linked to it.
        sensors: Kind of each linked sensor; a radar and a localisation unless given.

    Raises:
        AssertionError: Names the first rule that it breaks.
    """
    kinds = dict(sensors or {"front": "radar", "pose": "localisation"})
    context = channel_context(
        parameters,
        links=links,
        sensors=kinds,
        runs=RUNS,
        desired_speed=np.array([30.0, 20.0, 10.0]),
    )
    script = _script(context, kinds)
    channel = _make(factory)
    demand_alike = partial(demand_equal, names=_COMPARED, shown=True)
    first = _play(channel, context, script)
    _check_answers(channel, context, first)
    demand_alike(
        first, _play(channel, context, script), rule="a second reset() gives other commands"
    )
    demand_alike(first, _play(_make(factory), context, script), rule="equal inputs, other commands")
    for run in range(RUNS):
        alone = _play(_make(factory), _one_context(context, run), _one_script(script, run))
        part = [_one_command(command, run) for command in first]
        demand_alike(part, alone, rule=f"run {run} depends on the other runs of its batch")
    blind = [replace(tick, readings=_nothing(tick.readings)) for tick in script]
    _check_answers(channel, context, _play(channel, context, blind))


def _make(factory: Callable[..., Any]) -> ControlChannel:
    made: ControlChannel
    if isinstance(factory, type) and not hasattr(factory, "reset"):
        made = ScalarChannel(cast("ScalarFactory", factory))
    else:
        made = factory()
    return made


def _play(
    channel: ControlChannel, context: ChannelContext, script: Sequence[_Tick]
) -> list[ControlCommand]:
    channel.reset(context)
    answers = []
    for tick in script:
        observation = observe(
            context.links,
            tick.time,
            tick.readings,
            tick.commands,
            tick.authority,
            tick.running,
            protect=True,
        )
        answer = channel.act(observation)
        demand(
            isinstance(answer, ControlCommand),
            f"act() returned {type(answer).__name__}, not ControlCommand",
        )
        answers.append(answer.copy())
    return answers


def _check_answers(
    channel: ControlChannel, context: ChannelContext, answers: Sequence[ControlCommand]
) -> None:
    failures = [event for event in getattr(channel, "events", []) if event is not None]
    demand(not failures, f"the channel failed: {failures[:1]}")
    runs = context.runs
    for answer in answers:
        demand(answer.channel == context.channel_id, "the command has another id")
        for name in ("acceleration", "steering_angle", "stamp", "status"):
            shape = getattr(answer, name).shape
            demand(shape == (runs,), f"{name} has shape {shape}, not ({runs},)")
        known = (answer.status >= 0) & (answer.status < len(columns.STATUS_LABELS))
        demand(bool(known.all()), f"status {answer.status} is unknown")
        usable = (answer.status != columns.FAULT) & (answer.status != columns.SILENT)
        finite = np.isfinite(answer.acceleration) & np.isfinite(answer.steering_angle)
        demand(bool((finite | ~usable).all()), "a usable command is not finite")
        count = len(channel.monitor_ids)
        if count or answer.monitors is not None:
            shape = () if answer.monitors is None else answer.monitors.shape
            demand(shape == (runs, count, 2), f"monitors have shape {shape}")
        _check_fan(answer, runs)
        if answer.tracks is not None:
            shape = answer.tracks.shape
            fits = len(shape) == 3 and (shape[0], shape[2]) == (runs, len(columns.TRACK_COLUMNS))
            demand(fits, f"tracks have shape {shape}")


def _check_fan(answer: ControlCommand, runs: int) -> None:
    if answer.candidates is None:
        return
    shape = answer.candidates.shape
    fits = len(shape) == 4 and (shape[0], shape[3]) == (runs, 2)
    demand(fits, f"candidates have shape {shape}")
    costs = () if answer.candidate_costs is None else answer.candidate_costs.shape
    demand(costs == shape[:2], f"candidate_costs have shape {costs}")
    chosen = () if answer.chosen is None else answer.chosen.shape
    demand(chosen == (runs,), f"chosen has shape {chosen}")


def _script(context: ChannelContext, kinds: Mapping[str, str]) -> list[_Tick]:
    """Drive past a slower vehicle at three speeds, with an outage on the way."""
    runs, script = context.runs, []
    objects = np.zeros((runs, 2, 5))
    others = [link[len(CHANNEL_PREFIX) :] for link in context.links if CHANNEL_PREFIX in link]
    stamp = 0.0
    for tick in range(TICKS):
        time = tick_time(tick, context.step)
        ego = np.zeros((runs, 7))
        ego[:, columns.EGO_SPEED] = context.desired_speed
        ego[:, columns.EGO_X] = context.desired_speed * time
        ego[:, columns.EGO_Y] = 5.25 + 0.2 * np.arange(runs)
        objects[:, 0, :4] = [40.0 + 8.0 * time, 5.25, 0.0, 8.0]
        objects[:, 1, :4] = [60.0 + 12.0 * time, 8.75, 0.0, 12.0]
        out = tick in OUTAGE
        stamp = stamp if out else time
        readings = {
            name: _reading(kind, ego, objects, time, context.road) for name, kind in kinds.items()
        }
        if out and readings:
            first = next(iter(readings))
            readings[first] = _nothing(readings)[first]
        commands = {
            name: ControlCommand(
                name,
                np.full(runs, 0.5),
                np.zeros(runs),
                np.full(runs, stamp),
                np.full(runs, columns.SILENT if out else columns.OK, dtype=np.int64),
            )
            for name in others
        }
        authority = Authority(
            np.zeros(runs, dtype=np.int64), np.full(runs, columns.REASON_DEFAULT, dtype=np.int64)
        )
        running = np.ones(runs, dtype=np.bool_)
        running[0] = tick < TICKS - 5
        script.append(_Tick(time, readings, commands, authority, running))
    return script


def _reading(kind: str, ego: Floats, objects: Floats, time: float, road: RoadMap) -> Measurement:
    if kind == "localisation":
        return object_measurement(ego, objects[:, :0], time, road=road)
    return object_measurement(ego, objects, time, road=road if kind == "ground_truth" else None)


def _nothing(readings: Mapping[str, Measurement]) -> dict[str, Measurement]:
    """Return the same sensors before they have delivered anything, and dead."""
    return {
        name: Measurement(
            np.full_like(item.stamp, -1.0),
            np.zeros_like(item.fresh),
            np.zeros_like(item.alive),
            np.zeros_like(item.mask),
            np.zeros_like(item.detections),
            np.full_like(item.source, -1),
            None if item.estimate is None else np.zeros_like(item.estimate),
        )
        for name, item in readings.items()
    }


def _one_context(context: ChannelContext, run: int) -> ChannelContext:
    part = slice(run, run + 1)
    return replace(
        context,
        parameters=[context.parameters[run]],
        mounts={name: poses[part] for name, poses in context.mounts.items()},
        vehicles=[context.vehicles[run]],
        road=context.road.of(part),
        desired_speed=context.desired_speed[part],
    )


def _one_script(script: Sequence[_Tick], run: int) -> list[_Tick]:
    part = slice(run, run + 1)
    return [
        _Tick(
            tick.time,
            {name: item.map(lambda array: array[part]) for name, item in tick.readings.items()},
            {name: _one_command(item, run) for name, item in tick.commands.items()},
            Authority(tick.authority.channel[part], tick.authority.reason[part]),
            tick.running[part],
        )
        for tick in script
    ]


def _one_command(command: ControlCommand, run: int) -> ControlCommand:
    values = {field.name: getattr(command, field.name) for field in fields(command)}
    parts: dict[str, Any] = {
        name: value[run : run + 1]
        for name, value in values.items()
        if isinstance(value, np.ndarray)
    }
    return replace(command, **parts)
