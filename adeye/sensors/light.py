"""How well a camera tells an object from what is behind it: light, air, glare, noise of light."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from adeye.kernel.elementary import exp
from adeye.kernel.jit import compiled, inlined
from adeye.signals import OBJECT_CLASSES
from adeye.world.objects import DEFAULT_SIZES
from adeye.world.weather import GREY

CONTRAST: Final = {
    "car": 0.5,
    "van": 0.5,
    "truck": 0.6,
    "bus": 0.6,
    "motorcycle": 0.35,
    "cyclist": 0.3,
    "pedestrian": 0.25,
    "parked_truck": 0.6,
    "parked_car": 0.5,
    "barrier": 0.4,
    "building": 0.5,
}
"""Contrast of each class against road and sky where nothing weakens it. Our choice: painted
vehicles with shadow, windows and lamps stand out, clothing of people less."""

CONTRASTS: Final = np.array([CONTRAST[kind] for kind in OBJECT_CLASSES])
"""The same (11,) by number of the class."""

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

LIGHT_OF_THRESHOLD: Final = 120.0
"""Illuminance at which the noise of light doubles the square of the threshold [lx]. Our choice: so
a pedestrian of contrast 0.25 needs 5 lx where the threshold is 0.05 by day, the illuminance to
which the range of headlamps is commonly rated."""

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


@compiled
def threshold_at(threshold: float, illuminance: float) -> float:
    """Least contrast that is seen at an illuminance; infinite in the dark.

    The noise of light falls with the square root of its amount, so the threshold is
    ``threshold * sqrt(1 + E0 / E)`` with E0 = ``LIGHT_OF_THRESHOLD``: constant by day, where other
    noise decides, and inversely as the square root of the illuminance at night.

    Args:
        threshold: By day.
        illuminance: Of what is looked at [lx].

    Source:
        de Vries (1943) and Rose (1948), "The sensitivity performance of the human eye on an
        absolute scale", J. Opt. Soc. Am. 38, 196, which holds for any device that makes pictures.
        That both kinds of noise add by their squares and the value of E0 are our choice.
    """
    if not illuminance > 0.0:
        return math.inf
    return threshold * math.sqrt(1.0 + LIGHT_OF_THRESHOLD / illuminance)


@inlined
def beam(intensity: float, cosine: float, distance: float) -> float:
    """Illuminance [lx] by the own headlamps on a surface that faces them, I / d².

    Args:
        intensity: Straight ahead [cd].
        cosine: Of the angle to the ego's heading; half of the intensity is left at 19 degrees
            (its twelfth power, our choice), nothing from 90 degrees on.
        distance: [m].
    """
    if cosine <= 0.0:
        return 0.0
    square = cosine * cosine
    fourth = square * square
    return intensity * fourth * fourth * fourth / (distance * distance)


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
