"""Faults of when samples come and of what they say about it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from adeye.spec.faults.sensing import SensorFault
from adeye.spec.quantity import Duration, Number

_Duration = Annotated[Duration, Field(ge=0.0)]
_Share = Annotated[Number, Field(ge=0.0, le=1.0)]


class DropOut(SensorFault):
    """A sensor delivers nothing new."""

    silences = True
    model: Literal["drop_out"]


class PowerLoss(SensorFault):
    """A sensor delivers nothing, and once it has power again it takes a while to come up."""

    silences = True
    model: Literal["power_loss"]
    restart: _Duration = 0.0
    """From the end of the fault to the first sample that counts again [s]."""


class Freeze(SensorFault):
    """What the newest sample said is said again and again, with new stamps: nobody can tell."""

    model: Literal["freeze"]


class Stale(SensorFault):
    """The newest sample stays; the sensor says that it is well, but the stamp stands still."""

    model: Literal["stale"]


class StaleStamp(SensorFault):
    """Samples are new, and their stamps are not."""

    model: Literal["stale_stamp"]


class ClockDrift(SensorFault):
    """The clock of the sensor is wrong, and so are the stamps."""

    neutral = ({"offset": 0.0, "rate": 0.0},)
    model: Literal["clock_drift"]
    offset: Duration = 0.0
    """What is added to every stamp [s]."""
    rate: Annotated[Number, Field(ge=-0.5, le=0.5)] = 0.0
    """What is added to it in each second since the onset [s]."""


class Delay(SensorFault):
    """Samples come later, with their own stamps; none overtakes another."""

    neutral = ({"by": 0.0, "jitter": 0.0},)
    model: Literal["delay"]
    by: _Duration
    """How much later each comes [s]."""
    jitter: _Duration = 0.0
    """And up to so much later again, drawn anew for each [s]."""


class SampleLoss(SensorFault):
    """Samples are lost, one by one or in bursts; the one before stays.

    With ``enter`` it is the channel of Gilbert (1960), with ``probability``, too, that of Elliott
    (1963): in each sample a burst may begin or end, and all samples in a burst are lost.
    """

    neutral = ({"probability": 0.0, "enter": 0.0},)
    model: Literal["sample_loss"]
    probability: _Share = 0.0
    """Of a sample to be lost outside of bursts."""
    enter: _Share = 0.0
    """Probability that a burst begins with a sample."""
    leave: Annotated[Number, Field(gt=0.0, le=1.0)] = 1.0
    """Probability that it is over with the next one; its mean length is 1 / leave samples."""
