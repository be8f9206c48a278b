"""A carriageway as who drives on it meets it: cross-sections one after the other, and their strips.

A cross-section is a lane section of a road in one direction of travel. Which follows which is told
by most of its lanes. One lane that goes on all along, the rightmost such, gives the line: its right
edge, as arcs. What lies across is told along that line, in slabs between whose ends edges are
straight.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, pairwise
from typing import Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from adeye.kernel import strips as across
from adeye.kernel.jit import compiled, inlined
from adeye.maps import arcs, lanes, network
from adeye.maps.lanes import LaidRoad, Step, Strip
from adeye.maps.mirror import mirrored
from adeye.maps.opendrive import OpenDrive

Floats = NDArray[np.float64]

SAMPLE: Final = 2.0
"""Between two samples of the edges of lanes [m]."""
STRAIGHT: Final = 0.01
"""How far an edge may be from a straight line between the ends of a slab [m]."""
EVERY: Final = 5
"""Samples over which a road rises evenly."""
_DIGITS: Final = 6

_KINDS: Final = {
    "drive": across.DRIVING,
    "bus": across.DRIVING,
    "bicycle": across.CYCLING,
    "shoulder": across.SHOULDER,
    "parking": across.PARKING,
    "sidewalk": across.WALKING,
}


class Section(NamedTuple):
    """A cross-section: which road, which of its lane sections, and the direction of travel."""

    road: str
    number: int
    way: int


class Cut(NamedTuple):
    """A cross-section along an edge of one of its lanes.

    Attributes:
        section: Which.
        lane: Its id in the file.
        is_left: Whether the line is its left edge, not its right one.
    """

    section: Section
    lane: int
    is_left: bool = False


Slab = tuple[float, tuple[tuple[float, ...], ...]]
"""Where it begins on the line [m], and its strips from right to left, see ``kernel.strips``."""


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """A cross-section along the line of one of its lanes.

    Attributes:
        heading: Of the line where it begins [rad].
        arcs: Length [m] and curvature [1/m] of each piece of the line.
        begins: Of slabs on the line, in the order of travel [m].
        strips: Of each slab, from right to left (R, 8), see ``kernel.strips``.
        grades: From where on the line [m] it rises how much for each metre, (G, 2).
        places: Of samples on the road [m], in the order of travel.
        along: Of the same on the line [m].
        ends: Points of the line where it begins and ends, (2, 3): x, y, heading.
        steps: Of the line within it.
        folds: Where on the line [m] what carries a vehicle reaches beyond the centre of the bend.
    """

    heading: float
    arcs: tuple[tuple[float, float], ...]
    begins: tuple[float, ...]
    strips: tuple[Floats, ...]
    grades: Floats
    places: Floats
    along: Floats
    ends: Floats
    steps: tuple[Step, ...]
    folds: Floats

    @property
    def length(self) -> float:
        """Of the line [m]."""
        return float(self.along[-1])

    def on_line(self, place: float) -> float:
        """Return where a place of the road is on the line [m]."""
        way = 1.0 if self.places[-1] >= self.places[0] else -1.0
        return float(np.interp(way * place, way * self.places, self.along))


@dataclass
class Lanes:
    """A map's lanes as cross-sections.

    Attributes:
        drive: As the file says it.
        rows: Its lanes by their keys.
        graph: How they follow each other.
    """

    drive: OpenDrive
    rows: network.Rows
    graph: network.Network
    _laid: dict[str, LaidRoad] = field(default_factory=dict)
    _pieces: dict[Cut, Piece] = field(default_factory=dict)

    @classmethod
    def of(cls, drive: OpenDrive) -> Lanes:
        """Take the lanes of a map."""
        rows = network.Rows(drive)
        return cls(drive, rows, network.build_of_rows(rows))

    @cached_property
    def own(self) -> dict[Section, tuple[int, ...]]:
        """Rows of the lanes to drive in, of each cross-section from right to left.

        Those of roads where traffic keeps to the right: the others are so in ``mirrors``.
        """
        found: dict[Section, list[int]] = {}
        for row, (road, number, _) in enumerate(self.rows.keys):
            way = int(self.graph.way[row])
            is_right_hand = not self.drive.roads[road].left_hand
            if way != 0 and self.graph.kind[row] == network.DRIVE and is_right_hand:
                found.setdefault(Section(road, number, way), []).append(row)
        # Rows ascend with the ids of lanes: from right to left along s.
        return {key: tuple(found[key][:: key.way]) for key in sorted(found)}

    @cached_property
    def mirrors(self) -> tuple[Lanes, ...]:
        """Lanes of the mirror image; none if traffic keeps to the right everywhere."""
        is_needed = any(road.left_hand for road in self.drive.roads.values())
        return (Lanes.of(mirrored(self.drive)),) if is_needed else ()

    def laid(self, road: str) -> LaidRoad:
        """Return a road with its lines."""
        if road not in self._laid:
            # Cross-sections of one road are asked for one after the other.
            self._laid.clear()
            self._laid[road] = lanes.laid(self.drive.roads[road])
        return self._laid[road]

    def follow(self, row: int, sense: int) -> Sequence[int]:
        """Return the lanes that follow one (1), or that it follows (-1)."""
        found = self.graph.following(row) if sense > 0 else self.graph.preceding(row)
        return cast("list[int]", found.tolist())

    def section_of(self, row: int) -> Section:
        """Return the cross-section of a lane."""
        road, number, _ = self.rows.keys[row]
        return Section(road, number, int(self.graph.way[row]))

    def next_section(self, section: Section, sense: int) -> Section | None:
        """Return where most lanes of a cross-section lead to (1), or come from (-1)."""
        found = Counter(
            other
            for row in self.own.get(section, ())
            for other in set(map(self.section_of, self.follow(row, sense)))
        )
        # Of as many, the one that has most lanes itself: the carriageway, not the ramp.
        ranked = sorted(found, key=lambda item: (-found[item], -len(self.own.get(item, ())), item))
        return ranked[0] if ranked else None

    def piece(self, cut: Cut) -> Piece:
        """Return a cross-section along an edge of one of its lanes."""
        if cut not in self._pieces:
            self._pieces[cut] = self._cut(cut)
        return self._pieces[cut]

    def _cut(self, cut: Cut) -> Piece:
        section, way = cut.section, cut.section.way
        laid = self.laid(section.road)
        ordered = laid.strips[section.number][::-way]
        through = next(strip for strip in ordered if strip.lane.id == cut.lane)
        is_outer = ((through.lane.id < 0) == (way > 0)) != cut.is_left
        edge = through.outer if is_outer else through.inner
        start, end = (through.start, through.end)[::way]
        count = max(2, math.ceil(abs(end - start) / SAMPLE) + 1)
        places = np.linspace(start, end, count)
        line = lanes.along(laid, edge, places)
        course = arcs.Course(laid.pieces, edge, laid.scratch, start, end)
        rows = arcs.course_arcs(course)
        total = math.fsum(rows[:, arcs.LENGTH].tolist())
        steps = 0.5 * (line.rate[1:] + line.rate[:-1]) * np.abs(np.diff(places))
        along = np.concatenate([[0.0], np.cumsum(steps)])
        along *= total / along[-1]
        turned = line.heading if way > 0 else line.heading + np.pi
        points = np.array([(line.x[at], line.y[at], turned[at]) for at in (0, -1)])
        slabs = list(self._slabs(section, ordered, edge, places, along))
        bend = lanes.along(laid, lanes.REFERENCE, places).curvature
        sides = [
            lanes.value_at(border, places)[0]
            for strip in ordered
            if self._kind(section, strip) <= across.CYCLING
            for border in (strip.inner, strip.outer)
        ]
        return Piece(
            float(rows[0, arcs.ARC_HEADING]),
            tuple(zip(rows[:, arcs.LENGTH].tolist(), rows[:, arcs.BEND].tolist(), strict=True)),
            tuple(begin for begin, _ in slabs),
            tuple(np.array(strips) for _, strips in slabs),
            np.array(list(self._grades(section, places, along))),
            places,
            along,
            points,
            (
                *lanes.steps_in(laid, edge, through.start, through.end),
                *lanes.height_steps(laid.road, through.start, through.end),
            ),
            along[(bend * np.array(sides) >= 1.0).any(axis=0)],
        )

    def _kind(self, section: Section, strip: Strip) -> int:
        row = self.rows.find(section.road, section.number, strip.lane.id) or 0
        return _KINDS.get(network.KINDS[self.graph.kind[row]], across.OTHER)

    def _slabs(
        self,
        section: Section,
        ordered: Sequence[Strip],
        edge: Floats,
        places: Floats,
        along: Floats,
    ) -> Iterator[Slab]:
        """Cut a cross-section into slabs along its line."""
        borders = [(strip.inner, strip.outer) for strip in ordered]
        # Neighbours share one.
        known = {id(border): border for border in (*chain(*borders), edge)}
        at = {key: lanes.value_at(border, places)[0] for key, border in known.items()}
        sides = np.array([[at[id(border)] for border in pair] for pair in borders])
        ends = section.way * (sides - at[id(edge)])
        right, left = ends.min(axis=1), ends.max(axis=1)
        rows = [
            self.rows.find(section.road, section.number, strip.lane.id) or 0 for strip in ordered
        ]
        width = np.minimum(left[:, 1:] - right[:, 1:], left[:, :-1] - right[:, :-1])
        own = np.array([row in self.own.get(section, ()) for row in rows])
        is_lane = (width >= across.LEAST_LANE) & own[:, np.newaxis]
        limits = self._limits(rows, places, along)
        kinds = [float(self._kind(section, strip)) for strip in ordered]
        ways = [float(self._way(row, section)) for row in rows]
        # Plain numbers from here on: there are many, and few at a time.
        course, pairs = along.tolist(), list(zip(right.tolist(), left.tolist(), strict=True))
        for low, high in _straights(np.concatenate([right, left]), is_lane, along):
            far = course[high] - course[low]
            is_wide = (width[:, low:high].max(axis=1) > 0.0).tolist()
            is_here = is_lane[:, low].tolist()
            inside = [begin for begin in limits if course[low] < begin < course[high]]
            for begin in (course[low], *inside):
                held = limits[max(at for at in limits if at <= begin)]
                found, number = [], 0
                for item in range(len(rows)):
                    if not is_wide[item]:
                        continue
                    lane = number if is_here[item] else -1
                    number += lane >= 0
                    numbers = [kinds[item], ways[item], held[item], float(lane)]
                    for side in pairs[item]:
                        slope = (side[high] - side[low]) / far
                        numbers += [side[low] + slope * (begin - course[low]), slope]
                    found.append(tuple([round(value, _DIGITS) for value in numbers]))
                yield round(begin, _DIGITS), tuple(found)

    def _grades(
        self, section: Section, places: Floats, along: Floats
    ) -> Iterator[tuple[float, float]]:
        """Yield from where on the line a cross-section rises how much, about every ten metres."""
        heights = lanes.value_at(self.drive.roads[section.road].elevations, places)[0]
        known = math.nan
        at = [*range(0, len(places) - 1, EVERY), len(places) - 1]
        rises = np.diff(heights[at]) / np.diff(along[at])
        for begin, rise in zip(along[at].tolist(), rises.tolist(), strict=False):
            grade = round(rise, 4) + 0.0
            if grade != known:
                yield round(begin, _DIGITS), grade
            known = grade

    def _way(self, row: int, section: Section) -> int:
        is_driven = self.graph.kind[row] in {network.DRIVE, network.BUS}
        return int(self.graph.way[row]) * section.way if is_driven else 0

    def _limits(
        self, rows: Sequence[int], places: Floats, along: Floats
    ) -> dict[float, tuple[float, ...]]:
        """Return from where on the line [m] which limits hold in lanes [m/s], -1 for none known."""
        low, high = sorted((float(places[0]), float(places[-1])))
        spans = zip(rows, self.graph.start[rows], self.graph.end[rows], strict=True)
        told = [network.limits_along(self.rows, row, *span) for row, *span in spans]
        changes = {s for limits in told for s, _ in limits if low < s < high}
        backward = bool(places[0] > places[-1])
        course = (places[::-1], along[::-1]) if backward else (places, along)
        edges = sorted({low, high, *changes}, reverse=backward)
        found: dict[float, tuple[float, ...]] = {}
        for low, high in pairwise(edges):
            middle = 0.5 * (low + high)
            here = [
                next((limit for s, limit in reversed(limits) if s <= middle), math.nan)
                for limits in told
            ]
            held = tuple(limit if math.isfinite(limit) else -1.0 for limit in here)
            if not found or held != list(found.values())[-1]:
                found[float(np.interp(low, *course))] = held
        return found


def _straights(edges: Floats, marks: NDArray[np.bool_], along: Floats) -> Iterator[tuple[int, int]]:
    """Yield from sample to sample where edges (E, N) are straight and marks (L, N - 1) stay."""
    last = len(along) - 1
    low = 0
    while low < last:
        changed = np.flatnonzero((marks[:, low:] != marks[:, low : low + 1]).any(axis=0))
        most = low + int(changed[0]) if len(changed) else last
        high = _straight_until(edges, along, low, most)
        yield low, high
        low = high


@compiled
def _straight_until(edges: Floats, along: Floats, low: int, most: int) -> int:
    """Return the sample, one further at least, until which all edges are straight from another."""
    high = most
    while high > low + 1 and not _is_straight(edges, along, low, high):
        high = low + (high - low) // 2
    # Halving goes too far back: forward again as long as it is straight.
    step = max(1, (high - low) // 2)
    while step > 0:
        if high + step <= most and _is_straight(edges, along, low, high + step):
            high += step
        else:
            step //= 2
    return high


@inlined
def _is_straight(edges: Floats, along: Floats, low: int, high: int) -> bool:
    way = along[high] - along[low]
    if way <= 0.0:
        return False
    for edge in range(edges.shape[0]):
        begin, rise = edges[edge, low], edges[edge, high] - edges[edge, low]
        for at in range(low, high + 1):
            straight = begin + rise * ((along[at] - along[low]) / way)
            if not abs(edges[edge, at] - straight) <= STRAIGHT:
                return False
    return True


def steps_of(pieces: Sequence[Piece]) -> tuple[float, float]:
    """Return the widest gap [m] and the sharpest kink [rad] in pieces and between them."""
    within = [step for piece in pieces for step in piece.steps]
    gap = max((step.gap for step in within), default=0.0)
    kink = max((step.kink for step in within), default=0.0)
    for before, behind in pairwise(pieces):
        x, y, turn = behind.ends[0] - before.ends[1]
        gap = max(gap, math.hypot(x, y))
        kink = max(kink, abs(math.remainder(turn, 2.0 * math.pi)))
    return gap, kink
