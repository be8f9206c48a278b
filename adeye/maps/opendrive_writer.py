"""Write OpenDRIVE of 1.6 up: the records of a map, or the parametric road of a scenario.

The same records give the same bytes. What the records do not hold, such as objects, is not written.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from adeye import signals
from adeye.maps.losses import Loss
from adeye.maps.opendrive import (
    Floats,
    Geometry,
    Junction,
    Lane,
    OpenDrive,
    Road,
    RoadMark,
    RoadType,
    Section,
    Signal,
    no_cubics,
)
from adeye.signals import RoadMap

# --- The records of a map as a file ---------------------------------------------------------------

_OLDEST: Final = 6
"""Minor version that is written at least."""
_DIRECT, _DIRECTED = 7, 8
"""Minor versions that brought direct junctions, and directions of lanes."""
_NO_JUNCTION: Final = "-1"
_PARAMETERS: Final = {
    "line": (),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "poly3": ("a", "b", "c", "d"),
    "paramPoly3": ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV"),
}


def write_opendrive(network: OpenDrive) -> bytes:
    """Return a file of OpenDRIVE that reads as these records.

    Args:
        network: Its version is kept if it can say what is in there, and raised otherwise.
    """
    root = Element("OpenDRIVE")
    header = _add(
        root,
        "header",
        revMajor=network.version[0],
        revMinor=_minor(network),
        name=network.name,
        vendor="adeye",
    )
    if network.geo_reference:
        SubElement(header, "geoReference").text = network.geo_reference
    for road in network.roads.values():
        _add_road(root, road)
    for junction in network.junctions.values():
        _add_junction(root, junction)
    indent(root, " ")
    content: bytes = tostring(root, "UTF-8", xml_declaration=True)
    return content + b"\n"


def _minor(network: OpenDrive) -> int:
    is_direct = any(item.type == "direct" for item in network.junctions.values())
    is_directed = any(
        lane.direction not in {"", "standard"}
        for road in network.roads.values()
        for section in road.sections
        for lane in section.lanes
    )
    return max(network.version[1], _OLDEST, is_direct * _DIRECT, is_directed * _DIRECTED)


def _add(parent: Element, name: str, /, **attributes: object) -> Element:
    """Add an element; floats in the shortest way that reads as the same number."""
    texts = {
        key: repr(float(value)).removesuffix(".0") if isinstance(value, float) else str(value)
        for key, value in attributes.items()
    }
    return SubElement(parent, name, texts)


def _add_cubics(parent: Element, name: str, cubics: Floats, place: str = "s") -> None:
    for s, a, b, c, d in cubics:
        _add(parent, name, **{place: s, "a": a, "b": b, "c": c, "d": d})


def _add_road(root: Element, road: Road) -> None:
    element = _add(
        root,
        "road",
        name=road.name,
        length=road.length,
        id=road.id,
        junction=road.junction or _NO_JUNCTION,
        rule="LHT" if road.left_hand else "RHT",
    )
    ends = (("predecessor", road.predecessor), ("successor", road.successor))
    if any(end is not None for _, end in ends):
        link = _add(element, "link")
        for name, end in ends:
            if end is not None:
                contact = {"contactPoint": end.contact} if end.contact else {}
                _add(link, name, elementType=end.element, elementId=end.id, **contact)
    for kind in road.types:
        _add_limit(_add(element, "type", s=kind.s, type=kind.type), kind.limit)
    plan = _add(element, "planView")
    for piece in road.geometries:
        _add_geometry(plan, piece)
    _add_cubics(_add(element, "elevationProfile"), "elevation", road.elevations)
    _add_cubics(_add(element, "lateralProfile"), "superelevation", road.superelevations)
    lanes = _add(element, "lanes")
    _add_cubics(lanes, "laneOffset", road.offsets)
    for section in road.sections:
        _add_section(lanes, section)
    if road.signals:
        group = _add(element, "signals")
        for signal in road.signals:
            _add_signal(group, signal)


def _add_limit(parent: Element, limit: float) -> None:
    if not math.isnan(limit):
        _add(parent, "speed", max="no limit" if math.isinf(limit) else limit, unit="m/s")


def _add_geometry(plan: Element, piece: Geometry) -> None:
    element = _add(
        plan, "geometry", s=piece.s, x=piece.x, y=piece.y, hdg=piece.heading, length=piece.length
    )
    names = _PARAMETERS[piece.kind]
    curve = _add(element, piece.kind, **dict(zip(names, piece.parameters, strict=True)))
    if piece.kind == "paramPoly3":
        curve.set("pRange", "normalized" if piece.normalized else "arcLength")


def _add_section(lanes: Element, section: Section) -> None:
    element = _add(lanes, "laneSection", s=section.s)
    sides = (
        ("left", [lane for lane in section.lanes if lane.id > 0]),
        ("center", [lane for lane in section.lanes if lane.id == 0]),
        ("right", [lane for lane in section.lanes if lane.id < 0]),
    )
    for name, group in sides:
        if group:
            side = _add(element, name)
            for lane in group:
                _add_lane(side, lane)


def _add_lane(side: Element, lane: Lane) -> None:
    element = _add(side, "lane", id=lane.id, type=lane.type, level="false")
    if lane.direction not in {"", "standard"}:
        element.set("direction", lane.direction)
    if lane.predecessors or lane.successors:
        link = _add(element, "link")
        for number in lane.predecessors:
            _add(link, "predecessor", id=number)
        for number in lane.successors:
            _add(link, "successor", id=number)
    _add_cubics(element, "width", lane.widths, "sOffset")
    _add_cubics(element, "border", lane.borders, "sOffset")
    for mark in lane.marks:
        line = _add(element, "roadMark", sOffset=mark.s, type=mark.kind, color="standard")
        if not math.isnan(mark.width):
            line.set("width", repr(float(mark.width)))
        if mark.lane_change:
            line.set("laneChange", mark.lane_change)
    for speed in lane.speeds:
        # A lane has no words for no limit: XML's infinity is a number.
        limit = "INF" if math.isinf(speed.limit) else speed.limit
        _add(element, "speed", sOffset=speed.s, max=limit, unit="m/s")


def _add_signal(group: Element, signal: Signal) -> None:
    element = _add(
        group,
        "signal",
        s=signal.s,
        t=signal.t,
        id=signal.id,
        dynamic="yes" if signal.dynamic else "no",
        orientation=signal.orientation,
        zOffset=0.0,
        type=signal.type,
        subtype=signal.subtype,
    )
    if signal.country:
        element.set("country", signal.country)
    if not math.isnan(signal.value):
        element.set("value", repr(float(signal.value)))
        if signal.unit:
            element.set("unit", signal.unit)
    for first, last in signal.lanes:
        _add(element, "validity", fromLane=first, toLane=last)


def _add_junction(root: Element, junction: Junction) -> None:
    element = _add(root, "junction", name=junction.name, id=junction.id, type=junction.type)
    road = "linkedRoad" if junction.type == "direct" else "connectingRoad"
    for item in junction.connections:
        connection = _add(
            element,
            "connection",
            id=item.id,
            incomingRoad=item.incoming,
            **{road: item.connecting},
            contactPoint=item.contact,
        )
        for first, second in item.lanes:
            _add(connection, "laneLink", **{"from": first, "to": second})
    for high, low in junction.priorities:
        _add(element, "priority", high=high, low=low)


def map_losses(network: OpenDrive) -> Iterator[Loss]:
    """Yield what a file that is written lacks although it is needed: the records do not hold it."""
    for junction in network.junctions.values():
        if junction.type in {"virtual", "crossing"}:
            message = f"junction {junction.id!r}: where it is on its roads is not written"
            yield Loss("ignored", junction.line, f"junction type {junction.type}", message)


# --- The parametric road of a scenario as records of a map ----------------------------------------

_ROAD_TYPES: Final = {"motorway": "motorway", "rural": "rural", "urban": "town"}


def parametric_map(road: RoadMap, *, markings: str, road_type: str, path: str) -> OpenDrive:
    """Return the records of a parametric road.

    Its reference line is that of adeye, the right edge of lane 0. All lanes go along it, so they
    are right ones in OpenDRIVE, counted from the left edge, where the lane offset puts lane 0.
    Outside of them lie shoulder, bays and free verge, where there are any.

    Args:
        road: Of one run.
        markings: ``full``, ``worn`` or ``none``.
        road_type: ``motorway``, ``rural`` or ``urban``.
        path: Of the scenario, which names the map.
    """
    width, count = float(road.lane_width[0]), road.lanes
    depth = _refuge_depth(road.refuges[0])
    verge = _beyond(float(road.verge[0]), depth)
    strips = [("driving", _constant(width))] * count
    strips += [("shoulder", _constant(float(road.shoulder[0])))]
    strips += [("parking", depth), ("none", verge)]
    kept = [item for item in strips if item[1][:, 1:].any()]
    lanes = [_lane(0, "none", no_cubics(), _marks("solid", markings))]
    for number, (kind, widths) in enumerate(kept, 1):
        line = "broken" if number < count else "solid" if number == count else ""
        lanes.append(_lane(-number, kind, widths, _marks(line, markings)))
    length = float(road.segments[0, :, 3].sum())
    limit = float(road.speed_limit[0])
    only = Road(
        id="0",
        name="",
        length=length,
        junction="",
        left_hand=False,
        predecessor=None,
        successor=None,
        types=(RoadType(0.0, _ROAD_TYPES[road_type], limit, 0),),
        geometries=tuple(_pieces(road.segments[0])),
        elevations=no_cubics(),
        superelevations=no_cubics(),
        offsets=_constant(count * width),
        sections=(Section(0.0, tuple(lanes), 0),),
        signals=(),
        line=0,
    )
    return OpenDrive(path, (1, _DIRECT), path, "", {only.id: only}, {})


def losses_of(road: RoadMap, markings: str) -> Iterator[Loss]:
    """Yield what of a parametric road a file of OpenDRIVE says otherwise, or not at all."""
    if markings == "worn":
        message = "worn markings are written as whole ones"
        yield Loss("approximated", 0, "world.road.markings", message)
    rest = signals.REFUGE_KINDS.index("rest_area")
    if (road.refuges[0, :, signals.REFUGE_KIND] == rest).any():
        message = "a rest area is written as a lane of type parking, as parking bays are"
        yield Loss("approximated", 0, "world.road.bays", message)
    if road.verge[0] > 0.0:
        message = "free ground that carries a vehicle is written as a lane of type none"
        yield Loss("approximated", 0, "world.road.verge", message)
    if road.slabs.shape[1]:
        yield Loss(
            "ignored", 0, "world.road", "lanes of the other way, and their ends, are left out"
        )


def _lane(number: int, kind: str, widths: Floats, marks: tuple[RoadMark, ...]) -> Lane:
    return Lane(number, kind, "standard", widths, no_cubics(), (), (), (), marks, 0)


def _marks(line: str, markings: str) -> tuple[RoadMark, ...]:
    if not line or markings == "none":
        return ()
    return (RoadMark(0.0, line, "both" if line == "broken" else "none", math.nan, 0),)


def _pieces(segments: Floats) -> Iterator[Geometry]:
    s = 0.0
    for x, y, heading, length, curvature in segments.tolist():
        is_arc = curvature != 0.0
        yield Geometry(
            "arc" if is_arc else "line",
            s, x, y, heading, length,
            (curvature,) if is_arc else (),
            False,  # noqa: FBT003 - of another kind
            0,
        )  # fmt: skip
        s += length


def _constant(value: float) -> Floats:
    return np.array([[0.0, value, 0.0, 0.0, 0.0]])


def _linear(rows: Iterable[tuple[float, float, float]]) -> Floats:
    """Return cubics of rows (s, value, slope); where several begin at one place the last counts."""
    last: dict[float, tuple[float, float]] = {}
    begun = 0.0
    for s, value, slope in rows:
        # Bays may overlap by a rounding error.
        begun = max(begun, s)
        last[begun] = value, slope
    return np.array([[s, value, slope, 0.0, 0.0] for s, (value, slope) in last.items()])


def _refuge_depth(refuges: Floats) -> Floats:
    """Return how far bays (R, 5) reach beyond the shoulder, see ``kernel.road.refuge_depth``."""
    rows = [(0.0, 0.0, 0.0)]
    for _, s, length, depth, taper in refuges.tolist():
        if taper > 0.0:
            rows.append((s - taper, 0.0, depth / taper))
        rows.append((s, depth, 0.0))
        if taper > 0.0:
            rows.append((s + length, depth, -depth / taper))
        rows.append((s + length + taper, 0.0, 0.0))
    return _linear(rows)


def _beyond(verge: float, depth: Floats) -> Floats:
    """Return how far free ground reaches beyond the bays in it."""
    rows: list[tuple[float, float, float]] = []
    ends = [*depth[1:, 0].tolist(), math.inf]
    for (s, value, slope, _, _), end in zip(depth.tolist(), ends, strict=True):
        left = verge - value
        equal = s + left / slope if slope != 0.0 else s
        knots = [s, *([equal] if s < equal < end else []), end]
        for start, stop in pairwise(knots):
            middle = 0.5 * (start + stop) - s if slope != 0.0 else 0.0
            is_seen = left - slope * middle > 0.0
            at = left - slope * (start - s)
            rows.append((start, max(at, 0.0), -slope) if is_seen else (start, 0.0, 0.0))
    return _linear(rows)
