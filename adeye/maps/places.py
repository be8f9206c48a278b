"""Places of a map: where a scenario can take place, and the road that it has there.

A place is a point of a carriageway with a direction of travel. Its road is what a run there depends
on: the right edge of the rightmost lane as a chain of straight and circular pieces, and the lanes
beside it. It may lead over several roads of the map. For now the lanes are parallel and of one
width all along; a place where they are not has no road, and the reason is counted.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.errors import SpecError
from adeye.maps import arcs, lanes
from adeye.maps.lanes import LaidRoad, Strip
from adeye.maps.opendrive import OpenDrive, Road
from adeye.maps.opendrive_reader import read_opendrive

Floats = NDArray[np.float64]

EVERY: Final = 50.0
"""Between two places of a carriageway [m]."""
SAMPLE: Final = 2.0
"""Between two samples of what a carriageway has [m]."""
ONE_WIDTH: Final = 0.05
"""Lanes whose widths differ by no more than this are parallel lanes of one width [m]. Our
choice."""
GAP: Final = 0.05
"""Between the ends of two roads that are one way [m]."""
KINK: Final = 0.01
"""Between their headings [rad]."""
APART: Final = 40.0
"""Where the way comes nearer than this to itself after more than twice as much of it, places beside
it would be ambiguous [m]."""

_TYPES: Final = {
    "motorway": "motorway",
    "rural": "rural",
    "town": "urban",
    "townExpressway": "urban",
    "townCollector": "urban",
    "townArterial": "urban",
    "townPrivate": "urban",
    "townLocal": "urban",
    "townPlayStreet": "urban",
    "lowSpeed": "urban",
}
_USUAL: Final = {"motorway": 130.0 / 3.6, "rural": 100.0 / 3.6, "urban": 50.0 / 3.6}
"""Speed limit where the map has none, by the type of the road [m/s]: those of Germany's roads
(StVO, section 3; 130 km/h is recommended there, not a limit). A guess."""
_UNKNOWN: Final = "rural"
"""Type of a road where the map has none. A guess."""
_SHOULDERS: Final = frozenset({"shoulder", "stop"})


class Asked(NamedTuple):
    """What a place must have, along the whole road; None for anything.

    Attributes:
        before: How far its road begins before it [m].
        after: How far behind it its road ends [m].
        lanes: In the direction of travel.
        road_type: ``motorway``, ``rural`` or ``urban``.
        min_radius: No bend is narrower [m].
        max_radius: Some bend is not wider [m].
        min_speed_limit: [m/s].
        max_speed_limit: [m/s].
    """

    before: float
    after: float
    lanes: int | None = None
    road_type: str | None = None
    min_radius: float | None = None
    max_radius: float | None = None
    min_speed_limit: float | None = None
    max_speed_limit: float | None = None


@dataclass(frozen=True, slots=True)
class _Profile:
    """What a road has for who drives along it one way, at places (N,) in the order of the drive."""

    laid: LaidRoad
    way: int
    s: Floats
    count: NDArray[np.int64]
    width: Floats
    spread: Floats
    shoulder: Floats
    limit: Floats
    is_guessed: NDArray[np.bool_]
    type: NDArray[np.str_]
    curvature: Floats
    edges: tuple[tuple[float, float, Floats], ...]
    """Of each section, in the order of the map: its begin, its end and the right edge's line."""


class _Stretch(NamedTuple):
    """A part of a road, in the direction of travel: from one place to another [m]."""

    profile: _Profile
    first: float
    last: float


@dataclass(frozen=True)
class Place:
    """A place and its road.

    Attributes:
        key: Map, road, direction along (+) or against (-) its s, and place on it in metres.
        lanes: In the direction of travel.
        lane_width: [m].
        shoulder: Width of the hard shoulder [m], 0 for none.
        speed_limit: The lowest along the road [m/s].
        is_guessed: Whether the map has no speed limit there.
        road_type: ``motorway``, ``rural`` or ``urban``.
        radius: Of the narrowest bend of the right edge [m], infinite on a straight.
        stretches: The parts of roads that it leads over.
    """

    key: str
    lanes: int
    lane_width: float
    shoulder: float
    speed_limit: float
    is_guessed: bool
    road_type: str
    radius: float
    stretches: tuple[_Stretch, ...]

    @cached_property
    def heading(self) -> float:
        """That of the right edge where the road begins, in the map [rad]."""
        return self._fit[0]

    @cached_property
    def line(self) -> tuple[tuple[float, float], ...]:
        """Length [m] and curvature [1/m] of each piece of the right edge."""
        return self._fit[1]

    @cached_property
    def length(self) -> float:
        """Of the right edge [m]."""
        return math.fsum(length for length, _ in self.line)

    @cached_property
    def _fit(self) -> tuple[float, tuple[tuple[float, float], ...]]:
        heading, pieces = math.nan, []
        for stretch in self.stretches:
            for low, high, edge in _edges(stretch):
                ends = (low, high) if stretch.profile.way > 0 else (high, low)
                laid = stretch.profile.laid
                rows = arcs.course_arcs(arcs.Course(laid.pieces, edge, laid.scratch, *ends))
                heading = float(rows[0, arcs.ARC_HEADING]) if math.isnan(heading) else heading
                pieces += [(float(row[arcs.LENGTH]), float(row[arcs.BEND])) for row in rows]
        return heading, tuple(pieces)


