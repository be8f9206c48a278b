"""Whether a map holds together: what is wrong between its lanes, with the lines that say so."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from adeye.maps import lanes
from adeye.maps.network import (
    BUS,
    DRIVE,
    Joint,
    Network,
    Rows,
    build_of_rows,
    enters_by,
    is_joined,
    joints,
    leaves_by,
    link_at,
)
from adeye.maps.opendrive import FASTEST_POSTED, Floats, OpenDrive
from adeye.maps.opendrive_reader import LANE_TYPES
from adeye.maps.outlines import Points, points_along, strips_of
from adeye.units import shown

Severity = Literal["error", "warning", "note"]

GAP, WIDE_GAP = 0.01, 0.5
"""Between lanes that meet [m]: what is told, and what no vehicle should be led over."""
KINK, SHARP_KINK = math.radians(3.0), math.radians(20.0)
"""Between the headings of lanes that meet [rad]: what is told, and what cannot be driven."""
LEAST_RADIUS: Final = 4.1
"""What a car can turn: a wheelbase of 2.8 m with 35 degrees at the wheels [m]."""
NARROW: Final = 0.1
"""A lane of less width has ended, or not begun [m]."""
NO_WIDTH: Final = 0.01
OVERLAP, DEEP_OVERLAP = 0.3, 1.0
"""How far lanes reach into each other [m]: what is told, and what two vehicles would touch in."""
LEVEL: Final = 3.0
"""Roads that are further apart in height pass over each other [m]."""
STEP: Final = 2.0
"""Between the points of a lane that are looked at, at most [m]."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that is wrong with a map, or worth knowing.

    Attributes:
        kind: Such as ``gap``.
        severity: Whether it can be driven over, and whether anything is wrong at all.
        line: In the file.
        place: Lane or junction.
        x: [m], NaN if it is nowhere.
        y: [m].
        value: What was measured, in SI; NaN if nothing was.
        message: What is wrong.
    """

    kind: str
    severity: Severity
    line: int
    place: str
    x: float
    y: float
    value: float
    message: str


def check_topology(drive: OpenDrive) -> list[Finding]:
    """Return what is wrong between the lanes of a map, in the order of the file."""
    rows = Rows(drive)
    scene = _Scene(rows, build_of_rows(rows), points_along(strips_of(rows), STEP))
    said = list(joints(rows))
    found = [
        *_joint_findings(scene, said),
        *_ends(scene),
        *_shapes(scene),
        *_within(scene),
        *_words(scene),
        *_overlaps(scene, said),
        *_junctions(drive),
    ]
    return sorted(found, key=lambda item: (item.line, item.kind, item.place, item.message))


class _Scene:
    """A graph with the points of its lanes."""

    def __init__(self, rows: Rows, network: Network, points: Points) -> None:
        self.rows, self.network, self.points = rows, network, points
        self.is_driven = np.isin(network.kind, (DRIVE, BUS))

    def point(self, row: int, end: int) -> int:
        """Return the point at an end of a lane."""
        return int((self.points.last if end else self.points.first)[row])

    def finding(
        self, kind: str, severity: Severity, at: int, value: float, message: str, line: int = 0
    ) -> Finding:
        """Return a finding at a point."""
        points, row = self.points, int(self.points.row[at])
        return Finding(
            kind,
            severity,
            line or int(self.network.line[row]),
            f"{self.network.name(row)}, s {points.s[at]:.2f} m",
            float(points.x[at]),
            float(points.y[at]),
            value,
            message,
        )


# --- What lanes say of each other -----------------------------------------------------------------


def _joint_findings(scene: _Scene, said: list[Joint]) -> Iterator[Finding]:
    known = {(item.row, item.end, item.other, item.other_end) for item in said}
    measured: set[frozenset[tuple[int, int]]] = set()
    way, name = scene.network.way, scene.network.name
    for item in said:
        if not (scene.is_driven[item.row] and scene.is_driven[item.other]):
            continue
        here = scene.point(item.row, item.end)
        if item.is_mutual and (item.other, item.other_end, item.row, item.end) not in known:
            yield scene.finding(
                "one_sided",
                "warning",
                here,
                math.nan,
                f"is linked to {name(item.other)}, which is not linked to it",
                item.line,
            )
        pair = frozenset({(item.row, item.end), (item.other, item.other_end)})
        if pair in measured:
            continue
        measured.add(pair)
        goes_on = (
            leaves_by(way[item.row], item.end) and enters_by(way[item.other], item.other_end)
        ) or (leaves_by(way[item.other], item.other_end) and enters_by(way[item.row], item.end))
        if not goes_on:
            yield scene.finding(
                "wrong_way",
                "error",
                here,
                math.nan,
                f"is linked to {name(item.other)}, which is driven the other way",
                item.line,
            )
        yield from _steps(scene, item)


def _steps(scene: _Scene, item: Joint) -> Iterator[Finding]:
    points = scene.points
    here, there = scene.point(item.row, item.end), scene.point(item.other, item.other_end)
    other = scene.network.name(item.other)
    gap = math.hypot(points.x[here] - points.x[there], points.y[here] - points.y[there])
    if gap > GAP:
        severity: Severity = "error" if gap > WIDE_GAP else "warning"
        yield scene.finding(
            "gap", severity, here, gap, f"meets {other} with a gap of {gap:.3f} m", item.line
        )
    turned = points.heading[there] - points.heading[here]
    if item.end == item.other_end:
        turned += math.pi
    kink = abs(math.remainder(turned, 2.0 * math.pi))
    if kink > KINK:
        severity = "error" if kink > SHARP_KINK else "warning"
        message = f"meets {other} with a kink of {math.degrees(kink):.1f} deg"
        yield scene.finding("kink", severity, here, kink, message, item.line)


# --- Lanes that end -------------------------------------------------------------------------------

_AT_JUNCTION: Final[dict[bool, tuple[str, Severity, str]]] = {
    True: ("missing_connection", "error", "leads into"),
    False: ("unreached", "warning", "comes out of"),
}


def _ends(scene: _Scene) -> Iterator[Finding]:
    network = scene.network
    ends = [
        (row, end, is_exit)
        for row in np.flatnonzero(scene.is_driven & (network.way != 0)).tolist()
        for is_exit, neighbours in ((True, network.following), (False, network.preceding))
        if not scene.is_driven[neighbours(row)].any()
        for end in (0, 1)
        if leaves_by(network.way[row], end) == is_exit
    ]
    edge = [(row, end) for row, end, _ in ends if _link_of(scene, row, end) == "none"]
    begun = [(row, end) for row, end in edge if enters_by(network.way[row], end)]
    for row, end, is_exit in ends:
        at = scene.point(row, end)
        link = _link_of(scene, row, end)
        others = network.following(row) if is_exit else network.preceding(row)
        if len(others):
            # Works say by themselves why a lane ends.
            is_closed = any(scene.rows.lanes[other].type == "roadWorks" for other in others)
            if scene.points.width[at] > NARROW and not is_closed:
                kind, verb = ("dead_end", "leads into") if is_exit else ("unreached", "comes from")
                message = f"{verb} {network.name(int(others[0]))}, which is not driven on"
                yield scene.finding(kind, "warning", at, float(scene.points.width[at]), message)
        elif link == "none":
            if is_exit:
                yield _edge(scene, row, at, begun)
        elif link == "junction":
            kind, severity, verb = _AT_JUNCTION[is_exit]
            message = f"{verb} a junction that has no connection for it"
            yield scene.finding(kind, severity, at, math.nan, message)
        elif scene.points.width[at] > NARROW:
            kind, verb = ("dead_end", "goes on") if is_exit else ("unreached", "comes from")
            message = f"{verb} nowhere, and is {scene.points.width[at]:.2f} m wide here"
            yield scene.finding(kind, "warning", at, float(scene.points.width[at]), message)


def _link_of(scene: _Scene, row: int, end: int) -> str:
    """Tell what an end of a lane is linked to: ``section``, ``road``, ``junction`` or ``none``."""
    road_id, number, _ = scene.rows.keys[row]
    road = scene.rows.map.roads[road_id]
    if number != (len(road.sections) - 1 if end else 0):
        return "section"
    link = link_at(road, end)
    return "none" if link is None else link.element


def _edge(scene: _Scene, row: int, at: int, begun: list[tuple[int, int]]) -> Finding:
    """Return whether a road that is linked to nothing ends the map, or misses the next road."""
    points = scene.points
    for other, end in begun:
        there = scene.point(other, end)
        gap = math.hypot(points.x[at] - points.x[there], points.y[at] - points.y[there])
        if gap < WIDE_GAP and abs(points.z[at] - points.z[there]) < LEVEL and other != row:
            message = f"ends where {scene.network.name(other)} begins, and is not linked to it"
            return scene.finding("unlinked", "warning", at, gap, message)
    return scene.finding("map_edge", "note", at, math.nan, "ends with the map")


# --- Lanes that cannot be driven ------------------------------------------------------------------


def _shapes(scene: _Scene) -> Iterator[Finding]:
    points = scene.points
    for row in np.flatnonzero(scene.is_driven):
        part = slice(points.first[row], points.last[row] + 1)
        curvature, width = points.curvature[part], points.width[part]
        tightest, least = int(np.argmax(np.abs(curvature))), int(np.argmin(width))
        radius = 1.0 / max(abs(float(curvature[tightest])), 1e-12)
        if radius < LEAST_RADIUS:
            message = f"bends with R {radius:.2f} m, less than the {LEAST_RADIUS} m of a car"
            yield scene.finding("tight", "error", part.start + tightest, radius, message)
        if width.max() <= NO_WIDTH:
            message = "is driven on and has no width"
            yield scene.finding("no_width", "error", part.start, float(width.max()), message)
        elif width[least] < -NO_WIDTH:
            message = f"has borders that cross: its width is {width[least]:.2f} m"
            yield scene.finding(
                "no_width", "error", part.start + least, float(width[least]), message
            )


def _within(scene: _Scene) -> Iterator[Finding]:
    """Yield where a road's line, its height or one of its lanes does not go on."""
    for road in scene.rows.map.roads.values():
        laid = lanes.laid(road)
        lines = {piece.s: piece.line for piece in road.geometries}
        for step in lanes.steps_in(laid, lanes.REFERENCE, 0.0, road.length):
            yield from _step(step, lines[step.s], f"road {road.id}", "the line goes on")
        for strip in (strip for strips in laid.strips for strip in strips):
            row = scene.rows.find(road.id, strip.section, strip.lane.id)
            if row is not None and scene.is_driven[row]:
                for step in lanes.steps_in(laid, strip.center, strip.start, strip.end):
                    place = scene.network.name(row)
                    if step.s not in lines:
                        yield from _step(step, strip.lane.line, place, "goes on")
        for step in lanes.height_steps(road, 0.0, road.length):
            yield from _step(step, road.line, f"road {road.id}", "the height goes on")


