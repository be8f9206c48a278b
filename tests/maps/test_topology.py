"""What is wrong between the lanes of a map: hand-made maps with one thing wrong each."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from adeye.maps.carriageway import Lanes
from adeye.maps.opendrive import LaneSpeed, OpenDrive, Road, RoadLink, RoadType
from adeye.maps.places import Asked, places_of
from adeye.maps.topology import Finding, check_topology
from tests.drawn_roads import WIDE, crossing, cubics, lane, network, piece, road, section

HIGH = cubics((0.0, 6.0, 0.0, 0.0, 0.0))
ALONE = section(lane(0), lane(-1, WIDE))


def found(drive: OpenDrive) -> dict[str, Finding]:
    """Return findings by kind, without the notes of where the map ends."""
    return {item.kind: item for item in check_topology(drive) if item.severity != "note"}


def changed(name: str, **fields: Any) -> OpenDrive:
    """Return the crossing with a road that is changed."""
    drive = crossing()
    return replace(drive, roads={**drive.roads, name: replace(drive.roads[name], **fields)})


def moved(drive: OpenDrive, name: str, pose: tuple[float, float, float]) -> OpenDrive:
    only = drive.roads[name]
    shifted = (piece("line", only.length, pose=pose),)
    return replace(drive, roads={**drive.roads, name: replace(only, geometries=shifted)})


def without(connection: int, road_id: str = "") -> OpenDrive:
    """Return the crossing without a connection, and without a road."""
    drive = crossing()
    junction = drive.junctions["j"]
    kept = tuple(item for item in junction.connections if item.id != str(connection))
    roads = {key: item for key, item in drive.roads.items() if key != road_id}
    return replace(drive, roads=roads, junctions={"j": replace(junction, connections=kept)})


def test_sound_map_only_ends() -> None:
    kinds = [(item.kind, item.severity) for item in check_topology(crossing())]
    assert kinds == [("map_edge", "note")] * 2


@pytest.mark.parametrize(
    ("pose", "kind", "severity", "value"),
    [
        ((100.0, 0.02, 0.0), "gap", "warning", 0.02),
        ((100.0, 0.6, 0.0), "gap", "error", 0.6),
        ((100.0, 0.0, 0.1), "kink", "warning", 0.1),
        ((100.0, 0.0, 0.5), "kink", "error", 0.5),
    ],
)
def test_lanes_that_do_not_meet(
    pose: tuple[float, float, float], kind: str, severity: str, value: float
) -> None:
    item = found(moved(crossing(), "c", pose))[kind]
    assert (item.severity, item.line) == (severity, 1)
    assert item.value == pytest.approx(value, rel=0.3)


def test_gap_is_told_once_although_both_say_it() -> None:
    drive = moved(crossing(), "c", (100.0, 0.02, 0.0))
    assert sum(item.kind == "gap" for item in check_topology(drive)) == 2


@pytest.mark.parametrize(
    ("drive", "kind", "severity", "place"),
    [
        (without(0, "c"), "missing_connection", "error", "road a, section 0, lane -1"),
        (without(0), "one_sided", "warning", "road c, section 0, lane -1"),
        (without(0), "unused_road", "warning", "road c"),
        (changed("a", successor=None), "not_joined", "error", "junction j, connection 0"),
        (
            changed("c", sections=(section(lane(0), lane(-1, WIDE, successors=(-1,))),)),
            "wrong_way",
            "error",
            "road c, section 0, lane -1",
        ),
        (
            changed("c", sections=(section(lane(0), lane(-1, WIDE, successors=(1,))),)),
            "one_sided",
            "warning",
            "road a, section 0, lane -1",
        ),
    ],
    ids=["no way on", "no connection", "unused road", "not joined", "wrong way", "one side"],
)
def test_links_that_are_wrong(drive: OpenDrive, kind: str, severity: str, place: str) -> None:
    if kind == "not_joined":
        roads = {**drive.roads, "c": replace(drive.roads["c"], predecessor=None)}
        drive = replace(drive, roads=roads)
    item = found(drive)[kind]
    assert item.severity == severity
    assert item.place.startswith(place)


@pytest.mark.parametrize(
    ("width", "kinds"),
    [((0.0, 3.0, 0.0, 0.0, 0.0), {"dead_end"}), ((0.0, 3.0, -0.06, 0, 0), set())],
)
def test_lane_that_ends_within_its_road_is_a_dead_end_unless_it_narrows(
    width: Any, kinds: set[str]
) -> None:
    first = section(lane(0), lane(-1, WIDE, successors=(-1,)), lane(-2, width))
    second = section(lane(0), lane(-1, WIDE, predecessors=(-1,)), s=50.0)
    assert set(found(network(road([piece("line", 100.0)], first, second)))) == kinds


def test_next_road_that_is_not_linked_is_no_edge_of_the_map() -> None:
    one = road([piece("line", 50.0)], ALONE)
    other = road([piece("line", 50.0, pose=(50.1, 0.0, 0.0))], ALONE, id="2")
    assert found(network(one, other))["unlinked"].value == pytest.approx(0.1)
    bridge = replace(other, elevations=HIGH)
    assert not found(network(one, bridge))


@pytest.mark.parametrize(("radius", "kinds"), [(5.0, {"tight"}), (6.0, set())])
def test_bend_is_as_tight_as_the_centre_of_its_lane(radius: float, kinds: set[str]) -> None:
    drawn = road([piece("arc", 5.0, -1.0 / radius)], ALONE)
    items = found(network(drawn))
    assert set(items) == kinds
    if kinds:
        assert items["tight"].value == pytest.approx(3.5)


@pytest.mark.parametrize("width", [(0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 2.0, -0.1, 0.0, 0.0)])
def test_lane_without_width_is_an_error(width: Any) -> None:
    drawn = road([piece("line", 50.0)], section(lane(0), lane(-1, width)))
    assert found(network(drawn))["no_width"].severity == "error"


def _across(**changed: Any) -> Road:
    return road([piece("line", 60.0, pose=(25.0, -30.0, math.pi / 2))], ALONE, id="2", **changed)


OVERLAPS: dict[str, tuple[Callable[[], Road], set[str]]] = {
    "crossing at one level": (_across, {"overlap"}),
    "on a bridge": (lambda: _across(elevations=HIGH), set()),
    "beside each other": (
        lambda: road([piece("line", 50.0, pose=(0.0, 3.0, 0.0))], ALONE, id="2"),
        set(),
    ),
    "half a metre into each other": (
        lambda: road([piece("line", 50.0, pose=(0.0, 2.5, 0.0))], ALONE, id="2"),
        {"overlap"},
    ),
}


@pytest.mark.parametrize("name", OVERLAPS)
def test_overlap_is_of_roads_at_one_level_without_a_junction(name: str) -> None:
    other, kinds = OVERLAPS[name]
    one = road([piece("line", 50.0)], ALONE)
    assert set(found(network(one, other()))) == kinds
    inside = network(replace(one, junction="j"), replace(other(), junction="j"))
    assert "overlap" not in found(replace(inside, junctions=crossing().junctions))


def test_lanes_that_part_may_lie_in_each_other() -> None:
    link = RoadLink("road", "1", "end", 1)
    one = road([piece("line", 50.0)], ALONE)
    starts = section(lane(0), lane(-1, WIDE, predecessors=(-1,)))
    parts = [
        road([piece("line", 50.0, pose=(50.0, 0.0, turn))], starts, id=name, predecessor=link)
        for name, turn in (("2", 0.0), ("3", -0.02))
    ]
    assert "overlap" not in found(network(one, *parts))


BROKEN = (
    ({"geometries": (200.0, 20.0, 0.0)}, "gap", "error", 20.0),
    ({"geometries": (200.0, 0.0, 0.2)}, "kink", "warning", 0.2),
    ({"offsets": (100.0, 1.5, 0.0, 0.0, 0.0)}, "gap", "error", 1.5),
    ({"elevations": (100.0, 0.4, 0.0, 0.0, 0.0)}, "gap", "warning", 0.4),
)


@pytest.mark.parametrize(("fields", "kind", "severity", "value"), BROKEN)
def test_a_road_that_does_not_go_on_within_itself_is_told_and_no_place(
    fields: dict[str, Any], kind: str, severity: str, value: float
) -> None:
    (name, numbers), *_ = fields.items()
    pieces = [piece("line", 200.0), piece("line", 200.0, pose=(200.0, 0.0, 0.0), s=200.0)]
    more: dict[str, Any] = {}
    if name == "geometries":
        pieces[1] = replace(pieces[1], x=numbers[0], y=numbers[1], heading=numbers[2])
    else:
        more[name] = cubics((0.0, 0.0, 0.0, 0.0, 0.0), numbers)
    drive = network(road(pieces, ALONE, **more))
    (finding,) = found(drive).values()
    assert (finding.kind, finding.severity) == (kind, severity)
    assert finding.value == pytest.approx(value)
    asked = Asked("carriageway", 0.0, 350.0)
    assert "m:1+0" not in [place.key for place in places_of(Lanes.of(drive), "m", asked).places]


def test_a_street_steeper_than_any_is_no_place() -> None:
    lanes = [piece("line", 400.0)], ALONE
    for grade, count in ((0.4, 1), (0.6, 0)):
        drive = network(road(*lanes, elevations=cubics((0.0, 0.0, grade, 0.0, 0.0))))
        found_there = places_of(Lanes.of(drive), "m", Asked("carriageway", 0.0, 350.0)).places
        assert len([place for place in found_there if place.key == "m:1+0"]) == count


@pytest.mark.parametrize(
    ("middle", "wanted"),
    [
        ({}, set()),
        ({"type": "none"}, {"dead_end", "unreached"}),
        ({"type": "roadWorks"}, set()),
        ({"type": "x"}, {"unknown_type", "dead_end", "unreached"}),
        ({"speeds": (LaneSpeed(0.0, 0.0, 7),)}, {"no_speed"}),
        ({"type": "none", "speeds": (LaneSpeed(0.0, 0.0, 7),)}, {"dead_end", "unreached"}),
        ({"speeds": (LaneSpeed(0.0, math.inf, 7), LaneSpeed(9.0, 5.0, 8))}, set()),
        ({"speeds": (LaneSpeed(0.0, 50.0, 7),)}, {"fast"}),
    ],
)
def test_chain_of_lanes_is_driven_throughout(middle: Any, wanted: set[str]) -> None:
    links = {"predecessors": (-1,), "successors": (-1,)}
    parts = [
        section(lane(0), lane(-1, WIDE, successors=(-1,))),
        section(lane(0), lane(-1, WIDE, **links, **middle), s=30.0),
        section(lane(0), lane(-1, WIDE, predecessors=(-1,)), s=60.0),
    ]
    items = found(network(road([piece("line", 100.0)], *parts)))
    assert set(items) == wanted
    for kind in wanted:
        assert items[kind].severity == ("error" if kind == "no_speed" else "warning")
    if "dead_end" in items:
        assert items["dead_end"].place.startswith("road 1, section 0, lane -1")
        assert "leads into road 1, section 1, lane -1, which" in items["dead_end"].message


def test_limit_of_zero_of_a_road_is_an_error() -> None:
    def drawn(limit: float) -> OpenDrive:
        types = (RoadType(0.0, "rural", limit, 5),)
        return network(road([piece("line", 100.0)], ALONE, types=types))

    assert found(drawn(0.0))["no_speed"].line == 5
    assert not found(drawn(math.nan))
    assert not found(drawn(44.4))


def test_limit_above_any_that_is_posted_lacks_its_unit() -> None:
    types = (RoadType(0.0, "motorway", 130.0, 5),)
    fast = found(network(road([piece("line", 100.0)], ALONE, types=types)))["fast"]
    assert (fast.line, fast.severity, fast.value) == (5, "warning", 130.0)
    assert "468 km/h" in fast.message
