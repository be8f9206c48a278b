"""Places of a map: roads that lead over several of them, with the lanes that are there."""

import math
from collections.abc import Sequence
from typing import Any

import pytest

from adeye.kernel import strips
from adeye.maps.carriageway import Lanes
from adeye.maps.opendrive import (
    FASTEST_POSTED,
    Connection,
    Junction,
    LaneSpeed,
    OpenDrive,
    Road,
    RoadLink,
    RoadType,
)
from adeye.maps.places import Asked, Place, Places, places_of
from tests.drawn_roads import cubics, lane, network, piece, road, section

WIDE = (0.0, 3.5, 0.0, 0.0, 0.0)
NARROWING = (0.0, 3.5, 0.0, -3.0 * 3.5 / 100.0**2, 2.0 * 3.5 / 100.0**3)


def found(
    drawn: OpenDrive, anchor: Any = "carriageway", before: float = 50.0, **asked: Any
) -> Places:
    return places_of(
        Lanes.of(drawn), "m", Asked(anchor, before, asked.pop("after", 100.0), **asked)
    )


def place_at(drawn: OpenDrive, key: str, **asked: Any) -> Place:
    return next(place for place in found(drawn, **asked).places if place.key == key)


def straight(*sections: Any, length: float = 400.0, **changed: Any) -> Road:
    return road([piece("line", length)], *sections, **changed)


def two_way() -> OpenDrive:
    return network(straight(section(lane(1, WIDE), lane(0), lane(-1, WIDE))))


def own(place: Place) -> list[list[Sequence[float]]]:
    return [
        [strip for strip in across if strip[strips.STRIP_LANE] >= 0]
        for _, across in place.road.slabs
    ]


def test_each_direction_has_its_places_and_the_other_lane_on_its_left() -> None:
    drawn = two_way()
    assert [place.key for place in found(drawn).places][:2] == ["m:1+50", "m:1+100"]
    for key, heading in (("m:1+100", 0.0), ("m:1-100", math.pi)):
        place = place_at(drawn, key)
        assert math.isclose(abs(place.road.heading), heading)
        assert place.road.line == ((150.0, 0.0),)
        (begin, across), *others = place.road.slabs
        assert begin == 0.0
        assert not others
        edges = [(strip[strips.STRIP_RIGHT], strip[strips.STRIP_LEFT]) for strip in across]
        assert edges == [(0.0, 3.5), (3.5, 7.0)]
        assert [strip[strips.STRIP_WAY] for strip in across] == [1.0, -1.0]


@pytest.mark.parametrize("between", ["curb", "border", "median", "none", "restricted"])
def test_what_lies_beyond_a_strip_for_nobody_is_there_as_well(between: str) -> None:
    thin = (0.0, 0.5, 0.0, 0.0, 0.0)
    drawn = network(
        straight(
            section(
                lane(2, WIDE),
                lane(1, thin, type=between),
                lane(0),
                lane(-1, WIDE),
                lane(-2, thin, type=between),
                lane(-3, WIDE, type="sidewalk"),
            )
        )
    )
    for key in ("m:1+100", "m:1-100"):
        ((_, across),) = place_at(drawn, key).road.slabs
        kinds = [int(strip[strips.STRIP_KIND]) for strip in across]
        ways = [strip[strips.STRIP_WAY] for strip in across]
        if key == "m:1+100":
            assert kinds == [strips.WALKING, strips.OTHER, 0, strips.OTHER, 0]
            assert ways == [0.0, 0.0, 1.0, 0.0, -1.0]
        else:
            assert kinds == [0, strips.OTHER, 0, strips.OTHER, strips.WALKING]


def test_a_place_too_near_to_an_end_has_no_road_and_is_counted() -> None:
    refused = found(two_way()).refused
    # Of 0, 50, … 400 m each way: 0 m lacks what is before it, 350 and 400 m what is behind.
    assert refused == {"too near to the end of the way": 6}


