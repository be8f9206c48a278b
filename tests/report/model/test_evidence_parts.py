"""Records of how far evidence reaches: what does not add up is refused."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from tests.report.fake_evidence import coverage, line


def test_attribute_counts_what_is_feasible_and_what_is_covered() -> None:
    speed, light = coverage().attributes
    assert (speed.covered, speed.feasible) == (1, 2)
    assert (light.covered, light.feasible) == (2, 2)
    assert coverage().missing_pairs == 3


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"not_judged": 2}, "540 test cases, but 539 are told of"),
        ({"covered_pairs": 3}, "2 uncovered pairs are listed of 1"),
        ({"covered_pairs": 5}, "listed of -1"),
        ({"pairs": 2}, "listed of 3"),
    ],
)
def test_coverage_that_does_not_add_up_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        coverage(**changes)


def test_what_was_not_counted_need_not_add_up() -> None:
    found = coverage(refusal="too many", counted=0, not_judged=0)
    assert found.refusal == "too many"


def test_uncertainty_that_is_no_number_is_refused() -> None:
    with pytest.raises(ValidationError, match="finite"):
        line(uncertainty=float("nan"))
