"""Swept values as numbers in SI, and in the field's units for people."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import InputError, SweepError
from adeye.fields import texts_in
from adeye.spec.expression import parse
from adeye.units import Dimension, format_quantity

if TYPE_CHECKING:
    from adeye.spec.odd import Level

SAME: Final = 1e-9
"""Relative difference up to which two levels are one situation."""


def quantity_or_text(text: Level) -> tuple[float | str, Dimension | None]:
    """Read a quantity as SI with its dimension; what else there is becomes text without dimension.

    >>> quantity_or_text("90 m")[0]
    90.0
    >>> quantity_or_text("left")
    ('left', None)
    >>> quantity_or_text(("localisation", "front_radar"))
    ('[localisation, front_radar]', None)
    """
    if isinstance(text, tuple):
        return f"[{', '.join(str(item) for item in text)}]", None
    if isinstance(text, bool):
        return str(text).lower(), None
    if isinstance(text, int | float):
        if not math.isfinite(text):
            raise SweepError(f"{text!r} is not a finite number")
        return float(text) + 0.0, Dimension.NONE
    return _read(text)


@lru_cache(maxsize=4096)
def _read(text: str) -> tuple[float | str, Dimension | None]:
    """Read a text; a plan asks for the same in each of its sections."""
    try:
        expression = parse(text)
        if expression.names or not expression.is_constant:
            return text, None
        return float(expression.evaluate({})) + 0.0, expression.dimension({})
    except InputError:
        return text, None


@dataclass(frozen=True, slots=True)
class NamedValue:
    """A swept quantity and its value, ready for people."""

    label: str
    value: str


def named_values(
    point: Mapping[str, float | str], odd: Mapping[str, Any], scenario: str
) -> tuple[NamedValue, ...]:
    """Write the values of a point.

    Args:
        point: Swept values in SI by the name that the sweep uses.
        odd: Stored content of the ODD and everything that it names.
        scenario: Id of the scenario in the ODD.
    """
    return tuple(
        NamedValue(name, axis_text(name, value, odd, scenario)) for name, value in point.items()
    )


def axis_text(name: str, value: float | str, odd: Mapping[str, Any], scenario: str) -> str:
    """Write one swept value in the unit of the scenario's default, or of what the sweep wrote."""
    if isinstance(value, str):
        return value
    parameter = odd["scenarios"].get(scenario, {}).get("parameters", {}).get(name)
    if parameter is not None:
        return quantity_text(value, parameter["default"])
    for use in odd.get("odd", {}).get("scenarios", ()):
        if scenario == (use["as"] or use["use"]):
            return quantity_text(value, written_quantity(use["sweep"], name) or 0.0)
    return f"{value:.6g}"


def written_quantity(sweep: Mapping[str, Any], name: str) -> str | None:
    """Return the first quantity with a unit that a sweep has written for an axis.

    Args:
        sweep: As the file of an ODD has it.
        name: Of the axis.
    """
    points = [point[name] for point in sweep["points"] if name in point]
    for _, text in texts_in((sweep["parameters"].get(name), points)):
        if quantity_or_text(text)[1] not in (None, Dimension.NONE):
            return text
    return None


def quantity_text(value: float, default: str | float) -> str:
    """Write an SI value in the unit of a text like the default's.

    >>> quantity_text(25.0, "100 km/h")
    '90 km/h'
    >>> quantity_text(5.5, "1 m/s")
    '5.5 m/s'
    """
    _, dimension = quantity_or_text(default)
    if dimension is None or dimension is Dimension.NONE:
        return f"{value:.6g}"
    unit = str(default).strip().lstrip("+-0123456789.eE").strip()
    if dimension is Dimension.SPEED and unit == "mm/h":
        dimension = Dimension.RAIN_RATE
    if dimension is Dimension.SPEED and unit == "m/s":
        return f"{value:.6g} m/s"
    return format_quantity(float(f"{value:.12g}"), dimension)


# --- Which values are one ---


def are_same(low: float, high: float) -> bool:
    """Tell whether rounding alone may part two numbers; whole ones are never rounded."""
    is_whole = low.is_integer() and high.is_integer()
    return math.isclose(low, high, rel_tol=SAME) and (low == high or not is_whole)


def situations(values: Sequence[float | str]) -> tuple[float | str, ...]:
    """Give the values of an axis so that those are equal that rounding alone parts."""
    numbers = sorted(value for value in set(values) if isinstance(value, float))
    same = dict(zip(numbers, numbers, strict=True))
    for low, high in pairwise(numbers):
        if are_same(low, high):
            same[high] = same[low]
    return tuple(same[value] if isinstance(value, float) else value for value in values)
