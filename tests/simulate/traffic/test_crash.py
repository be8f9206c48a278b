"""Touching boxes: highway-env's answer for pairs, and the same one from both broad phases."""

import math
from typing import Any

import numpy as np
import pytest
from highway_env.utils import are_polygons_intersecting

from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.drivers import MANY
from adeye.signals import Floats
from benchmarks.support import crash as k
from benchmarks.support.highway_scenes import STEP, Draw, convert, scene
from tests.kernel.lane_road import LaneRoad

SIZE = (5.0, 2.0)


def box(x: float, y: float, heading: float) -> Floats:
    """(4, 2) corners of a car."""
    length, width = SIZE
    along = np.array([-length, -length, length, length]) / 2.0
    across = np.array([width, -width, -width, width]) / 2.0
    cosine, sine = math.cos(heading), math.sin(heading)
    return np.column_stack([x + cosine * along - sine * across, y + sine * along + cosine * across])


def pushed(first: Floats, second: Floats, way: tuple[float, float]) -> tuple[Any, ...]:
    return k.separating_push(np.vstack([first, second]), *way)


@pytest.mark.slow
def test_far_boxes_do_not_touch() -> None:
    assert pushed(box(0, 0, 0), box(20, 0, 0), (0.0, 0.0)) == (False, False, 0.0, 0.0)


@pytest.mark.slow
def test_overlapping_boxes_are_pushed_apart_by_the_overlap() -> None:
    touch, will_touch, x, y = pushed(box(0, 0, 0), box(4.5, 0, 0), (0.0, 0.0))
    assert (touch, will_touch) == (True, True)
    assert (x, y) == pytest.approx((-0.5, 0.0))


def test_a_way_that_closes_the_gap_will_touch_but_does_not() -> None:
    touch, will_touch, x, _ = pushed(box(0, 0, 0), box(5.5, 0, 0), (1.0, 0.0))
    assert (touch, will_touch) == (False, True)
    assert x == pytest.approx(-0.5)


def test_boxes_that_separate_will_not_touch() -> None:
    touch, will_touch, _, _ = pushed(box(0, 0, 0), box(5.5, 0, 0), (-1.0, 0.0))
    assert (touch, will_touch) == (False, False)


def test_what_two_boxes_do_is_highway_env_s_answer() -> None:
    draw = Draw(9)
    answers = set()
    for _ in range(300):
        first = box(0.0, 0.0, draw.between(-3.0, 3.0))
        second = box(draw.between(-7, 7), draw.between(-7, 7), draw.between(-3, 3))
        way = np.array([draw.between(-2, 2), draw.between(-2, 2)])
        touch, will_touch, push = are_polygons_intersecting(
            np.vstack([first, first[:1]]), np.vstack([second, second[:1]]), way, np.zeros(2)
        )
        found = pushed(first, second, (way[0], way[1]))
        assert found[:2] == (touch, will_touch)
        assert found[2:] == pytest.approx((0.0, 0.0) if push is None else tuple(push), abs=1e-12)
        answers.add((bool(touch), bool(will_touch)))
    assert len(answers) >= 3


def bodies_of(road: LaneRoad) -> tuple[Any, ...]:
    return k.make_bodies(np.tile(SIZE, (len(road.vehicles), 1)))


def collide(road: LaneRoad) -> Floats:
    """Let a road's vehicles touch; return the bodies."""
    bodies: Floats
    bodies, pairs, corners = bodies_of(road)
    k.collide(road.vehicles, road.marks, bodies, pairs, corners, STEP)
    k.push(road.vehicles, road.marks, bodies)
    return bodies


def test_two_cars_that_overlap_share_the_push_and_have_crashed() -> None:
    road = LaneRoad(1)
    rear, front = road.put(0, 100.0, 0.0), road.put(0, 104.0, 0.0)
    collide(road)
    assert road.vehicles[[rear, front], n.X].tolist() == pytest.approx([99.5, 104.5])
    assert road.marks[:, n.CRASHED].tolist() == [1, 1]


@pytest.mark.slow
def test_a_car_leaves_a_fixed_object_where_it_is() -> None:
    road = LaneRoad(1)
    car, thing = road.put(0, 100.0, 0.0), road.put(0, 104.0, 0.0, n.FIXED)
    collide(road)
    assert road.vehicles[[car, thing], n.X].tolist() == pytest.approx([99.0, 104.0])


