"""Who is ahead and behind: both searches give the same answer, which is highway-env's."""

import math
from itertools import permutations

import numpy as np
import pytest

from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.drivers import locate
from adeye.kernel.traffic.network import LANE_WIDTH, build_links, lane_local, write_straight
from benchmarks.support.highway_scenes import ROADS, Converted, Draw, convert, scene
from tests.kernel.lane_road import LaneRoad


def both(road: n.Road, lane: int, who: int, s: float) -> tuple[int, int]:
    """Return the one answer of the two searches."""
    plain = road._replace(seen=road.seen.copy(), listed=road.listed.copy())
    n.forget_lists(plain.listed)
    n.see_around(plain, lane)
    found = n.neighbours(plain, lane, who, s)
    n.forget_lists(road.listed)
    n.sort_along(road.vehicles, road.marks)
    n.list_around(road, lane)
    assert (n.front_listed(road, lane, who, s), n.rear_listed(road, lane, who, s)) == found
    return found


def around(road: LaneRoad, lane: int, who: int) -> tuple[int, int]:
    return both(road.road, lane, who, float(road.vehicles[who, n.S]))


def test_alone_nobody_is_ahead_or_behind() -> None:
    road = LaneRoad()
    road.put(1, 100.0)
    assert [around(road, lane, 0) for lane in range(3)] == [(-1, -1)] * 3


def test_the_nearest_on_the_lane_counts_not_the_nearest() -> None:
    road = LaneRoad()
    who = road.put(1, 100.0)
    road.put(0, 105.0)
    far, near = road.put(1, 150.0), road.put(1, 120.0)
    behind = road.put(1, 60.0)
    assert around(road, 1, who) == (near, behind)
    assert far != near


def test_somebody_abreast_on_the_other_lane_is_ahead() -> None:
    road = LaneRoad()
    who, other = road.put(1, 100.0), road.put(0, 100.0)
    assert around(road, 0, who) == (other, -1)


def test_of_equal_places_the_last_is_ahead_and_the_first_behind() -> None:
    road = LaneRoad()
    who = road.put(1, 100.0)
    ahead = [road.put(1, 120.0) for _ in range(3)]
    behind = [road.put(1, 80.0) for _ in range(3)]
    assert around(road, 1, who) == (ahead[-1], behind[0])


def test_a_lane_lists_its_vehicles_along_it_whatever_their_order_before() -> None:
    road = LaneRoad()
    for s in (100.0, 60.0, 140.0, 60.0):
        road.put(1, s)
    for order in permutations(range(4)):
        road.marks[:, n.ORDER] = order
        found = road.road
        n.forget_lists(found.listed)
        n.list_around(found, 1)
        assert found.listed[1].tolist() == [4, 1, 3, 0, 2], order
        assert found.along[1, :4].tolist() == [60.0, 60.0, 100.0, 140.0]


def test_a_vehicle_between_two_lanes_is_seen_on_both() -> None:
    road = LaneRoad(2)
    who = road.put(1, 100.0)
    between = road.put(1, 130.0)
    road.vehicles[between, n.Y] = -2.0
    assert around(road, 0, who) == around(road, 1, who) == (between, -1)


@pytest.mark.slow
def test_a_vehicle_more_than_a_metre_off_the_lane_is_not_seen() -> None:
    road = LaneRoad(1)
    who, other = road.put(0, 100.0), road.put(0, 130.0)
    road.vehicles[other, n.Y] = 3.0
    assert around(road, 0, who) == (other, -1)
    road.vehicles[other, n.Y] = 3.001
    assert around(road, 0, who) == (-1, -1)


def test_a_fixed_object_is_seen() -> None:
    road = LaneRoad(1)
    who, thing = road.put(0, 100.0), road.put(0, 150.0, 0.0, n.FIXED)
    assert around(road, 0, who) == (thing, -1)


@pytest.mark.slow
@pytest.mark.parametrize(("me", "other", "expected"), [(80, 140, (1, -1)), (140, 80, (-1, 1))])
def test_linked_lanes_count_beyond_ends(me: float, other: float, expected: tuple[int, int]) -> None:
    lanes = np.zeros((2, LANE_WIDTH))
    for number in range(2):
        write_straight(lanes[number], 100.0 * number, 0.0, 0.0, 100.0, 4.0, math.inf)
    roads = [("a", "b", 1), ("b", "c", 1)]
    vehicles = np.zeros((2, n.VEHICLE_WIDTH))
    vehicles[:, n.X], vehicles[:, n.COSINE] = (me, other), 1.0
    marks = np.zeros((2, n.MARK_WIDTH), dtype=np.int64)
    marks[:, n.ORDER] = 0, 1
    road = n.Road(lanes, build_links(roads), vehicles, marks, *n.make_lists(2, 2))
    for who in range(2):
        locate(road, who)
    lane, s = int(marks[0, n.LANE]), float(vehicles[0, n.S])
    assert both(road, lane, 0, s) == expected
    unlinked = build_links(roads, connected=False)
    assert both(road._replace(links=unlinked), lane, 0, s) == (-1, -1)


def test_place_along_is_kept_on_the_own_lane_and_computed_on_others() -> None:
    road = LaneRoad()
    who = road.put(1, 100.0)
    road.vehicles[who, n.S] = 101.0
    assert n.place_along(road.road, 1, who) == 101.0
    assert n.place_along(road.road, 0, who) == 100.0


def answers(ours: Converted) -> set[tuple[int, int]]:
    """See that both searches agree on everybody's own lane and on all others."""
    road = ours.road
    return {
        both(road, lane, who, n.place_along(road, lane, who))
        for who in range(len(road.vehicles))
        for lane in range(len(road.lanes))
    }


@pytest.mark.parametrize("kind", ROADS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_sorted_search_is_the_naive_one_to_the_bit(kind: str, seed: int) -> None:
    ours = convert(scene(kind, 40 + seed, 15))
    assert len(answers(ours)) > 5
    # Again with many in equal places, and with the order of the tick before.
    ours.vehicles[5:10, n.X : n.SPEED] = ours.vehicles[0, n.X : n.SPEED]
    for who in range(len(ours.vehicles)):
        locate(ours.road, who)
    answers(ours)


@pytest.mark.parametrize("kind", ROADS)
@pytest.mark.parametrize("seed", [3, 4, 5, 6])
def test_neighbours_are_highway_env_s(kind: str, seed: int) -> None:
    road = scene(kind, seed, 6)
    ours = convert(road)
    things = [*road.vehicles, *road.objects]
    n.forget_lists(ours.road.listed)
    names = list(road.network.lanes_dict())
    draw = Draw(seed)
    for who, vehicle in enumerate(road.vehicles):
        for lane in {int(ours.marks[who, n.LANE]), draw.below(len(names))}:
            x, y = ours.vehicles[who, [n.X, n.Y]]
            s, _ = lane_local(ours.lanes, lane, x, y)
            n.see_around(ours.road, lane)
            found = n.neighbours(ours.road, lane, who, s)
            theirs = road.neighbour_vehicles(vehicle, names[lane])
            expected = [things.index(v) if v is not None else -1 for v in theirs]
            assert list(found) == expected
