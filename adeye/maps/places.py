"""Places of a map: where a scenario can take place, and the road that it has there.

A place is a point of a carriageway with a direction of travel, such as where a ramp comes in. Its
road is what a run there depends on, and may lead over several roads of the map: a line of straight
and circular pieces, the right edge of a lane that goes on all along, and the lanes beside it. A
place that a run cannot be driven at has no road, and the reason is counted.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal, NamedTuple

import numpy as np

from adeye.kernel import strips as across
from adeye.maps import network
from adeye.maps.carriageway import Cut, Lanes, Piece, Section, Slab, steps_of
from adeye.maps.opendrive import STEEPEST

Anchor = Literal["carriageway", "entry", "exit", "lane_begin", "lane_end", "work_zone"]
"""What is at a place: a point of a carriageway, where the lane of a ramp comes in or leaves, where
a lane begins or ends beside others, and where one is closed for works."""
Route = Literal["entry", "exit"]
"""A road that begins on the ramp that comes in, or ends on the one that leaves."""

EVERY: Final = 50.0
"""Between two places of a carriageway [m]."""
GAP: Final = 0.05
"""Between the ends of two roads that are one way [m]."""
KINK: Final = 0.01
"""Between their headings [rad]."""
APART: Final = 40.0
"""Where the way comes nearer than this to itself after more than twice as much of it, places beside
it would be ambiguous [m]."""
MOST: Final = 1_000
"""Cross-sections that a road leads over."""
STRAIGHT: Final = 1e5
"""A road whose bends are all wider than this is straight [m]: where a spiral begins, a piece of it
bends by next to nothing, and no scenario may say so wide a radius."""

_TYPES: Final = {
    "motorway": "motorway",
    "rural": "rural",
    **dict.fromkeys(("town", "townExpressway", "townCollector", "townArterial"), "urban"),
    **dict.fromkeys(("townPrivate", "townLocal", "townPlayStreet", "lowSpeed"), "urban"),
    **{name: name for name in ("pedestrian", "bicycle")},
}
_USUAL: Final = {"motorway": 130.0 / 3.6, "rural": 100.0 / 3.6, "urban": 50.0 / 3.6}
"""Speed limit where the map has none, by the type of the road [m/s]. A guess, after the usual ones
of Germany."""
_UNKNOWN: Final = "rural"
"""Type of a road where the map has none. A guess."""


class Asked(NamedTuple):
    """What a place must have; None for anything.

    Attributes:
        anchor: What is there.
        before: How far its road begins before it [m].
        after: How far behind it its road ends [m].
        lanes: In the direction of travel, at the place.
        two_way: Whether traffic comes towards one right beside.
        road_type: ``motorway``, ``rural`` or ``urban``, at the place.
        min_radius: No bend of its road is narrower [m].
        max_radius: Some bend of its road is not wider [m].
        min_speed_limit: Lowest along its road [m/s].
        max_speed_limit: Highest along its road [m/s].
        route: Which ramp its road leads over; none if it goes on where most lanes do.
    """

    anchor: Anchor
    before: float
    after: float
    lanes: int | None = None
    two_way: bool | None = None
    road_type: str | None = None
    min_radius: float | None = None
    max_radius: float | None = None
    min_speed_limit: float | None = None
    max_speed_limit: float | None = None
    route: Route | None = None


class Spot(NamedTuple):
    """A point of a carriageway: a cross-section and a place on its road [m]."""

    section: Section
    at: float


class PlacedRoad(NamedTuple):
    """The road of a place.

    Attributes:
        heading: Of the line where it begins, in the map [rad].
        line: Length [m] and curvature [1/m] of each piece of the line.
        slabs: What lies across it.
        grades: From where on [m] it rises how much for each metre; none of a flat road.
    """

    heading: float
    line: tuple[tuple[float, float], ...]
    slabs: tuple[Slab, ...]
    grades: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False, slots=True)
class Place:
    """A place and what its road is made of.

    Attributes:
        key: Map, road, direction along (+) or against (-) its s, and place on it in metres.
        lanes: Most of the ego's way that are beside each other.
        lane_width: On average where slabs begin [m].
        shoulder: Least width of the hard shoulder there [m], 0 for none.
        speed_limit: The lowest along the road [m/s].
        is_guessed: Whether the map lacks some speed limit.
        is_type_guessed: Whether it lacks the type of the road.
        road_type: ``motorway``, ``rural`` or ``urban``.
        radius: Of the narrowest bend of the line [m], infinite on a straight, see ``STRAIGHT``.
        pieces: Cross-sections that the road leads over.
        window: From where to where on their line [m].
        left_hand: Whether traffic keeps to the left, and all this is of the mirror image.
        fastest: Highest speed limit that the map gives along the road [m/s].
    """

    key: str
    lanes: int
    lane_width: float
    shoulder: float
    speed_limit: float
    is_guessed: bool
    is_type_guessed: bool
    road_type: str
    radius: float
    pieces: tuple[Piece, ...]
    window: tuple[float, float]
    left_hand: bool = False
    fastest: float = 0.0

    @property
    def length(self) -> float:
        """Of the line [m]."""
        return math.fsum(length for length, _ in self.road.line)

    @property
    def road(self) -> PlacedRoad:
        """Its road, put together anew: of thousands of places few are taken."""
        return _put_together(self.pieces, self.window, self.road_type)


class Places(NamedTuple):
    """Places that have what was asked, and how many do not, by reason."""

    places: tuple[Place, ...]
    refused: Mapping[str, int]


@dataclass(frozen=True, eq=False, slots=True)
class Candidates:
    """Where a map has an anchor, each looked at when somebody asks whether it has the rest, too.

    Attributes:
        keys: In the order of the roads' ids as texts, those along before those against their s, and
            of the places.
    """

    keys: tuple[str, ...]
    _spots: Sequence[tuple[Spot, Lanes, bool]]
    _asked: Asked
    _known: dict[int, Place | str] = field(default_factory=dict)

    def look(self, number: int) -> Place | str:
        """Return the place at a key, or why it is none."""
        if number not in self._known:
            spot, lanes, left_hand = self._spots[number]
            found = _place(lanes, spot, self._asked, self.keys[number])
            self._known[number] = (
                replace(found, left_hand=left_hand) if isinstance(found, Place) else found
            )
        return self._known[number]


def candidates_of(found: Lanes, name: str, asked: Asked) -> Candidates:
    """Find where a map has the anchor that is asked for.

    Args:
        found: Lanes of a map.
        name: Of the map, for the keys of its places.
        asked: What a place must have.
    """
    both = (found, *found.mirrors)
    spots = [
        (spot, lanes, lanes is not found)
        for lanes in both
        for spot in set(_spots(lanes, asked.anchor))
    ]
    spots.sort(key=lambda item: _order(item[0]))
    keys = (
        f"{name}:{spot.section.road}{'+' if spot.section.way > 0 else '-'}{spot.at:.0f}"
        for spot, _, _ in spots
    )
    return Candidates(tuple(keys), spots, asked)


def places_of(found: Lanes, name: str, asked: Asked) -> Places:
    """Find all places of a map that have what is asked; arguments and order as above."""
    candidates = candidates_of(found, name, asked)
    looked = [candidates.look(number) for number in range(len(candidates.keys))]
    refused = Counter(item for item in looked if isinstance(item, str))
    return Places(tuple(item for item in looked if isinstance(item, Place)), refused)


def _order(spot: Spot) -> tuple[str, int, float]:
    return spot.section.road, -spot.section.way, spot.at


def _spots(found: Lanes, anchor: Anchor) -> Iterator[Spot]:
    """Yield the points of a map that an anchor is at."""
    for section, rows in found.own.items():
        record = found.drive.roads[section.road].sections
        low = record[section.number].s
        last = section.number + 1 == len(record)
        high = found.drive.roads[section.road].length if last else record[section.number + 1].s
        first, end = (low, high)[:: section.way]
        if anchor == "carriageway":
            number = math.ceil(low / EVERY)
            while number * EVERY < high or (last and number * EVERY <= high):
                yield Spot(section, number * EVERY)
                number += 1
        elif anchor == "work_zone":
            lanes = record[section.number].lanes
            if any(lane.type == "roadWorks" and lane.id * section.way < 0 for lane in lanes):
                yield Spot(section, first)
        else:
            sense = -1 if anchor in {"entry", "lane_begin"} else 1
            if _parts(found, section, rows, sense) & {anchor}:
                yield Spot(section, first if sense < 0 else end)


def _parts(found: Lanes, section: Section, rows: Sequence[int], sense: int) -> set[str]:
    """Return what lanes do where a cross-section begins (-1) or ends (1)."""
    main = found.next_section(section, sense)
    what: set[str] = set()
    for row in rows:
        others = found.follow(row, sense)
        if main is None:
            continue
        if not others:
            what.add("lane_begin" if sense < 0 else "lane_end")
        elif all(found.section_of(other) != main for other in others):
            what.add("entry" if sense < 0 else "exit")
    return what


def _place(found: Lanes, spot: Spot, asked: Asked, key: str) -> Place | str:
    """Return a place with its road, or why it has none."""
    section, kind = spot.section, _type_at(found, spot)
    lacks = _lacks(
        (asked.lanes in {None, len(found.own[section])}, "with another number of lanes"),
        (
            asked.two_way in {None, _is_two_way(found, section)},
            "with traffic towards one, or without",
        ),
        (asked.road_type in {None, kind or _UNKNOWN}, "on a road of another type"),
        (not kind or kind in _USUAL, "on a road that is none for cars"),
    )
    if lacks:
        return lacks
    chain = _over_ramp(found, spot, asked) if asked.route else _chain(found, spot, asked)
    if isinstance(chain, str):
        return chain
    pieces = [found.piece(cut) for cut in chain]
    gap, kink = steps_of(pieces)
    if gap > GAP or kink > KINK:
        return "where roads do not meet, or with a kink"
    at = [cut.section for cut in chain].index(section)
    here = math.fsum(piece.length for piece in pieces[:at]) + pieces[at].on_line(spot.at)
    if len(_types_along(found, chain, pieces, here - asked.before, here + asked.after)) > 1:
        return "where the type of the road changes"
    return _laid(key, kind, asked, pieces, here)


def _lacks(*asked: tuple[bool, str]) -> str:
    """Return the first reason that is not met; empty for none."""
    return next((reason for is_met, reason in asked if not is_met), "")


def _chain(found: Lanes, spot: Spot, asked: Asked) -> list[Cut] | str:
    """Return the cross-sections of a place's road, each with its lane that goes on all along."""
    parts = {-1: [spot.section], 1: [spot.section]}
    for sense, far in ((-1, asked.before), (1, asked.after)):
        low, high = _reach(found, spot)
        room = low if sense < 0 else high
        while room < far:
            following = found.next_section(parts[sense][-1], sense)
            if following is None or len(parts[sense]) > MOST:
                return "too near to the end of the way"
            if found.drive.roads[following.road].junction:
                return "too near to a junction"
            if following not in found.own:
                return "where no lane goes on, or traffic changes sides"
            parts[sense].append(following)
            room += _span(found, following)
    sections = (*reversed(parts[-1][1:]), *parts[1])
    rows = _through(found, sections)
    if not rows:
        return "where no lane goes on all along"
    return [Cut(part, found.rows.keys[row][2]) for part, row in zip(sections, rows, strict=True)]


