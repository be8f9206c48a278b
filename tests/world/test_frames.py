"""Frames: left is positive, out and into are inverse, chains compose."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.simulate.world.frames import FrameTree, Pose, vehicle_frames
from adeye.spec.sensors import Mount


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


def test_a_sensor_with_its_nose_down_looks_at_the_ground_ahead() -> None:
    # 45 degrees down from 1 m above the ground: the axis meets it 1 m ahead.
    tree = vehicle_frames(EGO, {"front": mount(x="2 m", z="1 m", pitch="45 deg")})
    ahead = np.array([np.sqrt(2.0), 0.0, 0.0])
    hit = tree.transform(ahead, source="front", target="ego")
    np.testing.assert_allclose(hit, [3.0, 0.0, 0.0], atol=1e-12)


def test_yaw_comes_before_pitch() -> None:
    # To the left first, then down: the nose points at the ground on the left.
    pose = Pose.of_mount(mount(yaw="90 deg", pitch="30 deg"))
    nose = pose.out(np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(nose, [0.0, np.sqrt(0.75), -0.5], atol=1e-12)
    # The left axis is not touched by the pitch.
    np.testing.assert_allclose(pose.out(np.array([0.0, 1.0, 0.0])), [-1.0, 0.0, 0.0], atol=1e-12)
    up = pose.out(np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(up, [0.0, 0.5, np.sqrt(0.75)], atol=1e-12)


def test_pose_is_the_product_of_two_rotations() -> None:
    yaw, pitch = 0.7, -0.4
    about_z = [[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]]
    about_y = [
        [np.cos(pitch), 0.0, np.sin(pitch)],
        [0.0, 1.0, 0.0],
        [-np.sin(pitch), 0.0, np.cos(pitch)],
    ]
    point = np.array([3.0, -2.0, 1.5])
    by_hand = np.array(about_z) @ np.array(about_y) @ point + np.array([2.0, 0.5, 1.2])
    pose = Pose.of_mount(mount(x="2 m", y="0.5 m", z="1.2 m", yaw="0.7 rad", pitch="-0.4 rad"))
    np.testing.assert_allclose(pose.out(point), by_hand, atol=1e-12)


_COORDINATE = st.floats(-500.0, 500.0)
_ANGLE = st.floats(-np.pi, np.pi)


@given(
    ego=st.tuples(_COORDINATE, _COORDINATE, _ANGLE),
    place=st.tuples(*[st.floats(-5.0, 5.0)] * 3),
    yaw=_ANGLE,
    pitch=st.floats(-1.0, 1.0),
    point=st.tuples(_COORDINATE, _COORDINATE, _COORDINATE),
)
def test_from_the_map_to_a_sensor_and_back_is_the_identity_and_keeps_lengths(
    ego: tuple[float, ...],
    place: tuple[float, ...],
    yaw: float,
    pitch: float,
    point: tuple[float, ...],
) -> None:
    x, y, z = place
    sensor = Mount.model_construct(x=x, y=y, z=z, yaw=yaw, pitch=pitch)
    tree = vehicle_frames(np.array([*ego, 0.0, 0.0, 0.0, 0.0]), {"front": sensor})
    there = tree.transform(np.array(point), source="map", target="ego")
    seen = tree.transform(there, source="ego", target="front")
    np.testing.assert_allclose(tree.transform(seen, source="front", target="map"), point, atol=1e-9)
    assert np.linalg.norm(seen) == pytest.approx(np.linalg.norm(there - place), abs=1e-9)


def test_a_frame_needs_a_parent_and_a_name_of_its_own() -> None:
    tree = FrameTree()
    pose = Pose.of_mount(mount())
    tree.add("ego", pose)
    with pytest.raises(ValueError, match="there already"):
        tree.add("ego", pose)
    with pytest.raises(ValueError, match="none of map, ego"):
        tree.add("camera", pose, "trailer")
