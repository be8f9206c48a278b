"""Random numbers: published vectors, independence of what they must not depend on, moments."""

import math

import numpy as np
import pytest

from adeye.kernel.elementary import log, sin_cos
from adeye.kernel.random import (
    normal,
    normal_pair,
    normal_pairs,
    normal_pairs_at,
    normal_pairs_of,
    owner_id,
    philox4x32,
    uniform,
)

SEED = np.uint64(0x0123456789ABCDEF)
OWNER = np.uint64(0xFEDCBA9876543210)


# Known answers of Random123 1.14 (`kat_vectors`, philox 4x32, 10 rounds).
@pytest.mark.parametrize(
    ("counter", "key", "block"),
    [
        (
            (0, 0, 0, 0),
            (0, 0),
            (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8),
        ),
        (
            (0xFFFFFFFF,) * 4,
            (0xFFFFFFFF,) * 2,
            (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD),
        ),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_philox_gives_the_published_answers(
    counter: tuple[int, ...], key: tuple[int, ...], block: tuple[int, ...]
) -> None:
    words = philox4x32(*(np.uint64(word) for word in counter + key))
    assert tuple(int(word) for word in words) == block


def test_draws_are_frozen() -> None:
    assert uniform(SEED, OWNER, 3, 5) == 0.559857237926524
    assert normal_pair(SEED, OWNER, 3, 5) == (-1.076064004851312, 0.04725650768815561)


def test_uniform_is_the_high_bits_of_the_block() -> None:
    a, b, _, _ = philox4x32(
        np.uint64(5),
        np.uint64(3),
        np.uint64(0x76543210),
        np.uint64(0xFEDCBA98),
        np.uint64(0x89ABCDEF),
        np.uint64(0x01234567),
    )
    assert uniform(SEED, OWNER, 3, 5) == ((int(a) << 20 | int(b) >> 12) + 0.5) / 2.0**52


def test_every_part_of_the_name_changes_the_draw() -> None:
    draws = {
        uniform(seed, owner, sample, index)
        for seed in (SEED, np.uint64(0), np.uint64(1), np.uint64(1 << 32))
        for owner in (OWNER, np.uint64(0), np.uint64(1), np.uint64(1 << 32))
        for sample in (0, 1, 2**32 - 1)
        for index in (0, 1, 2**32 - 1)
    }
    assert len(draws) == 4 * 4 * 3 * 3


def test_uniform_is_uniform() -> None:
    draws = np.array([uniform(SEED, OWNER, k // 50, k % 50) for k in range(4000)])
    assert 0.0 < draws.min() < 2e-3
    assert 1.0 - 2e-3 < draws.max() < 1.0
    steps = np.arange(1, draws.size + 1) / draws.size
    # Kolmogorov-Smirnov at 1 in 1,000.
    assert np.abs(np.sort(draws) - steps).max() < 1.95 / math.sqrt(draws.size)


def test_normal_is_standard_normal() -> None:
    pairs = np.array([normal_pair(SEED, OWNER, k, 0) for k in range(4000)])
    for draws in pairs.T:
        assert abs(draws.mean()) < 4.0 / math.sqrt(4000)
        assert abs(draws.var() - 1.0) < 4.0 * math.sqrt(2.0 / 4000)
        ordered = np.sort(draws)
        cumulative = np.array([0.5 * math.erfc(-z / math.sqrt(2.0)) for z in ordered])
        steps = np.arange(1, 4001) / 4000
        assert np.abs(cumulative - steps).max() < 1.95 / math.sqrt(4000)
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 4.0 / math.sqrt(4000)


def test_neighbouring_draws_are_uncorrelated() -> None:
    draws = np.array([normal(SEED, OWNER, k, 0) for k in range(4001)])
    assert abs(np.corrcoef(draws[:-1], draws[1:])[0, 1]) < 4.0 / math.sqrt(4000)


def test_normal_is_the_first_of_its_pair() -> None:
    assert normal(SEED, OWNER, 8, 1) == normal_pair(SEED, OWNER, 8, 1)[0]


# Whole vectors, what is left over beside them, a single draw, and none.
@pytest.mark.parametrize("count", [0, 1, 7, 64, 1003])
def test_many_pairs_are_the_single_ones_bit_for_bit(count: int) -> None:
    seeds = np.arange(count, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15) + SEED
    first, second = np.full(count + 1, 9.0), np.full(count + 1, 9.0)
    normal_pairs(seeds, OWNER, 2**32 - 1, 5, first[:count], second[:count])
    single = [normal_pair(seed, OWNER, 2**32 - 1, 5) for seed in seeds]
    assert list(zip(first[:count], second[:count], strict=True)) == single
    assert (first[count], second[count]) == (9.0, 9.0)


@pytest.mark.parametrize("count", [0, 1, 7, 1003])
def test_many_pairs_of_one_sample_are_the_single_ones_bit_for_bit(count: int) -> None:
    indices = (np.arange(count, dtype=np.int64) * 0x9E3779B1) % 2**32
    first, second = np.full(count + 1, 9.0), np.full(count + 1, 9.0)
    normal_pairs_at(SEED, OWNER, 2**32 - 1, indices, first[:count], second[:count])
    single = [normal_pair(SEED, OWNER, 2**32 - 1, int(index)) for index in indices]
    assert list(zip(first[:count], second[:count], strict=True)) == single
    assert (first[count], second[count]) == (9.0, 9.0)


@pytest.mark.parametrize("count", [0, 1, 7, 1003])
def test_many_pairs_of_seeds_and_indices_are_the_single_ones_bit_for_bit(count: int) -> None:
    seeds = SEED + np.arange(count, dtype=np.uint64) * OWNER
    indices = (np.arange(count, dtype=np.int64) * 0x9E3779B1) % 2**32
    first, second = np.full(count + 1, 9.0), np.full(count + 1, 9.0)
    normal_pairs_of(seeds, OWNER, 2**32 - 1, indices, first[:count], second[:count])
    pairs = zip(seeds, indices, strict=True)
    single = [normal_pair(seed, OWNER, 2**32 - 1, int(index)) for seed, index in pairs]
    assert list(zip(first[:count], second[:count], strict=True)) == single
    assert (first[count], second[count]) == (9.0, 9.0)


def test_owner_is_the_hash_of_the_name() -> None:
    # First eight bytes of the published SHA-256 of "abc".
    assert owner_id("abc") == 0xBA7816BF8F01CFEA


def test_normal_numbers_are_those_of_the_elementary_functions_bit_for_bit() -> None:
    for index in range(500):
        words = philox4x32(
            np.uint64(index),
            np.uint64(3),
            np.uint64(0x76543210),
            np.uint64(0xFEDCBA98),
            np.uint64(0x89ABCDEF),
            np.uint64(0x01234567),
        )
        a, b, c, d = (int(word) for word in words)
        u = ((a << 20 | b >> 12) + 0.5) / 2.0**52
        v = ((c << 20 | d >> 12) + 0.5) / 2.0**52
        radius = math.sqrt(-2.0 * log(u))
        sine, cosine = sin_cos(2.0 * math.pi * v)
        assert normal_pair(SEED, OWNER, 3, index) == (radius * cosine, radius * sine)
