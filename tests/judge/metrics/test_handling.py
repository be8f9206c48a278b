"""From a fault to the handover, to the safe state and to the place where the ego stands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.judge.metrics.handling import decided_rows, default_channel, handled
from adeye.judge.requirements import compile_requirement
from adeye.judge.timeline import timeline
from adeye.signals import REASON_STALENESS
from adeye.spec.channels import SafetyChannel, SafetyParameters
from adeye.spec.concept import MetricBound
from tests.judge.conftest import fsr, judge, rate_run


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    assert found.actor == (-1,)
    return float(found.value[0]), found.status[0], float(found.time[0])


def faulty(made: Any, *, rows: Any = slice(5, None)) -> Any:
    return made.set("fault_active", value=True, rows=rows, at=0)


def stopping(made: Any, row: int) -> Any:
    """The ego stands from a row on."""
    return made.ego(speed=np.where(np.arange(21) < row, 8.0, 0.0))


@pytest.mark.parametrize(
    "column", ["fault_to_safe_state_s", "takeover_time_s", "distance_to_safe_state_m"]
)
def test_without_an_active_fault_nothing_applies(hand_made: Any, column: str) -> None:
    made = stopping(hand_made(), 10).set("authority", 1, rows=slice(8, None))
    assert measure(made, column)[1] == "not_applicable"


@pytest.mark.parametrize(
    "column", ["fault_to_safe_state_s", "takeover_time_s", "distance_to_safe_state_m"]
)
def test_entry_without_faults_does_not_apply(hand_made: Any, column: str) -> None:
    assert measure(hand_made(faults=()), column)[1] == "not_applicable"


def test_safe_state_is_timed_from_the_onset(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 14))
    assert measure(made, "fault_to_safe_state_s") == (
        pytest.approx(0.9),
        "value",
        pytest.approx(1.4),
    )


def test_fault_that_has_passed_still_counts(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 14), rows=slice(5, 7))
    assert measure(made, "fault_to_safe_state_s")[0] == pytest.approx(0.9)


def test_first_of_two_faults_counts(hand_made: Any) -> None:
    made = stopping(hand_made(faults=("a", "b")), 14)
    made.set("fault_active", value=True, rows=slice(9, None), at=0)
    made.set("fault_active", value=True, rows=slice(4, 6), at=1)
    assert measure(made, "fault_to_safe_state_s")[0] == pytest.approx(1.0)


def test_run_that_ends_before_the_safe_state_is_incomplete(hand_made: Any) -> None:
    assert measure(faulty(hand_made()), "fault_to_safe_state_s")[1] == "incomplete"


def test_safe_state_that_is_left_again_does_not_count(hand_made: Any) -> None:
    row = np.arange(21)
    made = faulty(hand_made().ego(speed=np.where((row < 8) | (row == 15), 8.0, 0.0)))
    assert measure(made, "fault_to_safe_state_s")[0] == pytest.approx(1.1)


def test_ego_that_stands_all_the_time_is_safe_at_once(hand_made: Any) -> None:
    made = faulty(hand_made().ego(speed=0.0))
    assert measure(made, "fault_to_safe_state_s") == (0.0, "value", pytest.approx(0.5))


def test_contact_after_the_fault_leaves_it_incomplete(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 8)).touch(12, "lead")
    assert measure(made, "fault_to_safe_state_s")[1] == "incomplete"


def test_unknown_speed_is_an_error(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 14))
    made.columns["ego"][0, 2, 3] = np.nan
    assert measure(made, "fault_to_safe_state_s")[1] == "error"


def test_takeover_is_timed_from_the_onset(hand_made: Any) -> None:
    made = faulty(hand_made()).set("authority", 1, rows=slice(8, None))
    assert measure(made, "takeover_time_s") == (pytest.approx(0.3), "value", pytest.approx(0.8))


def test_takeover_in_the_row_of_the_onset_takes_no_time(hand_made: Any) -> None:
    made = faulty(hand_made()).set("authority", 1, rows=slice(5, None))
    assert measure(made, "takeover_time_s")[:2] == (0.0, "value")


def test_takeover_from_the_first_row_is_seen_against_the_default_channel(hand_made: Any) -> None:
    made = faulty(hand_made(), rows=slice(None)).set("authority", 1)
    assert measure(made, "takeover_time_s")[:2] == (0.0, "value")


def test_time_in_which_nobody_acts_belongs_to_the_takeover(hand_made: Any) -> None:
    made = faulty(hand_made()).set("authority", -1, rows=slice(6, 8))
    assert measure(made, "takeover_time_s")[1] == "incomplete"
    made.set("authority", 1, rows=slice(8, None))
    assert measure(made, "takeover_time_s") == (pytest.approx(0.3), "value", pytest.approx(0.8))


def test_default_that_acts_after_the_start_up_has_taken_nothing_over(hand_made: Any) -> None:
    made = faulty(hand_made(), rows=slice(1, None)).set("authority", -1, rows=slice(0, 3))
    assert measure(made, "takeover_time_s")[1] == "incomplete"


def test_handover_before_the_fault_does_not_count(hand_made: Any) -> None:
    made = faulty(hand_made()).set("authority", 1, rows=slice(3, None))
    assert measure(made, "takeover_time_s")[1] == "incomplete"


def test_fault_in_the_last_row_decides_nothing(hand_made: Any) -> None:
    made = faulty(hand_made(), rows=20)
    assert measure(made, "takeover_time_s")[1] == "not_applicable"


INTERVALS = (
    "fault_detection_time_s",
    "fault_reaction_time_s",
    "fault_handling_time_s",
    "emergency_operation_time_s",
)


def confirmed(made: Any, rows: slice) -> Any:
    made.columns["monitors"][:, rows, 0, 1] = True
    return made


def mastered(hand_made: Any) -> Any:
    """Fault at 0.5 s, detected at 0.7 s, emergency operation at 1.0 s, safe at 1.5 s."""
    made = confirmed(stopping(faulty(hand_made()), 15), slice(7, None))
    made.set("authority", 1, rows=slice(8, None))
    return made.set("command", -4.0, rows=slice(10, None), at=0)


def statuses(made: Any) -> list[str]:
    return [measure(made, column)[1] for column in INTERVALS]


def test_intervals_are_those_of_the_timeline(hand_made: Any) -> None:
    made = mastered(hand_made)
    found = [measure(made, column) for column in INTERVALS]
    assert [value for value, _, _ in found] == pytest.approx([0.2, 0.3, 0.5, 0.5])
    assert [time for _, _, time in found] == pytest.approx([0.7, 1.0, 1.0, 1.5])
    read = timeline(made.trace(), 0, hand_made().trace(), 0)
    shown = [read.fdti_s, read.frti_s, read.fhti_s, read.emergency_operation_s]
    assert [value for value, _, _ in found] == shown


def test_without_a_fault_no_interval_applies(hand_made: Any) -> None:
    made = confirmed(stopping(hand_made(), 15), slice(7, None))
    assert statuses(made) == ["not_applicable"] * 4


def test_undetected_fault_leaves_every_interval_open(hand_made: Any) -> None:
    assert statuses(faulty(hand_made())) == ["incomplete"] * 4


def test_detected_fault_that_nobody_handles_leaves_the_reaction_open(hand_made: Any) -> None:
    made = confirmed(faulty(hand_made()), slice(7, None))
    assert statuses(made) == ["value", "incomplete", "incomplete", "incomplete"]


def test_safe_state_without_detection_handles_nothing(hand_made: Any) -> None:
    found = statuses(stopping(faulty(hand_made()), 15))
    assert found == ["incomplete", "incomplete", "incomplete", "not_applicable"]


def test_emergency_operation_that_never_ends_is_incomplete(hand_made: Any) -> None:
    made = mastered(hand_made).ego(speed=8.0)
    assert statuses(made) == ["value", "value", "value", "incomplete"]


def test_alarm_from_before_the_fault_detects_nothing(hand_made: Any) -> None:
    made = confirmed(faulty(hand_made()), slice(4, None))
    assert measure(made, "fault_detection_time_s")[1] == "incomplete"


def test_alarm_from_before_that_ends_and_comes_again_detects(hand_made: Any) -> None:
    made = confirmed(confirmed(faulty(hand_made()), slice(3, 7)), slice(9, None))
    assert measure(made, "fault_detection_time_s")[0] == pytest.approx(0.4)


def test_second_monitor_detects_while_the_first_is_held(hand_made: Any) -> None:
    made = confirmed(faulty(hand_made()), slice(3, None))
    made.set("reason", REASON_STALENESS, rows=slice(8, None))
    assert measure(made, "fault_detection_time_s")[0] == pytest.approx(0.3)


def test_alarm_that_the_twin_has_too_detects_here_and_not_in_the_timeline(hand_made: Any) -> None:
    made, twin = (confirmed(item, slice(8, None)) for item in (faulty(hand_made()), hand_made()))
    assert measure(made, "fault_detection_time_s")[0] == pytest.approx(0.3)
    assert timeline(made.trace(), 0, twin.trace(), 0).detect_s is None


def test_unknown_speed_is_an_error_of_what_needs_the_safe_state(hand_made: Any) -> None:
    made = mastered(hand_made)
    made.columns["ego"][0, 2, 3] = np.nan
    assert statuses(made) == ["value", "error", "error", "error"]


def test_every_run_of_a_batch_is_as_it_is_alone(hand_made: Any) -> None:
    made = hand_made(runs=3)
    made.columns["fault_active"][1:, 5:, 0] = True
    made.columns["monitors"][2, 7:, 0, 1] = True
    found = METRICS["fault_detection_time_s"].compute(made.trace())
    assert tuple(found.status) == ("not_applicable", "incomplete", "value")
    assert found.value[2] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("status", "verdict"),
    [("none", "VACUOUS"), ("undetected", "INCONCLUSIVE"), ("slow", "FAIL"), ("fast", "PASS")],
)
def test_bound_is_kept_only_by_a_fault_that_is_handled_in_time(
    hand_made: Any, status: str, verdict: str
) -> None:
    made = {
        "none": hand_made(),
        "undetected": faulty(hand_made()),
        "slow": mastered(hand_made),
        "fast": mastered(hand_made).set("command", -4.0, rows=slice(8, None), at=0),
    }[status]
    bound = MetricBound(metric="fault_handling_time_s", at_most=0.4)
    [[judged]] = judge(
        made.trace(), [compile_requirement(fsr(bound=bound))], np.array([True])
    ).judgements
    assert judged.verdict == verdict


def test_contact_does_not_reopen_a_handling_time_that_is_there(hand_made: Any) -> None:
    made = mastered(hand_made).touch(12, "lead")
    bound = MetricBound(metric="fault_handling_time_s", at_most=0.6)
    [[judged]] = judge(
        made.trace(), [compile_requirement(fsr(bound=bound))], np.array([True])
    ).judgements
    assert judged.verdict == "PASS"


def test_availability_is_the_share_of_time_of_the_default_channel(hand_made: Any) -> None:
    made = hand_made().set("authority", 1, rows=slice(15, None))
    assert measure(made, "nominal_availability")[:2] == (pytest.approx(0.75), "value")
    assert measure(hand_made(), "nominal_availability")[:2] == (1.0, "value")


def test_time_in_which_nobody_acts_is_not_available(hand_made: Any) -> None:
    made = hand_made().set("authority", -1, rows=slice(0, 5))
    assert measure(made, "nominal_availability")[0] == pytest.approx(0.75)


def test_takeovers_are_counted_and_a_gap_in_between_is_none(hand_made: Any) -> None:
    made = hand_made().set("authority", 1, rows=slice(3, 6))
    made.set("authority", 1, rows=slice(9, 15)).set("authority", -1, rows=slice(11, 12))
    assert measure(made, "takeovers") == (2.0, "value", pytest.approx(0.3))
    assert measure(hand_made(), "takeovers")[:2] == (0.0, "value")


def test_authority_from_the_first_row_is_a_takeover(hand_made: Any) -> None:
    assert measure(hand_made().set("authority", 1), "takeovers")[:2] == (1.0, "value")


def test_alarm_and_the_takeover_that_follows_it_are_one_trip(hand_made: Any) -> None:
    made = confirmed(hand_made(), slice(4, 8)).set("authority", 1, rows=slice(6, 12))
    assert measure(made, "trips") == (1.0, "value", pytest.approx(0.4))
    assert measure(confirmed(made, slice(15, 17)), "trips")[0] == 2.0
    assert measure(hand_made(), "trips")[:2] == (0.0, "value")


def test_last_row_decides_nothing(hand_made: Any) -> None:
    made = confirmed(hand_made(), slice(20, None)).set("authority", 1, rows=slice(20, None))
    for column, value in (("trips", 0.0), ("takeovers", 0.0), ("nominal_availability", 1.0)):
        assert measure(made, column)[0] == value


def test_way_to_the_safe_state_is_that_from_the_onset(hand_made: Any) -> None:
    s = np.minimum(2.0 * np.arange(21), 2.0 * 13)
    made = faulty(stopping(hand_made(), 14).ego(s=s))
    assert measure(made, "distance_to_safe_state_m") == (
        pytest.approx(2.0 * (13 - 5)),
        "value",
        pytest.approx(1.4),
    )


def test_way_along_a_curve_is_longer_than_the_chord(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 14))
    angle = 0.1 * np.minimum(np.arange(21), 14)
    made.columns["ego"][0, :, 0], made.columns["ego"][0, :, 1] = np.sin(angle), np.cos(angle)
    assert measure(made, "distance_to_safe_state_m")[0] == pytest.approx(9 * 2 * np.sin(0.05))


def test_way_of_a_run_that_never_is_safe_is_incomplete(hand_made: Any) -> None:
    assert measure(faulty(hand_made()), "distance_to_safe_state_m")[1] == "incomplete"


def test_way_through_an_unknown_place_is_an_error(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 14))
    made.columns["ego"][0, 8, 0] = np.nan
    assert measure(made, "distance_to_safe_state_m")[1] == "error"


def test_rows_of_a_run_whose_fault_is_handled(hand_made: Any) -> None:
    made = hand_made(runs=2).ego(1, speed=np.where(np.arange(21) < 15, 8.0, 0.0))
    made.columns["fault_active"][1, 5:, 0] = True
    made.columns["monitors"][1, 7:, 0, 1] = True
    made.columns["authority"][1, 8:] = 1
    made.columns["command"][1, 10:, 0] = -4.0
    found = handled(made.trace())
    assert (found.fault.tolist(), found.detect.tolist()) == ([-1, 5], [-1, 7])
    assert (found.emergency.tolist(), found.safe.tolist()) == ([-1, 10], [-1, 15])
    assert not found.is_unknown.any()
    assert np.isnan(found.intervals.fhti[0])


def test_ego_that_stands_already_is_safe_from_the_fault_on(hand_made: Any) -> None:
    made = hand_made().ego(speed=0.0).set("fault_active", value=True, rows=slice(5, None), at=0)
    assert handled(made.trace()).safe.tolist() == [5]


def test_last_row_of_a_run_decides_nothing(hand_made: Any) -> None:
    trace = hand_made().trace()
    assert decided_rows(trace)[0].tolist() == [True] * 20 + [False]
    assert default_channel(trace) == 0


SLOW, MIDDLE = 1.75, 5.25
BOTH = ("stop_rating", "stop_regret")


def stopped(make: Any, d: float = SLOW, *, fault: bool = True, **arguments: Any) -> Any:
    """Let the ego stop with 4 m/s² from 20 m/s after 1 s, where the fault begins."""
    made = make(rows=91, **arguments).object("lead", d=8.75)
    braking = np.clip(made.time - 1.0, 0.0, 5.0)
    way = 20.0 * np.minimum(made.time, 1.0) + 20.0 * braking - 2.0 * braking * braking
    made.ego(s=way, speed=20.0 - 4.0 * braking, d=d)
    return made.set("fault_active", value=True, rows=slice(10, 90)) if fault else made


def with_shoulder(made: Any, width: float) -> Any:
    trace = made.trace()
    trace.layout.context.road.shoulder[:] = width
    return trace


def measured(trace: Any, run: int = 0) -> list[tuple[str, float]]:
    found = [METRICS[name].compute(trace) for name in BOTH]
    return [(column.status[run], float(column.value[run])) for column in found]


def statuses_of_stop(trace: Any) -> list[str]:
    return [status for status, _ in measured(trace)]


def test_stop_in_the_slow_lane_beside_a_free_shoulder_is_regretted(hand_made: Any) -> None:
    assert measured(with_shoulder(stopped(hand_made), 2.5)) == [("value", 3.0), ("value", 2.0)]
    assert measured(with_shoulder(stopped(hand_made), 0.0)) == [("value", 3.0), ("value", 0.0)]


def test_who_drives_on_has_no_place(hand_made: Any) -> None:
    made = hand_made().set("fault_active", value=True, rows=slice(5, 20))
    assert statuses_of_stop(made.trace()) == ["not_applicable", "not_applicable"]


def test_who_creeps_no_faster_than_standstill_stands(hand_made: Any) -> None:
    made = stopped(hand_made)
    made.columns["ego"][0, 90, 3] = 0.04
    assert statuses_of_stop(made.trace()) == ["value", "value"]
    made.columns["ego"][0, 90, 3] = 0.06
    assert statuses_of_stop(made.trace()) == ["not_applicable", "not_applicable"]


def test_without_a_fault_nothing_is_regretted(hand_made: Any) -> None:
    assert statuses_of_stop(stopped(hand_made, fault=False).trace()) == ["value", "not_applicable"]


def test_contact_is_rated_worst_with_its_time_and_actor(hand_made: Any) -> None:
    trace = with_shoulder(stopped(hand_made).touch(40, "lead"), 2.5)
    assert measured(trace) == [("value", 8.0), ("value", 7.0)]
    for name in BOTH:
        column = METRICS[name].compute(trace)
        assert (column.time[0], column.actor[0]) == (pytest.approx(4.0), 0)


@pytest.mark.parametrize(
    ("column", "row", "expected"),
    [
        ("ego", 90, ["error", "error"]),
        ("ego_place", 90, ["error", "error"]),
        ("ego", 10, ["value", "error"]),
        ("objects", 30, ["value", "error"]),
        ("object_places", 10, ["value", "error"]),
        ("objects", 5, ["value", "value"]),
    ],
)
def test_what_is_not_finite_is_never_a_good_place(
    hand_made: Any, column: str, row: int, expected: list[str]
) -> None:
    made = stopped(hand_made)
    made.columns[column][0, row] = np.nan
    assert statuses_of_stop(made.trace()) == expected


def test_each_run_is_rated_by_its_own_architecture_and_as_by_itself(hand_made: Any) -> None:
    made = stopped(hand_made, runs=3)
    made.columns["ego"][1, 90, 3] = 5.0
    trace = with_shoulder(made, 2.5)
    ratings = {"stop": "planned", "ratings": {"slow_lane_in_sight": 0, "hard_shoulder": 2}}
    parameters = SafetyParameters.model_validate(ratings)
    channel = SafetyChannel(
        kind="safety", links=("channels.nominal",), rate="20 Hz", parameters=parameters
    )
    first = trace.layout.architecture
    other = first.model_copy(update={"channels": {"safety": channel}})
    mixed = replace(trace, layout=replace(trace.layout, architectures=(first, first, other)))
    rows = [measured(mixed, run) for run in range(3)]
    assert rows[0] == [("value", 3.0), ("value", 2.0)]
    assert [status for status, _ in rows[1]] == ["not_applicable"] * 2
    assert rows[2] == [("value", 0.0), ("value", 0.0)]
    for run in (0, 2):
        assert measured(mixed.select([run])) == rows[run]
        quality = rate_run(mixed, run)
        assert [quality.achieved, quality.regret] == [value for _, value in rows[run]]
