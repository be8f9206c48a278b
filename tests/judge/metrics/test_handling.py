"""From a fault to the handover, to the safe state and to the place where the ego stands."""

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
from adeye.store.accounts import SINCE_FAULT
from tests.judge.conftest import HandMade, fsr, judge, rate_run


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    assert found.actor == (-1,)
    return float(found.value[0]), found.status[0], float(found.time[0])


def faulty(made: Any, *, rows: Any = slice(5, None)) -> Any:
    return made.set("fault_active", value=True, rows=rows, at=0)


def stopping(row: int) -> Any:
    """The ego stands from a row on."""
    return HandMade().ego(speed=np.where(np.arange(21) < row, 8.0, 0.0))


def taken_over(row: int, *, rows: Any = slice(5, None)) -> Any:
    """The safety channel acts from a row on."""
    return faulty(HandMade(), rows=rows).set("authority", 1, rows=slice(row, None))


def test_without_an_active_fault_nothing_applies() -> None:
    calm = stopping(10).set("authority", 1, rows=slice(8, None))
    for made in (calm, HandMade(faults=())):
        for column in ("fault_to_safe_state_s", "takeover_time_s", "distance_to_safe_state_m"):
            assert measure(made, column)[1] == "not_applicable", column


def test_safe_state_is_timed_from_the_first_onset_until_the_ego_stands_for_good() -> None:
    column, row = "fault_to_safe_state_s", np.arange(21)
    timed = (pytest.approx(0.9), "value", pytest.approx(1.4))
    assert measure(faulty(stopping(14)), column) == timed
    # A fault that has passed still counts.
    assert measure(faulty(stopping(14), rows=slice(5, 7)), column) == timed
    two = HandMade(faults=("a", "b")).ego(speed=np.where(row < 14, 8.0, 0.0))
    two.set("fault_active", value=True, rows=slice(9, None), at=0)
    two.set("fault_active", value=True, rows=slice(4, 6), at=1)
    assert measure(two, column)[0] == pytest.approx(1.0)
    # A safe state that is left again does not count.
    left = HandMade().ego(speed=np.where((row < 8) | (row == 15), 8.0, 0.0))
    assert measure(faulty(left), column)[0] == pytest.approx(1.1)
    standing = faulty(HandMade().ego(speed=0.0))
    assert measure(standing, column) == (0.0, "value", pytest.approx(0.5))
    assert handled(standing.trace()).safe.tolist() == [5]


def test_fault_of_the_first_row_is_one() -> None:
    found = measure(faulty(stopping(14), rows=slice(None)), "fault_to_safe_state_s")
    assert found == (pytest.approx(1.4), "value", pytest.approx(1.4))
    assert handled(faulty(stopping(14), rows=slice(None)).trace()).safe.tolist() == [14]


def test_safe_state_that_is_not_reached_or_not_known_has_no_time() -> None:
    unknown = faulty(stopping(14))
    unknown.columns["ego"][0, 2, 3] = np.nan
    for made, status in (
        (faulty(HandMade()), "incomplete"),
        (faulty(stopping(8)).touch(12, "lead"), "incomplete"),
        (unknown, "error"),
    ):
        assert measure(made, "fault_to_safe_state_s")[1] == status


def test_takeover_is_timed_from_the_onset() -> None:
    column = "takeover_time_s"
    timed = (pytest.approx(0.3), "value", pytest.approx(0.8))
    assert measure(taken_over(8), column) == timed
    # In the row of the onset, and from the first row on against the default channel.
    assert measure(taken_over(5), column)[:2] == (0.0, "value")
    assert measure(taken_over(0, rows=slice(None)), column)[:2] == (0.0, "value")
    # Time in which nobody acts belongs to it.
    nobody = faulty(HandMade()).set("authority", -1, rows=slice(6, 8))
    assert measure(nobody, column)[1] == "incomplete"
    assert measure(nobody.set("authority", 1, rows=slice(8, None)), column) == timed


