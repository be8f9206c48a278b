"""Faults of the switch."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from adeye.spec.faults.base import Fault
from adeye.spec.quantity import Duration


class Late(Fault):
    """Each change of authority takes effect later, beside the handover time of the switch."""

    fits = ("switch",)
    neutral = ({"delay": 0.0},)
    model: Literal["late"]
    delay: Annotated[Duration, Field(ge=0.0)]
    """How much later, in whole ticks [s]."""
