"""What covers the pixels of a frame."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.kernel.detection_range import contrast_threshold
from adeye.signals import OBJECT_CLASSES
from adeye.simulate.sensors import imaging
from adeye.simulate.sensors.sampling import Stream
from adeye.simulate.world.objects import CONTRAST
from adeye.simulate.world.weather import GREY, SUN_ILLUMINANCE, veil
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


def test_size_in_pixels_is_that_of_similar_triangles() -> None:
    context = scene_context()
    for distance in (8.0, 15.0, 30.0, 60.0):
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


# --- Tail of the normal distribution, and crossings against draws of every pixel ------------------


def stream(number: int, owner: int = 7) -> Stream:
    return Stream(np.uint64(3), np.uint64(owner), number)


def test_tail_is_half_of_the_complementary_error_function() -> None:
    for x in (0.0, 0.1, 0.5, 1.0, 2.0, 2.999, 3.0, 3.001, 4.0, 5.0, 6.0, 8.0):
        assert imaging.upper_tail(x) == pytest.approx(
            0.5 * math.erfc(x / math.sqrt(2.0)), rel=1e-11
        )


def test_miss_is_what_the_tail_leaves_and_no_noise_never_crosses() -> None:
    for ratio in (0.5, 2.0, 4.0, 4.5, 6.0):
        expected = math.log1p(-imaging.upper_tail(ratio))
        assert imaging.log_of_miss(ratio, 1.0) == pytest.approx(expected, rel=1e-10)
        assert expected < 0.0
    for level, noise in ((0.05, 0.0), (0.05, 0.05 / imaging.GREATEST), (math.inf, 1.0)):
        assert imaging.log_of_miss(level, noise) == 0.0


def test_skips_are_as_long_as_if_every_pixel_were_drawn() -> None:
    missing = imaging.log_of_miss(1.5, 1.0)
    crossing = imaging.upper_tail(1.5)
    skips = np.array([imaging.skip(missing, stream(0), index) for index in range(20_000)])
    mean = (1.0 - crossing) / crossing
    assert skips.mean() == pytest.approx(mean, rel=0.03)
    assert (skips == 0).mean() == pytest.approx(crossing, rel=0.06)
    assert skips.std() == pytest.approx(math.sqrt(1.0 - crossing) / crossing, rel=0.05)


def test_noise_of_pixels_is_standard_normal_and_independent_of_its_neighbour() -> None:
    noise = np.array([imaging.noise_of(pixel, stream(4)) for pixel in range(20_000)])
    assert abs(noise.mean()) < 0.03
    assert noise.std() == pytest.approx(1.0, abs=0.02)
    assert abs(np.corrcoef(noise[::2], noise[1::2])[0, 1]) < 0.03
    assert np.abs(noise).max() < imaging.GREATEST
    assert len(set(noise.tolist())) == len(noise)


def test_noise_depends_on_the_sample_and_the_sensor() -> None:
    assert imaging.noise_of(5, stream(1)) != imaging.noise_of(5, stream(2))
    assert imaging.noise_of(5, stream(1)) != imaging.noise_of(5, stream(1, 8))


# --- Contrast, light and glare: laws, limits and the figures that they are set by -----------------

LIGHT = st.floats(1e-3, 1e5)
DISTANCE = st.floats(0.1, 500.0)


def test_every_class_has_a_contrast() -> None:
    assert set(CONTRAST) == set(OBJECT_CLASSES)
    assert all(0.0 < contrast <= 1.0 for contrast in CONTRAST.values())


@given(LIGHT, LIGHT)
def test_threshold_falls_as_light_rises_and_without_light_there_is_none(
    one: float, other: float
) -> None:
    low, high = sorted((one, other))
    assert contrast_threshold(0.05, -low) == contrast_threshold(0.05, math.nan) == math.inf
    assert contrast_threshold(0.05, low) >= contrast_threshold(0.05, high) > 0.05


def test_headlamps_light_with_the_square_of_the_distance_and_nothing_behind() -> None:
    assert imaging.beam(20_000.0, 1.0, 50.0) == pytest.approx(8.0)
    assert imaging.beam(20_000.0, 1.0, 100.0) == pytest.approx(2.0)
    # Half as much at nineteen degrees.
    half = imaging.beam(20_000.0, math.cos(math.radians(19.3)), 10.0)
    assert half == pytest.approx(0.5 * imaging.beam(20_000.0, 1.0, 10.0), rel=0.01)
    assert imaging.beam(20_000.0, 0.0, 10.0) == imaging.beam(20_000.0, -1.0, 10.0) == 0.0


def test_veil_falls_with_the_square_of_the_angle_down_to_one_degree() -> None:
    greatest = 10.0 * SUN_ILLUMINANCE
    for degrees in (1.0, 2.0, 5.0, 20.0, 60.0, 120.0):
        found = veil(SUN_ILLUMINANCE, math.cos(math.radians(degrees)))
        assert found == pytest.approx(greatest / degrees**2), degrees
    for cosine in (1.0, math.cos(1e-3)):
        assert veil(SUN_ILLUMINANCE, cosine) == pytest.approx(greatest)
    assert veil(0.0, 1.0) == 0.0


@given(DISTANCE, DISTANCE, st.floats(0.0, 0.1))
def test_contrast_falls_with_distance(one: float, other: float, extinction: float) -> None:
    near, far = sorted((one, other))
    args = (extinction, 100.0, 10.0)
    assert imaging.shown_contrast(0.5, near, *args) >= imaging.shown_contrast(0.5, far, *args)
    # Two percent are left at the visibility.
    assert imaging.shown_contrast(1.0, far, 3.912 / far, 1e4, 0.0) == pytest.approx(0.02, rel=1e-3)


@given(LIGHT, LIGHT, st.floats(1e-3, 1e5))
def test_light_on_the_object_helps_against_glare(one: float, other: float, glare: float) -> None:
    dim, bright = sorted((one, other))
    weak, strong = (
        imaging.shown_contrast(0.5, 10.0, 0.01, light, glare) for light in (dim, bright)
    )
    assert weak <= strong <= imaging.shown_contrast(0.5, 10.0, 0.01, bright, 0.0)


def test_lamps_of_a_car_make_it_as_bright_as_58_lux_would_and_who_walks_has_none() -> None:
    shine = imaging.SHINE[OBJECT_CLASSES.index("car")]
    assert shine == pytest.approx(58.2, abs=0.1)
    assert GREY * shine / math.pi == pytest.approx(10.0 / (1.8 * 1.5))
    dark = {kind for kind, shine in zip(OBJECT_CLASSES, imaging.SHINE, strict=True) if shine == 0.0}
    assert dark == {"pedestrian", "parked_truck", "parked_car", "barrier", "building"}
