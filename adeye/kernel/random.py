"""Random numbers as a pure function of what they are for: no state, no order, no generator.

A draw is named by four numbers. The *stream seed* belongs to the situation, the *owner* to a
sensor instance or actor, the *sample* counts the owner's own samples, and the *index* counts the
draws within one sample. Nothing else enters, so another sensor, fault or step leaves every other
draw as it was.

The bits are Philox4x32-10: key = stream seed; counter = (index, sample, owner low, owner high).
Each draw is one block of its own; ``uniform`` and ``normal`` of one name come from the same block,
so a name serves for one of them.

Source:
    Salmon, Moraes, Dror, Shaw (2011), "Parallel random numbers: as easy as 1, 2, 3", SC'11.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import log_of_fraction, sin_cos_of_turn
from adeye.kernel.jit import compiled, inlined

# 64-bit words with 32-bit masks: no product or sum overflows, compiled or not.
_LOW = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)
_TWELVE = np.uint64(12)
_TWENTY = np.uint64(20)
_MULTIPLIER_0 = np.uint64(0xD2511F53)
_MULTIPLIER_1 = np.uint64(0xCD9E8D57)
_WEYL_0 = np.uint64(0x9E3779B9)
_WEYL_1 = np.uint64(0xBB67AE85)
_TWO_TO_MINUS_52 = 2.0**-52
# Of the bits of a float: those of its mantissa, and those of one half.


def owner_id(name: str) -> int:
    """Return the 64-bit number of a sensor instance or actor, from its name alone.

    Wrap it in ``numpy.uint64`` before it enters compiled code.

    >>> owner_id("sensors.front_camera") == owner_id("sensors.front_radar")
    False
    """
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big")


@inlined
def philox4x32(
    c0: np.uint64, c1: np.uint64, c2: np.uint64, c3: np.uint64, k0: np.uint64, k1: np.uint64
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return the ten-round Philox block of a counter and a key; all words below 2**32."""
    for _ in range(10):
        product_0 = _MULTIPLIER_0 * c0
        product_1 = _MULTIPLIER_1 * c2
        c0 = (product_1 >> _HALF) ^ c1 ^ k0
        c1 = product_1 & _LOW
        c2 = (product_0 >> _HALF) ^ c3 ^ k1
        c3 = product_0 & _LOW
        k0 = (k0 + _WEYL_0) & _LOW
        k1 = (k1 + _WEYL_1) & _LOW
    return c0, c1, c2, c3


