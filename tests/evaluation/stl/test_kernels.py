"""Compiled loops against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.evaluation.stl.kernels import (
    sliding_maxima,
    sliding_maximum,
    until_without_end,
    untils_without_end,
)

INF = float("inf")


@pytest.mark.parametrize("beyond", [-INF, INF, -1.0])
@pytest.mark.parametrize(("first", "last"), [(0, 0), (0, 3), (2, 2), (1, 6), (9, 12), (0, 40)])
def test_sliding_maximum_is_the_maximum_of_every_window(
    first: int, last: int, beyond: float
) -> None:
    bits = np.random.default_rng(1)
    for length in (1, 2, 7, 12):
        # Small whole numbers, so that equal neighbours occur.
        values = bits.integers(-2, 3, size=12).astype(float)
        out = np.full(12, np.nan)
        queue = np.empty(12, dtype=np.int64)
        sliding_maximum(values, length, first, last, beyond, queue, out)
        padded = np.concatenate([values[:length], np.full(60, beyond)])
        expected = [padded[k + first : k + last + 1].max() for k in range(length)]
        assert out.tolist() == expected + [beyond] * (12 - length)


@pytest.mark.parametrize("beyond", [-INF, INF])
def test_until_without_end_is_the_best_witness(beyond: float) -> None:
    bits = np.random.default_rng(2)
    for length in (1, 4, 9):
        left, right = bits.normal(size=(2, 9))
        out = np.full(9, np.nan)
        until_without_end(left, right, length, beyond, out)
        for k in range(length):
            witnesses = [
                min([right[j], *left[k:j]]) if j < length else min([beyond, *left[k:length]])
                for j in range(k, length + 1)
            ]
            assert out[k] == max(witnesses)
        assert out[length:].tolist() == [beyond] * (9 - length)


def test_batches_are_their_runs_one_by_one() -> None:
    bits = np.random.default_rng(3)
    left, right = bits.normal(size=(2, 4, 10))
    lengths, beyond = np.array([10, 1, 5, 8]), np.array([INF, -INF, -1.0, 1.0])
    maxima, endless = np.empty((4, 10)), np.empty((4, 10))
    sliding_maxima(left, lengths, 1, 3, beyond, maxima)
    untils_without_end(left, right, lengths, beyond, endless)
    for r in range(4):
        one = np.empty(10)
        queue = np.empty(10, dtype=np.int64)
        sliding_maximum(left[r], int(lengths[r]), 1, 3, float(beyond[r]), queue, one)
        assert maxima[r].tolist() == one.tolist()
        until_without_end(left[r], right[r], int(lengths[r]), float(beyond[r]), one)
        assert endless[r].tolist() == one.tolist()
