"""Random numbers: published vectors, independence of what they must not depend on, moments."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel import random as subject
from adeye.kernel.elementary import log, sin_cos

SEED = np.uint64(0x0123456789ABCDEF)
OWNER = np.uint64(0xFEDCBA9876543210)


# Known answers of Random123 1.14 (`kat_vectors`, philox 4x32, 10 rounds): counter, key, block.
KNOWN = """
00000000 00000000 00000000 00000000 00000000 00000000 6627e8d5 e169c58d bc57ac4c 9b00dbd8
ffffffff ffffffff ffffffff ffffffff ffffffff ffffffff 408f276d 41c83b0e a20bc7c6 6d5451fd
243f6a88 85a308d3 13198a2e 03707344 a4093822 299f31d0 d16cfe09 94fdcceb 5001e420 24126ea1
"""


def test_philox_gives_the_published_answers() -> None:
    for line in KNOWN.strip().splitlines():
        words = [int(word, 16) for word in line.split()]
        block = subject.philox4x32(*map(np.uint64, words[:6]))
        assert [int(word) for word in block] == words[6:]


def test_draws_are_frozen() -> None:
    assert subject.uniform(SEED, OWNER, 3, 5) == 0.559857237926524
    assert subject.normal_pair(SEED, OWNER, 3, 5) == (-1.076064004851312, 0.04725650768815561)


def test_every_part_of_the_name_changes_the_draw() -> None:
    draws = {
        subject.uniform(seed, owner, sample, index)
        for seed in (SEED, np.uint64(0), np.uint64(1), np.uint64(1 << 32))
        for owner in (OWNER, np.uint64(0), np.uint64(1), np.uint64(1 << 32))
        for sample in (0, 1, 2**32 - 1)
        for index in (0, 1, 2**32 - 1)
    }
    assert len(draws) == 4 * 4 * 3 * 3


def test_uniform_is_uniform() -> None:
    draws = np.array([subject.uniform(SEED, OWNER, k // 50, k % 50) for k in range(4000)])
    assert 0.0 < draws.min() < 2e-3
    assert 1.0 - 2e-3 < draws.max() < 1.0
    steps = np.arange(1, draws.size + 1) / draws.size
    # Kolmogorov-Smirnov at 1 in 1,000.
    assert np.abs(np.sort(draws) - steps).max() < 1.95 / math.sqrt(draws.size)


def test_normal_is_standard_normal() -> None:
    pairs = np.array([subject.normal_pair(SEED, OWNER, k, 0) for k in range(4000)])
    for draws in pairs.T:
        assert abs(draws.mean()) < 4.0 / math.sqrt(4000)
        assert abs(draws.var() - 1.0) < 4.0 * math.sqrt(2.0 / 4000)
        ordered = np.sort(draws)
        cumulative = np.array([0.5 * math.erfc(-z / math.sqrt(2.0)) for z in ordered])
        steps = np.arange(1, 4001) / 4000
        assert np.abs(cumulative - steps).max() < 1.95 / math.sqrt(4000)
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 4.0 / math.sqrt(4000)


def test_neighbouring_draws_are_uncorrelated() -> None:
    draws = np.array([subject.normal(SEED, OWNER, k, 0) for k in range(4001)])
    assert abs(np.corrcoef(draws[:-1], draws[1:])[0, 1]) < 4.0 / math.sqrt(4000)


LAST = 2**32 - 1


@pytest.mark.parametrize("count", [0, 1, 7, 64, 1003])
def test_many_pairs_are_the_single_ones_bit_for_bit(count: int) -> None:
    # Whole vectors, what is left over beside them, a single draw, and none.
    numbers = np.arange(count, dtype=np.int64)
    seeds, indices = SEED + numbers.astype(np.uint64) * OWNER, (numbers * 0x9E3779B1) % 2**32
    ways: list[tuple[Any, Any, Any]] = [
        (subject.normal_pairs, (seeds, OWNER, LAST, 5), (seeds, [5] * count)),
        (subject.normal_pairs_at, (SEED, OWNER, LAST, indices), ([SEED] * count, indices)),
        (subject.normal_pairs_of, (seeds, OWNER, LAST, indices), (seeds, indices)),
    ]
    for draw, given, (of, at) in ways:
        first, second = np.full(count + 1, 9.0), np.full(count + 1, 9.0)
        draw(*given, first[:count], second[:count])
        single = [
            subject.normal_pair(seed, OWNER, LAST, int(index))
            for seed, index in zip(of, at, strict=True)
        ]
        assert list(zip(first, second, strict=True)) == [*single, (9.0, 9.0)]


def test_owner_is_the_hash_of_the_name() -> None:
    # First eight bytes of the published SHA-256 of "abc".
    assert subject.owner_id("abc") == 0xBA7816BF8F01CFEA


def test_numbers_are_those_of_the_elementary_functions_of_a_block_bit_for_bit() -> None:
    key = [np.uint64(word) for word in (0x76543210, 0xFEDCBA98, 0x89ABCDEF, 0x01234567)]
    for index in range(500):
        words = subject.philox4x32(np.uint64(index), np.uint64(3), *key)
        a, b, c, d = (int(word) for word in words)
        u = ((a << 20 | b >> 12) + 0.5) / 2.0**52
        v = ((c << 20 | d >> 12) + 0.5) / 2.0**52
        radius = math.sqrt(-2.0 * log(u))
        sine, cosine = sin_cos(2.0 * math.pi * v)
        assert subject.uniform(SEED, OWNER, 3, index) == u
        assert subject.normal_pair(SEED, OWNER, 3, index) == (radius * cosine, radius * sine)
        assert subject.normal(SEED, OWNER, 3, index) == radius * cosine
