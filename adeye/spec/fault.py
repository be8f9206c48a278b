"""A fault: what fails, how, from when and for how long."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, get_args

from pydantic import Discriminator, Field, GetJsonSchemaHandler, Tag, TypeAdapter
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

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


SensorFault = DropOut
CommandFault = (
    Silent
    | Crash
    | Slow
    | Stuck
    | Bias
    | Scale
    | Oscillating
    | PlausibleButWrong
    | NotANumber
    | HeartbeatLies
)
LinkFault = Drop | Delay | Reorder | Duplicate
HookFault = TracksLost | PlannerFrozen | MapShifted
ActuatorFault = Loss | Fade | Offset | RateLimit | Delay | Stuck
TyreFault = Friction

_KINDS: Final[Mapping[str, Any]] = {
    "sensors": SensorFault,
    "channels": CommandFault,
    "links": LinkFault,
    "hooks": HookFault,
    "actuators": ActuatorFault,
    "tyres": TyreFault,
}


def _records(kind: str) -> tuple[type[Fault], ...]:
    return get_args(_KINDS[kind]) or (_KINDS[kind],)


_NAMES: Final[Mapping[str, frozenset[str]]] = {
    kind: frozenset(
        name
        for record in _records(kind)
        for name in get_args(record.model_fields["model"].annotation)
    )
    for kind in _KINDS
}
"""Names of the models of each kind of target; a name may mean another record at another kind."""


def _kind_of(value: Any) -> str:
    """Return the kind of target whose records read a fault.

    A model that is none of its target's is read as what it is elsewhere: that record knows what it
    is a fault of, and says so.
    """
    content = value if isinstance(value, Mapping) else getattr(value, "__dict__", {})
    kind = str(content.get("target")).partition(".")[0]
    model = str(content.get("model"))
    elsewhere = [name for name, names in _NAMES.items() if model in names]
    if elsewhere and kind not in elsewhere:
        return elsewhere[0]
    return kind if kind in _NAMES else next(iter(_NAMES))


class _InSchemaOfAny:
    """Lets several kinds fit in the JSON Schema, where some have a record in common."""

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        made = handler(core)
        made["anyOf"] = made.pop("oneOf")
        return made


AnyFault = Annotated[
    Annotated[SensorFault, Tag("sensors"), Field(title="sensors")]
    | Annotated[CommandFault, Tag("channels"), Field(discriminator="model", title="channels")]
    | Annotated[LinkFault, Tag("links"), Field(discriminator="model", title="links")]
    | Annotated[HookFault, Tag("hooks"), Field(discriminator="model", title="hooks")]
    | Annotated[ActuatorFault, Tag("actuators"), Field(discriminator="model", title="actuators")]
    | Annotated[TyreFault, Tag("tyres"), Field(title="tyres")],
    Discriminator(_kind_of),
    _InSchemaOfAny(),
]
"""A scripted fault, by the kind of its target and its model."""

MODELS: Final[tuple[type[Fault], ...]] = tuple(
    dict.fromkeys(record for kind in _KINDS for record in _records(kind))
)
"""The record of every model."""

FAULT: Final[TypeAdapter[Fault]] = TypeAdapter(AnyFault)
"""Reads a fault of any model."""