def test_a_road_leads_on_over_the_next_one_however_that_is_drawn() -> None:
    lanes = section(lane(1, WIDE), lane(0), lane(-1, WIDE, successors=(1,)))
    there = section(lane(1, WIDE, successors=(-1,)), lane(0), lane(-1, WIDE))
    first = straight(lanes, id="1", length=100.0, successor=RoadLink("road", "2", "end", 1))
    turned = [piece("arc", 200.0, -0.01, pose=_end_of_arc(200.0, 0.01, 100.0))]
    second = road(turned, there, id="2", successor=RoadLink("road", "1", "end", 1))
    place = place_at(network(first, second), "m:1+50")
    assert place.length == pytest.approx(150.0, abs=0.1)
    assert [round(curvature, 5) for _, curvature in place.road.line] == [0.0, 0.00966]


def _end_of_arc(length: float, curvature: float, x: float) -> tuple[float, float, float]:
    turn = curvature * length
    end = x + math.sin(turn) / curvature, (1.0 - math.cos(turn)) / curvature
    return *end, turn + math.pi


def test_the_line_keeps_to_the_lane_that_goes_on_and_the_others_end_beside_it() -> None:
    begin = section(lane(0), lane(-1, WIDE, successors=(-1,)), lane(-2, WIDE, successors=(-2,)))
    end = section(lane(0), lane(-1, WIDE, successors=(-1,)), lane(-2, NARROWING), s=100.0)
    rest = section(lane(0), lane(-1, WIDE), s=200.0)
    drawn = network(straight(begin, end, rest))
    (place,) = found(drawn, "lane_end", before=150.0).places
    assert place.key == "m:1+200"
    assert place.lanes == 2
    counts = [len(lanes) for lanes in own(place)]
    assert (counts[0], counts[-1]) == (2, 1)
    assert sorted(counts, reverse=True) == counts
    # The right lane is beside the line until it is too narrow to be one.
    ends = [lanes[0][strips.STRIP_RIGHT] for lanes in own(place) if len(lanes) == 2]
    assert ends[0] == -3.5
    for begin_at, across in place.road.slabs:
        edge = across[0][strips.STRIP_RIGHT] if len(across) == 2 else 0.0
        t = begin_at - 50.0
        width = 3.5 if t < 0 else 3.5 - 3 * 3.5 * (t / 100) ** 2 + 2 * 3.5 * (t / 100) ** 3
        if t < 100.0:
            assert edge == pytest.approx(-width, abs=0.02)


def test_edges_are_within_a_centimetre_of_what_the_map_says() -> None:
    wave = (0.0, 3.0, 0.0, 3.0e-4, -1.0e-6)
    drawn = network(straight(section(lane(0), lane(-1, wave), lane(-2, WIDE))))
    place = place_at(drawn, "m:1+100", lanes=2)
    for begin, across in place.road.slabs:
        s = 50.0 + begin
        width = 3.0 + 3.0e-4 * s**2 - 1.0e-6 * s**3
        left = across[1][strips.STRIP_LEFT]
        assert left - across[1][strips.STRIP_RIGHT] == pytest.approx(width, abs=0.02)


@pytest.mark.parametrize(
    ("asked", "count"),
    [({"lanes": 1}, 12), ({"lanes": 2}, 0), ({"two_way": False}, 0), ({"road_type": "rural"}, 12)],
)
def test_only_places_that_have_what_is_asked_are_found(asked: dict[str, Any], count: int) -> None:
    assert len(found(two_way(), **asked).places) == count


def test_a_road_that_nobody_reaches_changes_no_place() -> None:
    far = straight(section(lane(0), lane(-1, WIDE)), id="0")
    alone, with_it = (
        found(drawn).places for drawn in (two_way(), network(*two_way().roads.values(), far))
    )
    same = [(place.key, place.road) for place in with_it if place.key.startswith("m:1")]
    assert same == [(place.key, place.road) for place in alone]


