"""Draw the maps of the catalogue and the small ones of the tests.

    python scenarios_db/maps/draw_maps.py [FOLDER] [TESTS_FOLDER]

The files are what counts; this says how they came about and draws them again. Numbers are rounded,
so that other machines draw the same text.

Needs scenariogeneration (MPL-2.0), which is among the development dependencies.
"""

import math
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from scenariogeneration import xodr

HERE = Path(__file__).resolve().parent
TESTS = HERE.parents[1] / "tests" / "content" / "maps"

Pose = tuple[float, float, float]
Cubic = tuple[float, float, float, float, float]
LaneType = xodr.LaneType
SOLID = xodr.RoadMarkType.solid
BROKEN = xodr.RoadMarkType.broken
NO_MARK = xodr.RoadMarkType.none


@dataclass
class Lane:
    """A lane of a section; it goes on in the lane of the same key in the next section."""

    key: str
    widths: Sequence[Cubic]
    kind: str = "driving"
    mark: Any = BROKEN


@dataclass
class Section:
    """A lane section: lanes from the middle outwards, on both sides."""

    s: float
    right: Sequence[Lane] = ()
    left: Sequence[Lane] = ()
    center: Any = SOLID


@dataclass
class Plan:
    """What a road is made of beside its pieces and sections."""

    name: str = ""
    offsets: Sequence[Cubic] = ()
    heights: Sequence[Cubic] = ()
    types: Sequence[tuple[float, str, float]] = ()
    left_hand: bool = False
    junction: int = -1
    before: dict[str, int] = field(default_factory=dict)
    behind: dict[str, int] = field(default_factory=dict)
    signals: Sequence[Any] = field(default_factory=tuple)


def constant(width: float) -> tuple[Cubic]:
    """Return a width that stays."""
    return ((0.0, width, 0.0, 0.0, 0.0),)


def smooth(s: float, start: float, end: float, length: float) -> Cubic:
    """Return a cubic from one value to another, level at both ends."""
    rise = end - start
    return s, start, 0.0, 3.0 * rise / length**2, -2.0 * rise / length**3


def flat_to(slope: float, end: float, length: float, height: float) -> Cubic:
    """Return a height whose slope changes evenly."""
    return 0.0, height, slope, 0.5 * (end - slope) / length, 0.0


def numbered(section: Section) -> dict[str, int]:
    """Return the lanes' ids by their keys."""
    right = {lane.key: -i for i, lane in enumerate(section.right, 1)}
    return right | {lane.key: i for i, lane in enumerate(section.left, 1)}


def draw_lane(lane: Lane, before: dict[str, int], behind: dict[str, int]) -> Any:
    """Return a lane, joined to those of the sections before and behind."""
    first, *others = lane.widths
    drawn = xodr.Lane(getattr(LaneType, lane.kind), *first[1:], soffset=first[0])
    for s, a, b, c, d in others:
        drawn.add_lane_width(a, b, c, d, s)
    drawn.add_roadmark(xodr.RoadMark(lane.mark, width=0.15))
    if lane.key in before:
        drawn.add_link("predecessor", before[lane.key])
    if lane.key in behind:
        drawn.add_link("successor", behind[lane.key])
    return drawn


