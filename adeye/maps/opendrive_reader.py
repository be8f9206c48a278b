"""Read a file of ASAM OpenDRIVE 1.4 to 1.8 into its records, with a report of what was not taken.

Source:
    ASAM OpenDRIVE 1.4H to 1.8.1; the names of elements and attributes are those of its schemas.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, nan
from pathlib import Path
from typing import Final

import numpy as np

from adeye.maps.losses import Losses
from adeye.maps.opendrive import (
    Connection,
    Floats,
    Geometry,
    GeometryKind,
    Junction,
    Lane,
    LaneSpeed,
    OpenDrive,
    Road,
    RoadLink,
    RoadMark,
    RoadType,
    Section,
    Signal,
    no_cubics,
)
from adeye.maps.xml_source import Element, parts_of

MOST_COORDINATE: Final = 1e7
"""Largest x and y [m]: nothing on a projected map of the earth is farther, and doubles still part
places there by nanometres. Our choice."""
MOST_LENGTH: Final = 1e6
"""Longest road [m]. Our choice."""

_CUBIC: Final = ("a", "b", "c", "d")
_KINDS: Final[dict[GeometryKind, tuple[str, ...]]] = {
    "line": (),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "poly3": _CUBIC,
    "paramPoly3": ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV"),
}
_UNITS: Final = {"m/s": (1.0, 1.0), "km/h": (1.0, 3.6), "mph": (1609.344, 3600.0)}
_NO_CUBICS: Final = no_cubics()
_OTHERS: Final = {
    "net": "a network of SUMO: convert it by netconvert --sumo-net-file … --opendrive-output …",
    "osm": "OpenStreetMap: convert it by netconvert --osm-files … --opendrive-output …",
    "OpenSCENARIO": "a scenario: name the map that its RoadNetwork names",
    "commonRoad": "a CommonRoad scenario",
    "html": "an HTML page: download the file itself",
}


def read_opendrive(path: str | Path) -> tuple[OpenDrive, Losses]:
    """Read a map.

    Args:
        path: Of the file.

    Returns:
        Its records, and what was not taken as it was written.

    Raises:
        SpecError: It is no such file, or says what cannot be; with line and column.
    """
    reader = _Reader(str(path))
    for part in parts_of(Path(path)):
        reader.read(part)
    return reader.finished(), reader.losses


class _Reader:
    """Makes records of the parts of a file."""

    def __init__(self, path: str) -> None:
        self.losses = Losses()
        self.path = path
        self.root: Element | None = None
        self.header: OpenDrive | None = None
        self.roads: dict[str, Road] = {}
        self.junctions: dict[str, Junction] = {}

    def read(self, part: Element) -> None:
        """Read the root, or a part below it."""
        if self.root is None:
            self.root = part
            if part.tag != "OpenDRIVE":
                other = _OTHERS.get(part.tag, "")
                raise part.error(
                    f"the file is not OpenDRIVE{f', but {other}' if other else ''}",
                    "Name an OpenDRIVE file (.xodr).",
                )
            return
        if part.tag == "header":
            self.read_header(part)
        elif part.tag == "road":
            road = self.read_road(part)
            self.roads[road.id] = road
        elif part.tag == "junction":
            junction = self.read_junction(part)
            self.junctions[junction.id] = junction
        else:
            self.losses.ignore(part.path, part.line)
            return
        self.losses.ignore_rest(part)

    def finished(self) -> OpenDrive:
        """Return the whole, when all parts are read."""
        assert self.root is not None
        if self.header is None:
            raise self.root.error("there is no <header>", "Is this the whole file?")
        if not self.roads:
            raise self.root.error("there is no <road>", "Is this the whole file?")
        head = self.header
        return OpenDrive(
            head.path, head.version, head.name, head.geo_reference, self.roads, self.junctions
        )

    def read_header(self, part: Element) -> None:
        version = part.whole("revMajor"), part.whole("revMinor")
        if version[0] != 1:
            raise part.error(f"revMajor is {version[0]}", "OpenDRIVE 1.4 to 1.8 is read.")
        geo = part.take_one("geoReference")
        self.header = OpenDrive(
            self.path, version, part.word("name", ""), geo.text.strip() if geo else ""
        )

    # --- Roads ------------------------------------------------------------------------------------

    def read_road(self, part: Element) -> Road:
        plan, lanes = part.take_one("planView"), part.take_one("lanes")
        if plan is None or lanes is None:
            raise part.error(f"it has no <{'lanes' if plan else 'planView'}>")
        link = part.take_one("link")
        elevation = part.take_one("elevationProfile")
        lateral = part.take_one("lateralProfile")
        signals = part.take_one("signals")
        junction = part.word("junction", "-1")
        return Road(
            id=part.word("id"),
            name=part.word("name", ""),
            length=part.number("length", None, 0.0, MOST_LENGTH),
            junction="" if junction == "-1" else junction,
            left_hand=part.choice("rule", ("RHT", "LHT"), "RHT") == "LHT",
            predecessor=self.read_link(link, "predecessor"),
            successor=self.read_link(link, "successor"),
            types=tuple(map(self.read_type, part.take("type"))),
            geometries=tuple(map(self.read_geometry, plan.take("geometry"))),
            elevations=self.cubics(elevation.take("elevation") if elevation else ()),
            superelevations=self.cubics(lateral.take("superelevation") if lateral else ()),
            offsets=self.cubics(lanes.take("laneOffset")),
            sections=tuple(map(self.read_section, lanes.take("laneSection"))),
            signals=tuple(map(self.read_signal, signals.take("signal"))) if signals else (),
            line=part.line,
        )

    def read_link(self, link: Element | None, name: str) -> RoadLink | None:
        found = link.take_one(name) if link is not None else None
        if found is None:
            return None
        return RoadLink(
            element=found.choice("elementType", ("road", "junction")),
            id=found.word("elementId"),
            contact=found.choice("contactPoint", ("start", "end"), ""),
            line=found.line,
        )

    def read_type(self, part: Element) -> RoadType:
        speed = part.take_one("speed")
        limit = nan if speed is None else self.limit(speed)
        return RoadType(_place(part), part.word("type"), limit, part.line)

    def limit(self, part: Element) -> float:
        """Read a speed limit [m/s]; infinite for none, NaN where the file leaves it open."""
        words = {"no limit": inf, "undefined": nan}
        unit = part.choice("unit", tuple(_UNITS), "m/s") or "m/s"
        if part.attributes.get("max") in words:
            return words[part.word("max")]
        value = part.number("max", None, 0.0)
        return value * _UNITS[unit][0] / _UNITS[unit][1]

    def read_geometry(self, part: Element) -> Geometry:
        kinds = [kind for kind in _KINDS if kind in part.children]
        if len(kinds) != 1:
            raise part.error(
                f"it has {'no shape' if not kinds else f'several shapes, {kinds}'}",
                f"Write one of {', '.join(_KINDS)} in it.",
            )
        kind = kinds[0]
        shape = part.take_one(kind)
        assert shape is not None
        return Geometry(
            kind=kind,
            s=_place(part),
            x=part.number("x", None, -MOST_COORDINATE, MOST_COORDINATE),
            y=part.number("y", None, -MOST_COORDINATE, MOST_COORDINATE),
            heading=part.number("hdg"),
            length=part.number("length", None, 0.0, MOST_LENGTH),
            parameters=tuple(shape.number(name) for name in _KINDS[kind]),
            normalized=kind == "paramPoly3" and self.is_normalized(shape),
            line=part.line,
        )

    def is_normalized(self, shape: Element) -> bool:
        return shape.choice("pRange", ("arcLength", "normalized"), "") != "arcLength"

    def cubics(self, parts: Sequence[Element], place: str = "s") -> Floats:
        """Read functions along the road: rows (s, a, b, c, d)."""
        if not parts:
            return _NO_CUBICS
        rows = np.array(
            [(_place(part, place), *(part.number(name) for name in _CUBIC)) for part in parts]
        )
        rows.setflags(write=False)
        return rows

    # --- Lanes ------------------------------------------------------------------------------------

    def read_section(self, part: Element) -> Section:
        lanes: list[Lane] = []
        for side in ("left", "center", "right"):
            group = part.take_one(side)
            lanes += map(self.read_lane, group.take("lane") if group is not None else ())
        lanes.sort(key=lambda lane: -lane.id)
        part.word("singleSide", "")
        return Section(_place(part), tuple(lanes), part.line)

    def read_lane(self, part: Element) -> Lane:
        link = part.take_one("link")
        return Lane(
            id=part.whole("id"),
            type=part.word("type", "none"),
            direction=part.choice("direction", ("standard", "reversed", "both"), "standard"),
            widths=self.cubics(part.take("width"), "sOffset"),
            borders=self.cubics(part.take("border"), "sOffset"),
            predecessors=_ids(link, "predecessor"),
            successors=_ids(link, "successor"),
            speeds=tuple(map(self.read_speed, part.take("speed"))),
            marks=tuple(map(self.read_mark, part.take("roadMark"))),
            line=part.line,
        )

    def read_speed(self, part: Element) -> LaneSpeed:
        return LaneSpeed(_place(part, "sOffset"), self.limit(part), part.line)

    def read_mark(self, part: Element) -> RoadMark:
        return RoadMark(
            s=_place(part, "sOffset"),
            kind=part.word("type", "none"),
            lane_change=part.choice("laneChange", ("increase", "decrease", "both", "none"), ""),
            width=part.number("width", nan, 0.0),
            line=part.line,
        )

    def read_signal(self, part: Element) -> Signal:
        return Signal(
            id=part.word("id"),
            s=_place(part),
            t=part.number("t"),
            orientation=part.choice("orientation", ("+", "-", "none"), "none"),
            dynamic=part.choice("dynamic", ("yes", "no"), "no") == "yes",
            country=part.word("country", ""),
            type=part.word("type", ""),
            subtype=part.word("subtype", ""),
            value=part.number("value", nan),
            unit=part.word("unit", ""),
            lanes=tuple(
                (item.whole("fromLane"), item.whole("toLane")) for item in part.take("validity")
            ),
            line=part.line,
        )

    # --- Junctions --------------------------------------------------------------------------------

    def read_junction(self, part: Element) -> Junction:
        kinds = ("default", "virtual", "direct", "crossing")
        kind = part.choice("type", kinds, "default")
        return Junction(
            id=part.word("id"),
            name=part.word("name", ""),
            type=kind,
            connections=tuple(map(self.read_connection, part.take("connection"))),
            priorities=tuple(
                (item.word("high", ""), item.word("low", "")) for item in part.take("priority")
            ),
            line=part.line,
        )

    def read_connection(self, part: Element) -> Connection:
        linked = part.word("linkedRoad", "")
        return Connection(
            id=part.word("id"),
            incoming=part.word("incomingRoad"),
            connecting=linked or part.word("connectingRoad"),
            contact=part.choice("contactPoint", ("start", "end")),
            lanes=tuple((item.whole("from"), item.whole("to")) for item in part.take("laneLink")),
            line=part.line,
        )


def _place(part: Element, name: str = "s") -> float:
    return part.number(name, None, 0.0, MOST_LENGTH)


def _ids(link: Element | None, name: str) -> tuple[int, ...]:
    return tuple(item.whole("id") for item in link.take(name)) if link is not None else ()
