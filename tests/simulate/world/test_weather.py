"""Ranges in rain, fog, darkness and low sun against the closed forms and the published table."""

import math

import pytest

from adeye.signals import ILLUMINANCE
from adeye.simulate.world import weather as subject

REFLECTIVITIES = (0.9, 0.5, 0.1, 0.05)
TABLE = {
    0.0: (150.0, 111.8, 50.0, 35.4),
    0.5: (85.4, 70.3, 38.7, 29.2),
    1.5: (65.3, 55.3, 32.9, 25.5),
    3.5: (50.9, 44.0, 27.8, 22.1),
    7.5: (39.7, 34.8, 23.1, 18.8),
    15.0: (31.0, 27.6, 19.0, 15.8),
    40.0: (21.3, 19.2, 14.0, 11.9),
}
"""Range [m] by rain [mm/h] and reflectivity, at 150 m clear range of a surface of 0.9."""


def test_lidar_table() -> None:
    for rain, ranges in TABLE.items():
        for reflectivity, expected in zip(REFLECTIVITIES, ranges, strict=True):
            found = subject.lidar_range(
                150.0, reflectivity, 0.9, rain * subject.MM_PER_HOUR, math.inf
            )
            assert found == pytest.approx(expected, abs=0.051), rain
    # A black surface returns nothing.
    assert subject.lidar_range(150.0, 0.0, 0.9, 0.0, math.inf) == 0.0


def test_lidar_noise_table() -> None:
    # At 50 m [m].
    for rain, sigma in ((0.0, 0.0), (0.5, 0.155), (1.5, 0.604), (3.5, 0.941), (7.5, 0.999)):
        found = 50.0 * subject.lidar_rain_noise(rain * subject.MM_PER_HOUR)
        assert found == pytest.approx(sigma, abs=6e-4)


def test_range_in_extinction_is_its_inverse() -> None:
    for extinction in (0.0, 1e-9, 1e-3, 0.1, 10.0):
        z = subject.range_in_extinction(120.0, extinction)
        assert z * math.exp(extinction * z) == pytest.approx(120.0)


def test_camera_keeps_its_range_by_day_and_sees_nothing_without_contrast() -> None:
    assert subject.camera_range(100.0, 0.0, math.inf, 1.0) == 100.0
    assert subject.camera_range(100.0, 0.0, 1e4, 0.0) == 0.0


# --- light ----------------------------------------------------------------------------------------


def test_light_share_falls_in_the_logarithm_from_day_to_that_of_the_night() -> None:
    for light, share in (
        (ILLUMINANCE["day"], 1.0),
        (ILLUMINANCE["night"], 0.7),
        (1e-3, 0.7),
        (1e5, 1.0),
    ):
        assert subject.light_share(0.7, light) == share
    middle = math.sqrt(ILLUMINANCE["day"] * ILLUMINANCE["night"])
    assert subject.light_share(0.4, middle) == pytest.approx(0.7)
    assert list(ILLUMINANCE) == ["day", "dusk", "lit_night", "night"]
    shares = [subject.light_share(0.5, light) for light in ILLUMINANCE.values()]
    assert shares == sorted(shares, reverse=True)
    assert len(set(shares)) == 4


def test_line_of_sight_into_the_sun_is_as_high_as_the_sun() -> None:
    assert subject.sun_cosine(0.0, 1.0, 0.3, math.pi / 2.0) == pytest.approx(math.cos(0.3))
    assert subject.sun_cosine(1.0, 0.0, 0.3, math.pi / 2.0) == pytest.approx(0.0, abs=1e-15)
    assert subject.sun_cosine(0.0, -1.0, 0.3, math.pi / 2.0) == pytest.approx(-math.cos(0.3))


def test_glare_is_the_veil_of_stiles_and_holladay() -> None:
    angle = 10.0
    veil = 10.0 * subject.SUN_ILLUMINANCE * math.cos(math.radians(angle)) / angle**2
    luminance = 0.2 / math.pi * 2e4
    expected = luminance / (luminance + veil)
    assert subject.glare_contrast(math.cos(math.radians(angle)), 2e4) == pytest.approx(expected)


def test_contrast_falls_as_the_sun_comes_nearer_to_the_line_of_sight() -> None:
    left = [
        subject.glare_contrast(math.cos(math.radians(a)), 2e4) for a in (89, 60, 30, 10, 5, 2, 1.01)
    ]
    assert left == sorted(left, reverse=True)
    assert len(set(left)) == len(left)
    assert 0.0 < subject.glare_contrast(1.0, 2e4) <= left[-1]
    # Beside or behind it takes nothing.
    assert subject.glare_contrast(0.0, 2e4) == subject.glare_contrast(-1.0, 2e4) == 1.0


def test_extinction_of_light_is_that_of_rain_plus_that_of_fog() -> None:
    rain, visibility = 7.5 * subject.MM_PER_HOUR, 200.0
    # 1.076 dB/km times 7.5 to the power 0.67, and 2 % of contrast at the visibility.
    by_rain = 1.076 * 7.5**0.67 / (10.0 * math.log10(math.e)) / 1000.0
    assert subject.light_extinction(rain, 1e12) == pytest.approx(by_rain, rel=1e-3)
    assert math.exp(-visibility * subject.light_extinction(0.0, visibility)) == pytest.approx(
        0.02, rel=1e-3
    )
    both = subject.light_extinction(rain, visibility)
    assert both == pytest.approx(subject.light_extinction(rain, 1e12) + 3.912 / visibility)
