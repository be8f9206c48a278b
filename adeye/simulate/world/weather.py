"""How rain, fog, darkness and a low sun shorten the range of a sensor."""

from __future__ import annotations

import math
from typing import Final

from adeye.kernel.elementary import atan2, cos, exp, log, power, sin
from adeye.kernel.jit import compiled
from adeye.signals import ILLUMINANCE

MM_PER_HOUR: Final = 1e-3 / 3600.0
"""One millimetre per hour [m/s]."""

LIDAR_RAIN_A: Final = 0.01
LIDAR_RAIN_B: Final = 0.6
"""Extinction of a lidar beam in rain, a·R^b [1/m] with R [mm/h] (Goodin et al. 2019)."""

LIGHT_RAIN_A: Final = 1.076 / 4.343 * 1e-3
LIGHT_RAIN_B: Final = 0.67
"""Extinction of visible light in rain, a·R^b [1/m] with R [mm/h]: 1.076·R^0.67 dB/km
(Carbonneau 1998, as in ITU-R P.1814), divided by 4.343 dB per neper."""

RAIN_K: Final = 1.1276
RAIN_ALPHA: Final = 0.7073
"""Specific attenuation in rain at 77 GHz, k·R^alpha [dB/km] with R [mm/h], of vertical polarisation
(Recommendation ITU-R P.838-3, 2005, eqs. 1 to 3); horizontal is higher by less than 6 %
up to 150 mm/h."""

NEPER: Final = 4.342944819032518
"""Decibels of a power that is e times another."""

KOSCHMIEDER: Final = 3.912
"""Extinction times visibility in fog: contrast falls to 2 % (Koschmieder 1924)."""

SUN_ILLUMINANCE: Final = 2e4
"""Of a low sun in clear air on a plane that faces it [lx]. Our choice: about that of a sun that is
7 degrees high (IES: 127.5 klx·exp(-0.21/sin(elevation))). It is held for every elevation, so that
a lower sun is never the better one; haze that weakens a sun at the horizon is left out."""

GLARE: Final = 10.0
"""Veiling luminance [cd/m²] by illuminance at the eye [lx] and angle squared [1/deg²]: the
Stiles-Holladay formula of disability glare, taken for a lens as for an eye. Its form in CIE
146:2002 has a factor for the age of the eye besides, which is left out. The formula is for 1 to 30
degrees; nearer than 1 degree the glare of 1 degree is taken, farther than 30 it is carried on."""

GREY: Final = 0.2
"""Share of light that the surroundings return, against which glare counts. Our choice: dry road."""

_DARK: Final = ILLUMINANCE["night"]
_BRIGHT: Final = ILLUMINANCE["day"]

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
def radar_rain_extinction(rain: float) -> float:
    """Return the extinction of a radar's power on one way through rain [1/m].

    Args:
        rain: [m/s].
    """
    if not rain > 0.0:
        return 0.0
    return RAIN_K * power(rain / MM_PER_HOUR, RAIN_ALPHA) / (1e3 * NEPER)


@compiled
def camera_range(clear_range: float, rain: float, visibility: float, night_share: float) -> float:
    """Range at which a camera still tells an object from its background [m].

    The image of an object shrinks with 1/z and its contrast with exp(-extinction·z), so the range
    solves z·exp(extinction·z) = clear_range; at night the clear range is shortened first.

    Args:
        clear_range: Range by day in clear air [m].
        rain: [m/s].
        visibility: In fog [m].
        night_share: Share of the range that is left, 1 by day; darkness and glare both take from
            it.
    """
    if night_share <= 0.0:
        return 0.0
    return range_in_extinction(clear_range * night_share, light_extinction(rain, visibility))


@compiled
def light_share(night_share: float, illuminance: float) -> float:
    """Share of its range by day that a camera keeps in some light.

    It rises linearly with the logarithm of the illuminance between night and day, as an eye's
    acuity does roughly, and is held beyond both. Our choice.

    Args:
        night_share: Share that is left at night (``ILLUMINANCE["night"]``), 0 to 1.
        illuminance: Of a horizontal surface [lx]; 1 is returned from ``ILLUMINANCE["day"]`` on.

    >>> light_share(0.5, 0.1), light_share(0.5, 2e4)
    (0.5, 1.0)
    """
    if illuminance >= _BRIGHT:
        return 1.0
    if illuminance <= _DARK:
        return night_share
    light = log(illuminance / _DARK) / log(_BRIGHT / _DARK)
    return night_share + (1.0 - night_share) * light


@compiled
def sun_cosine(ahead_x: float, ahead_y: float, elevation: float, azimuth: float) -> float:
    """Cosine of the angle between a level line of sight and the sun.

    Args:
        ahead_x: Unit vector of the line of sight in the map.
        ahead_y: The same.
        elevation: Of the sun above the horizon [rad].
        azimuth: Of the sun, counter-clockwise from the map's x axis [rad].
    """
    toward = ahead_x * cos(azimuth) + ahead_y * sin(azimuth)
    return cos(elevation) * toward


@compiled
def veil(lens: float, cosine: float) -> float:
    """Veiling luminance of a glaring light, 10 E / θ² with θ in degrees [cd/m²].

    Args:
        lens: Illuminance E by the light on the lens [lx].
        cosine: Of the angle θ between the light and what is looked at; it counts as one degree
            below that, where the formula begins to hold.

    Source:
        Holladay (1926), Stiles (1929): the eye's stray light, whose form with the age of the eye
        is in CIE 146:2002, "CIE equations for disability glare". That a lens scatters as much as
        a young eye is our choice.
    """
    if lens <= 0.0:
        return 0.0
    angle = atan2(math.sqrt(max(0.0, 1.0 - cosine * cosine)), cosine) * (180.0 / math.pi)
    angle = max(1.0, angle)
    return GLARE * lens / (angle * angle)


@compiled
def glare_contrast(cosine: float, illuminance: float) -> float:
    """Share of contrast that the sun's glare leaves in the direction of a line of sight.

    Light that is scattered in the lens veils the image: the contrast falls by L/(L + V), with the
    luminance L of the surroundings and V of the veil, which goes with 1/angle². A hood is not
    modelled.

    Args:
        cosine: Of the angle between line of sight and sun, see ``sun_cosine``; ask only while the
            sun is above the horizon.
        illuminance: Of a horizontal surface [lx], positive.

    Returns:
        0 to 1; 1 where the sun stands at a right angle or behind.

    Source:
        Stiles-Holladay, see ``veil``.

    >>> glare_contrast(0.0, 2e4)
    1.0
    """
    if cosine <= 0.0:
        return 1.0
    return contrast_behind_veil(SUN_ILLUMINANCE * cosine, cosine, illuminance)


@compiled
def contrast_behind_veil(lens: float, cosine: float, illuminance: float) -> float:
    """Share of contrast that a light on the lens leaves, L/(L + V) of ``glare_contrast``.

    Args:
        lens: Illuminance by the light on the lens [lx].
        cosine: Of the angle between the light and what is looked at.
        illuminance: Of a horizontal surface [lx], positive.
    """
    luminance = GREY / math.pi * illuminance
    return luminance / (luminance + veil(lens, cosine))


@compiled
def light_extinction(rain: float, visibility: float) -> float:
    """Extinction of visible light in rain and fog [1/m].

    Args:
        rain: [m/s].
        visibility: In fog [m].
    """
    return (
        LIGHT_RAIN_A * power(rain / MM_PER_HOUR, LIGHT_RAIN_B) if rain > 0.0 else 0.0
    ) + KOSCHMIEDER / visibility
