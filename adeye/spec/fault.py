"""A fault: what fails, how, from when and for how long."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Union, get_args

from pydantic import Discriminator, Field, Tag, TypeAdapter

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

__all__ = ["FAULT", "MODELS", "AnyFault", "Fault", "Onset", "SensorFault", "Silent", "model_of"]


class Silent(Fault):
    """A channel says nothing."""

    fits = ("channels",)
    model: Literal["silent"]


MODELS: Final[tuple[type[Fault], ...]] = (
    Silent,
    DropOut,
    PowerLoss,
    Freeze,
    Stale,
    StaleStamp,
    ClockDrift,
    Delay,
    SampleLoss,
    Bias,
    Scale,
    Drift,
    Noise,
    Quantise,
    StuckAt,
    Spike,
    BitFlip,
    Jump,
    Miss,
    Ghost,
    Misclassify,
    Split,
    BlindSector,
    RangeLoss,
    Miscalibration,
    DeadPixels,
    PixelNoise,
    Blackout,
)
"""The record of every model; those of one kind of target have names of their own."""


def model_of(record: type[Fault]) -> str:
    """Return the name of a model, as files have it."""
    name: str = get_args(record.model_fields["model"].annotation)[0]
    return name


def _port_of(value: Any) -> str:
    """Tell by which kind of target a fault is to be read: its own, if that has such a model."""
    given = value if isinstance(value, Mapping) else vars(value)
    port, model = str(given.get("target")).split(".", 1)[0], given.get("model")
    named = [record for record in MODELS if model_of(record) == model]
    if named and not any(port in record.fits for record in named):
        return named[0].fits[0]
    return port if port in _PORTS else _PORTS[0]


def _of_port(port: str) -> Any:
    """Return the union of the models for a kind of target."""
    records = tuple(record for record in MODELS if port in record.fits)
    if len(records) == 1:
        return Annotated[records[0], Tag(port)]
    return Annotated[Union[records], Field(discriminator="model", title=port), Tag(port)]  # noqa: UP007 - made of a list


_PORTS: Final = tuple(sorted({port for record in MODELS for port in record.fits}, reverse=True))

if TYPE_CHECKING:
    AnyFault = Fault
else:
    AnyFault = Annotated[
        Union[tuple(_of_port(port) for port in _PORTS)],  # noqa: UP007 - made of a list
        Discriminator(_port_of),
    ]
    """A scripted fault, by kind of target and model."""

FAULT: Final[TypeAdapter[Fault]] = TypeAdapter(AnyFault)
"""Reads a fault of any model."""
