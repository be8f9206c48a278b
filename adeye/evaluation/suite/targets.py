"""What a suite must see: road users with their size, and the three cases that ask for range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from adeye.world.objects import DEFAULT_REFLECTIVITY, DEFAULT_SIZES

CROSS_SECTIONS: Final = {"car": 10.0, "pedestrian": 0.16}
"""Mean radar cross section at 77 GHz from behind or before [m²]: 10 and -8 dBsm. Our choice, of the
order of what is published for 76 to 81 GHz."""

CONTRASTS: Final = {"car": 0.5, "pedestrian": 0.25}
"""Contrast against road and sky where nothing weakens it. Our choice: painted vehicles with shadow,
windows and lamps stand out, clothing of people less."""


@dataclass(frozen=True, slots=True)
class Target:
    """A road user as sensors see it.

    Attributes:
        id: Its class.
        length_m: [m].
        width_m: [m].
        height_m: [m].
        reflectivity: Share of light that it returns.
        cross_section_m2: For radar [m²].
        contrast: For cameras, close by.
    """

    id: str
    length_m: float
    width_m: float
    height_m: float
    reflectivity: float
    cross_section_m2: float
    contrast: float


def target(kind: str) -> Target:
    """Describe a class of road user by its default size and surface."""
    return Target(
        kind,
        *DEFAULT_SIZES[kind],
        DEFAULT_REFLECTIVITY[kind],
        CROSS_SECTIONS[kind],
        CONTRASTS[kind],
    )


TARGETS: Final = {kind: target(kind) for kind in ("car", "pedestrian")}
"""Classes that coverage is computed for."""


@dataclass(frozen=True, slots=True)
class Case:
    """A situation that asks for range ahead.

    Attributes:
        id: Its name.
        title: In words.
        target: Class of the other.
        speed_mps: Of the other along the road [m/s].
        crossing_mps: Of the other across the road [m/s].
    """

    id: str
    title: str
    target: str
    speed_mps: float
    crossing_mps: float


CASES: Final = (
    Case("stopped_car", "stopped car", "car", 0.0, 0.0),
    Case("slower_car", "car at 60 km/h", "car", 60.0 / 3.6, 0.0),
    Case("crossing_pedestrian", "pedestrian crossing at 5 km/h", "pedestrian", 0.0, 5.0 / 3.6),
)
"""Standing traffic; the slowest vehicle that German motorways admit goes faster than 60 km/h (StVO
§ 18); the pedestrian of UN R157 (5 km/h or less)."""
