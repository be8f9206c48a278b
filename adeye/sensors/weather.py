"""How rain, fog and darkness shorten the range of a sensor."""

from __future__ import annotations

import math
from typing import Final

from adeye.kernel.elementary import exp, log, power
from adeye.kernel.jit import compiled

MM_PER_HOUR: Final = 1e-3 / 3600.0
"""One millimetre per hour [m/s]."""

LIDAR_RAIN_A: Final = 0.01
LIDAR_RAIN_B: Final = 0.6
"""Extinction of a lidar beam in rain, a·R^b [1/m] with R [mm/h] (Goodin et al. 2019, eq. 4)."""

LIGHT_RAIN_A: Final = 1.076 / 4.343 * 1e-3
LIGHT_RAIN_B: Final = 0.67
"""Extinction of visible light in rain, a·R^b [1/m] with R [mm/h]: 1.076·R^0.67 dB/km
(Carbonneau 1998, as in ITU-R P.1814), divided by 4.343 dB per neper."""

KOSCHMIEDER: Final = 3.912
"""Extinction times visibility in fog: contrast falls to 2 % (Koschmieder 1924)."""

REFLECTIVITY: Final = {
    "car": 0.5,
    "van": 0.5,
    "truck": 0.5,
    "bus": 0.5,
    "motorcycle": 0.3,
    "cyclist": 0.3,
    "pedestrian": 0.3,
    "parked_truck": 0.5,
    "parked_car": 0.5,
    "barrier": 0.4,
    "building": 0.4,
}
"""Typical share of near-infrared light that surfaces return; a scenario may set its own."""

ROAD_REFLECTIVITY: Final = 0.15
"""Of the ground [1]: dry asphalt in the near infrared. Our choice."""


@compiled
def range_in_extinction(clear_range: float, extinction: float) -> float:
    """Solve z·exp(extinction·z) = clear_range for the range z that is left.

    A signal that falls with the distance and with exp(-extinction·z) on top reaches, at z, the
    strength that it has at ``clear_range`` without extinction.

    Args:
        clear_range: Range without extinction [m], positive.
        extinction: [1/m], not negative.

    Returns:
        Range [m], by Newton's method on ln(z) + extinction·z, which is concave and rises, so that
        it converges from below without overshooting.

    >>> round(range_in_extinction(150.0, 0.01 * 7.5**0.6), 1)
    39.7
    """
    if extinction <= 0.0:
        return clear_range
    target = log(clear_range)
    z = clear_range / (1.0 + extinction * clear_range)
    for _ in range(100):
        change = (target - log(z) - extinction * z) / (1.0 / z + extinction)
        z += change
        if abs(change) <= 1e-14 * z:
            break
    return z


@compiled
def lidar_range(
    clear_range: float, reflectivity: float, reference: float, rain: float, visibility: float
) -> float:
    """Range at which a lidar still gets a return above its threshold [m].

    The received power falls with reflectivity/z² and with exp(-2·extinction·z), so the range
    solves z·exp(extinction·z) = clear_range·sqrt(reflectivity/reference).

    Args:
        clear_range: Range in clear air at the reference reflectivity [m].
        reflectivity: Of the target, 0 to 1.
        reference: Reflectivity at which the clear range is specified.
        rain: [m/s].
        visibility: In fog [m].

    Source:
        Goodin, Carruth, Doude & Hudson (2019), "Predicting the influence of rain on LIDAR in
        ADAS", Electronics 8(1), 89.
    """
    if reflectivity <= 0.0:
        return 0.0
    extinction = (
        LIDAR_RAIN_A * power(rain / MM_PER_HOUR, LIDAR_RAIN_B) if rain > 0.0 else 0.0
    ) + KOSCHMIEDER / visibility
    return range_in_extinction(clear_range * math.sqrt(reflectivity / reference), extinction)


@compiled
def lidar_rain_noise(rain: float) -> float:
    """Standard deviation of a lidar's range in rain, as a share of the range: 0.02·(1-exp(-R))².

    Args:
        rain: [m/s]; R is the same in mm/h.

    Source:
        Goodin, Carruth, Doude & Hudson (2019), "Predicting the influence of rain on LIDAR in
        ADAS", Electronics 8(1), 89.
    """
    wet = 1.0 - exp(-rain / MM_PER_HOUR)
    return 0.02 * wet * wet


@compiled
def camera_range(clear_range: float, rain: float, visibility: float, night_share: float) -> float:
    """Range at which a camera still tells an object from its background [m].

    The image of an object shrinks with 1/z and its contrast with exp(-extinction·z), so the range
    solves z·exp(extinction·z) = clear_range; at night the clear range is shortened first.

    Args:
        clear_range: Range by day in clear air [m].
        rain: [m/s].
        visibility: In fog [m].
        night_share: Share of the range that is left, 1 by day.
    """
    extinction = (
        LIGHT_RAIN_A * power(rain / MM_PER_HOUR, LIGHT_RAIN_B) if rain > 0.0 else 0.0
    ) + KOSCHMIEDER / visibility
    return range_in_extinction(clear_range * night_share, extinction)
