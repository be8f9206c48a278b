"""MCAP, the container of time-stamped messages that viewers open: written the same every time."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from mcap.writer import CompressionType, Writer

from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path


class McapFile:
    """An open file; times are simulated ones [ns], and no clock is read."""

    def __init__(self, writer: Writer) -> None:
        """Add to what a writer has begun."""
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._counts: dict[int, int] = {}

    def channel(
        self,
        topic: str,
        schema: tuple[str, str, bytes],
        encoding: str = "protobuf",
        metadata: Mapping[str, str] | None = None,
    ) -> int:
        """Begin a topic.

        Args:
            topic: Its name.
            schema: Name, encoding and text of the schema of its messages; a name stands for one.
            encoding: Of the messages.
            metadata: What is said of the topic.
        """
        name = schema[0]
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(*schema)
        return self._writer.register_channel(
            topic, encoding, self._schemas[name], dict(metadata or {})
        )

    def log(self, channel: int, time: int, message: bytes) -> None:
        """Write a message.

        Args:
            channel: Of its topic.
            time: [ns].
            message: Its bytes.
        """
        count = self._counts[channel] = self._counts.get(channel, 0) + 1
        self._writer.add_message(channel, time, message, time, count)

    def say(self, name: str, about: Mapping[str, str]) -> None:
        """Write what is said of the file as a whole."""
        self._writer.add_metadata(name, dict(about))


@contextmanager
def mcap_file(path: Path) -> Iterator[McapFile]:
    """Write a file of MCAP, which is complete at the end.

    Args:
        path: Of the file.
    """
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start(profile="", library=f"adeye {__version__}")
        yield McapFile(writer)
        writer.finish()  # type: ignore[no-untyped-call]
