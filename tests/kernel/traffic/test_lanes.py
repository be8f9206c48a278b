"""Lanes: places beside them are highway-env's with y flipped; places and points are inverse."""

import math

import numpy as np
import pytest
from highway_env.road.lane import CircularLane, StraightLane
from highway_env.road.road import RoadNetwork
from highway_env.utils import wrap_to_pi

from adeye.kernel.traffic import network as k
from adeye.signals import Floats
from benchmarks.support.highway_scenes import convert_network

STRAIGHT = StraightLane((12.0, -3.0), (80.0, 41.0), width=3.75, speed_limit=20.0)

LANES = {
    "straight": STRAIGHT,
    "left": CircularLane((5.0, 7.0), 40.0, 2.2, 0.3, clockwise=False, width=4.0),
    "right": CircularLane((5.0, 7.0), 40.0, 0.3, 2.2, clockwise=True, width=4.0),
    "long": CircularLane((-5.0, 0.0), 15.0, -2.0, 3.5, width=4.0, forbidden=True),
}
POINTS = [(x, y) for x in np.linspace(-60.0, 110.0, 13) for y in np.linspace(-71.0, 62.0, 11)]


def ours(name: str) -> Floats:
    """Return a lane of highway-env in our rows."""
    network = RoadNetwork()
    network.add_lane("a", "b", LANES[name])
    return convert_network(network, connected=False)[0]


def eastward() -> Floats:
    """Return a lane 100 m long and 4 m wide along x."""
    lane = np.zeros((1, k.LANE_WIDTH))
    k.write_straight(lane[0], 0.0, 0.0, 0.0, 100.0, 4.0, math.inf)
    return lane


def turned(first: float, second: float) -> float:
    """Return the angle between two directions."""
    return abs(math.remainder(first - second, 2.0 * math.pi))


@pytest.mark.parametrize("name", LANES)
def test_place_beside_a_lane_and_distance_are_highway_env_s_with_left_positive(name: str) -> None:
    lanes = ours(name)
    for x, y in POINTS:
        s, lateral = LANES[name].local_coordinates(np.array([x, -y]))
        place = k.lane_local(lanes, 0, x, y)
        assert place == pytest.approx((s, -lateral), abs=1e-11)
        distance = k.distance_to_lane(lanes, 0, *place)
        assert distance == pytest.approx(LANES[name].distance(np.array([x, -y])), abs=1e-11)
        least = k.least_distance(lanes, 0, x, y)
        assert least <= distance + 1e-9
        if k.is_on_lane(lanes, 0, *place, 1.0):
            assert least <= lanes[0, k.WIDTH] / 2.0 + 1.0 + k.OVERHANG + 1e-9


@pytest.mark.parametrize("name", LANES)
def test_point_and_heading_at_a_place_are_highway_env_s(name: str) -> None:
    lanes = ours(name)
    for s in np.linspace(-9.5, LANES[name].length + 9.5, 23):
        heading = k.lane_heading(lanes, 0, s)
        assert turned(heading, -LANES[name].heading_at(s)) < 1e-13
        for lateral in (-6.0, 0.0, 1.25):
            x, y = LANES[name].position(s, -lateral)
            assert k.lane_point(lanes, 0, s, lateral) == pytest.approx((x, -y), abs=1e-11)


@pytest.mark.parametrize("name", ["straight", "left", "right"])
def test_local_place_of_a_point_leads_back_to_the_point(name: str) -> None:
    lanes = ours(name)
    for s in np.linspace(0.0, LANES[name].length, 9):
        for lateral in (-4.0, 0.0, 2.5):
            x, y = k.lane_point(lanes, 0, s, lateral)
            assert k.lane_local(lanes, 0, x, y) == pytest.approx((s, lateral), abs=1e-11)


@pytest.mark.parametrize("name", LANES)
@pytest.mark.parametrize("margin", [0.0, 1.0])
def test_what_is_on_a_lane_or_reaches_it_is_highway_env_s_answer(name: str, margin: float) -> None:
    lanes = ours(name)
    lane = LANES[name]
    answers = set()
    for s in np.linspace(-7.3, lane.length + 7.3, 31):
        for lateral in np.linspace(-9.1, 9.1, 14):
            x, y = k.lane_point(lanes, 0, s, lateral)
            theirs = np.array([x, -y])
            place = k.lane_local(lanes, 0, x, y)
            on_it = k.is_on_lane(lanes, 0, *place, margin)
            assert on_it == lane.on_lane(theirs, margin=margin)
            reachable = k.is_reachable(lanes, 0, *place)
            assert reachable == lane.is_reachable_from(theirs)
            answers |= {on_it, reachable}
    assert answers == {True, False}


def test_far_from_a_straight_lane_the_least_distance_says_so() -> None:
    lanes = ours("straight")
    assert k.least_distance(lanes, 0, 500.0, 0.0) == pytest.approx(420.0)


@pytest.mark.parametrize(("turn", "inside"), [(1.0, 1.0), (-1.0, -1.0)])
def test_the_inside_of_a_curve_is_on_the_side_it_turns_to(turn: float, inside: float) -> None:
    lane = np.zeros((1, k.LANE_WIDTH))
    k.write_arc(lane[0], 0.0, 0.0, 50.0, 0.0, turn, 40.0, 4.0, math.inf)
    _, lateral = k.lane_local(lane, 0, 48.0, 0.0)
    assert lateral == pytest.approx(2.0 * inside)
    # From its easternmost point it goes north to the left and south to the right.
    assert k.lane_heading(lane, 0, 0.0) == pytest.approx(turn * math.pi / 2.0)


def test_the_shoulders_of_is_on_lane_count_and_its_far_end_does_not() -> None:
    lane = eastward()
    assert k.is_on_lane(lane, 0, -5.0, 3.0, 1.0)
    assert not k.is_on_lane(lane, 0, 105.0, 0.0, 1.0)
    assert not k.is_on_lane(lane, 0, 50.0, 3.0000001, 1.0)


def test_a_forbidden_lane_cannot_be_reached() -> None:
    lane = eastward()
    assert k.is_reachable(lane, 0, 50.0, 8.0)
    lane[0, k.FORBIDDEN] = 1.0
    assert not k.is_reachable(lane, 0, 50.0, 8.0)


def test_a_nan_place_is_on_no_lane() -> None:
    lane = eastward()
    assert not k.is_on_lane(lane, 0, math.nan, 0.0, 1.0)
    assert not k.is_on_lane(lane, 0, 1.0, math.nan, 1.0)
    assert not k.is_reachable(lane, 0, math.nan, 0.0)


def test_wrapped_has_the_bits_of_highway_env_s_wrap_to_pi() -> None:
    for angle in [*np.linspace(-20.0, 20.0, 101), -math.pi, math.pi, 0.0, -1e-300]:
        assert k.wrapped(angle) == wrap_to_pi(angle)
        assert -math.pi <= k.wrapped(angle) < math.pi


def test_a_box_around_a_long_arc_is_around_its_circle() -> None:
    lane = np.zeros(k.LANE_WIDTH)
    k.write_arc(lane, 1.0, 2.0, 10.0, 0.0, 1.0, 55.0, 4.0, math.inf)
    box = lane[[k.LEAST_X, k.MOST_X, k.LEAST_Y, k.MOST_Y]]
    assert box.tolist() == [-9.0, 11.0, -8.0, 12.0]
