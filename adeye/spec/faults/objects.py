"""Faults of the list of objects that a sensor reports."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from adeye.spec.faults.sensing import SensorFault, delivered
from adeye.spec.misplaced import Loc
from adeye.spec.quantity import Angle, Length, Many, Number, Speed
from adeye.spec.sensors import model_name

if TYPE_CHECKING:
    from adeye.spec.sensors import SensorRecord

ClassName = Literal[
    "car",
    "van",
    "truck",
    "bus",
    "motorcycle",
    "cyclist",
    "pedestrian",
    "parked_truck",
    "parked_car",
    "barrier",
    "building",
]
Classes = Annotated[Many[ClassName], Field(min_length=1)]
Share = Annotated[Number, Field(ge=0.0, le=1.0)]
Bearing = Annotated[Angle, Field(ge=-math.pi, le=math.pi)]


class _OfSome(SensorFault):
    """A fault of some of the objects: those for which all that is given holds."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("classes",)
    neutral = ({"probability": 0.0},)
    needs = ("detections",)

    probability: Share = 1.0
    """Of each object in each sample."""
    classes: Classes | None = None
    """Of the object itself, whatever the sensor takes it for; all unless given."""


class Miss(_OfSome):
    """Objects that are there are not reported."""

    model: Literal["miss"]
    beyond: Annotated[Length, Field(ge=0.0)] = 0.0
    """Only those farther from the sensor than this [m]."""
    right: Bearing = -math.pi
    """Only those from this bearing, counted at the sensor from the vehicle's x axis ..."""
    left: Bearing = math.pi
    """... on to the left, up to this one."""

    def misfits(self, sensor: SensorRecord) -> list[tuple[Loc, str]]:
        """Say that a sensor does not measure bearings, if there is a sector."""
        found = super().misfits(sensor)
        is_sector = (self.right, self.left) != (-math.pi, math.pi)
        if not found and is_sector and "bearings" not in delivered(sensor):
            found.append((("left",), f"a {model_name(sensor)} does not measure bearings"))
        return found


class Misclassify(_OfSome):
    """Objects are taken for some of another class."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("classes", "taken_for")
    needs = ("classes",)
    model: Literal["misclassify"]
    taken_for: ClassName


class Split(_OfSome):
    """An object is reported as two, side by side, each half as wide."""

    model: Literal["split"]


class Ghost(SensorFault):
    """An object is reported that is not there.

    It appears at a place in the vehicle frame and from then on moves in the map, straight on along
    the heading that the ego had, as far as the ego's motion at the time tells.
    """

    STRUCTURE: ClassVar[tuple[str, ...]] = ("taken_for",)
    needs = ("detections",)
    model: Literal["ghost"]
    x: Length
    y: Length = 0.0
    speed: Speed = 0.0
    """Over ground [m/s]."""
    length: Annotated[Length, Field(ge=0.0)] = 4.5
    width: Annotated[Length, Field(ge=0.0)] = 1.8
    taken_for: ClassName = "car"
