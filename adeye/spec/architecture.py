"""An architecture: vehicle, sensors, channels with their links, and the switch."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from adeye.spec.channels import Channel, PositiveAcceleration
from adeye.spec.misplaced import Loc, misplaced, repeated
from adeye.spec.quantity import (
    Angle,
    AngularRate,
    ById,
    Identifier,
    Number,
    Record,
    Text,
)
from adeye.spec.sensors import NonNegativeDuration, PositiveLength, Sensor
from adeye.spec.switch import Switch


class Vehicle(Record):
    """The ego's body and limits; every other part reads them from here."""

    length: PositiveLength
    width: PositiveLength
    height: PositiveLength
    wheelbase: PositiveLength
    mass: Annotated[Number, Field(gt=0.0)] = 1800.0
    max_acceleration: PositiveAcceleration
    max_deceleration: PositiveAcceleration
    max_steering_angle: Annotated[Angle, Field(gt=0.0)]
    max_steering_rate: Annotated[AngularRate, Field(gt=0.0)]
    acceleration_lag: NonNegativeDuration
    """Time constant of the first-order drive and brake response [s]."""
    steering_lag: NonNegativeDuration
    """Time constant of the first-order steering response [s]."""


class Architecture(Record):
    """One candidate arrangement of vehicle, sensors, channels and switch."""

    architecture: Identifier
    title: Text
    text: str = ""
    vehicle: Vehicle
    sensors: Annotated[ById[Sensor], Field(min_length=1)]
    channels: Annotated[ById[Channel], Field(min_length=1)]
    switch: Switch
    cost: Annotated[Number, Field(ge=0.0)] = 0.0

    @model_validator(mode="after")
    def _links_exist(self) -> Self:
        known = [*self.sensors, *(f"channels.{name}" for name in self.channels), "switch"]
        found: list[tuple[Loc, str]] = []
        for name, channel in self.channels.items():
            for at, link in enumerate(channel.links):
                loc = ("channels", name, "links", at)
                if link not in known:
                    text = f"channel {name!r} links {link!r}, which is none of {', '.join(known)}"
                    found.append((loc, text))
                elif at in repeated(channel.links):
                    found.append((loc, f"channel {name!r} links {link!r} twice"))
        for at, name in enumerate(self.switch.priority):
            if name not in self.channels:
                text = f"{name!r} is no channel of this architecture: {', '.join(self.channels)}"
                found.append((("switch", "priority", at), text))
        if found:
            raise misplaced(found)
        return self

    def executable(self) -> dict[str, object]:
        """The part that a run depends on: never cost, texts or the elements that it realises.

        Nor the names of files that channels read: their content counts, as that of code does, in
        the identity of the result.
        """
        part = self.model_dump(mode="json", exclude={"architecture", "title", "text", "cost"})
        for record in [*part["sensors"].values(), *part["channels"].values(), part["switch"]]:
            for key in ("cost", "text", "realises", "files"):
                record.pop(key, None)
        return part


ACTUATORS = ("drive", "brake", "steering")
"""What moves the vehicle, as targets of faults."""


def targets_of(architecture: Architecture) -> list[str]:
    """List what of an architecture a fault can be injected into.

    A link is named by the channel that it leads to and what it brings.
    """
    return [
        *(f"sensors.{name}" for name in architecture.sensors),
        *(f"channels.{name}" for name in architecture.channels),
        *(f"hooks.{name}" for name in architecture.channels),
        *(
            f"links.{name}.{link}"
            for name, channel in architecture.channels.items()
            for link in channel.links
        ),
        *(f"actuators.{name}" for name in ACTUATORS),
        "tyres",
        "switch",
    ]