def test_a_push_happens_once() -> None:
    road = LaneRoad(1)
    road.put(0, 100.0, 0.0)
    road.put(0, 104.0, 0.0)
    bodies = collide(road)
    after = road.vehicles.copy()
    k.push(road.vehicles, road.marks, bodies)
    np.testing.assert_array_equal(road.vehicles, after)


def test_cars_in_lanes_side_by_side_do_not_touch() -> None:
    road = LaneRoad(2)
    road.put(0, 100.0)
    road.put(1, 100.0)
    before = road.vehicles.copy()
    collide(road)
    np.testing.assert_array_equal(road.vehicles, before)
    assert not road.marks[:, n.CRASHED].any()


def by_looking_at_all(ours: Any) -> Floats:
    """Touch everybody with everybody, pair by pair, as two at a time."""
    vehicles, marks = ours.vehicles, ours.marks
    bodies, _, corners = ours.bodies
    for first in range(len(vehicles)):
        for second in range(first + 1, len(vehicles)):
            if marks[first, n.ROLE] != n.FIXED and k._are_near(
                vehicles, bodies, first, second, STEP
            ):
                k._collide_pair(vehicles, marks, bodies, corners, first, second, STEP)
    return np.array(bodies)


@pytest.mark.slow
@pytest.mark.parametrize("vehicles", [6, 20])
@pytest.mark.parametrize("kind", ["straight", "intersection"])
def test_culled_pairs_touch_as_all_pairs_do_to_the_bit(kind: str, vehicles: int) -> None:
    crashes = 0
    for seed in range(80 // vehicles):
        road = scene(kind, 80 + seed, vehicles)
        ours, naive = convert(road), convert(road)
        assert (len(ours.vehicles) >= MANY) == (vehicles == 20)
        # Closer together, so that many touch, more than two at a time.
        for side in (ours, naive):
            centre = side.vehicles[:, :2].mean(axis=0)
            side.vehicles[:, :2] = centre + 0.15 * (side.vehicles[:, :2] - centre)
        expected = by_looking_at_all(naive)
        bodies, pairs, corners = ours.bodies
        k.collide(ours.vehicles, ours.marks, bodies, pairs, corners, STEP)
        np.testing.assert_array_equal(bodies, expected)
        np.testing.assert_array_equal(ours.marks[:, n.CRASHED], naive.marks[:, n.CRASHED])
        crashes += int(ours.marks[:, n.CRASHED].sum())
    assert crashes > 10


@pytest.mark.slow
@pytest.mark.parametrize("advance", [k.advance_crashing_reference, k.advance_crashing_fast])
def test_after_a_crash_both_come_to_rest(advance: Any) -> None:
    road = LaneRoad(1)
    road.put(0, 100.0, 30.0, n.CRUISING)
    road.put(0, 130.0, 10.0, n.CRUISING, desired_speed=10.0)
    bodies = bodies_of(road)
    for _ in range(300):
        advance(road.road, *bodies, STEP)
    assert road.marks[:, n.CRASHED].tolist() == [1, 1]
    assert road.vehicles[:, n.SPEED].max() < 1e-5


def test_a_diagonal_reaches_from_corner_to_corner() -> None:
    bodies, pairs, corners = k.make_bodies(np.array([[3.0, 4.0], [6.0, 8.0], [1.0, 0.0]]))
    assert bodies[:, k.DIAGONAL].tolist() == [5.0, 10.0, 1.0]
    assert pairs.shape == (3, 2)
    assert corners.shape == (8, 2)


@pytest.mark.slow
def test_boxes_called_apart_neither_touch_nor_will() -> None:
    draw = Draw(10)
    apart = near = 0
    for _ in range(400):
        road = LaneRoad(1)
        for _ in range(2):
            who = road.put(0, 0.0, draw.between(0.0, 40.0), heading=draw.between(-3.0, 3.0))
            road.vehicles[who, [n.X, n.Y]] = draw.between(-5, 5), draw.between(-5, 5)
        bodies, _, _ = bodies_of(road)
        corners = np.vstack([box(*road.vehicles[who, [n.X, n.Y, n.HEADING]]) for who in range(2)])
        ways = road.vehicles[:, [n.COSINE, n.SINUS]] * road.vehicles[:, [n.SPEED]] * STEP
        answer = k.separating_push(corners, *(ways[0] - ways[1]))
        if k._are_apart(road.vehicles, bodies, 0, 1, STEP):
            assert answer[:2] == (False, False)
            apart += 1
        near += answer[0] or answer[1]
    assert apart > 50
    assert near > 50
