"""What is judged at once is what every pixel on its own would show."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.kernel.detection_range import contrast_threshold
from adeye.kernel.raster import NOTHING
from adeye.signals import OBJECT_CLASSES
from adeye.simulate.sensors.camera import PhysicalCameraSensor
from adeye.simulate.sensors.exposure import contrast_at, judge_box, judge_part
from adeye.simulate.sensors.imaging import CONTRASTS, EACH, HIDDEN, PART_WIDTH, WHOLE, draw
from tests.simulate.sensors.pictures import camera
from tests.simulate.sensors.scenes import CAR, TRUCK, scene, scene_context

KIND = OBJECT_CLASSES.index("car")
SUN = {"sun_elevation": 0.15, "sun_azimuth": 0.1}


def drawn(place: tuple[float, ...], weather: dict[str, Any], **changes: Any) -> Any:
    """Draw one car; return camera, its scene, and first and last column in use."""
    context = scene_context([CAR], kinds=["car"], **weather)
    shown = scene(context, [place])
    sensor = camera(context, **changes)
    ends = draw(
        sensor._parameters[0],
        shown.ego[0],
        shown.objects[0],
        context.object_sizes[0],
        sensor._image,
    )
    return sensor, shown, context, ends


def part_of(sensor: PhysicalCameraSensor, columns: range, dimmest: float, clearest: float) -> Any:
    """Describe the pixels of some columns; return the part and which pixels it has."""
    covered = [
        (column, row)
        for column in columns
        for row in range(*sensor._image.span[column])
        if sensor._image.owner[column, row] != NOTHING
    ]
    pixels = np.array(covered)
    near = [sensor._image.nearness[column, row] for column, row in covered]
    part = np.zeros(PART_WIDTH)
    ends = [pixels[:, 0].min(), pixels[:, 0].max(), pixels[:, 1].min(), pixels[:, 1].max()]
    part[:] = [*ends, max(near), min(near), dimmest, clearest, 0.0]
    return part, covered


def pixels_shown(sensor: PhysicalCameraSensor, covered: Any, transmission: float) -> list[bool]:
    """Ask each pixel on its own."""
    parameters, image = sensor._parameters[0], sensor._image
    found = []
    for column, row in covered:
        contrast, light = contrast_at(parameters, KIND, CONTRASTS[KIND], column, row, image)
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
    sensor, shown, context, (first, stop) = drawn(place, weather)
    parameters, image = sensor._parameters[0], sensor._image
    whole = judge_box(parameters, KIND, shown.objects[0, 0], context.object_sizes[0, 0], image)
    for left in range(first, stop, 8):
        columns = range(left, min(left + 8, stop))
        if not (image.owner[columns.start : columns.stop] != NOTHING).any():
            continue
        part, covered = part_of(sensor, columns, transmission, transmission)
        state = judge_part(parameters, KIND, part, image)
        seen = pixels_shown(sensor, covered, transmission)
        assert state != WHOLE or all(seen)
        assert state != HIDDEN or not any(seen)
        alone = pixels_shown(sensor, covered, 1.0)
        assert whole != WHOLE or all(alone)
        assert whole != HIDDEN or not any(alone)


def test_clear_day_is_sure_at_once_and_blackout_too() -> None:
    for changes, expected in (({}, WHOLE), ({"transmission": 0.0}, HIDDEN)):
        sensor, shown, context, _ = drawn((30.0, 0.0, 0.0), {}, **changes)
        size = context.object_sizes[0, 0]
        found = judge_box(sensor._parameters[0], KIND, shown.objects[0, 0], size, sensor._image)
        assert found == expected


def test_noise_and_patches_make_a_part_unsure() -> None:
    sensor, _, _, (first, stop) = drawn((30.0, 0.0, 0.0), {})
    parameters, image = sensor._parameters[0], sensor._image
    part, _ = part_of(sensor, range(first, stop), 1.0, 1.0)
    assert judge_part(parameters, KIND, part, image) == WHOLE
    part[-1] = 0.1**2
    assert judge_part(parameters, KIND, part, image) == EACH
    part[-1] = 0.0
    part[-3] = 0.0
    assert judge_part(parameters, KIND, part, image) == EACH
    part[-2] = 0.0
    assert judge_part(parameters, KIND, part, image) == HIDDEN


@pytest.mark.slow
def test_a_camera_inside_of_the_ball_around_a_box_looks_at_each_pixel() -> None:
    context = scene_context([TRUCK], kinds=["truck"])
    shown = scene(context, [(5.0, 0.0, 0.0)])
    sensor = camera(context)
    sizes = context.object_sizes[0]
    draw(sensor._parameters[0], shown.ego[0], shown.objects[0], sizes, sensor._image)
    found = judge_box(sensor._parameters[0], KIND, shown.objects[0, 0], sizes[0], sensor._image)
    assert found == EACH


@pytest.mark.slow
def test_one_part_of_a_car_before_the_sun_is_judged_unlike_another() -> None:
    sensor, _, _, (first, stop) = drawn((18.0, 1.0, 0.0), {"sun_elevation": 0.12})
    parameters, image = sensor._parameters[0], sensor._image
    found = set()
    for left in range(first, stop, 4):
        part, _ = part_of(sensor, range(left, min(left + 4, stop)), 0.4, 0.4)
        found.add(judge_part(parameters, KIND, part, image))
    assert len(found) > 1
