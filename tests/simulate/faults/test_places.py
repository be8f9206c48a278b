"""Where faults move things: bearings, turned frames, places on the road, rigid returns."""

import math

import numpy as np
import pytest

from adeye.signals import EGO_X, EGO_Y, ESTIMATE_PLACE, PLACE_D, PLACE_LANE, PLACE_S
from adeye.simulate.faults.sensor_faults import FARTHEST, bearing_of, relocate, shift_points, turned
from tests.simulate.faults.streams import CONTEXT, RUNS


def test_bearing_is_counter_clockwise_and_that_of_no_number_is_none() -> None:
    x, y = np.array([[1.0, 0.0, -1.0, np.inf, np.nan]]), np.array([[0.0, 2.0, 0.0, 1.0, 1.0]])
    found = bearing_of(x, y)[0]
    assert found[:3] == pytest.approx([0.0, math.pi / 2, math.pi])
    assert np.isnan(found[3:]).all()


def test_turned_there_and_back_is_where_it_was() -> None:
    x, y = np.array([[3.0, -1.0]]), np.array([[4.0, 2.0]])
    there = turned(x, y, np.array([[0.7]]))
    assert np.hypot(*there) == pytest.approx(np.hypot(x, y))
    back = turned(*there, np.array([[-0.7]]))
    assert back[0] == pytest.approx(x)
    assert back[1] == pytest.approx(y)


def test_what_is_nowhere_has_no_place_on_the_road() -> None:
    for far in (np.nan, np.inf, -np.inf, 2.0 * FARTHEST, 1e300):
        estimate = np.zeros((RUNS, 13))
        estimate[:, EGO_X], estimate[:, EGO_Y] = 50.0, 1.75
        estimate[0, EGO_X] = far
        relocate(CONTEXT.road, np.array([True, True, False]), estimate)
        place = estimate[:, ESTIMATE_PLACE:]
        assert np.isnan(place[0, [PLACE_S, PLACE_D]]).all(), far
        assert place[0, PLACE_LANE] == -1.0
        assert place[1, [PLACE_S, PLACE_D, PLACE_LANE]].tolist() == [50.0, 1.75, 0.0]
        assert not place[2].any()


def test_returns_move_as_a_rigid_body_does() -> None:
    points = np.array([[[10.0, 0.1, 0.05], [20.0, -0.2, -0.05], [0.0, 0.3, 0.0]]])
    moved = points.copy()
    one = np.ones((1, 1))
    shift_points(moved, np.ones(1, dtype=np.bool_), 0.2 * one, 1.0 * one, -0.5 * one)
    for before, after in zip(points[0, :2], moved[0, :2], strict=True):
        assert after[0] * math.sin(after[2]) == pytest.approx(before[0] * math.sin(before[2]))
        x = before[0] * math.cos(before[2]) * math.cos(before[1]) - 1.0
        y = before[0] * math.cos(before[2]) * math.sin(before[1]) + 0.5
        way = after[0] * math.cos(after[2])
        assert way * math.cos(after[1] + 0.2) == pytest.approx(x)
        assert way * math.sin(after[1] + 0.2) == pytest.approx(y)
    assert moved[0, 2].tolist() == points[0, 2].tolist()
