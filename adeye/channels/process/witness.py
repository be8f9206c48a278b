"""Writes down what a channel is shown, whatever its kind, as the lines that a program would get."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.channels.process.protocol import encode, hello, shown

if TYPE_CHECKING:
    from typing import BinaryIO

    from adeye.ports import ChannelContext, ControlChannel
    from adeye.signals import ControlCommand, Observation


class Witness:
    """Takes down what one channel is shown in the first run of a batch.

    Attributes:
        channel: Id of the channel.
    """

    def __init__(self, channel: str, stream: BinaryIO) -> None:
        """Prepare.

        Args:
            channel: Id of the channel.
            stream: Where the lines go.
        """
        self.channel = channel
        self._stream = stream
        self._tick = 0

    def begin(self, context: ChannelContext, kind: str) -> None:
        """Take down what is known before the drive, and the kind of the channel.

        Args:
            context: Of the batch.
            kind: As the architecture has it.
        """
        self._tick = 0
        self._stream.write(encode({**hello(context, 0), "kind": kind}))

    def take(self, observation: Observation) -> None:
        """Take down an observation."""
        if observation.running[0]:
            self._stream.write(encode(shown(observation, 0, self._tick)))
            self._tick += 1


class WitnessedChannel:
    """A channel under the eyes of a witness; it answers as it does without."""

    def __init__(self, channel: ControlChannel, kind: str, witness: Witness) -> None:
        """Wrap a channel.

        Args:
            channel: The channel.
            kind: As the architecture has it.
            witness: Who takes down what it is shown.
        """
        self._channel = channel
        self._kind = kind
        self._witness = witness
        self.monitor_ids: tuple[str, ...] = tuple(channel.monitor_ids)

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        self._witness.begin(context, self._kind)
        self._channel.reset(context)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation."""
        self._witness.take(observation)
        return self._channel.act(observation)
