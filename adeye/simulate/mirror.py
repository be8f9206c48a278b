"""Left-hand traffic: the run takes place in the mirror, and what is the vehicle's is turned round.

All that drives knows right-hand roads only. The road of a test case in left-hand traffic is given
as its mirror image, and what the scenario says of right and left is said of that. A sensor on the
left of the vehicle is on its right there, and a fault that steers to the left steers to the right.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeVar

from adeye.spec import fault as commands
from adeye.spec import fault_base as actuators
from adeye.spec import sensor_faults as sensed
from adeye.spec.quantity import Record
from adeye.spec.sensors import PhysicalCamera, Sensor

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.spec.architecture import Architecture
    from adeye.sweep.case import TestCase

Part = TypeVar("Part", bound=Record)

TURNED: Final[dict[type[Any], tuple[str, ...]]] = {
    commands.Bias: ("steering_angle",),
    commands.Oscillating: ("steering_angle",),
    commands.PlausibleButWrong: ("steering_angle",),
    commands.MapShifted: ("offset",),
    actuators.Offset: ("steering_angle",),
    sensed.Jump: ("y", "heading"),
    sensed.Ghost: ("y",),
    sensed.Miscalibration: ("y", "yaw"),
    **dict.fromkeys((sensed.Bias, sensed.Drift, sensed.Spike), ("size",)),
    sensed.StuckAt: ("value",),
}
"""Fields of faults that are positive to the left; of those of signals, if the signal is."""

LATERAL: Final = (
    *("y", "bearing", "ego_y", "ego_heading", "ego_yaw_rate"),
    *("position_y", "velocity_y", "acceleration_y", "yaw_rate"),
)
"""Signals of sensors that are positive to the left."""


def as_driven(cases: Sequence[TestCase]) -> Sequence[TestCase]:
    """Return the test cases of a batch as they are executed, under the identities that they have.

    Args:
        cases: Of one structure: traffic keeps to one side in all of them.
    """
    if cases[0].scenario.world.road.traffic == "right":
        return cases
    known = {id(case.architecture): case.architecture for case in cases}
    turned = {key: _architecture(architecture) for key, architecture in known.items()}
    return [
        replace(
            case,
            architecture=turned[id(case.architecture)],
            faults=tuple(_fault(fault, case.architecture) for fault in case.faults),
        ).identified(case.stream_seed, case.situation_digest, case.digest)
        for case in cases
    ]


def _architecture(architecture: Architecture) -> Architecture:
    sensors = {name: _sensor(sensor) for name, sensor in architecture.sensors.items()}
    return architecture.model_copy(update={"sensors": sensors})


def _sensor(sensor: Sensor) -> Sensor:
    found: dict[str, Any] = {}
    if hasattr(sensor, "mount"):
        found["mount"] = _turned(sensor.mount, ("y", "yaw"))
    if isinstance(sensor, PhysicalCamera):
        columns = sensor.columns
        found["patches"] = {name: _across(item, columns) for name, item in sensor.patches.items()}
    return sensor.model_copy(update=found)


def _fault(fault: commands.Fault, architecture: Architecture) -> commands.Fault:
    if isinstance(fault, sensed.Miss | sensed.BlindSector):
        return fault.model_copy(update={"right": 0.0 - fault.left, "left": 0.0 - fault.right})
    if isinstance(fault, sensed.DeadPixels | sensed.PixelNoise):
        camera = architecture.sensors[fault.target_id]
        pixels: commands.Fault = _across(fault, getattr(camera, "columns", 0))
        return pixels
    if isinstance(fault, sensed.SignalFault) and fault.signal not in LATERAL:
        return fault
    return _turned(fault, TURNED.get(type(fault), ()))


def _turned(part: Part, fields: Sequence[str]) -> Part:
    return part.model_copy(update={name: 0.0 - getattr(part, name) for name in fields})


def _across(part: Any, columns: int) -> Any:
    """Move a rectangle to the other side of an image; what is beyond its edge is cut off."""
    end = min(part.column + part.columns, columns)
    return part.model_copy(update={"column": columns - end, "columns": end - part.column})
