"""What comes late or stands still: of links, channels and actuators alike."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT
from adeye.spec.fault_base import LONGEST_LAG


def read(target: str, model: str, **more: Any) -> Any:
    content = {"id": "a", "target": target, "model": model, "onset": {"at": "1 s"}}
    return FAULT.validate_python({**content, **more})


@pytest.mark.parametrize("target", ["links.nominal.front", "actuators.brake"])
def test_delay_is_in_seconds(target: str) -> None:
    assert read(target, "delay", by="250 ms").by == 0.25


@pytest.mark.parametrize("by", ["-1 s", f"{LONGEST_LAG + 1} s", "2 m"])
def test_delay_that_is_none_is_refused(by: str) -> None:
    with pytest.raises(ValidationError, match="by"):
        read("actuators.brake", "delay", by=by)


def test_stuck_is_of_channels_and_actuators() -> None:
    assert read("channels.nominal", "stuck").port == "channels"
    assert read("actuators.steering", "stuck").port == "actuators"
    with pytest.raises(ValidationError, match="stuck is a fault of channels or actuators"):
        read("sensors.front", "stuck")
