"""Plug-ins without importing them: what packages offer, and what an ODD names, with code hashes."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from importlib.machinery import PathFinder
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Final

from adeye.registry import files_digest, package_files
from adeye.spec.channels import PluginChannel, PolicyChannel
from adeye.spec.sensors import PluginSensor

if TYPE_CHECKING:
    from collections.abc import Iterator

    from adeye.spec.load import OddFiles

GROUP: Final = "adeye."
"""Beginning of the groups of entry points that packages offer parts in, such as
``adeye.channels``."""


@dataclass(frozen=True, slots=True)
class Offered:
    """A part that an installed package offers; nothing uses it until a file names ``source``.

    Attributes:
        name: As the package calls it.
        kind: What of: the group behind ``adeye.``.
        package: The distribution.
        version: Of the distribution.
        source: ``module:Class``, as an ODD or architecture would name it.
    """

    name: str
    kind: str
    package: str
    version: str
    source: str


@dataclass(frozen=True, slots=True)
class Named:
    """A part that an ODD or one of its architectures names.

    Attributes:
        source: ``module:Class`` or ``./file.py:Class``, as written.
        kind: channel, sensor, policy or metric.
        owner: The file that names it, as the user wrote its path.
        digest: sha256 of the file, or of all files of the package; empty if it is not found.
    """

    source: str
    kind: str
    owner: str
    digest: str


def offered() -> tuple[Offered, ...]:
    """List what installed packages offer, from their metadata alone."""
    found = {
        Offered(
            item.name,
            item.group.removeprefix(GROUP),
            item.dist.name if item.dist is not None else "",
            item.dist.version if item.dist is not None else "",
            item.value,
        )
        for group in entry_points().groups
        if group.startswith(GROUP)
        for item in entry_points(group=group)
    }
    return tuple(sorted(found, key=lambda item: (item.kind, item.name, item.source)))


def named(files: OddFiles) -> tuple[Named, ...]:
    """List the plug-ins that an ODD and its architectures name; none is imported."""
    found = {
        Named(source, kind, str(owner), _digest(source, owner.parent))
        for owner, kind, source in _sources(files)
    }
    return tuple(sorted(found, key=lambda item: (item.owner, item.kind, item.source)))


def _sources(files: OddFiles) -> Iterator[tuple[Path, str, str]]:
    for source in files.odd.spec.plugins:
        yield files.odd.path, "metric", source
    for loaded in files.architectures.values():
        for sensor in loaded.spec.sensors.values():
            if isinstance(sensor, PluginSensor):
                yield loaded.path, "sensor", sensor.kind
        for channel in loaded.spec.channels.values():
            if isinstance(channel, PluginChannel):
                yield loaded.path, "channel", channel.kind
            if isinstance(channel, PolicyChannel):
                yield loaded.path, "policy", channel.parameters.policy


def _digest(source: str, folder: Path) -> str:
    """Hash the code behind a name as ``registry`` does when it loads it."""
    module = source.rpartition(":")[0]
    try:
        if module.endswith(".py"):
            return hashlib.sha256((folder / module).resolve().read_bytes()).hexdigest()
        # The finder of files only looks; import_module would execute the package.
        spec = PathFinder.find_spec(module.partition(".")[0])
        if spec is None:
            return ""
        folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
        origin = Path(spec.origin or "")
        return files_digest(package_files(folders) if folders else [(origin.name, origin)])
    except (OSError, ValueError):
        return ""
