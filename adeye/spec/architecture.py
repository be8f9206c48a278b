"""An architecture: vehicle, sensors, channels with their links, and the switch."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from adeye.spec.misplaced import Loc, misplaced, repeated
from adeye.spec.quantity import (
    PLUGIN,
    Acceleration,
    Angle,
    AngularRate,
    ById,
    Duration,
    Frequency,
    Identifier,
    Length,
    Many,
    Number,
    Record,
    Speed,
    Text,
)

PositiveLength = Annotated[Length, Field(gt=0.0)]
NonNegativeLength = Annotated[Length, Field(ge=0.0)]
NonNegativeDuration = Annotated[Duration, Field(ge=0.0)]
PositiveFrequency = Annotated[Frequency, Field(gt=0.0)]
PositiveAcceleration = Annotated[Acceleration, Field(gt=0.0)]
FieldOfView = Annotated[Angle, Field(gt=0.0, le=6.283185307179587)]
Share = Annotated[Number, Field(ge=0.0, le=1.0)]

PluginPath = Annotated[str, StringConstraints(pattern=PLUGIN)]
"""An entry point: ``module:Class`` or ``./file.py:Class``."""


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


class Mount(Record):
    """Pose of a sensor in the vehicle frame: x forward, y left of the box centre, z up."""

    x: Length = 0.0
    y: Length = 0.0
    z: Length = 0.0
    yaw: Angle = 0.0


class _Sensor(Record):
    rate: PositiveFrequency
    latency: NonNegativeDuration = 0.0
    realises: Identifier | None = None
    cost: Annotated[Number, Field(ge=0.0)] = 0.0
    text: str = ""


class _Ranging(_Sensor):
    mount: Mount
    field_of_view: FieldOfView
    range: PositiveLength
    min_visible: Share = 0.5
    """Smallest unoccluded share of an object's angular extent that is detected."""


class Camera(_Ranging):
    """Object-level camera: bearing is sharp, distance error grows with the distance squared."""

    kind: Literal["camera"]
    bearing_noise: Annotated[Angle, Field(ge=0.0)] = 0.0
    distance_noise: Share = 0.0
    """Standard deviation of the distance at full range, as a share of the range."""
    night_range: Share = 1.0
    """Share of the range that is left at night."""


class Radar(_Ranging):
    """Object-level radar: measures the range rate; rain does not shorten its range here."""

    kind: Literal["radar"]
    range_noise: NonNegativeLength = 0.0
    bearing_noise: Annotated[Angle, Field(ge=0.0)] = 0.0
    range_rate_noise: Annotated[Speed, Field(ge=0.0)] = 0.0


class Lidar(_Ranging):
    """Object-level lidar: its range follows the rain and the target's reflectivity."""

    kind: Literal["lidar"]
    reference_reflectivity: Annotated[Number, Field(gt=0.0, le=1.0)] = 0.9
    """Reflectivity at which the clear-weather range is specified."""
    range_noise: NonNegativeLength = 0.0
    bearing_noise: Annotated[Angle, Field(ge=0.0)] = 0.0


class Localisation(_Sensor):
    """Ego pose in the map and the vehicle's own motion sensors."""

    kind: Literal["localisation"]
    lateral_noise: NonNegativeLength = 0.0
    heading_noise: Annotated[Angle, Field(ge=0.0)] = 0.0
    speed_noise: Annotated[Speed, Field(ge=0.0)] = 0.0


class GroundTruth(_Sensor):
    """The scene as it is: every object and the ego's own state, without error."""

    kind: Literal["ground_truth"]


class PluginSensor(_Sensor):
    """A sensor from outside the package."""

    kind: PluginPath
    mount: Mount = Mount()
    parameters: dict[str, Any] = {}


BuiltInSensor = Annotated[
    Camera | Radar | Lidar | Localisation | GroundTruth, Field(discriminator="kind")
]
Sensor = BuiltInSensor | PluginSensor


