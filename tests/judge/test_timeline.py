"""What follows a fault as times, and injected faults counted."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.judge.timeline import (
    CLASSES,
    Injection,
    Timeline,
    classify_injection,
    count_injections,
    tabulate,
    timeline,
    violation_s,
    worst_of,
)
from adeye.signals import REASON_STALENESS
from tests.refusals import refused

ONSET = 5


def faulty(hand_made: Any) -> Any:
    """A run whose fault is present from row 5 on, at 0.5 s."""
    return hand_made().set("fault_active", value=True, rows=slice(ONSET, None), at=0)


def read(made: Any, twin: Any) -> Timeline:
    return timeline(made.trace(), 0, twin.trace(), 0)


def confirmed(made: Any, row: int) -> Any:
    """The monitor is confirmed from a row on."""
    made.columns["monitors"][:, row:, 0, 1] = True
    return made


def taken_over(made: Any, row: int) -> Any:
    """The safety channel acts from a row on, and brakes."""
    confirmed(made, row).set("authority", 1, rows=slice(row, None))
    return made.set("command", -4.0, rows=slice(row, None), at=0)


def test_fault_that_is_never_present_is_not_activated(hand_made: Any) -> None:
    found = read(hand_made(), hand_made())
    assert found == Timeline(None)
    assert classify_injection(found, 1.0) == "not_activated"


@pytest.mark.parametrize(("row", "expected"), [(15, "detected_in_time"), (16, "not_activated")])
def test_fault_in_the_tail_is_not_detected_in_time(hand_made: Any, row: int, expected: str) -> None:
    made = hand_made().set("fault_active", value=True, rows=slice(row, None), at=0)
    found = read(taken_over(made, 17), hand_made())
    assert classify_injection(found, None) == expected


def test_fault_of_the_first_row_is_present_from_there(hand_made: Any) -> None:
    made = hand_made().set("fault_active", value=True, rows=slice(0, 1), at=0)
    assert read(made, hand_made()).fault_s == 0.0


def test_fault_that_changes_no_bit_is_not_activated(hand_made: Any) -> None:
    found = read(faulty(hand_made), hand_made())
    assert found.fault_s == pytest.approx(0.5)
    assert found.effect_s is None
    assert classify_injection(found, 1.0) == "not_activated"


def test_effect_that_the_ego_never_shows_is_masked(hand_made: Any) -> None:
    made = faulty(hand_made).set("sensor_alive", value=False, rows=slice(7, 9), at=0)
    found = read(made, hand_made())
    assert found.effect_s == pytest.approx(0.7)
    assert found.deviation_s is None
    assert classify_injection(found, None) == "masked"


def test_takeover_within_the_ftti_is_detected_in_time(hand_made: Any) -> None:
    found = read(taken_over(faulty(hand_made), 8), hand_made())
    assert found.fdti_s == pytest.approx(0.3)
    assert (found.detect_s, found.switch_s, found.brake_s, found.emergency_s) == pytest.approx(
        (0.8, 0.8, 0.8, 0.8)
    )
    assert (found.frti_s, found.fhti_s) == pytest.approx((0.0, 0.3))
    assert found.fhti_s is not None
    # Handling that takes as long as the FTTI is late.
    for ftti, class_ in (
        (0.4, "detected_in_time"),
        (None, "detected_in_time"),
        (found.fhti_s, "detected_late"),
    ):
        assert classify_injection(found, ftti) == class_


def test_without_reaction_or_detection_it_is_late_latent_or_a_violation(hand_made: Any) -> None:
    deviating = faulty(hand_made).set("command", 0.3, rows=slice(9, None), at=0)
    for made, time, value, class_ in (
        (confirmed(faulty(hand_made), 8), "fdti_s", 0.3, "detected_late"),
        (taken_over(faulty(hand_made), 8).touch(12, "lead"), "violation_s", 1.2, "detected_late"),
        (deviating, "deviation_s", 0.9, "undetected_no_violation"),
        (
            faulty(hand_made).touch(12, "lead"),
            "fault_to_violation_s",
            0.7,
            "undetected_violation",
        ),
    ):
        found = read(made, hand_made())
        assert getattr(found, time) == pytest.approx(value)
        assert classify_injection(found, None) == class_
    found = read(confirmed(faulty(hand_made), 8), hand_made())
    assert (found.frti_s, found.fhti_s) == (None, None)


def test_monitor_that_the_twin_confirms_too_is_no_detection(hand_made: Any) -> None:
    made = confirmed(faulty(hand_made), 8)
    twin = confirmed(hand_made(), 8)
    assert read(made, twin).detect_s is None


def test_stale_channel_is_detected_by_the_switch(hand_made: Any) -> None:
    made = faulty(hand_made).set("reason", REASON_STALENESS, rows=slice(10, None))
    assert read(made, hand_made()).detect_s == pytest.approx(1.0)


def test_reaction_ends_at_emergency_operation_before_the_safe_state(hand_made: Any) -> None:
    made = confirmed(faulty(hand_made), 6)
    made.set("authority", 1, rows=slice(8, None)).set("command", -4.0, rows=slice(10, None), at=0)
    made.ego(speed=np.where(np.arange(21) < 15, 8.0, 0.0))
    found = read(made, hand_made())
    assert (found.switch_s, found.emergency_s, found.safe_s) == pytest.approx((0.8, 1.0, 1.5))
    assert (found.fdti_s, found.frti_s, found.fhti_s) == pytest.approx((0.1, 0.4, 0.5))
    assert found.emergency_operation_s == pytest.approx(0.5)


def test_braking_that_the_twin_does_too_is_no_reaction(hand_made: Any) -> None:
    made = faulty(hand_made).set("command", -4.0, rows=slice(6, None), at=0)
    twin = hand_made().set("command", -4.0, rows=slice(9, None), at=0)
    assert read(made, twin).brake_s == pytest.approx(0.6)
    assert read(made, made).brake_s is None


def test_what_happened_before_the_fault_is_not_its_effect(hand_made: Any) -> None:
    made = faulty(hand_made).set("command", 0.3, rows=slice(0, 3), at=0)
    found = read(made, hand_made())
    assert (found.effect_s, found.deviation_s) == (None, None)


def test_ego_beside_the_road_or_nowhere_violates(hand_made: Any) -> None:
    assert violation_s(hand_made().trace(), 0) is None
    for place in (-2.5, np.nan):
        made = hand_made().ego(d=np.where(np.arange(21) < 13, 5.25, place))
        assert violation_s(made.trace(), 0) == pytest.approx(1.3)


def test_runs_of_another_clock_are_no_twins(hand_made: Any) -> None:
    one, two = hand_made().trace(), hand_made(step=0.05).trace()
    refused(ValueError, timeline, one, 0, two, 0, says="no twin")


def injection(class_: str, violation: float | None = None, run: str = "ab") -> Injection:
    off = Timeline(1.0, violation_s=violation)
    return Injection(run, "cut_in", "new", "out", off, off, None, class_)  # type: ignore[arg-type]


def handled(after: float, violation: float, run: str) -> Injection:
    """Detected at once and handled some time after the fault; without, it violates at a time."""
    times = Timeline(1.0, 1.0, detect_s=1.0, emergency_s=1.0 + after)
    off = Timeline(1.0, violation_s=violation)
    return Injection(run, "cut_in", "new", "out", times, off, None, "detected_in_time")


def test_random_sample_has_an_interval_without_what_was_not_activated() -> None:
    group = [injection("detected_in_time")] * 3 + [injection("masked"), injection("not_activated")]
    found = count_injections(group, is_sample=True)
    assert (found.detected, found.activated) == (3, 4)
    assert found.coverage is not None
    assert found.coverage.low < 0.75 < found.coverage.high
    assert count_injections([injection("not_activated")], is_sample=True).coverage is None
    assert count_injections(group, is_sample=False).coverage is None


def test_least_ftti_is_that_of_the_worst_run() -> None:
    group = [injection("masked", 4.0), injection("masked", 2.5), injection("masked")]
    assert count_injections(group, is_sample=False).least_ftti_s == pytest.approx(1.5)


def test_twin_that_violates_without_the_fault_tells_nothing_of_how_long_the_fault_may_last() -> (
    None
):
    anyway = replace(injection("masked", 1.5), fault_free_violation_s=1.4)
    assert anyway.ftti_s == pytest.approx(0.5)
    group = [injection("masked", 4.0), anyway]
    assert count_injections(group, is_sample=False).least_ftti_s == pytest.approx(3.0)
    assert count_injections([anyway], is_sample=False).least_ftti_s is None


def test_table_has_a_row_for_each_group_and_counts_every_run_once() -> None:
    other = Injection("cd", "braking", "new", "out", Timeline(None), Timeline(None), None, "masked")
    rows = tabulate(
        [injection("masked"), other, injection("masked")], lambda name: name == "cut_in"
    )
    assert [(row.scenario, sum(row.counts.values())) for row in rows] == [
        ("braking", 1),
        ("cut_in", 2),
    ]
    assert all(tuple(row.counts) == CLASSES for row in rows)
    assert [row.coverage is None for row in rows] == [True, False]


def test_violation_is_worse_than_any_margin_and_a_small_margin_than_a_large_one() -> None:
    large, small = handled(0.2, 4.0, "a"), handled(0.5, 2.0, "b")
    assert worst_of([large, small]) is small
    violating = injection("undetected_violation", run="c")
    assert worst_of([large, small, violating]) is violating
    assert worst_of([injection("not_activated"), large]) is large
