"""Frames: left is positive, out and into are inverse, chains compose."""

import numpy as np
import pytest

from adeye.spec.sensors import Mount
from adeye.world.frames import FrameTree, Pose, vehicle_frames


def mount(**pose: str) -> Mount:
    return Mount.model_validate(pose)


EGO = np.array([100.0, 5.0, np.pi / 2, 20.0, 0.0, 0.0, 0.0])


def test_left_of_an_ego_that_heads_along_x_is_positive_y_in_the_map() -> None:
    ego = np.array([10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    left = vehicle_frames(ego, {}).transform(np.array([0.0, 2.0, 0.0]), source="ego", target="map")
    assert left.tolist() == [10.0, 2.0, 0.0]


def test_left_of_an_ego_that_heads_along_y_is_negative_x_in_the_map() -> None:
    left = vehicle_frames(EGO, {}).transform(np.array([0.0, 2.0, 0.0]), source="ego", target="map")
    np.testing.assert_allclose(left, [98.0, 5.0, 0.0], atol=1e-12)


def test_a_sensor_that_looks_left_sees_ahead_of_it_what_is_left_of_the_ego() -> None:
    tree = vehicle_frames(EGO, {"side": mount(x="1 m", y="0.5 m", z="0.8 m", yaw="90 deg")})
    seen = tree.transform(np.array([1.0, 7.5, 0.8]), source="ego", target="side")
    np.testing.assert_allclose(seen, [7.0, 0.0, 0.0], atol=1e-12)


def test_the_way_from_sensor_to_map_and_back_is_the_identity() -> None:
    tree = vehicle_frames(EGO, {"front": mount(x="2 m", y="-0.3 m", z="0.5 m", yaw="-0.4 rad")})
    points = np.array([[3.0, -2.0, 1.0], [0.0, 0.0, 0.0], [-50.0, 80.0, 2.0]])
    there = tree.transform(points, source="front", target="map")
    back = tree.transform(there, source="map", target="front")
    np.testing.assert_allclose(back, points, atol=1e-11)


def test_a_frame_seen_from_itself_changes_no_more_than_rounding() -> None:
    tree = vehicle_frames(EGO, {"front": mount(x="2 m")})
    point = np.array([3.0, -2.0, 1.0])
    same = tree.transform(point, source="front", target="front")
    np.testing.assert_allclose(same, point, atol=1e-12)


def test_poses_of_a_batch_move_the_points_of_each_run() -> None:
    ego = np.stack([EGO, EGO + np.array([50.0, 0, 0, 0, 0, 0, 0])])
    ahead = Pose.of_ego(ego).out(np.array([10.0, 0.0, 0.0]))
    np.testing.assert_allclose(ahead, [[100.0, 15.0, 0.0], [150.0, 15.0, 0.0]], atol=1e-12)


def test_headings_add_up_along_the_chain() -> None:
    tree = vehicle_frames(EGO, {"side": mount(yaw="0.25 rad")})
    angle = tree.heading(np.float64(0.1) * np.ones(1), source="side", target="map")
    assert angle[0] == pytest.approx(np.pi / 2 + 0.35)
    assert tree.heading(angle, source="map", target="side")[0] == pytest.approx(0.1)


def test_a_frame_needs_a_parent_and_a_name_of_its_own() -> None:
    tree = FrameTree()
    pose = Pose.of_mount(mount())
    tree.add("ego", pose)
    with pytest.raises(ValueError, match="there already"):
        tree.add("ego", pose)
    with pytest.raises(ValueError, match="none of map, ego"):
        tree.add("camera", pose, "trailer")
