"""What is linked to a channel: its observation, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from adeye.signals import SILENT, Authority, Bools, ControlCommand, Ints, Measurement, Observation
from adeye.spec.architecture import HEALTH

Scalar = TypeVar("Scalar", bound=np.generic)

SWITCH = "switch"
CHANNEL_PREFIX = "channels."


def health_of(measurement: Measurement) -> Measurement:
    """Return what a measurement tells of its sensor's health: stamp and validity, no content."""
    return Measurement(
        measurement.stamp,
        measurement.fresh,
        measurement.alive,
        measurement.mask[:, :0],
        measurement.detections[:, :0],
        measurement.source[:, :0],
    )


def linked_channels(links: Sequence[str]) -> tuple[str, ...]:
    """Return the ids of the channels among the links, in their order."""
    size = len(CHANNEL_PREFIX)
    return tuple(link[size:] for link in links if link.startswith(CHANNEL_PREFIX))


def no_command(channel: str, runs: int) -> ControlCommand:
    """Return what stands for the command of a channel that has not given one: silent, no stamp."""
    return ControlCommand(
        channel,
        np.zeros(runs),
        np.zeros(runs),
        np.full(runs, -1.0),
        np.full(runs, SILENT, dtype=np.int64),
    )


@dataclass(frozen=True, slots=True)
class View:
    """What there is to be shown to a channel at a tick, before its links choose from it.

    Attributes:
        measurements: Newest measurement of every sensor, after faults.
        commands: Command of every channel at the previous tick, after faults; a channel that is
            missing has not given any.
        authority: The switch's state at the previous tick; None before the first.
        health: What links of a sensor's health show where that is not what the sensor delivers.
    """

    measurements: Mapping[str, Measurement]
    commands: Mapping[str, ControlCommand]
    authority: Authority | None
    health: Mapping[str, Measurement] = field(default_factory=dict)

    def shown(self, link: str, runs: int) -> Measurement | ControlCommand | Authority | None:
        """Return what a link shows; None before the first decision of the switch."""
        if link == SWITCH:
            return self.authority
        if link.startswith(CHANNEL_PREFIX):
            name = link[len(CHANNEL_PREFIX) :]
            return self.commands.get(name) or no_command(name, runs)
        if link.startswith(HEALTH):
            return self.health.get(link) or health_of(self.measurements[link[len(HEALTH) :]])
        return self.measurements[link]

    def instead(self, link: str, thing: Any) -> View:
        """Return the view with another thing behind a link."""
        if link == SWITCH:
            return replace(self, authority=thing)
        if link.startswith(CHANNEL_PREFIX):
            name = link[len(CHANNEL_PREFIX) :]
            return replace(self, commands={**self.commands, name: thing})
        if link.startswith(HEALTH):
            return replace(self, health={**self.health, link: thing})
        return replace(self, measurements={**self.measurements, link: thing})


def observe(  # noqa: PLR0913 - one argument per stage that it is taken from
    links: Sequence[str],
    time: float,
    measurements: Mapping[str, Measurement],
    commands: Mapping[str, ControlCommand],
    authority: Authority | None,
    running: Bools,
    *,
    protect: bool,
    health: Mapping[str, Measurement] | None = None,
) -> Observation:
    """Build the observation of one channel at one of its ticks.

    Args:
        links: Sensor ids, ``health.<sensor>``, ``channels.<id>`` and ``switch``.
        time: Of this tick [s].
        measurements: Newest measurement of every sensor, after faults.
        commands: Command of every channel at the previous tick, after faults; a channel that is
            missing has not given any.
        authority: The switch's state at the previous tick; None before the first.
        running: (B,) runs that have not ended.
        protect: Whether to hand out copies that cannot be written to, as plug-ins get them.
        health: What links of a sensor's health show where that is not what the sensor delivers.

    Returns:
        The observation; nothing in it tells which object is behind a detection.
    """
    runs = running.shape[0]
    seen: dict[str, Measurement] = {}
    heard: dict[str, ControlCommand] = {}
    shown: Authority | None = None
    view = View(measurements, commands, authority, health or {})
    for link in links:
        thing = view.shown(link, runs)
        if isinstance(thing, ControlCommand):
            heard[link.removeprefix(CHANNEL_PREFIX)] = _without_fan(thing)
        elif isinstance(thing, Measurement):
            seen[link] = thing if link.startswith(HEALTH) else _blanked(thing)
        else:
            shown = thing
    if protect:
        seen = {name: item.map(_locked) for name, item in seen.items()}
        heard = {name: _locked_command(item) for name, item in heard.items()}
        shown = shown and Authority(_locked(shown.channel), _locked(shown.reason))
        running = _locked(running)
    return Observation(time, seen, heard, shown, running)


def _without_fan(command: ControlCommand) -> ControlCommand:
    """Leave out what is there for pictures only, so that it makes no difference."""
    if command.candidates is None:
        return command
    return replace(command, candidates=None, candidate_costs=None, chosen=None)


def _blanked(measurement: Measurement) -> Measurement:
    return replace(measurement, source=_no_source(measurement.source.shape), hits=None)


@lru_cache(maxsize=8)
def _no_source(shape: tuple[int, ...]) -> Ints:
    """Return a list that tells no object; every measurement of a shape shows the same."""
    blank = np.full(shape, -1, dtype=np.int64)
    blank.flags.writeable = False
    return blank


def _locked_command(command: ControlCommand) -> ControlCommand:
    copy = command.copy()
    for array in (copy.acceleration, copy.steering_angle, copy.stamp, copy.status):
        array.flags.writeable = False
    for extra in (copy.plan, copy.monitors, copy.tracks):
        if extra is not None:
            extra.flags.writeable = False
    return copy


def _locked(array: NDArray[Scalar]) -> NDArray[Scalar]:
    copy = array.copy()
    copy.flags.writeable = False
    return copy
