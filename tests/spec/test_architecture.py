"""Architectures: the vehicle, and what links and switch may name."""

import copy
import re
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.architecture import Architecture
from adeye.spec.channels import PluginChannel
from adeye.spec.document import load_document
from adeye.spec.fault import FAULT
from adeye.spec.load import load_architecture
from adeye.spec.quantity import SI
from adeye.spec.sensors import Camera, PluginSensor
from adeye.sweep.axes import with_path
from tests.refusals import refused
from tests.stored import stored

TABLES = stored("definitions")


# --- Architectures: references resolve at their place, and identity is what is executed -----------

SHIPPED = sorted((Path(__file__).parents[2] / "odd" / "architectures").glob("*.yaml"))
CONTENT: dict[str, Any] = load_document(
    Path(__file__).parents[2] / "odd" / "architectures" / "camera_radar.yaml"
).value


def content(*place: str, value: Any) -> dict[str, Any]:
    """Return the shipped architecture with one value changed."""
    return with_path(copy.deepcopy(CONTENT), place, value)


def errors(changed: dict[str, Any]) -> list[tuple[tuple[int | str, ...], str]]:
    """Return place and message of everything that is refused."""
    caught = refused(ValidationError, Architecture.model_validate, changed)
    return [(item["loc"], item["msg"]) for item in caught.errors()]


@pytest.mark.parametrize("path", SHIPPED, ids=[path.stem for path in SHIPPED])
def test_shipped_architecture_reads_back_from_its_stored_form(path: Path) -> None:
    spec = load_architecture(path).spec
    assert spec.architecture == path.stem
    assert Architecture.model_validate(spec.model_dump(mode="json"), context=SI) == spec


def test_quantities_are_si() -> None:
    changed = content("sensors", "front_camera", "range", value="0.12 km")
    camera = Architecture.model_validate(changed).sensors["front_camera"]
    assert isinstance(camera, Camera)
    assert camera.range == 120.0


def test_link_to_what_is_not_there_is_refused_at_its_place() -> None:
    for link, said in (
        ("lidar", "'lidar', which is none of .*channels.nominal"),
        ("health.front_camara", "Did you mean 'health.front_camera'?$"),
    ):
        ((loc, message),) = errors(content("channels", "safety", "links", value=["truth", link]))
        assert loc == ("channels", "safety", "links", 1)
        assert re.search(said.replace("?", r"\?"), message)


def test_every_wrong_reference_is_listed() -> None:
    changed = content("channels", "safety", "links", value=["a", "truth", "b", "truth"])
    changed["switch"]["priority"] = ["safety", "nominal", "backup"]
    assert [loc for loc, _ in errors(changed)] == [
        ("channels", "safety", "links", 0),
        ("channels", "safety", "links", 2),
        ("channels", "safety", "links", 3),
        ("switch", "priority", 2),
    ]


@pytest.mark.parametrize("link", ["channels.nominal", "switch", "truth"])
def test_sensors_channels_and_switch_can_be_linked(link: str) -> None:
    spec = Architecture.model_validate(content("channels", "safety", "links", value=[link]))
    assert spec.channels["safety"].links == (link,)


def test_default_must_be_in_the_priority_and_no_channel_twice() -> None:
    for priority, place, said in (
        (["safety"], ("default",), "'nominal' is not in priority: safety"),
        (["nominal", "safety", "nominal"], ("priority", 2), ""),
    ):
        ((loc, message),) = errors(content("switch", "priority", value=priority))
        assert loc == ("switch", *place)
        assert said in message


@pytest.mark.parametrize(("place", "value"), TABLES["impossible value is refused of architecture"])
def test_impossible_value_is_refused(place: tuple[str, ...], value: Any) -> None:
    assert errors(content(*place, value=value))


def test_plugins_keep_their_parameters_as_written() -> None:
    changed = content("sensors", "sonar", value={"kind": "pack.sonar:Sonar", "rate": "20 Hz"})
    changed["channels"]["nominal"] = {"kind": "./mine.py:Planner", "parameters": {"a": [1, None]}}
    spec = Architecture.model_validate(changed)
    assert isinstance(spec.sensors["sonar"], PluginSensor)
    channel = spec.channels["nominal"]
    assert isinstance(channel, PluginChannel)
    assert channel.parameters == {"a": [1, None]}


def test_order_in_the_file_is_no_part_of_the_content() -> None:
    turned = copy.deepcopy(CONTENT)
    turned["sensors"] = dict(reversed(turned["sensors"].items()))
    one, other = Architecture.model_validate(CONTENT), Architecture.model_validate(turned)
    assert one == other
    assert one.executable() == other.executable()


@pytest.mark.parametrize(("place", "value"), TABLES["words and cost are not executed"])
def test_words_and_cost_are_not_executed(place: tuple[str, ...], value: Any) -> None:
    changed = Architecture.model_validate(content(*place, value=value))
    assert changed.executable() == Architecture.model_validate(CONTENT).executable()


@pytest.mark.parametrize(("place", "value"), TABLES["what changes the drive is executed"])
def test_what_changes_the_drive_is_executed(place: tuple[str, ...], value: Any) -> None:
    changed = Architecture.model_validate(content(*place, value=value))
    assert changed.executable() != Architecture.model_validate(CONTENT).executable()


# --- Faults of actuators and tyres: which actuator can have which, and in what unit ---------------


def read(target: str, model: str, **more: Any) -> Any:
    content = {"id": "a", "target": target, "model": model, "onset": {"at": "1 s"}}
    return FAULT.validate_python({**content, **more})


def test_rate_is_that_of_the_actuator() -> None:
    assert read("actuators.brake", "rate_limit", jerk="5 m/s^3").rate == 5.0
    steering = read("actuators.steering", "rate_limit", steering_rate="180 deg/s")
    assert steering.rate == pytest.approx(3.14159265)


def test_what_is_no_such_fault_is_refused() -> None:
    for target, model, more, said in TABLES["what is no such fault is refused of architecture"]:
        refused(ValidationError, read, target, model, **more, says=said)
