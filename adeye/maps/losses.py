"""What an import did not take as it was written: a report by line of the source."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal, get_args

from adeye.errors import InputErrors, SourceLocation, SpecError
from adeye.maps.xml_source import Element

LossKind = Literal["approximated", "repaired", "guessed", "ignored"]

MOST_LISTED: Final = 100

_NOT_READ: Final = "is not read"
_SILENT: Final = frozenset(
    [
        *(("header", name) for name in ("date", "vendor", "version")),
        *(("header", name) for name in ("east", "north", "south", "west")),
        # What is level stays so where roads lean; here none does.
        ("lane", "level"),
        ("roadMark", "height"),
    ]
)
"""What says nothing of how roads are driven."""
_IMPLIED: Final = frozenset(
    [
        *(("roadMark", "color", value) for value in ("standard", "white")),
        ("roadMark", "weight", "standard"),
    ]
)
"""Values that say what is taken without them."""
_EMPTY: Final = frozenset(
    [
        *("elevationProfile", "lateralProfile", "left", "link", "objects", "railroad", "right"),
        *("signals", "surface"),
    ]
)
"""What says nothing if nothing is in it."""


@dataclass(frozen=True, slots=True)
class Loss:
    """One thing of a map that was not taken as it was written.

    Attributes:
        kind: What became of it.
        line: In the file; of several, that of the first.
        element: Its place among the elements, such as ``road.lanes.laneSection.right.lane.access``;
            an attribute follows after an ``@``.
        message: What stood there and what was made of it.
        count: How many of them there are: what is not read at all is told once.
        column: In the file, of the first.
    """

    kind: LossKind
    line: int
    element: str
    message: str
    count: int = 1
    column: int = 1


class Losses:
    """The losses of an import, in the order in which they were met.

    Attributes:
        about: Which road or junction they are of now; begins their messages.
        taken: How many elements were taken.
        given: How many rules beside the map say what it leaves to a guess.
    """

    def __init__(self) -> None:
        self.about = ""
        self.taken = self.given = 0
        self._found: list[Loss] = []
        self._counts: dict[str, int] = {}

    def __iter__(self) -> Iterator[Loss]:
        """Give them one after the other."""
        for loss in self._found:
            is_counted = loss.message == _NOT_READ
            yield replace(loss, count=self._counts[loss.element]) if is_counted else loss

    def __len__(self) -> int:
        """Count them; what is not read at all counts once for each kind of it."""
        return len(self._found)

    def counts(self) -> dict[str, int]:
        """Count what was taken, and the losses by their kind."""
        found = {"taken": self.taken, **dict.fromkeys(get_args(LossKind), 0)}
        for loss in self:
            found[loss.kind] += loss.count
        return found

    def add(self, kind: LossKind, part: Element, message: str) -> None:
        """Note what became of an element."""
        about = f"{self.about}: " if self.about else ""
        self._found.append(
            Loss(kind, part.line, part.path, f"{about}{message}", column=part.column)
        )

    def append(self, loss: Loss) -> None:
        """Note what became of something that is no element any more."""
        self._found.append(loss)

    def ignore(self, part: Element, end: str = "") -> None:
        """Note that an element, or what its path is followed by, is not read."""
        if part.tag == "userData" and not end:
            # For the programs that wrote it, by the standard.
            return
        element = f"{part.path}{end}"
        if element not in self._counts:
            self._found.append(Loss("ignored", part.line, element, _NOT_READ, column=part.column))
        self._counts[element] = self._counts.get(element, 0) + 1

    def ignore_rest(self, part: Element) -> None:
        """Note of an element what nobody took out of it."""
        self.taken += 1
        for name, value in part.attributes.items():
            is_said = (part.tag, name) in _SILENT or (part.tag, name, value) in _IMPLIED
            if not is_said and not name.startswith(("xmlns", "xsi:")):
                self.ignore(part, f"@{name}")
        if part.text:
            self.ignore(part, " text")
        for tag, children in part.children.items():
            for child in children:
                if tag not in _EMPTY or child.attributes or child.children or child.text:
                    self.ignore(child)
        for child in part.taken:
            self.ignore_rest(child)


def require_none(losses: Losses, path: str) -> None:
    """Refuse a map of which anything was not taken as it is written.

    Raises:
        InputErrors: There is such a thing; each is told with its place.
    """
    errors = [
        SpecError(
            f"{loss.element}: {loss.message}" + f", {loss.count:,} times" * (loss.count > 1),
            where=SourceLocation(path, loss.line, loss.column),
        )
        for loss in losses
    ]
    if errors:
        listed = errors[:MOST_LISTED]
        raise InputErrors(listed, unlisted=len(errors) - len(listed))
