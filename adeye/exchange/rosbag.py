"""What a channel was shown in a run as a bag of ROS, with the topics that the bridges publish.

A folder is a bag of ROS 2, with MCAP within; a file that ends in ``.bag`` is one of ROS 1. Types
and messages are those of ``simulate.bridges.ros_messages``; times are simulated ones.
"""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from adeye.simulate.bridges.ros_messages import TOPICS, Topics, definitions, filled, nanoseconds

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from adeye.simulate.bridges.ros_messages import Field

FILE: Final = ".bag"
"""How the name of a bag of ROS 1 ends."""

NAMES: Final = re.compile(r"metadata\.yaml|.*\.mcap")
"""Files in a bag of ROS 2."""

_MARK: Final = ("adeye_replay", "what a channel was shown")
"""What is said in a bag, for it to be known from what somebody recorded; ``outputs`` knows bags of
ROS 1 by who is said to have sent it all."""
_TAIL: Final = 1_000_000
"""Part of a file that holds its metadata, which come last [bytes]."""


def write_rosbag(lines: Iterable[bytes], path: Path, name: str) -> None:
    """Write a bag, always the same bytes.

    Args:
        lines: What the channel is told before the run, and at each of its ticks, as
            ``adeye/channel@1`` has it.
        path: Of a file for ROS 1, else of an empty folder.
        name: Of the bag.
    """
    told = iter(lines)
    hello = json.loads(next(told))
    if name.endswith(FILE):
        with rosbag1.Writer(path) as writer:
            _write(writer, _Types(1), hello, told)
        return
    with tempfile.TemporaryDirectory(dir=path) as folder:
        # A bag names its files like the folder that it makes.
        made = Path(folder, name)
        plugin = rosbag2.StoragePlugin.MCAP
        with rosbag2.Writer(made, version=9, storage_plugin=plugin) as writer:
            writer.set_custom_data(*_MARK)
            _write(writer, _Types(2), hello, told)
        for file in made.iterdir():
            file.rename(path / file.name)


def is_own(file: Path) -> bool:
    """Tell whether a file in a bag of ROS 2 is of one that was written here."""
    with file.open("rb") as stream:
        stream.seek(max(0, file.stat().st_size - _TAIL))
        return ": ".join(_MARK).encode() in stream.read()


def _write(writer: Any, types: _Types, hello: Mapping[str, Any], lines: Iterable[bytes]) -> None:
    topics = Topics(hello, types.version)
    said = {"callerid": f"/{_MARK[0]}"} if types.version == 1 else {}
    connections = {
        name: writer.add_connection(
            f"/{topics.topic(name).lstrip('/')}", _named(kind), typestore=types.store, **said
        )
        for name, kind in TOPICS.items()
    }
    for line in lines:
        shown = json.loads(line)
        for name, value in topics.messages(line, shown):
            content = types.encode(TOPICS[name], value)
            writer.write(connections[name], nanoseconds(shown["time"]), content)


class _Types:
    """The types of one version of ROS, and messages of them as bytes.

    Attributes:
        version: Of ROS.
        store: Its types.
    """

    def __init__(self, version: int) -> None:
        self.version = version
        self._definitions = definitions(version)
        self.store = get_typestore(Stores.EMPTY)
        found: dict[str, Any] = {}
        for kind, fields in self._definitions.items():
            text = "\n".join(_line(field, version) for field in fields)
            found |= get_types_from_msg(text, _named(kind))
        self.store.register(found)

    def encode(self, kind: str, value: Any) -> memoryview:
        """Return a message made of a dictionary."""
        message, name = filled(self._definitions, kind, value, self._build), _named(kind)
        if self.version == 1:
            return self.store.serialize_ros1(message, name)
        return self.store.serialize_cdr(message, name)

    def _build(self, kind: str, values: Mapping[str, Any]) -> Any:
        made = dict(values)
        for field in self._definitions.get(kind, ()):
            if field.length is not None and field.kind not in self._definitions:
                plain = np.frombuffer if isinstance(made[field.name], bytes) else np.array
                made[field.name] = plain(made[field.name], dtype=field.kind)
        return self.store.types[_named(kind)](**made)


def _named(kind: str) -> str:
    """Return the name of a type as both versions are called by the library."""
    package, _, name = ("builtin_interfaces/Time" if kind == "time" else kind).partition("/")
    return f"{package}/msg/{name}"


def _line(field: Field, version: int) -> str:
    """Write a line of a definition."""
    kind = "builtin_interfaces/Time" if (field.kind, version) == ("time", 2) else field.kind
    many = "" if field.length is None else f"[{field.length or ''}]"
    constant = f"={field.constant}" if field.constant else ""
    return f"{kind}{many} {field.name}{constant}"
