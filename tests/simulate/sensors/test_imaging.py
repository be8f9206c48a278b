"""What covers the pixels of a frame, and which of them show it."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.kernel.detection_range import contrast_threshold
from adeye.kernel.raster import GHOST, NOTHING
from adeye.signals import OBJECT_CLASSES, Scene
from adeye.simulate.sensors import imaging
from adeye.simulate.sensors.camera import PhysicalCameraSensor
from adeye.simulate.sensors.imaging import contrast_at, judge_box, judge_part
from adeye.simulate.sensors.sampling import Stream
from adeye.simulate.world.objects import CONTRAST
from adeye.simulate.world.weather import GREY, SUN_ILLUMINANCE, veil
from tests.simulate.sensors.pictures import (
    CONDITIONS,
    PERSON,
    camera,
    condition,
    picture,
    pixels,
)
from tests.simulate.sensors.scenes import CAR, TRUCK, scene, scene_context


def test_frame_holds_class_object_and_depth_of_the_nearest_face() -> None:
    context = scene_context([TRUCK], kinds=["truck"])
    frame = picture(context, scene(context, [(40.0, 0.0)]))
    assert set(frame.objects.ravel().tolist()) == {-1, 0}
    assert set(frame.classes[frame.objects == 0].tolist()) == {2}
    np.testing.assert_allclose(frame.depth[frame.objects == 0], 35.0)
    assert np.isinf(frame.depth[frame.objects < 0]).all()
    assert frame.visible.shape == (60, 160)


def test_pose_of_ego_and_mount_counts_and_nothing_else() -> None:
    context = scene_context()
    here = picture(context, scene(context, [(30.0, 2.0, 0.3)]), mount={"x": "2 m", "y": "0.5 m"})
    ego = (100.0, -50.0, math.pi / 2.0)
    place = (100.0 - 2.0, -50.0 + 30.0, 0.3 + math.pi / 2.0)
    there = picture(context, scene(context, [place], ego=ego), mount={"x": "2 m", "y": "0.5 m"})
    assert np.array_equal(here.objects, there.objects)
    np.testing.assert_allclose(here.depth, there.depth)


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
def test_threshold_falls_as_light_rises_and_darkness_has_none(one: float, other: float) -> None:
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


# --- Which pixels show what covers them: air, light, glare, lens, dirt and noise ------------------

PLACES = [(18.0, 1.0, 0.2), (35.0, -4.0, 0.0), (60.0, 3.0, 1.0), (25.0, 6.0, 0.0)]
SIZES = [CAR, TRUCK, TRUCK, PERSON]
KINDS = ["car", "truck", "bus", "pedestrian"]


def shown(weather: dict[str, Any], **changes: Any) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Which pixels of a scene with four objects show them."""
    context = scene_context(SIZES, kinds=KINDS, **weather)
    return picture(context, scene(context, PLACES), **changes).visible


def first_hidden(weather: dict[str, Any], **changes: Any) -> float:
    """Distance from which on no pixel of a pedestrian straight ahead shows it [m]."""
    context = scene_context([PERSON], kinds=["pedestrian"], **weather)
    sensor = camera(context, columns=1024, rows=128, **changes)
    low, high = 1.0, 400.0
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        frame = sensor.frame(scene(context, [(middle + 0.25, 0.0)]))
        low, high = (middle, high) if pixels(frame) else (low, middle)
    return low


def test_clear_day_shows_every_pixel() -> None:
    context = scene_context(SIZES, kinds=KINDS)
    frame = picture(context, scene(context, PLACES))
    assert np.array_equal(frame.visible, frame.objects >= 0)
    assert {0, 1, 2, 3} <= set(frame.objects.ravel().tolist())


def test_pedestrian_at_night_is_seen_as_far_as_lamps_give_five_lux() -> None:
    night = {"illuminance": 0.1}
    reach = pytest.approx(math.sqrt(20_000.0 / 4.9), rel=0.01)
    assert first_hidden(night) == reach
    assert first_hidden(night, headlamps=80_000.0) == pytest.approx(127.8, rel=0.01)
    for light, lamps, distance, is_seen in ((0.1, 0.0, 3.0, False), (10.0, 20_000.0, 100.0, True)):
        # No headlamps; street lights where headlamps do not reach.
        context = scene_context([PERSON], kinds=["pedestrian"], illuminance=light)
        frame = picture(context, scene(context, [(distance, 0.0)]), headlamps=lamps)
        assert frame.visible.any() == is_seen