def test_a_way_that_changes_sides_is_refused_there() -> None:
    lanes = section(lane(0), lane(-1, WIDE, successors=(1,)))
    there = section(lane(1, WIDE), lane(0))
    one = straight(lanes, id="1", length=100.0, successor=RoadLink("road", "2", "start", 1))
    pose = (100.0, 0.0, 0.0)
    other = road([piece("line", 400.0, pose=pose)], there, id="2", left_hand=True)
    refused = found(network(one, other), before=0.0).refused
    assert refused["where no lane goes on, or traffic changes sides"] == 2


def test_lanes_too_narrow_to_drive_in_are_no_place() -> None:
    narrow = straight(section(lane(0), lane(-1, (0.0, 1.8, 0.0, 0.0, 0.0))))
    assert "where no lane is wide enough" in found(network(narrow)).refused


def test_a_way_that_comes_near_itself_has_no_road() -> None:
    ring = road([piece("arc", 300.0, 1.0 / 40.0)], section(lane(0), lane(-1, WIDE)))
    refused = found(network(ring), before=50.0, after=230.0).refused
    assert "where the way comes near itself" in refused


@pytest.mark.parametrize(
    ("limit", "is_refused"), [(130.0, True), (44.5, True), (44.4, False), (math.inf, False)]
)
def test_a_limit_that_lacks_its_unit_is_none_to_be_kept(limit: float, *, is_refused: bool) -> None:
    types = (RoadType(0.0, "motorway", limit, 1),)
    lanes = section(lane(1, WIDE), lane(0), lane(-1, WIDE))
    asked = found(network(road([piece("line", 400.0)], lanes, types=types)))
    assert {place.fastest > FASTEST_POSTED for place in asked.places} == {is_refused}


@pytest.mark.parametrize(("radius", "found_as"), [(9e4, 9e4), (4e5, math.inf)])
def test_a_road_that_bends_next_to_nothing_is_straight(radius: float, found_as: float) -> None:
    drawn = road([piece("arc", 400.0, 1.0 / radius)], section(lane(0), lane(-1, WIDE)))
    assert found(network(drawn)).places[0].radius == pytest.approx(found_as, rel=0.02)


@pytest.mark.parametrize(("radius", "is_folded"), [(7.5, False), (6.5, True)])
def test_lanes_beyond_the_centre_of_a_bend_are_no_place(radius: float, is_folded: Any) -> None:
    refused = found(bent(radius), before=60.0, after=60.0).refused
    assert ("where lanes reach beyond the centre of a bend" in refused) == is_folded


def test_only_a_road_that_leads_over_such_a_bend_is_none() -> None:
    # At 100 to 110 m: of every 50 m, the roads at 100 and 150 m would lead over it.
    places = found(bent(6.5), before=60.0, after=60.0).places
    keys = [place.key for place in places if place.key.startswith("m:1+")]
    assert keys == ["m:1+200", "m:1+250", "m:1+300", "m:1+350"]


def bent(radius: float) -> OpenDrive:
    """Draw a road with a bend of 10 m after 100 m, whose lane on the inner left ends at 7 m."""
    turn = 10.0 / radius
    end = 100.0 + radius * math.sin(turn), radius * (1.0 - math.cos(turn))
    line = [
        piece("line", 100.0),
        piece("arc", 10.0, 1.0 / radius, pose=(100.0, 0.0, 0.0), s=100.0),
        piece("line", 300.0, pose=(*end, turn), s=110.0),
    ]
    return network(road(line, section(lane(2, WIDE), lane(1, WIDE), lane(0), lane(-1, WIDE))))


def test_a_road_begins_and_ends_as_far_along_the_edge_as_was_asked() -> None:
    spiral = road([piece("spiral", 200.0, 0.0, 1.0 / 80.0)], section(lane(0), lane(-1, WIDE)))
    place = place_at(network(spiral), "m:1+100")
    turned = math.fsum(length * curvature for length, curvature in place.road.line)
    # The right edge is 3.5 m farther out, so that it is longer by as much for each radian.
    ends = [100.0 + 3.5 * 100.0**2 / 32e3 + way for way in (-50.0, 100.0)]
    first, last = ((math.sqrt(1.0 + 4.0 * 3.5 / 32e3 * end) - 1.0) * 32e3 / 7.0 for end in ends)
    # A spiral turns by half of its curvature times its length.
    assert turned == pytest.approx((last**2 - first**2) / 32e3, abs=5e-3)


