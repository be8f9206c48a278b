"""A run as others see it: frames, samples, and which side is left."""

import numpy as np
import pytest

from adeye.exchange.road_lines import BOUNDARY_STEP
from adeye.exchange.view import RunView, quaternion
from tests.exchange.handed import in_left_hand_traffic
from tests.judge.conftest import HandMade


def test_record_of_left_hand_traffic_is_turned_back() -> None:
    made = HandMade().ego(d=5.25, heading=0.1, steering_angle=0.02).set("detected", 1)
    made.set("detections", np.array([30.0, 4.0])).set("tracks", 1.0)
    trace = made.trace()
    right, left = RunView(trace), RunView(in_left_hand_traffic(trace))
    assert left.ego[3].tolist() == (right.ego[3] * [1, -1, -1, 1, 1, -1, -1]).tolist()
    assert left.objects[3, 0].tolist() == (right.objects[3, 0] * [1, -1, -1, 1, 1]).tolist()
    assert left.tracks[0, 0, 0].tolist() == [1.0, -1.0, 1.0, -1.0, 1.0, 1.0]
    (sample, *_), (turned, *_) = (list(view.samples(0)) for view in (right, left))
    assert turned[3].tolist() == [[30.0, -4.0]] != sample[3].tolist()
    # What was not turned is what was recorded, and nobody has changed it.
    assert trace["ego"][0, 3, 1] == 5.25
    for before, after in zip(right.road.boundaries, left.road.boundaries, strict=True):
        np.testing.assert_array_equal(after.places, before.places * [1.0, -1.0])


def test_lanes_lie_between_their_lines_on_either_side() -> None:
    trace = HandMade().trace()
    for view, side in ((RunView(trace), 1.0), (RunView(in_left_hand_traffic(trace)), -1.0)):
        road = view.road
        assert len(road.lanes) == 3
        for number, lane in enumerate(road.lanes):
            right, left = (road.boundaries[line].places for line in (lane.right, lane.left))
            # Seen along the road, left is where y is greater.
            assert (left[:, 1] - right[:, 1]).tolist() == pytest.approx([3.5] * len(left))
            middle = side * (3.5 * number + 1.75)
            assert (0.5 * (left + right))[:, 1].tolist() == pytest.approx([middle] * len(left))
        assert road.shoulder is not None
        assert road.shoulder.places[:, 1].tolist() == pytest.approx([-2.0 * side] * 2)


def test_bend_is_drawn_in_short_pieces() -> None:
    trace = HandMade().trace()
    trace.layout.context.road.segments[:, 0, 4] = 1.0 / 500.0
    places = RunView(trace).road.boundaries[0].places
    pieces = np.hypot(*np.diff(places, axis=0).T)
    assert pieces.max() <= BOUNDARY_STEP
    # The points lie on the circle of the right edge.
    np.testing.assert_allclose(np.hypot(places[:, 0], places[:, 1] - 500.0), 500.0)


def test_samples_are_told_once_and_only_while_the_sensor_delivers() -> None:
    made = HandMade(rows=7, step=0.1, tail_rows=1, objects=("lead", "other"))
    made.set("sensor_stamp", np.array([-1.0, 0.0, 0.0, 0.2, 0.9, 0.2, 0.0]), at=0)
    made.set("sensor_alive", 0, rows=5, at=0).set("detected", 1)
    made.set("detections", np.array([30.0, 4.0])).set("detections", np.nan, rows=3, at=0)
    found = [
        (row, taken, has.tolist()) for row, taken, _, _, has in RunView(made.trace()).samples(0)
    ]
    # A clock that goes wrong tells of a time to come: it is cut to now, as the recorder does.
    assert found == [(1, 0, [True, True]), (3, 2, [False, False]), (4, 4, [True, True])]


def test_run_that_was_not_drawn_has_samples_without_detections() -> None:
    made = HandMade()
    made.columns["detections"] = np.zeros((1, made.rows, 2, 0, 2))
    assert {len(item[4]) for item in RunView(made.set("detected", 1).trace()).samples(0)} == {0}


def test_turns_follow_one_another() -> None:
    x, y, z, w = quaternion(0.7, 0.2)
    # First with the nose down about y, then to the left about z: where the nose points.
    nose = (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w))
    wanted = (np.cos(0.7) * np.cos(0.2), np.sin(0.7) * np.cos(0.2), -np.sin(0.2))
    assert nose == pytest.approx(wanted)
