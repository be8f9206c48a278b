"""Read a file of ASAM OpenDRIVE 1.4 to 1.8 into its records, with a report of what was not taken.

Source:
    ASAM OpenDRIVE 1.4H to 1.8.1; the names of elements and attributes are those of its schemas.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise, zip_longest
from math import inf, nan
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar

import numpy as np

from adeye.maps.losses import Losses, require_none
from adeye.maps.opendrive import (
    FASTEST,
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
from adeye.maps.opendrive_links import linked
from adeye.maps.xml_source import MOST, Element, listed, parts_of
from adeye.notices import notice
from adeye.units import shown


class Rules(Protocol):
    """What people say of a map where its file leaves it to a guess."""

    def lane_type(self, written: str) -> str:
        """Return which type of lanes is meant."""

    def lanes(self, junction: str, connection: str) -> Sequence[tuple[int, int]]:
        """Return the lanes of a connection that names none, as far as they are given."""

    def require_used(self) -> None:
        """Refuse rules of what the map does not leave to a guess."""


Record = TypeVar("Record", Road, Junction)

ROUNDING: Final = 0.01
"""Lengths that differ by no more are taken for one [m]: files are written with two decimals."""
REPAIRED: Final = 0.5
"""Lengths that differ by more are an error [m], less is repaired. Our choice."""
LEAST: Final = 1e-6
"""Shortest piece of a line or section of lanes [m]."""
MOST_LENGTH: Final = 1e6
"""Longest road [m]. Our choice, as the others."""
MOST_WIDTH: Final = 1_000.0
MOST_CURVATURE: Final = 10.0
MOST_TURN: Final = 1_000.0
"""Largest heading, and largest turn of one piece [rad]."""
MOST_STRETCH: Final = 10.0
"""How much farther than its length a piece may lead away from its start."""
STEEP: Final = 0.1
"""Slope across the road from which on a notice tells that it is not driven."""

_CUBIC: Final = ("a", "b", "c", "d")
_KINDS: Final[dict[GeometryKind, tuple[str, ...]]] = {
    "line": (),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "poly3": _CUBIC,
    "paramPoly3": ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV"),
}
_SIDES: Final = (("left", 1), ("center", 0), ("right", -1))
"""With the sign of the ids of their lanes."""
_UNITS: Final = {"m/s": (1.0, 1.0), "km/h": (1.0, 3.6), "mph": (1609.344, 3600.0)}
_NO_CUBICS: Final = no_cubics()
_SHARES: Final = np.linspace(0.0, 1.0, 9)[:, np.newaxis]
_OTHERS: Final = {
    "net": "a network of SUMO: convert it by netconvert --sumo-net-file … --opendrive-output …",
    "osm": "OpenStreetMap: convert it by netconvert --osm-files … --opendrive-output …",
    "OpenSCENARIO": "a scenario: name the map that its RoadNetwork names",
    "commonRoad": "a CommonRoad scenario",
    "html": "an HTML page: download the file itself",
}
LANE_TYPES: Final = frozenset(
    [
        *("HOV", "bidirectional", "biking", "border", "bus", "connectingRamp", "curb", "driving"),
        *("entry", "exit", "median", "mwyEntry", "mwyExit", "none", "offRamp", "onRamp"),
        *("parking", "rail", "restricted", "roadWorks", "shared", "shoulder", "sidewalk"),
        *("slipLane", "special1", "special2", "special3", "stop", "taxi", "tram", "walking"),
    ]
)
"""Those of the standard, deprecated ones included."""


def read_opendrive(
    path: str | Path, rules: Rules | None = None, *, strict: bool = False
) -> tuple[OpenDrive, Losses]:
    """Read a map.

    Args:
        path: Of the file.
        rules: What people say of what it leaves to a guess.
        strict: Whether anything that is not taken as it is written is an error.

    Returns:
        Its records, whose links lead to what is there, and what was not taken as it was written.

    Raises:
        SpecError: It is no such file, or says what cannot be; with line and column.
        InputErrors: It is not taken as it is written, and that was asked for.
    """
    reader = _Reader(str(path), rules)
    for part in parts_of(Path(path)):
        reader.read(part)
    if rules is not None:
        rules.require_used()
    drive = linked(reader.finished(), reader.columns, reader.losses)
    if strict:
        require_none(reader.losses, str(path))
    return drive, reader.losses


class _Reader:
    """Makes records of the parts of a file.

    Attributes:
        losses: What was not taken as it was written.
        columns: Of links, lanes and connections, by the identity of their records.
    """

    def __init__(self, path: str, rules: Rules | None) -> None:
        self.losses = Losses()
        self.columns: dict[int, int] = {}
        self._path = path
        self._rules = rules
        self._root: Element | None = None
        self._header: OpenDrive | None = None
        self._roads: dict[str, Road] = {}
        self._junctions: dict[str, Junction] = {}

    def read(self, part: Element) -> None:
        """Read the root, or a part below it."""
        if self._root is None:
            self._root = part
            if part.tag != "OpenDRIVE":
                other = _OTHERS.get(part.tag, "")
                raise part.error(
                    f"the file is not OpenDRIVE{f', but {other}' if other else ''}",
                    "Name an OpenDRIVE file (.xodr).",
                )
        elif part.tag == "header":
            if self._header is not None:
                raise part.error("there is a second one", "Remove one.")
            self._header = self._read_header(part)
        elif part.tag == "road":
            _keep(self._roads, self._read_road(part), part)
        elif part.tag == "junction":
            _keep(self._junctions, self._read_junction(part), part)
        else:
            self.losses.ignore(part)
            return
        self.losses.ignore_rest(part)

    def finished(self) -> OpenDrive:
        """Return the whole, when all parts are read."""
        assert self._root is not None
        if self._header is None:
            raise self._root.error("there is no <header>", "Is this the whole file?")
        if not self._roads:
            raise self._root.error("there is no <road>", "Is this the whole file?")
        return replace(self._header, roads=self._roads, junctions=self._junctions)

    def _read_header(self, part: Element) -> OpenDrive:
        major, minor = part.whole("revMajor"), part.whole("revMinor")
        if major != 1:
            raise part.error(f"revMajor is {major}", "OpenDRIVE 1.4 to 1.8 is read.")
        if not 4 <= minor <= 8:
            taken = "1.4" if minor < 4 else "1.8"
            self.losses.add("guessed", part, f"version 1.{minor} is read as if it were {taken}")
        geo = part.take_one("geoReference")
        text = geo.take_text() if geo is not None else ""
        return OpenDrive(self._path, (major, minor), part.word("name", ""), text)

    # --- Roads ------------------------------------------------------------------------------------

    def _read_road(self, part: Element) -> Road:
        road = part.word("id")
        part.name = self.losses.about = f"road {shown(road)}"
        plan, lanes = part.take_one("planView"), part.take_one("lanes")
        if plan is None or lanes is None:
            raise part.error(f"it has no <{'lanes' if plan else 'planView'}>")
        geometries = self._read_geometries(plan)
        length = self._length(part, geometries)
        link = part.take_one("link")
        elevation, lateral = part.take_one("elevationProfile"), part.take_one("lateralProfile")
        signals = part.take_one("signals")
        junction = part.word("junction", "-1")
        return Road(
            id=road,
            name=part.word("name", ""),
            length=length,
            junction="" if junction == "-1" else junction,
            left_hand=part.choice("rule", ("RHT", "LHT"), "RHT") == "LHT",
            predecessor=self._read_link(link, "predecessor", road),
            successor=self._read_link(link, "successor", road),
            types=tuple(self._read_type(*item) for item in self._ordered(part.take("type"))),
            geometries=geometries,
            elevations=self._elevations(elevation, length),
            superelevations=self._superelevations(lateral, length),
            offsets=self._cubics(lanes.take("laneOffset"), length, "s", MOST_WIDTH),
            sections=self._read_sections(lanes, length),
            signals=tuple(
                self._read_signal(item, length)
                for item in (signals.take("signal") if signals else ())
            ),
            line=part.line,
        )

    def _length(self, part: Element, geometries: Sequence[Geometry]) -> float:
        """Return the length of a road: the file's, or that of its line where they differ."""
        length = part.number("length", None, 0.0, MOST_LENGTH)
        end = geometries[-1].s + geometries[-1].length
        if abs(end - length) <= ROUNDING:
            return length
        what = f"length is {length:g} m, and its line ends at {end:g} m"
        if abs(end - length) > REPAIRED:
            raise part.error(what, f"Differences up to {REPAIRED:g} m are repaired.")
        self.losses.add("repaired", part, f"{what}: the line counts")
        return end

    def _read_link(self, link: Element | None, name: str, road: str) -> RoadLink | None:
        found = link.take_one(name) if link is not None else None
        if found is None:
            return None
        # What leads into the middle of a road, at elementS, has no end to touch.
        inside = "elementS" in found.attributes
        element = found.choice("elementType", ("road", "junction"), "road" if inside else None)
        contact = ""
        if element == "road":
            contact = found.choice("contactPoint", ("start", "end"), "" if inside else None)
        else:
            # A junction has no ends.
            found.word("contactPoint", "")
        result = RoadLink(element, found.word("elementId"), contact, found.line)
        own = "end" if name == "successor" else "start"
        if (result.element, result.id, result.contact) == ("road", road, own):
            raise found.error(f"the road's {own} is linked to itself", "Link it to another end.")
        self.columns[id(result)] = found.column
        return result

    def _read_type(self, s: float, part: Element) -> RoadType:
        speed = part.take_one("speed")
        limit = nan if speed is None else self._limit(speed)
        return RoadType(s, part.word("type"), limit, part.line)

    def _limit(self, part: Element) -> float:
        """Read a speed limit [m/s]; infinite for none, NaN where the file leaves it open."""
        unit = part.choice("unit", tuple(_UNITS), "m/s")
        words = {"no limit": inf, "undefined": nan}
        if part.attributes.get("max") in words:
            return words[part.word("max")]
        factor = _UNITS[unit][0] / _UNITS[unit][1]
        return part.number("max", None, 0.0, FASTEST / factor) * factor

    def _read_geometries(self, plan: Element) -> tuple[Geometry, ...]:
        """Read the pieces of a line: each begins where the one before ends."""
        found: list[Geometry] = []
        for s, part in self._ordered(plan.take("geometry")):
            piece = self._read_geometry(s, part)
            if piece.length < LEAST:
                self.losses.add("repaired", part, f"the piece at {s:g} m has no length: left out")
                continue
            end = found[-1].s + found[-1].length if found else 0.0
            before = "the piece before ends" if found else "the road begins"
            self._check_joint(part, s, end, before, counts="s" if found else "its begin")
            found.append(piece if found else replace(piece, s=0.0))
        if not found:
            raise plan.error("it has no <geometry> of any length")
        return tuple(found)

    def _check_joint(
        self, part: Element, s: float, end: float, before: str, *, counts: str = "its begin"
    ) -> None:
        """Check that something begins where what is before it ends."""
        if abs(s - end) <= ROUNDING:
            return
        what = f"s is {s:g} m, and {before} at {end:g} m"
        if abs(s - end) > REPAIRED:
            raise part.error(what, f"Differences up to {REPAIRED:g} m are repaired.")
        self.losses.add("repaired", part, f"{what}: {counts} counts")

    def _read_geometry(self, s: float, part: Element) -> Geometry:
        kinds = [kind for kind in _KINDS if kind in part.children]
        if len(kinds) != 1:
            raise part.error(
                f"it has {f'several shapes, {listed(kinds)}' if kinds else 'no shape'}",
                f"Write one of {', '.join(_KINDS)} in it.",
            )
        kind = kinds[0]
        shape = part.take_one(kind)
        assert shape is not None
        most = MOST_CURVATURE if kind in {"arc", "spiral"} else MOST
        piece = Geometry(
            kind=kind,
            s=s,
            x=part.number("x"),
            y=part.number("y"),
            heading=part.number("hdg", None, -MOST_TURN, MOST_TURN),
            length=part.number("length", None, 0.0, MOST_LENGTH),
            parameters=tuple(shape.number(name, None, -most, most) for name in _KINDS[kind]),
            normalized=kind == "paramPoly3" and self._is_normalized(shape),
            line=part.line,
        )
        _check_extent(part, piece)
        return piece

    def _is_normalized(self, shape: Element) -> bool:
        if "pRange" not in shape.attributes:
            self.losses.add("guessed", shape, "pRange is missing: taken as normalized")
        return shape.choice("pRange", ("arcLength", "normalized"), "normalized") == "normalized"

    def _ordered(self, parts: Sequence[Element], name: str = "s") -> list[tuple[float, Element]]:
        """Take the places of parts, and put them in order."""
        found = [
            (max(0.0, part.number(name, None, -ROUNDING, MOST_LENGTH)), part) for part in parts
        ]
        for (before, _), (s, part) in pairwise(found):
            if s < before:
                self.losses.add("repaired", part, f"{name} is {s:g} after {before:g}: put in order")
                return sorted(found, key=itemgetter(0))
        return found

    def _cubics(
        self, parts: Sequence[Element], end: float, name: str = "s", most: float = MOST
    ) -> Floats:
        """Read functions along the road, no larger than that: rows (s, a, b, c, d)."""
        if not parts:
            return _NO_CUBICS
        rows: list[tuple[float, ...]] = []
        for s, part in self._ordered(parts, name):
            # Without -0.0, so that equal rows are the same.
            row = (s, *(part.number(letter) + 0.0 for letter in _CUBIC))
            if s > end + ROUNDING:
                self.losses.add(
                    "repaired", part, f"{name} is {s:g} m, behind the end at {end:g} m: left out"
                )
                continue
            if rows and rows[-1][0] == s:
                self.losses.add("repaired", part, f"a second one at {s:g} m: it counts")
                rows.pop()
            rows.append(row)
        found = _cubic_rows(tuple(rows))
        if _largest(found, end) > most:
            raise parts[0].error(
                f"it comes to {_largest(found, end):g} m", f"Up to {most:g} m are read."
            )
        return found

    def _elevations(self, profile: Element | None, length: float) -> Floats:
        rows = self._cubics(profile.take("elevation") if profile is not None else (), length)
        if profile is not None and rows[:, 1:].any():
            self.losses.add(
                "approximated",
                profile,
                "grades pull at the ego; sight over crests and pitch are not told",
            )
        return rows

    def _superelevations(self, profile: Element | None, length: float) -> Floats:
        """Read how far the road leans to a side; crossfall (before 1.6) leans as well."""
        if profile is None:
            return _NO_CUBICS
        rows = self._cubics(profile.take("superelevation"), length)
        for tag, leaning in (
            ("superelevation", rows),
            ("crossfall", self._cubics(profile.take("crossfall"), length)),
        ):
            steepest = _largest(leaning, length)
            if steepest:
                what = f"{tag} of up to {100.0 * steepest:.3g} % is not driven: roads are flat"
                self.losses.add("approximated", profile, what)
            if steepest > STEEP:
                where = f"{self._path}:{profile.line}: {self.losses.about}"
                notice(f"{where}: {what}", topic=self._path, every_s=60.0)
        return rows

    # --- Lanes ------------------------------------------------------------------------------------

    def _read_sections(self, lanes: Element, length: float) -> tuple[Section, ...]:
        """Read the sections: each begins behind the one before, within the road."""
        placed = self._ordered(lanes.take("laneSection"))
        inside = [item for item in placed if item[0] <= length - LEAST]
        for s, part in placed[len(inside) :]:
            what = f"s is {s:g} m, and the road is {length:g} m long"
            if not inside or s > length + REPAIRED:
                raise part.error(what, "Let it begin within the road.")
            self.losses.add("repaired", part, f"{what}: left out")
            part.abandon()
        if not inside:
            raise lanes.error("it has no <laneSection>")
        self._check_joint(inside[0][1], inside[0][0], 0.0, "the road begins")
        starts = [0.0, *(s for s, _ in inside[1:]), length]
        # By side, where sections begin that say something of it.
        begins: dict[str, list[float]] = {side: [] for side, _ in _SIDES}
        for start, (_, part) in zip(starts, inside, strict=False):
            is_single = part.choice("singleSide", ("true", "false"), "false") == "true"
            for side in begins if start == 0.0 or not is_single else begins & part.children.keys():
                begins[side].append(start)
        sections: list[Section] = []
        for number, (_, part) in enumerate(inside):
            start, end = starts[number : number + 2]
            if end - start < LEAST:
                raise part.error(f"two sections begin at {end:g} m", "Leave one out.")
            ends = {
                side: min((s for s in found if s > start), default=length)
                for side, found in begins.items()
            }
            section = self._read_section(part, start, ends)
            for side, sign in _SIDES:
                if start not in begins[side]:
                    sections[-1], section = _carried_on(sections[-1], section, sign)
            sections.append(section)
        return tuple(sections)

    def _read_section(self, part: Element, start: float, ends: Mapping[str, float]) -> Section:
        lanes: list[Lane] = []
        for side, sign in _SIDES:
            group, length = part.take_one(side), ends[side] - start
            found = [self._read_lane(item, length) for item in group.take("lane")] if group else []
            found.sort(key=lambda lane: -lane.id)
            wanted = [sign * (k + 1) for k in range(len(found))] if sign else [0]
            wanted.sort(reverse=True)
            ids = [lane.id for lane in found]
            if sign == 0 and not found:
                self.losses.add("repaired", part, "lane 0 is missing: put in")
                none = _NO_CUBICS
                found = [Lane(0, "none", "standard", none, none, (), (), (), (), part.line)]
            elif ids != wanted:
                assert group is not None
                raise group.error(
                    f"the ids of its lanes are {listed(ids)}", f"Write {listed(wanted)}."
                )
            lanes += found
        return Section(start, tuple(lanes), part.line)

    def _read_lane(self, part: Element, length: float) -> Lane:
        number = part.whole("id")
        part.name = f"lane {number}"
        link = part.take_one("link")
        kind = part.word("type", "none")
        if kind not in LANE_TYPES and self._rules is not None:
            kind = self._rules.lane_type(kind)
        if kind not in LANE_TYPES:
            self.losses.add("guessed", part, f"type {shown(kind)} is not known: not driven on")
        lane = Lane(
            id=number,
            type=kind,
            direction=part.choice("direction", ("standard", "reversed", "both"), "standard"),
            **self._read_widths(part, number, length),
            predecessors=_ids(link, "predecessor"),
            successors=_ids(link, "successor"),
            speeds=tuple(
                LaneSpeed(s, limit, item.line)
                for s, item in self._ordered(part.take("speed"), "sOffset")
                if (limit := self._limit(item)) == limit  # not NaN
            ),
            marks=tuple(
                self._read_mark(*item) for item in self._ordered(part.take("roadMark"), "sOffset")
            ),
            line=part.line,
        )
        self.columns[id(lane)] = part.column
        return lane

    def _read_widths(self, part: Element, number: int, length: float) -> dict[str, Floats]:
        """Read how wide a lane is, or where its outer border is; of both, the widths count."""
        widths = self._cubics(part.take("width"), length, "sOffset", MOST_WIDTH)
        borders = self._cubics(part.take("border"), length, "sOffset", MOST_WIDTH)
        if number == 0:
            if len(widths) or len(borders):
                self.losses.add("ignored", part, "lane 0 has no width")
            return {"widths": _NO_CUBICS, "borders": _NO_CUBICS}
        if len(widths) and len(borders):
            self.losses.add("ignored", part, "there are widths, so its borders do not count")
            borders = _NO_CUBICS
        rows = widths if len(widths) else borders
        if not len(rows):
            raise part.error("it has neither <width> nor <border>", "Write how wide it is.")
        if len(widths) and rows[:, 1].min() < -ROUNDING:
            raise part.error(f"width is {rows[:, 1].min():g} m", "Write one of 0 m or more.")
        if rows[0, 0] > 0.0:
            self._check_joint(part, float(rows[0, 0]), 0.0, "the section begins")
            # Before its first row it is as wide as at it.
            rows = np.vstack([(0.0, rows[0, 1], 0.0, 0.0, 0.0), rows])
        if len(borders) and rows[0, 1] * number < 0.0:
            message = "its border is on the other side: taken for a distance to its own"
            self.losses.add("repaired", part, message)
            rows = rows * np.array([1.0, -1.0, -1.0, -1.0, -1.0])
        return {
            "widths": rows if len(widths) else _NO_CUBICS,
            "borders": _NO_CUBICS if len(widths) else rows,
        }

    def _read_mark(self, s: float, part: Element) -> RoadMark:
        return RoadMark(
            s=s,
            kind=part.word("type", "none"),
            lane_change=part.choice("laneChange", ("increase", "decrease", "both", "none"), ""),
            width=part.number("width", nan, 0.0),
            line=part.line,
        )

    def _read_signal(self, part: Element, length: float) -> Signal:
        value = nan
        if part.attributes.get("value", "") in {"", "none"}:
            part.word("value", "")
        else:
            value = part.number("value")
        return Signal(
            id=part.word("id"),
            s=part.number("s", None, -ROUNDING, length + REPAIRED),
            t=part.number("t"),
            orientation=part.choice("orientation", ("+", "-", "none"), "none"),
            dynamic=part.choice("dynamic", ("yes", "no"), "no") == "yes",
            country=part.word("country", ""),
            type=part.word("type", ""),
            subtype=part.word("subtype", ""),
            value=value,
            unit=part.word("unit", ""),
            lanes=tuple(
                (item.whole("fromLane"), item.whole("toLane")) for item in part.take("validity")
            ),
            line=part.line,
        )

    # --- Junctions --------------------------------------------------------------------------------

    def _read_junction(self, part: Element) -> Junction:
        junction = part.word("id")
        part.name = self.losses.about = f"junction {shown(junction)}"
        kind = part.choice("type", ("default", "virtual", "direct", "crossing"), "default")
        # Where a virtual junction is at its main road is where its connections are.
        found = [self._read_connection(item, junction, kind) for item in part.take("connection")]
        return Junction(
            id=junction,
            name=part.word("name", ""),
            type=kind,
            connections=tuple(item for item in found if item is not None),
            priorities=tuple(
                (item.word("high", ""), item.word("low", "")) for item in part.take("priority")
            ),
            line=part.line,
        )

    def _read_connection(self, part: Element, junction: str, kind: str) -> Connection | None:
        # Those of direct junctions link another road, by the name of 1.7.
        name = "linkedRoad" if "linkedRoad" in part.attributes else "connectingRoad"
        if kind == "virtual" and name not in part.attributes:
            self.losses.add("ignored", part, "a connection without a road of its own")
            return None
        number = part.word("id")
        lanes = [(item.whole("from"), item.whole("to")) for item in part.take("laneLink")]
        if not lanes and self._rules is not None:
            lanes += self._rules.lanes(junction, number)
        connection = Connection(
            id=number,
            incoming=part.word("incomingRoad"),
            connecting=part.word(name),
            contact=part.choice("contactPoint", ("start", "end")),
            lanes=tuple(lanes),
            line=part.line,
        )
        self.columns[id(connection)] = part.column
        return connection