def _over_ramp(found: Lanes, spot: Spot, asked: Asked) -> list[Cut] | str:
    """Return the cross-sections of a place's road that leads over a ramp.

    Its line is what the carriageway and the ramp share: of a ramp to the right, the right edge of
    the lane beside that of the ramp, and on the ramp the left edge of its own.
    """
    sense = 1 if asked.route == "exit" else -1
    rows = found.own[spot.section]
    main = found.next_section(spot.section, sense)
    away = [
        row
        for row in rows
        if found.follow(row, sense)
        and all(found.section_of(other) != main for other in found.follow(row, sense))
    ]
    count = len(away)
    if not away or count == len(rows):
        return "without such a ramp"
    is_right = tuple(away) == rows[:count]
    if not is_right and tuple(away) != rows[-count:]:
        return "with ramps on both sides"
    inner, neighbour = (away[-1], rows[count]) if is_right else (away[0], rows[-count - 1])
    low, high = _reach(found, spot)
    rooms = (asked.after, asked.before - low) if sense > 0 else (asked.before, asked.after - high)
    ramp = _along(found, inner, sense, rooms[0], is_left=is_right, is_ramp=True)
    beside = _along(found, neighbour, -sense, rooms[1], is_left=not is_right, is_ramp=False)
    if isinstance(ramp, str) or isinstance(beside, str):
        return ramp if isinstance(ramp, str) else beside
    here = Cut(spot.section, found.rows.keys[neighbour][2], not is_right)
    whole = [*reversed(beside), here, *ramp]
    return whole if sense > 0 else whole[::-1]


