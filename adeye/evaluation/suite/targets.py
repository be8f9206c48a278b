"""What a suite must see: road users with their size, and the three cases that ask for range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from adeye.kernel.elementary import power
from adeye.world.objects import CONTRAST, CROSS_SECTION, DEFAULT_REFLECTIVITY, DEFAULT_SIZES


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
        power(10.0, 0.1 * CROSS_SECTION[kind][0]),
        CONTRAST[kind],
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
§ 18); the pedestrian of UN R157, 5.2.5.3 (5 km/h or less)."""
