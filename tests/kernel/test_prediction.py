"""What is predicted of one object, whoever asks; the tests of the channels' tracks are theirs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.kernel.profiles import (
    FREE_GROWTH,
    OBJECT_D,
    OBJECT_GROWTH,
    OBJECT_ROW,
    OBJECT_SINE,
    OBJECT_SPEED,
    WAY_D,
    WAY_ROW,
    WAY_S,
    believed_braking,
    lane_ahead,
    margin_at,
    predict_body,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

LANE = 5.25
TIMES = 0.5 * np.arange(1, 9)


def ways(
    speed: float, sideways: float, acceleration: float = 0.0, *, is_free: bool = False
) -> tuple[Floats, Floats]:
    body, way = np.zeros(OBJECT_ROW), np.zeros((8, WAY_ROW))
    body[OBJECT_D], body[OBJECT_SPEED] = LANE, speed
    predict_body(body, sideways, is_free, acceleration, 3.5, 3, 0.5, way)
    return body, way


@pytest.mark.slow
def test_lane_change_is_completed_and_no_more() -> None:
    body, way = ways(20.0, 1.0)
    assert way[:, WAY_S] == pytest.approx(20.0 * TIMES)
    assert way[:, WAY_D] == pytest.approx(np.minimum(8.75, LANE + TIMES))
    assert body[OBJECT_SINE] > 0.0


def test_who_is_free_goes_on_beyond_the_road() -> None:
    body, way = ways(0.0, -2.0, is_free=True)
    assert way[:, WAY_D] == pytest.approx(LANE - 2.0 * TIMES)
    assert body[OBJECT_GROWTH] == FREE_GROWTH


@pytest.mark.slow
def test_who_brakes_stands_and_moves_sideways_no_more() -> None:
    _, way = ways(8.0, 0.5, -4.0)
    assert way[-1, WAY_S] == pytest.approx(8.0)
    assert way[-1, WAY_D] == pytest.approx(LANE + 0.5 * 2.0)


@pytest.mark.parametrize(
    ("acceleration", "forward", "believed"),
    [(-1.0, 20.0, 0.0), (-4.0, 20.0, -4.0), (-30.0, 20.0, -10.0), (-4.0, -20.0, 0.0)],
)
def test_little_braking_is_noise_and_too_much_is_not_believed(
    acceleration: float, forward: float, believed: float
) -> None:
    assert believed_braking(acceleration, forward) == believed


@pytest.mark.parametrize(
    ("d", "sideways", "goal"),
    [
        (8.6, -1.0, LANE),
        (8.8, -1.0, 8.75),
        (LANE, 1.0, 8.75),
        (2.0, -1.0, 1.75),
        (1.0, -1.0, -math.inf),
        (9.0, 1.0, math.inf),
    ],
)
def test_lane_change_ends_at_the_next_centre_that_way(
    d: float, sideways: float, goal: float
) -> None:
    assert lane_ahead(d, sideways, 3.5, 3) == goal


def test_margin_grows_with_time_and_faster_for_those_who_may_turn() -> None:
    assert margin_at(0.3, 0.1, 1.0, 0.0) == 0.3
    assert margin_at(0.3, 0.1, 1.0, 4.0) == pytest.approx(0.7)
    assert margin_at(0.3, 0.1, FREE_GROWTH, 4.0) == pytest.approx(1.3)
