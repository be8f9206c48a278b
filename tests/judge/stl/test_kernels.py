"""The sliding maximum against its definition."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.judge.stl.operators import sliding_maximum

INF = float("inf")


@pytest.mark.slow
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