def _keep(known: dict[str, Record], record: Record, part: Element) -> None:
    first = known.setdefault(record.id, record)
    if first is not record:
        raise part.error(
            f"id {shown(record.id)} is given twice, the first time in line {first.line}",
            "Give each an id of its own.",
        )


@lru_cache(maxsize=4096)
def _cubic_rows(rows: tuple[tuple[float, ...], ...]) -> Floats:
    """Return one array for functions that are the same: most lanes of a map are as wide."""
    found = np.array(rows, dtype=np.float64).reshape(-1, 5)
    found.setflags(write=False)
    return found


def _ids(link: Element | None, name: str) -> tuple[int, ...]:
    return tuple(item.whole("id") for item in link.take(name)) if link is not None else ()


def _carried_on(before: Section, section: Section, sign: int) -> tuple[Section, Section]:
    """Cut the lanes of one side in two where a section begins that says nothing of it.

    Args:
        before: The section that has them.
        section: The one that they go on in.
        sign: Of their ids; 0 for the centre, which has a lane in every section.

    Returns:
        Both, with all lanes that they have.
    """
    shift, lanes = section.s - before.s, [lane for lane in before.lanes if lane.id * sign > 0]
    first = [_up_to(lane, shift) if lane in lanes else lane for lane in before.lanes]
    every = [*section.lanes, *(_from(lane, shift) for lane in lanes)]
    every.sort(key=lambda lane: -lane.id)
    return replace(before, lanes=tuple(first)), replace(section, lanes=tuple(every))


