"""Parts by themselves: what is told by name goes in, and what they do comes out by name."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from adeye import signals
from adeye.errors import UsageError
from adeye.simulate import parts
from adeye.spec.load import load_architecture, load_scenario
from adeye.sweep.axes import default_values
from adeye.sweep.case import TestCase, lone_case
from tests.refusals import refused

ROOT = Path(__file__).resolve().parents[2]
STEP = 0.05


@pytest.fixture(scope="module")
def case() -> TestCase:
    record = load_scenario(ROOT / "scenarios_db" / "motorway" / "cut_in.yaml").spec
    path = ROOT / "odd" / "architectures" / "camera_radar.yaml"
    values = default_values(record)
    return lone_case(record, load_architecture(path).spec, values, step=STEP, seed=7)


def tell(values: Iterable[parts.Value], told: dict[str, Any]) -> None:
    named = {value.name: value for value in values}
    for name, number in told.items():
        named[name].set(number)


def say(part: parts.Part) -> dict[str, Any]:
    return {value.name: value.get() for value in part.outputs}


def test_vehicle_begins_as_it_is_told_and_moves_at_the_command(case: TestCase) -> None:
    part = parts.vehicle_part(case.architecture, STEP)
    tell(part.parameters, {"start.x": 5.0, "start.speed": 20.0})
    tell(part.inputs, {"command.acceleration": 0.0, "friction": 0.9})
    part.begin()
    assert (say(part)["x"], say(part)["speed"]) == (5.0, 20.0)
    for tick in range(4):
        part.act(tick)
    assert say(part)["x"] == pytest.approx(5.0 + 4 * STEP * 20.0)
    assert say(part)["speed"] == pytest.approx(20.0)
    units = {value.name: value.unit for value in (*part.inputs, *part.outputs)}
    assert units["command.acceleration"] == "m/s2"
    assert (units["x"], units["speed"], units["heading"]) == ("m", "m/s", "rad")
    assert units["friction"] == ""


def test_switch_takes_the_command_of_the_channel_that_has_authority(case: TestCase) -> None:
    part = parts.switch_part(case.architecture, STEP)
    channels = list(case.architecture.channels)
    for number, name in enumerate(channels):
        status = signals.STATUS_LABELS.index("ok")
        told = {"acceleration": -1.0 - number, "stamp": 0.0, "status": status}
        tell(part.inputs, {f"{name}.{key}": value for key, value in told.items()})
    part.act(0)
    said = say(part)
    assert said["acceleration"] == -1.0 - said["authority"]
    assert said["authority"] in range(len(channels))
    (who,) = [value for value in part.outputs if value.name == "authority"]
    assert who.text == "-1 nobody, " + ", ".join(f"{k} {name}" for k, name in enumerate(channels))


@pytest.mark.parametrize("ahead", [30.0, 1_000.0])
def test_sensor_delivers_what_is_near_enough_and_nothing_before_it_sampled(
    case: TestCase, ahead: float
) -> None:
    part = parts.sensor_part(case, "front_radar")
    assert (say(part)["stamp"], say(part)["alive"]) == (-1.0, True)
    ego = {"ego.x": 0.0, "ego.y": 0.0, "ego.speed": 25.0}
    place = {"x": ahead, "y": 0.0, "speed": 20.0}
    tell(part.inputs, ego | {f"objects.cutter.{key}": value for key, value in place.items()})
    for tick in range(20):
        part.act(tick)
    said = say(part)
    assert said["stamp"] >= 0.0
    present = [name for name, value in said.items() if name.endswith(".present") and value]
    assert bool(present) is (ahead < 100.0)
    if present:
        assert said["detections[1].x"] == pytest.approx(ahead, abs=4.0)
        assert abs(said["detections[1].y"]) < 2.0


def test_channel_is_told_its_links_by_name_and_answers_at_its_rate(case: TestCase) -> None:
    part = parts.channel_part(case, "nominal")
    linked = case.architecture.channels["nominal"].links
    before = {value.name.partition(".")[0] for value in part.inputs}
    assert before == {link.partition(".")[0] for link in linked}
    rows = [value for value in part.inputs if value.name.endswith("].present")]
    assert len(rows) >= parts.LEAST_ROWS
    assert say(part)["stamp"] == -1.0
    for tick in range(20):
        tell(part.inputs, {"localisation.stamp": tick * STEP, "localisation.estimate.speed": 20.0})
        part.act(tick)
    assert say(part)["stamp"] > 0.0


def test_what_is_not_there_or_of_others_is_no_part(case: TestCase) -> None:
    refused(UsageError, parts.channel_part, case, "nominl", says="there is no channel 'nominl'")
    refused(UsageError, parts.sensor_part, case, "front_rader", says="Did you mean 'front_radar'")
