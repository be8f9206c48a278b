from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.faults.base import Onset


@pytest.mark.parametrize(
    "onset", [{}, {"at": "1 s", "when": "time >= 1 s"}, {"between": ["2 s", "1 s"]}]
)
def test_onset_is_one_of_three_and_in_order(onset: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Onset.model_validate(onset)


def test_onset_is_read_in_si() -> None:
    assert Onset.model_validate({"between": ["500 ms", "2 s"]}).between == (0.5, 2.0)