def test_a_road_rises_in_the_direction_of_travel_as_its_map_says() -> None:
    rising = cubics((0.0, 5.0, 0.02, 0.0, 0.0), (200.0, 9.0, -0.01, 0.0, 0.0))
    lanes = section(lane(1, WIDE), lane(0), lane(-1, WIDE))
    drawn = network(straight(lanes, elevations=rising))
    assert place_at(drawn, "m:1+150").road.grades == ((0.0, 0.02), (100.0, -0.01))
    assert place_at(drawn, "m:1-250").road.grades == ((0.0, 0.01), (100.0, -0.02))
    assert place_at(two_way(), "m:1+150").road.grades == ()


# --- Roads over ramps -----------------------------------------------------------------------------

SHARED = 200.0
"""How long the lane of the ramp is beside those of the carriageway [m]."""


def with_ramp() -> OpenDrive:
    """Return two lanes along x, and one that opens beside them and leaves at 400 m."""
    opening = (0.0, 0.0, 0.0, 3.0 * 3.5 / 50.0**2, -2.0 * 3.5 / 50.0**3)
    widths = [opening, (50.0, 3.5, 0.0, 0.0, 0.0)]
    others = [lane(-1, WIDE, successors=(-1,)), lane(-2, WIDE, successors=(-2,))]
    joined = RoadLink("junction", "j", "", 1)
    sections = [
        section(lane(0), *others),
        section(lane(0), *others, lane(-3, *widths), s=400.0 - SHARED),
    ]
    first = straight(*sections, successor=joined)
    on = road(
        [piece("line", 400.0, pose=(400.0, 0.0, 0.0))],
        section(lane(0), lane(-1, WIDE), lane(-2, WIDE)),
        id="2",
        predecessor=joined,
    )
    ramp = road(
        [piece("arc", 150.0, -0.005, pose=(400.0, -7.0, 0.0))],
        section(lane(0), lane(-1, WIDE)),
        id="3",
        predecessor=joined,
    )
    joint = Junction(
        "j",
        "",
        "direct",
        (
            Connection("0", "1", "2", "start", ((-1, -1), (-2, -2)), 1),
            Connection("1", "1", "3", "start", ((-3, -1),), 1),
        ),
        (),
        1,
    )
    return OpenDrive(
        "drawn.xodr", (1, 8), "", "", {item.id: item for item in (first, on, ramp)}, {"j": joint}
    )


def test_a_road_over_an_exit_ends_on_the_ramp_and_the_other_lanes_end_where_it_leaves() -> None:
    (place,) = found(with_ramp(), "exit", 300.0, after=100.0, route="exit").places
    assert place.key == "m:1+400"
    # Along the edge that carriageway and ramp share, so that the lane that opens bends nothing.
    assert [bend for _, bend in place.road.line] == pytest.approx([0.0, 0.0, -0.005], abs=1e-6)
    lanes = own(place)
    assert [len(lanes[0]), len(lanes[-2]), len(lanes[-1])] == [2, 3, 1]
    edges = [(lane[strips.STRIP_RIGHT], lane[strips.STRIP_LEFT]) for lane in lanes[-2]]
    assert edges == [(-3.5, 0.0), (0.0, 3.5), (3.5, 7.0)]
    assert lanes[-1][0][strips.STRIP_RIGHT] == -3.5


def test_without_a_route_the_road_goes_on_where_most_lanes_do() -> None:
    (place,) = found(with_ramp(), "exit", 300.0, after=100.0).places
    assert [len(lanes) for lanes in own(place)][-1] == 2


