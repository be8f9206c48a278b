"""Sensors as users write them: what a model does not have, and what can never detect."""

from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from adeye.spec import sensors
from adeye.spec.quantity import SI
from adeye.spec.sensors import PhysicalRadar, PluginSensor, Sensor, SensorRecord, model_name
from tests.refusals import refused

SENSOR: TypeAdapter[SensorRecord] = TypeAdapter(Sensor)
SEEING: dict[str, Any] = {"rate": "10 Hz", "mount": {"x": "1 m"}, "field_of_view": "60 deg"}
PHYSICAL = {"fidelity": "physical", "mount": {"z": "1.3 m"}}
KINDS: list[tuple[dict[str, Any], type[SensorRecord], str]] = [
    ({"kind": "camera", "range": "80 m"}, sensors.Camera, "camera"),
    ({"kind": "camera", "fidelity": "object", "range": "80 m"}, sensors.Camera, "camera"),
    ({"kind": "camera", **PHYSICAL}, sensors.PhysicalCamera, "camera/physical"),
    ({"kind": "radar", "range": "80 m"}, sensors.Radar, "radar"),
    ({"kind": "radar", "range": "80 m", **PHYSICAL}, PhysicalRadar, "radar/physical"),
    ({"kind": "lidar", "range": "80 m"}, sensors.Lidar, "lidar"),
    ({"kind": "lidar", "range": "80 m", **PHYSICAL}, sensors.PhysicalLidar, "lidar/physical"),
    ({"kind": "ultrasonic", "range": "5 m"}, sensors.Ultrasonic, "ultrasonic"),
]


@pytest.mark.parametrize(("content", "model", "name"), KINDS)
def test_kind_and_fidelity_choose_the_model(
    content: dict[str, Any], model: type[SensorRecord], name: str
) -> None:
    sensor = SENSOR.validate_python(SEEING | content)
    assert type(sensor) is model
    assert model_name(sensor) == name
    assert SENSOR.validate_python(sensor.model_dump(mode="json"), context=SI) == sensor


def test_sensors_of_the_own_motion_need_a_rate_only() -> None:
    for kind, model in (("gnss", sensors.Gnss), ("imu", sensors.Imu)):
        assert type(SENSOR.validate_python({"kind": kind, "rate": "20 Hz"})) is model


def test_plugin_is_named_by_its_entry_point() -> None:
    sensor = SENSOR.validate_python({"kind": "pack.sonar:Sonar", "rate": "20 Hz"})
    assert isinstance(sensor, PluginSensor)
    assert model_name(sensor) == "pack.sonar:Sonar"


def test_what_a_model_does_not_have_is_refused() -> None:
    for content in (
        {"kind": "camera", "fidelity": "exact", "range": "80 m"},
        {"kind": "camera", "fidelity": "physical"},
        {"kind": "camera", **PHYSICAL, "mount": {"z": "0 m"}},
        {"kind": "camera", **PHYSICAL, "range": "80 m"},
        {"kind": "camera", **PHYSICAL, "field_of_view": "170 deg"},
        {"kind": "lidar", **PHYSICAL, "range": "80 m", "beams": 1},
        {"kind": "lidar", **PHYSICAL, "range": "80 m", "mount": {"z": "0.1 m"}},
        {"kind": "radar", **PHYSICAL, "range": "80 m", "false_alarm_rate": 0.0},
        {"kind": "ultrasonic", "range": "5 m", "fidelity": "object"},
    ):
        refused(ValidationError, SENSOR.validate_python, SEEING | content)


def test_radar_that_would_see_more_false_alarms_than_objects_is_told_what_to_change() -> None:
    fields = {"kind": "radar", "fidelity": "physical", "range": "150 m", **SEEING}
    # 300 cells of range, 800 of range rate.
    assert PhysicalRadar.model_validate(fields).cells == pytest.approx(240_000.0)
    with pytest.raises(ValidationError, match=r"0\.001 in each of 240000 cells makes 240 false"):
        SENSOR.validate_python({**fields, "false_alarm_rate": 1e-3})
    coarse = {**fields, "false_alarm_rate": 1e-3, "range_resolution": "5 m"}
    assert PhysicalRadar.model_validate(coarse).cells == pytest.approx(24_000.0)


DIRT = {"dirt": {"column": 160, "columns": 4, "rows": 4}}
NEVER: list[tuple[dict[str, Any], str]] = [
    ({"kind": "camera", **PHYSICAL, "rows": 40, "min_pixel_height": 50}, "50 of 40"),
    ({"kind": "camera", **PHYSICAL, "patches": DIRT}, "outside of the image of 160 x 60"),
    ({"kind": "lidar", **PHYSICAL, "range": "9 m", "beams": 9, "min_points": 10}, "never"),
    ({"kind": "lidar", **PHYSICAL, "range": "9 m", "layers": 4}, "need an angle"),
    ({"kind": "ultrasonic", "range": "5 m", "blind_zone": "5 m"}, "nothing is left"),
]


def test_sensor_that_can_never_detect_is_refused() -> None:
    for content, said in NEVER:
        refused(ValidationError, SENSOR.validate_python, SEEING | content, says=said)
