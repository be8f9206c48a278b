"""Strict YAML 1.2 documents with the line and column of every value.

The core schema of YAML 1.2 only: ``no`` and ``on`` are text, dates are text, and so is ``017``,
which 1.1 and 1.2 read as different numbers. Duplicate keys, explicit tags, numbers that are not
decimal or not finite, merge keys, recursive aliases and oversized documents are errors, all but the
numbers found on the event stream before anything is built.
"""

from __future__ import annotations

import math
import re
import stat
import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import yaml

from adeye.errors import SourceLocation, SpecError
from adeye.outputs import reads
from adeye.spec.problems import Loc, Located, validate
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Document", "Loc", "Located", "load_document", "parse_document", "validate"]

MAX_BYTES: Final = 1_000_000
MAX_NODES: Final = 100_000
MAX_DEPTH: Final = 50

_INTEGER: Final = re.compile(r"[-+]?(?:0|[1-9][0-9]*)")
_OTHER_BASE: Final = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT: Final = re.compile(r"[-+]?(?:\.[0-9]+|(?:0|[1-9][0-9]*)(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_NON_FINITE: Final = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
# What is not among the printable characters of YAML 1.2.2, production [1].
_FOREIGN: Final = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_WORDS: Final = {
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys(("null", "Null", "NULL", "~", ""), None),
}
_Loader: Final = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class Document:
    """A YAML file as plain data, with places.

    Attributes:
        path: As given by the user.
        value: Plain Python data.
    """

    path: str
    value: Any
    _values: Mapping[Loc, SourceLocation]
    _keys: Mapping[Loc, SourceLocation]

    def locate(self, loc: Loc) -> SourceLocation:
        """Find the place of a part, or of the deepest part above it that exists."""
        return _nearest(self._values, loc)

    def locate_key(self, loc: Loc) -> SourceLocation:
        """Find the place of the key of a part."""
        return self._keys.get(loc) or _nearest(self._values, loc)

    def heir(self, loc: Loc) -> str:  # noqa: ARG002 - nothing is inherited
        """Return no file: everything is written here."""
        return ""


def load_document(path: str | Path) -> Document:
    """Read a YAML file.

    Raises:
        SpecError: The file is missing, too large, no strict YAML, or empty.
    """
    return parse_document(_read(Path(path)), str(path))


def parse_document(text: str, path: str) -> Document:
    """Read YAML text that stands for a file.

    Raises:
        SpecError: It is no strict YAML, too large, or empty.
    """
    start = SourceLocation(path, 1, 1)
    _check_characters(text, path)
    if len(text.encode()) > MAX_BYTES:
        raise _too_large(start)
    try:
        _Scan(path).run(text)
        node = yaml.compose(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise _yaml_error(error, text, path) from error
    if node is None:
        raise SpecError("the document is empty", where=start, remedy="Write a mapping.")
    builder = _Builder(path)
    value = builder.build(node, ())
    return Document(path, value, builder.values, builder.keys)


def require_plain(path: Path, most: int) -> None:
    """Refuse what should not be read whole: devices and pipes may never end.

    Args:
        path: What somebody named.
        most: Largest size that is read [bytes].

    Raises:
        SpecError: It is no regular file, or larger.
        UsageError: It is about to be written.
        OSError: It is not there.
    """
    reads(path)
    found = path.stat()
    where = SourceLocation(str(path), 1, 1)
    if stat.S_ISDIR(found.st_mode):
        raise SpecError("this is a folder, not a file", where=where, remedy="Name a file.")
    if not stat.S_ISREG(found.st_mode):
        raise SpecError("this is not a regular file", where=where, remedy="Name a file.")
    if found.st_size > most:
        raise SpecError(f"the file has more than {most:,} bytes", where=where, remedy="Split it.")


def _read(path: Path) -> str:
    where = SourceLocation(str(path), 1, 1)
    try:
        require_plain(path, MAX_BYTES)
        with path.open("rb") as file:
            content = file.read(MAX_BYTES)
    except FileNotFoundError as error:
        raise SpecError("there is no such file", where=where, remedy="Check the path.") from error
    except OSError as error:
        raise SpecError(f"the file cannot be read: {error.strerror}", where=where) from error
    except ValueError as error:
        raise SpecError(f"{shown(str(path))} is not a path", where=None) from error
    return _decoded(content, str(path))


def _decoded(content: bytes, path: str) -> str:
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SpecError(
            f"byte 0x{content[error.start]:02x} is not UTF-8",
            where=_after(content[: error.start].decode("utf-8"), path),
            remedy="Save the file as UTF-8.",
        ) from error


def _check_characters(text: str, path: str) -> None:
    foreign = _FOREIGN.search(text)
    if foreign is not None:
        raise SpecError(
            f"character U+{ord(foreign[0]):04X} cannot stand in YAML",
            where=_after(text[: foreign.start()], path),
            remedy="Remove it.",
        )


def _after(before: str, path: str) -> SourceLocation:
    line_start = before.rfind("\n") + 1
    return SourceLocation(path, before.count("\n") + 1, len(before) - line_start + 1)


def _too_large(where: SourceLocation) -> SpecError:
    return SpecError(f"the file has more than {MAX_BYTES:,} bytes", where=where, remedy="Split it.")


class _Scan:
    """Looks for what must not be built, with aliases counted at the size of what they repeat."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._documents = 0
        self._nodes = 0
        self._sizes: dict[str, int] = {}
        # For each open collection: its anchor and the nodes before it.
        self._open: list[tuple[str | None, int]] = []

    def run(self, text: str) -> None:
        for event in yaml.parse(text, Loader=_Loader):
            if isinstance(event, yaml.NodeEvent):
                self._node(event)
            elif isinstance(event, yaml.CollectionEndEvent):
                anchor, before = self._open.pop()
                if anchor is not None:
                    self._sizes[anchor] = self._nodes - before
            elif isinstance(event, yaml.DocumentStartEvent):
                self._document(event)

    def _document(self, event: yaml.DocumentStartEvent) -> None:
        self._documents += 1
        if self._documents > 1:
            raise self._error("a second document begins here", event, "Keep one.")
        if event.version not in {None, (1, 2)}:
            raise self._error(
                "this is YAML 1.1, whose words and numbers mean other things",
                event,
                "Remove %YAML and check words like no, on and 017.",
            )

    def _node(self, event: yaml.NodeEvent) -> None:
        if isinstance(event, yaml.AliasEvent):
            if any(anchor == event.anchor for anchor, _ in self._open):
                raise self._error(f"alias *{event.anchor} contains itself", event)
            self._nodes += self._sizes.get(str(event.anchor), 1)
        else:
            self._value(event)
        if self._nodes > MAX_NODES:
            raise self._error(f"more than {MAX_NODES:,} values, aliases included", event)

    def _value(self, event: Any) -> None:
        if event.tag is not None:
            raise self._error(
                f"tag {shown(event.tag)} is not read", event, "Remove it; quote text that needs it."
            )
        if isinstance(event, yaml.CollectionStartEvent):
            self._open.append((event.anchor, self._nodes))
            if len(self._open) > MAX_DEPTH:
                raise self._error(f"nested more than {MAX_DEPTH} deep", event)
        elif event.anchor is not None:
            self._sizes[event.anchor] = 1
        self._nodes += 1

    def _error(self, what: str, event: yaml.Event, remedy: str = "") -> SpecError:
        return SpecError(what, where=_mark(event.start_mark, self._path), remedy=remedy)


class _Builder:
    """Builds plain data from composed nodes and notes every place."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.values: dict[Loc, SourceLocation] = {}
        self.keys: dict[Loc, SourceLocation] = {}

    def build(self, node: yaml.Node, loc: Loc) -> Any:
        self.values[loc] = _mark(node.start_mark, self.path)
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, loc)
        if isinstance(node, yaml.SequenceNode):
            return [self.build(item, (*loc, k)) for k, item in enumerate(node.value)]
        if isinstance(node, yaml.ScalarNode) and not node.style:
            return self._plain(node.value, self.values[loc])
        return node.value

    def _mapping(self, node: yaml.MappingNode, loc: Loc) -> dict[str, Any]:
        built: dict[str, Any] = {}
        written: dict[str, SourceLocation] = {}
        for key_node, value_node in node.value:
            place = _mark(key_node.start_mark, self.path)
            key = self._key(key_node, place)
            # Two spellings of one accented letter are one key for the reader.
            name = unicodedata.normalize("NFC", key)
            if name in written:
                raise SpecError(
                    f"key {shown(key)} occurs twice, first in line {written[name].line}",
                    where=place,
                    remedy="Remove one.",
                )
            written[name] = place
            self.keys[(*loc, key)] = place
            built[key] = self.build(value_node, (*loc, key))
        return built

    def _key(self, node: yaml.Node, place: SourceLocation) -> str:
        if not isinstance(node, yaml.ScalarNode):
            raise SpecError("a key must be text", where=place)
        if node.value == "<<" and not node.style:
            raise SpecError(
                "merge keys are not read", where=place, remedy="Use `extends:` or repeat it."
            )
        return str(node.value)

    def _plain(self, text: str, where: SourceLocation) -> Any:
        if text in _WORDS:
            return _WORDS[text]
        if _NON_FINITE.fullmatch(text):
            raise SpecError(f"{text} is not a finite number", where=where, remedy="Write a number.")
        if _OTHER_BASE.fullmatch(text):
            raise SpecError(
                f"{shown(text)} is not a decimal number",
                where=where,
                remedy="Write it with the digits 0 to 9, or quote it if it is text.",
            )
        if _INTEGER.fullmatch(text):
            return _integer(text, where)
        if _FLOAT.fullmatch(text):
            value = float(text)
            if not math.isfinite(value):
                raise SpecError(f"{shown(text)} is not a finite number", where=where)
            return value
        return text


def _integer(text: str, where: SourceLocation) -> int:
    # 80 characters are enough for 64 bits; Python refuses thousands of digits with an exception.
    value = int(text) if len(text) <= 80 else None
    if value is None or not -(2**63) <= value < 2**64:
        raise SpecError(
            f"{shown(text)} does not fit into 64 bits", where=where, remedy="Write 1e20 for 10^20."
        )
    return value


def _mark(mark: Any, path: str) -> SourceLocation:
    return SourceLocation(path, mark.line + 1, mark.column + 1)


def _nearest(places: Mapping[Loc, SourceLocation], loc: Loc) -> SourceLocation:
    while loc and loc not in places:
        loc = loc[:-1]
    return places[loc]


def _yaml_error(error: yaml.YAMLError, text: str, path: str) -> SpecError:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    # What is missing at the end is reported in the line after the last.
    is_inside = mark is not None and mark.line <= text.count("\n")
    where = _mark(mark, path) if is_inside else _after(text, path)
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    return SpecError(f"no valid YAML: {problem}", where=where)
