"""Where the lanes of a road lie: borders, centres, widths, headings, curvatures and lengths.

A road is laid once, ``laid``; then every line along it is a cubic of the place beside the reference
line, as ``adeye.maps.alignment`` has it, and everything else is asked of these.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.maps import alignment
from adeye.maps.opendrive import Geometry, Lane, OpenDrive, Road, Section

Floats = NDArray[np.float64]

EXPORTED: Final = ("road", "lane", "s_m", "x_m", "y_m", "heading_rad", "width_m")
"""Columns of ``lane_rows``."""

_KINDS: Final = {
    "line": alignment.LINE,
    "arc": alignment.ARC,
    "spiral": alignment.SPIRAL,
    "poly3": alignment.POLY3,
    "paramPoly3": alignment.PARAM_POLY3,
}
REFERENCE: Final = np.zeros((0, 5))
"""The line that is nowhere beside the reference line."""


class Line(NamedTuple):
    """Places on a line along a road, arrays (N,) each.

    Attributes:
        x: [m].
        y: [m].
        heading: Of the line itself, towards greater s, in (-pi, pi] [rad].
        curvature: Of the line itself, positive to the left towards greater s [1/m].
        rate: How far one goes on the line for each metre of the reference line.
    """

    x: Floats
    y: Floats
    heading: Floats
    curvature: Floats
    rate: Floats


@dataclass(frozen=True, slots=True)
class Strip:
    """A lane of one section and where it lies.

    Its lines are cubics (M, 5) of the place on the road: how far they are to the left of the
    reference line.

    Attributes:
        lane: As the file says it.
        section: Number of its section.
        start: On the road [m].
        end: On the road [m].
        way: Whether traffic drives along s (1), against it (-1) or both ways (0).
        inner: The border on the side of lane 0.
        outer: The other border.
    """

    lane: Lane
    section: int
    start: float
    end: float
    way: int
    inner: Floats
    outer: Floats

    @property
    def center(self) -> Floats:
        """Half-way between the borders."""
        center = self.inner.copy()
        center[:, 1:] = 0.5 * (self.inner[:, 1:] + self.outer[:, 1:])
        return center


class Step(NamedTuple):
    """How far a line is from going on.

    Attributes:
        s: Where on the road [m].
        x: Where it ends [m].
        y: [m].
        gap: [m].
        kink: [rad].
    """

    s: float
    x: float
    y: float
    gap: float
    kink: float


@dataclass(frozen=True, slots=True)
class LaidRoad:
    """A road with its lines.

    Attributes:
        road: As the file says it.
        pieces: (G, 15) of the reference line, see ``adeye.maps.alignment``.
        strips: For each section its lanes from left to right, lane 0 left out.
        scratch: For the functions of ``adeye.maps.alignment``.
    """

    road: Road
    pieces: Floats
    strips: tuple[tuple[Strip, ...], ...]
    scratch: Floats


def laid(road: Road) -> LaidRoad:
    """Return a road with its lines."""
    pieces = np.array([_piece(geometry) for geometry in road.geometries])
    scratch = np.full(alignment.SCRATCH, -1.0)
    strips = tuple(_strips(road, number) for number in range(len(road.sections)))
    return LaidRoad(road, pieces, strips, scratch)


def _piece(geometry: Geometry) -> Floats:
    piece = np.zeros(alignment.PIECE_WIDTH)
    piece[:6] = (
        geometry.s,
        geometry.x,
        geometry.y,
        geometry.heading,
        geometry.length,
        _KINDS[geometry.kind],
    )
    piece[alignment.FIRST : alignment.FIRST + len(geometry.parameters)] = geometry.parameters
    piece[alignment.RANGE] = 1.0 if geometry.normalized else geometry.length
    return piece


def section_end(road: Road, number: int) -> float:
    """Return where a section ends on its road [m]."""
    following = number + 1
    return road.sections[following].s if following < len(road.sections) else road.length


def way_of(road: Road, lane: Lane) -> int:
    """Tell whether traffic of a lane drives along s (1), against it (-1) or both ways (0)."""
    if lane.direction == "both":
        return 0
    along = (lane.id < 0) != road.left_hand
    return 1 if along != (lane.direction == "reversed") else -1


def _strips(road: Road, number: int) -> tuple[Strip, ...]:
    """Return the lanes of a section, from left to right."""
    section = road.sections[number]
    start, end = section.s, section_end(road, number)
    line = _sum(section, road.offsets, start, end)
    strips: list[Strip] = []
    for side in (1, -1):
        inner = line
        lanes = [lane for lane in section.lanes if lane.id * side > 0]
        for lane in sorted(lanes, key=lambda lane: abs(lane.id)):
            base, cubics, factor = (
                (line, lane.borders, 1.0) if len(lane.borders) else (inner, lane.widths, side)
            )
            outer = base.copy()
            alignment.add_cubics(cubics, start, float(factor), outer)
            strips.append(Strip(lane, number, start, end, way_of(road, lane), inner, outer))
            inner = outer
    return tuple(sorted(strips, key=lambda strip: -strip.lane.id))


def _sum(section: Section, offsets: Floats, start: float, end: float) -> Floats:
    """Return the lane offset with a row wherever a function of the section changes."""
    knots = {start, *(float(s) for s in offsets[:, 0] if start < s < end)}
    for lane in section.lanes:
        for cubics in (lane.widths, lane.borders):
            knots.update(s + start for s in cubics[:, 0].tolist() if 0.0 < s < end - start)
    line = np.zeros((len(knots), 5))
    line[:, 0] = sorted(knots)
    alignment.add_cubics(offsets, 0.0, 1.0, line)
    return line


def along(road: LaidRoad, line: Floats, places: Floats) -> Line:
    """Return the places on a line along a road.

    Args:
        road: Which road.
        line: (M, 5), such as ``Strip.center``, or ``REFERENCE``.
        places: (N,) on the road [m].
    """
    found = np.empty((len(places), alignment.PLACE_WIDTH))
    alignment.fill_line(road.pieces, line, places, road.scratch, found)
    return Line(*found.T)


def steps_in(road: LaidRoad, line: Floats, start: float, end: float) -> list[Step]:
    """Return the steps of a line within a part of a road, where pieces or cubics meet.

    Args:
        road: Which road.
        line: (M, 5), such as ``Strip.center``, or ``REFERENCE``.
        start: Of the part [m]; steps there are none of it.
        end: [m].
    """
    joints = {*road.pieces[:, alignment.START].tolist(), *line[:, 0].tolist()}
    found = []
    for s in sorted(joint for joint in joints if start < joint < end):
        behind, before = (
            alignment.place_beside(road.pieces, line, s, side, road.scratch)
            for side in (alignment.BEHIND, alignment.BEFORE)
        )
        gap = math.hypot(behind[0] - before[0], behind[1] - before[1])
        kink = abs(math.remainder(behind[2] - before[2], 2.0 * math.pi))
        found.append(Step(s, before[0], before[1], gap, kink))
    return found


def height_steps(road: Road, start: float, end: float) -> list[Step]:
    """Return the steps of a road's height within a part of it [m]."""
    found = []
    for s in (s for s in road.elevations[1:, 0].tolist() if start < s < end):
        low, high = (
            alignment.cubic_at(road.elevations, s, side)[0]
            for side in (alignment.BEFORE, alignment.BEHIND)
        )
        found.append(Step(s, math.nan, math.nan, abs(high - low), 0.0))
    return found