def with_left_ramp(route: str) -> OpenDrive:
    """Return three lanes along x of which the left one leaves at 400 m, or comes in there."""
    lanes = section(lane(0), lane(-1, WIDE), lane(-2, WIDE), lane(-3, WIDE))
    joined = RoadLink("junction", "j", "", 1)
    is_exit = route == "exit"
    here, there = ("successor", "predecessor") if is_exit else ("predecessor", "successor")
    begin, further = (0.0, 400.0) if is_exit else (400.0, 0.0)
    bend = piece("arc", 150.0, 0.005, pose=(400.0, 0.0, 0.0))
    if not is_exit:
        # Along s towards the carriageway, which it meets straight on.
        x, y, turned = _end_of_arc(150.0, 0.005, 0.0)
        bend = piece("arc", 150.0, 0.005, pose=(400.0 - x, y, math.pi - turned))
    two = section(lane(0), lane(-1, WIDE), lane(-2, WIDE))
    lines = [
        piece("line", 400.0, pose=(begin, 0.0, 0.0)),
        piece("line", 400.0, pose=(further, -3.5, 0.0)),
        bend,
    ]
    parts = (here, lanes), (there, two), (there, section(lane(0), lane(-1, WIDE)))
    roads = [
        road([line], across, **{"id": str(number), side: joined})
        for number, (line, (side, across)) in enumerate(zip(lines, parts, strict=True), 1)
    ]
    contact = "start" if is_exit else "end"
    connections = (
        Connection("0", "1", "2", contact, ((-2, -1), (-3, -2)), 1),
        Connection("1", "1", "3", contact, ((-1, -1),), 1),
    )
    joint = Junction("j", "", "direct", connections, (), 1)
    return OpenDrive("drawn.xodr", (1, 8), "", "", {item.id: item for item in roads}, {"j": joint})


@pytest.mark.parametrize("route", ["exit", "entry"])
def test_a_ramp_to_the_left_shares_its_right_edge(route: Any) -> None:
    far = (300.0, 100.0) if route == "exit" else (100.0, 300.0)
    (place,) = found(with_left_ramp(route), route, far[0], after=far[1], route=route).places
    bends = [bend for _, bend in place.road.line]
    lanes = own(place)
    whole, ramp = (lanes[0], lanes[-1]) if route == "exit" else (lanes[-1], lanes[0])
    edges = [(strip[strips.STRIP_RIGHT], strip[strips.STRIP_LEFT]) for strip in whole]
    assert edges == [(-7.0, -3.5), (-3.5, 0.0), (0.0, 3.5)]
    assert [(strip[strips.STRIP_RIGHT], strip[strips.STRIP_LEFT]) for strip in ramp] == [(0.0, 3.5)]
    # Its reference line bends by 1/200 m, and its right edge is 3.5 m further out.
    turned = 0.005 / (1.0 + 0.005 * 3.5)
    assert bends == pytest.approx([0.0, turned] if route == "exit" else [turned, 0.0], abs=1e-6)


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        ({"before": 500.0}, "too near to the end of the way"),
        ({"after": 160.0}, "too near to the end of the way"),
    ],
)
def test_a_ramp_that_is_too_short_gives_no_road(asked: dict[str, float], reason: str) -> None:
    asked = {"before": 300.0, "after": 100.0, **asked}
    assert found(with_ramp(), "exit", **asked, route="exit").refused == {reason: 1}


def test_a_place_has_one_type_of_road_from_end_to_end() -> None:
    types = (RoadType(0.0, "rural", math.nan, 1), RoadType(200.0, "town", math.nan, 1))
    drawn = network(straight(section(lane(0), lane(-1, WIDE)), types=types))
    places = found(drawn)
    assert {place.key: place.road_type for place in places.places} == {
        "m:1+50": "rural",
        "m:1+100": "rural",
        "m:1+250": "urban",
        "m:1+300": "urban",
    }
    assert places.refused["where the type of the road changes"] == 2


