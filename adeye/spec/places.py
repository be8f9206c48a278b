"""Places of a scenario's maps: each gives a road, as if the scenario's file had written it.

What reads maps is imported when one is read: most scenarios have none.
"""

from __future__ import annotations

import gc
import hashlib
import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Self

from pydantic import Field

from adeye.errors import SourceLocation, SpecError, suggest
from adeye.identity import digest
from adeye.notices import notice
from adeye.spec.document import Loc, load_document, validate
from adeye.spec.quantity import Record
from adeye.spec.scenario import LogicalScenario
from adeye.units import shown

if TYPE_CHECKING:
    from adeye.maps.carriageway import Lanes
    from adeye.maps.losses import Losses
    from adeye.maps.opendrive import OpenDrive
    from adeye.maps.places import Asked, Candidates, Place

PLACE: Final = "place"
"""Name of the axis that takes places."""
ROAD: Final = ("world", "road")
"""What it writes into a scenario."""

RULES: Final = "rules.yaml"
"""File beside a map that says what it leaves to a guess."""

SOME_ROAD: Final[Mapping[str, object]] = {
    "length": "1000 m",
    "lanes": 1,
    "lane_width": "3.5 m",
    "shoulder": "0 m",
    "speed_limit": "50 km/h",
}
"""Stands for the road of a place until the places are known."""


class PlaceRoad(str):
    """The key of a place, which knows its road.

    Attributes:
        place: With the road that the map has there.
    """

    __slots__ = ("place",)
    place: Place

    def __new__(cls, place: Place) -> Self:
        """Make it from a place."""
        made = super().__new__(cls, place.key)
        made.place = place
        return made

    def __getnewargs__(self) -> tuple[Any, ...]:
        """Keep the place in a copy."""
        return (self.place,)

    @property
    def content(self) -> dict[str, Any]:
        """Of ``world.road``, as a file would write it."""
        return _road(self.place)


def place_of(scenario: LogicalScenario) -> str:
    """Return the key of the place that a scenario's road is at; empty without a map."""
    road = scenario.world.road
    return road.place if road.kind == "imported" else ""


def is_on_map(content: Any) -> bool:
    """Tell whether a scenario as written names a map instead of a road."""
    world = content.get("world") if isinstance(content, Mapping) else None
    return isinstance(world, Mapping) and "map" in world and "road" not in world


def map_files(scenario: LogicalScenario, locate: Callable[[Loc], SourceLocation]) -> list[Path]:
    """Return the maps of a scenario and the rules beside them.

    Args:
        scenario: Any.
        locate: Finds where a part of it was written, for a map lies beside that file.
    """
    maps = _maps(scenario, locate)
    beside = {path.parent / RULES for path in maps}
    return [*maps, *(rules for rules in sorted(beside) if rules.is_file())]


def map_notes(
    scenario: LogicalScenario, locate: Callable[[Loc], SourceLocation]
) -> dict[str, dict[str, int]]:
    """Count by map what was made of it: rules that are given, and elements by what became of them.

    A limit of speed that a lane lacks is guessed as well. Changes of it change no road.
    """
    return {path.name: _lanes(path, _state(path))[1] for path in _maps(scenario, locate)}


def _maps(scenario: LogicalScenario, locate: Callable[[Loc], SourceLocation]) -> list[Path]:
    named = scenario.world.map.files if scenario.world.map else ()
    folder = Path(locate(("world", "map", "file")).path).parent
    return [folder / name for name in named]