def _along(
    found: Lanes, row: int, sense: int, far: float, *, is_left: bool, is_ramp: bool
) -> list[Cut] | str:
    """Return the cross-sections that a lane leads to (1), or comes from (-1), and its lane in each.

    Args:
        found: Lanes of a map.
        row: The lane.
        sense: See above.
        far: How much of them is asked for [m].
        is_left: Whether the line is its left edge, not its right one.
        is_ramp: Whether the way is that of the lane, wherever the others lead.
    """
    cuts: list[Cut] = []
    while far > 0.0:
        section = found.section_of(row)
        following = found.next_section(section, sense)
        others = found.follow(row, sense)
        if is_ramp and not cuts and others:
            following = found.section_of(others[0])
        if following is None or len(cuts) > MOST:
            return "too near to the end of the way"
        if found.drive.roads[following.road].junction:
            return "too near to a junction"
        beside = found.own[following]
        places = [beside.index(other) for other in others if other in beside]
        if not places:
            return "where no lane goes on all along"
        row = beside[max(places) if is_left else min(places)]
        cuts.append(Cut(following, found.rows.keys[row][2], is_left))
        far -= _span(found, following)
    return cuts


def _ends(found: Lanes, section: Section) -> tuple[float, float]:
    """Return where a cross-section begins and ends on its road, in the order of travel [m]."""
    row = found.own[section][0]
    low, high = float(found.graph.start[row]), float(found.graph.end[row])
    return (low, high) if section.way > 0 else (high, low)