def _up_to(lane: Lane, end: float) -> Lane:
    widths, borders = (rows[rows[:, 0] < end] for rows in (lane.widths, lane.borders))
    return replace(lane, widths=widths, borders=borders, successors=(lane.id,))


def _from(lane: Lane, begin: float) -> Lane:
    return replace(
        lane,
        widths=_rest(lane.widths, begin),
        borders=_rest(lane.borders, begin),
        predecessors=(lane.id,),
        speeds=_items(lane.speeds, begin),
        marks=_items(lane.marks, begin),
    )


def _rest(rows: Floats, begin: float) -> Any:
    """Return cubics (N, 5) as they are seen from a place."""
    at = int(np.searchsorted(rows[:, 0], begin, side="right"))
    for s, a, b, c, d in rows[max(0, at - 1) : at]:
        t = begin - s
        here = (begin, a + t * (b + t * (c + t * d)), b + t * (2.0 * c + 3.0 * t * d))
        rows = np.vstack([(*here, c + 3.0 * t * d, d), rows[at:]])
    return rows - np.array([begin, 0.0, 0.0, 0.0, 0.0])


def _items(items: tuple[Any, ...], begin: float) -> tuple[Any, ...]:
    return tuple(
        replace(item, s=max(0.0, item.s - begin))
        for item, behind in zip_longest(items, items[1:])
        if behind is None or behind.s > begin
    )