def _words(scene: _Scene) -> Iterator[Finding]:
    """Yield what is said of roads and lanes and cannot be meant."""
    for road in scene.rows.map.roads.values():
        for kind in road.types:
            yield from _limit(kind.limit, kind.line, f"road {road.id}, s {kind.s:.2f} m")
        for number, section in enumerate(road.sections):
            for lane in section.lanes:
                place = f"road {road.id}, section {number}, lane {lane.id}"
                if lane.type not in LANE_TYPES:
                    message = f"type {shown(lane.type)} is none of OpenDRIVE: it is not driven on"
                    yield _nowhere("unknown_type", "warning", lane.line, place, message)
                row = scene.rows.find(road.id, number, lane.id)
                for speed in lane.speeds if row is not None and scene.is_driven[row] else ():
                    yield from _limit(speed.limit, speed.line, place)


def _limit(limit: float, line: int, place: str) -> Iterator[Finding]:
    """Yield what is wrong with a speed limit [m/s]; infinite for none, NaN if nothing is said."""
    if limit <= 0.0:
        message = "has a speed limit of 0, so that nobody may drive on"
        yield _nowhere("no_speed", "error", line, place, message)
    elif FASTEST_POSTED < limit < math.inf:
        message = (
            f"has a speed limit of {3.6 * limit:.0f} km/h, more than any road has: if its unit is "
            "missing, it is read as m/s"
        )
        yield Finding("fast", "warning", line, place, math.nan, math.nan, limit, message)


