"""Comfort and motion: the largest motions of the ego, jerk, deceleration, place in the lane."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.series import CHANGE_WINDOW, mean_change
from tests.judge.conftest import measure


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
    for column in ("max_total_jerk_mps3", "max_jerk_mps3"):
        assert measure(made, column)[1] == "undefined"
    assert measure(made, "max_yaw_rate_radps")[1] == "value"


def test_one_unknown_sample_makes_the_metric_an_error(hand_made: Any) -> None:
    made = hand_made()
    made.columns["ego"][0, 4, 6] = np.nan
    for column in ("max_yaw_rate_radps", "uncomfortable_time_s"):
        assert measure(made, column)[1] == "error", column
    made.columns["ego"][0, 9, 4] = made.columns["ego_place"][0, 9, 5] = np.nan
    for column in ("max_jerk_mps3", "max_deceleration_mps2", "max_lane_offset_m"):
        assert measure(made, column)[1] == "error", column


def test_jerk_counts_whatever_its_sign(hand_made: Any) -> None:
    acceleration = np.zeros(21)
    acceleration[5], acceleration[6:] = 0.4, -0.5
    made = hand_made().ego(acceleration=acceleration)
    # From 0.4 m/s² at 0.5 s to -0.5 m/s² a second later.
    expected = (pytest.approx(0.9), "value", pytest.approx(1.5), -1)
    assert measure(made, "max_jerk_mps3") == expected


def stop(step: float) -> Any:
    """Acceleration of a car that brakes from 10 m/s with 4 m/s² and a lag of 0.15 s."""
    time = np.arange(int(5.0 / step) + 1) * step
    lag = np.exp(-time / 0.15)
    speed = 10.0 - 4.0 * (time - 0.15 * (1.0 - lag))
    return np.where(speed > 0.0, -4.0 * (1.0 - lag), 0.0)


@pytest.mark.parametrize("column", ["max_jerk_mps3", "max_total_jerk_mps3"])
def test_jerk_of_a_stop_converges_with_the_step(hand_made: Any, column: str) -> None:
    found = []
    for step in (0.1, 0.05, 0.025, 0.0125):
        acceleration = stop(step)
        made = hand_made(rows=len(acceleration), step=step).ego(acceleration=acceleration)
        found.append(measure(made, column)[0])
    # The deceleration that a second before the standstill was full is gone.
    assert found == pytest.approx([4.0] * 4, rel=0.01)


@pytest.mark.parametrize("step", [0.03, 0.05, 0.07, 0.3, 1.0, 2.5])
def test_steady_change_is_its_slope_at_every_step(step: float) -> None:
    slope = np.asarray(np.arange(60) * step * 0.7, dtype=np.float64)
    change = mean_change(slope[np.newaxis], step)[0]
    np.testing.assert_allclose(change[np.arange(60) * step >= CHANGE_WINDOW], 0.7, rtol=1e-9)
    assert change[0] == 0.0


def test_deceleration_is_a_magnitude_and_zero_where_nobody_brakes(hand_made: Any) -> None:
    made = hand_made().ego(acceleration=np.where(np.arange(21) == 7, -3.5, 1.0))
    assert measure(made, "max_deceleration_mps2") == (3.5, "value", pytest.approx(0.7), -1)
    assert measure(hand_made().ego(acceleration=2.0), "max_deceleration_mps2")[0] == 0.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_lane_offset_counts_to_both_sides(hand_made: Any, side: float) -> None:
    made = hand_made().ego(d=5.25 + side * np.linspace(0.0, 1.0, 21))
    assert measure(made, "max_lane_offset_m") == (pytest.approx(1.0), "value", 2.0, -1)
