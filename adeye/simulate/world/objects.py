"""Boxes around actors and static objects: their classes and default sizes."""

from __future__ import annotations

from typing import Final

import numpy as np

from adeye.signals import OBJECT_CLASSES, Ints

DEFAULT_SIZES: Final[dict[str, tuple[float, float, float]]] = {
    "car": (4.5, 1.8, 1.5),
    "van": (5.9, 2.0, 2.6),
    "truck": (12.0, 2.5, 3.8),
    "bus": (12.0, 2.55, 3.2),
    "motorcycle": (2.2, 0.8, 1.5),
    "cyclist": (1.8, 0.6, 1.75),
    "pedestrian": (0.5, 0.6, 1.75),
}
"""Length, width, height of an actor without a size of its own [m].

Typical values, not norms: a compact car (segment C), a long-wheelbase delivery van, a rigid truck
and a city bus at the 12 m of Directive 96/53/EC, which also limits the width to 2.55 m and the
height to 4.0 m; a person with a step's length and a shoulder's width.
"""

DEFAULT_REFLECTIVITY: Final[dict[str, float]] = {
    **dict.fromkeys(("car", "van", "truck", "bus", "parked_truck", "parked_car"), 0.5),
    **dict.fromkeys(("motorcycle", "cyclist", "pedestrian"), 0.3),
    **dict.fromkeys(("barrier", "building"), 0.4),
}
"""Share of light that a surface without a value of its own returns at lidar wavelengths.

Typical values: paint spreads from 0.05 (black) to 0.9 (white), clothing from 0.05 to 0.8, and
concrete lies about 0.4. Sweep them where they matter.
"""


CROSS_SECTION: Final[dict[str, tuple[float, float]]] = {
    "car": (10.0, 15.0),
    "van": (12.0, 17.0),
    "truck": (20.0, 25.0),
    "bus": (20.0, 25.0),
    "motorcycle": (5.0, 8.0),
    "cyclist": (0.0, 3.0),
    "pedestrian": (-8.0, -8.0),
    "parked_truck": (20.0, 25.0),
    "parked_car": (10.0, 15.0),
    "barrier": (5.0, 10.0),
    "building": (25.0, 25.0),
}
"""Mean radar cross section of the front or rear and of a side, seen at right angles [dBsm]. Our
choice, of the order of what is published for 76 to 81 GHz: a person around -8, a car around 10, a
truck around 20, sides a few decibels more than ends."""

CONTRAST: Final[dict[str, float]] = {
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


def class_indices(kinds: tuple[str, ...]) -> Ints:
    """Return the numbers (M,) of kinds of actors and objects in ``signals.OBJECT_CLASSES``."""
    return np.array([OBJECT_CLASSES.index(kind) for kind in kinds], dtype=np.int64)
