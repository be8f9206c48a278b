"""The cadence of a channel: it acts at its own rate, and its command arrives after its delay."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from adeye.channels.links import no_command

if TYPE_CHECKING:
    from adeye.ports import ChannelContext, ControlChannel
    from adeye.signals import ControlCommand, Observation


class ClockedChannel:
    """Holds a channel's newest command between its ticks and releases each one late.

    The stamp of a command is the time of the observation that it answers, so its age counts the
    delay and the time that it has been held.
    """

    def __init__(self, channel: ControlChannel, every: int, delay: int) -> None:
        """Wrap a channel.

        Args:
            channel: The channel.
            every: Ticks between two of its own ticks, at least 1.
            delay: Compute time: ticks from an observation to the command's release.
        """
        self._channel = channel
        self._every = every
        self._delay = delay
        self.monitor_ids: tuple[str, ...] = tuple(channel.monitor_ids)
        self._tick = 0
        self._waiting: deque[tuple[int, ControlCommand]] = deque()
        self._newest = no_command("", 0)

    @property
    def is_due(self) -> bool:
        """Whether the channel acts at the coming tick, so that it needs an observation."""
        return self._tick % self._every == 0

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        self._tick = 0
        self._waiting.clear()
        self._newest = no_command(context.channel_id, context.runs)
        if self.monitor_ids:
            shape = (context.runs, len(self.monitor_ids), 2)
            self._newest.monitors = np.zeros(shape, dtype=np.bool_)
        self._channel.reset(context)

    def act(self, observation: Observation | None) -> ControlCommand:
        """Return the newest released command of this tick of the master clock.

        Args:
            observation: What is linked to the channel; None is enough unless ``is_due``.

        Raises:
            ValueError: The channel is due and there is no observation.
        """
        if self.is_due:
            if observation is None:
                msg = "a due channel needs an observation"
                raise ValueError(msg)
            self._waiting.append((self._tick + self._delay, self._channel.act(observation)))
        while self._waiting and self._waiting[0][0] <= self._tick:
            self._newest = self._waiting.popleft()[1]
        self._tick += 1
        return self._newest
