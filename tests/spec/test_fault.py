"""Faults: the model fits the target, the onset is one, and identity is what is executed."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.fault import Fault
from adeye.spec.quantity import SI

OUT: dict[str, Any] = {
    "id": "camera_out",
    "target": "sensors.front_camera",
    "model": "drop_out",
    "onset": {"at": "2 s"},
    "duration": "500 ms",
}


def test_times_are_in_seconds() -> None:
    fault = Fault.model_validate(OUT)
    assert fault.onset.at == 2.0
    assert fault.duration == 0.5
    assert fault.target_id == "front_camera"


def test_duration_may_be_left_out() -> None:
    assert Fault.model_validate({k: v for k, v in OUT.items() if k != "duration"}).duration is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"model": "silent"}, "silent is a fault of channels, and sensors.front_camera"),
        ({"target": "channels.nominal"}, "drop_out is a fault of sensors, and channels.nominal"),
        ({"target": "front_camera"}, "target"),
        ({"target": "sensors.front.camera"}, "target"),
        ({"model": "stuck"}, "model"),
        ({"onset": {}}, "give either at or when"),
        ({"onset": {"at": "1 s", "when": "time > 1 s"}}, "give either at or when"),
        ({"onset": {"at": "-1 s"}}, "greater than or equal to 0"),
        ({"onset": {"at": "5 m"}}, "is not a time"),
        ({"onset": {"when": "time"}}, "neither true nor false"),
        ({"duration": "-1 s"}, "greater than or equal to 0"),
        ({"id": "Camera out"}, "id"),
        ({"from": "2 s"}, "from"),
    ],
)
def test_what_is_no_fault_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        Fault.model_validate({**OUT, **changes})


def test_text_is_no_part_of_what_is_executed() -> None:
    plain = Fault.model_validate(OUT).executable()
    assert Fault.model_validate({**OUT, "text": "cable broken"}).executable() == plain
    assert Fault.model_validate({**OUT, "duration": "1 s"}).executable() != plain


def test_stored_fault_reads_back() -> None:
    triggered = Fault.model_validate({**OUT, "onset": {"when": "lead.gap < 20 m"}})
    stored = triggered.model_dump(mode="json")
    assert Fault.model_validate(stored, context=SI) == triggered
