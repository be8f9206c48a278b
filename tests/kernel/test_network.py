"""Networks of lanes: the lane found from a guess is the one found by looking at all."""

import numpy as np
import pytest

from adeye.kernel import network as k
from adeye.kernel.lanes import LANE_WIDTH, LENGTH, lane_heading, lane_point, write_straight
from adeye.signals import Floats
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


def places(lanes: Floats, curves: Floats | None, count: int) -> list[tuple[float, float, float]]:
    """Return poses near lanes of a network, and some far away."""
    draw = Draw(3)
    found = []
    for _ in range(count):
        lane = draw.below(len(lanes))
        s = draw.between(-8.0, min(lanes[lane, LENGTH], 400.0) + 8.0)
        x, y = lane_point(lanes, lane, curves, s, draw.between(-6.0, 6.0))
        turned = draw.between(-0.5, 0.5) if draw.chance(0.8) else draw.between(-4.0, 4.0)
        found.append((x, y, lane_heading(lanes, lane, curves, s) + turned))
    return [*found, (1e4, -1e4, 0.0), (-500.0, 300.0, 3.0)]


@pytest.mark.parametrize("kind", ROADS)
def test_nearest_lane_is_found_from_any_guess_to_the_bit(kind: str) -> None:
    road = ROADS[kind](connected=True)
    lanes, links, curves = convert_network(road.network, connected=True)
    for x, y, heading in places(lanes, curves, 25):
        expected = k.search_lanes(lanes, curves, x, y, heading)
        for guess in range(0, len(lanes), 3):
            assert k.nearest_lane(lanes, links, curves, guess, x, y, heading) == expected


@pytest.mark.parametrize("kind", ROADS)
def test_nearest_lane_is_highway_env_s_closest_lane(kind: str) -> None:
    road = ROADS[kind](connected=True)
    lanes, _, curves = convert_network(road.network, connected=True)
    names = list(road.network.lanes_dict())
    for x, y, heading in places(lanes, curves, 40):
        found, _, _ = k.search_lanes(lanes, curves, x, y, heading)
        assert names[found] == road.network.get_closest_lane_index(np.array([x, -y]), -heading)


@pytest.mark.parametrize("kind", ROADS)
def test_next_lane_is_highway_env_s_without_a_route(kind: str) -> None:
    road = ROADS[kind](connected=True)
    lanes, links, curves = convert_network(road.network, connected=True)
    names = list(road.network.lanes_dict())
    answers = set()
    for lane, name in enumerate(names):
        for lateral in (-3.0, 0.5, 5.0):
            x, y = lane_point(lanes, lane, curves, float(lanes[lane, LENGTH]) - 1.0, lateral)
            found = k.next_lane(lanes, links, curves, lane, x, y)
            assert names[found] == road.network.next_lane(name, position=np.array([x, -y]))
            answers.add(found != lane)
    # At the crossing every road is followed by another one.
    assert answers == {"straight": {False}, "intersection": {True}}.get(kind, {False, True})


def test_at_the_end_of_the_last_road_the_lane_goes_on_as_itself() -> None:
    lanes = np.zeros((1, LANE_WIDTH))
    write_straight(lanes[0], 0.0, 0.0, 0.0, 100.0, 4.0, np.inf)
    assert k.next_lane(lanes, k.build_links([("a", "b", 1)]), None, 0, 99.0, 0.0) == 0