def _check_extent(part: Element, piece: Geometry) -> None:
    """Refuse a piece that turns or leads away as no road of its length does."""
    kind, length = piece.kind, piece.length
    if kind in {"arc", "spiral"}:
        turn = length * max(map(abs, piece.parameters))
        if turn > MOST_TURN:
            raise part.error(
                f"it turns by {turn:g} rad", f"Up to {MOST_TURN:g} rad are read: shorten it."
            )
    elif piece.parameters:
        rows = np.array(piece.parameters).reshape(-1, 4)
        rows = np.hstack([np.zeros((len(rows), 1)), rows])
        far = max(_largest(row[np.newaxis], 1.0 if piece.normalized else length) for row in rows)
        if far == 0.0 and kind == "paramPoly3":
            raise part.error("it leads nowhere", "Check its polynomials.")
        if far > MOST_STRETCH * (length + 1.0):
            raise part.error(
                f"it is {length:g} m long, and leads {far:g} m away", "Check its polynomials."
            )


def _largest(rows: Floats, length: float) -> float:
    """Return the largest size of a function along the road, at and between its rows."""
    if not len(rows):
        return 0.0
    if not rows[:, 2:].any():
        return float(np.abs(rows[:, 1]).max())
    ends = np.append(rows[1:, 0], max(length, float(rows[-1, 0])))
    t = (ends - rows[:, 0]) * _SHARES
    a, b, c, d = rows[:, 1:].T
    return float(np.abs(a + t * (b + t * (c + t * d))).max())
