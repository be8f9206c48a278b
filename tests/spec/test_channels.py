from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from adeye.spec.channels import (
    Channel,
    NominalChannel,
    NominalParameters,
    PluginChannel,
    SafetyChannel,
)

CHANNEL: TypeAdapter[Any] = TypeAdapter(Channel)


@pytest.mark.parametrize(
    ("kind", "model"),
    [
        ("nominal", NominalChannel),
        ("safety", SafetyChannel),
        ("./mine.py:Planner", PluginChannel),
    ],
)
def test_kind_chooses_the_model(kind: str, model: type) -> None:
    assert type(CHANNEL.validate_python({"kind": kind})) is model


@pytest.mark.parametrize(
    "content",
    [
        {"kind": "cruise"},
        {"kind": "nominal", "delay": "-1 s"},
        {"kind": "nominal", "parameters": {"time_gap": "0 s"}},
        {"kind": "safety", "parameters": {"time_gap": "1 s"}},
    ],
)
def test_impossible_channel_is_refused(content: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        CHANNEL.validate_python(content)


@pytest.mark.parametrize(("window", "fits"), [(0, True), (2, False), (3, True), (30, True)])
def test_window_of_confirmation_has_room_for_the_hits(window: int, *, fits: bool) -> None:
    content = {"confirm_hits": 3, "confirm_window": window}
    if fits:
        assert NominalParameters.model_validate(content).confirm_window == window
        return
    with pytest.raises(ValidationError, match="3 detections never come in 2 samples"):
        NominalParameters.model_validate(content)
