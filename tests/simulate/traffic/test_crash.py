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