def test_what_is_no_takeover_after_a_fault_has_no_time() -> None:
    begun = faulty(HandMade(), rows=slice(1, None)).set("authority", -1, rows=slice(0, 3))
    for why, made, status in (
        ("the default acts after the start-up", begun, "incomplete"),
        ("a handover before the fault", taken_over(3), "incomplete"),
        ("the last row decides nothing", faulty(HandMade(), rows=20), "not_applicable"),
    ):
        assert measure(made, "takeover_time_s")[1] == status, why


INTERVALS = (
    "fault_detection_time_s",
    "fault_reaction_time_s",
    "fault_handling_time_s",
    "emergency_operation_time_s",
)


def confirmed(made: Any, rows: slice) -> Any:
    made.columns["monitors"][:, rows, 0, 1] = True
    return made


def mastered() -> Any:
    """Fault at 0.5 s, detected at 0.7 s, emergency operation at 1.0 s, safe at 1.5 s."""
    made = confirmed(faulty(stopping(15)), slice(7, None))
    made.set("authority", 1, rows=slice(8, None))
    return made.set("command", -4.0, rows=slice(10, None), at=0)


def test_intervals_are_those_of_the_timeline() -> None:
    made = mastered()
    found = [measure(made, column) for column in INTERVALS]
    assert [value for value, _, _ in found] == pytest.approx([0.2, 0.3, 0.5, 0.5])
    assert [time for _, _, time in found] == pytest.approx([0.7, 1.0, 1.0, 1.5])
    read = timeline(made.trace(), 0, HandMade().trace(), 0)
    shown = [read.fdti_s, read.frti_s, read.fhti_s, read.emergency_operation_s]
    assert [value for value, _, _ in found] == shown


def test_metric_that_reads_which_faults_are_present_says_that_it_counts_from_one_on() -> None:
    made, calm = mastered(), mastered().set("fault_active", value=False)
    found = {
        name
        for name, metric in METRICS.items()
        if str(metric.compute(made.trace())) != str(metric.compute(calm.trace()))
    }
    assert found == {name for name, metric in METRICS.items() if metric.since_fault} == SINCE_FAULT


def test_intervals_are_open_as_far_as_nothing_ends_them() -> None:
    unknown = mastered()
    unknown.columns["ego"][0, 2, 3] = np.nan
    no, v, o, e = "not_applicable", "value", "incomplete", "error"
    scenes: dict[str, tuple[Any, list[str]]] = {
        "no fault": (confirmed(stopping(15), slice(7, None)), [no, no, no, no]),
        "undetected": (faulty(HandMade()), [o, o, o, o]),
        "detected and not handled": (confirmed(faulty(HandMade()), slice(7, None)), [v, o, o, o]),
        "safe without detection": (faulty(stopping(15)), [o, o, o, no]),
        "emergency operation that never ends": (mastered().ego(speed=8.0), [v, v, v, o]),
        "unknown speed": (unknown, [v, e, e, e]),
    }
    for why, (made, expected) in scenes.items():
        assert [measure(made, column)[1] for column in INTERVALS] == expected, why


def test_only_an_alarm_that_comes_after_the_fault_detects_it() -> None:
    column = "fault_detection_time_s"
    early = confirmed(faulty(HandMade()), slice(4, None))
    assert measure(early, column)[1] == "incomplete"
    again = confirmed(confirmed(faulty(HandMade()), slice(3, 7)), slice(9, None))
    assert measure(again, column)[0] == pytest.approx(0.4)
    # A second monitor does while the first one is held.
    second = confirmed(faulty(HandMade()), slice(3, None))
    second.set("reason", REASON_STALENESS, rows=slice(8, None))
    assert measure(second, column)[0] == pytest.approx(0.3)


def test_alarm_that_the_twin_has_too_detects_here_and_not_in_the_timeline() -> None:
    made, twin = (confirmed(item, slice(8, None)) for item in (faulty(HandMade()), HandMade()))
    assert measure(made, "fault_detection_time_s")[0] == pytest.approx(0.3)
    assert timeline(made.trace(), 0, twin.trace(), 0).detect_s is None


