"""XML of others, read as a stream: elements with their lines, within bounds, and nothing fetched.

What the standard library's expat makes of a file is taken, but no document type, no entity and no
reference to another file: these are refused where they stand.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from pathlib import Path
from sys import intern
from typing import Any, Final
from xml.parsers import expat

from adeye.errors import SourceLocation, SpecError, suggest
from adeye.outputs import require_plain
from adeye.units import shown

MAX_BYTES: Final = 400_000_000
"""Some 500,000 lanes as others write them. Our choice, as the bounds below."""
MAX_ELEMENTS: Final = 100_000
"""In one part of a file, such as a road: it is held until it is read."""
MAX_DEPTH: Final = 50
MAX_ATTRIBUTES: Final = 100
MAX_NAME: Final = 200
MAX_TAG_BYTES: Final = 1_000_000
MAX_TEXT: Final = 100_000
MOST: Final = 1e7
"""Largest number that anything of a map may be: no place of a projected map of the earth is farther
[m], and doubles still part places there by nanometres."""

_CHUNK: Final = 65_536
_PACKED: Final = {b"\x1f\x8b": "gzip", b"PK": "zip", b"BZh": "bzip2", b"\xfd7zXZ": "xz"}

_INCLUDING: Final = frozenset({"include", "xi:include"})
"""Elements of OpenDRIVE and of XML that stand for what is in another file."""


class Element:
    """An element, whose attributes and children are taken out by whoever reads them.

    Attributes:
        tag: Its name.
        path: The names from below the root down to it, such as ``road.lanes.laneSection``.
        file: Where it stands.
        line: Of its first character.
        column: Of that.
        attributes: Those that nobody took.
        children: By tag those that nobody took.
        taken: Children that were taken.
        text: What stands in it, without what stands in its children; empty once it is taken.
        name: What people call it; empty until its reader knows.
    """

    __slots__ = (
        *("attributes", "children", "column", "file", "line", "name", "path", "tag", "taken"),
        "text",
    )

    def __init__(
        self, tag: str, path: str, place: tuple[str, int, int], found: dict[str, str]
    ) -> None:
        self.tag = tag
        self.path = path
        self.file, self.line, self.column = place
        self.attributes = found
        self.children: dict[str, list[Element]] = {}
        self.taken: list[Element] = []
        self.text = ""
        self.name = ""

    def error(self, message: str, remedy: str = "") -> SpecError:
        """Make an error that says where the element stands."""
        where = SourceLocation(self.file, self.line, self.column)
        return SpecError(f"{self.name or f'<{self.tag}>'}: {message}", where=where, remedy=remedy)

    def take_text(self) -> str:
        """Take what stands in it."""
        text, self.text = self.text.strip(), ""
        return text

    def abandon(self) -> None:
        """Take all that is in it: it was told that none of it counts."""
        self.attributes.clear()
        self.children.clear()

    def take(self, tag: str) -> Sequence[Element]:
        """Take all children of a name, in the order of the file."""
        found = self.children.pop(tag, None)
        if found is None:
            return ()
        self.taken += found
        return found

    def take_one(self, tag: str) -> Element | None:
        """Take the child of a name, if there is one.

        Raises:
            SpecError: There are several.
        """
        found = self.take(tag)
        if len(found) > 1:
            raise found[1].error(
                f"it is there twice, the first time in line {found[0].line}", "Remove one."
            )
        return found[0] if found else None

    def word(self, name: str, default: str | None = None) -> str:
        """Take an attribute as it is written.

        Raises:
            SpecError: It is not there, and there is no default.
        """
        text = self.attributes.pop(name, default)
        if text is None:
            near = suggest(name, self.attributes) if self.attributes else ""
            raise self.error(f"{name} is missing", f"Write {name}=. {near}".rstrip())
        # Many lanes have few kinds.
        return intern(text)

    def choice(self, name: str, allowed: Sequence[str], default: str | None = None) -> str:
        """Take an attribute that is one of several words.

        Raises:
            SpecError: It is another, or not there without a default.
        """
        text = self.word(name, default)
        if text not in allowed and text != default:
            raise self.error(f"{name} is {shown(text)}", suggest(text, allowed))
        return text

    def number(
        self, name: str, default: float | None = None, least: float = -MOST, most: float = MOST
    ) -> float:
        """Take an attribute that is a number.

        Raises:
            SpecError: It is none, not within the bounds, or not there without a default.
        """
        text = self.attributes.pop(name, None)
        if text is None and default is not None:
            return default
        if text is None:
            text = self.word(name)
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not (least <= value <= most) or "_" in text or not text.isascii():
            is_number = isfinite(value) and "_" not in text and text.isascii()
            allowed = f"from {least:g} to {most:g}" if is_number else "in plain decimal digits"
            what = "" if is_number else ", no finite number"
            raise self.error(f"{name} is {shown(text)}{what}", f"Write a number {allowed}.")
        return value

    def whole(self, name: str, most: int = 10_000) -> int:
        """Take an attribute that is a whole number, of either sign.

        Raises:
            SpecError: It is none, too large, or not there.
        """
        value = self.number(name, None, -most, most)
        if value != int(value):
            raise self.error(f"{name} is {value:g}", "Write a whole number.")
        return int(value)


def listed(items: Iterable[object], most: int = 12) -> str:
    """Write items one after the other, and of many the first."""
    found = list(items)
    return ", ".join(map(str, found[:most])) + (", …" if len(found) > most else "")


def parts_of(path: Path) -> Iterator[Element]:
    """Read a file, one part after the other.

    Args:
        path: Of the file.

    Yields:
        The root without what is in it, then each child of the root with all that is in it.

    Raises:
        SpecError: It is missing, too large, no well-formed XML, or holds what is refused.
    """
    start = SourceLocation(str(path), 1, 1)
    try:
        require_plain(path)
        if path.stat().st_size > MAX_BYTES:
            raise SpecError(
                f"the file has more than {MAX_BYTES:,} bytes",
                where=start,
                remedy="Cut the map to the part that is needed.",
            )
        with path.open("rb") as stream:
            yield from _Source(str(path)).parts(stream)
    except FileNotFoundError as error:
        whole = SourceLocation(str(path), 0, 0)
        raise SpecError("there is no such file", where=whole, remedy="Check the path.") from error
    except OSError as error:
        raise SpecError(f"the file cannot be read: {error.strerror}", where=start) from error
    except ValueError as error:
        raise SpecError(f"{shown(str(path))} is not a path", where=None) from error


class _Source:
    """Builds elements of what expat finds."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._open: list[Element] = []
        self._done: list[Element] = []
        self._elements = 0
        self._paths: dict[tuple[str, str], str] = {}
        self._parser = parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text
        parser.StartDoctypeDeclHandler = self._doctype
        parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)

    def parts(self, stream: Any) -> Iterator[Element]:
        read = 0
        while chunk := stream.read(_CHUNK):
            if not read:
                self._check_head(chunk)
            read += len(chunk)
            self._parse(chunk)
            if read - max(self._parser.CurrentByteIndex, 0) > MAX_TAG_BYTES:
                raise self._error(f"something here is longer than {MAX_TAG_BYTES:,} bytes")
            yield from self._done
            self._done.clear()
        self._parse(b"", is_last=True)
        yield from self._done

    def _check_head(self, chunk: bytes) -> None:
        packer = next((name for head, name in _PACKED.items() if chunk.startswith(head)), "")
        if packer:
            raise self._error(f"the file is packed by {packer}", "Unpack it first.")

    def _parse(self, chunk: bytes, *, is_last: bool = False) -> None:
        try:
            self._parser.Parse(chunk, is_last)
        except expat.ExpatError as error:
            what = expat.ErrorString(error.code)
            if is_last and self._open:
                inner = self._open[-1]
                what = f"the file ends inside <{inner.tag}>, which begins in line {inner.line}"
            elif is_last and not self._elements:
                what = "the file is empty or holds no element"
            where = SourceLocation(self._path, error.lineno, error.offset + 1)
            remedy = "Is the file complete, and is it XML?"
            raise SpecError(f"no well-formed XML: {what}", where=where, remedy=remedy) from error
        except (LookupError, ValueError) as error:
            raise self._error(f"its encoding is not known: {error}", "Save it as UTF-8.") from error

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        above = self._open[-1] if self._open else None
        self._elements += 1
        if len(self._open) >= MAX_DEPTH:
            raise self._error(f"nested more than {MAX_DEPTH} deep")
        if len(tag) > MAX_NAME:
            raise self._error(f"a name has more than {MAX_NAME} letters")
        if len(attributes) > MAX_ATTRIBUTES:
            raise self._error(f"<{tag}> has more than {MAX_ATTRIBUTES} attributes")
        if tag in _INCLUDING:
            named = shown(next(iter(attributes.values()), ""))
            raise self._error(
                f"<{tag}> names another file, {named}, which is not read", "Put its content here."
            )
        if self._elements > MAX_ELEMENTS:
            raise self._error(f"more than {MAX_ELEMENTS:,} elements in one part")
        # One text for all elements of a kind.
        key = (above.path, tag) if above is not None else ("", "")
        path = self._paths.get(key)
        if path is None:
            path = self._paths.setdefault(key, f"{key[0]}.{key[1]}".strip(".")[:MAX_NAME])
        parser = self._parser
        place = self._path, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        element = Element(tag, path, place, attributes)
        self._open.append(element)
        if above is None:
            self._done.append(element)
        elif len(self._open) > 2:
            above.children.setdefault(tag, []).append(element)

    def _end(self, tag: str) -> None:  # noqa: ARG002 - expat's own
        element = self._open.pop()
        if len(self._open) == 1:
            self._done.append(element)
            self._elements = 1

    def _text(self, text: str) -> None:
        if text.isspace() or not self._open:
            return
        element = self._open[-1]
        if len(element.text) + len(text) > MAX_TEXT:
            raise self._error(f"<{element.tag}> holds more than {MAX_TEXT:,} characters")
        element.text += text

    def _doctype(self, name: str, *_: object) -> None:
        if name.lower() == "html":
            raise self._error("this is an HTML page, not a map", "Download the file itself.")
        raise self._error(
            f"it declares a document type, {shown(name)}: entities and other files are not read",
            "Remove the <!DOCTYPE …> declaration.",
        )

    def _error(self, message: str, remedy: str = "") -> SpecError:
        parser = self._parser
        line, column = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        return SpecError(message, where=SourceLocation(self._path, line, column), remedy=remedy)
