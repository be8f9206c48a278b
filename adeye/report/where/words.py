"""Conditions on swept values as people write them: read again, they hold where they did."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from adeye.report.where.boxes import LISTED
from adeye.signals import Bools
from adeye.sweep.values import quantity_or_text
from adeye.units import UNITS, Dimension, Unit, si_unit

FAULT: Final = "fault"
"""Name of the axis that the fault list is; a swept value may not have it."""
LONGEST: Final = 1_000
"""Characters that ``adeye run -k`` takes."""
_CLOSE: Final = 1e-9
_FEW: Final = 6
"""Digits that people read at a glance."""


@dataclass(frozen=True, slots=True)
class Words:
    """How the values of an axis are written.

    Attributes:
        name: Of the axis.
        values: Different ones, in SI and in order, or texts.
        unit: Unit that the ODD writes them in; empty for plain numbers and texts.
    """

    name: str
    values: tuple[Any, ...]
    unit: str = ""

    @classmethod
    def of(cls, name: str, values: Sequence[Any], written: Any) -> Words:
        """Write values in the unit of what the ODD says of the axis.

        Args:
            name: Of the axis.
            values: All of them, each once.
            written: One value of the axis as the ODD has it, or the default of the parameter.
        """
        if not all(isinstance(value, int | float) for value in values):
            return cls(name, tuple(sorted(map(str, values))))
        return cls(name, tuple(sorted(map(float, values))), _unit_of(written))

    @property
    def is_ordered(self) -> bool:
        """Whether it has values in between."""
        return not isinstance(self.values[0], str)

    @property
    def is_listed(self) -> bool:
        """Whether its values are few enough to be named one by one."""
        return len(self.values) <= LISTED

    def value(self, place: int) -> str:
        """Write one value, as short as what reads as the same one."""
        value = self.values[place]
        return value if isinstance(value, str) else self._number(value)

    def span(self, first: int, last: int) -> str:
        """Write a range of values, or the one that it has."""
        if first == last:
            return self.value(first)
        low, high = (f"{self._scaled(self.values[at]):.4g}" for at in (first, last))
        return f"{low} to {high} {self.unit}".rstrip()

    def condition(self, levels: Bools) -> str:
        """Write the condition that a value is among some levels; intervals where there is an order.

        Args:
            levels: (L,) which; neither none nor all of them.
        """
        chosen = np.flatnonzero(levels).tolist()
        if not self.is_ordered:
            return self._member(chosen)
        first, last = chosen[0], chosen[-1]
        if first == last and self.is_listed:
            return f"{self.name} == {self.value(first)}"
        ends = []
        if first > 0:
            ends.append(f"{self.name} >= {self._limit(first, first - 1)}")
        if last < len(levels) - 1:
            ends.append(f"{self.name} <= {self._limit(last, last + 1)}")
        return " and ".join(ends)

    def _member(self, chosen: Sequence[int]) -> str:
        quoted = [_quoted(self.values[place]) for place in chosen]
        if len(chosen) == 1:
            return f"{self.name} == {quoted[0]}"
        if len(chosen) == len(self.values) - 1:
            (other,) = set(range(len(self.values))) - set(chosen)
            return f"{self.name} != {_quoted(self.values[other])}"
        return f"{self.name} in [{', '.join(quoted)}]"

    def _limit(self, inside: int, beyond: int) -> str:
        """Write a limit at a value, or short between it and its neighbour beyond."""
        low, high = self.values[inside], self.values[beyond]
        exact = self._number(low)
        if self.is_listed or len(exact.split()[0].lstrip("-")) <= _FEW:
            return exact
        middle = self._scaled((low + high) / 2.0)
        for digits in range(1, 17):
            text = self._with_unit(_plain(float(f"{middle:.{digits}g}")))
            if min(low, high) < _read(text) < max(low, high):
                return text
        return exact

    def _number(self, value: float) -> str:
        scaled = self._scaled(value)
        for digits in range(_FEW, 18):
            text = self._with_unit(_plain(float(f"{scaled:.{digits}g}")))
            if math.isclose(_read(text), value, rel_tol=_CLOSE / 10.0, abs_tol=1e-300):
                return text
        return self._with_unit(_plain(scaled))

    def _scaled(self, value: float) -> float:
        unit = UNITS.get(self.unit, _NONE)
        return value * unit.denominator / unit.numerator + 0.0

    def _with_unit(self, digits: str) -> str:
        return f"{digits} {self.unit}".rstrip()


_NONE: Final = Unit(1.0, 1.0, (0, 0, 0))


def _plain(value: float) -> str:
    """Write a number in the digits of the language of expressions."""
    text = repr(value)
    return text.removesuffix(".0")


def _read(text: str) -> float:
    found = quantity_or_text(text)[0]
    assert isinstance(found, float)
    return found


def _quoted(text: str) -> str:
    return f'"{text}"' if "'" in text else f"'{text}'"


def _unit_of(written: Any) -> str:
    """Give the unit that a value is written in, or the SI unit of what it measures."""
    _, dimension = quantity_or_text(written)
    if dimension is None or dimension is Dimension.NONE:
        return ""
    unit = str(written).strip().lstrip("+-0123456789.eE").strip()
    return unit if unit in UNITS else si_unit(dimension.exponents)


def keyword(scenario: str, architecture: str, chosen: Sequence[tuple[Words, Bools]]) -> str:
    """Write test cases as ``adeye run -k`` takes them, each value by name; else nothing.

    Args:
        scenario: Id.
        architecture: Id.
        chosen: Levels of some axes, all of which a test case has.
    """
    parts = [f"scenario={scenario}", f"architecture={architecture}"]
    for words, levels in chosen:
        if not words.is_listed or any('"' in words.value(at) for at in range(len(words.values))):
            return ""
        found = [
            f'"{words.name}={words.value(place)}"' for place in np.flatnonzero(levels).tolist()
        ]
        parts.append(found[0] if len(found) == 1 else f"({' or '.join(found)})")
    text = " and ".join(parts)
    return text if len(text) <= LONGEST else ""
