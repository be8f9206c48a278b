"""The monitors of the stop in the lane: when each is raised, and when it is confirmed."""

from typing import Any

import numpy as np
import pytest

from adeye.kernel.stops import ONSET_JERK
from adeye.signals import FAULT, OK, SILENT, Floats, parameter_record
from adeye.simulate.channels.driving import HOLD_DECELERATION
from adeye.simulate.channels.safety import in_lane

RECORD = parameter_record(
    {
        "staleness": [0.2],
        "max_command": 10.0,
        "max_steering_angle": 0.6,
        "danger_threshold": 4.5,
        "max_lane_offset": 1.0,
        "lane_width": 3.5,
        "lanes": 3,
        "confirm_ticks": 2,
        "heal_ticks": 3,
    }
)[0]


def evidence(**changes: float) -> Floats:
    seen = np.zeros(in_lane.EVIDENCE_WIDTH)
    columns = {
        "channels": in_lane.SEEN_CHANNELS,
        "heard": in_lane.SEEN_HEARD,
        "time": in_lane.SEEN_TIME,
        "status": in_lane.SEEN_STATUS,
        "age": in_lane.SEEN_AGE,
        "acceleration": in_lane.SEEN_ACCELERATION,
        "steering": in_lane.SEEN_STEERING,
        "pose": in_lane.SEEN_POSE,
        "required": in_lane.SEEN_REQUIRED,
        "offset": in_lane.SEEN_OFFSET,
        "d": in_lane.SEEN_D,
    }
    defaults = {"channels": 1.0, "heard": 1.0, "time": 1.0, "pose": 1.0, "d": 5.25}
    for name, value in (defaults | changes).items():
        seen[columns[name]] = value
    return seen


NAN, INF = float("nan"), float("inf")
FIRES: dict[Any, list[tuple[dict[str, float], bool]]] = {
    in_lane.nominal_silent: [
        ({"status": 1.0}, True),
        ({"age": 0.2}, False),
        ({"age": 0.21}, True),
        ({"age": NAN}, True),
        ({"heard": 0.0, "time": 0.2}, False),
        ({"heard": 0.0, "time": 0.25}, True),
        ({"channels": 0.0, "status": 1.0, "age": 9.0, "heard": 0.0}, False),
    ],
    in_lane.nominal_implausible: [
        ({"acceleration": 10.0}, False),
        ({"acceleration": 10.1}, True),
        ({"acceleration": NAN}, True),
        ({"acceleration": INF}, True),
        ({"steering": 0.6}, False),
        ({"steering": 0.61}, True),
        ({"channels": 0.0, "acceleration": NAN}, False),
    ],
    in_lane.object_danger: [
        ({"required": 4.49}, False),
        ({"required": 4.5}, True),
        ({"required": INF}, True),
        ({"required": NAN}, True),
        ({"required": INF, "pose": 0.0}, False),
    ],
    in_lane.lane_departure: [
        ({"offset": 1.0}, False),
        ({"offset": -1.01}, True),
        ({"offset": NAN}, True),
        ({"d": -0.1}, True),
        ({"d": 10.6}, True),
        ({"offset": 2.0, "pose": 0.0}, False),
    ],
}


def test_monitor_fires_beyond_its_threshold_and_where_it_knows_no_number() -> None:
    for monitor, cases in FIRES.items():
        assert not monitor(RECORD, evidence())
        for changes, fires in cases:
            assert monitor(RECORD, evidence(**changes)) is fires, changes


def confirmed_after(pattern: str, confirm: int, heal: int) -> str:
    """Feed a pattern of x (fires) and . (rests); mark the ticks at which it is confirmed."""
    state = np.zeros(2, dtype=np.int64)
    marks = ""
    for mark in pattern:
        in_lane.debounce(state, mark == "x", confirm, heal)
        marks += "C" if state[1] else "."
    return marks


def test_debounce_counts_and_saturates() -> None:
    for pattern, confirm, heal, marks in (
        ("x", 0, 0, "C"),
        ("x.", 0, 0, "C."),
        ("xxxx", 2, 3, "..CC"),
        ("xx.xx.", 2, 3, "....CC"),
        ("x.x.x.", 2, 3, "......"),
        ("xxx....", 2, 3, "..CCCC."),
        ("xxx..x....", 2, 3, "..CCCCCC.."),
        ("xxxxxxxxx....", 2, 3, "..CCCCCCCCCC."),
    ):
        assert confirmed_after(pattern, confirm, heal)[: len(marks)] == marks, pattern


@pytest.mark.slow
def test_confirmed_monitor_is_shown_beside_its_raw_state() -> None:
    states = np.zeros((len(in_lane.MONITOR_IDS), in_lane.STATE_WIDTH), dtype=np.int64)
    shown = np.zeros((len(in_lane.MONITOR_IDS), 2), dtype=np.bool_)
    danger = in_lane.MONITOR_IDS.index("object_danger")
    results = [
        in_lane.run_monitors(RECORD, evidence(required=9.0), states, shown) for _ in range(3)
    ]
    assert results == [False, False, True]
    assert shown[danger].tolist() == [True, True]
    assert not in_lane.run_monitors(RECORD, evidence(), np.zeros_like(states), shown)
    assert shown[danger].tolist() == [False, False]