class _Channel(Record):
    links: Many[str] = ()
    """What it receives: sensor ids, ``channels.<id>`` and ``switch``."""
    rate: PositiveFrequency = 20.0
    delay: NonNegativeDuration = 0.0
    """Compute time: its command acts this long after the observation [s]."""
    realises: Identifier | None = None
    cost: Annotated[Number, Field(ge=0.0)] = 0.0
    text: str = ""


class NominalParameters(Record):
    """Nominal channel: tracking, car following, lane keeping and emergency braking."""

    confirm_hits: Annotated[int, Field(ge=1, le=10)] = 3
    coast: NonNegativeDuration = 0.5
    """How long a confirmed track lives without a detection [s]."""
    gate: PositiveLength = 4.0
    time_gap: Annotated[Duration, Field(gt=0.0)] = 1.8
    standstill_gap: PositiveLength = 4.0
    max_acceleration: PositiveAcceleration = 1.5
    comfort_deceleration: PositiveAcceleration = 2.5
    emergency_deceleration: PositiveAcceleration = 8.0
    emergency_threshold: PositiveAcceleration = 3.5
    """Required deceleration from which it brakes with the emergency deceleration."""
    lateral_margin: NonNegativeLength = 0.3
    """How much nearer than touching an object's side must come to count as in the path [m]."""


class SafetyParameters(Record):
    """Safety channel: monitors with debounce and an in-lane safe stop."""

    staleness: Annotated[Duration, Field(gt=0.0)] = 0.2
    confirm: NonNegativeDuration = 0.1
    """How long a monitor must hold before it is confirmed [s]."""
    heal: NonNegativeDuration = 1.0
    stop_deceleration: PositiveAcceleration = 4.0
    """Deceleration of the minimal-risk stop [m/s²]."""
    emergency_deceleration: PositiveAcceleration = 8.0
    danger_threshold: PositiveAcceleration = 4.5
    """Required deceleration from which an object ahead is a danger [m/s²]."""
    max_command: PositiveAcceleration = 10.0
    max_lane_offset: PositiveLength = 1.0
    lateral_margin: NonNegativeLength = 0.2


class NominalChannel(_Channel):
    """The built-in nominal channel."""

    kind: Literal["nominal"]
    parameters: NominalParameters = NominalParameters()


class SafetyChannel(_Channel):
    """The built-in safety channel."""

    kind: Literal["safety"]
    parameters: SafetyParameters = SafetyParameters()


class PluginChannel(_Channel):
    """A channel from outside the package."""

    kind: PluginPath
    parameters: dict[str, Any] = {}


BuiltInChannel = Annotated[NominalChannel | SafetyChannel, Field(discriminator="kind")]
Channel = BuiltInChannel | PluginChannel


class Switch(Record):
    """Who acts: fixed priority with debounce, latch and staleness watchdog, or one channel."""

    policy: Literal["fixed_priority", "stuck"]
    priority: Annotated[Many[Identifier], Field(min_length=1)]
    """Channels, highest priority first."""
    default: Identifier
    """The channel that acts when nobody requests authority."""
    debounce: NonNegativeDuration = 0.0
    """How long a request must stand before it is granted [s]."""
    latch: bool = True
    """Whether authority, once taken by a higher priority, is kept to the end."""
    staleness: Annotated[Duration, Field(gt=0.0)] = 0.2
    """Age of the acting command from which the next channel takes over [s]."""
    realises: Identifier | None = None

    @model_validator(mode="after")
    def _default_is_listed(self) -> Self:
        found: list[tuple[Loc, str]] = [
            (("priority", at), f"channel {self.priority[at]!r} occurs twice")
            for at in repeated(self.priority)
        ]
        if self.default not in self.priority:
            text = f"{self.default!r} is not in priority: {', '.join(self.priority)}"
            found.append((("default",), text))
        if found:
            raise misplaced(found)
        return self


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
        """The part that a run depends on: never cost, texts or the elements that it realises."""
        part = self.model_dump(mode="json", exclude={"architecture", "title", "text", "cost"})
        for record in [*part["sensors"].values(), *part["channels"].values(), part["switch"]]:
            for key in ("cost", "text", "realises"):
                record.pop(key, None)
        return part
