"""Architectures for tests of the suite analysis, in SI units: one ego, sensors as asked for."""

from typing import Any

from adeye.analysis.suite.geometry import View, view_of
from adeye.spec.architecture import Architecture, Vehicle
from adeye.spec.quantity import SI

LENGTH, WIDTH, HEIGHT = 4.9, 1.9, 1.6
FRONT = 0.5 * LENGTH
ROOF = {"x": 0.0, "y": 0.0, "z": 2.0}
BUMPER = {"x": FRONT, "y": 0.0, "z": 0.5}

VEHICLE: dict[str, Any] = {
    "length": LENGTH,
    "width": WIDTH,
    "height": HEIGHT,
    "wheelbase": 2.9,
    "max_acceleration": 3.0,
    "max_deceleration": 9.0,
    "max_steering_angle": 0.6,
    "max_steering_rate": 0.5,
    "acceleration_lag": 0.15,
    "steering_lag": 0.1,
}


def radar(**changes: Any) -> dict[str, Any]:
    """Describe a radar at the front bumper: 40 degrees, 200 m, 20 Hz."""
    return {
        "kind": "radar",
        "mount": BUMPER,
        "field_of_view": 0.7,
        "range": 200.0,
        "rate": 20.0,
        "latency": 0.1,
        **changes,
    }


def all_around(**changes: Any) -> dict[str, Any]:
    """Describe a sensor on the roof that looks everywhere."""
    return radar(mount=ROOF, field_of_view=6.283185307179586, **changes)


def architecture(sensors: dict[str, Any], **changes: Any) -> Architecture:
    """Put sensors on the ego, each linked to one nominal channel."""
    content = {
        "architecture": "some",
        "title": "Some",
        "vehicle": VEHICLE,
        "sensors": sensors,
        "channels": {
            "nominal": {"kind": "nominal", "links": list(sensors), "rate": 20.0, "delay": 0.05}
        },
        "switch": {"policy": "fixed_priority", "priority": ["nominal"], "default": "nominal"},
        **changes,
    }
    return Architecture.model_validate(content, context=SI)


def vehicle() -> Vehicle:
    return Vehicle.model_validate(VEHICLE, context=SI)


def view(**changes: Any) -> View:
    """Place one radar."""
    return view_of(architecture({"eye": radar(**changes)}).sensors["eye"], vehicle())
