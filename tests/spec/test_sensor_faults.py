"""Faults of sensors: of their bodies, signals, objects and timing."""

from typing import Any, get_args

import pytest
from pydantic import ValidationError

from adeye.simulate.sensors.rig import BUILT_IN
from adeye.spec.fault import FAULT
from adeye.spec.quantity import SI
from adeye.spec.sensor_faults import DELIVERS, SIGNALS, SignalName, delivered, signals_of
from adeye.spec.sensors import PluginSensor
from tests.refusals import refused
from tests.simulate.faults.streams import SUITE
from tests.stored import stored

TABLES = stored("definitions")


# --- What sensors deliver, and so which faults have a meaning for them ----------------------------


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
    TABLES["fault without a meaning for a sensor says so where it is written"],
)
def test_fault_without_a_meaning_for_a_sensor_says_so_where_it_is_written(
    model: str, parameters: dict[str, Any], sensor: str, loc: str
) -> None:
    found = fault(model, **parameters).misfits(SUITE.sensors[sensor])
    assert [place for place, _ in found] == [(loc,)]


# --- The list of objects --------------------------------------------------------------------------

FIXED = {"id": "a", "target": "sensors.a", "onset": {"at": "0 s"}}


def test_what_cannot_be_is_refused() -> None:
    for wrong in TABLES["what cannot be is refused"]:
        refused(ValidationError, FAULT.validate_python, {**FIXED, **wrong})


def test_classes_are_of_the_structure_of_a_batch() -> None:
    fault: Any = FAULT.validate_python({**FIXED, "model": "miss", "classes": ["car", "bus"]})
    assert [getattr(fault, name) for name in fault.STRUCTURE] == [("car", "bus")]


# --- The body: where it looks, how far, and through what ------------------------------------------


def test_what_cannot_be_is_refused_of_sensor_bodies() -> None:
    for wrong in TABLES["what cannot be is refused of sensor bodies"]:
        refused(ValidationError, FAULT.validate_python, {**FIXED, **wrong})


def test_whole_turn_is_no_miscalibration() -> None:
    wrong = {**FIXED, "model": "miscalibration", "yaw": "360 deg"}
    refused(ValidationError, FAULT.validate_python, wrong, says="yaw")


def test_lens_is_dark_and_sensor_straight_unless_given() -> None:
    dark: Any = FAULT.validate_python({**FIXED, "model": "blackout"})
    straight: Any = FAULT.validate_python({**FIXED, "model": "miscalibration"})
    assert dark.transmission == 0.0
    assert (straight.yaw, straight.x, straight.y) == (0.0, 0.0, 0.0)


# --- The numbers that sensors measure -------------------------------------------------------------


def read(**parameters: Any) -> Any:
    return FAULT.validate_python({**FIXED, **parameters})


@pytest.mark.parametrize(
    ("signal", "size", "value"),
    [("x", "50 cm", 0.5), ("bearing", "180 deg", 3.141592653589793), ("range_rate", "36 km/h", 10)],
)
def test_size_is_read_in_the_unit_of_its_signal(signal: str, size: str, value: float) -> None:
    assert read(model="bias", signal=signal, size=size).size == pytest.approx(value)


def test_stored_fault_is_read_again() -> None:
    fault = read(model="noise", signal="yaw_rate", size="2 deg/s")
    again: Any = FAULT.validate_python(fault.model_dump(mode="json"), context=SI)
    assert again == fault


def test_wrong_value_is_refused_at_its_place() -> None:
    for wrong, loc in TABLES["wrong value is refused at its place"]:
        caught = refused(ValidationError, read, **wrong)
        assert [error["loc"][-1] for error in caught.errors()] == [loc]


def test_signal_is_of_the_structure_of_a_batch() -> None:
    assert read(model="bias", signal="x", size="1 m").STRUCTURE == ("signal",)


# --- When samples come ----------------------------------------------------------------------------


def test_identity_of_a_drop_out_is_what_it_was() -> None:
    fault = FAULT.validate_python({**FIXED, "model": "drop_out"})
    assert set(fault.executable()) == {"id", "target", "model", "onset", "duration"}


def test_what_no_sensor_can_have_is_refused() -> None:
    for wrong in TABLES["what no sensor can have is refused"]:
        refused(ValidationError, FAULT.validate_python, {**FIXED, **wrong})
