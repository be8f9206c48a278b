"""Places on the road: lanes from the right, offsets to the left."""

import math

import numpy as np
import pytest

from adeye.signals import (
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_LANE,
    PLACE_OFFSET,
    PLACE_S,
    Floats,
)
from adeye.simulate.traffic.stage import locate, locate_all

STRAIGHT = np.array([[0.0, 0.0, 0.0, 1000.0, 0.0]])
LEFT = np.array([[0.0, 0.0, 0.0, 300.0, 0.01]])


def place(x: float, y: float, road: Floats = STRAIGHT) -> Floats:
    out = np.zeros(6)
    locate(road, 3.5, 3, x, y, out)
    return out


@pytest.mark.parametrize(
    ("y", "lane", "offset"),
    [(1.75, 0, 0.0), (5.75, 1, 0.5), (8.25, 2, -0.5), (0.0, 0, -1.75)],
)
def test_a_point_on_the_road_has_its_lane_and_its_distance_left_of_the_centre(
    y: float, lane: int, offset: float
) -> None:
    found = place(120.0, y)
    assert found[PLACE_LANE] == lane
    assert found[PLACE_OFFSET] == pytest.approx(offset)
    assert found[PLACE_S] == 120.0


@pytest.mark.parametrize(("y", "offset"), [(-1.0, -2.75), (12.0, 3.25)])
def test_off_the_lanes_the_offset_counts_from_the_nearest(y: float, offset: float) -> None:
    found = place(120.0, y)
    assert found[PLACE_LANE] == -1
    assert found[PLACE_OFFSET] == pytest.approx(offset)


def test_in_a_left_curve_the_road_turns_left() -> None:
    # A quarter circle of 100 m around (0, 100).
    found = place(97.0, 100.0, LEFT)
    assert found[PLACE_S] == pytest.approx(50.0 * math.pi)
    assert found[PLACE_D] == pytest.approx(3.0)
    assert found[PLACE_HEADING] == pytest.approx(math.pi / 2)
    assert found[PLACE_CURVATURE] == 0.01


def test_no_number_is_nowhere() -> None:
    found = place(math.nan, 0.0)
    assert found[PLACE_LANE] == -1
    assert np.isnan(found[[PLACE_S, PLACE_D, PLACE_OFFSET]]).all()


def test_ego_and_objects_of_running_runs_are_located() -> None:
    ego = np.zeros((2, 7))
    ego[:, 0], ego[:, 1] = 10.0, 1.75
    objects = np.zeros((2, 2, 5))
    objects[:, :, 0], objects[:, :, 1] = [[20.0, 30.0]], [[5.25, -1.0]]
    ego_place, places = np.full((2, 6), 7.0), np.full((2, 2, 6), 7.0)
    roads, widths = np.stack([STRAIGHT] * 2), np.array([3.5, 3.5])
    locate_all(np.array([True, False]), ego, objects, roads, widths, 3, ego_place, places)
    assert ego_place[0, :2].tolist() == [10.0, 1.75]
    assert places[0, :, PLACE_S].tolist() == [20.0, 30.0]
    assert places[0, :, PLACE_LANE].tolist() == [1.0, -1.0]
    assert (ego_place[1] == 7.0).all()
    assert (places[1] == 7.0).all()
