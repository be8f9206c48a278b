"""What drivers decide: IDM and MOBIL against laws, hand-made scenes and highway-env."""

import math
from typing import Any

import numpy as np
import pytest
from highway_env.utils import not_zero as their_not_zero
from highway_env.vehicle.controller import MDPVehicle

from adeye.kernel.traffic import drivers as k
from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.network import LANE_LENGTH
from benchmarks.support.highway_scenes import convert, scene
from tests.kernel.lane_road import LENGTH, LaneRoad

DUE = 1.5
"""A timer that says that a driver should think of changing lanes [s]."""


def acceleration(road: LaneRoad, who: int) -> float:
    road.decide()
    return float(road.vehicles[who, n.ACCELERATION])


def test_a_divisor_is_kept_from_zero_as_in_highway_env() -> None:
    for value in (0.0, -0.0, 1e-3, -1e-3, 1e-2, -1e-2, 0.02, -5.0):
        assert k.not_zero(value) == their_not_zero(value)


def test_alone_the_acceleration_falls_from_the_largest_to_zero_at_the_desired_speed() -> None:
    # The speed limit caps the desired speed.
    for speed, limit, expected in ((30.0, np.inf, 0.0), (0.0, np.inf, 3.0), (20.0, 20.0, 0.0)):
        road = LaneRoad(limit=limit)
        assert acceleration(road, road.put(1, 100.0, speed)) == expected


def test_a_far_leader_of_equal_speed_takes_the_share_of_the_gap() -> None:
    road = LaneRoad(1)
    rear = road.put(0, 100.0, 20.0)
    road.put(0, 180.0, 20.0)
    gap = 10.0 + 1.5 * 20.0
    expected = 3.0 * (1.0 - (20.0 / 30.0) ** 4 - (gap / 80.0) ** 2)
    assert acceleration(road, rear) == pytest.approx(expected, rel=1e-14)


def test_desired_gap_grows_with_the_closing_speed_along_the_follower_and_the_length() -> None:
    least = 2.0 * math.sqrt(15.0)
    leaders: list[tuple[float, dict[str, Any], float]] = [
        (30.0, {}, 10.0 + 45.0 + 30.0 * 10.0 / least),
        # A longer one is kept half the difference further away.
        (20.0, {"length": 12.0}, 10.0 + 30.0 + 3.5),
        (20.0, {"heading": math.pi / 3.0}, 10.0 + 30.0 + 20.0 * 10.0 / least),
    ]
    for speed, leader, expected in leaders:
        road = LaneRoad(1)
        rear, front = road.put(0, 0.0, speed), road.put(0, 100.0, 20.0, **leader)
        found = k.desired_gap(road.vehicles, rear, rear, front)
        assert found == pytest.approx(expected, rel=1e-14)


def test_a_close_leader_brakes_no_harder_than_the_limit() -> None:
    road = LaneRoad(1)
    rear = road.put(0, 100.0, 30.0)
    road.put(0, 107.0, 0.0)
    assert acceleration(road, rear) == -k.MAX_ACCELERATION


def test_a_fixed_object_ahead_is_braked_for_and_asked_for_nothing() -> None:
    road = LaneRoad(1)
    rear = road.put(0, 100.0, 20.0)
    thing = road.put(0, 130.0, 0.0, n.FIXED)
    assert acceleration(road, rear) < -3.0
    assert k.following_acceleration(road.road, rear, thing, -1) == 0.0
    assert k.following_acceleration(road.road, rear, -1, thing) == 0.0


def test_one_who_cruises_keeps_its_speed_whoever_is_ahead() -> None:
    road = LaneRoad(1)
    who = road.put(0, 100.0, 20.0, n.CRUISING, desired_speed=26.0)
    road.put(0, 110.0, 0.0)
    assert acceleration(road, who) == pytest.approx(10.0)


# --- MOBIL ----------------------------------------------------------------------------------------


def overtaking(timer: float = DUE, role: int = n.CHANGING) -> tuple[LaneRoad, int]:
    """A driver behind a slow one in the right of two lanes."""
    road = LaneRoad(2)
    who = road.put(1, 100.0, 25.0, role, timer=timer)
    road.put(1, 130.0, 12.0, n.FOLLOWING)
    return road, who


def target(road: LaneRoad, who: int) -> int:
    road.decide()
    return int(road.marks[who, n.TARGET])


def test_a_driver_leaves_the_lane_of_a_slow_leader() -> None:
    road, who = overtaking()
    assert target(road, who) == 0
    assert road.vehicles[who, n.TIMER] == 0.0


def test_a_driver_sees_who_was_put_first_ahead_of_it_on_the_other_lane() -> None:
    road = LaneRoad(2)
    road.put(0, 128.0, 12.0, n.FOLLOWING)
    who = road.put(1, 100.0, 25.0, timer=DUE)
    road.put(1, 130.0, 12.0, n.FOLLOWING)
    assert target(road, who) == 1


