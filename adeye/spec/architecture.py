"""An architecture: vehicle, sensors, channels with their links, and the switch."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Annotated, ClassVar, Final

from pydantic import Field

from adeye.errors import suggest
from adeye.spec.channels import Channel, ReferenceChannel, SafetyChannel
from adeye.spec.document import Problem, finds, repeated
from adeye.spec.plausible import FileRecord, Limits
from adeye.spec.program import Plant
from adeye.spec.quantity import Angle, AngularRate, ById, GrownRecord, Identifier, Number, Text
from adeye.spec.sensors import NonNegativeDuration, PositiveLength, Sensor
from adeye.spec.supervisor import PositiveAcceleration
from adeye.spec.switch import Switch

HEALTH: Final = "health."
"""Begins a link that shows of a sensor only whether it delivers, and when it sampled last."""


NEAR: Final = 2.0
"""How far from the body a sensor may be mounted [m]: masts, roof racks, test rigs. Our choice."""


class Vehicle(GrownRecord):
    """The ego's body and limits; every other part reads them from here."""

    later: ClassVar[tuple[str, ...]] = ("plant",)

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
    plant: Plant | None = None
    """An FMU that moves it, instead of the built-in single-track model."""


class Architecture(FileRecord):
    """One candidate arrangement of vehicle, sensors, channels and switch."""

    architecture: Identifier
    title: Text
    text: str = ""
    vehicle: Vehicle
    sensors: Annotated[ById[Sensor], Field(min_length=1)]
    channels: Annotated[ById[Channel], Field(min_length=1)]
    switch: Switch
    cost: Annotated[Number, Field(ge=0.0)] = 0.0

    @finds
    def _links_exist(self) -> Iterator[Problem]:
        known = [
            *self.sensors,
            *(f"channels.{name}" for name in self.channels),
            "switch",
            *(f"{HEALTH}{name}" for name in self.sensors),
        ]
        for name, channel in self.channels.items():
            for at, link in enumerate(channel.links):
                loc = ("channels", name, "links", at)
                if link not in known:
                    text = f"channel {name!r} links {link!r}, which is none of {', '.join(known)}"
                    near = suggest(link, known)
                    yield loc, f"{text}. {near}" if near.endswith("?") else text
                elif at in repeated(channel.links):
                    yield loc, f"channel {name!r} links {link!r} twice"
            if isinstance(channel, SafetyChannel):
                yield from _unlinked(name, channel, self.sensors, self.channels)
            if isinstance(channel, ReferenceChannel):
                yield from _untrue(name, channel, self.sensors)
        for at, name in enumerate(self.switch.priority):
            if name not in self.channels:
                text = f"{name!r} is no channel of this architecture: {', '.join(self.channels)}"
                yield ("switch", "priority", at), text

    def own_limits(self) -> Limits:
        """The wheels stand below the body, and a sensor on it or near it."""
        body = self.vehicle
        along, across = 0.5 * body.length + NEAR, 0.5 * body.width + NEAR
        return {
            "wheelbase": (0.2, body.length),
            "mount.x": (-along, along),
            "mount.y": (-across, across),
            "mount.z": (0.0, body.height + NEAR),
        }

    def executable(self) -> dict[str, object]:
        """The part that a run depends on: never cost, texts or the elements that it realises.

        Nor the names of files that channels read: their content counts, as that of code does, in
        the identity of the result.
        """
        part = self.model_dump(
            mode="json", exclude={*self.later, "architecture", "title", "text", "cost"}
        )
        for record in [*part["sensors"].values(), *part["channels"].values(), part["switch"]]:
            for key in ("cost", "text", "realises", "files"):
                record.pop(key, None)
        return part


def _untrue(
    name: str, channel: ReferenceChannel, sensors: Mapping[str, Sensor]
) -> Iterator[Problem]:
    """Find what keeps a reference driver from seeing the scene as it is at each of its ticks."""
    linked = [sensors[link] for link in channel.links if link in sensors]
    fits = [
        sensor
        for sensor in linked
        if sensor.kind == "ground_truth"
        and sensor.latency == 0.0
        and sensor.jitter == 0.0
        and sensor.rate == channel.rate
    ]
    if len(channel.links) != 1 or len(fits) != 1:
        text = (
            f"channel {name!r} is a reference driver: it links one sensor and nothing else, of "
            f"kind ground_truth, without latency and jitter, at its own {channel.rate:g} Hz"
        )
        yield ("channels", name, "links"), text


def _unlinked(
    name: str, channel: SafetyChannel, sensors: Collection[str], channels: Collection[str]
) -> Iterator[Problem]:
    """Find what the monitors of a channel watch although nothing of it is linked to the channel."""
    supervisor = channel.parameters.supervisor
    for monitor, spec in ({} if supervisor is None else supervisor.monitors).items():
        of_sensors = spec.kind == "sensor_silent"
        there, what = (sensors, "sensor") if of_sensors else (channels, "channel")
        for at, watched in enumerate(getattr(spec, "watches", ())):
            loc = ("channels", name, "parameters", "supervisor", "monitors", monitor, "watches", at)
            link = f"{HEALTH if of_sensors else 'channels.'}{watched}"
            if watched not in there:
                text = f"{monitor!r} watches {watched!r}, which is no {what}: {', '.join(there)}"
                yield loc, text
            elif link not in channel.links and not (of_sensors and watched in channel.links):
                text = (
                    f"{monitor!r} watches {watched!r}, which channel {name!r} does not link; add "
                    f"{link} to its links"
                )
                yield loc, text


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