def _step(step: lanes.Step, line: int, place: str, what: str) -> Iterator[Finding]:
    """Yield what is wrong where a line goes on within a road."""
    place = f"{place}, s {step.s:.2f} m"
    if step.gap > GAP:
        severity: Severity = "error" if step.gap > WIDE_GAP else "warning"
        message = f"{what} with a gap of {step.gap:.3f} m"
        yield Finding("gap", severity, line, place, step.x, step.y, step.gap, message)
    if step.kink > KINK:
        severity = "error" if step.kink > SHARP_KINK else "warning"
        message = f"{what} with a kink of {math.degrees(step.kink):.1f} deg"
        yield Finding("kink", severity, line, place, step.x, step.y, step.kink, message)


def _overlaps(scene: _Scene, said: list[Joint]) -> Iterator[Finding]:
    """Yield roads that reach into each other at one level, and no junction or link says why."""
    one, other, depth = _near_points(scene)
    keep = np.argsort(-depth, kind="stable")
    linked = {frozenset((item.row, item.other)) for item in said}
    told: set[frozenset[int]] = set()
    network, points = scene.network, scene.points
    for a, b, deep in zip(one[keep].tolist(), other[keep].tolist(), depth[keep], strict=True):
        row, second = int(points.row[a]), int(points.row[b])
        roads = frozenset((int(network.road[row]), int(network.road[second])))
        if roads in told or frozenset((row, second)) in linked or _is_fork(network, row, second):
            continue
        told.add(roads)
        severity: Severity = "error" if deep > DEEP_OVERLAP else "warning"
        message = f"reaches {deep:.2f} m into {network.name(second)}, in no junction with it"
        yield scene.finding("overlap", severity, a, float(deep), message)


