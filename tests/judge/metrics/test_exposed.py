"""Scans of exposure: what they sum up, row by row, and where the worst is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adeye.judge.metrics.exposure import exposures, least_stopping_shares
from adeye.judge.metrics.scans import ERROR, NO_CONFLICT, VALUE

ENDS = np.array([[8.45, 1.40, 4.23, 12.68]])


def sums(ttc: list[float], drac: list[float], margin: list[float]) -> tuple[list[float], int]:
    found, _, codes = exposures(
        np.array([len(ttc)]), 0.5, np.array([ttc]), np.array([drac]), np.array([margin]),
        np.zeros((1, len(ttc))), 3.0, ENDS, 1.0, 4.0,
    )  # fmt: skip
    return found[:, 0].tolist(), int(codes[0])


def test_rows_are_summed_up() -> None:
    inf = math.inf
    found, code = sums([inf, 3.0, 2.0], [0.0, 20.0, 8.45], [inf, inf, inf])
    assert code == VALUE
    assert found == pytest.approx([1.0, 0.5, (1.0 + 0.49998496) / 3.0, 0.0], rel=1e-6)


def test_response_is_due_a_response_time_after_the_violation_began() -> None:
    calm = [math.inf] * 6
    found, _ = sums(calm, [0.0] * 6, [-1.0, -1.0, -1.0, -1.0, 1.0, -1.0])
    # From 0 s on in violation, due after 1 s: the row at 1.5 s only.
    assert found[3] == 0.5


@pytest.mark.slow
def test_unknown_is_an_error_and_not_left_out() -> None:
    assert sums([math.nan], [0.0], [math.inf])[1] == ERROR
    assert sums([1.0], [math.nan], [math.inf])[1] == ERROR
    assert sums([1.0], [0.0], [math.nan])[1] == ERROR


@pytest.mark.slow
def test_standing_ego_needs_no_way() -> None:
    _, _, codes = least_stopping_shares(
        np.array([2]), np.array([[5.0, 5.0]]), np.zeros((1, 2)),
        np.full((1, 2), -1, dtype=np.int64), np.array([8.0]),
    )  # fmt: skip
    assert codes.tolist() == [NO_CONFLICT]
