"""Faults of what carries out the acting command: drive, brake, steering and tyres."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from adeye.spec.faults.base import Fault
from adeye.spec.misplaced import misplaced
from adeye.spec.quantity import Angle, AngularRate, Duration, Jerk, Number

Share = Annotated[Number, Field(ge=0.0, le=1.0)]


class _OfActuators(Fault):
    """A fault that not every actuator can have.

    Attributes:
        actuators: Those that can.
    """

    fits = ("actuators",)
    actuators: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="after")
    def _actuator_can_have_it(self) -> Self:
        if self.target_id not in self.actuators:
            known = " or ".join(f"actuators.{name}" for name in self.actuators)
            text = f"{self.model} is a fault of {known}, and {self.target} is not one of them"
            raise misplaced([(("target",), text)])
        return self


class Loss(_OfActuators):
    """A share of what drive or brake is asked for is missing."""

    actuators = ("drive", "brake")
    neutral = ({"share": 0.0},)
    model: Literal["loss"]
    share: Share


class Fade(_OfActuators):
    """Drive or brake weakens evenly, from the onset until a share of it is missing."""

    actuators = ("drive", "brake")
    neutral = ({"share": 0.0},)
    model: Literal["fade"]
    share: Share
    over: Annotated[Duration, Field(gt=0.0)]
    """After which time this share is missing [s]; counted from the first onset."""


class Offset(_OfActuators):
    """The wheels are steered beside what is asked for."""

    actuators = ("steering",)
    neutral = ({"steering_angle": 0.0},)
    model: Literal["offset"]
    steering_angle: Angle
    """To the left [rad]."""


class RateLimit(Fault):
    """An actuator follows no quicker than a rate."""

    fits = ("actuators",)
    model: Literal["rate_limit"]
    steering_rate: Annotated[AngularRate, Field(ge=0.0)] | None = None
    """Of the steering [rad/s]."""
    jerk: Annotated[Jerk, Field(ge=0.0)] | None = None
    """Of drive and brake [m/s³]."""

    @model_validator(mode="after")
    def _rate_of_its_actuator(self) -> Self:
        wanted, other = ("jerk", "steering_rate")
        if self.target_id == "steering":
            wanted, other = other, wanted
        if getattr(self, wanted) is None or getattr(self, other) is not None:
            name = other if getattr(self, other) is not None else "model"
            text = f"the rate of {self.target} is {wanted}; give it alone"
            raise misplaced([((name,), text)])
        return self

    @property
    def rate(self) -> float:
        """How quickly it follows at most [rad/s] or [m/s³]."""
        return float(self.jerk or 0.0) + float(self.steering_rate or 0.0)


class Friction(Fault):
    """The tyres grip otherwise than the road has it."""

    fits = ("tyres",)
    neutral = ({"factor": 1.0},)
    model: Literal["friction"]
    value: Annotated[Number, Field(ge=0.0, le=2.0)] | None = None
    """The friction coefficient."""
    factor: Annotated[Number, Field(ge=0.0, le=2.0)] | None = None
    """Of the friction coefficient of the road."""

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.value is None) == (self.factor is None):
            name = "model" if self.value is None else "factor"
            raise misplaced([((name,), "give one of value and factor")])
        return self
