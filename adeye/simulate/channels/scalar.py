"""One Python object per run as a channel on the batch: the simplest way to write a channel.

    class MyChannel:
        def __init__(self, parameters, context): ...
        def act(self, observation): return acceleration, steering_angle

An object that raises, or answers with anything but two finite numbers, is silent from that tick on;
the other runs of the batch do not notice.
"""

from __future__ import annotations

import math
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye import ports
from adeye.signals import OK, SILENT, STATUS_LABELS, ControlCommand, Observation
from adeye.simulate.channels.guard import ERROR, INVALID_OUTPUT, Failures, describe
from adeye.simulate.channels.links import no_command
from adeye.supervision import is_asked, raised

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.trace import ChannelEvent


class ScalarChannel:
    """Puts one object per run behind the interface of a channel on the batch."""

    monitor_ids: tuple[str, ...] = ()

    def __init__(self, factory: ports.ScalarFactory) -> None:
        """Wrap a class.

        Args:
            factory: Called with parameters and context once per run.
        """
        self._factory = factory
        self._objects: dict[int, ports.ScalarAct] = {}
        self._failures = Failures("", 0)
        self._previous = no_command("", 0)

    @property
    def events(self) -> list[ChannelEvent | None]:
        """First failure of the channel in each run, or None."""
        return self._failures.events

    def reset(self, context: ChannelContext) -> None:
        """Make the object of every run; one that fails here is silent from the start."""
        self._failures = Failures(context.channel_id, context.runs)
        self._previous = no_command(context.channel_id, context.runs)
        self._objects = {}
        for run in range(context.runs):
            try:
                parameters = context.parameters[run]
                self._objects[run] = self._factory(parameters, _context(context, run))
            except BaseException as error:
                if is_asked(error):
                    raise
                raised(error)
                self._failures.add(run, ERROR, 0.0, describe(error))

    def act(self, observation: Observation) -> ControlCommand:
        """Ask the object of every run that has not ended."""
        command = self._previous.copy()
        # How strict numpy is about overflow is not for a channel to decide for the others.
        with np.errstate():
            for run in np.flatnonzero(observation.running & ~self._failures.silent):
                answer = self._ask(int(run), observation)
                if answer is None:
                    continue
                command.status[run] = answer.status
                if answer.status != SILENT:
                    command.acceleration[run] = answer.acceleration
                    command.steering_angle[run] = answer.steering_angle
                    command.stamp[run] = observation.time
        self._previous = self._failures.hold(command, self._previous)
        return self._previous

    def _ask(self, run: int, observation: Observation) -> ports.ScalarCommand | None:
        channel = self._objects[run]
        try:
            # What it answers with may have code of its own, too.
            command, wrong = _command(channel.act(_observation(observation, run)))
        except BaseException as error:
            if is_asked(error):
                raise
            raised(error)
            self._failures.add(run, ERROR, observation.time, describe(error))
            return None
        if command is None:
            self._failures.add(run, INVALID_OUTPUT, observation.time, wrong)
        return command


def _command(answer: Any) -> tuple[ports.ScalarCommand | None, str]:
    """Read an answer: a command, or what is wrong with it."""
    if isinstance(answer, ports.ScalarCommand):
        pair: Any = (answer.acceleration, answer.steering_angle)
        status: Any = answer.status
    else:
        pair, status = answer, OK
    if not isinstance(pair, tuple | list) and not (isinstance(pair, np.ndarray) and pair.ndim == 1):
        return None, f"act() returned {type(answer).__name__}, not (acceleration, steering_angle)"
    if len(pair) != 2:
        return None, f"act() returned {len(pair)} values, not acceleration and steering_angle"
    numbers = [_number(value) for value in pair]
    if not all(math.isfinite(number) for number in numbers):
        return None, f"acceleration {pair[0]!r}, steering_angle {pair[1]!r}: not finite numbers"
    if not isinstance(status, int | np.integer) or not 0 <= status < len(STATUS_LABELS):
        return None, f"status {status!r} is none of 0 to {len(STATUS_LABELS) - 1}"
    return ports.ScalarCommand(numbers[0], numbers[1], int(status)), ""


def _number(value: Any) -> float:
    """Return a real number as float, NaN for everything else."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:  # a whole number beyond every float
        return math.nan


def _context(context: ChannelContext, run: int) -> ports.ScalarContext:
    return ports.ScalarContext(
        channel_id=context.channel_id,
        links=context.links,
        step=context.step,
        period=context.period,
        sensors=dict(context.sensors),
        mounts={name: poses[run].copy() for name, poses in context.mounts.items()},
        vehicle=context.vehicles[run],
        road=ports.ScalarRoad(**context.road.told(run)),
        desired_speed=float(context.desired_speed[run]),
    )


def _observation(observation: Observation, run: int) -> ports.ScalarObservation:
    authority = observation.authority
    return ports.ScalarObservation(
        time=observation.time,
        measurements={
            name: ports.ScalarMeasurement(
                stamp=float(item.stamp[run]),
                fresh=bool(item.fresh[run]),
                alive=bool(item.alive[run]),
                detections=item.detections[run][item.mask[run]],
                estimate=None if item.estimate is None else item.estimate[run].copy(),
                values=None if item.values is None else item.values[run].copy(),
            )
            for name, item in observation.measurements.items()
        },
        commands={
            name: ports.LinkedCommand(
                float(item.acceleration[run]),
                float(item.steering_angle[run]),
                float(item.stamp[run]),
                int(item.status[run]),
            )
            for name, item in observation.commands.items()
        },
        authority=None if authority is None else int(authority.channel[run]),
        reason=None if authority is None else int(authority.reason[run]),
    )
