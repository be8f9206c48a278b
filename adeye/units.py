"""Quantities with units, as people write them, and SI inside.

>>> round(parse_quantity("90 km/h", Dimension.SPEED), 6)
25.0
>>> format_quantity(25.0, Dimension.SPEED)
'90 km/h'
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from enum import Enum

from adeye.errors import UnitError


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit: how many SI units it is, kept as a fraction so that conversion is one rounding."""

    numerator: float
    denominator: float
    exponents: tuple[int, int, int]


_L, _T, _A = (1, 0, 0), (0, 1, 0), (0, 0, 1)
_SPEED, _ACCELERATION, _JERK = (1, -1, 0), (1, -2, 0), (1, -3, 0)
_RATE, _TURN = (0, -1, 0), (0, -1, 1)

UNITS: dict[str, Unit] = {
    "m": Unit(1.0, 1.0, _L),
    "km": Unit(1000.0, 1.0, _L),
    "cm": Unit(1.0, 100.0, _L),
    "mm": Unit(1.0, 1000.0, _L),
    "s": Unit(1.0, 1.0, _T),
    "ms": Unit(1.0, 1000.0, _T),
    "min": Unit(60.0, 1.0, _T),
    "h": Unit(3600.0, 1.0, _T),
    "m/s": Unit(1.0, 1.0, _SPEED),
    "km/h": Unit(1.0, 3.6, _SPEED),
    "mm/h": Unit(1.0, 3_600_000.0, _SPEED),
    "m/s^2": Unit(1.0, 1.0, _ACCELERATION),
    "m/s2": Unit(1.0, 1.0, _ACCELERATION),
    "m/s²": Unit(1.0, 1.0, _ACCELERATION),
    "g": Unit(9.80665, 1.0, _ACCELERATION),
    "m/s^3": Unit(1.0, 1.0, _JERK),
    "m/s3": Unit(1.0, 1.0, _JERK),
    "m/s³": Unit(1.0, 1.0, _JERK),
    "rad": Unit(1.0, 1.0, _A),
    "deg": Unit(math.pi, 180.0, _A),
    "rad/s": Unit(1.0, 1.0, _TURN),
    "deg/s": Unit(math.pi, 180.0, _TURN),
    "Hz": Unit(1.0, 1.0, _RATE),
    "/s": Unit(1.0, 1.0, _RATE),
    "1/s": Unit(1.0, 1.0, _RATE),
    "/h": Unit(1.0, 3600.0, _RATE),
    "1/h": Unit(1.0, 3600.0, _RATE),
    "1/m": Unit(1.0, 1.0, (-1, 0, 0)),
}
"""Every unit that is understood; the exponents are of length, time and angle."""


class Dimension(Enum):
    """What a quantity measures: exponents of length, time and angle, name and example."""

    NONE = ((0, 0, 0), "a plain number", "0.5", "")
    LENGTH = (_L, "a length", "15 m", "m")
    TIME = (_T, "a time", "0.5 s", "s")
    SPEED = (_SPEED, "a speed", "60 km/h", "km/h")
    ACCELERATION = (_ACCELERATION, "an acceleration", "3 m/s^2", "m/s²")
    JERK = (_JERK, "a jerk", "12 m/s^3", "m/s³")
    ANGLE = (_A, "an angle", "-3 deg", "deg")
    ANGULAR_RATE = (_TURN, "an angular rate", "20 deg/s", "deg/s")
    RAIN_RATE = (_SPEED, "a rain rate", "7.5 mm/h", "mm/h")
    FREQUENCY = (_RATE, "a rate", "20 Hz", "Hz")
    CURVATURE = ((-1, 0, 0), "a curvature", "0.01 1/m", "1/m")

    def __init__(
        self, exponents: tuple[int, int, int], label: str, example: str, unit: str
    ) -> None:
        self.exponents = exponents
        self.label = label
        self.example = example
        self.unit = unit


_NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_QUANTITY = re.compile(rf"^\s*({_NUMBER})\s*(\S.*?)?\s*$")


def parse_quantity(text: str | float, dimension: Dimension) -> float:
    """Read a quantity and convert it to SI.

    Args:
        text: A number with a unit; without one only for plain numbers.
        dimension: What it must measure.

    Raises:
        UnitError: Not a number, not finite, no unit, or a unit of something else.
    """
    if isinstance(text, bool):
        raise _refuse(repr(text), dimension)
    if isinstance(text, int | float):
        if not math.isfinite(text):
            raise UnitError(f"{text!r} is not a finite number")
        if dimension is not Dimension.NONE:
            raise _refuse(f"{text!r} has no unit", dimension)
        return float(text)
    match = _QUANTITY.match(text)
    if match is None:
        raise _refuse(f"{text!r} is not a quantity", dimension)
    value, unit_text = float(match[1]), (match[2] or "").replace(" ", "")
    if not math.isfinite(value):
        raise UnitError(f"{text!r} is not a finite number")
    if not unit_text:
        if dimension is not Dimension.NONE:
            raise _refuse(f"{text!r} has no unit", dimension)
        return value
    unit = UNITS.get(unit_text)
    if unit is None or unit.exponents != dimension.exponents:
        raise _refuse(f"{text!r} is not {dimension.label}", dimension)
    return convert(value, unit)


def convert(value: float, unit: Unit) -> float:
    """Convert a value to SI, always in the same order of operations."""
    return value * unit.numerator / unit.denominator


def format_quantity(value: float, dimension: Dimension) -> str:
    """Write an SI value in the field's unit, short and without trailing zeros."""
    if dimension is Dimension.NONE:
        return f"{value:.10g}"
    unit = UNITS[dimension.unit]
    return f"{value * unit.denominator / unit.numerator:.10g} {dimension.unit}"


def units_of(dimension: Dimension) -> list[str]:
    """List the units of a dimension."""
    return [name for name, unit in UNITS.items() if unit.exponents == dimension.exponents]


def _refuse(what: str, dimension: Dimension) -> UnitError:
    if dimension is Dimension.NONE:
        return UnitError(what, remedy="Write a plain number, for instance 0.5.")
    allowed = ", ".join(units_of(dimension))
    return UnitError(
        what, remedy=f"Write {dimension.label} like '{dimension.example}' (units: {allowed})."
    )
