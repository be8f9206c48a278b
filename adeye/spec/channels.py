"""The channels that an architecture may name, with their parameters."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from adeye.spec.misplaced import misplaced
from adeye.spec.quantity import Acceleration, Duration, Identifier, Many, Number, Record
from adeye.spec.sensors import (
    NonNegativeDuration,
    NonNegativeLength,
    PluginPath,
    PositiveFrequency,
    PositiveLength,
)

PositiveAcceleration = Annotated[Acceleration, Field(gt=0.0)]


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
    """Detections that confirm a track: what has fewer is not reacted to."""
    confirm_window: Annotated[int, Field(ge=0, le=30)] = 0
    """Samples among which these detections must be, of the sensor that began the track; 0 for any
    number. A track that is not confirmed is forgotten after 0.25 s without a detection anyway."""
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

    @model_validator(mode="after")
    def _window_has_room(self) -> Self:
        if 0 < self.confirm_window < self.confirm_hits:
            text = (
                f"{self.confirm_hits} detections never come in {self.confirm_window} samples; "
                "at least as many samples are needed, or 0 for any number"
            )
            raise misplaced([(("confirm_window",), text)])
        return self


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
