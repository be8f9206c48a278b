"""What covers the pixels of a frame."""

import math

import numpy as np
import pytest

from adeye.simulate.sensors.imaging import empty_image, wipe
from tests.simulate.sensors.pictures import HEIGHT, camera, focal, picture, pixels, spec
from tests.simulate.sensors.scenes import CAR, TRUCK, scene, scene_context


def test_frame_holds_class_object_and_depth_of_the_nearest_face() -> None:
    context = scene_context([TRUCK], kinds=["truck"])
    frame = picture(context, scene(context, [(40.0, 0.0)]))
    assert set(frame.objects.ravel().tolist()) == {-1, 0}
    assert set(frame.classes[frame.objects == 0].tolist()) == {2}
    np.testing.assert_allclose(frame.depth[frame.objects == 0], 35.0)
    assert np.isinf(frame.depth[frame.objects < 0]).all()
    assert frame.visible.shape == (60, 160)


@pytest.mark.parametrize("distance", [8.0, 15.0, 30.0, 60.0])
def test_size_in_pixels_is_that_of_similar_triangles(distance: float) -> None:
    context = scene_context()
    frame = picture(context, scene(context, [(distance + 0.5 * CAR[0], 0.0)]))
    shown = frame.objects == 0
    scale = focal(spec()) / distance
    rows = np.flatnonzero(shown.any(axis=1))
    assert abs(len(rows) - scale * CAR[2]) <= 1.0
    assert abs(shown.any(axis=0).sum() - scale * CAR[1]) <= 1.0
    # Row 30 begins at the horizon.
    assert abs(rows[-1] + 1 - 30 - scale * HEIGHT) <= 1.0


def test_left_is_left_and_up_is_up() -> None:
    context = scene_context([CAR, TRUCK])
    frame = picture(context, scene(context, [(20.0, 5.0), (30.0, -5.0)]))
    assert np.argwhere(frame.objects == 0)[:, 1].max() < 80
    assert np.argwhere(frame.objects == 1)[:, 1].min() > 80
    assert np.argwhere(frame.objects == 1)[:, 0].min() < np.argwhere(frame.objects == 0)[:, 0].min()


def test_pose_of_ego_and_mount_counts_and_nothing_else() -> None:
    context = scene_context()
    here = picture(context, scene(context, [(30.0, 2.0, 0.3)]), mount={"x": "2 m", "y": "0.5 m"})
    ego = (100.0, -50.0, math.pi / 2.0)
    place = (100.0 - 2.0, -50.0 + 30.0, 0.3 + math.pi / 2.0)
    there = picture(context, scene(context, [place], ego=ego), mount={"x": "2 m", "y": "0.5 m"})
    assert np.array_equal(here.objects, there.objects)
    np.testing.assert_allclose(here.depth, there.depth)


def test_pitch_moves_the_horizon_up_in_the_image() -> None:
    context = scene_context()
    shown = scene(context, [(40.0, 0.0)])
    level = np.argwhere(picture(context, shown).objects == 0)[:, 0]
    nodding = np.argwhere(picture(context, shown, mount={"pitch": "3 deg"}).objects == 0)[:, 0]
    shift = focal(spec()) * math.tan(math.radians(3.0))
    assert abs((level.max() - nodding.max()) - shift) <= 1.0


def test_low_object_behind_the_crest_of_another_shows_what_rises_above_it() -> None:
    # A wall of 1 m, 10 m away, seen from 1.3 m: at 30 m it hides all below 0.4 m.
    context = scene_context([(1.0, 8.0, 1.0), (1.0, 2.0, 1.4), (1.0, 2.0, 0.3)])
    frame = picture(context, scene(context, [(10.5, 0.0), (30.5, 2.0), (30.5, -2.0)]))
    assert pixels(frame, 0) > 0
    rows = np.flatnonzero((frame.objects == 1).any(axis=1))
    assert abs(len(rows) - focal(spec()) * (1.4 - 0.4) / 30.0) <= 1.0
    assert pixels(frame, 2) == 0


def test_object_is_cut_at_the_edge_of_the_image() -> None:
    context = scene_context([(1e-3, 1.8, 1.5)])
    edge = 20.0 * math.tan(math.radians(25.0))
    frame = picture(context, scene(context, [(20.0, edge)]))
    columns = np.flatnonzero((frame.objects == 0).any(axis=0))
    assert columns[0] == 0
    assert abs(len(columns) - focal(spec()) * 0.9 / 20.0) <= 1.0


def test_taking_a_picture_leaves_the_memory_empty() -> None:
    context = scene_context([CAR, TRUCK])
    sensor = camera(context)
    first = sensor.frame(scene(context, [(20.0, 0.0), (30.0, 3.0)]))
    empty = sensor.frame(scene(context, [(-20.0, 0.0), (-30.0, 3.0)]))
    again = sensor.frame(scene(context, [(20.0, 0.0), (30.0, 3.0)]))
    assert not empty.visible.any()
    assert np.array_equal(first.depth, again.depth)


def test_wiping_empties_what_is_in_use() -> None:
    image = empty_image(8, 4, 1)
    image.owner[2, 1:3], image.nearness[2, 1:3], image.span[2] = 0, 0.1, (1, 3)
    wipe(image, 2, 3)
    fresh = empty_image(8, 4, 1)
    for one, other in zip(image, fresh, strict=True):
        assert np.array_equal(one, other)
