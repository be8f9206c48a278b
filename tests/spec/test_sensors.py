"""Sensors as users write them: what a model does not have, and what can never detect."""

from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from adeye.spec.quantity import SI
from adeye.spec.sensors import (
    Camera,
    Gnss,
    Imu,
    Lidar,
    PhysicalCamera,
    PhysicalLidar,
    PhysicalRadar,
    PluginSensor,
    Radar,
    Sensor,
    SensorRecord,
    Ultrasonic,
    model_name,
)

SENSOR: TypeAdapter[SensorRecord] = TypeAdapter(Sensor)
LOW = {"z": "0.5 m"}
SEEING: dict[str, Any] = {"rate": "10 Hz", "mount": {"x": "1 m"}, "field_of_view": "60 deg"}
KINDS: list[tuple[dict[str, Any], type[SensorRecord], str]] = [
    ({"kind": "camera", "range": "80 m"}, Camera, "camera"),
    ({"kind": "camera", "fidelity": "object", "range": "80 m"}, Camera, "camera"),
    (
        {"kind": "camera", "fidelity": "physical", "mount": {"z": "1.3 m"}},
        PhysicalCamera,
        "camera/physical",
    ),
    ({"kind": "radar", "range": "80 m"}, Radar, "radar"),
    ({"kind": "radar", "fidelity": "physical", "range": "80 m"}, PhysicalRadar, "radar/physical"),
    ({"kind": "lidar", "range": "80 m"}, Lidar, "lidar"),
    (
        {"kind": "lidar", "fidelity": "physical", "range": "80 m", "mount": {"z": "1 m"}},
        PhysicalLidar,
        "lidar/physical",
    ),
    ({"kind": "ultrasonic", "range": "5 m"}, Ultrasonic, "ultrasonic"),
]


@pytest.mark.parametrize(("content", "model", "name"), KINDS)
def test_kind_and_fidelity_choose_the_model(
    content: dict[str, Any], model: type[SensorRecord], name: str
) -> None:
    sensor = SENSOR.validate_python(SEEING | content)
    assert type(sensor) is model
    assert model_name(sensor) == name
    assert SENSOR.validate_python(sensor.model_dump(mode="json"), context=SI) == sensor


@pytest.mark.parametrize(("kind", "model"), [("gnss", Gnss), ("imu", Imu)])
def test_sensors_of_the_own_motion_need_a_rate_only(kind: str, model: type[SensorRecord]) -> None:
    assert type(SENSOR.validate_python({"kind": kind, "rate": "20 Hz"})) is model


def test_plugin_is_named_by_its_entry_point() -> None:
    sensor = SENSOR.validate_python({"kind": "pack.sonar:Sonar", "rate": "20 Hz"})
    assert isinstance(sensor, PluginSensor)
    assert model_name(sensor) == "pack.sonar:Sonar"


@pytest.mark.parametrize(
    "content",
    [
        {"kind": "camera", "fidelity": "exact", "range": "80 m"},
        {"kind": "camera", "fidelity": "physical"},
        {"kind": "camera", "fidelity": "physical", "mount": {"z": "0 m"}},
        {"kind": "camera", "fidelity": "physical", "mount": {"z": "1 m"}, "range": "80 m"},
        {
            "kind": "camera",
            "fidelity": "physical",
            "mount": {"z": "1 m"},
            "field_of_view": "170 deg",
        },
        {"kind": "lidar", "fidelity": "physical", "range": "80 m", "mount": LOW, "beams": 1},
        {"kind": "lidar", "fidelity": "physical", "range": "80 m", "mount": {"z": "0.1 m"}},
        {"kind": "radar", "fidelity": "physical", "range": "80 m", "false_alarm_rate": 0.0},
        {"kind": "ultrasonic", "range": "5 m", "fidelity": "object"},
    ],
)
def test_what_a_model_does_not_have_is_refused(content: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        SENSOR.validate_python(SEEING | content)


def test_radar_that_would_see_more_false_alarms_than_objects_is_told_what_to_change() -> None:
    fields = {"kind": "radar", "fidelity": "physical", "range": "150 m", **SEEING}
    # 300 cells of range, 800 of range rate.
    assert PhysicalRadar.model_validate(fields).cells == pytest.approx(240_000.0)
    with pytest.raises(ValidationError, match=r"0\.001 in each of 240000 cells makes 240 false"):
        SENSOR.validate_python({**fields, "false_alarm_rate": 1e-3})
    coarse = {**fields, "false_alarm_rate": 1e-3, "range_resolution": "5 m"}
    assert PhysicalRadar.model_validate(coarse).cells == pytest.approx(24_000.0)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"kind": "camera", "mount": {"z": "1 m"}, "rows": 40, "min_pixel_height": 50}, "50 of 40"),
        (
            {
                "kind": "camera",
                "mount": {"z": "1 m"},
                "patches": {"dirt": {"column": 160, "columns": 4, "rows": 4}},
            },
            "outside of the image of 160 x 60",
        ),
        ({"kind": "lidar", "mount": LOW, "range": "9 m", "beams": 9, "min_points": 10}, "never"),
        ({"kind": "lidar", "mount": LOW, "range": "9 m", "layers": 4}, "need an angle"),
        ({"kind": "ultrasonic", "range": "5 m", "blind_zone": "5 m"}, "nothing is left"),
    ],
)
def test_sensor_that_can_never_detect_is_refused(content: dict[str, Any], said: str) -> None:
    physical = {} if content["kind"] == "ultrasonic" else {"fidelity": "physical"}
    with pytest.raises(ValidationError, match=said):
        SENSOR.validate_python(SEEING | physical | content)