class Places(NamedTuple):
    """Places that have what was asked, and how many do not, by reason."""

    places: tuple[Place, ...]
    refused: Mapping[str, int]


@lru_cache(maxsize=64)
def _read(path: Path, changed: int, size: int) -> OpenDrive:  # noqa: ARG001 - the state of the file
    return read_opendrive(path)[0]


@lru_cache(maxsize=64)
def _profiles(path: Path, changed: int, size: int) -> Mapping[tuple[str, int], _Profile]:
    """Return what each road of a map has, by its id and the direction of travel."""
    found: dict[tuple[str, int], _Profile] = {}
    for road in _read(path, changed, size).roads.values():
        laid = lanes.laid(road)
        for way in (1, -1):
            profile = _profile(laid, way)
            if profile is not None:
                found[road.id, way] = profile
    return found


def places_of(path: Path, asked: Asked) -> Places:
    """Find the places of a map that have what is asked.

    Args:
        path: Of the map.
        asked: What a place must have.

    Returns:
        In the order of the roads' ids as texts, along before against their s, and of the places.

    Raises:
        SpecError: The map cannot be read.
    """
    if not path.is_file():
        raise SpecError(f"there is no map {path}", remedy="Name a file beside the scenario's.")
    state = path.stat()
    profiles = _profiles(path, state.st_mtime_ns, state.st_size)
    found: list[Place] = []
    refused: Counter[str] = Counter()
    for road, way in sorted(profiles, key=lambda item: (item[0], -item[1])):
        length = profiles[road, way].laid.road.length
        for number in range(math.floor(length / EVERY) + 1):
            at = number * EVERY
            key = f"{path.stem}:{road}{'+' if way > 0 else '-'}{at:.0f}"
            place = _place(profiles, (road, way), at, asked, key)
            if isinstance(place, Place):
                found.append(place)
            else:
                refused[place] += 1
    return Places(tuple(found), refused)


def _profile(laid: LaidRoad, way: int) -> _Profile | None:
    """Return what a road has for one direction; None if nobody drives that way on it."""
    road = laid.road
    if road.junction:
        return None
    s = np.unique(np.append(np.arange(0.0, road.length, SAMPLE), road.length))
    starts = np.array([section.s for section in road.sections])
    numbers = np.maximum(np.searchsorted(starts, s, side="right") - 1, 0)
    count = np.zeros(len(s), dtype=np.int64)
    width, spread, shoulder, limit, curvature = (np.full(len(s), np.nan) for _ in range(5))
    edges: list[tuple[float, float, Floats]] = []
    for number, strips in enumerate(laid.strips):
        here = np.flatnonzero(numbers == number)
        driven = _driven(strips, way)
        edge = lanes.REFERENCE
        if driven:
            edge = _right(driven[0], way)
        edges.append((road.sections[number].s, lanes.section_end(road, number), edge))
        if not (driven and len(here)):
            continue
        widths = np.array([lanes.width_at(strip, s[here]) for strip in driven])
        count[here] = len(driven)
        width[here] = widths.mean(axis=0)
        spread[here] = widths.max(axis=0) - widths.min(axis=0)
        beside = [strip for strip in strips if _is_beside(strip, driven[0], strips, way)]
        shoulder[here] = lanes.width_at(beside[0], s[here]) if beside else 0.0
        limit[here] = _limits(driven, s[here])
        curvature[here] = way * lanes.along(laid, edge, s[here]).curvature
    if not count.any():
        return None
    kinds = _kinds(road, s)
    is_guessed = np.isnan(limit)
    given = _road_limits(road, s)
    limit = np.where(is_guessed, given, limit)
    is_guessed = np.isnan(limit)
    limit = np.where(is_guessed, [_USUAL[kind] for kind in kinds.tolist()], limit)
    order = slice(None) if way > 0 else slice(None, None, -1)
    columns = (s, count, width, spread, shoulder, limit, is_guessed, kinds, curvature)
    return _Profile(laid, way, *(column[order] for column in columns), tuple(edges))