def _is_fork(network: Network, row: int, other: int) -> bool:
    """Tell whether two lanes part or meet: they lie in each other there."""
    return any(
        np.intersect1d(neighbours(row), neighbours(other)).size
        for neighbours in (network.following, network.preceding)
    )


def _near_points(scene: _Scene) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """Return pairs of points of different roads whose lanes reach into each other, and how far."""
    network, points = scene.network, scene.points
    kept = np.flatnonzero(scene.is_driven[points.row] & (points.width > NARROW))
    if not len(kept):
        return kept, kept, np.zeros(0)
    size = max(float(points.width[kept].max()), STEP)
    x = np.floor(points.x[kept] / size).astype(np.int64)
    y = np.floor(points.y[kept] / size).astype(np.int64)
    # One number a cell, with a border so that neighbours in x are not those of another y.
    x, y = x - x.min() + 1, y - y.min() + 1
    across = int(x.max()) + 2
    cell = y * across + x
    order = np.argsort(cell, kind="stable")
    kept, cell = kept[order], cell[order]
    found = []
    for shift in (0, 1, across - 1, across, across + 1):
        begin, stop = (np.searchsorted(cell, cell + shift, side) for side in ("left", "right"))
        counts = stop - begin
        one = np.repeat(np.arange(len(kept)), counts)
        other = np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts) + begin[one]
        a, b = kept[one], kept[other]
        road_a, road_b = network.road[points.row[a]], network.road[points.row[b]]
        joined = network.junction[points.row[a]]
        is_apart = (joined >= 0) & (joined == network.junction[points.row[b]])
        good = (road_a != road_b) & ~is_apart & (np.abs(points.z[a] - points.z[b]) < LEVEL)
        a, b = a[good], b[good]
        depth = np.maximum(_depth(points, a, b), _depth(points, b, a))
        deep = depth > OVERLAP
        found.append((a[deep], b[deep], depth[deep]))
    one, other, depth = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return one, other, depth


def _depth(points: Points, a: NDArray[np.int64], b: NDArray[np.int64]) -> Floats:
    """Return how far a lane at a point reaches into another lane at a point of that."""
    dx, dy = points.x[a] - points.x[b], points.y[a] - points.y[b]
    sine, cosine = np.sin(points.heading[b]), np.cos(points.heading[b])
    across = np.abs(dy * cosine - dx * sine)
    along = np.abs(dx * cosine + dy * sine)
    side = 0.5 * points.width[a] * np.abs(np.cos(points.heading[a] - points.heading[b]))
    depth: Floats = 0.5 * points.width[b] + side - across
    return np.where(along <= 0.55 * STEP, depth, -np.inf)


# --- Junctions ------------------------------------------------------------------------------------


def _junctions(drive: OpenDrive) -> Iterator[Finding]:
    used = {
        (junction.id, item.connecting)
        for junction in drive.junctions.values()
        for item in junction.connections
    }
    for road in drive.roads.values():
        if road.junction and (road.junction, road.id) not in used:
            message = f"belongs to junction {road.junction}, none of whose connections takes it"
            yield _nowhere("unused_road", "warning", road.line, f"road {road.id}", message)
    for junction in drive.junctions.values():
        for item in junction.connections:
            place = f"junction {junction.id}, connection {item.id}"
            if not item.lanes:
                message = "links no lanes"
                yield _nowhere("no_lane_links", "warning", item.line, place, message)
            if not is_joined(drive, junction, item):
                message = f"comes from road {item.incoming}, which is not joined to the junction"
                yield _nowhere("not_joined", "error", item.line, place, message)


def _nowhere(kind: str, severity: Severity, line: int, place: str, message: str) -> Finding:
    return Finding(kind, severity, line, place, math.nan, math.nan, math.nan, message)
