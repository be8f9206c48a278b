"""How well a camera tells an object from what is behind it: light, air, glare, noise of light."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from adeye.kernel.detection_range import headlamp_share
from adeye.kernel.elementary import exp
from adeye.kernel.jit import inlined
from adeye.signals import OBJECT_CLASSES
from adeye.world.objects import CONTRAST, DEFAULT_SIZES
from adeye.world.weather import GREY

CONTRASTS: Final = np.array([CONTRAST[kind] for kind in OBJECT_CLASSES])
"""Contrast (11,) of each class by its number."""

LAMPS: Final = {
    "car": 10.0,
    "van": 10.0,
    "truck": 10.0,
    "bus": 10.0,
    "motorcycle": 5.0,
    "cyclist": 2.0,
}
"""Intensity of the lamps that a class shows to whoever looks at it [cd]. Our choice: one or two
rear position lamps of 5 cd, of the order of UN R7, and a weaker one on a bicycle. Those of the
front are brighter. What is parked and who walks shows none."""

SHINE: Final = np.array(
    [
        math.pi * LAMPS[kind] / (GREY * DEFAULT_SIZES[kind][1] * DEFAULT_SIZES[kind][2])
        if kind in LAMPS
        else 0.0
        for kind in OBJECT_CLASSES
    ]
)
"""Illuminance (11,) that would make the rear of a class as bright, on average, as its own lamps do
[lx]: a surface of area A and intensity I has the luminance I / A, one that returns the share r of
an illuminance E has r E / pi."""


@inlined
def beam(intensity: float, cosine: float, distance: float) -> float:
    """Illuminance [lx] by the own headlamps on a surface that faces them, I / d².

    Args:
        intensity: Straight ahead [cd].
        cosine: Of the angle to the ego's heading.
        distance: [m].
    """
    return intensity * headlamp_share(cosine) / (distance * distance)


@inlined
def shown_contrast(
    contrast: float, distance: float, extinction: float, illuminance: float, veiling: float
) -> float:
    """Contrast of an object that air and glare leave.

    Args:
        contrast: Without air and glare, behind the lens.
        distance: [m].
        extinction: Of the air [1/m]: contrast falls with exp(-extinction * distance)
            (Koschmieder 1924).
        illuminance: Of the object, with ``SHINE`` [lx].
        veiling: Luminance of the glare that lies over the image [cd/m²].
    """
    shown = contrast * exp(-extinction * distance)
    if veiling > 0.0:
        luminance = illuminance * GREY / math.pi
        shown *= luminance / (luminance + veiling)
    return shown
