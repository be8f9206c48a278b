"""Plug-ins and monitors of an architecture, loaded and checked at plan time."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from adeye.channels.factory import BUILT_IN as BUILT_IN_CHANNELS
from adeye.channels.factory import make_channel, plugin_channel
from adeye.channels.policy.channel import load_policy
from adeye.channels.process import command_files, find_program
from adeye.errors import SpecError
from adeye.registry import (
    Loc,
    Part,
    ReadFile,
    load_part,
    plugins_digest,
    read_file,
    require,
    validate_parameters,
)
from adeye.spec.channels import PluginChannel, PolicyChannel, ProcessChannel
from adeye.spec.quantity import IDENTIFIER
from adeye.spec.sensors import PluginSensor
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from adeye.ports import ControlChannel
    from adeye.spec.architecture import Architecture
    from adeye.spec.load import Loaded


@dataclass(frozen=True)
class Parts:
    """What an architecture brings beside its own file.

    Attributes:
        plugins: Plug-ins that it names.
        monitors: Monitor ids that its channels declare, in the order of the channels.
        metrics: Metrics from outside the package that the ODD lists.
        files: Files that its channels say they read.
    """

    plugins: tuple[Part, ...]
    monitors: tuple[str, ...]
    metrics: tuple[Part, ...] = ()
    files: tuple[ReadFile, ...] = ()

    @property
    def digest(self) -> str:
        """Hash of the plug-ins' code, versions and files; empty if there are none."""
        parts = (*self.plugins, *self.metrics)
        return plugins_digest(parts, self.files) if parts or self.files else ""


def load_parts(loaded: Loaded[Architecture], metrics: tuple[Part, ...] = ()) -> Parts:
    """Load the plug-ins of an architecture, ask its channels for monitors, hash what they read.

    Raises:
        SpecError: A plug-in does not load, its parameters are not valid, or a file that it reads
            is not there.
    """
    return replace(load_code(loaded, metrics), files=tuple(_files(loaded)))


def load_code(loaded: Loaded[Architecture], metrics: tuple[Part, ...] = ()) -> Parts:
    """Load the plug-ins of an architecture and ask its channels for monitors; read no more.

    Raises:
        SpecError: A plug-in does not load, or its parameters are not valid.
    """
    folder = loaded.path.parent
    plugins: list[Part] = []
    monitors: list[str] = []
    for name, sensor in loaded.spec.sensors.items():
        if isinstance(sensor, PluginSensor):
            plugins.append(_plugin(loaded, ("sensors", name), sensor, "sensor", ("sense",)))
    for name, channel in loaded.spec.channels.items():
        if isinstance(channel, PolicyChannel):
            plugins.append(_policy(loaded, name, channel))
            continue
        if isinstance(channel, ProcessChannel):
            _check_program(loaded, name, channel)
            continue
        if channel.kind in BUILT_IN_CHANNELS:
            made = make_channel(channel.kind, folder, channel.parameters)
        else:
            assert isinstance(channel, PluginChannel)
            part = _plugin(loaded, ("channels", name), channel, "channel", ("act",))
            plugins.append(part)
            made = _placed(loaded, name, part)
        for monitor in made.monitor_ids:
            if re.fullmatch(IDENTIFIER, str(monitor)) is None:
                raise SpecError(
                    f"channel {name}: {shown(monitor)} cannot name a monitor",
                    where=loaded.locate(("channels", name, "kind")),
                    remedy="Use lower case letters, digits and underscores after a letter.",
                )
            if monitor in monitors:
                raise SpecError(
                    f"channel {name}: monitor {monitor!r} is declared by another channel, too",
                    where=loaded.locate(("channels", name)),
                    remedy="Monitor ids are unique within an architecture.",
                )
            monitors.append(monitor)
    return Parts(tuple(plugins), tuple(monitors), metrics)


def named_files(architecture: Architecture) -> dict[str, tuple[str, ...]]:
    """List the files that each channel names, as written: those that it reads, its program."""
    return {
        name: tuple(file for _, file in files)
        for name in architecture.channels
        if (files := _named(architecture, name))
    }


def _named(architecture: Architecture, name: str) -> list[tuple[Loc, str]]:
    """List where in a channel's record which file is named."""
    channel = architecture.channels[name]
    found: list[tuple[Loc, str]] = []
    if isinstance(channel, ProcessChannel):
        files = command_files(channel.parameters.command)
        found += [(("parameters", "command", at), file) for at, file in files.items()]
    if isinstance(channel, PolicyChannel | ProcessChannel | PluginChannel):
        found += [(("files", at), file) for at, file in enumerate(channel.files)]
    return found


def _files(loaded: Loaded[Architecture]) -> Iterator[ReadFile]:
    for channel in loaded.spec.channels:
        found: set[Path] = set()
        for loc, name in _named(loaded.spec, channel):
            where = loaded.locate(("channels", channel, *loc))
            try:
                file = read_file(f"channels.{channel}", name, loaded.path.parent)
            except SpecError as error:
                text = f"channel {channel}: {error.message}"
                raise SpecError(text, where=where, remedy=error.remedy) from error
            if file.path in found:
                raise SpecError(
                    f"channel {channel}: file {shown(name)} is listed twice",
                    where=where,
                    remedy="Name each file once.",
                )
            found.add(file.path)
            yield file


def _placed(loaded: Loaded[Architecture], name: str, part: Part) -> ControlChannel:
    try:
        return plugin_channel(part)
    except SpecError as error:
        where = loaded.locate(("channels", name, "kind"))
        raise SpecError(error.message, where=where, remedy=error.remedy) from error


def _policy(loaded: Loaded[Architecture], name: str, spec: PolicyChannel) -> Part:
    where = loaded.locate(("channels", name, "parameters", "policy"))
    try:
        return load_policy(spec.parameters.policy, loaded.path.parent)
    except SpecError as error:
        if error.where is not None:
            raise
        raise SpecError(error.message, where=where, remedy=error.remedy) from error


def _check_program(loaded: Loaded[Architecture], name: str, spec: ProcessChannel) -> None:
    try:
        find_program(spec.parameters.command, loaded.path.parent)
    except SpecError as error:
        where = loaded.locate(("channels", name, "parameters", "command"))
        text = f"channel {name}: {error.message}"
        raise SpecError(text, where=where, remedy=error.remedy) from error


def _plugin(
    loaded: Loaded[Architecture],
    loc: tuple[str, str],
    spec: PluginSensor | PluginChannel,
    kind: str,
    methods: tuple[str, ...],
) -> Part:
    where = loaded.locate((*loc, "kind"))
    try:
        part = load_part(spec.kind, loaded.path.parent)
        require(part, kind, methods)
        checked = validate_parameters(part, spec.parameters)
    except SpecError as error:
        if error.where is not None:
            raise
        raise SpecError(error.message, where=where, remedy=error.remedy) from error
    for place, message in checked.errors:
        raise SpecError(
            f"{'.'.join((*loc, 'parameters', *map(str, place)))}: {message}",
            where=loaded.locate((*loc, "parameters", *place)),
        )
    return part
