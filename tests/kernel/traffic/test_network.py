"""Networks of lanes: the lane found from a guess is the one found by looking at all."""

import numpy as np
import pytest

from adeye.kernel.traffic import network as k
from adeye.signals import Floats, Ints
from benchmarks.support.highway_scenes import ROADS, Draw, convert_network


def test_lanes_of_a_road_are_numbered_from_the_left_and_know_their_road() -> None:
    links = k.build_links([("a", "b", 2), ("b", "c", 3)])
    assert links[:, k.FIRST].tolist() == [0, 0, 2, 2, 2]
    assert links[:, k.COUNT].tolist() == [2, 2, 3, 3, 3]
    assert links[:, k.PLACE].tolist() == [0, 1, 0, 1, 2]
    assert links[:, k.NEXT_ROADS].tolist() == [1, 1, 0, 0, 0]


def test_a_driver_looks_into_the_same_lane_of_the_next_road_or_the_first() -> None:
    links = k.build_links([("a", "b", 2), ("b", "c", 1), ("b", "d", 3)])
    # The second lane: no second lane in b-c, so its only one; the second one of b-d.
    row = links[1]
    assert row[k.LINKED] == 2
    assert row[k.LIST : k.LIST + 2].tolist() == [2, 3]
    assert row[k.LIST + 2 : k.LIST + 4].tolist() == [2, 4]


def test_a_driver_looks_back_into_the_roads_that_lead_here() -> None:
    links = k.build_links([("a", "c", 1), ("b", "c", 1), ("c", "d", 1)])
    row = links[2]
    assert (row[k.NEXT_ROADS], row[k.LINKED]) == (0, 2)
    assert row[k.LIST : k.LIST + 2].tolist() == [0, 1]


def test_unconnected_lanes_are_followed_but_not_looked_into() -> None:
    links = k.build_links([("a", "b", 1), ("b", "c", 1)], connected=False)
    assert links[:, k.LINKED].tolist() == [0, 0]
    assert links[:, k.NEXT_ROADS].tolist() == [1, 0]


def places(lanes: Floats, count: int) -> list[tuple[float, float, float]]:
    """Return poses near lanes of a network, and some far away."""
    draw = Draw(3)
    found = []
    for _ in range(count):
        lane = draw.below(len(lanes))
        s = draw.between(-8.0, min(lanes[lane, k.LANE_LENGTH], 400.0) + 8.0)
        x, y = k.lane_point(lanes, lane, s, draw.between(-6.0, 6.0))
        turned = draw.between(-0.5, 0.5) if draw.chance(0.8) else draw.between(-4.0, 4.0)
        found.append((x, y, k.lane_heading(lanes, lane, s) + turned))
    return [*found, (1e4, -1e4, 0.0), (-500.0, 300.0, 3.0)]


def looked_for(lanes: Floats, x: float, y: float, heading: float) -> tuple[int, float, float]:
    """Return the lane nearest in place and direction, and the place beside it, of all lanes."""
    found = [k.lane_local(lanes, number, x, y) for number in range(len(lanes))]
    weights = [k._weight(lanes, number, *place, heading) for number, place in enumerate(found)]
    number = int(np.argmin(weights))
    return (number, *found[number])


@pytest.mark.parametrize("kind", ROADS)
def test_nearest_lane_is_found_from_any_guess_to_the_bit(kind: str) -> None:
    road = ROADS[kind](connected=True)
    lanes, links = convert_network(road.network, connected=True)
    for x, y, heading in places(lanes, 25):
        expected = looked_for(lanes, x, y, heading)
        for guess in range(0, len(lanes), 3):
            assert k.nearest_lane(lanes, links, guess, x, y, heading) == expected


@pytest.mark.slow
@pytest.mark.parametrize("kind", ROADS)
def test_nearest_lane_is_highway_env_s_closest_lane(kind: str) -> None:
    road = ROADS[kind](connected=True)
    lanes, _ = convert_network(road.network, connected=True)
    names = list(road.network.lanes_dict())
    for x, y, heading in places(lanes, 40):
        found, _, _ = looked_for(lanes, x, y, heading)
        assert names[found] == road.network.get_closest_lane_index(np.array([x, -y]), -heading)