@pytest.mark.slow
def test_headlamps_light_what_is_ahead_of_the_ego_not_of_the_camera() -> None:
    context = scene_context([CAR], kinds=["parked_car"], illuminance=0.1)
    behind = picture(context, scene(context, [(-20.0, 0.0)]), mount={"yaw": "180 deg"})
    assert not behind.visible.any()
    assert (behind.objects == 0).any()


def test_low_sun_hides_what_stands_before_it() -> None:
    context = scene_context([CAR, CAR], sun_elevation=math.radians(2.5))
    frame = picture(context, scene(context, [(60.0, 0.0), (60.0, 22.0)]))
    assert (frame.objects == 0).any()
    assert pixels(frame, 0) == 0
    assert pixels(frame, 1) > 0


def test_sun_on_the_horizon_hides_what_stands_beside_it() -> None:
    for elevation, is_hidden in ((0.0, True), (-1e-9, False)):
        context = scene_context(sun_elevation=elevation)
        frame = picture(context, scene(context, [(60.0, 1.8)]))
        assert (pixels(frame) == 0) == is_hidden


def test_sun_below_the_horizon_or_behind_does_nothing() -> None:
    clear = shown({})
    assert np.array_equal(shown({"sun_elevation": -0.01}), clear)
    assert np.array_equal(shown({"sun_elevation": 0.05, "sun_azimuth": math.pi}), clear)


def test_truck_before_the_sun_shades_the_lens() -> None:
    context = scene_context([CAR, TRUCK], sun_elevation=math.radians(4.0))
    # Seven degrees beside the sun, and beside the truck as well; behind a dirty lens.
    glaring = picture(context, scene(context, [(40.0, 6.0), (20.0, -30.0)]), transmission=0.15)
    shaded = picture(context, scene(context, [(40.0, 6.0), (20.0, 0.0)]), transmission=0.15)
    assert pixels(glaring, 0) == 0
    assert pixels(shaded, 0) > 0


def test_dead_patch_loses_its_pixels_and_no_others() -> None:
    expected = shown({})
    assert expected[25:34, 70:82].any()
    expected[25:34, 70:82] = False
    assert np.array_equal(shown({}, patches={"dead": DEAD}), expected)
    # Beyond the image it is cut.
    far = {"column": 150, "row": 0, "columns": 500, "rows": 500}
    expected = shown({})
    expected[:, 150:] = False
    assert np.array_equal(shown({}, patches={"far": far}), expected)


DEAD = {"column": 70, "row": 25, "columns": 12, "rows": 9}
WHOLE_IMAGE = {"columns": 160, "rows": 60}


def test_patch_over_the_whole_image_is_the_lens() -> None:
    weather = {"fog_visibility": 120.0}
    dirty = shown(weather, patches={"dirt": {**WHOLE_IMAGE, "transmission": 0.3}})
    assert np.array_equal(dirty, shown(weather, transmission=0.3))
    assert not np.array_equal(dirty, shown(weather))


def test_where_patches_overlap_the_worst_counts() -> None:
    dirt = {**WHOLE_IMAGE, "transmission": 0.9}
    one = shown({}, patches={"a": dirt, "b": DEAD})
    assert np.array_equal(one, shown({}, patches={"a": DEAD, "b": dirt}))
    assert np.array_equal(one, shown({}, patches={"dead": DEAD}))


SHARE = st.floats(0.0, 1.0)


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(CONDITIONS), SHARE, SHARE, st.floats(0.02, 0.3))
def test_worse_conditions_show_no_more(
    name: str, one: float, other: float, elevation: float
) -> None:
    worse, better = sorted((one, other))
    base = {"fog_visibility": 150.0, "sun_elevation": elevation, "illuminance": 2e4}
    seen = []
    for share in (worse, better):
        lens = {"transmission": condition(name, share)} if name == "transmission" else {}
        weather = base if lens else base | {name: condition(name, share)}
        seen.append(shown(weather, **lens))
    assert not (seen[0] & ~seen[1]).any()


@settings(max_examples=30, deadline=None)
@given(st.floats(0.01, 1.2), st.floats(0.01, 1.2))
def test_sun_further_from_line_of_sight_hides_no_further_pixel(one: float, other: float) -> None:
    # The object is to the right, the sun moves away from it to the left.
    near, far = sorted((one, other))
    context = [scene_context([CAR], sun_elevation=0.02, sun_azimuth=turn) for turn in (near, far)]
    frames = [picture(item, scene(item, [(40.0, -2.0)])) for item in context]
    assert pixels(frames[0]) <= pixels(frames[1])


