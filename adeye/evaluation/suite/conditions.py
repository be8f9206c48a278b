"""The conditions that a suite is analysed in: rain, fog, light, a low sun and grip."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from adeye.signals import ILLUMINANCE
from adeye.world.weather import MM_PER_HOUR

if TYPE_CHECKING:
    from adeye.spec.odd import EnvironmentalConditions

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
