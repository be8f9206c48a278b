"""Ranges in rain, fog and darkness against the closed forms and the published table."""

from __future__ import annotations

import math

import pytest

from adeye.sensors.weather import (
    LIDAR_RAIN_A,
    LIDAR_RAIN_B,
    MM_PER_HOUR,
    camera_range,
    lidar_rain_noise,
    lidar_range,
    range_in_extinction,
)

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


@pytest.mark.parametrize("rain", TABLE)
def test_lidar_table(rain: float) -> None:
    for reflectivity, expected in zip(REFLECTIVITIES, TABLE[rain], strict=True):
        found = lidar_range(150.0, reflectivity, 0.9, rain * MM_PER_HOUR, math.inf)
        assert found == pytest.approx(expected, abs=0.051)


def test_lidar_noise_table() -> None:
    # At 50 m [m].
    for rain, sigma in ((0.0, 0.0), (0.5, 0.155), (1.5, 0.604), (3.5, 0.941), (7.5, 0.999)):
        found = 50.0 * lidar_rain_noise(rain * MM_PER_HOUR)
        assert found == pytest.approx(sigma, abs=6e-4)


def test_lidar_range_solves_its_equation() -> None:
    for rain in (0.1, 1.0, 10.0, 100.0):
        z = lidar_range(150.0, 0.3, 0.9, rain * MM_PER_HOUR, math.inf)
        extinction = LIDAR_RAIN_A * rain**LIDAR_RAIN_B
        assert z * math.exp(extinction * z) == pytest.approx(150.0 * math.sqrt(0.3 / 0.9))


def test_black_surface_returns_nothing() -> None:
    assert lidar_range(150.0, 0.0, 0.9, 0.0, math.inf) == 0.0


@pytest.mark.parametrize("extinction", [0.0, 1e-9, 1e-3, 0.1, 10.0])
def test_range_in_extinction_is_its_inverse(extinction: float) -> None:
    z = range_in_extinction(120.0, extinction)
    assert z * math.exp(extinction * z) == pytest.approx(120.0)


def test_ranges_fall_as_it_gets_worse() -> None:
    rains = [k * MM_PER_HOUR for k in (0.0, 0.5, 2.0, 8.0, 40.0)]
    fogs = [math.inf, 1000.0, 200.0, 50.0]
    for values in (
        [camera_range(100.0, rain, math.inf, 1.0) for rain in rains],
        [camera_range(100.0, 0.0, fog, 1.0) for fog in fogs],
        [camera_range(100.0, 0.0, math.inf, night) for night in (1.0, 0.7, 0.3)],
        [lidar_range(100.0, 0.5, 0.9, rain, math.inf) for rain in rains],
        [lidar_range(100.0, 0.5, 0.9, 0.0, fog) for fog in fogs],
    ):
        assert values == sorted(values, reverse=True)
        assert len(set(values)) == len(values)


def test_camera_by_day_in_clear_air_keeps_its_range() -> None:
    assert camera_range(100.0, 0.0, math.inf, 1.0) == 100.0
