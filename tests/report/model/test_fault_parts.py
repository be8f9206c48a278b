"""Records about faults that contradict themselves are refused."""

import pytest
from pydantic import ValidationError

from adeye.report.model.assessment import FaultEvidence
from tests.report.fake_faults import evidence, group


def test_evidence_that_holds_together_is_taken() -> None:
    found = evidence().takeovers
    assert found is not None
    assert found.runs == evidence().forked


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"measured": 7}, "7 measured"),
        ({"with_fault": 4}, "of 4 runs"),
        ({"forked": 11}, "11 runs are forked"),
        ({"takeovers": None}, "12 runs are forked"),
    ],
)
def test_counts_that_do_not_agree_are_refused(changes: dict[str, object], message: str) -> None:
    content = {**evidence().model_dump(), **changes}
    with pytest.raises(ValidationError, match=message):
        FaultEvidence.model_validate(content)


@pytest.mark.parametrize("changes", [{"activated": 5}, {"detected": 9}])
def test_group_that_counts_otherwise_than_its_classes_is_refused(changes: dict[str, int]) -> None:
    content = {**group().model_dump(), **changes}
    with pytest.raises(ValidationError, match="do not fit"):
        type(group()).model_validate(content)