def _span(found: Lanes, section: Section) -> float:
    first, last = _ends(found, section)
    return abs(last - first)


def _reach(found: Lanes, spot: Spot) -> tuple[float, float]:
    """Return how much of a spot's own cross-section is before it and behind it [m]."""
    first, last = _ends(found, spot.section)
    return abs(spot.at - first), abs(last - spot.at)


def _through(found: Lanes, sections: Sequence[Section]) -> list[int]:
    """Return of each cross-section the rightmost lane that goes on all along; empty for none."""
    ways = [[row] for row in found.own[sections[0]]]
    for section in sections[1:]:
        beside = found.own[section]
        further = []
        for way in ways:
            others = [row for row in found.follow(way[-1], 1) if row in beside]
            if others:
                further.append([*way, min(others, key=beside.index)])
        ways = further
    return ways[0] if ways else []


def _is_two_way(found: Lanes, section: Section) -> bool:
    """Tell whether the leftmost lane of a cross-section lies beside one that is driven against."""
    return int(found.graph.opposite[found.own[section][-1]]) != network.NONE


def _type_at(found: Lanes, spot: Spot) -> str:
    """Return the type of a road at a place, empty if it says none."""
    kinds = [item for item in found.drive.roads[spot.section.road].types if item.s <= spot.at]
    return _TYPES.get(kinds[-1].type, "") if kinds else ""


