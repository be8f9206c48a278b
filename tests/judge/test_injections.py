"""Injected faults counted by class, and the worst of a group."""

from __future__ import annotations

import pytest

from adeye.judge.timeline import CLASSES, Injection, Timeline, count_injections, tabulate, worst_of


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
