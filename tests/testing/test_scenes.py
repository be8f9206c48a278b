"""Scenes for the tests of plug-ins: contexts, estimates and measurements."""

import numpy as np
import pytest

from adeye.signals import PLACE_LANE, PLACE_OFFSET
from adeye.testing.scenes import (
    channel_context,
    ego_estimate,
    object_measurement,
    passenger_car,
    pose_measurement,
    straight_road,
)

EGO = np.array([[10.0, 5.25, 0.0, 20.0, 0.0, 0.0, 0.0]])


def test_context_has_one_record_a_run() -> None:
    context = channel_context("p", links=("front",), sensors={"front": "radar"}, runs=3, every=2)
    assert (context.runs, context.parameters, context.period) == (3, ["p"] * 3, 0.1)
    assert context.desired_speed.shape == (3,)
    assert passenger_car().width < passenger_car().length


@pytest.mark.parametrize(
    ("y", "lane", "offset"), [(5.25, 1, 0.0), (6.0, 1, 0.75), (-1.0, -1, -2.75)]
)
def test_estimate_knows_the_lane(y: float, lane: int, offset: float) -> None:
    ego = EGO.copy()
    ego[0, 1] = y
    place = ego_estimate(straight_road(), ego)[0, 7:]
    assert place[PLACE_LANE] == lane
    assert place[PLACE_OFFSET] == pytest.approx(offset)


def test_objects_are_seen_nearest_first_with_their_range_rate() -> None:
    objects = np.array([[[90.0, 5.25, 0, 10, 0], [40.0, 5.25, 0, 25, 0], [999.0, 0, 0, 0, 0]]])
    seen = object_measurement(EGO, objects, 0.5, sight=100.0)
    assert seen.mask[0].tolist() == [True, True, False]
    assert seen.source[0].tolist() == [1, 0, -1]
    assert seen.detections[0, :2, 0].tolist() == [30.0, 80.0]
    assert seen.detections[0, :2, 2].tolist() == [5.0, -10.0]
    assert seen.estimate is None


def test_pose_has_an_estimate_and_no_detections() -> None:
    seen = pose_measurement(straight_road(), EGO, 0.5)
    assert seen.estimate is not None
    assert seen.mask.shape == (1, 0)