def _driven(strips: tuple[Strip, ...], way: int) -> tuple[Strip, ...]:
    """Return the lanes that traffic drives one way in, from its right."""
    found = [strip for strip in strips if strip.way == way and strip.lane.type == "driving"]
    # From left to right along s.
    return tuple(reversed(found)) if way > 0 else tuple(found)


def _right(strip: Strip, way: int) -> Floats:
    """Return the line of a lane's edge to the right of who drives in it."""
    is_outer = (strip.lane.id < 0) == (way > 0)
    return strip.outer if is_outer else strip.inner


def _is_beside(strip: Strip, rightmost: Strip, strips: tuple[Strip, ...], way: int) -> bool:
    """Tell whether a strip is the shoulder to the right of the rightmost lane."""
    at = strips.index(rightmost) + way
    return 0 <= at < len(strips) and strips[at] is strip and strip.lane.type in _SHOULDERS


def _limits(driven: tuple[Strip, ...], s: Floats) -> Floats:
    """Return the lowest limit that lanes have (N,) [m/s], NaN where none has one."""
    found = np.full(len(s), np.inf)
    for strip in driven:
        for speed in strip.lane.speeds:
            later = s >= strip.start + speed.s
            found = np.where(later, np.minimum(found, speed.limit), found)
    return np.where(np.isfinite(found), found, np.nan)


def _kinds(road: Road, s: Floats) -> NDArray[np.str_]:
    kinds = np.full(len(s), _UNKNOWN, dtype="<U8")
    for item in road.types:
        kinds[s >= item.s] = _TYPES.get(item.type, _UNKNOWN)
    return kinds


def _road_limits(road: Road, s: Floats) -> Floats:
    limits = np.full(len(s), np.nan)
    for item in road.types:
        limits[s >= item.s] = item.limit
    return np.where(np.isfinite(limits), limits, np.nan)


def _place(
    profiles: Mapping[tuple[str, int], _Profile],
    road: tuple[str, int],
    at: float,
    asked: Asked,
    key: str,
) -> Place | str:
    """Return a place with its road, or why it has none."""
    if profiles[road].laid.road.left_hand:
        return "in left-hand traffic"
    behind = _walk(profiles, road, at, asked.before, -1)
    ahead = _walk(profiles, road, at, asked.after, 1)
    if behind is None or ahead is None:
        return "too near to the end of the way or to a junction"
    stretches = _joined([*reversed(behind), *ahead])
    has = [_within(stretch) for stretch in stretches]

    def every(name: str) -> NDArray[np.generic]:
        parts = zip(stretches, has, strict=True)
        column: NDArray[np.generic]
        column = np.concatenate([getattr(stretch.profile, name)[rows] for stretch, rows in parts])
        return column

    counts, widths = every("count"), np.asarray(every("width"), dtype=np.float64)
    if counts.min() != counts.max() or not counts.min() > 0:
        return "where the number of lanes changes"
    spread = max(float(np.max(every("spread"))), float(widths.max() - widths.min()))
    if not spread <= ONE_WIDTH:
        return "where lanes are of several widths"
    types = set(every("type").tolist())
    limits = np.asarray(every("limit"), dtype=np.float64)
    bend = float(np.max(np.abs(np.asarray(every("curvature"), dtype=np.float64))))
    radius = 1.0 / bend if bend > 1e-9 else math.inf
    reason = _refusal(asked, int(counts[0]), types, radius, limits)
    if reason:
        return reason
    if not _is_smooth(stretches):
        return "where roads do not meet, or with a kink"
    if _is_near_itself(stretches):
        return "where the way comes near itself"
    return Place(
        key,
        int(counts[0]),
        float(widths.mean()),
        max(0.0, float(np.min(every("shoulder")))),
        float(limits.min()),
        bool(every("is_guessed").any()),
        min(types),
        radius,
        tuple(stretches),
    )


def _refusal(asked: Asked, count: int, types: set[str], radius: float, limits: Floats) -> str:
    """Say what a place lacks of what is asked; empty for nothing."""
    for is_met, reason in (
        (asked.lanes in {None, count}, "with another number of lanes"),
        (asked.road_type is None or types == {asked.road_type}, "on a road of another type"),
        (asked.min_radius is None or radius >= asked.min_radius, "with a narrower bend"),
        (asked.max_radius is None or radius <= asked.max_radius, "without such a bend"),
        (
            asked.min_speed_limit is None or float(limits.min()) >= asked.min_speed_limit,
            "with a lower speed limit",
        ),
        (
            asked.max_speed_limit is None or float(limits.max()) <= asked.max_speed_limit,
            "with a higher speed limit",
        ),
    ):
        if not is_met:
            return reason
    return ""