def test_every_run_of_a_batch_is_as_it_is_alone(hand_made: Any) -> None:
    made = hand_made(runs=3)
    made.columns["fault_active"][1:, 5:, 0] = True
    made.columns["monitors"][2, 7:, 0, 1] = True
    found = METRICS["fault_detection_time_s"].compute(made.trace())
    assert tuple(found.status) == ("not_applicable", "incomplete", "value")
    assert found.value[2] == pytest.approx(0.2)


def test_bound_is_kept_only_by_a_fault_that_is_handled_in_time() -> None:
    fast = mastered().set("command", -4.0, rows=slice(8, None), at=0)
    for made, most, verdict in (
        (HandMade(), 0.4, "VACUOUS"),
        (faulty(HandMade()), 0.4, "INCONCLUSIVE"),
        (mastered(), 0.4, "FAIL"),
        (fast, 0.4, "PASS"),
        # Contact does not reopen a handling time that is there.
        (mastered().touch(12, "lead"), 0.6, "PASS"),
    ):
        bound = MetricBound(metric="fault_handling_time_s", at_most=most)
        requirement = compile_requirement(fsr(bound=bound))
        [[judged]] = judge(made.trace(), [requirement], np.array([True])).judgements
        assert judged.verdict == verdict


def test_availability_takeovers_and_trips_are_those_of_decided_rows() -> None:
    late = HandMade().set("authority", 1, rows=slice(15, None))
    nobody = HandMade().set("authority", -1, rows=slice(0, 5))
    # A gap in between is no second takeover.
    twice = HandMade().set("authority", 1, rows=slice(3, 6))
    twice.set("authority", 1, rows=slice(9, 15)).set("authority", -1, rows=slice(11, 12))
    # An alarm and the takeover that follows it are one trip.
    alarmed = confirmed(HandMade(), slice(4, 8)).set("authority", 1, rows=slice(6, 12))
    last = confirmed(HandMade(), slice(20, None)).set("authority", 1, rows=slice(20, None))
    for column, made, value in (
        ("nominal_availability", HandMade(), 1.0),
        ("nominal_availability", late, pytest.approx(0.75)),
        ("nominal_availability", nobody, pytest.approx(0.75)),
        ("nominal_availability", last, 1.0),
        ("takeovers", HandMade(), 0.0),
        ("takeovers", HandMade().set("authority", 1), 1.0),
        ("takeovers", last, 0.0),
        ("trips", HandMade(), 0.0),
        ("trips", last, 0.0),
    ):
        assert measure(made, column)[:2] == (value, "value"), column
    assert measure(twice, "takeovers") == (2.0, "value", pytest.approx(0.3))
    assert measure(alarmed, "trips") == (1.0, "value", pytest.approx(0.4))
    assert measure(confirmed(alarmed, slice(15, 17)), "trips")[0] == 2.0


def test_way_to_the_safe_state_is_that_from_the_onset_along_the_curve() -> None:
    column = "distance_to_safe_state_m"
    made = faulty(stopping(14).ego(s=np.minimum(2.0 * np.arange(21), 2.0 * 13)))
    assert measure(made, column) == (pytest.approx(2.0 * (13 - 5)), "value", pytest.approx(1.4))
    bent = faulty(stopping(14))
    angle = 0.1 * np.minimum(np.arange(21), 14)
    bent.columns["ego"][0, :, 0], bent.columns["ego"][0, :, 1] = np.sin(angle), np.cos(angle)
    assert measure(bent, column)[0] == pytest.approx(9 * 2 * np.sin(0.05))
    assert measure(faulty(HandMade()), column)[1] == "incomplete"
    bent.columns["ego"][0, 8, 0] = np.nan
    assert measure(bent, column)[1] == "error"


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


def test_what_is_not_finite_is_never_a_good_place(hand_made: Any) -> None:
    for column, row, expected in (
        ("ego", 90, ["error", "error"]),
        ("ego_place", 90, ["error", "error"]),
        ("ego", 10, ["value", "error"]),
        ("objects", 30, ["value", "error"]),
        ("object_places", 10, ["value", "error"]),
        ("objects", 5, ["value", "value"]),
    ):
        made = stopped(hand_made)
        made.columns[column][0, row] = np.nan
        assert statuses_of_stop(made.trace()) == expected, column


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