# --- noise ----------------------------------------------------------------------------------------


def empty_scene() -> tuple[Any, Scene]:
    context = scene_context([CAR])
    return context, scene(context, [(-30.0, 0.0)])


def test_noise_far_below_the_threshold_changes_no_bit() -> None:
    assert np.array_equal(shown({}, noise=0.005), shown({}))


def test_noise_alone_shows_as_many_ghost_pixels_as_cross_the_threshold() -> None:
    context, nothing = empty_scene()
    sensor = camera(context, noise=0.025)
    count = 0
    for _ in range(50):
        count += int(sensor.frame(nothing).visible.sum())
        sensor.sense(nothing)
    threshold = 0.05 * math.sqrt(1.0 + 120.0 / 2e4)
    expected = 50 * 160 * 60 * imaging.upper_tail(threshold / 0.025)
    assert count == pytest.approx(expected, abs=5.0 * math.sqrt(expected))


def test_noise_of_a_patch_stays_in_the_patch() -> None:
    context, nothing = empty_scene()
    patch = {"column": 20, "row": 10, "columns": 30, "rows": 20, "noise": 0.1}
    visible = picture(context, nothing, patches={"broken": patch}).visible
    share = visible[10:30, 20:50].mean()
    assert share == pytest.approx(imaging.upper_tail(0.5), abs=0.08)
    visible[10:30, 20:50] = False
    assert not visible.any()


def test_noise_of_the_image_and_of_a_patch_add_by_their_squares() -> None:
    context, nothing = empty_scene()
    patch = {**WHOLE_IMAGE, "noise": 0.04}
    both = picture(context, nothing, noise=0.03, patches={"broken": patch}).visible
    one = picture(context, nothing, noise=0.05).visible
    assert both.mean() == pytest.approx(one.mean(), rel=0.1)
    assert both.mean() == pytest.approx(imaging.upper_tail(1.003), rel=0.1)


def test_pixel_that_is_mostly_noise_does_not_tell_its_class() -> None:
    context = scene_context([CAR])
    near = scene(context, [(8.0, 0.0)])
    patch = {"columns": 160, "rows": 60, "transmission": 0.0, "noise": 0.1}
    found = camera(context, patches={"dead": patch}).sense(near)
    classes = found.detections[0, found.mask[0], 6]
    assert len(classes) > 0
    assert (classes == -1.0).all()
    assert (found.source[0] == -1).all()
    assert GHOST < -1


def test_noise_is_new_in_each_sample_and_the_same_in_each_run_of_it() -> None:
    context, nothing = empty_scene()
    one, other = camera(context, noise=0.03), camera(context, noise=0.03)
    first = one.frame(nothing).visible
    assert np.array_equal(first, other.frame(nothing).visible)
    one.sense(nothing)
    assert not np.array_equal(first, one.frame(nothing).visible)


# --- What is judged at once is what every pixel on its own would show -----------------------------

KIND = OBJECT_CLASSES.index("car")
SUN = {"sun_elevation": 0.15, "sun_azimuth": 0.1}


def drawn(
    place: tuple[float, ...], weather: dict[str, Any], size: Any = CAR, **changes: Any
) -> Any:
    """Draw one object; return its camera, how it is judged as a whole, and its columns."""
    context = scene_context([size], **weather)
    shown = scene(context, [place])
    sensor = camera(context, **changes)
    parameters, image = sensor._parameters[0], sensor._image
    ends = imaging.draw(parameters, shown.ego[0], shown.objects[0], context.object_sizes[0], image)
    whole = judge_box(parameters, KIND, shown.objects[0, 0], context.object_sizes[0, 0], image)
    return sensor, whole, ends


def part_of(sensor: PhysicalCameraSensor, columns: range, dimmest: float, clearest: float) -> Any:
    """Describe the pixels of some columns; return the part and which pixels it has."""
    image = sensor._image
    covered = [
        (column, row)
        for column in columns
        for row in range(*image.span[column])
        if image.owner[column, row] != NOTHING
    ]
    across, down = np.array(covered).T
    near = [image.nearness[place] for place in covered]
    ends = [across.min(), across.max(), down.min(), down.max()]
    return np.array([*ends, max(near), min(near), dimmest, clearest, 0.0]), covered


