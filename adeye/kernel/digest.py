"""A rolling 128-bit digest of arrays, as fast as memory: it tells traces apart, it keeps no secret.

Eight lanes take one word each in turn. Every step is a bijection of the lane for a given word and
of the word for a given lane, so that a change of one word always changes the digest's lane; the
lanes are mixed at the end.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled

Words = NDArray[np.uint64]

LANES: Final = 8

_PRIME: Final = np.uint64(0x9E3779B185EBCA87)
_LEFT: Final = np.uint64(29)
_RIGHT: Final = np.uint64(35)
_FIRST: Final = np.uint64(0xFF51AFD7ED558CCD)
_SECOND: Final = np.uint64(0xC4CEB9FE1A85EC53)
_HALF: Final = np.uint64(33)
_BYTE: Final = np.uint64(8)


@compiled
def _take(lane: np.uint64, word: np.uint64) -> np.uint64:
    """Take one word into a lane."""
    mixed = lane ^ word
    # The turn brings the highest bits down to where the product spreads them.
    return np.uint64(((mixed << _LEFT) | (mixed >> _RIGHT)) * _PRIME)


@compiled
def _spread(word: np.uint64) -> np.uint64:
    """Let every bit of a word decide on every other."""
    word = (word ^ (word >> _HALF)) * _FIRST
    word = (word ^ (word >> _HALF)) * _SECOND
    return np.uint64(word ^ (word >> _HALF))


@compiled
def absorb_words(words: Words, counts: NDArray[np.int64], key: np.uint64, lanes: Words) -> None:
    """Take the first words of each row.

    Args:
        words: (B, W).
        counts: (B,) how many of them.
        key: What the words are: their name, type and shape.
        lanes: (B, LANES) in and out.
    """
    for run in range(words.shape[0]):
        row, own, count = words[run], lanes[run], counts[run]
        a, b, c, d = own[0] ^ key, own[1] ^ key, own[2] ^ key, own[3] ^ key
        e, f, g, h = own[4] ^ key, own[5] ^ key, own[6] ^ key, own[7] ^ key
        whole = count - count % 8
        for k in range(0, whole, 8):
            a, b = _take(a, row[k]), _take(b, row[k + 1])
            c, d = _take(c, row[k + 2]), _take(d, row[k + 3])
            e, f = _take(e, row[k + 4]), _take(f, row[k + 5])
            g, h = _take(g, row[k + 6]), _take(h, row[k + 7])
        own[0], own[1], own[2], own[3] = a, b, c, d
        own[4], own[5], own[6], own[7] = e, f, g, h
        for k in range(whole, count):
            own[k - whole] = _take(own[k - whole], row[k])
        for lane in range(8):
            own[lane] = _take(own[lane], key)


@compiled
def absorb_bytes(
    values: NDArray[np.uint8], counts: NDArray[np.int64], key: np.uint64, lanes: Words
) -> None:
    """Take the first bytes of each row, eight to a word; the last word is filled up with zeros.

    Args:
        values: (B, W).
        counts: (B,) how many of them.
        key: What the bytes are: their name, type and shape.
        lanes: (B, LANES) in and out.
    """
    for run in range(values.shape[0]):
        row, own, count = values[run], lanes[run], counts[run]
        for lane in range(8):
            own[lane] ^= key
        place = 0
        lane = 0
        while place < count:
            word = np.uint64(0)
            for k in range(min(place + 8, count) - 1, place - 1, -1):
                word = (word << _BYTE) | np.uint64(row[k])
            own[lane] = _take(own[lane], word)
            lane = (lane + 1) % 8
            place += 8
        for lane in range(8):
            own[lane] = _take(own[lane], key)


@compiled
def finish(lanes: Words, out: Words) -> None:
    """Mix the lanes into the digest.

    Args:
        lanes: (B, LANES).
        out: (B, 2).
    """
    for run in range(lanes.shape[0]):
        one, two = np.uint64(0), _PRIME
        for lane in range(8):
            one = _spread(_take(one, lanes[run, lane]))
            two = _spread(_take(two, lanes[run, 7 - lane]))
        out[run, 0], out[run, 1] = one, _spread(two ^ one)