@inlined
def _block(
    stream_seed: np.uint64, owner: np.uint64, sample: int, index: int
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    return philox4x32(
        np.uint64(index) & _LOW,
        np.uint64(sample) & _LOW,
        owner & _LOW,
        owner >> _HALF,
        stream_seed & _LOW,
        stream_seed >> _HALF,
    )


@inlined
def _fraction(high: np.uint64, low: np.uint64) -> float:
    """Return the middle of one of 2**52 equal parts of (0, 1); never 0, never 1."""
    # Signed numbers are sooner made floats; these are below 2**52.
    bits = np.int64((high << _TWENTY) | (low >> _TWELVE))
    return (float(bits) + 0.5) * _TWO_TO_MINUS_52


@compiled
def uniform(stream_seed: np.uint64, owner: np.uint64, sample: int, index: int) -> float:
    """Draw from the uniform distribution on the open interval (0, 1).

    Args:
        stream_seed: Seed of the situation.
        owner: ``owner_id`` of the sensor instance or actor.
        sample: Number of the owner's sample, 0 <= sample < 2**32.
        index: Number of the draw within the sample, 0 <= index < 2**32.
    """
    a, b, _, _ = _block(stream_seed, owner, sample, index)
    return _fraction(a, b)


@inlined
def _normal_pair(
    stream_seed: np.uint64, owner: np.uint64, sample: int, index: int
) -> tuple[float, float]:
    a, b, c, d = _block(stream_seed, owner, sample, index)
    radius = math.sqrt(-2.0 * log_of_fraction(_fraction(a, b)))
    sine, cosine = sin_cos_of_turn(2.0 * math.pi * _fraction(c, d))
    return radius * cosine, radius * sine


@compiled
def normal_pair(
    stream_seed: np.uint64, owner: np.uint64, sample: int, index: int
) -> tuple[float, float]:
    """Draw two independent standard normal numbers from one block.

    Args:
        stream_seed: Seed of the situation.
        owner: ``owner_id`` of the sensor instance or actor.
        sample: Number of the owner's sample, 0 <= sample < 2**32.
        index: Number of the draw within the sample, 0 <= index < 2**32.

    Source:
        Box and Muller (1958), "A note on the generation of random normal deviates".
    """
    return _normal_pair(stream_seed, owner, sample, index)


@compiled
def normal_pairs(
    stream_seeds: NDArray[np.uint64],
    owner: np.uint64,
    sample: int,
    index: int,
    first: NDArray[np.float64],
    second: NDArray[np.float64],
) -> None:
    """Draw a ``normal_pair`` for each of many situations, in a fraction of the time.

    Nothing jumps and no draw waits for another, so a processor that can makes several at a time.

    Args:
        stream_seeds: (B,) of the situations.
        owner: ``owner_id`` of the sensor instance or actor.
        sample: Number of the owner's sample, 0 <= sample < 2**32.
        index: Number of the draw within the sample, 0 <= index < 2**32.
        first: (B,) first number of each pair, out.
        second: (B,) second one, out.
    """
    for place in range(stream_seeds.shape[0]):
        first[place], second[place] = _normal_pair(stream_seeds[place], owner, sample, index)


@compiled
def normal_pairs_at(
    stream_seed: np.uint64,
    owner: np.uint64,
    sample: int,
    indices: NDArray[np.int64],
    first: NDArray[np.float64],
    second: NDArray[np.float64],
) -> None:
    """Draw a ``normal_pair`` for each of many indices of one sample, in a fraction of the time.

    Args:
        stream_seed: Seed of the situation.
        owner: ``owner_id`` of the sensor instance or actor.
        sample: Number of the owner's sample, 0 <= sample < 2**32.
        indices: (N,) numbers of the draws within the sample, 0 <= index < 2**32.
        first: (N,) first number of each pair, out.
        second: (N,) second one, out.
    """
    for place in range(indices.shape[0]):
        first[place], second[place] = _normal_pair(stream_seed, owner, sample, indices[place])


@compiled
def normal_pairs_of(
    stream_seeds: NDArray[np.uint64],
    owner: np.uint64,
    sample: int,
    indices: NDArray[np.int64],
    first: NDArray[np.float64],
    second: NDArray[np.float64],
) -> None:
    """Draw a ``normal_pair`` for each of many pairs of a situation and an index, likewise.

    Args:
        stream_seeds: (N,) of the situations.
        owner: ``owner_id`` of the sensor instance or actor.
        sample: Number of the owner's sample, 0 <= sample < 2**32.
        indices: (N,) numbers of the draws within the sample, 0 <= index < 2**32.
        first: (>= N,) first number of each pair, out.
        second: (>= N,) second one, out.
    """
    for place in range(stream_seeds.shape[0]):
        first[place], second[place] = _normal_pair(
            stream_seeds[place], owner, sample, indices[place]
        )


@compiled
def normal(stream_seed: np.uint64, owner: np.uint64, sample: int, index: int) -> float:
    """Draw from the standard normal distribution: the first of ``normal_pair``.

    Args:
        stream_seed: Seed of the situation.
        owner: ``owner_id`` of the sensor instance or actor.
        sample: Number of the owner's sample, 0 <= sample < 2**32.
        index: Number of the draw within the sample, 0 <= index < 2**32.
    """
    return normal_pair(stream_seed, owner, sample, index)[0]