def pixels_shown(sensor: PhysicalCameraSensor, covered: Any, transmission: float) -> list[bool]:
    """Ask each pixel on its own."""
    parameters, image = sensor._parameters[0], sensor._image
    found = []
    for column, row in covered:
        contrast, light = contrast_at(parameters, KIND, imaging.CONTRASTS[KIND], column, row, image)
        found.append(transmission * contrast >= contrast_threshold(parameters["threshold"], light))
    return found


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    place=st.tuples(st.floats(5.0, 80.0), st.floats(-12.0, 12.0), st.floats(-3.0, 3.0)),
    fog=st.floats(20.0, 2000.0),
    light=st.sampled_from([0.1, 10.0, 2e4]),
    sun=st.sampled_from([{}, SUN]),
    transmission=st.floats(0.05, 1.0),
)
def test_what_is_sure_of_a_part_holds_for_each_of_its_pixels(
    place: tuple[float, float, float],
    fog: float,
    light: float,
    sun: dict[str, float],
    transmission: float,
) -> None:
    weather = {"fog_visibility": fog, "illuminance": light, **sun}
    sensor, whole, (first, stop) = drawn(place, weather)
    parameters, image = sensor._parameters[0], sensor._image
    for left in range(first, stop, 8):
        columns = range(left, min(left + 8, stop))
        if not (image.owner[columns.start : columns.stop] != NOTHING).any():
            continue
        part, covered = part_of(sensor, columns, transmission, transmission)
        state = judge_part(parameters, KIND, part, image)
        seen = pixels_shown(sensor, covered, transmission)
        assert state != imaging.WHOLE or all(seen)
        assert state != imaging.HIDDEN or not any(seen)
        alone = pixels_shown(sensor, covered, 1.0)
        assert whole != imaging.WHOLE or all(alone)
        assert whole != imaging.HIDDEN or not any(alone)


def test_surface_has_less_contrast_the_nearer_to_the_sun_it_is_looked_at() -> None:
    sensor, _, (first, stop) = drawn((18.0, 0.0, 0.0), {"sun_elevation": 0.3}, TRUCK)
    parameters, image = sensor._parameters[0], sensor._image
    assert image.sun[0] > 0.0
    column = (first + stop) // 2
    rows = [row for row in range(*image.span[column]) if image.owner[column, row] != NOTHING]
    seen = [contrast_at(parameters, KIND, 1.0, column, row, image)[0] for row in rows]
    # Below the sun, from the top of the truck to its wheels: above and below the camera.
    assert len(seen) > 10
    assert all(0.0 < upper < lower for upper, lower in itertools.pairwise(seen))


def test_clear_day_is_sure_at_once_and_blackout_too_but_not_what_is_very_near() -> None:
    assert drawn((30.0, 0.0, 0.0), {})[1] == imaging.WHOLE
    assert drawn((30.0, 0.0, 0.0), {}, transmission=0.0)[1] == imaging.HIDDEN
    # Inside of the ball around a box each pixel is looked at.
    assert drawn((5.0, 0.0, 0.0), {}, TRUCK)[1] == imaging.EACH


def test_noise_and_patches_make_a_part_unsure() -> None:
    sensor, _, (first, stop) = drawn((30.0, 0.0, 0.0), {})
    parameters, image = sensor._parameters[0], sensor._image
    whole, _ = part_of(sensor, range(first, stop), 1.0, 1.0)
    for dimmest, clearest, noise, judged in (
        (1.0, 1.0, 0.0, imaging.WHOLE),
        (1.0, 1.0, 0.1**2, imaging.EACH),
        (0.0, 1.0, 0.0, imaging.EACH),
        (0.0, 0.0, 0.0, imaging.HIDDEN),
    ):
        whole[-3:] = dimmest, clearest, noise
        assert judge_part(parameters, KIND, whole, image) == judged


@pytest.mark.slow
def test_one_part_of_a_car_before_the_sun_is_judged_unlike_another() -> None:
    sensor, _, (first, stop) = drawn((18.0, 1.0, 0.0), {"sun_elevation": 0.12})
    parameters, image = sensor._parameters[0], sensor._image
    found = set()
    for left in range(first, stop, 4):
        part, _ = part_of(sensor, range(left, min(left + 4, stop)), 0.4, 0.4)
        found.add(judge_part(parameters, KIND, part, image))
    assert len(found) > 1
