"""Faults of the switch: how late, and of nothing else."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT, Late

LATE = {
    "id": "slow_relay",
    "target": "switch",
    "model": "late",
    "delay": "200 ms",
    "onset": {"at": "1 s"},
}


def test_delay_is_in_seconds() -> None:
    fault = FAULT.validate_python(LATE)
    assert isinstance(fault, Late)
    assert (fault.delay, fault.port, fault.target_id) == (0.2, "switch", "")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"delay": "-1 s"}, "greater than or equal to 0"),
        ({"delay": "1 m"}, "is not a time"),
        ({"target": "channels.nominal"}, "late is a fault of switch"),
    ],
)
def test_what_is_no_late_switch_is_refused(changes: dict[str, str], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        FAULT.validate_python({**LATE, **changes})
