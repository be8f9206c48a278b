"""Comfort: the largest motions of the ego, from its state."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


def test_straight_and_steady_drive_is_comfortable(hand_made: Any) -> None:
    for column in ("max_acceleration_mps2", "max_lateral_acceleration_mps2", "max_total_jerk_mps3",
                   "max_yaw_rate_radps", "max_yaw_acceleration_radps2"):  # fmt: skip
        assert measure(hand_made(), column)[:2] == (0.0, "value")
    value, status, time, _ = measure(hand_made(), "uncomfortable_time_s")
    assert (value, status) == (0.0, "value")
    assert np.isnan(time)


def test_turn_is_measured_by_speed_and_yaw_rate(hand_made: Any) -> None:
    made = hand_made()
    made.columns["ego"][0, 10:, 6] = 0.25
    assert measure(made, "max_lateral_acceleration_mps2")[:3] == (5.0, "value", pytest.approx(1.0))
    assert measure(made, "max_yaw_rate_radps")[0] == 0.25
    assert measure(made, "max_yaw_acceleration_radps2")[0] == pytest.approx(0.25)
    # Along 3 m/s² in one second, across 5 m/s².
    made.columns["ego"][0, 10:, 4] = 3.0
    assert measure(made, "max_total_jerk_mps3")[0] == pytest.approx(np.hypot(3.0, 5.0))
    assert measure(made, "max_acceleration_mps2")[0] == 3.0
    # Eleven rows beyond the lateral limit.
    assert measure(made, "uncomfortable_time_s")[:3] == (
        pytest.approx(1.1), "value", pytest.approx(1.0)
    )  # fmt: skip


@pytest.mark.parametrize(("acceleration", "expected"), [(-4.05, 0.0), (-4.06, 2.1), (2.41, 2.1)])
def test_limits_themselves_are_comfortable(
    hand_made: Any, acceleration: float, expected: float
) -> None:
    made = hand_made().ego(acceleration=acceleration)
    assert measure(made, "uncomfortable_time_s")[0] == pytest.approx(expected)


def test_one_row_has_no_changes(hand_made: Any) -> None:
    made = hand_made()
    made.length[:] = 1
    assert measure(made, "max_total_jerk_mps3")[1] == "undefined"
    assert measure(made, "max_yaw_rate_radps")[1] == "value"


def test_unknown_yaw_rate_is_an_error(hand_made: Any) -> None:
    made = hand_made()
    made.columns["ego"][0, 4, 6] = np.nan
    assert measure(made, "max_yaw_rate_radps")[1] == "error"
    assert measure(made, "uncomfortable_time_s")[1] == "error"
