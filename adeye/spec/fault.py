"""A fault: what fails, how, from when and for how long."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field, TypeAdapter

from adeye.spec.faults.base import Fault, Onset
from adeye.spec.faults.objects import Ghost, Misclassify, Miss, Split
from adeye.spec.faults.sensing import SensorFault
from adeye.spec.faults.sensor_bodies import (
    Blackout,
    BlindSector,
    DeadPixels,
    Miscalibration,
    PixelNoise,
    RangeLoss,
)
from adeye.spec.faults.sensor_signals import (
    Bias,
    BitFlip,
    Drift,
    Jump,
    Noise,
    Quantise,
    Scale,
    Spike,
    StuckAt,
)
from adeye.spec.faults.sensor_timing import (
    ClockDrift,
    Delay,
    DropOut,
    Freeze,
    PowerLoss,
    SampleLoss,
    Stale,
    StaleStamp,
)

__all__ = ["FAULT", "AnyFault", "Fault", "Onset", "SensorFault", "Silent"]


class Silent(Fault):
    """A channel says nothing."""

    fits = ("channels",)
    model: Literal["silent"]


AnySensorFault = (
    DropOut
    | PowerLoss
    | Freeze
    | Stale
    | StaleStamp
    | ClockDrift
    | Delay
    | SampleLoss
    | Bias
    | Scale
    | Drift
    | Noise
    | Quantise
    | StuckAt
    | Spike
    | BitFlip
    | Jump
    | Miss
    | Ghost
    | Misclassify
    | Split
    | BlindSector
    | RangeLoss
    | Miscalibration
    | DeadPixels
    | PixelNoise
    | Blackout
)

AnyFault = Annotated[AnySensorFault | Silent, Field(discriminator="model")]
"""A scripted fault, by its model."""

FAULT: Final[TypeAdapter[Fault]] = TypeAdapter(AnyFault)
"""Reads a fault of any model."""