def draw_road(
    number: int,
    pieces: Sequence[Any],
    sections: Sequence[Section],
    plan: Plan,
    start: Pose = (0.0, 0.0, 0.0),
) -> Any:
    """Return a road from a pose."""
    view = xodr.PlanView()
    view.set_start_point(*start)
    for piece in pieces:
        view.add_geometry(piece)
    view.adjust_geometries()
    lanes = xodr.Lanes()
    for s, a, b, c, d in plan.offsets:
        lanes.add_laneoffset(xodr.LaneOffset(s, a, b, c, d))
    joints = [plan.before, *map(numbered, sections), plan.behind]
    for i, section in enumerate(sections):
        middle = xodr.Lane()
        middle.add_roadmark(xodr.RoadMark(section.center, width=0.15))
        drawn = xodr.LaneSection(section.s, middle)
        for lane in section.right:
            drawn.add_right_lane(draw_lane(lane, joints[i], joints[i + 2]))
        for lane in section.left:
            drawn.add_left_lane(draw_lane(lane, joints[i], joints[i + 2]))
        lanes.add_lanesection(drawn)
    rule = xodr.TrafficRule.LHT if plan.left_hand else xodr.TrafficRule.RHT
    road = xodr.Road(number, view, lanes, road_type=plan.junction, name=plan.name, rule=rule)
    for height in plan.heights:
        road.add_elevation(*height)
    for s, kind, speed in plan.types:
        road.add_type(getattr(xodr.RoadType, kind), s, speed=speed, speed_unit="km/h")
    for signal in plan.signals:
        road.add_signal(signal)
    return road


def end_of(pieces: Sequence[Any], start: Pose) -> Pose:
    """Return the pose that pieces lead to."""
    return draw_road(0, pieces, (), Plan(), start).planview.get_end_point()


def length_of(pieces: Sequence[Any]) -> float:
    """Return how long pieces are [m]."""
    return sum(piece.length for piece in pieces)


def start_for(pieces: Sequence[Any], end: Pose) -> Pose:
    """Return the pose from which pieces lead to another."""
    x, y, turn = end_of(pieces, (0.0, 0.0, 0.0))
    heading = end[2] - turn
    cosine, sine = math.cos(heading), math.sin(heading)
    return end[0] - x * cosine + y * sine, end[1] - x * sine - y * cosine, heading


def beside(pose: Pose, aside: float) -> Pose:
    """Return a pose to the left of another."""
    x, y, heading = pose
    return x - aside * math.sin(heading), y + aside * math.cos(heading), heading


def bend(curvature: float, spiral: float, arc: float) -> list[Any]:
    """Return a bend: spiral, arc, spiral."""
    return [
        xodr.Spiral(0.0, curvature, length=spiral),
        xodr.Arc(curvature, length=arc),
        xodr.Spiral(curvature, 0.0, length=spiral),
    ]


PLACES = ("s", "x", "y", "length")


def rounded(name: str, text: str) -> str:
    """Return an attribute without what differs between machines: lengths to a nanometre."""
    if not any(mark in text for mark in ".e"):
        return text
    try:
        return repr(round(float(text), 9 if name in PLACES else 12) + 0.0)
    except ValueError:
        return text


