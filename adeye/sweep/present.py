"""Swept values in the field's units, for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from adeye.sweep.axes import quantity_or_text
from adeye.units import Dimension, format_quantity

if TYPE_CHECKING:
    from collections.abc import Mapping


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
    """Write one swept value in the unit that the scenario's default uses."""
    if isinstance(value, str):
        return value
    parameter = odd["scenarios"].get(scenario, {}).get("parameters", {}).get(name)
    if parameter is None:
        return f"{value:.6g}"
    return quantity_text(value, parameter["default"])


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