class Offer:
    """The places of a scenario's maps, in the order of the maps, and in each of roads and places.

    Each is looked at when it is asked for: a large map has many of which few are taken.

    Args:
        scenario: One on a map.
        locate: Finds where a part of it was written.

    Attributes:
        lacking: How many of those that were looked at are no places, by reason.

    Raises:
        SpecError: A map cannot be read, two have one name, or no place is asked for.
    """

    def __init__(self, scenario: LogicalScenario, locate: Callable[[Loc], SourceLocation]) -> None:
        from adeye.maps.places import Asked

        query = scenario.world.place
        if query is None:
            raise SpecError(
                "world.map: no place of the map is asked for",
                where=locate(("world", "map")),
                remedy="Write world.place with an anchor and how far the road goes behind it.",
            )
        asked, files = Asked(**query.model_dump()), _maps(scenario, locate)
        if len({path.stem for path in files}) < len(files):
            raise SpecError(
                "world.map: two maps have one name, so their places would have one key",
                where=locate(("world", "map")),
                remedy="Name their files differently.",
            )
        maps = [_candidates(path, asked) for path in files]
        self._spots = [
            (key, candidates, number)
            for candidates in maps
            for number, key in enumerate(candidates.keys)
        ]
        self.lacking = Counter[str]()

    def __iter__(self) -> Iterator[PlaceRoad]:
        """Look at one after the other."""
        self.lacking.clear()
        yield from self._look(range(len(self._spots)))

    def _look(self, order: Iterable[int]) -> Iterator[PlaceRoad]:
        for index in order:
            _, candidates, number = self._spots[index]
            with _kept():
                found = candidates.look(number)
            if isinstance(found, str):
                self.lacking[found] += 1
            else:
                yield PlaceRoad(found)

    def named(self, key: str) -> list[PlaceRoad]:
        """List the places that have a key: one, or none."""
        return list(self._look(i for i, item in enumerate(self._spots) if item[0] == key))

    def has(self, name: str) -> bool:
        """Tell whether there is a place on the map of this name."""
        on_map = (i for i, (key, *_) in enumerate(self._spots) if key.partition(":")[0] == name)
        return next(self._look(on_map), None) is not None

    def drawn(self, count: int, seed: int) -> list[PlaceRoad]:
        """Draw some, or all if they are fewer: the same ones whatever others there are."""
        order = sorted(
            range(len(self._spots)), key=lambda index: digest([seed, self._spots[index][0]])
        )
        taken = {str(place): place for place in islice(self._look(order), count)}
        return [taken[key] for key, *_ in self._spots if key in taken]

    def lack(self) -> str:
        """Say what all lack that were looked at."""
        looked = [f"{count:,} {reason}" for reason, count in sorted(self.lacking.items())]
        return ", ".join(looked) or "it has none"


def _road(place: Place) -> dict[str, Any]:
    """Write the road of a place as a file would."""
    laid = place.road
    road = {
        "kind": "imported",
        "place": place.key,
        "heading": laid.heading,
        "line": [list(piece) for piece in laid.line],
        "slabs": [[s, [list(strip) for strip in strips]] for s, strips in laid.slabs],
        "grades": [list(item) for item in laid.grades],
        "length": f"{math.fsum(length for length, _ in laid.line)!r} m",
        "lanes": place.lanes,
        "lane_width": f"{place.lane_width!r} m",
        "shoulder": f"{place.shoulder!r} m",
        "speed_limit": f"{place.speed_limit!r} m/s",
        "road_type": place.road_type,
    }
    if place.left_hand:
        road["traffic"] = "left"
    if place.radius < float("inf"):
        road["radius"] = f"{place.radius!r} m"
    return road


def first_place(scenario: LogicalScenario, locate: Callable[[Loc], SourceLocation]) -> PlaceRoad:
    """Return the first place of a scenario on a map; arguments and errors as of ``Offer``.

    Raises:
        SpecError: There is none.
    """
    offer = Offer(scenario, locate)
    for place in offer:
        return place
    raise SpecError(
        f"world.place: no place of the map has what is asked: {offer.lack()}",
        where=locate(("world", "place")),
        remedy="Ask for less, or take another map; adeye map show tells what one has.",
    )


def choose_places(offer: Offer, choice: str | Sequence[object]) -> tuple[PlaceRoad, ...]:
    """Choose among the places of a scenario.

    Args:
        offer: Those that it has.
        choice: ``all``, ``first N``, ``sample N seed K``, or keys.

    Returns:
        In the order of the places; of keys, in theirs. A sample is the same whatever other places
        there are, but for those that take the place of others in it.

    Raises:
        SpecError: There are fewer, there is none of such a key, or several.
    """
    if isinstance(choice, str):
        what, *numbers = choice.split()
        if what == "sample":
            chosen = offer.drawn(int(numbers[0]), int(numbers[2]))
        else:
            chosen = list(islice(offer, int(numbers[0]) if numbers else None))
        if numbers and len(chosen) < int(numbers[0]):
            raise SpecError(
                f"{choice}: the scenario has {len(chosen):,} places",
                remedy="Take fewer, or ask the map for less.",
            )
    else:
        chosen = [place for key in choice for place in offer.named(str(key))]
        for key in choice:
            if key not in chosen:
                known = list(offer)
                raise SpecError(
                    f"there is no place {shown(key)} among the {len(known):,} of the scenario",
                    remedy=suggest(str(key), known),
                )
    require_posted(chosen)
    guessed = Counter(
        str(key).partition(":")[0]
        for key in chosen
        if key.place.is_guessed or key.place.is_type_guessed
    )
    for name, count in guessed.items():
        told = (
            f"{name}: {count:,} places lack a speed limit or the type of their road; "
            "the usual one is taken"
        )
        notice(told, topic=told, every_s=math.inf)
    return tuple(chosen)