def _types_along(
    found: Lanes, chain: Sequence[Cut], pieces: Sequence[Piece], low: float, high: float
) -> set[str]:
    """Return the types of roads between two places on the line [m].

    One that says none is one, too, but for the roads within a junction, which seldom say any.
    """
    kinds, begin = set(), 0.0
    for cut, piece in zip(chain, pieces, strict=True):
        ends = np.clip([low - begin, high - begin], 0.0, piece.length)
        road = found.drive.roads[cut.section.road]
        types = road.types
        if ends[1] > ends[0] and (types or not road.junction):
            first, last = sorted(np.interp(ends, piece.along, piece.places).tolist())
            kinds.add(_type_at(found, Spot(cut.section, first)))
            kinds |= {_TYPES.get(item.type, "") for item in types if first < item.s < last}
        begin += piece.length
    return kinds


def _laid(key: str, kind: str, asked: Asked, pieces: Sequence[Piece], here: float) -> Place | str:
    """Put the road of a place together, or say what it lacks.

    Args:
        key: Of the place.
        kind: Type of its road, empty if the map does not say.
        asked: What it must have.
        pieces: The cross-sections that the road leads over.
        here: Where on their line the place is [m].
    """
    if any((strips[:, across.STRIP_LANE] < 0.0).all() for item in pieces for strips in item.strips):
        return "where no lane is wide enough"
    window = here - asked.before, here + asked.after
    begins = np.cumsum([0.0, *(piece.length for piece in pieces[:-1])])
    folds = np.concatenate([s + piece.folds for s, piece in zip(begins, pieces, strict=True)])
    if ((folds >= window[0]) & (folds <= window[1])).any():
        return "where lanes reach beyond the centre of a bend"
    road = _put_together(pieces, window, "")
    if any(abs(grade) > STEEPEST for _, grade in road.grades):
        return "where heights jump, or steeper than any street"
    bend = max(abs(curvature) for _, curvature in road.line)
    radius = 1.0 / bend if bend * STRAIGHT > 1.0 else math.inf
    if _is_near_itself(road.line):
        return "where the way comes near itself"
    own = [[strip for strip in item if strip[across.STRIP_LANE] >= 0.0] for _, item in road.slabs]
    given = [strip[across.STRIP_LIMIT] for lanes in own for strip in lanes]
    limits = [limit if limit >= 0.0 else _USUAL[kind or _UNKNOWN] for limit in given]
    least, most = min(limits), max(limits)
    lacks = _lacks(
        (asked.min_radius is None or radius >= asked.min_radius, "with a narrower bend"),
        (asked.max_radius is None or radius <= asked.max_radius, "without such a bend"),
        (
            asked.min_speed_limit is None or least >= asked.min_speed_limit,
            "with a lower speed limit",
        ),
        (
            asked.max_speed_limit is None or most <= asked.max_speed_limit,
            "with a higher speed limit",
        ),
    )
    if lacks:
        return lacks
    width, shoulder = _summary(road.slabs)
    return Place(
        key=key,
        lanes=max(map(len, own)),
        lane_width=width,
        shoulder=shoulder,
        speed_limit=least,
        is_guessed=min(given) < 0.0,
        is_type_guessed=not kind,
        road_type=kind or _UNKNOWN,
        radius=radius,
        pieces=tuple(pieces),
        window=window,
        fastest=max((limit for limit in given if limit < math.inf), default=0.0),
    )


def _put_together(pieces: Sequence[Piece], window: tuple[float, float], kind: str) -> PlacedRoad:
    """Put a road together from cross-sections.

    Args:
        pieces: In the order of travel.
        window: From where to where on their line [m].
        kind: Type of the road, whose usual limit strips get that have none; empty to leave them so.
    """
    low, high = window
    heading, begin = math.nan, 0.0
    line: list[tuple[float, float]] = []
    slabs: list[Slab] = []
    grades: list[tuple[float, float]] = []
    for piece in pieces:
        first, last = max(low, begin) - begin, min(high, begin + piece.length) - begin
        if last - first > 1e-6:
            turned, part = _clipped(piece, first, last)
            heading = turned if math.isnan(heading) else heading
            line += part
            slabs += _moved(piece, first, last, begin - low)
            grades += _rising(piece, first, last, begin - low)
        begin += piece.length
    if kind:
        slabs = [(s, tuple(_limited(strip, kind) for strip in item)) for s, item in slabs]
    rises = any(grade for _, grade in grades)
    return PlacedRoad(heading, tuple(line), tuple(slabs), tuple(grades) if rises else ())