def value_at(cubics: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Return a function of the place and its slope, (N,) each: of a line, or of the elevation."""
    values = np.empty((len(places), 2))
    alignment.fill_cubics(cubics, places, values)
    return values[:, 0], values[:, 1]


def width_at(strip: Strip, places: Floats) -> Floats:
    """Return the width of a lane (N,) [m]; negative where its borders cross."""
    outer, inner = value_at(strip.outer, places)[0], value_at(strip.inner, places)[0]
    return outer - inner if strip.lane.id > 0 else inner - outer


def places_of(road: Road, step: float) -> Floats:
    """Return the start of a road, the end of each step on it, and its own end (N,) [m]."""
    places = np.arange(0.0, road.length, step)
    return np.append(places, road.length)


def lane_rows(
    network: OpenDrive, step: float
) -> Iterator[tuple[str, int, float, float, float, float, float]]:
    """Yield where the centre lines of all lanes are, in the columns ``EXPORTED``.

    At the start of every road, each step and its end; where a section begins, its lanes and not
    those of the one before. The heading is the centre line's own, towards greater s.

    Args:
        network: Whose roads.
        step: Along each road [m].
    """
    for road in map(laid, network.roads.values()):
        places = places_of(road.road, step)
        starts = np.array([section.s for section in road.road.sections])
        numbers = np.maximum(np.searchsorted(starts, places, side="right") - 1, 0)
        for number, strips in enumerate(road.strips):
            here = places[numbers == number]
            lines = [(along(road, s.center, here), width_at(s, here)) for s in strips]
            for i, place in enumerate(here.tolist()):
                for strip, (line, width) in zip(strips, lines, strict=True):
                    yield (
                        road.road.id,
                        strip.lane.id,
                        place,
                        float(line.x[i]),
                        float(line.y[i]),
                        float(line.heading[i]),
                        float(width[i]),
                    )
