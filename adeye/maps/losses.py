"""What an import did not take as it was written: a report by line of the source."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal

from adeye.maps.xml_source import Element

LossKind = Literal["approximated", "repaired", "guessed", "ignored"]

_NOT_READ: Final = "is not read"


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
    """

    kind: LossKind
    line: int
    element: str
    message: str
    count: int = 1


class Losses:
    """The losses of an import, in the order in which they were met."""

    def __init__(self) -> None:
        self._found: list[Loss] = []
        self._ignored: dict[str, int] = {}

    def __iter__(self) -> Iterator[Loss]:
        """Give them one after the other."""
        return iter(self._found)

    def __len__(self) -> int:
        """Count them; what is not read at all counts once for each kind of it."""
        return len(self._found)

    def add(self, kind: LossKind, part: Element, message: str) -> None:
        """Note what became of an element."""
        self._found.append(Loss(kind, part.line, part.path, message))

    def ignore(self, element: str, line: int) -> None:
        """Note that an element or attribute is not read."""
        known = self._ignored.get(element)
        if known is None:
            self._ignored[element] = len(self._found)
            self._found.append(Loss("ignored", line, element, _NOT_READ))
        else:
            loss = self._found[known]
            self._found[known] = replace(loss, count=loss.count + 1)

    def ignore_rest(self, part: Element) -> None:
        """Note of an element what nobody took out of it."""
        for name in part.attributes:
            self.ignore(f"{part.path}@{name}", part.line)
        for tag, children in part.children.items():
            for child in children:
                self.ignore(f"{part.path}.{tag}", child.line)
        for child in part.taken:
            self.ignore_rest(child)
