from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT

FIXED = {"id": "a", "target": "sensors.a", "onset": {"at": "0 s"}}


def test_identity_of_a_drop_out_is_what_it_was() -> None:
    fault = FAULT.validate_python({**FIXED, "model": "drop_out"})
    assert set(fault.executable()) == {"id", "target", "model", "onset", "duration"}


@pytest.mark.parametrize(
    "wrong",
    [
        {"model": "delay"},
        {"model": "delay", "by": "-1 s"},
        {"model": "sample_loss", "probability": 2.0},
        {"model": "sample_loss", "enter": 0.1, "leave": 0.0},
        {"model": "clock_drift", "rate": 2.0},
        {"model": "freeze", "target": "channels.nominal"},
    ],
)
def test_what_no_sensor_can_have_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        FAULT.validate_python({**FIXED, **wrong})
