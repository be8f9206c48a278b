"""Fixes that come late, early, between two samples or not at all."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adeye.signals import EGO_HEADING, EGO_SPEED, EGO_X, EGO_Y, Floats
from adeye.simulate.channels.perception.localisation import (
    COUNT,
    FIX_TIME,
    INNOVATION,
    LATEST_FIX,
    NOTHING,
    NOW_TIME,
    SEEN,
    TIME,
    WAITING,
    is_number,
)
from tests.simulate.channels.egos import CAR, STEP, Estimated, drive, estimate, gnss, imu

NOISY = {"position_noise": "0.2 m", "speed_noise": "0.1 m/s"}
SHAKY = {"yaw_rate_noise": "0.3 deg/s", "acceleration_noise": "0.1 m/s^2"}
WINDING = drive(200, 20.0, lambda time: (math.sin(time), 0.02 * math.sin(2.0 * time)))


def errors(found: Estimated, states: Floats, column: int) -> Floats:
    """Return the errors (N, B) of the estimates after 5 s, each at its own time."""
    ticks = np.round(found.stamps[100:] / STEP).astype(int)
    made: Floats = found.estimates[100:, :, column] - states[ticks][:, :, column]
    return made


def test_nothing_is_known_before_the_first_sample() -> None:
    times = (TIME, NOW_TIME, SEEN, FIX_TIME, WAITING)
    assert [NOTHING[column] for column in times] == [-1.0] * 5
    assert NOTHING[COUNT] == 0.0
    assert math.isnan(NOTHING[INNOVATION])


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_row_with_one_that_is_no_number_is_none(wrong: float) -> None:
    assert is_number(np.array([1.0, 2.0]))
    assert not is_number(np.array([1.0, wrong]))


def test_late_fix_gives_the_state_that_a_fix_without_latency_gives() -> None:
    # With the antenna over the rear axle: elsewhere the late fix knows the turn better.
    over_axle = {"x": f"{-0.5 * CAR.wheelbase} m"}
    receiver, unit = gnss(rate="4 Hz", mount=over_axle, **NOISY), imu(**SHAKY)
    early = estimate(WINDING, receiver, unit, latency=0.0)
    late = estimate(WINDING, receiver, unit, latency=0.2)
    # After the fix of tick k the one without latency stands there; the other one four ticks later.
    for tick in range(5, 190, 5):
        assert np.array_equal(early.states[tick], late.states[tick + 4])
        assert np.array_equal(early.innovations[tick], late.innovations[tick + 4], equal_nan=True)


def test_estimate_is_of_the_newest_sample_however_late_the_fix() -> None:
    found = estimate(WINDING, gnss(), imu(), latency=0.3)
    assert found.stamps[20:, 0] == pytest.approx(np.arange(20, 200) * STEP)


def test_fix_that_is_older_than_the_queue_is_not_used() -> None:
    # Once begun, the filter has gone on beyond its time.
    found = estimate(WINDING, gnss(**NOISY), imu(), latency=LATEST_FIX + 0.2)
    used = found.innovations[np.isfinite(found.innovations)]
    assert used.size == 0
    assert (found.stamps[20:] > 0.0).all()


def test_fix_between_two_samples_is_used_at_its_time() -> None:
    # The unit samples every fourth tick, the receiver every second.
    found = estimate(WINDING, gnss(), imu(rate="5 Hz"), latency=0.1)
    for column, bound in ((EGO_X, 0.05), (EGO_Y, 0.05), (EGO_HEADING, 0.01), (EGO_SPEED, 0.1)):
        assert np.abs(errors(found, WINDING, column)).max() < bound


def test_fix_that_is_newer_than_all_samples_waits_for_the_unit() -> None:
    found = estimate(WINDING, gnss(rate="20 Hz"), imu(), latency=0.0, unit_latency=0.15)
    # The estimate is as old as the newest sample.
    assert found.stamps[50:, 0] == pytest.approx(np.arange(47, 197) * STEP)
    for column, bound in ((EGO_X, 0.01), (EGO_Y, 0.01), (EGO_HEADING, 0.002), (EGO_SPEED, 0.02)):
        assert np.abs(errors(found, WINDING, column)).max() < bound


def test_one_of_several_fixes_that_come_before_their_sample_is_used() -> None:
    found = estimate(WINDING, gnss(rate="20 Hz", **NOISY), imu(), latency=0.0, unit_latency=0.15)
    used = np.diff(found.innovations[60:180, 0]) != 0.0
    # One waits for three ticks, and the next one is that of the tick after: one in four.
    assert used.sum() == pytest.approx(30, abs=1)


def test_dead_unit_stops_the_estimate_and_it_begins_anew_with_it() -> None:
    found = estimate(WINDING, gnss(), imu(), blind={1: (100, 140)})
    stamps = found.stamps[:, 0]
    assert stamps[139] == pytest.approx(99 * STEP)
    # The first fix that is newer than the unit's return comes 0.1 s later.
    assert stamps[145] == pytest.approx(145 * STEP)
    assert np.abs(found.estimates[145:, 0, EGO_Y] - WINDING[145:, EGO_Y]).max() < 0.05


def test_dead_receiver_leaves_the_samples_to_go_by() -> None:
    found = estimate(WINDING, gnss(), imu(), blind={0: (100, 200)})
    assert found.stamps[100:, 0] == pytest.approx(np.arange(100, 200) * STEP)
    # Without noise the samples alone are nearly enough.
    assert np.abs(errors(found, WINDING, EGO_Y)).max() < 0.1
    assert (np.diff(found.deviations[115:, 0]) > 0.0).all()
