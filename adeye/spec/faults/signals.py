"""Faults of whatever hands on a signal: it comes late, or it stands still."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from adeye.spec.faults.base import Fault
from adeye.spec.quantity import Duration

LONGEST_LAG: Final = 10.0
"""How late something can come at most [s]: everything up to then is kept."""

Lag = Annotated[Duration, Field(ge=0.0, le=LONGEST_LAG)]


class Delay(Fault):
    """What goes through comes later; in order, and with the stamps that it has."""

    fits = ("links", "actuators")
    neutral = ({"by": 0.0},)
    model: Literal["delay"]
    by: Lag
    """How much later [s], rounded up to ticks."""


class Stuck(Fault):
    """The last value before the onset stands; a channel goes on stamping it.

    A switch stays at the channel that acts.
    """

    fits = ("channels", "actuators", "switch")
    model: Literal["stuck"]
