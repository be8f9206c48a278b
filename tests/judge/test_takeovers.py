"""Takeovers in hindsight: every combination of decision and truth."""

import pytest

from adeye.judge.preventability import (
    Takeover,
    TakeoverClass,
    classify_takeover,
    precision_of,
    recall_of,
)


@pytest.mark.parametrize(
    ("takeover", "expected"),
    [
        (Takeover(took_over=True, violates=False, fork_violates=True), "needed_and_done"),
        (Takeover(took_over=True, violates=True, fork_violates=True), "late"),
        (Takeover(took_over=True, violates=False, fork_violates=False), "spurious"),
        (Takeover(took_over=True, violates=True, fork_violates=False), "spurious"),
        (Takeover(took_over=False, violates=True, fork_violates=False), "missed"),
        (Takeover(took_over=False, violates=True, fork_violates=True), "missed"),
        (Takeover(took_over=False, violates=True, fork_violates=None), "missed"),
        (Takeover(took_over=False, violates=False, fork_violates=True), "not_needed"),
        (Takeover(took_over=False, violates=False, fork_violates=None), "not_needed"),
    ],
)
def test_takeover_is_classified_by_what_happens_without(takeover: Takeover, expected: str) -> None:
    assert classify_takeover(takeover) == expected


def test_takeover_without_its_fork_has_no_truth() -> None:
    with pytest.raises(ValueError, match="without its fork"):
        classify_takeover(Takeover(took_over=True, violates=False, fork_violates=None))


COUNTS: dict[TakeoverClass, int] = {
    "needed_and_done": 6,
    "late": 1,
    "spurious": 3,
    "missed": 2,
    "not_needed": 9,
}


def test_late_takeover_was_needed_and_yet_not_in_time() -> None:
    assert precision_of(COUNTS) == (7, 10)
    assert recall_of(COUNTS, 2) == (6, 9)


def test_violation_that_no_takeover_would_have_avoided_needed_none() -> None:
    assert recall_of(COUNTS, 0) == (6, 7)


def test_without_takeovers_there_is_no_share() -> None:
    nothing: dict[TakeoverClass, int] = dict.fromkeys(COUNTS, 0)
    assert precision_of(nothing) == recall_of(nothing, 0) == (0, 0)
