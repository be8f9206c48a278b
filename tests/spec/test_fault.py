"""Faults: the model fits the target, the onset is one, and identity is what is executed."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT
from adeye.spec.quantity import SI

OUT: dict[str, Any] = {
    "id": "camera_out",
    "target": "sensors.front_camera",
    "model": "drop_out",
    "onset": {"at": "2 s"},
    "duration": "500 ms",
}


def test_times_are_in_seconds() -> None:
    fault = FAULT.validate_python(OUT)
    assert fault.onset.at == 2.0
    assert fault.duration == 0.5
    assert fault.target_id == "front_camera"


def test_duration_may_be_left_out() -> None:
    assert FAULT.validate_python({k: v for k, v in OUT.items() if k != "duration"}).duration is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"model": "silent"}, "silent is a fault of channels, and sensors.front_camera"),
        ({"target": "channels.nominal"}, "drop_out is a fault of sensors, and channels.nominal"),
        ({"target": "front_camera"}, "target"),
        ({"target": "sensors.front.camera"}, "target"),
        ({"model": "stuck"}, "stuck is a fault of channels or actuators or switch, and sensors.fr"),
        ({"model": "late", "target": "switch"}, "delay"),
        ({"model": "broken"}, "drop_out"),
        ({"model": ["drop_out"]}, "model"),
        ({"target": 3}, "target"),
        ({"target": "tyres"}, "drop_out is a fault of sensors, and tyres is not one of them"),
        ({"onset": {}}, "give one of at, when and between"),
        ({"onset": {"at": "1 s", "when": "time > 1 s"}}, "give one of at, when and between"),
        ({"onset": {"at": "1 s", "between": ["1 s", "2 s"]}}, "give one of at, when and between"),
        ({"onset": {"between": ["2 s", "1 s"]}}, "the earliest time comes first"),
        ({"onset": {"between": ["2 s"]}}, "at least 2"),
        ({"every": "500 ms"}, "give a duration that is shorter"),
        ({"every": "1 s", "duration": None}, "give a duration that is shorter"),
        ({"times": 3}, "give every, too"),
        ({"every": "1 s", "times": 0}, "greater than or equal to 1"),
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
        FAULT.validate_python({**OUT, **changes})


def test_text_is_no_part_of_what_is_executed() -> None:
    plain = FAULT.validate_python(OUT).executable()
    assert FAULT.validate_python({**OUT, "text": "cable broken"}).executable() == plain
    assert FAULT.validate_python({**OUT, "duration": "1 s"}).executable() != plain


def test_stored_fault_reads_back() -> None:
    triggered = FAULT.validate_python({**OUT, "onset": {"when": "lead.gap < 20 m"}})
    stored = triggered.model_dump(mode="json")
    assert FAULT.validate_python(stored, context=SI) == triggered


def test_identity_of_a_fault_that_comes_once_is_what_it_was() -> None:
    assert FAULT.validate_python(OUT).executable() == {
        "id": "camera_out",
        "target": "sensors.front_camera",
        "model": "drop_out",
        "onset": {"at": 2.0, "when": None},
        "duration": 0.5,
    }
    again = FAULT.validate_python({**OUT, "every": "2 s", "times": 3}).executable()
    assert (again["every"], again["times"]) == (2.0, 3)
