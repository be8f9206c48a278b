"""The examples work as they are written: they pass the conformance suites and do what they say."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adeye.cli.new import EXAMPLES, write_example
from adeye.judge.metrics.registry import METRICS, register_metric
from adeye.plugins import Part, load_part, require, validate_parameters
from adeye.ports import ScalarMeasurement, ScalarObservation
from adeye.signals import EGO_SPEED
from adeye.spec.sensors import PluginSensor
from adeye.testing import check_channel, check_sensor, passenger_car

Write = Callable[[str], Part]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write the example of a kind and load it as an architecture would."""

    def make(kind: str) -> Part:
        write_example(kind, "mine", tmp_path)
        return load_part("./mine.py:Mine", tmp_path)

    return make


@pytest.mark.parametrize("kind", EXAMPLES)
def test_example_is_short_enough_to_read(kind: str) -> None:
    lines = [line for line in EXAMPLES[kind].source.splitlines() if line.strip()]
    assert len(lines) <= 45


def test_channel_conforms(write: Write) -> None:
    part = write("channel")
    require(part, "channel", ("act",))
    check_channel(part.obj, validate_parameters(part, {}).parameters)


def test_channel_parameters_are_checked(write: Write) -> None:
    part = write("channel")
    assert validate_parameters(part, {"time_gap": 2.5}).errors == ()
    assert validate_parameters(part, {"time_gpa": 2.5}).errors != ()


def delivered(detections: Any, estimate: Any) -> ScalarMeasurement:
    return ScalarMeasurement(
        stamp=1.0, fresh=True, alive=True, detections=detections, estimate=estimate
    )


def act(part: Part, *, speed: float, offset: float = 0.0, ahead: float | None = None) -> Any:
    """Ask the channel once: localisation and one object ahead."""
    context = SimpleNamespace(desired_speed=30.0, vehicle=passenger_car())
    estimate = np.zeros(13)
    estimate[3], estimate[12] = speed, offset
    detections = np.zeros((0, 7)) if ahead is None else np.array([[ahead, 0, 0, 0, 4.5, 1.8, 0]])
    measurements = {
        "localisation": delivered(np.zeros((0, 7)), estimate),
        "front_camera": delivered(detections, None),
    }
    channel = part.build(validate_parameters(part, {}).parameters, context)
    return channel.act(ScalarObservation(1.0, measurements, {}, None, None))


def test_channel_holds_its_speed_on_a_free_road(write: Write) -> None:
    command = act(write("channel"), speed=30.0)
    assert (command.acceleration, command.steering_angle) == (0.0, 0.0)


def test_channel_brakes_for_what_is_near_and_not_for_what_is_far(write: Write) -> None:
    part = write("channel")
    assert act(part, speed=30.0, ahead=20.0).acceleration == -8.0
    assert act(part, speed=30.0, ahead=200.0).acceleration == 0.0


def test_channel_steers_back_to_the_centre(write: Write) -> None:
    part = write("channel")
    assert act(part, speed=30.0, offset=1.0).steering_angle < 0.0
    assert act(part, speed=30.0, offset=-1.0).steering_angle > 0.0


def test_sensor_conforms(write: Write, tmp_path: Path) -> None:
    part = write("sensor")
    require(part, "sensor", ("sense",))
    spec = PluginSensor(kind=f"{tmp_path}/mine.py:Mine", rate="10 Hz", parameters={"range": 80.0})
    check_sensor(part.build, spec)


def test_sensor_parameters_are_checked(write: Write) -> None:
    part = write("sensor")
    assert validate_parameters(part, {"range": 30}).errors == ()
    assert validate_parameters(part, {"reach": 30}).errors != ()


def test_metric_is_the_highest_speed_of_each_run_alone(write: Write) -> None:
    ego = np.zeros((2, 4, 7))
    ego[0, :, EGO_SPEED] = [10.0, 30.0, 20.0, 99.0]  # the last row is beyond the run's end
    ego[1, :, EGO_SPEED] = [5.0, 4.0, 3.0, 6.0]
    trace: Any = _Trace(np.arange(4) * 0.1, np.array([3, 4]), {"ego": ego})
    column = write("metric").build().compute(trace)
    assert column.value.tolist() == [30.0, 6.0]
    assert column.time.tolist() == pytest.approx([0.1, 0.3])
    assert column.status == ("value", "value")
    assert list(column.actor) == [-1, -1]


class _Trace:
    """As much of a trace as the example reads."""

    def __init__(self, time: Any, length: Any, columns: dict[str, Any]) -> None:
        self.time, self.length, self.columns, self.runs = time, length, columns, len(length)

    def __getitem__(self, name: str) -> Any:
        return self.columns[name]


def test_metric_can_be_registered(write: Write) -> None:
    part = write("metric")
    assert "mine_mps" not in METRICS
    register_metric(part.obj)
    assert METRICS.pop("mine_mps").unit == "m/s"
