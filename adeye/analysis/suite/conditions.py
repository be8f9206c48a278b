"""The conditions that a suite is analysed in: rain, fog, light, a low sun and grip."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from adeye.kernel.elementary import power
from adeye.signals import ILLUMINANCE
from adeye.simulate.world.objects import (
    CONTRAST,
    CROSS_SECTION,
    DEFAULT_REFLECTIVITY,
    DEFAULT_SIZES,
)
from adeye.simulate.world.weather import MM_PER_HOUR

if TYPE_CHECKING:
    from adeye.spec.odd import EnvironmentalConditions

# --- The conditions that a suite is analysed in: rain, fog, light, a low sun and grip -------------

LIGHTS: Final = ("day", "dusk", "lit_night", "night")
"""Illuminations, the brightest first."""

CLEAR_AIR: Final = 10_000.0
"""Visibility without fog [m], as in the shipped scenarios."""

DRY: Final = 0.9
WET: Final = 0.6
"""Friction of a dry and of a wet road. Our choice: what the shipped scenarios and driving manuals
use; an ODD states its own lowest."""


@dataclass(frozen=True, slots=True)
class Condition:
    """One combination of weather, light and grip.

    Attributes:
        id: Its name.
        rain_mps: Rain rate [m/s].
        visibility_m: In fog [m].
        light: Illumination.
        friction: Between tyre and road.
        sun_elevation_rad: Of a sun straight ahead of the ego; None if nobody looks into it.
    """

    id: str
    rain_mps: float
    visibility_m: float
    light: str
    friction: float
    sun_elevation_rad: float | None = None

    @property
    def illuminance(self) -> float:
        """Of a horizontal surface [lx]."""
        return ILLUMINANCE[self.light]

    @property
    def text(self) -> str:
        """Say in short what it is."""
        parts = [self.light.replace("_", " ")]
        if self.rain_mps > 0.0:
            parts.append(f"{self.rain_mps / MM_PER_HOUR:g} mm/h rain")
        if self.visibility_m < CLEAR_AIR:
            parts.append(f"{self.visibility_m:g} m visibility")
        if self.sun_elevation_rad is not None:
            parts.append(f"sun ahead at {math.degrees(self.sun_elevation_rad):.3g} deg")
        return ", ".join([*parts, f"friction {self.friction:g}"])


DEFAULTS: Final = (
    Condition("dry_day", 0.0, CLEAR_AIR, "day", DRY),
    Condition("rain", 7.5 * MM_PER_HOUR, CLEAR_AIR, "day", WET),
    Condition("night", 0.0, CLEAR_AIR, "night", DRY),
)
"""Where no ODD says otherwise; the first is the reference."""


def conditions_of(environment: EnvironmentalConditions) -> tuple[Condition, ...]:
    """Take the corners of an ODD: the best of it, each adverse attribute alone, all together.

    The lowest friction counts where it rains and where everything comes together; where an ODD
    limits friction only, it is a corner of its own. A low sun that the ODD names stands straight
    ahead; it comes together with the rest only where the darkest light is that of day.

    Args:
        environment: Environmental attributes of the ODD.

    Returns:
        The best conditions first, the worst last; one only if nothing is adverse.
    """
    lights = sorted(environment.illumination, key=LIGHTS.index) or ["day"]
    grip = environment.friction.min if environment.friction is not None else None
    low = WET if grip is None else min(WET, grip)
    best = Condition("best", 0.0, CLEAR_AIR, lights[0], DRY if grip is None else max(DRY, grip))
    worst = best
    found = [best]
    if environment.rain is not None and environment.rain.max > 0.0:
        wet = {"rain_mps": environment.rain.max, "friction": low}
        found.append(replace(best, id="rain", **wet))
        worst = replace(worst, **wet)
    elif grip is not None and grip < best.friction:
        found.append(replace(best, id="slippery", friction=grip))
        worst = replace(worst, friction=grip)
    if environment.fog is not None and environment.fog.min_visibility < CLEAR_AIR:
        found.append(replace(best, id="fog", visibility_m=environment.fog.min_visibility))
        worst = replace(worst, visibility_m=environment.fog.min_visibility)
    if environment.sun_elevation is not None and lights[0] == "day":
        elevation = environment.sun_elevation.min
        found.append(replace(best, id="low_sun", sun_elevation_rad=elevation))
        if lights[-1] == "day":
            worst = replace(worst, sun_elevation_rad=elevation)
    if lights[-1] != lights[0]:
        found.append(replace(best, id=lights[-1], light=lights[-1]))
        worst = replace(worst, light=lights[-1])
    if len(found) > 2:
        found.append(replace(worst, id="worst"))
    return tuple(found)


# --- What a suite must see: road users with their size, and the three cases that ask for range ----


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


TARGETS: Final = ("car", "pedestrian")
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
