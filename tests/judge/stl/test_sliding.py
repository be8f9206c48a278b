"""Windows over signs and exact bounds: the same as over bounds of which nothing is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.measures import EXACT, OPEN, SIGN
from adeye.judge.stl.operators import slide

ROWS, KNOWN = 40, 33


def slid(level: int, state: Any, truth: Any, first: int, last: int, *, always: bool) -> Any:
    out, sign = np.zeros((2, ROWS)), np.zeros((2, ROWS), dtype=np.int8)
    scratch, queue = np.zeros((3, ROWS)), np.zeros(ROWS, dtype=np.int64)
    slide(always, level, state, truth, KNOWN, first, last, scratch, queue, out, sign)
    return out[:, :KNOWN], sign[:, :KNOWN]


@pytest.mark.slow
@pytest.mark.parametrize("window", [(0, 0), (0, 5), (2, 9), (0, 32), (3, 60), (35, 50)])
@pytest.mark.parametrize("is_last_open", [False, True])
@pytest.mark.parametrize("always", [False, True])
@pytest.mark.parametrize("level", [EXACT, SIGN])
def test_what_is_known_beforehand_changes_nothing(
    window: tuple[int, int], *, is_last_open: bool, always: bool, level: int
) -> None:
    bits = np.random.default_rng(3)
    for share in (0.0, 0.1, 0.5, 0.9, 1.0):
        truth = np.tile(np.where(bits.uniform(size=ROWS) < share, 1, -1), (2, 1)).astype(np.int8)
        state = truth * (1.0 if level == SIGN else bits.uniform(0.1, 3.0, ROWS))
        if is_last_open:
            state[:, KNOWN - 1], truth[:, KNOWN - 1] = (-np.inf, np.inf), (-1, 1)
        found, sign = slid(level, state, truth, *window, always=always)
        expected, expected_sign = slid(OPEN, state, truth, *window, always=always)
        np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(sign, expected_sign)


def test_last_row_that_is_half_open_is_looked_at() -> None:
    truth = np.full((2, ROWS), -1, dtype=np.int8)
    state = np.full((2, ROWS), -1.0)
    state[0, KNOWN - 1] = -np.inf
    found, _ = slid(SIGN, state, truth, 0, 0, always=False)
    assert found[:, KNOWN - 1].tolist() == [-np.inf, -1.0]
