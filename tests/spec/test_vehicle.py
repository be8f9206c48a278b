"""Faults of actuators and tyres: which actuator can have which, and in what unit."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT


def read(target: str, model: str, **more: Any) -> Any:
    content = {"id": "a", "target": target, "model": model, "onset": {"at": "1 s"}}
    return FAULT.validate_python({**content, **more})


def test_rate_is_that_of_the_actuator() -> None:
    assert read("actuators.brake", "rate_limit", jerk="5 m/s^3").rate == 5.0
    steering = read("actuators.steering", "rate_limit", steering_rate="180 deg/s")
    assert steering.rate == pytest.approx(3.14159265)


@pytest.mark.parametrize(
    ("target", "model", "more", "said"),
    [
        ("actuators.steering", "loss", {"share": 0.5}, "actuators.drive or actuators.brake"),
        ("actuators.steering", "fade", {"share": 0.5, "over": "1 s"}, "actuators.brake"),
        ("actuators.brake", "offset", {"steering_angle": "1 deg"}, "a fault of actuators.steering"),
        ("actuators.brake", "loss", {"share": 1.5}, "less than or equal to 1"),
        ("actuators.brake", "fade", {"share": 0.5, "over": "0 s"}, "greater than 0"),
        ("actuators.brake", "rate_limit", {}, "rate of actuators.brake is jerk"),
        ("actuators.brake", "rate_limit", {"steering_rate": "1 rad/s"}, "is jerk"),
        ("actuators.steering", "rate_limit", {"jerk": "1 m/s^3"}, "is steering_rate"),
        (
            "actuators.steering",
            "rate_limit",
            {"jerk": "1 m/s^3", "steering_rate": "1 rad/s"},
            "give it alone",
        ),
        ("tyres", "friction", {}, "give one of value and factor"),
        ("tyres", "friction", {"value": 0.5, "factor": 0.5}, "give one of value and factor"),
        ("tyres", "friction", {"value": -0.5}, "greater than or equal to 0"),
        ("tyres", "loss", {"share": 0.5}, "loss is a fault of actuators, and tyres"),
    ],
)
def test_what_is_no_such_fault_is_refused(
    target: str, model: str, more: dict[str, Any], said: str
) -> None:
    with pytest.raises(ValidationError, match=said):
        read(target, model, **more)
