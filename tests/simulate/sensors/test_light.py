"""Contrast, light and glare: laws, limits and the figures that they are set by."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.kernel.detection_range import contrast_threshold
from adeye.signals import ILLUMINANCE, OBJECT_CLASSES
from adeye.simulate.sensors.imaging import SHINE, beam, shown_contrast
from adeye.simulate.world.objects import CONTRAST
from adeye.simulate.world.weather import GREY, SUN_ILLUMINANCE, veil

LIGHT = st.floats(1e-3, 1e5)
DISTANCE = st.floats(0.1, 500.0)


def test_every_class_has_a_contrast() -> None:
    assert set(CONTRAST) == set(OBJECT_CLASSES)
    assert all(0.0 < contrast <= 1.0 for contrast in CONTRAST.values())


def test_threshold_by_day_is_the_one_that_is_given() -> None:
    assert contrast_threshold(0.05, ILLUMINANCE["day"]) == pytest.approx(0.05, rel=0.005)


def test_threshold_at_night_falls_with_the_root_of_the_light() -> None:
    assert contrast_threshold(0.05, 1e-3) == pytest.approx(
        10.0 * contrast_threshold(0.05, 0.1), rel=0.01
    )


def test_pedestrian_needs_five_lux() -> None:
    assert contrast_threshold(0.05, 5.0) == pytest.approx(CONTRAST["pedestrian"])


def test_nothing_is_seen_in_the_dark() -> None:
    for light in (0.0, -1.0, math.nan):
        assert contrast_threshold(0.05, light) == math.inf


@given(LIGHT, LIGHT)
def test_threshold_falls_as_light_rises(one: float, other: float) -> None:
    low, high = sorted((one, other))
    assert contrast_threshold(0.05, low) >= contrast_threshold(0.05, high) > 0.05


def test_headlamps_light_with_the_square_of_the_distance() -> None:
    assert beam(20_000.0, 1.0, 50.0) == pytest.approx(8.0)
    assert beam(20_000.0, 1.0, 100.0) == pytest.approx(2.0)


def test_headlamps_light_half_as_much_at_nineteen_degrees_and_nothing_behind() -> None:
    half = beam(20_000.0, math.cos(math.radians(19.3)), 10.0)
    assert half == pytest.approx(0.5 * beam(20_000.0, 1.0, 10.0), rel=0.01)
    assert beam(20_000.0, 0.0, 10.0) == beam(20_000.0, -1.0, 10.0) == 0.0


def test_veil_falls_with_the_square_of_the_angle() -> None:
    for degrees in (2.0, 5.0, 20.0, 60.0, 120.0):
        angle = math.radians(degrees)
        assert veil(SUN_ILLUMINANCE, math.cos(angle)) == pytest.approx(
            10.0 * SUN_ILLUMINANCE / degrees**2
        )


def test_veil_within_one_degree_is_that_at_one() -> None:
    assert (
        veil(SUN_ILLUMINANCE, 1.0)
        == veil(SUN_ILLUMINANCE, math.cos(1e-3))
        == pytest.approx(10.0 * SUN_ILLUMINANCE)
    )


def test_no_light_no_veil() -> None:
    assert veil(0.0, 1.0) == 0.0


@given(DISTANCE, DISTANCE, st.floats(0.0, 0.1))
def test_contrast_falls_with_distance(one: float, other: float, extinction: float) -> None:
    near, far = sorted((one, other))
    args = (extinction, 100.0, 10.0)
    assert shown_contrast(0.5, near, *args) >= shown_contrast(0.5, far, *args)


@given(LIGHT, LIGHT, st.floats(1e-3, 1e5))
def test_light_on_the_object_helps_against_glare(one: float, other: float, glare: float) -> None:
    dim, bright = sorted((one, other))
    weak, strong = (shown_contrast(0.5, 10.0, 0.01, light, glare) for light in (dim, bright))
    assert weak <= strong <= shown_contrast(0.5, 10.0, 0.01, bright, 0.0)


def test_contrast_at_the_visibility_is_two_percent() -> None:
    assert shown_contrast(1.0, 200.0, 3.912 / 200.0, 1e4, 0.0) == pytest.approx(0.02, rel=1e-3)


def test_lamps_of_a_car_make_it_as_bright_as_58_lux_would() -> None:
    shine = SHINE[OBJECT_CLASSES.index("car")]
    assert shine == pytest.approx(58.2, abs=0.1)
    assert GREY * shine / math.pi == pytest.approx(10.0 / (1.8 * 1.5))


def test_what_is_parked_and_who_walks_has_no_lamps() -> None:
    dark = {kind for kind, shine in zip(OBJECT_CLASSES, SHINE, strict=True) if shine == 0.0}
    assert dark == {"pedestrian", "parked_truck", "parked_car", "barrier", "building"}
