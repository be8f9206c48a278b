"""Faults of a channel's command, by hand."""

from typing import Any

import numpy as np
import pytest

from adeye.signals import DEGRADED, FAULT, OK, REQUESTS_AUTHORITY, SILENT, ControlCommand
from adeye.testing.sensors import injector, moment
from tests.simulate.faults import flows

STEP = 0.05
FIRST = np.array([True, False])
NONE = np.array([False, False])


def command(tick: int, status: int = OK) -> ControlCommand:
    return flows.command(float(tick), stamp=tick * STEP, status=status)


def made(model: str, **parameters: Any) -> Any:
    return injector(model, "channels.nominal", runs=2, step=STEP, parameters=[parameters] * 2)


def test_slow_channel_gives_old_commands_with_their_own_stamps() -> None:
    slow = made("slow", by="0.08 s")
    given = []
    for tick in range(9):
        active = FIRST if 3 <= tick < 8 else NONE
        given.append(slow.apply(command(tick), moment(active)))
    assert [item.acceleration[0] for item in given] == [0, 1, 2, 2, 2, 3, 4, 5, 8]
    assert [item.stamp[0] for item in given] == [item.acceleration[0] * STEP for item in given]
    assert [item.acceleration[1] for item in given] == list(range(9))


def test_stuck_channel_repeats_its_last_command_with_fresh_stamps() -> None:
    stuck = made("stuck")
    stuck.apply(command(1, DEGRADED), moment(NONE))
    for tick in (2, 3):
        faulty = stuck.apply(command(tick), moment(FIRST))
        assert faulty.acceleration.tolist() == [1.0, tick]
        assert faulty.status.tolist() == [DEGRADED, OK]
        assert faulty.stamp.tolist() == [tick * STEP] * 2
    # Stuck from the start it has nothing to repeat.
    faulty = made("stuck").apply(command(3), moment(FIRST))
    assert (faulty.acceleration[0], faulty.status[0]) == (0.0, SILENT)


def test_bias_is_added_and_scale_multiplies() -> None:
    biased = made("bias", acceleration="-2 m/s^2", steering_angle="1 deg")
    faulty = biased.apply(command(3), moment(FIRST))
    assert faulty.acceleration.tolist() == [1.0, 3.0]
    assert faulty.steering_angle[0] == pytest.approx(-3.0 + np.radians(1.0))
    degrees = made("scale", steering_angle=57.3).apply(command(3), moment(FIRST))
    assert degrees.steering_angle[0] == pytest.approx(-3.0 * 57.3)
    assert degrees.acceleration.tolist() == [3.0, 3.0]


def test_oscillation_is_a_cosine_of_the_time_since_the_onset() -> None:
    wave = made("oscillating", acceleration="2 m/s^2", frequency="0.5 Hz")
    added = [
        float(wave.apply(command(0), moment(FIRST, age=age)).acceleration[0])
        for age in (0.0, 0.5, 1.0, 1.5, 2.0, 1e6)
    ]
    assert added == pytest.approx([2.0, 0.0, -2.0, 0.0, 2.0, 2.0], abs=1e-12)


def test_plausible_but_wrong_command_looks_healthy() -> None:
    wrong = made("plausible_but_wrong", acceleration="0.5 m/s^2")
    faulty = wrong.apply(command(3, FAULT), moment(FIRST, time=4.0))
    assert (faulty.acceleration[0], faulty.steering_angle[0]) == (0.5, 0.0)
    assert (faulty.status[0], faulty.stamp[0]) == (OK, 4.0)


def test_plausible_but_wrong_command_goes_gently_faster_unless_it_is_told_otherwise() -> None:
    faulty = made("plausible_but_wrong").apply(command(3), moment(FIRST))
    assert (faulty.acceleration[0], faulty.steering_angle[0]) == (0.5, 0.0)


def test_no_number_is_nan_in_its_runs_only() -> None:
    faulty = made("not_a_number").apply(command(3), moment(FIRST))
    assert np.isnan(faulty.acceleration).tolist() == [True, False]
    assert np.isnan(faulty.steering_angle).tolist() == [True, False]


def test_lying_heartbeat_says_ok_of_what_is_not() -> None:
    for status in (OK, DEGRADED, FAULT, SILENT, REQUESTS_AUTHORITY):
        said = status if status == REQUESTS_AUTHORITY else OK
        faulty = made("heartbeat_lies").apply(command(3, status), moment(FIRST, time=9.0))
        assert faulty.status.tolist() == [said, status]
        assert faulty.stamp[0] == (9.0 if status != said else 3 * STEP)
