"""A fault: what fails, how, from when and for how long."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, Union, get_args

from pydantic import Discriminator, Field, GetJsonSchemaHandler, Tag, TypeAdapter
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from adeye.spec.faults import (
    channels,
    objects,
    sensor_bodies,
    sensor_signals,
    sensor_timing,
    signals,
    switch,
    vehicle,
)
from adeye.spec.faults.base import Fault, Onset
from adeye.spec.faults.sensing import SensorFault

__all__ = ["FAULT", "MODELS", "AnyFault", "Fault", "Onset", "SensorFault", "model_of"]


MODELS: Final[tuple[type[Fault], ...]] = (
    sensor_timing.DropOut,
    sensor_timing.PowerLoss,
    sensor_timing.Freeze,
    sensor_timing.Stale,
    sensor_timing.StaleStamp,
    sensor_timing.ClockDrift,
    sensor_timing.Delay,
    sensor_timing.SampleLoss,
    sensor_signals.Bias,
    sensor_signals.Scale,
    sensor_signals.Drift,
    sensor_signals.Noise,
    sensor_signals.Quantise,
    sensor_signals.StuckAt,
    sensor_signals.Spike,
    sensor_signals.BitFlip,
    sensor_signals.Jump,
    objects.Miss,
    objects.Ghost,
    objects.Misclassify,
    objects.Split,
    sensor_bodies.BlindSector,
    sensor_bodies.RangeLoss,
    sensor_bodies.Miscalibration,
    sensor_bodies.DeadPixels,
    sensor_bodies.PixelNoise,
    sensor_bodies.Blackout,
    channels.Silent,
    channels.Crash,
    channels.Slow,
    channels.Bias,
    channels.Scale,
    channels.Oscillating,
    channels.PlausibleButWrong,
    channels.NotANumber,
    channels.HeartbeatLies,
    channels.Drop,
    channels.Reorder,
    channels.Duplicate,
    channels.TracksLost,
    channels.PlannerFrozen,
    channels.MonitorsFrozen,
    channels.MapShifted,
    signals.Delay,
    signals.Stuck,
    vehicle.Loss,
    vehicle.Fade,
    vehicle.Offset,
    vehicle.RateLimit,
    vehicle.Friction,
    switch.Late,
)
"""The record of every model; those of one kind of target have names of their own."""


def model_of(record: type[Fault]) -> str:
    """Return the name of a model, as files have it."""
    name: str = get_args(record.model_fields["model"].annotation)[0]
    return name


def _port_of(value: Any) -> str:
    """Tell by which kind of target a fault is to be read: its own, if that has such a model.

    A model that is none of its target's is read as what it is elsewhere: that record knows what it
    is a fault of, and says so.
    """
    given = value if isinstance(value, Mapping) else getattr(value, "__dict__", {})
    port, model = str(given.get("target")).split(".", 1)[0], given.get("model")
    named = [record for record in MODELS if model_of(record) == model]
    if named and not any(port in record.fits for record in named):
        return named[0].fits[0]
    return port if port in _PORTS else _PORTS[0]


def _of_port(port: str) -> Any:
    """Return the union of the models for a kind of target."""
    records = tuple(record for record in MODELS if port in record.fits)
    if len(records) == 1:
        return Annotated[records[0], Tag(port), Field(title=port)]
    return Annotated[Union[records], Field(discriminator="model", title=port), Tag(port)]  # noqa: UP007 - made of a list


class _InSchemaOfAny:
    """Lets several kinds fit in the JSON Schema, where some have a record in common."""

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        made = handler(core)
        made["anyOf"] = made.pop("oneOf")
        return made


_PORTS: Final = tuple(dict.fromkeys(port for record in MODELS for port in record.fits))

if TYPE_CHECKING:
    AnyFault = Fault
else:
    AnyFault = Annotated[
        Union[tuple(_of_port(port) for port in _PORTS)],  # noqa: UP007 - made of a list
        Discriminator(_port_of),
        _InSchemaOfAny(),
    ]
    """A scripted fault, by kind of target and model."""

FAULT: Final[TypeAdapter[Fault]] = TypeAdapter(AnyFault)
"""Reads a fault of any model."""
