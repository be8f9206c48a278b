from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from adeye.spec.channels import (
    Channel,
    NominalChannel,
    NominalParameters,
    PluginChannel,
    PolicyChannel,
    ProcessChannel,
    SafetyChannel,
    SafetyParameters,
    StopRatings,
    TrajectoryChannel,
)

CHANNEL: TypeAdapter[Any] = TypeAdapter(Channel)


@pytest.mark.parametrize(
    ("kind", "model"),
    [
        ("nominal", NominalChannel),
        ("safety", SafetyChannel),
        ("trajectory", TrajectoryChannel),
        ("./mine.py:Planner", PluginChannel),
    ],
)
def test_kind_chooses_the_model(kind: str, model: type) -> None:
    assert type(CHANNEL.validate_python({"kind": kind})) is model


def test_policy_channel_names_its_policy() -> None:
    content = {"kind": "policy", "parameters": {"policy": "./mine.py:drive", "nearest": 3}}
    channel = CHANNEL.validate_python(content)
    assert type(channel) is PolicyChannel
    assert channel.parameters.nearest == 3


def test_process_channel_names_its_program_and_what_stops_it() -> None:
    parameters = {"command": ["./drive", "--fast"], "values": {"gain": 2}, "run_deadline": "1 min"}
    channel = CHANNEL.validate_python({"kind": "process", "parameters": parameters})
    assert type(channel) is ProcessChannel
    assert channel.parameters.command == ("./drive", "--fast")
    assert (channel.parameters.run_deadline, channel.parameters.step_deadline) == (60.0, 2.0)
    assert channel.parameters.limits.processes == 16


def test_channels_with_code_of_the_user_may_name_the_files_that_it_reads() -> None:
    for content in (
        {"kind": "policy", "parameters": {"policy": "./mine.py:drive"}},
        {"kind": "./mine.py:Planner"},
    ):
        assert CHANNEL.validate_python({**content, "files": ["net.bin"]}).files == ("net.bin",)


def test_parameters_of_the_trajectory_channel_have_units() -> None:
    parameters = {"rear_sight": "80 m", "max_jerk": "10 m/s^3", "weight_lane_change": 2}
    channel = CHANNEL.validate_python({"kind": "trajectory", "parameters": parameters})
    assert channel.parameters.rear_sight == 80.0
    assert channel.parameters.max_jerk == 10.0


@pytest.mark.parametrize(
    "content",
    [
        {"kind": "cruise"},
        {"kind": "nominal", "delay": "-1 s"},
        {"kind": "nominal", "parameters": {"time_gap": "0 s"}},
        {"kind": "safety", "parameters": {"time_gap": "1 s"}},
        {"kind": "trajectory", "parameters": {"horizon": "20 s"}},
        {"kind": "trajectory", "parameters": {"weight_comfort": -1}},
        {"kind": "nominal", "files": ["net.bin"]},
        {"kind": "./mine.py:Planner", "files": [""]},
        {"kind": "policy"},
        {"kind": "process"},
        {"kind": "process", "parameters": {"command": []}},
        {"kind": "process", "parameters": {"command": ["./a\0b"]}},
        {"kind": "process", "parameters": {"command": ["./a"], "step_deadline": "0 s"}},
        {"kind": "process", "parameters": {"command": ["./a"], "limits": {"memory_mib": 1}}},
        {"kind": "process", "parameters": {"command": ["./a"], "limits": {"memory": 64}}},
        {"kind": "policy", "parameters": {"policy": "mine.py"}},
        {"kind": "policy", "parameters": {"policy": "./mine.py:p", "observation": "pixels"}},
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


def test_what_a_planned_stop_reads_is_no_part_of_the_identity_where_it_is_left_out() -> None:
    content = SafetyParameters().model_dump(mode="json")
    assert set(content) == {
        *("staleness", "confirm", "heal", "stop_deceleration", "emergency_deceleration"),
        *("danger_threshold", "max_command", "max_lane_offset", "lateral_margin"),
    }
    assert (
        SafetyParameters(stop="in_lane", ratings=StopRatings()).model_dump(mode="json") == content
    )
    planned = SafetyParameters(stop="planned", ratings=StopRatings(fast_lane=6))
    added = planned.model_dump(mode="json")
    assert added["stop"] == "planned"
    assert added["ratings"]["fast_lane"] == 6
    assert SafetyParameters.model_validate(added, context={"si": True}) == planned


@pytest.mark.parametrize(
    ("parameters", "match"),
    [
        ({"stop": "shoulder"}, "in_lane"),
        ({"ratings": {"hard_shoulder": 9}}, "less than or equal to 8"),
        ({"ratings": {"ditch": 2}}, "ditch"),
        ({"rear_sight": "-1 m"}, "greater than or equal to 0"),
    ],
)
def test_wrong_stop_is_refused(parameters: dict[str, Any], match: str) -> None:
    with pytest.raises(ValidationError, match=match):
        SafetyParameters.model_validate(parameters)


def test_way_of_stopping_is_structure_because_of_its_monitor() -> None:
    planned = SafetyChannel(kind="safety", parameters=SafetyParameters(stop="planned"))
    assert (planned.stop, SafetyChannel(kind="safety").stop) == ("planned", "in_lane")
    assert "stop" in SafetyChannel.STRUCTURE
