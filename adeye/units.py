"""Quantities with units, as people write them, and SI inside.

>>> round(parse_quantity("90 km/h", Dimension.SPEED), 6)
25.0
>>> format_quantity(25.0, Dimension.SPEED)
'90 km/h'
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from enum import Enum
from typing import Final

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
    "/m": Unit(1.0, 1.0, (-1, 0, 0)),
    "1/m": Unit(1.0, 1.0, (-1, 0, 0)),
}
"""Every unit that is understood; the exponents are of length, time and angle."""


class Dimension(Enum):
    """What a quantity measures: exponents of length, time and angle, name, example and unit.

    The suffix is that of the SI unit in the name of a column.
    """

    NONE = ((0, 0, 0), "a plain number", "0.5", "", "")
    LENGTH = (_L, "a length", "15 m", "m", "m")
    TIME = (_T, "a time", "0.5 s", "s", "s")
    SPEED = (_SPEED, "a speed", "60 km/h", "km/h", "mps")
    ACCELERATION = (_ACCELERATION, "an acceleration", "3 m/s^2", "m/s²", "mps2")
    JERK = (_JERK, "a jerk", "12 m/s^3", "m/s³", "mps3")
    ANGLE = (_A, "an angle", "-3 deg", "deg", "rad")
    ANGULAR_RATE = (_TURN, "an angular rate", "20 deg/s", "deg/s", "radps")
    RAIN_RATE = (_SPEED, "a rain rate", "7.5 mm/h", "mm/h", "mps")
    FREQUENCY = (_RATE, "a rate", "20 Hz", "Hz", "hz")
    CURVATURE = ((-1, 0, 0), "a curvature", "0.01 1/m", "1/m", "pm")

    def __init__(
        self, exponents: tuple[int, int, int], label: str, example: str, unit: str, suffix: str
    ) -> None:
        self.exponents = exponents
        self.label = label
        self.example = example
        self.unit = unit
        self.suffix = suffix


MAX_LENGTH: Final = 100
"""Longest text that is read as a quantity, in characters."""

_NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_QUANTITY = re.compile(rf"({_NUMBER})\s*(.*)", re.DOTALL)
_AROUND_SIGN = re.compile(r"\s*([/^])\s*")


def parse_quantity(text: str | float, dimension: Dimension) -> float:
    """Read a quantity and convert it to SI.

    Args:
        text: A number with a unit; without one only for plain numbers. Zero needs its unit too.
        dimension: What it must measure.

    Raises:
        UnitError: Not a number, not finite, no unit, or a unit of something else.

    >>> parse_quantity("130 km/h", Dimension.SPEED) == 130 / 3.6
    True
    """
    if isinstance(text, str):
        return _read(text, dimension)
    if isinstance(text, bool) or not isinstance(text, int | float):
        raise _refuse(f"{shown(text)} is not a quantity", dimension)
    if dimension is not Dimension.NONE:
        raise _refuse(f"{shown(text)} has no unit", dimension)
    return _finite(text, text)


def read_quantity(text: str) -> tuple[float, tuple[int, int, int]]:
    """Read a quantity of any dimension and convert it to SI.

    Args:
        text: A number with a unit, or a plain number.

    Returns:
        Its value, and the exponents of length, time and angle.

    Raises:
        UnitError: Not a number, not finite, or no unit that is known.

    >>> read_quantity("1500 ms")
    (1.5, (0, 1, 0))
    """
    match = _QUANTITY.fullmatch(text.strip()) if len(text) <= MAX_LENGTH else None
    name = "" if match is None else _AROUND_SIGN.sub(r"\1", match[2])
    if match is None or (name and name not in UNITS):
        raise UnitError(
            f"{shown(text)} is not a quantity",
            remedy=f"Write a number and one of the units {', '.join(UNITS)}.",
        )
    if not name:
        return _finite(_held(match[1]), text), Dimension.NONE.exponents
    unit = UNITS[name]
    return _finite(convert(_held(match[1]), unit), text), unit.exponents


def _read(text: str, dimension: Dimension) -> float:
    match = _QUANTITY.fullmatch(text.strip()) if len(text) <= MAX_LENGTH else None
    if match is None:
        raise _refuse(f"{shown(text)} is not a quantity", dimension)
    name = _AROUND_SIGN.sub(r"\1", match[2])
    if not name:
        if dimension is not Dimension.NONE:
            raise _refuse(f"{shown(text)} has no unit", dimension)
        return _finite(_held(match[1]), text)
    unit = UNITS.get(name)
    if unit is None or unit.exponents != dimension.exponents:
        raise _refuse(f"{shown(text)} is not {dimension.label}", dimension)
    return _finite(convert(_held(match[1]), unit), text)


def _held(digits: str) -> float:
    """Read a number.

    Raises:
        UnitError: It is another number by then.
    """
    number = float(digits)
    if is_rounded(digits, number):
        raise UnitError(f"{shown(digits)} {ROUNDED}", remedy=FEWER_DIGITS)
    return number


def _finite(value: float, text: object) -> float:
    try:
        number = float(value) + 0.0  # no -0.0
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise UnitError(f"{shown(text)} is not a finite number", remedy="Write a smaller number.")
    if number != value:
        raise UnitError(f"{shown(text)} {ROUNDED}", remedy=FEWER_DIGITS)
    return number


ROUNDED: Final = "would be rounded: of whole numbers above 2^53 not every one is held"
FEWER_DIGITS: Final = "Write it without what all values have in common, or with the digits it has."
_ALL_HELD: Final = 2.0**53
"""Below it a float holds every whole number."""


def is_rounded(text: str, number: float) -> bool:
    """Tell whether a number that is written to its last whole digit is another one as a float.

    Where digits are left out, as in 1e23, nobody said more than the float holds.

    Args:
        text: The number, which ``float`` reads.
        number: What it read.

    >>> is_rounded("9007199254740993", 9007199254740992.0), is_rounded("1e23", 1e23)
    (True, False)
    """
    if not _ALL_HELD <= abs(number) < math.inf:
        return False
    written = Decimal(text)
    exponent = written.as_tuple().exponent
    return isinstance(exponent, int) and exponent <= 0 and written != Decimal(number)


def decimal(text: str) -> float:
    """Read a number without unit from a table, in the digits 0 to 9.

    Raises:
        ValueError: It is none; Python would also read other scripts and ``1_000``.

    >>> decimal("1e3")
    1000.0
    """
    if not text.isascii() or "_" in text:
        raise ValueError(f"{shown(text)} is no number in plain decimal digits")
    return float(text)


def shown(value: object) -> str:
    """Quote a value for a message: on one line, without control characters, not too long."""
    if isinstance(value, str):
        return repr(value if len(value) <= 80 else f"{value[:77]}...")
    if isinstance(value, int) and value.bit_length() > 200:
        return "a number of more than 60 digits"
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def convert(value: float, unit: Unit) -> float:
    """Convert a value to SI, always in the same order of operations."""
    return value * unit.numerator / unit.denominator


def format_quantity(value: float, dimension: Dimension) -> str:
    """Write an SI value in the field's unit, short and without trailing zeros.

    A rate is written per hour if it is a short number then and not in hertz (an exposure).

    >>> format_quantity(parse_quantity("0.6 /h", Dimension.FREQUENCY), Dimension.FREQUENCY)
    '0.6 /h'
    """
    text = _format(value, dimension.unit)
    if dimension is Dimension.FREQUENCY and abs(value) < 1.0:
        hourly = _format(value, "/h")
        if _read(text, dimension) != value == _read(hourly, dimension):
            return hourly
    return text


def _format(value: float, name: str) -> str:
    if name:
        value = value * UNITS[name].denominator / UNITS[name].numerator
    # The sum turns -0.0 into 0.0.
    return f"{value + 0.0:.10g} {name}".rstrip()


def units_of(dimension: Dimension) -> list[str]:
    """List the units of a dimension."""
    return [name for name, unit in UNITS.items() if unit.exponents == dimension.exponents]


def si_unit(exponents: tuple[int, int, int]) -> str:
    """Name the SI unit with these exponents of length, time and angle; empty if there is none.

    >>> si_unit((1, -1, 0)), si_unit((0, 0, 0))
    ('m/s', '')
    """
    names = (
        name
        for name, unit in UNITS.items()
        if unit.exponents == exponents and unit.numerator == unit.denominator
    )
    return next(names, "")


def _refuse(what: str, dimension: Dimension) -> UnitError:
    if dimension is Dimension.NONE:
        return UnitError(what, remedy="Write a plain number, for instance 0.5.")
    allowed = ", ".join(units_of(dimension))
    return UnitError(
        what, remedy=f"Write {dimension.label} like '{dimension.example}' (units: {allowed})."
    )


# --- Loss of margin, by unit, that does not count -------------------------------------------------

MOST_TOLERANCE: Final = 1_000.0
"""Largest loss of margin that somebody may mean, in any unit. Our choice."""
TOLERANCES: Final[Mapping[str, float]] = {
    "m": 0.01, "s": 0.01, "m/s": 0.01, "m/s^2": 0.01, "m/s^3": 0.01, "rad": 0.001, "rad/s": 0.001,
    "1": 0.001,
}  # fmt: skip
"""Loss of margin, by unit, that nobody on the road could tell. Our choice; ``1`` is that of a
margin without a unit, or divided by the scale of its signal."""
