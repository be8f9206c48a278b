"""Records of the concept refuse what is none."""

import pytest
from pydantic import ValidationError

from adeye.report.model.concept import OpenPoint, SafetyGoal


def test_open_point_has_a_known_kind() -> None:
    with pytest.raises(ValidationError):
        OpenPoint.model_validate({"kind": "surprise", "subject": "FSR-01", "text": "x"})


def test_goal_has_an_asil() -> None:
    with pytest.raises(ValidationError):
        SafetyGoal.model_validate(
            {"id": "SG", "text": "x", "asil": "E", "hazards": [], "safe_state": "y"}
        )