def write(folder: Path, drawn: Any, *, change: Callable[[ET.Element], None] | None = None) -> None:
    """Write a map.

    Args:
        folder: Where to.
        drawn: What, named as the file is to be.
        change: What the library cannot say is put in by this.
    """
    root = drawn.get_element()
    if change is not None:
        change(root)
    for element in root.iter():
        for name, text in element.attrib.items():
            element.set(name, rounded(name, text))
    header = root.find("header")
    header.set("date", "2026-01-01T00:00:00")
    header.set("vendor", "adeye")
    ET.indent(root, " ")
    text = ET.tostring(root, encoding="unicode")
    path = folder / f"{drawn.name}.xodr"
    path.write_text(f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n', encoding="utf-8")


# --- A motorway with many ramps -------------------------------------------------------------------

WIDTH = 3.75
SHOULDER = 2.5
TAPER = 60.0
WORKS = 250.0
BLOCKS = 56


class Motorway:
    """A carriageway that grows by blocks, each a road and the ramp that leaves or joins at its end.

    Attributes:
        drawn: The map.
        pose: Where the next block begins: its left edge.
        height: There [m].
        slope: There.
        lanes: Keys of the lanes, from the left.
        entered: Whether a lane comes in from the ramp where the next block begins.
        places: How many ramps, works and changes of lanes there are.
    """

    def __init__(self) -> None:
        self.drawn = xodr.OpenDrive("ramp", revMinor="7")
        self.pose: Pose = (0.0, 0.0, 0.0)
        self.height, self.slope = 50.0, 0.01
        self.lanes = ["a", "b", "c"]
        self.entered = False
        self.places = 0
        self.joint: Any = None
        self.offsets: list[Cubic] = []
        self.types: list[tuple[float, str, float]] = []

    def beside_each_other(self) -> list[Lane]:
        """Return the lanes as they are, and the shoulder."""
        lanes = [Lane(key, constant(WIDTH)) for key in self.lanes]
        lanes[-1].mark = SOLID
        return [*lanes, Lane("shoulder", constant(SHOULDER), "shoulder", NO_MARK)]

    def with_ramp(self, widths: Sequence[Cubic], kind: str) -> list[Lane]:
        """Return the lanes with one of a ramp between them and the shoulder."""
        *lanes, shoulder = self.beside_each_other()
        lanes[-1].mark = BROKEN
        return [*lanes, Lane("ramp", widths, kind, SOLID), shoulder]

    def ending(self, at: float) -> list[Section]:
        """Return sections in which the right lane ends."""
        lanes = self.beside_each_other()
        lanes[-2].widths = [smooth(0.0, WIDTH, 0.0, 150.0)]
        self.lanes = self.lanes[:-1]
        return [Section(at, lanes), Section(at + 150.0, self.beside_each_other())]

    def beginning(self, at: float) -> list[Section]:
        """Return a section in which a lane begins on the left; the lane offset makes room."""
        self.lanes = [f"{self.lanes[0]}+", *self.lanes]
        lanes = self.beside_each_other()
        stay = 120.0, WIDTH, 0.0, 0.0, 0.0
        lanes[0].widths = [smooth(0.0, 0.0, WIDTH, 120.0), stay]
        self.offsets = [
            (0.0, 0.0, 0.0, 0.0, 0.0),
            smooth(at, 0.0, WIDTH, 120.0),
            (at + 120.0, WIDTH, 0.0, 0.0, 0.0),
        ]
        return [Section(at, lanes)]

    def works(self, at: float) -> list[Section]:
        """Return sections in which the left lane is closed and the others are narrow."""
        narrow, lanes = 3.25, self.beside_each_other()
        changes = [1.0, *[narrow - WIDTH] * (len(self.lanes) - 1)]
        lanes[0].kind, lanes[0].mark = "roadWorks", SOLID
        for lane, change in zip(lanes, [*changes, -sum(changes)], strict=True):
            width = lane.widths[0][1]
            lane.widths = [
                smooth(0.0, width, width + change, 50.0),
                (50.0, width + change, 0.0, 0.0, 0.0),
                smooth(WORKS - 50.0, width + change, width, 50.0),
            ]
        self.types += [(at, "motorway", 80.0), (at + WORKS, "motorway", 130.0)]
        return [Section(at, lanes), Section(at + WORKS, self.beside_each_other())]

    def block(self, k: int) -> None:
        """Add a block and the ramp at its end."""
        self.offsets, self.types = [], [(0.0, "motorway", 130.0)]
        pieces = main_pieces(k)
        length = length_of(pieces)
        leaves = k % 2 == 1
        weaves = self.entered and k % 10 == 9
        at = 0.0
        name = [f"block {k}"]
        sections: list[Section] = []
        if weaves:
            sections.append(Section(0.0, self.with_ramp(constant(WIDTH), "driving")))
            name.append("weaving")
        elif self.entered:
            at = 160.0 + 30.0 * (k % 4)
            widths = [*constant(WIDTH), smooth(at - TAPER, WIDTH, 0.0, TAPER)]
            sections.append(Section(0.0, self.with_ramp(widths, "entry")))
        if not weaves:
            sections.append(Section(at, self.beside_each_other()))
            change = {2: self.ending, 4: self.works, 6: self.beginning}.get(k % 8)
            if change is not None:
                name.append({2: "a lane ends", 4: "works", 6: "a lane begins"}[k % 8])
                # Behind where the ramp before it is beside the shoulder.
                sections += change(at + 110.0)
                self.places += 1
        if leaves and not weaves:
            reach = (150.0, 190.0, 230.0, 250.0)[k // 2 % 4]
            widths = [smooth(0.0, 0.0, WIDTH, TAPER), (TAPER, WIDTH, 0.0, 0.0, 0.0)]
            sections.append(Section(length - reach, self.with_ramp(widths, "exit")))
        road = self.carriageway(k, pieces, sections, ", ".join(name))
        self.pose = beside(road.planview.get_end_point(), WIDTH if self.offsets else 0.0)
        self.joint = road, self.ramp(k, leaves=leaves), leaves
        self.entered = not leaves

    def carriageway(self, k: int, pieces: Sequence[Any], sections: Any, name: str) -> Any:
        """Add the road of a block and join it to what is before it."""
        length = length_of(pieces)
        # Up and down, no steeper than 4 %, and back to where it was in the end.
        slope = 0.04 * math.sin(0.9 * (k + 1))
        heights = [flat_to(self.slope, slope, length, self.height)]
        plan = Plan(name, offsets=self.offsets, heights=heights, types=self.types)
        road = draw_road(k + 1, pieces, sections, plan, self.pose)
        self.drawn.add_road(road)
        self.height += 0.5 * (self.slope + slope) * length
        self.slope = slope
        if self.joint is not None:
            before, ramp, leaves = self.joint
            # The lanes that go on are those that the new road begins with.
            lanes = len(sections[0].right) - 1 - self.entered
            join(self.drawn, before, road, ramp, lanes if leaves else -lanes)
        return road

    def ramp(self, k: int, *, leaves: bool) -> Any:
        """Add the ramp at the end of a block, level with the carriageway there."""
        pieces = ramp_pieces(k)
        length = length_of(pieces)
        gore = beside(self.pose, -len(self.lanes) * WIDTH)
        other = (0.03, -0.05, 0.05, -0.02)[k // 2 % 4]
        if leaves:
            name, start = f"exit {k}", gore
            height = flat_to(self.slope, other, length, self.height)
        else:
            pieces = pieces[::-1]
            name, start = f"entry {k}", start_for(pieces, gore)
            begin = self.height - 0.5 * (other + self.slope) * length
            height = flat_to(other, self.slope, length, begin)
        lanes = [
            Lane("ramp", constant(WIDTH), mark=SOLID),
            Lane("shoulder", constant(1.5), "shoulder", NO_MARK),
        ]
        plan = Plan(name, heights=[height], types=[(0.0, "motorway", 60.0)])
        road = draw_road(101 + k, pieces, [Section(0.0, lanes)], plan, start)
        self.drawn.add_road(road)
        self.places += 1
        return road


def join(drawn: Any, before: Any, behind: Any, ramp: Any, lanes: int) -> None:
    """Join two roads of a carriageway and a ramp directly; the ramp joins if lanes are negative."""
    number = 1001 + len(drawn.junctions)
    before.add_successor(xodr.ElementType.junction, number)
    behind.add_predecessor(xodr.ElementType.junction, number)
    joint = xodr.Junction(f"ramp {ramp.id}", number, xodr.JunctionType.direct)
    main = xodr.Connection(before.id, behind.id, xodr.ContactPoint.start)
    for lane in range(1, abs(lanes) + 1):
        main.add_lanelink(-lane, -lane)
    joint.add_connection(main)
    if lanes > 0:
        ramp.add_predecessor(xodr.ElementType.junction, number)
        side = xodr.Connection(before.id, ramp.id, xodr.ContactPoint.start)
        side.add_lanelink(-(lanes + 1), -1)
    else:
        ramp.add_successor(xodr.ElementType.junction, number)
        side = xodr.Connection(ramp.id, behind.id, xodr.ContactPoint.start)
        side.add_lanelink(-1, lanes - 1)
    joint.add_connection(side)
    drawn.add_junction(joint)


def main_pieces(k: int) -> list[Any]:
    """Return the pieces of a block of the carriageway: bends to the left and right in turn."""
    length = 620.0 + 40.0 * (k % 5)
    curvature = (1.0 if k % 2 else -1.0) / (900.0, 1200.0, 2000.0, 3000.0)[k // 2 % 4]
    return [xodr.Line(150.0), *bend(curvature, 120.0, length - 540.0), xodr.Line(150.0)]


def ramp_pieces(k: int) -> list[Any]:
    """Return the pieces of an exit to the right: slip roads, and every third a loop."""
    radius = (160.0, 60.0, 120.0, 90.0, 220.0, 45.0)[k % 6]
    turn = 2.4 if k % 3 == 2 else (0.5, 0.7, 0.9, 1.2)[k % 4]
    spiral = min(60.0, 0.4 * turn * radius)
    arc = turn * radius - spiral
    straight, rest = 40.0 + 10.0 * (k % 4), 60.0 + 20.0 * (k % 3)
    return [xodr.Line(straight), *bend(-1.0 / radius, spiral, arc), xodr.Line(rest)]


def ramp_map() -> Any:
    """Return a motorway with entries, exits, weaving, lane drops and gains, and works."""
    way = Motorway()
    for k in range(BLOCKS):
        way.block(k)
    way.offsets, way.types = [], [(0.0, "motorway", 130.0)]
    way.carriageway(BLOCKS, [xodr.Line(300.0)], [Section(0.0, way.beside_each_other())], "end")
    if way.places < 50:
        raise ValueError(way.places)
    return way.drawn


# --- A road through the country -------------------------------------------------------------------


def two_way(shoulder: float = 1.0, *, center: Any = BROKEN, kind: str = "shoulder") -> Section:
    """Return a section with a lane each way."""
    right = [Lane("r1", constant(3.5), mark=SOLID), Lane("r2", constant(shoulder), kind, NO_MARK)]
    left = [Lane("l1", constant(3.5), mark=SOLID), Lane("l2", constant(shoulder), kind, NO_MARK)]
    return Section(0.0, right, left, center)


def rural_map() -> Any:
    """Return a road with bends over a hill, a third lane to overtake on, and a village."""
    drawn = xodr.OpenDrive("rural", revMinor="6", geo_reference="+proj=utm +zone=32 +ellps=WGS84")
    bends = [
        xodr.Line(180.0),
        *bend(1 / 120.0, 60.0, 70.0),
        xodr.Line(60.0),
        *bend(-1 / 80.0, 50.0, 60.0),
        *bend(1 / 200.0, 70.0, 90.0),
        xodr.Spiral(0.0, -1 / 60.0, length=40.0),
        xodr.Spiral(-1 / 60.0, 1 / 60.0, length=80.0),
        xodr.Spiral(1 / 60.0, 0.0, length=40.0),
        xodr.Line(120.0),
    ]
    third = [xodr.Line(200.0), *bend(-1 / 450.0, 90.0, 300.0), xodr.Line(420.0)]
    village = [xodr.Line(150.0), xodr.Arc(1 / 35.0, length=40.0), xodr.Line(160.0)]
    lengths = [length_of(pieces) for pieces in (bends, third, village)]
    solid = two_way(center=SOLID)
    solid.s = 420.0
    again = two_way()
    again.s = 760.0

    widening = two_way(center=SOLID)
    widening.s = 150.0
    more = [smooth(0.0, 0.0, 3.5, 100.0), (100.0, 3.5, 0.0, 0.0, 0.0)]
    less = [*more, smooth(lengths[1] - 400.0, 3.5, 0.0, 100.0)]
    widening.right = [Lane("fast", less), *widening.right]
    narrow = two_way()
    narrow.s = lengths[1] - 150.0
    offsets = [
        (0.0, 0.0, 0.0, 0.0, 0.0),
        smooth(150.0, 0.0, 1.75, 100.0),
        (250.0, 1.75, 0.0, 0.0, 0.0),
        smooth(lengths[1] - 250.0, 1.75, 0.0, 100.0),
        (lengths[1] - 150.0, 0.0, 0.0, 0.0, 0.0),
    ]

    houses = two_way(2.0, kind="sidewalk")
    houses.s = 60.0
    parked = two_way(2.0, kind="sidewalk")
    parked.s = 220.0
    bay = Lane("bay", [smooth(0.0, 0.0, 2.2, 8.0), (8.0, 2.2, 0.0, 0.0, 0.0)], "parking", NO_MARK)
    parked.right = [parked.right[0], bay, parked.right[1]]

    heights = [
        [flat_to(0.0, 0.06, lengths[0], 100.0)],
        [flat_to(0.06, -0.05, lengths[1], 100.0 + 0.03 * lengths[0])],
        [flat_to(-0.05, 0.0, lengths[2], 100.0 + 0.03 * lengths[0] + 0.005 * lengths[1])],
    ]
    same = numbered(two_way())
    roads = [
        (bends, [two_way(), solid, again], Plan("bends", types=[(0.0, "rural", 100.0)])),
        (
            third,
            [two_way(), widening, narrow],
            Plan("three lanes", offsets, types=[(0.0, "rural", 100.0)]),
        ),
        (
            village,
            [two_way(), houses, parked],
            Plan("village", types=[(0.0, "rural", 70.0), (60.0, "town", 50.0)]),
        ),
    ]
    pose: Pose = (0.0, 0.0, 0.3)
    last: Any = None
    for i, (pieces, sections, plan) in enumerate(roads):
        plan.heights = heights[i]
        plan.before = same if i else {}
        plan.behind = same if i < len(roads) - 1 else {}
        road = draw_road(i + 1, pieces, sections, plan, pose)
        if last is not None:
            last.add_successor(xodr.ElementType.road, road.id, xodr.ContactPoint.start)
            road.add_predecessor(xodr.ElementType.road, last.id, xodr.ContactPoint.end)
        drawn.add_road(road)
        pose, last = road.planview.get_end_point(), road
    return drawn


# --- A town ---------------------------------------------------------------------------------------

STREETS = (
    # Number, length, junction and angle where it begins, and where it ends.
    (1, 120.0, None, (500, 180.0)),
    (2, 150.0, (500, 0.0), (501, 180.0)),
    (3, 90.0, (500, 90.0), None),
    (4, 90.0, (500, 270.0), None),
    (5, 140.0, (501, 0.0), (502, 180.0)),
    (6, 80.0, (501, 90.0), None),
    (7, 80.0, (501, 270.0), (503, 90.0)),
    (8, 100.0, (502, 70.0), None),
    (9, 110.0, (502, 290.0), None),
    (10, 70.0, (503, 180.0), None),
    (11, 70.0, (503, 0.0), None),
)


def town_map() -> Any:
    """Return streets with sidewalks: two crossings, one with lights, and two forks."""
    drawn = xodr.OpenDrive("town", revMinor="6")
    joints = {
        number: xodr.CommonJunctionCreator(number, f"junction {number}", startnum=1000 * i)
        for i, number in enumerate((500, 501, 502, 503), 1)
    }
    for number, length, *_ in STREETS:
        sections = [two_way(2.5, kind="sidewalk")]
        plan = Plan(
            f"street {number}", types=[(0.0, "town", 50.0)], signals=signs_of(number, length)
        )
        view = xodr.PlanView()
        view.add_geometry(xodr.Line(length))
        road = draw_road(number, [xodr.Line(length)], sections, plan)
        # The library places the streets around their junctions.
        road.planview = view
        drawn.add_road(road)
    arms: dict[int, list[tuple[int, int, int]]] = {number: [] for number in joints}
    for number, _, begin, end in STREETS:
        street = drawn.roads[str(number)]
        if begin is not None:
            joints[begin[0]].add_incoming_road_circular_geometry(
                street, 14.0, math.radians(begin[1]), "predecessor"
            )
            arms[begin[0]].append((number, 1, -1))
        if end is not None:
            joints[end[0]].add_incoming_road_circular_geometry(
                street, 14.0, math.radians(end[1]), "successor"
            )
            arms[end[0]].append((number, -1, 1))
    for number, joint in joints.items():
        # Each lane that arrives goes on to each other arm.
        for one, arrives, _ in arms[number]:
            for other, _, leaves in arms[number]:
                if one != other:
                    joint.add_connection(one, other, arrives, leaves)
        drawn.add_junction_creator(joint)
    drawn.adjust_roads_and_lanes()
    return drawn


def signs_of(number: int, length: float) -> list[Any]:
    """Return the lights or the sign before a street's junctions."""
    _, _, begin, end = next(street for street in STREETS if street[0] == number)
    ways = [(begin, 2.0, 4.2, xodr.Orientation.negative)]
    ways.append((end, length - 2.0, -4.2, xodr.Orientation.positive))
    signs = []
    for joint, s, t, way in ways:
        if joint is None:
            continue
        lights = joint[0] == 501
        # A light; else who comes along the main road has priority (306), others yield (205).
        kind = "1000001" if lights else "306" if joint[1] in (0.0, 180.0) else "205"
        dynamic = xodr.Dynamic.yes if lights else xodr.Dynamic.no
        country = "OpenDRIVE" if lights else "DE"
        signs.append(
            xodr.Signal(s, t, country, kind, "-1", dynamic=dynamic, orientation=way, zOffset=2.5)
        )
    return signs


# --- Small ones for the tests ---------------------------------------------------------------------

WIDE = constant(3.5)


def one_lane_each_way() -> Section:
    """Return a section with one lane on each side."""
    return Section(0.0, [Lane("r", WIDE, mark=SOLID)], [Lane("l", WIDE, mark=SOLID)])


def left_hand_map() -> Any:
    """Return a road on which one keeps to the left."""
    drawn = xodr.OpenDrive("left_hand", revMinor="6")
    pieces = [xodr.Line(40.0), *bend(1 / 50.0, 25.0, 20.0), xodr.Line(40.0)]
    drawn.add_road(draw_road(1, pieces, [one_lane_each_way()], Plan("left", left_hand=True)))
    return drawn


TURN = (0.0, 16.5, 0.0, -5.5, 0.0, 0.0, 16.5, -5.5)


def param_poly3_map() -> Any:
    """Return two turns of the same curve: with a parameter up to 1, and up to the length."""
    drawn = xodr.OpenDrive("param_poly3", revMinor="5")
    curve = xodr.ParamPoly3(*TURN)
    scaled = [c / curve.length ** (k % 4) for k, c in enumerate(TURN)]
    by_length = xodr.ParamPoly3(*scaled, prange="arcLength", length=curve.length)
    for number, piece in ((1, curve), (2, by_length)):
        start = (0.0, 30.0 * number, 0.2)
        pieces = [xodr.Line(10.0), piece, xodr.Line(10.0)]
        road = draw_road(number, pieces, [one_lane_each_way()], Plan(f"turn {number}"), start)
        drawn.add_road(road)
    return drawn


def poly3_map() -> tuple[Any, Callable[[ET.Element], None]]:
    """Return a road of 1.4 with a poly3 in the middle, which the library cannot draw."""
    drawn = xodr.OpenDrive("poly3", revMinor="4")
    c, d, reach = 0.01, -1e-4, 40.0
    parts = 4000
    ends = [c * u * u + d * u**3 for u in (reach * i / parts for i in range(parts + 1))]
    length = sum(math.hypot(reach / parts, b - a) for a, b in pairwise(ends))
    turn = math.atan(2 * c * reach + 3 * d * reach * reach)
    cosine, sine = math.cos(0.4), math.sin(0.4)
    x, y = 20.0 * cosine, 20.0 * sine
    start = (x, y, 0.4)
    end = (x + reach * cosine - ends[-1] * sine, y + reach * sine + ends[-1] * cosine, 0.4 + turn)
    view = xodr.PlanView()
    view.add_fixed_geometry(xodr.Line(20.0), 0.0, 0.0, 0.4)
    view.add_fixed_geometry(xodr.Line(length), *start)
    view.add_fixed_geometry(xodr.Line(20.0), *end)
    road = draw_road(1, [xodr.Line(1.0)], [one_lane_each_way()], Plan("cubic"))
    road.planview = view
    drawn.add_road(road)

    def bent(root: ET.Element) -> None:
        piece = root.findall(".//geometry")[1]
        piece.clear()
        values = (20.0, *start, length)
        piece.attrib.update(zip(("s", "x", "y", "hdg", "length"), map(str, values), strict=True))
        ET.SubElement(piece, "poly3", {"a": "0.0", "b": "0.0", "c": str(c), "d": str(d)})

    return drawn, bent


def borders_map() -> tuple[Any, Callable[[ET.Element], None]]:
    """Return a bend whose lanes are given by their borders, beside a lane offset."""
    drawn = xodr.OpenDrive("borders", revMinor="6")
    pieces = [xodr.Line(20.0), xodr.Arc(-1 / 60.0, length=40.0), xodr.Line(20.0)]
    widths = [(0.0, 3.0, 0.0, 0.0, 0.0), smooth(30.0, 3.0, 4.0, 20.0), (50.0, 4.0, 0.0, 0.0, 0.0)]
    section = Section(0.0, [Lane("r1", widths), Lane("r2", WIDE, mark=SOLID)], [Lane("l", widths)])
    offsets = [(0.0, 0.4, 0.0, 0.0, 0.0), smooth(40.0, 0.4, -0.6, 30.0), (70.0, -0.6, 0, 0, 0)]
    drawn.add_road(draw_road(1, pieces, [section], Plan("borders", offsets)))

    def bordered(root: ET.Element) -> None:
        for lane in root.iter("lane"):
            number = int(lane.get("id", "0"))
            for width in lane.findall("width"):
                width.tag = "border"
                for name in "abcd":
                    width.set(name, str(math.copysign(1.0, number) * float(width.get(name, "0"))))
            if number == -2:
                # An outer border is where it is, whatever the lane within does.
                lane.find("border").set("a", "-8.0")

    return drawn, bordered


def sections_map() -> Any:
    """Return a road whose lanes come and go beside a moving lane offset, one of them reversed."""
    drawn = xodr.OpenDrive("sections", revMinor="8")
    pieces = [xodr.Line(60.0), *bend(1 / 80.0, 30.0, 30.0), xodr.Line(50.0)]
    more = [smooth(0.0, 0.0, 3.5, 40.0), (40.0, 3.5, 0.0, 0.0, 0.0)]
    right, left = Lane("r", WIDE), Lane("l", WIDE)
    sections = [
        Section(0.0, [right], [left]),
        Section(50.0, [right, Lane("turn", more)], [left]),
        Section(120.0, [right, Lane("turn", WIDE)], [left, Lane("bike", constant(1.6), "biking")]),
    ]
    offsets = [smooth(0.0, 0.0, -0.8, 90.0), (90.0, -0.8, 0.0, 0.0, 0.0)]
    drawn.add_road(draw_road(1, pieces, sections, Plan("sections", offsets)))
    return drawn


def direct_map() -> Any:
    """Return an exit that leaves directly: two roads, a ramp and a direct junction."""
    way = Motorway()
    way.drawn.name = "direct"
    way.block(1)
    way.offsets, way.types = [], [(0.0, "motorway", 130.0)]
    way.carriageway(2, [xodr.Line(100.0)], [Section(0.0, way.beside_each_other())], "end")
    return way.drawn


def main() -> None:
    """Draw all maps."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    tests = Path(sys.argv[2]) if len(sys.argv) > 2 else TESTS
    for drawn in (ramp_map(), rural_map(), town_map()):
        write(folder, drawn)
    for drawn in (left_hand_map(), param_poly3_map(), sections_map(), direct_map()):
        write(tests, drawn)
    for drawn, change in (poly3_map(), borders_map()):
        write(tests, drawn, change=change)


if __name__ == "__main__":
    main()
