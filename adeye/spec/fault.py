"""A fault: what fails, how, from when and for how long."""

from __future__ import annotations

from typing import Annotated, Final, Literal, get_args

from pydantic import Field, TypeAdapter

from adeye.spec.faults.base import Fault, Onset
from adeye.spec.faults.channels import (
    Bias,
    Crash,
    Drop,
    Duplicate,
    HeartbeatLies,
    MapShifted,
    NotANumber,
    Oscillating,
    PlannerFrozen,
    PlausibleButWrong,
    Reorder,
    Scale,
    Silent,
    Slow,
    TracksLost,
)
from adeye.spec.faults.signals import Delay, Stuck
from adeye.spec.faults.vehicle import Fade, Friction, Loss, Offset, RateLimit

__all__ = ["FAULT", "MODELS", "AnyFault", "Fault", "Onset"]


class DropOut(Fault):
    """A sensor delivers nothing new."""

    fits = ("sensors",)
    model: Literal["drop_out"]


Choice = (
    DropOut
    | Silent
    | Crash
    | Slow
    | Stuck
    | Bias
    | Scale
    | Oscillating
    | PlausibleButWrong
    | NotANumber
    | HeartbeatLies
    | Drop
    | Delay
    | Reorder
    | Duplicate
    | TracksLost
    | PlannerFrozen
    | MapShifted
    | Loss
    | Fade
    | Offset
    | RateLimit
    | Friction
)

AnyFault = Annotated[Choice, Field(discriminator="model")]
"""A scripted fault, by its model."""

MODELS: Final[tuple[type[Fault], ...]] = get_args(Choice)
"""The record of every model."""

FAULT: Final[TypeAdapter[Fault]] = TypeAdapter(AnyFault)
"""Reads a fault of any model."""
