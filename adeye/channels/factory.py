"""From the kind of a channel in an architecture to the channel itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, cast

from adeye.channels.guard import GuardedChannel
from adeye.channels.nominal import NominalChannel
from adeye.channels.safety import SafetyChannel
from adeye.channels.scalar import ScalarChannel
from adeye.ports import ControlChannel
from adeye.registry import Part, load_part, require

BUILT_IN: Final[Mapping[str, Callable[[], ControlChannel]]] = {
    "nominal": NominalChannel,
    "safety": SafetyChannel,
}
"""Channels of the package, by kind."""


def make_channel(kind: str, base_dir: Path) -> ControlChannel:
    """Make the channel of a kind; it has still to be reset with a context.

    A class with ``reset`` works on the batch; one without is made once per run.

    Args:
        kind: ``nominal``, ``safety``, ``module:Class`` or ``./file.py:Class``.
        base_dir: Folder of the file that names a plug-in.

    Returns:
        The channel. What a plug-in raises or answers is contained in it.

    Raises:
        SpecError: There is no such plug-in, or it is no channel.
    """
    if kind in BUILT_IN:
        return GuardedChannel(BUILT_IN[kind](), trusted=True)
    return plugin_channel(load_part(kind, base_dir))


def plugin_channel(part: Part) -> ControlChannel:
    """Make the channel of a class from outside the package.

    Args:
        part: What was loaded.

    Raises:
        SpecError: The class has no ``act``.
    """
    require(part, "channel", ("act",))
    if not hasattr(part.obj, "reset"):
        return ScalarChannel(part.obj)
    return GuardedChannel(cast("Any", _LateChannel)(part))


class _LateChannel:
    """A batch channel whose instance is made at reset, so that its constructor may fail, too."""

    def __init__(self, part: Part) -> None:
        self._part = part
        self.monitor_ids: tuple[str, ...] = tuple(getattr(part.obj, "monitor_ids", ()))
        self._channel: Any = None

    def reset(self, context: Any) -> None:
        self._channel = self._part.build()
        self._channel.reset(context)

    def act(self, observation: Any) -> Any:
        return self._channel.act(observation)
