"""Faults of channels, links and insides: values in SI, defaults, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT


def read(target: str, model: str, **more: Any) -> Any:
    content = {"id": "a", "target": target, "model": model, "onset": {"at": "1 s"}}
    return FAULT.validate_python({**content, **more})


def test_values_are_in_si() -> None:
    bias = read("channels.nominal", "bias", steering_angle="180 deg")
    assert bias.steering_angle == pytest.approx(3.14159265)
    assert bias.acceleration == 0.0
    assert read("links.safety.switch", "reorder", by="100 ms").by == 0.1
    assert read("hooks.nominal", "map_shifted", offset="-50 cm").offset == -0.5


def test_everything_is_lost_unless_a_share_is_given() -> None:
    drop = read("links.nominal.front", "drop")
    assert (drop.probability, drop.burst) == (1.0, 1)


@pytest.mark.parametrize(
    ("target", "model", "more", "said"),
    [
        ("channels.nominal", "crash", {"duration": "1 s"}, "does not come back"),
        ("channels.nominal", "bias", {}, "give acceleration, steering_angle or both"),
        ("channels.nominal", "scale", {"by": 2}, "by"),
        ("channels.nominal", "oscillating", {"acceleration": 1}, "frequency"),
        ("channels.nominal", "slow", {}, "by"),
        ("channels.nominal", "slow", {"by": "11 s"}, "less than or equal to 10"),
        ("channels.nominal", "drop", {}, "drop is a fault of links, and channels.nominal"),
        ("links.nominal.front", "drop", {"probability": 1.1}, "less than or equal to 1"),
        ("links.nominal.front", "drop", {"burst": 0}, "greater than or equal to 1"),
        ("hooks.nominal", "map_shifted", {}, "offset"),
        ("hooks.nominal", "silent", {}, "silent is a fault of channels"),
    ],
)
def test_what_is_no_such_fault_is_refused(
    target: str, model: str, more: dict[str, Any], said: str
) -> None:
    with pytest.raises(ValidationError, match=said):
        read(target, model, **more)
