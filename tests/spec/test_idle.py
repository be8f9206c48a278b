"""Faults that change nothing: of no size, masked, on what nobody looks at, in no entry."""

from __future__ import annotations

from typing import Any

import pytest
import yaml

from adeye.spec.architecture import Architecture
from adeye.spec.fault import FAULT, MODELS, idle_faults
from adeye.spec.load import shipped

CANDIDATE = yaml.safe_load((shipped("odd") / "architectures/camera_radar.yaml").read_text("utf-8"))


def fault(model: str, target: str = "sensors.front_radar", **more: Any) -> Any:
    content = {"id": model, "target": target, "model": model, "onset": {"at": "2 s"}, **more}
    return FAULT.validate_python(content)


def architecture(**changes: Any) -> Architecture:
    content = {name: item for name, item in CANDIDATE.items() if name != "extends"}
    return Architecture.model_validate({**content, **changes})


def idle(*faults: Any, of: Architecture | None = None) -> dict[str, str]:
    return dict(idle_faults([item.id for item in faults], [(faults, of or architecture())]))


@pytest.mark.parametrize(
    ("nothing", "something"),
    [
        ({"model": "bias", "signal": "x", "size": "0 m"}, {"size": "1 m"}),
        ({"model": "scale", "signal": "x", "factor": 1}, {"factor": 1.1}),
        ({"model": "spike", "signal": "x", "size": "1 m", "probability": 0}, {"probability": 0.1}),
        ({"model": "sample_loss"}, {"enter": 0.1}),
        ({"model": "delay", "by": "0 s"}, {"jitter": "0.1 s"}),
        ({"model": "miss", "probability": 0}, {"probability": 0.5}),
        ({"model": "blind_sector", "right": "1 deg", "left": "1 deg"}, {"left": "2 deg"}),
        ({"model": "clock_drift"}, {"rate": 0.01}),
        ({"model": "loss", "target": "actuators.brake", "share": 0}, {"share": 0.2}),
        (
            {"model": "bias", "target": "channels.nominal", "acceleration": "0 m/s^2"},
            {"acceleration": "1 m/s^2"},
        ),
        ({"model": "scale", "target": "channels.nominal", "acceleration": 1}, {"acceleration": 2}),
        ({"model": "late", "target": "switch", "delay": "0 s"}, {"delay": "1 s"}),
        ({"model": "friction", "target": "tyres", "factor": 1}, {"factor": 0.5}),
        ({"model": "map_shifted", "target": "hooks.nominal", "offset": "0 m"}, {"offset": "1 m"}),
        (
            {"model": "drop", "target": "links.nominal.front_radar", "probability": 0},
            {"probability": 1},
        ),
    ],
)
def test_fault_of_no_size_is_named(nothing: dict[str, Any], something: dict[str, Any]) -> None:
    model = nothing["model"]
    assert "changes nothing" in idle(fault(**nothing))[model]
    assert idle(fault(**{**nothing, **something})) == {}


def test_sizes_are_fields_of_their_models() -> None:
    for model in MODELS:
        for sizes in model.neutral:
            assert sizes.keys() <= model.model_fields.keys()


@pytest.mark.parametrize(
    ("silencer", "other", "is_masked"),
    [
        ({}, {}, True),
        ({"onset": {"at": "1 s"}}, {"duration": "3 s"}, True),
        ({"onset": {"at": "1 s"}, "duration": "2 s"}, {"duration": "1 s"}, True),
        ({"onset": {"at": "1 s"}, "duration": "2 s"}, {"duration": "2 s"}, False),
        ({"duration": "2 s"}, {}, False),
        ({"onset": {"at": "3 s"}}, {}, False),
        ({"onset": {"at": "1 s"}}, {"onset": {"between": ["2 s", "3 s"]}}, True),
        ({"onset": {"when": "time > 1 s"}}, {"onset": {"when": "time > 1 s"}}, True),
        ({"onset": {"when": "time > 1 s"}}, {}, False),
        ({"duration": "1 s", "every": "2 s"}, {"duration": "1 s"}, False),
        ({}, {"target": "sensors.front_camera"}, False),
    ],
)
@pytest.mark.parametrize("is_first", [True, False])
def test_fault_is_masked_while_its_target_is_silent(
    silencer: dict[str, Any], other: dict[str, Any], *, is_masked: bool, is_first: bool
) -> None:
    pair = (
        fault("drop_out", **silencer),
        fault("bias", signal="x", size="1 m", **{"target": "sensors.front_radar", **other}),
    )
    found = idle(*(pair if is_first else pair[::-1]))
    assert ("masked by drop_out" in found.get("bias", "")) is is_masked
    assert "drop_out" not in found


