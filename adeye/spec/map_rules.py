"""What people say of a map where its file leaves it to a guess: ``rules.yaml`` beside the map."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Annotated

from pydantic import Field

from adeye.errors import SpecError
from adeye.maps.carriageway import Lanes
from adeye.maps.losses import Losses
from adeye.maps.opendrive import OpenDrive
from adeye.maps.opendrive_reader import LANE_TYPES, read_opendrive
from adeye.maps.places import Asked, Places, places_of
from adeye.spec.document import load_document, validate
from adeye.spec.places import RULES
from adeye.spec.quantity import Record

Pair = Annotated[list[int], Field(min_length=2, max_length=2)]


class MapRules(Record):
    """The rules of one map.

    Attributes:
        lane_types: By a type of lanes that the file uses, the one of the standard that is meant.
        lanes: By ``JUNCTION/CONNECTION`` the lanes of a connection that names none: [from, to].
    """

    lane_types: dict[str, str] = Field(default_factory=dict)
    lanes: dict[str, list[Pair]] = Field(default_factory=dict)


class RulesFile(Record):
    """A file of rules.

    Attributes:
        maps: By the name of the map's file, which lies beside.
    """

    maps: dict[str, MapRules]


def read_map(path: Path, *, strict: bool = False) -> tuple[OpenDrive, Losses]:
    """Read a map with the rules beside it.

    Args:
        path: Of the map.
        strict: Whether anything that is not taken as it is written is an error.

    Returns:
        As ``read_opendrive``.

    Raises:
        SpecError: The map or its rules cannot be read.
        InputErrors: Something is not taken as it is written, and that was asked for.
    """
    beside = path.with_name(RULES)
    rules = Rules(beside, path.name, LANE_TYPES) if beside.is_file() else None
    return read_opendrive(path, rules, strict=strict)


def read_places(path: Path, asked: Asked) -> Places:
    """Find the places of a map that have what is asked, once for each state of its files.

    Raises:
        SpecError: The map or its rules cannot be read.
    """
    files = [item for item in (path, path.with_name(RULES)) if item.is_file()]
    states = [item.stat() for item in files]
    with _kept():
        return _found(path, tuple((state.st_mtime_ns, state.st_size) for state in states), asked)


@contextmanager
def _kept() -> Iterator[None]:
    """Look for no garbage: a map's many records are none, and looking takes a third longer."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@lru_cache(maxsize=64)
def _found(path: Path, state: object, asked: Asked) -> Places:
    return places_of(_lanes(path, state), path.stem, asked)


@lru_cache(maxsize=4)
def _lanes(path: Path, state: object) -> Lanes:  # noqa: ARG001 - of the files
    return Lanes.of(read_map(path)[0])


class Rules:
    """The rules of a map, which all have to be of use.

    Args:
        path: Of the file.
        name: Of the map.
        types: Of lanes that are known.

    Raises:
        SpecError: The file cannot be read, or says what it cannot.
    """

    def __init__(self, path: Path, name: str, types: frozenset[str]) -> None:
        self._name = name
        self._document = load_document(path)
        self._rules = validate(self._document, RulesFile).maps.get(self._name, MapRules())
        self._unused = {("lane_types", key) for key in self._rules.lane_types}
        self._unused |= {("lanes", key) for key in self._rules.lanes}
        for key, kind in self._rules.lane_types.items():
            if kind not in types:
                raise self._error("lane_types", key, f"{kind!r} is no type of lanes")

    def lane_type(self, written: str) -> str:
        """Return which type of lanes is meant."""
        self._unused.discard(("lane_types", written))
        return self._rules.lane_types.get(written, written)

    def lanes(self, junction: str, connection: str) -> Sequence[tuple[int, int]]:
        """Return the lanes of a connection that names none, as far as they are given."""
        key = f"{junction}/{connection}"
        self._unused.discard(("lanes", key))
        return [(first, last) for first, last in self._rules.lanes.get(key, ())]

    def require_used(self) -> None:
        """Refuse rules of what the map does not leave to a guess.

        Raises:
            SpecError: There is one.
        """
        for section, key in sorted(self._unused):
            raise self._error(section, key, "the map leaves nothing of that name to a guess")

    def _error(self, section: str, key: str, message: str) -> SpecError:
        where = self._document.locate_key(("maps", self._name, section, key))
        return SpecError(f"{section}: {key!r}: {message}", where=where, remedy="Correct it.")
