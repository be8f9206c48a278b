"""What may stand under ``supervisor:``, and what is refused, with its place."""

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.simulate.channels.safety.supervisor import (
    CHANNEL_SILENT,
    LAST_SAFE_STOP,
    SENSOR_SILENT,
)
from adeye.spec.channels import SafetyChannel
from adeye.spec.supervisor import KINDS, Counter, Supervisor

OFF = {"off": {"kind": "off_road"}}


def channel(supervisor: dict[str, Any], *, rate: str = "20 Hz", stop: str = "planned") -> Any:
    parameters = {"stop": stop, "supervisor": supervisor}
    return SafetyChannel.model_validate({"kind": "safety", "rate": rate, "parameters": parameters})


def test_monitor_takes_from_the_common_counter_what_it_does_not_say() -> None:
    made = Supervisor.model_validate(
        {
            "counter": {"decrement": 2, "heal": -8},
            "monitors": {"a": {"kind": "off_road", "counter": {"fault": 15}}, **OFF},
        }
    )
    assert made.counter_of("a") == Counter(increment=1, decrement=2, fault=15, heal=-8)
    assert made.counter_of("off") == Counter(increment=1, decrement=2, fault=4, heal=-8)


def test_levels_that_are_not_named_ask_for_the_usual() -> None:
    made = Supervisor.model_validate({"monitors": OFF, "manoeuvres": {"3": "stop"}})
    assert list(made.manoeuvres.values()) == ["continue", "rest_area", "stop", "stop"]


def test_monitors_are_in_the_order_of_their_names() -> None:
    made = Supervisor.model_validate({"monitors": {"b": {"kind": "off_road"}, "a": OFF["off"]}})
    assert list(made.monitors) == ["a", "b"]


def test_content_can_be_stored_and_read_back() -> None:
    made = channel({"monitors": {"x": {"kind": "odd_exit", "max_speed": "30 m/s"}}})
    stored = made.model_dump(mode="json")
    assert SafetyChannel.model_validate(stored, context={"si": True}) == made


def test_safety_channel_without_one_has_its_old_content_and_structure() -> None:
    plain = SafetyChannel.model_validate({"kind": "safety"})
    assert "supervisor" not in plain.model_dump(mode="json")["parameters"]
    assert plain.monitors is None
    assert channel({"monitors": OFF}).monitors == [["off", "off_road", []]]


def test_kernels_know_the_kinds_by_their_place() -> None:
    for number, name in (
        (CHANNEL_SILENT, "channel_silent"),
        (SENSOR_SILENT, "sensor_silent"),
        (LAST_SAFE_STOP, "last_safe_stop"),
    ):
        assert KINDS[number] == name


@pytest.mark.parametrize(
    ("supervisor", "place", "match"),
    [
        ({"monitors": {}}, "monitors", "at least 1 item"),
        ({"monitors": {"a": {"kind": "of_road"}}}, "a", "channel_silent"),
        ({"counter": {"fault": -4}, "monitors": OFF}, "fault", "-4 is not more than -4"),
        (
            {"monitors": {"a": {"kind": "off_road", "counter": {"heal": 4}}}},
            "counter",
            "4 is not more than 4",
        ),
        ({"counter": {"increment": 0}, "monitors": OFF}, "increment", "greater than or equal to 1"),
        ({"counter": {"fault": 1.5}, "monitors": OFF}, "fault", "integer"),
        ({"monitors": {"a": {"kind": "off_road", "level": 5}}}, "level", "less than or equal to 4"),
        ({"monitors": {"mrm_stop": {"kind": "off_road"}}}, "mrm_stop", "another name"),
        ({"monitors": {"a": {"kind": "channel_silent"}}}, "watches", "required"),
        ({"monitors": {"a": {"kind": "sensor_silent", "watches": ["x", "x"]}}}, "1", "twice"),
        ({"monitors": {"a": {"kind": "odd_exit"}}}, "kind", "asks nothing"),
        (
            {"monitors": {"a": {"kind": "odd_exit", "from_s": "9 m", "to_s": "8 m"}}},
            "to_s",
            "more than from_s",
        ),
        ({"monitors": OFF, "manoeuvres": {"3": "continue"}}, "3", "milder than 'rest_area'"),
        ({"monitors": OFF, "manoeuvres": {"5": "stop"}}, "5", "'1', '2', '3' or '4'"),
        ({"monitors": OFF, "rate": "8 Hz"}, "rate", "6.66667 Hz and 10 Hz"),
        ({"monitors": OFF, "rate": "30 Hz"}, "rate", "nearest that do are 10 Hz and 20 Hz"),
    ],
)
def test_wrong_supervisor_is_refused(supervisor: dict[str, Any], place: str, match: str) -> None:
    with pytest.raises(ValidationError) as caught:
        channel(supervisor)
    wrong = caught.value.errors()
    assert len(wrong) == 1
    assert place in [str(step) for step in wrong[0]["loc"]]
    assert match in wrong[0]["msg"] or match in str(wrong[0])


def test_last_safe_stop_takes_a_planner() -> None:
    last = {"monitors": {"last": {"kind": "last_safe_stop"}}}
    assert channel(last).parameters.supervisor is not None
    with pytest.raises(ValidationError, match="takes stop: planned"):
        channel(last, stop="in_lane")
