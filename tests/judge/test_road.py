"""On the road and in a refuge: what the evaluation of a trace asks."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from adeye.judge.outcome import in_refuge, on_road
from adeye.signals import EGO_HEADING, PLACE_D, PLACE_S
from tests.judge.conftest import HandMade

Make = Callable[..., HandMade]
BAY = np.array([[[0.0, 40.0, 60.0, 4.0, 20.0]]])


def test_the_bay_belongs_to_the_road(hand_made: Make) -> None:
    made = hand_made(rows=6)
    made.ego(s=np.array([0.0, 50.0, 50.0, 50.0, 50.0, 30.0]), d=-5.0, speed=1.0)
    trace = made.trace()
    road, places = trace.layout.context.road, trace["ego_place"].astype(np.float64)
    places[0, :, PLACE_D] = [1.0, 1.0, -5.0, -6.1, np.nan, -5.0]
    assert on_road(road, places).tolist() == [[True, True, False, False, False, False]]
    bay = replace(road, refuges=BAY)
    assert on_road(bay, places).tolist() == [[True, True, True, False, False, False]]
    verge = replace(road, verge=road.verge + 3.0)
    assert on_road(verge, places).tolist() == [[True, True, True, False, False, True]]


def test_the_whole_ego_is_in_the_bay_or_it_is_not(hand_made: Make) -> None:
    made = hand_made(rows=4)
    made.ego(s=np.array([50.0, 50.0, 50.0, 25.0]), d=-4.0, speed=1.0)
    trace = made.trace()
    context = trace.layout.context
    places = trace["ego_place"].astype(np.float64)
    headings = trace["ego"][..., EGO_HEADING].astype(np.float64)
    places[0, :, PLACE_S] = [50.0, 50.0, 50.0, 25.0]
    places[0, :, PLACE_D] = [-4.0, -2.9, -4.0, -4.0]
    headings[0, 2] = 0.8
    assert not in_refuge(context, places, headings).any()
    with_bay = replace(context, road=replace(context.road, refuges=BAY))
    assert in_refuge(with_bay, places, headings).tolist() == [[True, False, False, False]]


def test_the_road_begins_and_ends(hand_made: Make) -> None:
    made = hand_made(rows=6)
    trace = made.trace()
    road, places = trace.layout.context.road, trace["ego_place"].astype(np.float64)
    road = replace(road, length=np.array([3000.0]), verge=np.array([9.0]))
    places[0, :, PLACE_S] = [-0.1, 0.0, 1.0, 3000.0, 3000.1, np.nan]
    for d in (5.25, -9.0):
        places[0, :, PLACE_D] = d
        assert on_road(road, places).tolist() == [[False, True, True, True, False, False]]
