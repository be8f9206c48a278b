"""Intervals of fault handling, over hand-made times and alarms."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.judge.intervals import (
    Degradation,
    alarms,
    degradation,
    first_from,
    held_since_before,
    intervals,
    operates_in_emergency,
    others_act,
)
from adeye.signals import NO_CHANNEL, REASON_STALENESS

times = st.floats(0.0, 100.0)


@given(times, times, times, times)
def test_handling_is_detection_and_reaction_together_and_never_less(
    fault: float, delay: float, emergency: float, safe: float
) -> None:
    found = intervals(*np.array([[fault], [fault + delay], [emergency], [safe]]))
    assert found.fhti == found.fdti + found.frti
    assert found.fhti >= found.fdti >= 0.0
    assert found.frti >= 0.0
    assert found.eoti >= 0.0


@pytest.mark.parametrize("missing", ["fault", "detect"])
def test_without_fault_or_detection_nothing_is_handled(missing: str) -> None:
    given_times: dict[str, Any] = {"fault": 1.0, "detect": 1.2, "emergency": 1.5, "safe": 4.0}
    given_times[missing] = np.nan
    found = intervals(**{name: np.array([value]) for name, value in given_times.items()})
    assert np.isnan([found.fdti, found.fhti]).all()


def test_either_of_safe_state_and_emergency_operation_ends_the_reaction() -> None:
    none = np.nan
    times_of = np.array([[1.0, 1.2, none, 4.0], [1.0, 1.2, 1.5, none], [1.0, 1.2, none, none]])
    found = intervals(*times_of.T)
    assert found.frti[:2] == pytest.approx([2.8, 0.3])
    assert np.isnan(found.frti[2])
    assert np.isnan(found.eoti).all()


def test_alarm_is_a_confirmed_monitor_or_a_stale_channel_and_not_a_raw_monitor() -> None:
    monitors = np.zeros((1, 4, 3, 2), dtype=np.bool_)
    monitors[0, 1, 0, 0] = True
    monitors[0, 2, 1, 1] = True
    monitors[0, 0, 2, 1] = True
    reason = np.array([[1, 1, 1, REASON_STALENESS]])
    found = alarms(monitors, reason, ("one", "other", "mrm_stop"))
    assert np.argwhere(found[0]).tolist() == [[2, 1], [3, 2]]


def test_without_monitors_only_the_switch_gives_alarm() -> None:
    found = alarms(np.zeros((1, 2, 0, 2), dtype=np.bool_), np.array([[REASON_STALENESS, 1]]), ())
    assert found[0].tolist() == [[True], [False]]


def test_alarm_from_before_is_held_until_its_first_break() -> None:
    on = np.array([[0, 1, 1, 0, 1], [0, 0, 1, 1, 1], [1, 1, 1, 1, 1]], dtype=np.bool_)
    onset = np.array([2, 2, 0])
    held = held_since_before(on[..., np.newaxis], onset)[..., 0]
    assert np.flatnonzero(held[0, 2:]).tolist() == [0]
    assert not held[1].any()
    # Nothing is before the first row.
    assert not held[2].any()


def test_nobody_is_no_other_channel() -> None:
    assert others_act(np.array([0, 1, NO_CHANNEL]), 0).tolist() == [False, True, False]


def test_emergency_operation_is_another_channel_that_brakes_or_stands() -> None:
    acts = np.array([True, True, True, False])
    braking, speed = np.array([-4.0, 0.0, 0.0, -4.0]), np.array([9.0, 0, 9, 0])
    none = np.zeros(4, dtype=np.bool_)
    found = operates_in_emergency(acts, braking, speed, Degradation(none, none))
    assert found.tolist() == [True, True, False, False]
    found = operates_in_emergency(acts, braking, speed, Degradation(~none, none))
    assert found.tolist() == [True, True, True, False]
    found = operates_in_emergency(acts, braking, speed, Degradation(none, ~none))
    assert found.all()


def test_supervisor_lets_the_drive_go_on_where_it_has_an_alarm_and_asks_for_nothing() -> None:
    monitors = np.zeros((5, 3, 2), dtype=np.bool_)
    monitors[1, 1, 0] = monitors[2, 1] = monitors[2, 2, 1] = True
    monitors[3:, 0] = True
    found = degradation(monitors, ("one", "mrm_rest_area", "mrm_stop"))
    assert found.in_force.tolist() == [False, False, True, False, False]
    assert found.goes_on.tolist() == [False, False, False, True, True]


def test_mild_alarm_before_a_manoeuvre_is_asked_for_handles_nothing() -> None:
    monitors = np.zeros((2, 4, 2, 2), dtype=np.bool_)
    monitors[:, :, 0] = True
    monitors[0, 2, 1, 0] = True
    found = degradation(monitors, ("one", "mrm_stop"))
    assert found.goes_on.tolist() == [[False, False, False, True], [True, True, True, True]]


def test_monitors_without_a_supervisor_let_nothing_go_on() -> None:
    found = degradation(np.ones((2, 1, 2), dtype=np.bool_), ("one",))
    assert not found.in_force.any()
    assert not found.goes_on.any()


def test_first_row_from_another_on() -> None:
    flags = np.array([[1, 0, 1], [1, 0, 0]], dtype=np.bool_)
    assert first_from(flags, np.array([1, 1])).tolist() == [2, -1]
