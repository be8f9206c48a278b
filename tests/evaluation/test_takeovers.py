"""Takeovers in hindsight: every combination of decision and truth."""

import pytest

from adeye.evaluation.takeovers import Takeover, classify_takeover


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