def test_of_two_silencers_one_is_masked() -> None:
    assert list(idle(fault("drop_out"), fault("power_loss"))) == ["power_loss"]


def test_silent_channel_hides_what_is_wrong_inside_but_not_its_lies() -> None:
    silent = fault("silent", "channels.nominal")
    assert idle(silent, fault("heartbeat_lies", "channels.nominal")) == {}
    found = idle(silent, fault("planner_frozen", "hooks.nominal"))
    assert "masked by silent" in found["planner_frozen"]


def test_silent_channel_hides_what_it_is_shown_but_not_what_others_see_of_it() -> None:
    silent = fault("silent", "channels.nominal")
    assert "masked by silent" in idle(silent, fault("drop", "links.nominal.front_radar"))["drop"]
    assert idle(silent, fault("drop", "links.safety.channels.nominal")) == {}


@pytest.mark.parametrize(
    ("target", "first", "then"),
    [
        ("sensors.front_radar", ("bias", {"size": "1 m"}), ("stuck_at", {"value": "9 m"})),
        ("channels.nominal", ("bias", {"steering_angle": "1 deg"}), ("plausible_but_wrong", {})),
        ("channels.nominal", ("scale", {"steering_angle": 57.3}), ("not_a_number", {})),
        ("actuators.brake", ("loss", {"share": 0.5}), ("stuck", {})),
        ("tyres", ("friction", {"factor": 0.5}), ("friction", {"value": 0.9})),
    ],
)
def test_fault_is_masked_by_one_that_replaces_what_it_changed(
    target: str, first: tuple[str, dict[str, Any]], then: tuple[str, dict[str, Any]]
) -> None:
    signal = {"signal": "x"} if target.startswith("sensors.") else {}
    one = fault(first[0], target, **signal, **first[1], id="one")
    other = fault(then[0], target, **signal, **then[1], id="other")
    assert "masked by other, which replaces" in idle(one, other)["one"]
    brief = other.model_copy(update={"duration": 1.0})
    assert idle(one, brief) == {}
    if signal:
        elsewhere = fault(then[0], target, signal="y", id="other", value="9 m")
        assert idle(one, elsewhere) == {}


def test_fault_on_what_nobody_looks_at_is_named() -> None:
    channels = {**CANDIDATE["channels"]}
    alone = {"policy": "stuck", "priority": ["nominal"], "default": "nominal"}
    nominal = {**channels["nominal"], "links": ["localisation", "health.front_camera"]}
    bare = architecture(channels={**channels, "nominal": nominal}, switch=alone)
    found = idle(
        fault("drop_out"),
        fault("silent", "channels.safety"),
        fault("late", "switch", delay="1 s"),
        of=bare,
    )
    assert "which no channel" in found["drop_out"]
    assert "no channel that acts" in found["silent"]
    assert "one channel only" in found["late"]
    assert idle(fault("drop_out", "sensors.front_camera"), of=bare) == {}
    assert idle(fault("drop_out"), fault("silent", "channels.safety")) == {}


def test_fault_of_no_entry_is_named() -> None:
    assert idle_faults(["a"], []) == [("a", "is injected in no test case")]