def _limited(strip: tuple[float, ...], kind: str) -> tuple[float, ...]:
    """Give a strip the usual speed limit where the map has none."""
    at = across.STRIP_LIMIT
    return strip if strip[at] >= 0.0 else (*strip[:at], _USUAL[kind], *strip[at + 1 :])


def _clipped(piece: Piece, first: float, last: float) -> tuple[float, list[tuple[float, float]]]:
    """Return a part of a piece's line, and the heading that it begins with."""
    heading, begin = piece.heading, 0.0
    found, begun = [], math.nan
    for length, curvature in piece.arcs:
        low, high = max(first, begin), min(last, begin + length)
        if high > low:
            if math.isnan(begun):
                begun = heading + curvature * (low - begin)
            found.append((high - low, curvature))
        heading += curvature * length
        begin += length
    return begun, found


def _moved(piece: Piece, first: float, last: float, shift: float) -> Iterator[Slab]:
    """Yield the slabs of a part of a piece, moved along the line."""
    ends = [*piece.begins[1:], piece.length]
    for begin, strips, end in zip(piece.begins, piece.strips, ends, strict=True):
        low = max(begin, first)
        if min(end, last) - low <= 1e-6:
            continue
        moved = strips.copy()
        for at in (across.STRIP_RIGHT, across.STRIP_LEFT):
            moved[:, at] += moved[:, at + 1] * (low - begin)
        rows = [tuple(row) for row in np.round(moved, 6).tolist()]
        yield max(0.0, round(low + shift, 6)), tuple(rows)


def _rising(piece: Piece, first: float, last: float, shift: float) -> Iterator[tuple[float, float]]:
    """Yield the grades of a part of a piece, moved along the line."""
    grades = piece.grades.tolist()
    ends = [s for s, _ in grades[1:]] + [piece.length]
    for (begin, grade), end in zip(grades, ends, strict=True):
        if min(end, last) - max(begin, first) > 1e-6:
            yield max(0.0, round(max(begin, first) + shift, 6)), grade


def _summary(slabs: Sequence[Slab]) -> tuple[float, float]:
    """Return the mean width of the lanes and the least of the shoulder [m], where slabs begin."""
    widths, shoulders = [], []
    for _, strips in slabs:
        own = [strip for strip in strips if strip[across.STRIP_LANE] >= 0.0]
        widths += [strip[across.STRIP_LEFT] - strip[across.STRIP_RIGHT] for strip in own]
        at = strips.index(own[0]) - 1
        hard = at >= 0 and strips[at][across.STRIP_KIND] == across.SHOULDER
        edges = strips[at]
        shoulders.append(edges[across.STRIP_LEFT] - edges[across.STRIP_RIGHT] if hard else 0.0)
    return round(math.fsum(widths) / len(widths), 6), round(max(0.0, min(shoulders)), 6)


def _is_near_itself(line: Sequence[tuple[float, float]]) -> bool:
    """Tell whether the way comes near itself."""
    # What turns by less than a third of a turn leads away.
    if math.fsum(abs(length * bend) for length, bend in line) < 2.0:
        return False
    lengths = np.array([length for length, _ in line])
    bends = np.array([bend for _, bend in line])
    total = float(lengths.sum())
    s = np.arange(0.0, total, 10.0)
    ends = np.cumsum(lengths)
    begins, turned = ends - lengths, np.concatenate([[0.0], np.cumsum(lengths * bends)[:-1]])
    at = np.minimum(np.searchsorted(ends, s, side="right"), len(line) - 1)
    heading = turned[at] + bends[at] * (s - begins[at])
    x, y = np.cumsum(10.0 * np.cos(heading)), np.cumsum(10.0 * np.sin(heading))
    apart = np.hypot(x[:, None] - x[None, :], y[:, None] - y[None, :])
    is_far = np.abs(s[:, None] - s[None, :]) > 2.0 * APART
    return bool((is_far & (apart < APART)).any())