def test_types_of_the_next_road_count_where_the_place_reaches_them() -> None:
    def typed(*of: tuple[float, str]) -> Any:
        return tuple(RoadType(s, kind, 20.0, 1) for s, kind in of)

    lanes = section(lane(0), lane(-1, WIDE, successors=(-1,)))
    on = RoadLink("road", "2", "start", 1)
    one = straight(lanes, id="1", successor=on, types=typed((0.0, "rural")))
    types = typed((0.0, "rural"), (200.0, "town"))
    there = section(lane(0), lane(-1, WIDE))
    pose = (400.0, 0.0, 0.0)
    other = road([piece("line", 400.0, pose=pose)], there, id="2", types=types)
    for after, keys in ((200.0, {"m:1+300", "m:1+350"}), (300.0, {"m:1+300"})):
        asked = found(network(one, other), before=50.0, after=after)
        assert {"m:1+300", "m:1+350"} & {place.key for place in asked.places} == keys


def test_what_says_no_type_of_road_is_taken_for_none_beside_one_that_does() -> None:
    def of(*types: RoadType) -> Places:
        return found(network(straight(section(lane(0), lane(-1, WIDE)), types=types)))

    late = of(RoadType(200.0, "town", math.nan, 1))
    assert [place.is_type_guessed for place in late.places] == [True, True, False, False]
    assert {place.key: place.road_type for place in late.places} == {
        "m:1+50": "rural",
        "m:1+100": "rural",
        "m:1+250": "urban",
        "m:1+300": "urban",
    }
    limited = of(RoadType(0.0, "rural", 20.0, 1))
    assert not any(place.is_guessed or place.is_type_guessed for place in limited.places)
    assert all(place.is_guessed and place.is_type_guessed for place in of().places)
    for kind in ("pedestrian", "bicycle"):
        assert set(of(RoadType(0.0, kind, 5.0, 1)).refused) >= {"on a road that is none for cars"}


def test_limit_holds_from_where_it_changes_in_the_middle_of_a_section() -> None:
    def limits(key: str) -> list[tuple[float, list[float]]]:
        place = place_at(drawn, key, before=50.0, after=250.0)
        slabs = zip(place.road.slabs, own(place), strict=True)
        return [(s, [strip[strips.STRIP_LIMIT] for strip in lanes]) for (s, _), lanes in slabs]

    slower = (LaneSpeed(120.0, 8.0, 1), LaneSpeed(180.0, 14.0, 1))
    drawn = network(
        straight(
            section(lane(1, WIDE), lane(0), lane(-1, WIDE), lane(-2, WIDE, speeds=slower)),
            types=(RoadType(0.0, "town", 13.0, 1), RoadType(150.0, "town", 5.0, 1)),
        )
    )
    # From the right: the lane that has its own, which goes on where that of the road changes.
    assert limits("m:1+100") == [
        (0.0, [13.0, 13.0]),
        (pytest.approx(70.0), [8.0, 13.0]),
        (pytest.approx(100.0), [8.0, 5.0]),
        (pytest.approx(130.0), [14.0, 5.0]),
    ]
    # The slabs are those of both ways.
    assert limits("m:1-300") == [(0.0, [5.0]), (170.0, [5.0]), (200.0, [13.0]), (230.0, [13.0])]


@pytest.mark.parametrize(("kind", "limit"), [("motorway", 130.0), ("rural", 100.0), ("town", 50.0)])
def test_where_a_map_has_no_limit_it_is_the_usual_one_of_the_type(kind: str, limit: float) -> None:
    types = (RoadType(0.0, kind, math.nan, 1),)
    places = found(network(straight(section(lane(0), lane(-1, WIDE)), types=types))).places
    assert places
    for place in places:
        strip_limits = {strip[strips.STRIP_LIMIT] * 3.6 for (strip,) in own(place)}
        assert place.is_guessed
        assert place.speed_limit * 3.6 == pytest.approx(limit)
        assert list(strip_limits) == [pytest.approx(limit)]
