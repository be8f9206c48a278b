from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT

FIXED = {"id": "a", "target": "sensors.a", "onset": {"at": "0 s"}}


@pytest.mark.parametrize(
    "wrong",
    [
        {"model": "blind_sector", "left": "1 deg"},
        {"model": "range_loss", "factor": 1.5},
        {"model": "dead_pixels", "columns": 3},
        {"model": "dead_pixels", "columns": 3, "rows": 3, "row": -1},
        {"model": "pixel_noise", "columns": 3, "rows": 3, "noise": -0.1},
        {"model": "blackout", "transmission": "5 m"},
    ],
)
def test_what_cannot_be_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        FAULT.validate_python({**FIXED, **wrong})


def test_lens_is_dark_and_sensor_straight_unless_given() -> None:
    dark: Any = FAULT.validate_python({**FIXED, "model": "blackout"})
    straight: Any = FAULT.validate_python({**FIXED, "model": "miscalibration"})
    assert dark.transmission == 0.0
    assert (straight.yaw, straight.x, straight.y) == (0.0, 0.0, 0.0)
