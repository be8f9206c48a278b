"""The lines of a road as points in the map: edges of lanes, and of what is paved beside them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from adeye.kernel.road import Ground, far_edge, has_strips, lane_edge, position, right_edge
from adeye.kernel.strips import (
    DRIVING,
    OPPOSITE,
    SLAB_BEGIN,
    SLAB_FIRST,
    SLAB_STRIPS,
    STRIP_KIND,
    STRIP_LEFT,
    STRIP_LEFT_SLOPE,
    STRIP_RIGHT,
    STRIP_RIGHT_SLOPE,
    STRIP_WAY,
)
from adeye.signals import REFUGE_LENGTH, REFUGE_S, REFUGE_TAPER

if TYPE_CHECKING:
    from adeye.signals import Floats

Marking = Literal["solid", "dashed", "none"]

BOUNDARY_STEP: Final = 5.0
"""Longest piece of a lane boundary on a bend [m]."""
VIEW: Final = 150.0
"""How much road is drawn before and behind what the ego drives [m]."""
_STEP: Final = 0.01
"""Length of a step in an edge [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class RoadLine:
    """A line along the road.

    Attributes:
        marking: What is painted there.
        places: (N, 2) x, y in the map [m], towards greater s.
    """

    marking: Marking
    places: Floats


@dataclass(frozen=True, slots=True)
class RoadLane:
    """A lane, or a piece of one, between two of the lines, which have as many points each.

    Attributes:
        right: Number of the line to the right of who looks towards greater s.
        left: Number of the other one.
        is_ahead: Whether traffic goes towards greater s.
    """

    right: int
    left: int
    is_ahead: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class RoadLines:
    """What a piece of a road looks like from above.

    Attributes:
        boundaries: From right to left; those of imported roads slab by slab, between the outermost.
        lanes: Which of them have a lane to drive on between them.
        shoulder: Right edge of what is paved, where that is not among the boundaries.
    """

    boundaries: tuple[RoadLine, ...]
    lanes: tuple[RoadLane, ...]
    shoulder: RoadLine | None = None


def road_lines(ground: Ground, start: float, end: float) -> RoadLines:
    """Draw a piece of a road.

    Args:
        ground: The road.
        start: Where along it the piece begins [m].
        end: Where it ends, behind the start [m].
    """
    curved = bool(np.any(ground.segments[:, 4] != 0.0))
    pieces = max(1, math.ceil((end - start) / BOUNDARY_STEP)) if curved else 1
    stations = np.linspace(start, end, pieces + 1)
    if has_strips(ground):
        # What is paved lies between the first boundary and the last.
        right, left = (
            _line(ground, "none", stations, [outermost(ground, float(s)) for s in stations])
            for outermost in (right_edge, far_edge)
        )
        inner, lanes = _strips(ground, start, end)
        return RoadLines((right, *inner, left), tuple(lanes))
    edges = tuple(
        _line(
            ground,
            "solid" if k in {0, ground.lanes} else "dashed",
            stations,
            [lane_edge(ground, float(s), k) for s in stations],
        )
        for k in range(ground.lanes + 1)
    )
    lanes = [RoadLane(k, k + 1) for k in range(ground.lanes)]
    at, paved = _with_corners(stations, ground.refuges), ground._replace(verge=0.0)
    beside = [right_edge(paved, float(s)) for s in at]
    shoulder = _line(ground, "none", at, beside) if min(beside) < 0.0 else None
    return RoadLines(edges, tuple(lanes), shoulder)


def _line(ground: Ground, marking: Marking, stations: Floats, beside: Any) -> RoadLine:
    """Place a line whose distance from the right edge of the road is known at stations (N,)."""
    places = [
        position(ground.segments, float(s), float(d))[:2]
        for s, d in zip(stations, beside, strict=True)
    ]
    return RoadLine(marking, np.array(places))


def _strips(ground: Ground, start: float, end: float) -> tuple[list[RoadLine], list[RoadLane]]:
    """Draw the edges of the strips of an imported road slab by slab, each edge once."""
    lines: list[RoadLine] = []
    lanes: list[RoadLane] = []
    begins = [*ground.slabs[:, SLAB_BEGIN], math.inf]
    for slab, (first, rows) in enumerate(ground.slabs[:, SLAB_FIRST : SLAB_STRIPS + 1].astype(int)):
        low, high = max(start, begins[slab]), min(end, begins[slab + 1])
        if not low < high:
            continue
        at = np.linspace(low, high, max(2, math.ceil((high - low) / BOUNDARY_STEP) + 1))
        found = ground.strips[first : first + rows]
        for number, strip in enumerate(found):
            is_lane = [
                row[STRIP_KIND] == DRIVING for row in (strip, *found[number + 1 : number + 2])
            ]
            ways = {float(row[STRIP_WAY]) for row in found[number : number + 2]}
            inner = len(is_lane) == 2 and all(is_lane) and len(ways) == 1
            touches = number and np.array_equal(
                strip[[STRIP_RIGHT, STRIP_RIGHT_SLOPE]],
                found[number - 1][[STRIP_LEFT, STRIP_LEFT_SLOPE]],
            )
            sides = [STRIP_LEFT] if touches else [STRIP_RIGHT, STRIP_LEFT]
            for side in sides:
                d = strip[side] + strip[side + 1] * (at - begins[slab])
                # The right edge of the outermost strip is drawn as its left one.
                painted = is_lane if side == STRIP_LEFT or not number else is_lane[:1]
                marking: Marking = "solid" if any(painted) else "none"
                marking = "dashed" if inner and side == STRIP_LEFT else marking
                lines.append(_line(ground, marking, at, d))
            if is_lane[0]:
                # The outermost edge of the road is boundary 0.
                lanes.append(RoadLane(len(lines) - 1, len(lines), strip[STRIP_WAY] != OPPOSITE))
    return lines, lanes


def _with_corners(stations: Floats, refuges: Floats) -> Floats:
    """Add the corners of parking bays and rest areas (R, 5) to the stations of a line."""
    first = refuges[:, REFUGE_S] - refuges[:, REFUGE_TAPER]
    last = refuges[:, REFUGE_S] + refuges[:, REFUGE_LENGTH]
    # A corner without a taper is a step: a place just outside, and one just inside.
    corners = [
        first - _STEP,
        refuges[:, REFUGE_S],
        last,
        last + refuges[:, REFUGE_TAPER] + _STEP,
    ]
    inside = np.concatenate(corners)
    inside = inside[(inside > stations[0]) & (inside < stations[-1])]
    return np.unique(np.concatenate([stations, inside]))
