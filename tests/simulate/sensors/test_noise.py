"""Tail of the normal distribution, and crossings against draws of every pixel."""

import math

import numpy as np
import pytest

from adeye.simulate.sensors.imaging import GREATEST, log_of_miss, noise_of, skip, upper_tail

SEED, OWNER = np.uint64(3), np.uint64(7)


@pytest.mark.parametrize("x", [0.0, 0.1, 0.5, 1.0, 2.0, 2.999, 3.0, 3.001, 4.0, 5.0, 6.0, 8.0])
def test_tail_is_half_of_the_complementary_error_function(x: float) -> None:
    assert upper_tail(x) == pytest.approx(0.5 * math.erfc(x / math.sqrt(2.0)), rel=1e-11)


def test_no_noise_never_crosses() -> None:
    assert log_of_miss(0.05, 0.0) == 0.0
    assert log_of_miss(0.05, 0.05 / GREATEST) == 0.0
    assert log_of_miss(math.inf, 1.0) == 0.0


@pytest.mark.parametrize("ratio", [0.5, 2.0, 4.0, 4.5, 6.0])
def test_miss_is_what_the_tail_leaves(ratio: float) -> None:
    expected = math.log1p(-upper_tail(ratio))
    assert log_of_miss(ratio, 1.0) == pytest.approx(expected, rel=1e-10)
    assert expected < 0.0


def test_skips_are_as_long_as_if_every_pixel_were_drawn() -> None:
    missing = log_of_miss(1.5, 1.0)
    crossing = upper_tail(1.5)
    skips = np.array([skip(missing, SEED, OWNER, 0, index) for index in range(20_000)])
    mean = (1.0 - crossing) / crossing
    assert skips.mean() == pytest.approx(mean, rel=0.03)
    assert (skips == 0).mean() == pytest.approx(crossing, rel=0.06)
    assert skips.std() == pytest.approx(math.sqrt(1.0 - crossing) / crossing, rel=0.05)


def test_noise_of_pixels_is_standard_normal_and_independent_of_its_neighbour() -> None:
    noise = np.array([noise_of(pixel, SEED, OWNER, 4) for pixel in range(20_000)])
    assert abs(noise.mean()) < 0.03
    assert noise.std() == pytest.approx(1.0, abs=0.02)
    assert abs(np.corrcoef(noise[::2], noise[1::2])[0, 1]) < 0.03
    assert np.abs(noise).max() < GREATEST
    assert len(set(noise.tolist())) == len(noise)


def test_noise_depends_on_the_sample_and_the_sensor() -> None:
    assert noise_of(5, SEED, OWNER, 1) != noise_of(5, SEED, OWNER, 2)
    assert noise_of(5, SEED, OWNER, 1) != noise_of(5, SEED, np.uint64(8), 1)
