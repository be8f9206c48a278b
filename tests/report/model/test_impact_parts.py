"""Records of change: they refuse to contradict themselves."""

from typing import Any

import pytest
from pydantic import ValidationError

from tests.report.fake_assessment import impact


def test_differences_that_decide_are_counted() -> None:
    assert impact().deciding == 1


@pytest.mark.parametrize("changes", [{"stale": None}, {"not_asked": "the file is gone"}])
def test_stale_evidence_is_told_or_why_not(changes: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match="either stale evidence is told"):
        impact(**changes)
    impact(stale=None, not_asked="the file is gone")


def test_stale_and_counting_evidence_are_all_of_it() -> None:
    stale = impact().stale
    assert stale is not None
    with pytest.raises(ValidationError, match="5 of 10 count, and 4 are stale"):
        impact(stale={**stale.model_dump(), "counts": 5})