@pytest.mark.parametrize("before", [0, 2, 5])
def test_frozen_monitors_show_what_they_showed_and_go_on_from_there(before: int) -> None:
    states = np.zeros((len(in_lane.MONITOR_IDS), in_lane.STATE_WIDTH), dtype=np.int64)
    shown = np.zeros((len(in_lane.MONITOR_IDS), 2), dtype=np.bool_)
    for _ in range(before):
        in_lane.run_monitors(RECORD, evidence(required=9.0), states, shown)
    last = shown.copy()
    states[:, in_lane.STATE_FROZEN] = 1
    kept = states.copy()
    for required in (0.0, 9.0, 9.0, 9.0, 9.0, 0.0, 0.0):
        confirmed = in_lane.run_monitors(RECORD, evidence(required=required), states, shown)
        assert confirmed == last[:, 1].any()
        assert shown.tolist() == last.tolist()
        assert states.tolist() == kept.tolist()
    states[:, in_lane.STATE_FROZEN] = 0
    other = states.copy()
    assert in_lane.run_monitors(RECORD, evidence(required=9.0), states, shown) == (before >= 2)
    assert not np.array_equal(states, other) or before == 5


def gathered(*rows: tuple[float, float, float, int], heard: bool = True) -> Floats:
    seen = np.zeros(in_lane.EVIDENCE_WIDTH)
    in_lane.gather_commands(
        1.0,
        np.array([row[:3] for row in rows], dtype=np.float64).reshape(-1, 3),
        np.array([row[3] for row in rows], dtype=np.int64),
        np.full(len(rows), heard),
        seen,
    )
    return seen


@pytest.mark.slow
def test_worst_of_the_linked_channels_counts() -> None:
    seen = gathered((1.0, 0.1, 0.9, OK), (-3.0, -0.2, 0.6, FAULT))
    assert seen[[in_lane.SEEN_CHANNELS, in_lane.SEEN_STATUS]].tolist() == [2.0, 1.0]
    assert seen[in_lane.SEEN_AGE] == pytest.approx(0.4)
    assert seen[[in_lane.SEEN_ACCELERATION, in_lane.SEEN_STEERING]].tolist() == [3.0, 0.2]


def test_number_that_is_none_is_not_hidden_by_others() -> None:
    none, some = (np.nan, 0.0, 1.0, OK), (9.0, 0.0, 1.0, OK)
    assert np.isnan(gathered(none, some)[in_lane.SEEN_ACCELERATION])
    assert np.isnan(gathered(some, none)[in_lane.SEEN_ACCELERATION])


def test_channel_without_first_command_is_not_heard_and_nothing_linked_is_none() -> None:
    assert gathered((0.0, 0.0, -1.0, SILENT), heard=False)[in_lane.SEEN_HEARD] == 0.0
    assert gathered((0.0, 0.0, 1.0, OK), heard=False)[in_lane.SEEN_HEARD] == 1.0
    assert gathered()[in_lane.SEEN_CHANNELS] == 0.0


STEP = 0.05
RECORD_STOP = parameter_record(
    {"stop_deceleration": [4.0], "emergency_deceleration": 8.0, "period": STEP}
)[0]


def stop(ticks: int, required: float) -> list[float]:
    accelerations = [0.0]
    for _ in range(ticks):
        accelerations.append(
            in_lane.stop_acceleration(
                RECORD_STOP, accelerations[-1], 20.0, required, is_danger=True
            )
        )
    return accelerations[1:]


def test_stop_builds_up_at_the_onset_jerk_to_the_stop_deceleration() -> None:
    ramp = stop(10, 0.0)
    assert ramp[:3] == pytest.approx([-ONSET_JERK * STEP * k for k in (1, 2, 3)])
    assert ramp[-1] == -4.0


def test_object_ahead_is_braked_for_at_once_with_a_reserve_up_to_the_emergency() -> None:
    for ticks, required, expected in (
        (1, 5.0, -5.0),
        (3, 5.0, -6.0),
        (3, 50.0, -8.0),
        (3, INF, -8.0),
    ):
        assert stop(ticks, required)[-1] == pytest.approx(expected)


def test_braking_is_not_taken_back_before_standstill_where_the_ego_is_held() -> None:
    for speed, expected in ((10.0, -7.0), (0.0, -HOLD_DECELERATION)):
        found = in_lane.stop_acceleration(RECORD_STOP, -7.0, speed, 0.0, is_danger=True)
        assert found == expected


def test_healed_danger_leaves_the_stop_its_own_deceleration() -> None:
    acceleration = -7.0
    for _ in range(40):
        acceleration = in_lane.stop_acceleration(
            RECORD_STOP, acceleration, 10.0, 0.0, is_danger=False
        )
    assert acceleration == -RECORD_STOP["stop_deceleration"]
