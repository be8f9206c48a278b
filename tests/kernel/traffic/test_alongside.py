"""What drivers decide on one straight road is what they decide on any road."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel.traffic import drivers as k
from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.drivers import MANY, decide
from adeye.kernel.traffic.network import ALONGSIDE, FORBIDDEN
from adeye.signals import Floats, Ints
from benchmarks.support.crash import advance_crashing_reference
from benchmarks.support.highway_scenes import Draw, convert, scene
from tests.kernel.lane_road import LaneRoad

DUE = 1.5
"""A timer that says that a driver should think of changing lanes [s]."""


def both(road: Any) -> tuple[tuple[Floats, Ints], tuple[Floats, Ints]]:
    """Return vehicles and marks after the decisions here and by ``drivers.decide``."""
    ours, expected = (
        road.road._replace(vehicles=road.vehicles.copy(), marks=road.marks.copy()) for _ in range(2)
    )
    k.decide_alongside(ours)
    decide(expected)
    return (ours.vehicles, ours.marks), (expected.vehicles, expected.marks)


def agree(road: Any) -> Floats:
    """See that both decide the same, and return the accelerations."""
    (vehicles, marks), (expected, expected_marks) = both(road)
    np.testing.assert_allclose(vehicles, expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(marks[:, n.TARGET], expected_marks[:, n.TARGET])
    return vehicles[:, n.ACCELERATION]


@pytest.mark.slow
@pytest.mark.parametrize("vehicles", [2, 5, 11, 12, 20, 50])
def test_drivers_of_a_scene_decide_as_on_any_road(vehicles: int) -> None:
    changes = 0
    for seed in range(4):
        ours = convert(scene("straight", 900 + seed, vehicles))
        assert ours.lanes[0, ALONGSIDE] == 1.0
        for _ in range(100):
            agree(ours)
            ours.advance(advance_crashing_reference)
            changes += int((ours.marks[:, n.TARGET] != ours.marks[:, n.LANE]).sum())
    assert changes > 0 or vehicles < 5


@pytest.mark.parametrize("others", [3, MANY])
def test_of_those_abreast_each_is_ahead_of_the_other(others: int) -> None:
    road = LaneRoad()
    for _ in range(3):
        road.put(1, 100.0, 20.0, timer=DUE)
    for place in range(others):
        road.put(1, 130.0 + 20.0 * place, 15.0)
    assert agree(road)[:3].tolist() == [-6.0] * 3


@pytest.mark.slow
@pytest.mark.parametrize("others", [0, MANY])
@pytest.mark.parametrize("exponent", [0.0, 3.7, 4.0, 16.0, 17.5, -2.5, -40.5])
@pytest.mark.parametrize("speed", [0.0, 0.3, 10.0, 29.0, 44.0, 80.0])
def test_every_power_of_the_speed_is_right(others: int, exponent: float, speed: float) -> None:
    road = LaneRoad()
    road.put(1, 1500.0, speed, exponent=exponent)
    for place in range(others):
        road.put(1, 80.0 * place, 25.0)
    if speed == 0.0 and exponent < 0.0:
        assert both(road)[0][0][0, n.ACCELERATION] == -6.0
        return
    agree(road)


@pytest.mark.parametrize("others", [0, MANY])
def test_objects_crashed_ones_and_forbidden_lanes_count_as_on_any_road(others: int) -> None:
    changed = set()
    for seed in range(60):
        draw = Draw(seed)
        road = LaneRoad()
        road.lanes[draw.below(3), FORBIDDEN] = float(draw.chance(0.5))
        for _ in range(4 + others):
            role = (n.FIXED, n.PLACED, n.CRUISING, n.FOLLOWING, n.CHANGING)[draw.below(5)]
            road.put(
                draw.below(3),
                5.0 * draw.below(20),
                draw.between(0.0, 30.0),
                role,
                lateral=0.0,
                timer=DUE,
                heading=draw.between(-0.2, 0.2),
                desired_speed=draw.between(5.0, 40.0),
            )
            road.marks[-1, n.CRASHED] = draw.chance(0.2)
            road.marks[-1, n.TARGET] = draw.below(3)
        before = road.marks[:, n.TARGET].copy()
        agree(road)
        (_, marks), _ = both(road)
        changed |= {tuple(pair) for pair in np.stack([before, marks[:, n.TARGET]], axis=1).tolist()}
    # They left each lane, to each side, or gave a change up.
    assert {(0, 1), (1, 0), (1, 2), (2, 1)} <= changed


def test_beyond_the_ends_nobody_is_seen() -> None:
    road = LaneRoad(1)
    rear = road.put(0, 1960.0, 20.0)
    road.put(0, 2004.0, 0.0)
    assert agree(road)[rear] < 0.0
    road.put(0, 1900.0, 20.0)
    road.vehicles[1, [n.X, n.S]] = 2006.0
    assert agree(road)[rear] == pytest.approx(3.0 * (1.0 - (2.0 / 3.0) ** 4))


def test_the_order_of_a_tick_ago_changes_nothing() -> None:
    ours = convert(scene("straight", 31, 20))
    found = []
    for order in (np.arange(20), np.arange(20)[::-1], np.roll(np.arange(20), 7)):
        vehicles, marks = ours.vehicles.copy(), ours.marks.copy()
        marks[:, n.ORDER] = order
        k.decide_alongside(ours.road._replace(vehicles=vehicles, marks=marks))
        found.append(vehicles[:, n.ACCELERATION].copy())
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])
    assert math.isfinite(found[0].sum())
