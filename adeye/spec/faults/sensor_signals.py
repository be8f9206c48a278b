"""Faults of the numbers that sensors measure; each is of one signal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema

from adeye.spec.faults.sensing import (
    SIGNALS,
    SensorFault,
    SignalName,
    delivered,
    signals_of,
)
from adeye.spec.misplaced import Loc
from adeye.spec.quantity import Angle, Duration, Length, Number, quantity_reader
from adeye.spec.sensors import model_name

if TYPE_CHECKING:
    from adeye.spec.sensors import SensorRecord


def _in_its_unit(value: Any, info: ValidationInfo) -> float:
    """Read a quantity of whatever the signal measures, which stands before it."""
    signal = info.data.get("signal")
    # Without a signal the record is wrong anyway.
    return 0.0 if signal is None else quantity_reader(SIGNALS[signal].dimension)(value, info)


_Size = Annotated[
    float,
    BeforeValidator(_in_its_unit),
    WithJsonSchema({"type": ["string", "number"], "examples": ["1 m", "2 deg", "3 m/s"]}),
]
_LeastZero = Annotated[_Size, Field(ge=0.0)]


class SignalFault(SensorFault):
    """A fault of one of the numbers that a sensor measures."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("signal",)

    signal: SignalName

    def misfits(self, sensor: SensorRecord) -> list[tuple[Loc, str]]:
        """Say that a sensor does not measure the signal."""
        known = signals_of(sensor)
        if self.signal in known:
            return []
        has = f"measures {', '.join(known)}" if known else "measures none that can be disturbed"
        return [(("signal",), f"a {model_name(sensor)} {has}, and not {self.signal}")]


class Bias(SignalFault):
    """It is too large by the same amount."""

    neutral = ({"size": 0.0},)
    model: Literal["bias"]
    size: _Size


class Scale(SignalFault):
    """It is too large by the same factor."""

    neutral = ({"factor": 1.0},)
    model: Literal["scale"]
    factor: Number


class Drift(SignalFault):
    """It goes away, evenly since the first onset."""

    neutral = ({"size": 0.0},)
    model: Literal["drift"]
    size: _Size
    """How far it goes ..."""
    over: Annotated[Duration, Field(gt=0.0)]
    """... in this time [s]."""


class Noise(SignalFault):
    """White Gaussian noise of its own in every sample."""

    neutral = ({"size": 0.0},)
    model: Literal["noise"]
    size: _LeastZero
    """Standard deviation."""


class Quantise(SignalFault):
    """It comes in steps only: the nearest multiple."""

    neutral = ({"size": 0.0},)
    model: Literal["quantise"]
    size: _LeastZero
    """Of a step; with 0 there are none."""


class StuckAt(SignalFault):
    """It has one value whatever is there."""

    model: Literal["stuck_at"]
    value: _Size


class Spike(SignalFault):
    """It is too large by the same amount, in a few samples."""

    neutral = ({"size": 0.0}, {"probability": 0.0})
    model: Literal["spike"]
    size: _Size
    probability: Annotated[Number, Field(ge=0.0, le=1.0)]
    """Of a sample to have it."""


class BitFlip(SignalFault):
    """A bit of the 64 of IEEE 754 is the wrong one; the result may be infinite or no number."""

    model: Literal["bit_flip"]
    bit: Annotated[int, Field(ge=0, le=63)]
    """0 is the least of the fraction, 52 the least of the exponent, 63 the sign."""


class Jump(SensorFault):
    """The place of the ego is another one, along the axes of the map, and so is its heading."""

    needs = ("ego estimates", "fixes")
    neutral = ({"x": 0.0, "y": 0.0, "heading": 0.0},)
    model: Literal["jump"]
    x: Length = 0.0
    y: Length = 0.0
    heading: Angle = 0.0

    def misfits(self, sensor: SensorRecord) -> list[tuple[Loc, str]]:
        """Say that a sensor does not measure where the ego is, or not its heading."""
        found = super().misfits(sensor)
        if not found and self.heading != 0.0 and "ego estimates" not in delivered(sensor):
            found.append((("heading",), f"a {model_name(sensor)} does not measure the heading"))
        return found
