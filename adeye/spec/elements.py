"""Elements of the preliminary architectural assumptions (PAA), and what they depend on.

An element depends on its resources, its software and its supplier, on every element that provides
what it consumes, and on all that those depend on. The store follows these relations to see whether
two elements are independent.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import ClassVar, Final, Literal

from adeye.spec.asil import Asil
from adeye.spec.misplaced import Loc
from adeye.spec.quantity import GrownRecord, Identifier, Many, Text

ElementKind = Literal[
    "sensor",
    "perception",
    "planner",
    "arbiter",
    "actuator",
    "network",
    "compute",
    "power",
    "human",
    "external",
    "other",
]


class Element(GrownRecord):
    """An element of the preliminary architectural assumptions (PAA)."""

    later: ClassVar[tuple[str, ...]] = ("supplier", "software", "provides", "consumes")

    id: Identifier
    kind: ElementKind
    text: Text
    asil_capability: Asil
    legacy: bool = False
    resources: Many[str] = ()
    """Power, computers, clocks, buses, mountings; one that is an element has its own."""
    supplier: Text | None = None
    software: Many[Text] = ()
    """Code that it is made of and others may be made of, too: libraries, compilers, models."""
    provides: Many[Text] = ()
    consumes: Many[Text] = ()
    """What it needs of what others provide."""

    @property
    def relations(self) -> tuple[tuple[str, str], ...]:
        """What it has and needs, as kind and name, each once."""
        found = [("supplier", self.supplier)] if self.supplier else []
        for kind, names in (
            ("resource", self.resources),
            ("software", self.software),
            ("provides", self.provides),
            ("consumes", self.consumes),
        ):
            found += [(kind, name) for name in names]
        return tuple(dict.fromkeys(found))


CAUSES: Final = ("resource", "software", "supplier")
"""Kinds of relations to something that can fail, or be wrong, for several elements at once."""


def causes(elements: Iterable[Element]) -> tuple[str, ...]:
    """List what several elements can fail by: themselves, resources, software and suppliers."""
    found: dict[str, None] = {}
    for element in elements:
        found[element.id] = None
        found |= {name: None for kind, name in element.relations if kind in CAUSES}
    return tuple(found)


def unprovided(elements: Iterable[Element]) -> Iterator[tuple[Loc, str]]:
    """Find what is consumed and provided by nobody.

    Args:
        elements: All of a concept.

    Yields:
        Place below the concept, and what is wrong.
    """
    known = tuple(elements)
    provided = sorted({name for element in known for name in element.provides})
    for number, element in enumerate(known):
        for at, name in enumerate(element.consumes):
            if name not in provided:
                allowed = f"Provided are {', '.join(provided)}" if provided else "Nothing is"
                yield (
                    ("elements", number, "consumes", at),
                    f"nobody provides {name!r}. {allowed}",
                )
