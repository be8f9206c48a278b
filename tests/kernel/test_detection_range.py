"""Closed forms of detection ranges, and the speed that a range allows."""

import math

import numpy as np
import pytest

from adeye.kernel import detection_range as subject
from adeye.kernel.criticality import stopping_distance

DAY, NIGHT = 2e4, 0.1


def test_ninety_degrees_put_the_image_half_its_width_away() -> None:
    assert subject.focal_length(160.0, math.pi / 2.0) == pytest.approx(80.0, rel=1e-12)


def test_object_at_its_pixel_range_fills_just_so_many_rows() -> None:
    focal = subject.focal_length(320.0, 0.8)
    depth = subject.pixel_range(1.5, focal, 3.0)
    assert focal * 1.5 / depth == pytest.approx(3.0, rel=1e-12)


def test_threshold_by_day_is_the_given_one_and_no_light_shows_nothing() -> None:
    assert subject.contrast_threshold(0.05, DAY) == pytest.approx(0.05, rel=0.01)
    assert subject.contrast_threshold(0.05, 120.0) == pytest.approx(0.05 * math.sqrt(2.0))
    assert subject.contrast_threshold(0.05, 0.0) == math.inf


def test_pedestrian_by_night_is_seen_to_where_the_headlamps_give_five_lux() -> None:
    found = subject.contrast_range(0.25, 0.05, 0.0, 0.0, 20_000.0)
    assert found == pytest.approx(math.sqrt(20_000.0 / 5.0), rel=1e-9)


def test_headlamps_have_half_their_light_at_nineteen_degrees_and_none_from_ninety_on() -> None:
    degrees = (0.0, 19.3, 45.0, 90.1, 180.0)
    found = [subject.headlamp_share(math.cos(math.radians(angle))) for angle in degrees]
    assert found == pytest.approx([1.0, 0.5, 1.0 / 64.0, 0.0, 0.0], abs=1e-3)


def test_contrast_range_by_day_is_that_of_koschmieder() -> None:
    found = subject.contrast_range(0.5, 0.05, 0.01, 1e12, 0.0)
    assert found == pytest.approx(math.log(10.0) / 0.01, rel=1e-6)


def test_weak_contrast_is_seen_nowhere_and_clear_air_hides_nothing() -> None:
    assert subject.contrast_range(0.01, 0.05, 0.001, DAY, 0.0) == pytest.approx(0.0, abs=1e-9)
    assert subject.contrast_range(0.5, 0.05, 0.0, DAY, 0.0) == pytest.approx(subject.FARTHEST)


def test_contrast_range_falls_as_it_gets_worse() -> None:
    ranges = [
        [subject.contrast_range(0.5, 0.05, fog, 10.0, 0.0) for fog in (0.001, 0.01, 0.1)],
        [subject.contrast_range(0.5, 0.05, 0.001, light, 2e4) for light in (DAY, 100.0, NIGHT)],
        [subject.contrast_range(0.5, 0.05, 0.001, NIGHT, lamp) for lamp in (4e4, 1e4, 1e3)],
    ]
    for found in ranges:
        assert found == sorted(found, reverse=True)
        assert len(set(found)) == len(found)


def test_sixteenth_of_the_cross_section_halves_the_range() -> None:
    assert subject.cross_section_range(200.0, 10.0 / 16.0, 10.0) == pytest.approx(100.0, rel=1e-12)


@pytest.mark.parametrize("beams", [1, 2, 7])
def test_face_over_n_spacings_holds_n_beams_for_sure(beams: int) -> None:
    spacing = 0.007
    width = 2.0 * 50.0 * math.tan(0.5 * beams * spacing)
    assert subject.sure_beams(width, 50.0, spacing) == beams
    assert subject.sure_beams(0.99 * width, 50.0, spacing) == beams - 1


@pytest.mark.parametrize("margin", [0.0, 2.0])
def test_stopping_distance_and_the_margin_are_needed_by_who_is_faster(margin: float) -> None:
    speeds, out = np.array([-5.0, 0.0, 13.9, 22.2, 36.1]), np.zeros(5)
    for delay, deceleration in ((0.35, 6.0), (0.5, 5.0), (1.0, 4.0)):
        subject.needed_ranges(speeds, delay, deceleration, margin, out)
        ways = [stopping_distance(max(speed, 0.0), delay, deceleration) for speed in speeds]
        assert out == pytest.approx(np.array(ways) + margin, rel=1e-12)


def test_unknown_is_never_a_range() -> None:
    assert math.isnan(subject.contrast_range(0.5, 0.05, math.nan, DAY, 0.0))
