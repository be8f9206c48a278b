from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT
from adeye.spec.quantity import SI

FIXED = {"id": "a", "target": "sensors.a", "onset": {"at": "0 s"}}


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


@pytest.mark.parametrize(
    ("wrong", "loc"),
    [
        ({"model": "bias", "signal": "x", "size": "1 s"}, "size"),
        ({"model": "bias", "signal": "x", "size": 1.0}, "size"),
        ({"model": "bias", "signal": "z", "size": "1 m"}, "signal"),
        ({"model": "noise", "signal": "x", "size": "-1 m"}, "size"),
        ({"model": "bit_flip", "signal": "x", "bit": 64}, "bit"),
        ({"model": "drift", "signal": "x", "size": "1 m", "over": "0 s"}, "over"),
        ({"model": "spike", "signal": "x", "size": "1 m", "probability": 1.1}, "probability"),
    ],
)
def test_wrong_value_is_refused_at_its_place(wrong: dict[str, Any], loc: str) -> None:
    with pytest.raises(ValidationError) as caught:
        read(**wrong)
    assert [error["loc"][-1] for error in caught.value.errors()] == [loc]


def test_signal_is_of_the_structure_of_a_batch() -> None:
    assert read(model="bias", signal="x", size="1 m").STRUCTURE == ("signal",)
