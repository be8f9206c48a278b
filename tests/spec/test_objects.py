from typing import Any, get_args

import pytest
from pydantic import ValidationError

from adeye.signals import OBJECT_CLASSES
from adeye.spec.fault import FAULT
from adeye.spec.sensor_faults import ClassName

FIXED = {"id": "a", "target": "sensors.a", "onset": {"at": "0 s"}}


def test_classes_are_those_of_objects() -> None:
    assert get_args(ClassName) == OBJECT_CLASSES


@pytest.mark.parametrize(
    "wrong",
    [
        {"model": "miss", "classes": []},
        {"model": "miss", "classes": ["tree"]},
        {"model": "miss", "left": "190 deg"},
        {"model": "ghost"},
        {"model": "misclassify"},
        {"model": "split", "probability": -0.1},
    ],
)
def test_what_cannot_be_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        FAULT.validate_python({**FIXED, **wrong})


def test_classes_are_of_the_structure_of_a_batch() -> None:
    fault: Any = FAULT.validate_python({**FIXED, "model": "miss", "classes": ["car", "bus"]})
    assert [getattr(fault, name) for name in fault.STRUCTURE] == [("car", "bus")]