@pytest.mark.parametrize("kind", ROADS)
def test_next_lane_is_highway_env_s_without_a_route(kind: str) -> None:
    road = ROADS[kind](connected=True)
    lanes, links = convert_network(road.network, connected=True)
    names = list(road.network.lanes_dict())
    answers = set()
    for lane, name in enumerate(names):
        for lateral in (-3.0, 0.5, 5.0):
            x, y = k.lane_point(lanes, lane, float(lanes[lane, k.LANE_LENGTH]) - 1.0, lateral)
            found = k.next_lane(lanes, links, lane, x, y)
            assert names[found] == road.network.next_lane(name, position=np.array([x, -y]))
            answers.add(found != lane)
    # At the crossing every road is followed by another one.
    assert answers == {"straight": {False}, "intersection": {True}}.get(kind, {False, True})


@pytest.mark.slow
def test_at_the_end_of_the_last_road_the_lane_goes_on_as_itself() -> None:
    lanes = np.zeros((1, k.LANE_WIDTH))
    k.write_straight(lanes[0], 0.0, 0.0, 0.0, 100.0, 4.0, np.inf)
    assert k.next_lane(lanes, k.build_links([("a", "b", 1)]), 0, 99.0, 0.0) == 0


def straight_road(heading: float = 0.0, widths: tuple[float, ...] = (4.0, 4.0, 3.0)) -> Floats:
    """Lanes side by side from a point, 4 m from centre to centre."""
    lanes = np.zeros((len(widths), k.LANE_WIDTH))
    for number, width in enumerate(widths):
        x, y = 50.0 + 4.0 * number * np.sin(heading), 20.0 - 4.0 * number * np.cos(heading)
        k.write_straight(lanes[number], x, y, heading, 300.0, width, np.inf)
    return lanes


def is_alongside(lanes: Floats, links: Ints) -> bool:
    k.mark_alongside(lanes, links)
    assert len({*lanes[:, k.ALONGSIDE]}) == 1
    return bool(lanes[0, k.ALONGSIDE])


@pytest.mark.parametrize("heading", [0.0, 0.4, -2.9])
def test_lanes_of_one_straight_road_are_alongside(heading: float) -> None:
    assert is_alongside(straight_road(heading), k.build_links([("a", "b", 3)]))


def test_lanes_of_anything_else_are_not_alongside() -> None:
    one_road = k.build_links([("a", "b", 3)])
    two_roads = k.build_links([("a", "b", 2), ("c", "d", 1)])
    followed = k.build_links([("a", "a", 3)])
    assert not is_alongside(straight_road(), two_roads)
    assert not is_alongside(straight_road(), followed)
    assert not is_alongside(straight_road(widths=(4.0, 4.0, 4.1)), one_road)
    for x, y, heading, length in (
        (51.0, 12.0, 0.0, 300.0),
        (50.0, 12.0, 1e-3, 300.0),
        (50.0, 12.0, 0.0, 299.0),
        (50.0, 13.0, 0.0, 300.0),
    ):
        lanes = straight_road()
        k.write_straight(lanes[2], x, y, heading, length, 4.0, np.inf)
        assert not is_alongside(lanes, one_road)
    lanes = straight_road()
    k.write_arc(lanes[2], 50.0, 500.0, 488.0, -np.pi / 2.0, 1.0, 300.0, 4.0, np.inf)
    assert not is_alongside(lanes, one_road)


@pytest.mark.parametrize("kind", [kind for kind in ROADS if kind != "straight"])
def test_only_the_straight_road_of_highway_env_is_alongside(kind: str) -> None:
    for connected in (False, True):
        lanes, _ = convert_network(ROADS[kind](connected=connected).network, connected=connected)
        assert not lanes[:, k.ALONGSIDE].any()


@pytest.mark.parametrize("heading", [0.0, 0.4, -2.9])
def test_alone_nearest_is_the_lane_that_looking_at_all_finds(heading: float) -> None:
    lanes = straight_road(heading)
    links = k.build_links([("a", "b", 3)])
    k.mark_alongside(lanes, links)
    draw = Draw(3)
    sure = 0
    for _ in range(3000):
        number = draw.below(3)
        s, lateral = draw.between(-40.0, 340.0), draw.between(-6.0, 6.0)
        x, y = k.lane_point(lanes, number, s, lateral)
        direction = heading + draw.between(-3.0, 3.0)
        place = k.straight_local(lanes, number, x, y)
        if k.is_alone_nearest(lanes, number, place[1]):
            assert looked_for(lanes, x, y, direction) == (number, *place)
            sure += 1
    assert 500 < sure < 2000


def test_nothing_is_alone_nearest_where_lanes_are_not_alongside() -> None:
    lanes = straight_road()
    assert not k.is_alone_nearest(lanes, 0, 0.0)
