"""Keeps simulated time from running ahead of the wall clock, and measures how long channels take.

Soft real time: a tick never begins before its time, and one that ends late is counted, not cut off.
What is simulated does not depend on it.
"""

from __future__ import annotations

import math
import time
from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from adeye.errors import UsageError
from adeye.units import shown

if TYPE_CHECKING:
    from adeye.ports import ChannelContext, ControlChannel
    from adeye.signals import ControlCommand, Observation


@dataclass(frozen=True, slots=True)
class AnswerTimes:
    """How long a channel took from an observation to its command, by the wall clock.

    With several runs at once it is the time until the last of them has answered; what it takes to
    write what a program is told, and to read its answer, is a part of it.

    Attributes:
        asked: How often it was asked.
        median_s: [s].
        p99_s: 99 of 100 answers took no longer [s].
        worst_s: [s].
    """

    asked: int
    median_s: float
    p99_s: float
    worst_s: float


class Pace:
    """The pace of the runs of a campaign, and what came of it.

    Attributes:
        factor: Seconds of simulated time in a second of the wall clock, at most.
        ticks: How many there were.
        overruns: Ticks that ended later than the next one was due.
        latest_s: How much later the latest of them ended [s].
    """

    def __init__(self, factor: float) -> None:
        """Begin with nothing measured.

        Raises:
            UsageError: The factor is no number above 0.
        """
        if not (math.isfinite(factor) and factor > 0.0):
            raise UsageError(
                f"the pace is {shown(factor)}",
                remedy="Give seconds of simulated time in a second, above 0: 1 for the wall clock.",
            )
        self.factor = factor
        self.ticks = 0
        self.overruns = 0
        self.latest_s = 0.0
        self._began = 0.0
        self._times: dict[str, array[float]] = {}

    def hold(self, time_s: float) -> None:
        """Wait until a tick may begin, which the one before it has ended for.

        Args:
            time_s: Simulated time of the tick [s]; 0 is the beginning of a run.
        """
        now = time.perf_counter()
        if time_s <= 0.0:
            self._began = now
            return
        early = self._began + time_s / self.factor - now
        self.ticks += 1
        if early < 0.0:
            self.overruns += 1
            self.latest_s = max(self.latest_s, -early)
        else:
            time.sleep(early)

    def timed(self, name: str, channel: ControlChannel) -> ControlChannel:
        """Return a channel that answers as it does, and is measured."""
        return _TimedChannel(channel, self._times.setdefault(name, array("d")))

    @property
    def answers(self) -> dict[str, AnswerTimes]:
        """How long channels took, by their ids."""
        found = {}
        for name, times in self._times.items():
            if times:
                at = np.quantile(np.array(times), (0.5, 0.99, 1.0), method="higher").tolist()
                found[name] = AnswerTimes(len(times), *at)
        return found


class _TimedChannel:
    """A channel whose answers are measured."""

    def __init__(self, channel: ControlChannel, times: array[float]) -> None:
        self._channel = channel
        self._times = times
        self.monitor_ids: tuple[str, ...] = tuple(channel.monitor_ids)

    def reset(self, context: ChannelContext) -> None:
        self._channel.reset(context)

    def act(self, observation: Observation) -> ControlCommand:
        began = time.perf_counter()
        command = self._channel.act(observation)
        self._times.append(time.perf_counter() - began)
        return command
