from typing import Any, get_args

import pytest

from adeye.simulate.sensors.rig import BUILT_IN
from adeye.spec.fault import FAULT
from adeye.spec.sensor_faults import DELIVERS, SIGNALS, SignalName, delivered, signals_of
from adeye.spec.sensors import PluginSensor
from tests.simulate.faults.streams import SUITE


def fault(model: str, **parameters: Any) -> Any:
    fixed = {"id": "a", "target": "sensors.a", "model": model, "onset": {"at": "0 s"}}
    return FAULT.validate_python({**fixed, **parameters})


def test_what_is_delivered_is_said_of_every_model_of_sensor() -> None:
    assert set(DELIVERS) == set(BUILT_IN)


def test_signal_is_told_by_its_name_alone() -> None:
    assert set(get_args(SignalName)) == set(SIGNALS)


def test_every_signal_is_measured_by_a_sensor_and_no_sensor_but_a_plugin_by_none() -> None:
    measured = {name: set(signals_of(sensor)) for name, sensor in SUITE.sensors.items()}
    assert set().union(*measured.values()) == set(SIGNALS)
    assert all(measured.values())


def test_plugin_has_a_list_of_detections() -> None:
    plugin = PluginSensor.model_validate({"kind": "./a.py:B", "rate": "10 Hz"})
    assert not fault("miss").misfits(plugin)
    assert fault("jump", x="1 m").misfits(plugin)
    assert "range" not in delivered(plugin)


@pytest.mark.parametrize(
    ("model", "parameters", "sensor", "loc"),
    [
        ("miss", {}, "gnss", "model"),
        ("ghost", {"x": "20 m"}, "beam_lidar", "model"),
        ("misclassify", {"taken_for": "car"}, "cell_radar", "model"),
        ("blind_sector", {"right": "0 deg", "left": "9 deg"}, "ultrasonic", "model"),
        ("range_loss", {"factor": 0.5}, "pixel_camera", "model"),
        ("blackout", {}, "camera", "model"),
        ("jump", {"x": "1 m"}, "imu", "model"),
        ("jump", {"heading": "1 deg"}, "gnss", "heading"),
        ("miss", {"right": "0 deg"}, "ultrasonic", "left"),
        ("bias", {"signal": "range_rate", "size": "1 m/s"}, "camera", "signal"),
        ("bias", {"signal": "x", "size": "1 m"}, "localisation", "signal"),
        ("dead_pixels", {"columns": 321, "rows": 1}, "pixel_camera", "columns"),
        (
            "pixel_noise",
            {"row": 1, "columns": 1, "rows": 120, "noise": 0.1},
            "pixel_camera",
            "rows",
        ),
    ],
)
def test_fault_without_a_meaning_for_a_sensor_says_so_where_it_is_written(
    model: str, parameters: dict[str, Any], sensor: str, loc: str
) -> None:
    found = fault(model, **parameters).misfits(SUITE.sensors[sensor])
    assert [place for place, _ in found] == [(loc,)]
