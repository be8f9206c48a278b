"""From the kind of a channel in an architecture to the channel itself."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from pydantic import BaseModel

from adeye.errors import SpecError
from adeye.plugins import Part, load_part, names_in, require, validate_parameters
from adeye.ports import HookedChannel
from adeye.simulate.bridges.middleware import MIDDLEWARE, bridge
from adeye.simulate.channels.fmu import FmuChannel
from adeye.simulate.channels.guard import GuardedChannel
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.policy import PolicyChannel
from adeye.simulate.channels.process.channel import ProcessChannel, RemoteChannel
from adeye.simulate.channels.reference import ReferenceChannel
from adeye.simulate.channels.safety import (
    PlannedSafetyChannel,
    SafetyChannel,
    SupervisedSafetyChannel,
)
from adeye.simulate.channels.scalar import ScalarChannel
from adeye.simulate.channels.trajectory.channel import TrajectoryChannel
from adeye.supervision import guest

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from adeye.ports import ChannelContext, ControlChannel
    from adeye.signals import Bools, ControlCommand, Floats, Observation
    from adeye.trace import ChannelEvent

BUILT_IN: Final[Mapping[str, Callable[[], ControlChannel]]] = {
    "nominal": NominalChannel,
    "safety": SafetyChannel,
    "trajectory": TrajectoryChannel,
    "reference": ReferenceChannel,
}
"""Channels of the package, by kind."""

POLICY: Final = "policy"
"""Kind of the channel that asks a policy from outside; it is contained like a plug-in."""

HOSTED: Final[Mapping[str, Callable[[Path, Sequence[Sequence[str]]], ControlChannel]]] = {
    "process": ProcessChannel,
    "remote": RemoteChannel,
    "fmu": FmuChannel,
    **{kind: partial(ProcessChannel, before=bridge(kind)) for kind in MIDDLEWARE},
}
"""Channels that are asked outside of this process, by kind; they contain what is done there."""


def make_channel(
    kind: str, base_dir: Path, parameters: Any = None, files: Sequence[Sequence[str]] = ()
) -> ControlChannel:
    """Make the channel of a kind; it has still to be reset with a context.

    A class with ``reset`` works on the batch; one without is made once per run.

    Args:
        kind: One of ``BUILT_IN`` or ``HOSTED``, ``policy``, ``module:Class`` or
            ``./file.py:Class``.
        base_dir: Folder of the file that names a plug-in.
        parameters: Its parameter record, which may ask for another implementation of a kind; the
            default where it is missing.
        files: Files that one of ``HOSTED`` says it reads, of each run.

    Returns:
        The channel. What a plug-in raises or answers is contained in it.

    Raises:
        SpecError: There is no such plug-in, or it is no channel.
    """
    if kind == "safety" and getattr(parameters, "supervisor", None) is not None:
        return GuardedChannel(SupervisedSafetyChannel(parameters), trusted=True)
    if kind == "safety" and getattr(parameters, "stop", "in_lane") == "planned":
        return GuardedChannel(PlannedSafetyChannel(), trusted=True)
    if kind in BUILT_IN:
        return GuardedChannel(BUILT_IN[kind](), trusted=True)
    if kind == POLICY:
        return GuardedChannel(PolicyChannel(base_dir))
    if kind in HOSTED:
        return HOSTED[kind](base_dir, files)
    return plugin_channel(load_part(kind, base_dir))


def plugin_channel(part: Part) -> ControlChannel:
    """Make the channel of a class from outside the package.

    Args:
        part: What was loaded.

    Raises:
        SpecError: The class has no ``act``.
    """
    require(part, "channel", ("act",))
    late = _LateChannel(part)
    with guest(part.name, "channel"):
        is_on_batch = hasattr(part.obj, "reset")
    return PluginChannel(part, GuardedChannel(late) if is_on_batch else ScalarChannel(part.obj))


class PluginChannel:
    """A contained plug-in that is given its parameters as the model that it declares."""

    def __init__(self, part: Part, channel: GuardedChannel | ScalarChannel) -> None:
        """Wrap a contained channel.

        Args:
            part: The class that it is made from.
            channel: What contains its failures.
        """
        self._part = part
        self._channel = channel
        self.monitor_ids: tuple[str, ...] = channel.monitor_ids

    @property
    def hooks(self) -> tuple[str, ...]:
        """Faults inside it that the channel offers a hook for, see ``ports.HookedChannel``."""
        return tuple(getattr(self._channel, "hooks", ()))

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Tell the channel where a fault inside it is present.

        Raises:
            SpecError: It does not offer the hook.
        """
        if not isinstance(self._channel, HookedChannel):
            raise SpecError(
                f"{self._part.name} has no hook {hook}",
                remedy="A channel on the batch may have it.",
            )
        with guest(self._part.name):
            self._channel.inject(hook, active, size)

    @property
    def events(self) -> list[ChannelEvent | None]:
        """First failure of the channel in each run, or None."""
        return self._channel.events

    def reset(self, context: ChannelContext) -> None:
        """Validate the parameters of every run and prepare for the batch.

        Raises:
            SpecError: The parameters do not fit the class's ``Parameters``.
        """
        models = [self._validated(context.channel_id, item) for item in context.parameters]
        with guest(self._part.name):
            self._channel.reset(replace(context, parameters=models))

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation."""
        with guest(self._part.name):
            return self._channel.act(observation)

    def _validated(self, channel_id: str, values: Any) -> Any:
        if isinstance(values, BaseModel):
            return values
        checked = validate_parameters(self._part, values or {})
        if checked.errors:
            loc, message = checked.errors[0]
            path = ".".join(str(step) for step in ("channels", channel_id, "parameters", *loc))
            raise SpecError(f"{path}: {message}", remedy=f"See {self._part.name}.Parameters.")
        return checked.parameters


class _LateChannel:
    """A batch channel whose instance is made at reset, so that its constructor may fail, too."""

    def __init__(self, part: Part) -> None:
        self._part = part
        self.monitor_ids = names_in(part, "channel", "monitor_ids")
        self.hooks = names_in(part, "channel", "hooks")
        self._channel: Any = None

    def reset(self, context: ChannelContext) -> None:
        self._channel = self._part.build()
        self._channel.reset(context)

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        self._channel.inject(hook, active, size)

    def act(self, observation: Observation) -> ControlCommand:
        command: ControlCommand = self._channel.act(observation)
        return command