def _walk(
    profiles: Mapping[tuple[str, int], _Profile],
    road: tuple[str, int],
    at: float,
    far: float,
    sense: int,
) -> list[_Stretch] | None:
    """Go along the way (1) or back (-1) from a place; None if it ends before.

    Returns:
        The parts of roads in the order of the walk, each in the direction of travel.
    """
    found: list[_Stretch] = []
    while far > 0.0 or not found:
        profile = profiles.get(road)
        if profile is None or len(found) > 1_000:
            return None
        length = profile.laid.road.length
        # Along the road's own s if the way and the walk have one sense.
        along = profile.way * sense
        room = length - at if along > 0 else at
        step = min(far, room)
        end = at + along * step
        found.append(_Stretch(profile, at, end) if sense > 0 else _Stretch(profile, end, at))
        far -= step
        if far <= 1e-9:
            break
        following = _next(profile.laid.road, along)
        if following is None:
            return None
        other, is_start = following
        # Entering at its start one goes along its s.
        own = 1 if is_start else -1
        road = (other, own * sense)
        if road not in profiles:
            return None
        at = 0.0 if is_start else profiles[road].laid.road.length
    return found


def _next(road: Road, along: int) -> tuple[str, bool] | None:
    """Return the road that one ends at, and whether at its start; None for none or a junction."""
    link = road.successor if along > 0 else road.predecessor
    if link is None or link.element != "road":
        return None
    return link.id, link.contact == "start"


def _joined(stretches: list[_Stretch]) -> list[_Stretch]:
    """Join what lies on one road, and drop what has no length."""
    found: list[_Stretch] = []
    for stretch in stretches:
        if found and found[-1].profile is stretch.profile and found[-1].last == stretch.first:
            found[-1] = _Stretch(stretch.profile, found[-1].first, stretch.last)
        else:
            found.append(stretch)
    return [item for item in found if item.first != item.last]


def _within(stretch: _Stretch) -> NDArray[np.intp]:
    """Return the samples of a stretch, those just outside included."""
    low, high = sorted((stretch.first, stretch.last))
    s = stretch.profile.s
    return np.flatnonzero((s > low - SAMPLE) & (s < high + SAMPLE))


def _edges(stretch: _Stretch) -> Iterator[tuple[float, float, Floats]]:
    """Yield the parts of the right edge in the direction of travel: first s, last s, line."""
    low, high = sorted((stretch.first, stretch.last))
    parts = [
        (max(low, start), min(high, end), edge)
        for start, end, edge in stretch.profile.edges
        if min(high, end) - max(low, start) > 1e-6
    ]
    yield from parts if stretch.profile.way > 0 else reversed(parts)


def _line_places(stretches: list[_Stretch], step: float) -> Floats:
    """Return x, y and heading in the direction of travel of each part's places, (N, 4).

    The fourth column is the number of the part.
    """
    found = []
    number = 0
    for stretch in stretches:
        way = stretch.profile.way
        for low, high, edge in _edges(stretch):
            s = np.linspace(low, high, max(2, math.ceil((high - low) / step) + 1))
            line = lanes.along(stretch.profile.laid, edge, s if way > 0 else s[::-1])
            heading = line.heading if way > 0 else line.heading + np.pi
            found.append(np.column_stack([line.x, line.y, heading, np.full(len(s), number)]))
            number += 1
    return np.concatenate(found)


def _is_smooth(stretches: list[_Stretch]) -> bool:
    """Tell whether the parts of the right edge meet, and without a kink."""
    places = _line_places(stretches, math.inf)
    before, after = places[1:-1:2], places[2::2]
    gaps = np.hypot(after[:, 0] - before[:, 0], after[:, 1] - before[:, 1])
    turns = np.abs(np.remainder(after[:, 2] - before[:, 2] + np.pi, 2.0 * np.pi) - np.pi)
    return bool((gaps <= GAP).all() and (turns <= KINK).all())


def _is_near_itself(stretches: list[_Stretch]) -> bool:
    """Tell whether the way comes near itself."""
    places = _line_places(stretches, 10.0)
    steps = np.hypot(np.diff(places[:, 0]), np.diff(places[:, 1]))
    way = np.concatenate([[0.0], np.cumsum(steps)])
    apart = np.hypot(
        places[:, 0, None] - places[None, :, 0], places[:, 1, None] - places[None, :, 1]
    )
    is_far = np.abs(way[:, None] - way[None, :]) > 2.0 * APART
    return bool((is_far & (apart < APART)).any())