def test_a_driver_stays_before_its_time_without_gain_or_where_it_may_not_go() -> None:
    early, early_who = overtaking(1.0)
    assert target(early, early_who) == 1
    assert early.vehicles[early_who, n.TIMER] == 1.0
    following = overtaking(role=n.FOLLOWING)
    fast_behind, slow, forbidden = overtaking(), overtaking(), overtaking()
    fast_behind[0].put(0, 85.0, 33.0)
    slow[0].vehicles[slow[1], n.SPEED] = 0.99
    forbidden[0].lanes[0, LANE_LENGTH] = 50.0
    alone = LaneRoad(3)
    no_gain = alone, alone.put(1, 100.0, 29.0, timer=DUE)
    for road, who in (following, fast_behind, slow, forbidden, no_gain):
        assert target(road, who) == 1


def test_of_two_good_lanes_the_right_one_is_taken() -> None:
    # Both sides are looked at, left first; the last good one stays.
    road = LaneRoad(3)
    who = road.put(1, 100.0, 25.0, timer=DUE)
    road.put(1, 130.0, 12.0, n.FOLLOWING)
    assert target(road, who) == 2


def changing_ahead(role: int = n.CHANGING) -> tuple[LaneRoad, int, int]:
    """Two drivers on the outer lanes, both on the way to the middle, one ahead of the other."""
    road = LaneRoad(3)
    who, other = road.put(0, 100.0), road.put(2, 110.0, role=role)
    road.marks[[who, other], n.TARGET] = 1
    return road, who, other


def test_the_one_behind_gives_up_a_change_to_the_same_lane() -> None:
    road, who, other = changing_ahead()
    assert target(road, who) == 0
    assert road.marks[other, n.TARGET] == 1


def test_a_placed_vehicle_on_the_way_to_the_same_lane_is_not_given_way() -> None:
    road, who, _ = changing_ahead(n.PLACED)
    assert target(road, who) == 1


def test_a_later_driver_sees_what_an_earlier_one_has_just_chosen() -> None:
    # Both would take the middle lane. The first one does; the second one, behind, then gives up.
    road = LaneRoad(3)
    first = road.put(0, 110.0, 25.0, timer=DUE)
    second = road.put(2, 100.0, 25.0)
    road.marks[second, n.TARGET] = 1
    road.put(0, 140.0, 12.0, n.FOLLOWING)
    road.decide()
    assert road.marks[[first, second], n.TARGET].tolist() == [1, 2]


def test_while_changing_the_slower_of_both_leaders_counts() -> None:
    road = LaneRoad(2)
    who = road.put(1, 100.0, 25.0)
    road.put(1, 160.0, 20.0)
    road.put(0, 125.0, 20.0)
    alone = acceleration(road, who)
    road.marks[who, n.TARGET] = 0
    assert acceleration(road, who) < alone


def test_a_crashed_driver_decides_nothing() -> None:
    road, who = overtaking()
    road.marks[who, n.CRASHED] = 1
    road.vehicles[who, n.ACCELERATION] = 1.25
    road.decide()
    assert road.vehicles[who, n.ACCELERATION] == 1.25
    assert road.marks[who, n.TARGET] == 1


def test_at_the_end_of_the_last_road_a_driver_goes_on() -> None:
    road = LaneRoad(2)
    who = road.put(1, LENGTH - 1.0)
    assert target(road, who) == 1


@pytest.mark.parametrize("vehicles", [k.MANY - 2, k.MANY + 3])
def test_few_and_many_decide_alike_on_a_road_that_they_share(vehicles: int) -> None:
    # The same platoon, once with bystanders far behind that make it many.
    found = []
    for bystanders in (0, vehicles - 5):
        road = LaneRoad(3)
        for place in range(5):
            road.put(place % 3, 500.0 + 9.0 * place, 25.0 - 3.0 * (place % 2), timer=DUE)
        for number in range(bystanders):
            road.put(0, 1.0 + 0.5 * number, 0.0, n.FIXED)
        road.decide()
        found.append((road.vehicles[:5, n.ACCELERATION].copy(), road.marks[:5, n.TARGET].copy()))
    np.testing.assert_array_equal(found[0][0], found[1][0])
    np.testing.assert_array_equal(found[0][1], found[1][1])


@pytest.mark.parametrize("kind", ["straight", "curved", "intersection"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_acceleration_behind_anybody_is_highway_env_s(kind: str, seed: int) -> None:
    road = scene(kind, seed, 5)
    ours = convert(road)
    for driver, vehicle in enumerate(road.vehicles):
        if isinstance(vehicle, MDPVehicle):
            continue
        for rear in range(len(road.vehicles)):
            for front in (-1, *range(len(road.vehicles))):
                if front == rear:
                    continue
                ahead = None if front < 0 else road.vehicles[front]
                expected = vehicle.acceleration(road.vehicles[rear], ahead)
                found = k.following_acceleration(ours.road, driver, rear, front)
                assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("kind", ["straight", "curved"])
def test_decisions_of_a_tick_are_highway_env_s(kind: str) -> None:
    changes = 0
    for seed in range(6):
        road = scene(kind, 60 + seed, 10)
        for vehicle in road.vehicles:
            vehicle.timer = DUE
        ours = convert(road)
        road.act()
        k.decide(ours.road)
        names = list(road.network.lanes_dict())
        for who, vehicle in enumerate(road.vehicles):
            assert names[ours.marks[who, n.TARGET]] == vehicle.target_lane_index
            expected = vehicle.action["acceleration"]
            assert ours.vehicles[who, n.ACCELERATION] == pytest.approx(expected, abs=1e-10)
            changes += vehicle.target_lane_index != vehicle.lane_index
    assert changes > 0