def require_posted(places: Iterable[PlaceRoad], where: SourceLocation | None = None) -> None:
    """Refuse to drive where a map has a speed limit that nobody posts.

    Args:
        places: Where somebody drives.
        where: What asks for them.

    Raises:
        SpecError: It has one.
    """
    from adeye.maps.opendrive import FASTEST_POSTED

    for key in places:
        if key.place.fastest > FASTEST_POSTED:
            raise SpecError(
                f"place {key} has a speed limit of {3.6 * key.place.fastest:.0f} km/h, above any "
                "that is posted: one without a unit is in m/s",
                where=where,
                remedy="Write its unit in the map, or ask for less by max_speed_limit.",
            )


# --- Maps, and what people say of one where its file leaves it to a guess: ``rules.yaml`` --------

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

    maps: Annotated[dict[str, MapRules], Field(min_length=1)]


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
    from adeye.maps.opendrive_reader import LANE_TYPES, read_opendrive

    beside = path.parent / RULES
    # What has that name and is no file is refused where it is read.
    rules = Rules(beside, path.name, LANE_TYPES) if os.path.lexists(beside) else None
    drive, losses = read_opendrive(path, rules, strict=strict)
    losses.given = rules.count if rules else 0
    return drive, losses


def _candidates(path: Path, asked: Asked) -> Candidates:
    """Find where a map has an anchor, once for each state of its files.

    Raises:
        SpecError: The map or its rules cannot be read.
    """
    with _kept():
        return _candidates_in(path, _state(path), asked)


def _state(path: Path) -> tuple[str, str]:
    """Return what tells whether a map or the rules beside it are others: times and sizes do not."""

    def told(file: Path) -> str:
        try:
            return hashlib.sha256(file.read_bytes()).hexdigest()
        except OSError:
            return ""

    return told(path), told(path.parent / RULES)


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
def _candidates_in(path: Path, state: object, asked: Asked) -> Candidates:
    from adeye.maps.places import candidates_of

    return candidates_of(_lanes(path, state)[0], path.stem, asked)


@lru_cache(maxsize=4)
def _lanes(path: Path, state: object) -> tuple[Lanes, dict[str, int]]:  # noqa: ARG001 - of the files
    from adeye.maps.carriageway import Lanes

    drive, losses = read_map(path)
    lanes, counts = Lanes.of(drive), {"given": losses.given, **losses.counts()}
    own = [row for rows in lanes.own.values() for row in rows]
    counts["guessed"] += sum(not math.isfinite(lanes.graph.limit[row]) for row in own)
    return lanes, counts


class Rules:
    """The rules of a map, which all have to be of use.

    Args:
        path: Of the file.
        name: Of the map.
        types: Of lanes that are known.

    Attributes:
        count: How many there are.

    Raises:
        SpecError: The file cannot be read, or says what it cannot.
    """

    def __init__(self, path: Path, name: str, types: frozenset[str]) -> None:
        self._name = name
        self._document = load_document(path)
        maps = validate(self._document, RulesFile).maps
        for other in maps:
            if Path(other).name != other:
                raise SpecError(
                    f"maps: {shown(other)} is a path",
                    where=self._document.locate_key(("maps", other)),
                    remedy=f"Rules are for maps beside them: write {Path(other).name!r}.",
                )
            if not (path.parent / other).is_file():
                raise SpecError(
                    f"maps: there is no map {shown(other)} beside these rules",
                    where=self._document.locate_key(("maps", other)),
                    remedy=suggest(other, [item.name for item in path.parent.glob("*.xodr")]),
                )
        self._rules = maps.get(self._name, MapRules())
        self._unused = {("lane_types", key) for key in self._rules.lane_types}
        self._unused |= {("lanes", key) for key in self._rules.lanes}
        self.count = len(self._unused)
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
