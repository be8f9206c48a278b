"""The lines of a road: lanes between edges that are theirs, on parametric and on imported roads."""

import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from adeye.exchange.commonroad import render_scenario
from adeye.exchange.osi import ground_truth
from adeye.exchange.road_lines import RoadLines, road_lines
from adeye.exchange.view import Account, RunView
from adeye.kernel import strips
from adeye.signals import RoadMap
from adeye.testing.scenes import straight_road
from tests.judge.conftest import HandMade

# A shoulder and a lane; a second lane on the left from 100 m on; beyond a reservation of 2 m, which
# is no strip, a lane of the other way.
SLABS = np.array([[0.0, 0.0, 3.0, 1.0], [100.0, 3.0, 4.0, 2.0], [math.inf, 0.0, 0.0, 0.0]])
STRIPS = np.array(
    [
        [strips.SHOULDER, 0, 20.0, -1, -2.5, 0.0, 0.0, 0.0],
        [strips.DRIVING, strips.OWN, 20.0, 0, 0.0, 0.0, 3.5, 0.0],
        [strips.DRIVING, strips.OPPOSITE, 15.0, -1, 9.0, 0.0, 12.0, 0.0],
        [strips.SHOULDER, 0, 20.0, -1, -2.5, 0.0, 0.0, 0.0],
        [strips.DRIVING, strips.OWN, 20.0, 0, 0.0, 0.0, 3.5, 0.0],
        [strips.DRIVING, strips.OWN, 20.0, 1, 3.5, 0.0, 7.0, 0.0],
        [strips.DRIVING, strips.OPPOSITE, 15.0, -1, 9.0, 0.0, 12.0, 0.0],
    ]
)
OWN, WIDER, BESIDE = (0.0, 3.5), (3.5, 7.0), (9.0, 12.0)


def imported() -> RoadMap:
    return replace(straight_road(lanes=2), slabs=SLABS[np.newaxis], strips=STRIPS[np.newaxis])


def edges(road: RoadLines) -> list[tuple[float, float]]:
    """Return y of the right and the left edge of each lane; the road is straight."""
    lines = [road.boundaries[end].places for lane in road.lanes for end in (lane.right, lane.left)]
    ys = [float(line[0, 1]) for line in lines]
    assert ys == [float(line[-1, 1]) for line in lines]
    return list(zip(ys[::2], ys[1::2], strict=True))


def test_lanes_of_an_imported_road_lie_between_their_own_edges() -> None:
    road = road_lines(imported().ground(0), 10.0, 190.0)
    assert edges(road) == [OWN, BESIDE, OWN, WIDER, BESIDE]
    assert [lane.is_ahead for lane in road.lanes] == [True, False, True, True, False]
    for lane, (start, end) in zip(road.lanes, [(10, 100)] * 2 + [(100, 190)] * 3, strict=True):
        for line in (lane.right, lane.left):
            assert road.boundaries[line].places[[0, -1], 0].tolist() == [start, end]
    # Between lanes of one way one may change; a reservation is no place to.
    markings = {
        (round(line.places[0, 0]), round(line.places[0, 1], 1)): line.marking
        for line in road.boundaries[1:-1]
    }
    assert markings[100, 3.5] == "dashed"
    assert {markings[100, y] for y in (0.0, 7.0, 9.0, 12.0)} == {"solid"}


@pytest.fixture
def view() -> RunView:
    trace = HandMade(rows=11).ego(s=np.linspace(60.0, 140.0, 11)).trace()
    context = replace(trace.layout.context, road=imported())
    return RunView(replace(trace, layout=replace(trace.layout, context=context)))


def test_lanelets_lead_their_way_and_go_on(view: RunView) -> None:
    scenario = ET.fromstring(render_scenario(view, Account("ab" * 32, {})))  # noqa: S314
    lanes = scenario.findall("lanelet")
    ahead = [
        [float(point.findtext("x", "")) for point in lane.findall("leftBound/point")]
        for lane in lanes
    ]
    assert [places[-1] > places[0] for places in ahead] == [True, False, True, True, False]
    follow = {
        lane.get("id"): [item.get("ref") for item in lane.findall("successor")] for lane in lanes
    }
    assert follow == {"1": ["3"], "2": [], "3": [], "4": [], "5": ["2"]}
    before = [[item.get("ref") for item in lane.findall("predecessor")] for lane in lanes]
    assert before == [[], ["5"], ["1"], [], []]
    beside = [[item.get("ref") for item in lane.findall("adjacentLeft")] for lane in lanes]
    assert beside == [[], [], ["4"], [], []]


def test_lanes_of_osi_tell_their_way(view: RunView) -> None:
    truth = next(ground_truth(view))
    found = [lane.classification.centerline_is_driving_direction for lane in truth.lane]
    assert found == [True, False, True, True, False]
    beside = [len(lane.classification.left_adjacent_lane_id) for lane in truth.lane]
    assert beside == [0, 0, 1, 0, 0]
