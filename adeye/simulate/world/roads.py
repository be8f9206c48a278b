"""Build the reference lines of parametric roads: straight, curve and S-curve.

The reference line is the right edge of lane 0 and starts in the origin of the map, heading along
x. The line of every road goes on straight for ``RUN_OUT`` beyond its length, for actors that are
ahead of the ego; the run of an ego that drives over the end is over. A curve and an S-curve begin
with a straight lead-in of ``LEAD_IN``:

- straight: ``length + RUN_OUT`` straight;
- curve: lead-in, an arc over the rest of the length, run-out;
- s_curve: lead-in, an arc over half of the rest, the opposite arc over the other half, run-out;
- imported: the pieces of its line, straight or arcs, run-out. It starts in the origin, too, with
  the heading that it has in its map.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye import signals
from adeye.errors import SpecError
from adeye.kernel.elementary import sin, sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.road import MANY
from adeye.kernel.strips import (
    DRIVING,
    LEAST_LANE,
    OPPOSITE,
    OWN,
    SHOULDER,
    SLAB_BEGIN,
    SLAB_WIDTH,
    STRIP_LANE,
    STRIP_WIDTH,
)
from adeye.signals import MOST_LANES, Floats, Ints, RoadMap
from adeye.simulate.world.formulas import BELOW_ZERO, Formulas, Pick
from adeye.spec.scenario import Road

Across = dict[str, Floats]
Slabs = tuple[tuple[float, tuple[tuple[float, ...], ...]], ...]

# --- Parking bays and rest areas beside a road, and where they may be -----------------------------

_ROUNDING = 1e-9
"""By how much one bay may reach into the next or beyond the road [m]: rounding errors."""


def build_refuges(formulas: Formulas, length: Floats) -> Floats:
    """Build the parking bays and rest areas of each run, in the order of their places.

    Args:
        formulas: Scenarios of the batch with their parameters.
        length: Of the road of each run (B,) [m].

    Returns:
        (B, R, 5), see ``signals.REFUGE_COLUMNS``.

    Raises:
        SpecError: A length or depth is not positive, a taper is negative, a bay reaches beyond the
            road, or two of them overlap.
    """
    bays = formulas.scenario.world.road.bays
    refuges = np.zeros((formulas.runs, len(bays), len(signals.REFUGE_COLUMNS)))
    for row, (name, bay) in enumerate(bays.items()):
        where = f"world.road.bays.{name}"
        refuges[:, row, signals.REFUGE_KIND] = signals.REFUGE_KINDS.index(bay.kind)
        refuges[:, row, signals.REFUGE_S] = formulas.values(f"{where}.s", _pick(name, "s"))
        for column, field, above in (
            (signals.REFUGE_LENGTH, "length", 0.0),
            (signals.REFUGE_DEPTH, "depth", 0.0),
            (signals.REFUGE_TAPER, "taper", BELOW_ZERO),
        ):
            refuges[:, row, column] = formulas.limited(
                f"{where}.{field}", _pick(name, field), above=above
            )
        _check_ends(where, refuges[:, row], length)
    order = np.argsort(refuges[:, :, signals.REFUGE_S], axis=1, kind="stable")
    _check_overlaps(tuple(bays), refuges, order)
    ordered: Floats = np.take_along_axis(refuges, order[:, :, np.newaxis], axis=1)
    return ordered


def _pick(name: str, field: str) -> Pick:
    return lambda scenario: getattr(scenario.world.road.bays[name], field)


def _ends(refuges: Floats) -> tuple[Floats, Floats]:
    """Return where refuges (..., 5) begin and end with their tapers [m]."""
    first = refuges[..., signals.REFUGE_S] - refuges[..., signals.REFUGE_TAPER]
    last = (
        refuges[..., signals.REFUGE_S]
        + refuges[..., signals.REFUGE_LENGTH]
        + refuges[..., signals.REFUGE_TAPER]
    )
    return first, last


def _check_ends(where: str, refuges: Floats, length: Floats) -> None:
    """Refuse a bay (B, 5) that is not wholly beside the road."""
    first, last = _ends(refuges)
    bad = (first < -_ROUNDING) | (last > length + _ROUNDING)
    if bad.any():
        raise SpecError(
            f"{where}.s: with its tapers it reaches from {first[bad][0]:g} m to "
            f"{last[bad][0]:g} m, but the road from 0 m to {length[bad][0]:g} m",
            remedy="Move it, or make the road longer.",
        )


def _check_overlaps(names: tuple[str, ...], refuges: Floats, order: Ints) -> None:
    """Refuse bays (B, R, 5) that overlap, their tapers included."""
    first, last = (np.take_along_axis(ends, order, axis=1) for ends in _ends(refuges))
    bad = np.argwhere(first[:, 1:] < last[:, :-1] - _ROUNDING)
    if bad.size:
        run, row = bad[0]
        one, next_one = (names[order[run, row + k]] for k in range(2))
        raise SpecError(
            f"world.road.bays.{next_one}.s: with its taper it begins at "
            f"{first[run, row + 1]:g} m, where {one} has not ended: it reaches to "
            f"{last[run, row]:g} m",
            remedy="Move one of them, or make their tapers shorter.",
        )


# --- Build the reference lines of parametric roads: straight, curve and S-curve -------------------

LEAD_IN: Final = 100.0
"""Straight part before the first arc [m]."""

RUN_OUT: Final = 1000.0
"""Straight part after the length of the road [m]."""

MAX_TURN: Final = 0.9 * np.pi
"""Largest angle of one arc [rad]; with more, places on the road would be ambiguous."""


def build_roads(formulas: Formulas) -> RoadMap:
    """Build the road of each run.

    Args:
        formulas: Scenarios of the batch with their parameters.

    Raises:
        SpecError: A width, length, radius or bay is not possible.
    """
    road = formulas.scenario.world.road
    lane_width = formulas.limited(
        "world.road.lane_width", lambda s: s.world.road.lane_width, above=0.0
    )
    shoulder = formulas.limited(
        "world.road.shoulder", lambda s: s.world.road.shoulder, above=BELOW_ZERO
    )
    limit = formulas.limited(
        "world.road.speed_limit", lambda s: s.world.road.speed_limit, above=0.0, unit="m/s"
    )
    length = formulas.limited("world.road.length", lambda s: s.world.road.length, above=0.0)
    heading = np.zeros(formulas.runs)
    if road.kind == "straight":
        pieces = [(length + RUN_OUT, np.zeros(formulas.runs))]
    elif road.kind == "imported":
        pieces, heading = _imported(formulas)
    else:
        radius = formulas.values("world.road.radius", lambda s: s.world.road.radius)
        arcs = 1 if road.kind == "curve" else 2
        arc = (length - LEAD_IN) / arcs
        _check_arcs(road.kind, radius, arc, (road.lanes + road.opposite_lanes) * lane_width)
        straight = np.zeros(formulas.runs)
        pieces = [(np.full(formulas.runs, LEAD_IN), straight)]
        pieces += [(arc, (-1.0) ** number / radius) for number in range(arcs)]
        pieces.append((np.full(formulas.runs, RUN_OUT), straight))
    return RoadMap(
        segments=_join(pieces, heading),
        lane_width=lane_width,
        lanes=MOST_LANES if road.kind == "imported" else road.lanes,
        shoulder=shoulder,
        speed_limit=limit,
        verge=formulas.limited(
            "world.road.verge", lambda s: s.world.road.verge, above=BELOW_ZERO, default=0.0
        ),
        refuges=build_refuges(formulas, length),
        length=length,
        left_hand=road.traffic == "left",
        **(_across(formulas, lane_width, shoulder, limit) if road.has_strips else {}),
    )


def _imported(formulas: Formulas) -> tuple[list[tuple[Floats, Floats]], Floats]:
    """Return the pieces of the lines with their run-out, and the headings that they begin with.

    Shorter ones are filled up with pieces of no length at the very end, where nobody drives.
    """
    heading = np.zeros(formulas.runs)
    # Places are found in one way on all of them, whatever roads share the batch.
    most = max(MANY, *(len(scenario.world.road.line) for scenario, _, _ in formulas.parts))
    lines = np.zeros((formulas.runs, most + 1, 2))
    for scenario, rows, _ in formulas.parts:
        road = scenario.world.road
        lines[rows, : len(road.line)] = road.line
        lines[rows, len(road.line), 0] = RUN_OUT
        heading[rows] = road.heading
    return [(lines[:, at, 0], lines[:, at, 1]) for at in range(most + 1)], heading


def _across(formulas: Formulas, width: Floats, shoulder: Floats, limit: Floats) -> Across:
    """Return slabs (B, S, 4) and strips (B, J, 8), filled up at the end.

    Args:
        formulas: Scenarios of the batch with their parameters.
        width: Of the lanes of each run (B,) [m], as the others for a parametric road.
        shoulder: (B,) [m].
        limit: (B,) [m/s].
    """
    parts = [(scenario.world.road.slabs, rows) for scenario, rows, _ in formulas.parts]
    if formulas.scenario.world.road.kind != "imported":
        ends = _lane_ends(formulas)
        parts = [
            (_slabs(formulas.scenario.world.road, *numbers), np.array([run]))
            for run, numbers in enumerate(zip(ends, width, shoulder, limit, strict=True))
        ]
    most = max(len(slabs) for slabs, _ in parts)
    many = max(sum(len(found) for _, found in slabs) for slabs, _ in parts)
    across = np.zeros((formulas.runs, most, SLAB_WIDTH))
    beside = np.zeros((formulas.runs, many, STRIP_WIDTH))
    across[:, :, SLAB_BEGIN] = np.inf
    for slabs, rows in parts:
        flat = chain.from_iterable(strip for _, found in slabs for strip in found)
        table = np.fromiter(flat, np.float64).reshape(-1, STRIP_WIDTH)
        counts = [len(found) for _, found in slabs]
        first = np.cumsum([0, *counts[:-1]])
        own = np.add.reduceat(table[:, STRIP_LANE] >= 0.0, first, dtype=np.int64)
        begins = [begin for begin, _ in slabs]
        across[rows, : len(slabs)] = np.column_stack([begins, first, counts, own])
        beside[rows, : len(table)] = table
    return {"slabs": across, "strips": beside, "grades": _grades(formulas)}


def _grades(formulas: Formulas) -> Floats:
    """Return the grades of imported roads (B, G, 2), filled up at the end."""
    parts = [(scenario.world.road.grades, rows) for scenario, rows, _ in formulas.parts]
    grades = np.zeros((formulas.runs, max(len(rising) for rising, _ in parts), 2))
    grades[:, :, 0] = np.inf
    for rising, rows in parts:
        if rising:
            grades[rows, : len(rising)] = rising
    return grades


def _lane_ends(formulas: Formulas) -> Floats:
    """Return where lanes of each run begin to narrow and how long they do (B, E, 2) [m]."""
    names = list(formulas.scenario.world.road.lane_ends)
    ends = np.zeros((formulas.runs, len(names), 2))
    length = formulas.values("world.road.length", lambda s: s.world.road.length)
    for row, name in enumerate(names):
        where = f"world.road.lane_ends.{name}"
        for column, field in enumerate(("s", "taper")):
            ends[:, row, column] = formulas.limited(
                f"{where}.{field}", _end(name, field), above=0.0
            )
        beyond = ends[:, row].sum(axis=1) > length + _ROUNDING
        if beyond.any():
            raise SpecError(
                f"{where}.s: the lane has ended at {ends[beyond, row].sum(axis=1)[0]:g} m, but the "
                f"road ends at {length[beyond][0]:g} m",
                remedy="Let it end sooner, or make the road longer.",
            )
    return ends


def _end(name: str, field: str) -> Pick:
    return lambda scenario: getattr(scenario.world.road.lane_ends[name], field)


def _slabs(road: Road, ends: Floats, width: float, shoulder: float, limit: float) -> Slabs:
    """Return what lies across a parametric road of one run, slab by slab.

    Args:
        road: How many lanes it has, and on which sides lanes end.
        ends: (E, 2) where each begins to narrow and how long it does [m].
        width: Of a lane [m].
        shoulder: [m].
        limit: [m/s].
    """
    sides = np.array([end.side == "right" for end in road.lane_ends.values()], dtype=np.bool_)
    first, taper = ends[:, 0], ends[:, 1]
    # Narrower than the least, a lane is none any more.
    narrow = min(LEAST_LANE, width)
    begins = np.unique(
        np.concatenate([[0.0], first, first + taper * (1.0 - narrow / width), first + taper])
    )

    def gone(s: float, which: NDArray[np.bool_]) -> float:
        return float(width * np.clip((s - first) / taper, 0.0, 1.0)[which].sum())

    whole = road.lanes * width
    slabs: list[tuple[float, tuple[tuple[float, ...], ...]]] = []
    for begin, end in zip(begins, [*begins[1:], begins[-1] + 1.0], strict=True):
        far, number = end - begin, 0
        low, high = ((gone(s, sides), whole - gone(s, ~sides)) for s in (begin, end))
        rows: list[tuple[float, float, float, Sequence[float], Sequence[float]]]
        rows = [(SHOULDER, 0.0, -1.0, (low[0] - shoulder, high[0] - shoulder), (low[0], high[0]))]
        for lane in range(road.lanes):
            right = [max(lane * width, edges[0]) for edges in (low, high)]
            left = [min((lane + 1) * width, edges[1]) for edges in (low, high)]
            wide = [b - a for a, b in zip(right, left, strict=True)]
            if max(wide) <= 0.0:
                continue
            is_lane = min(wide) >= narrow - _ROUNDING
            rows.append((DRIVING, OWN, float(number if is_lane else -1), right, left))
            number += is_lane
        rows.append((SHOULDER, 0.0, -1.0, (low[1], high[1]), (whole, whole)))
        rows += [
            (DRIVING, OPPOSITE, -1.0, [whole + k * width] * 2, [whole + (k + 1) * width] * 2)
            for k in range(road.opposite_lanes)
        ]
        slabs.append(
            (
                float(begin),
                tuple(
                    (
                        *(float(kind), way, limit, lane),
                        *(right[0], (right[1] - right[0]) / far),
                        *(left[0], (left[1] - left[0]) / far),
                    )
                    for kind, way, lane, right, left in rows
                    if max(b - a for a, b in zip(right, left, strict=True)) > 0.0
                ),
            )
        )
    return tuple(slabs)


def _check_arcs(kind: str, radius: Floats, arc: Floats, width: Floats) -> None:
    if (arc <= 0.0).any():
        raise SpecError(
            f"world.road.length: a {kind} begins with {LEAD_IN:g} m straight, and nothing is left "
            "of the length for its arc",
            remedy=f"Make the road longer than {LEAD_IN:g} m.",
        )
    # The inner edge is the left one in a left curve; the second arc of an S-curve turns both.
    tight = np.abs(radius) <= width
    if tight.any():
        raise SpecError(
            f"world.road.radius: {radius[tight][0]:g} m is not larger than the "
            f"{width[tight][0]:g} m that the lanes take",
            remedy="Use a larger radius.",
        )
    turn = arc / np.abs(radius)
    if (turn > MAX_TURN).any():
        raise SpecError(
            f"world.road.radius: an arc of the {kind} turns by {np.degrees(turn.max()):.0f} deg, "
            f"more than {np.degrees(MAX_TURN):.0f} deg",
            remedy="Use a larger radius or a shorter road.",
        )


def _join(pieces: list[tuple[Floats, Floats]], heading: Floats) -> Floats:
    segments = np.zeros((pieces[0][0].shape[0], len(pieces), 5))
    segments[:, 0, 2] = heading
    for number, (length, curvature) in enumerate(pieces):
        segments[:, number, 3] = length
        segments[:, number, 4] = curvature
    join_segments(segments)
    return segments


@compiled
def join_segments(segments: Floats) -> None:
    """Place segments one after the other, from the origin along the heading of the first.

    The chord of an arc that turns by ``a`` on a length ``l`` is ``l sin(a/2) / (a/2)`` long and
    turned by ``a/2``.

    Args:
        segments: (B, K, 5), length, curvature and the first heading given; x, y and heading out.
    """
    for run in range(segments.shape[0]):
        x, y, heading = 0.0, 0.0, segments[run, 0, 2]
        for number in range(segments.shape[1]):
            row = segments[run, number]
            row[0], row[1], row[2] = x, y, heading
            half = 0.5 * row[4] * row[3]
            chord = row[3] if half == 0.0 else row[3] * sin(half) / half
            sine, cosine = sin_cos(heading + half)
            x += chord * cosine
            y += chord * sine
            heading += 2.0 * half
