"""How accurate a channel takes its sensors to be: what their data sheets tell, and floors.

A channel knows the data sheet of a sensor, as it was bought; it knows neither the error of a sample
nor a fault. Where a sweep changes a noise it changes the data sheet, and with it what is assumed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.elementary import tan
from adeye.kernel.jit import inlined
from adeye.sensors.radar_equation import detection_threshold

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from adeye.ports import ChannelContext
    from adeye.signals import Floats

# Columns of what is assumed of a sensor, variances all.
(
    ALONG,  # of the place along the line of sight [m²]
    ALONG_GROWTH,  # what is added to it, times the fourth power of the distance [1/m²]
    ACROSS,  # of the place across the line of sight [m²]
    BEARING,  # of the bearing, which is added to it times the square of the distance [rad²]
    RATE,  # of the range rate [m²/s²]
) = range(5)
ACCURACY_WIDTH: Final = 5

# Standard deviations (m, 1/m, m, rad, m/s) of what no data sheet tells, which are added to what it
# does, as independent errors are. So they are floors. Our choice.
_CENTRES: Final = (0.02, 0.0, 0.02, 0.0, 0.05)
"""Sensors that report the centre of a box: what is left is how the ego turns and speeds up
unnoticed between sample and use, and how well it knows its own speed."""

_GROUND_CONTACTS: Final = (0.3, 0.0, 0.1, 0.0, 0.05)
"""Cameras that find the lower edge of an object and guess the rest of it from its class."""

_OUTLINES: Final = (0.15, 0.0, 0.1, 0.0, 0.05)
"""Lidars that see a face: bent, aslant, and part of it only."""

_REFLECTIONS: Final = (0.5, 0.0, 0.2, 0.0, 0.25)
"""Radars whose echo comes from somewhere on an object. A point at the side of a body that turns
does not have the rate of its centre, nor has a sensor ahead of the ego's axle that of the ego."""

_ECHOES: Final = (0.1, 0.0, 0.5, 0.0, 0.05)
"""Ultrasonic sensors that hear the nearest surface, wherever the middle of it is."""

_UNKNOWN: Final = (0.3, 3e-4, 0.1, 0.003, 0.05)
"""Where no data sheet can be read: those of a middling camera."""

_HALF_PIXEL: Final = 0.5
"""Standard deviation of the row of a ground contact [pixels]. Rounding alone has 1/√12, but stays
the same from sample to sample, so a filter that takes errors for independent must assume more."""

Columns = tuple["Floats | float", ...]
"""Standard deviations in the order of the columns, each for every run (B,) or the same for all."""


@inlined
def assumed_noise(accuracy: Floats, distance: float) -> tuple[float, float]:
    """Return the assumed variance of a detection along and across the line of sight [m²].

    Args:
        accuracy: (ACCURACY_WIDTH,) of the sensor.
        distance: From the sensor [m].
    """
    square = distance * distance
    return (
        accuracy[ALONG] + accuracy[ALONG_GROWTH] * square * square,
        accuracy[ACROSS] + accuracy[BEARING] * square,
    )


def assumed_accuracy(context: ChannelContext, sensors: Sequence[str]) -> Floats:
    """Return what a channel assumes of some of its linked sensors (B, S, ACCURACY_WIDTH).

    Args:
        context: Gives their models, data sheets and mounts.
        sensors: Their ids.
    """
    found = np.zeros((context.runs, len(sensors), ACCURACY_WIDTH))
    for index, name in enumerate(sensors):
        model = context.models.get(name, context.sensors[name])
        floors, read = _MODELS.get(model, (_UNKNOWN, None))
        told: Columns = (0.0,) * ACCURACY_WIDTH
        sheet = context.data_sheets.get(name)
        if sheet is not None and read is not None:
            told = read(sheet)
        elif model != "ground_truth":
            floors = _UNKNOWN
        for column in range(ACCURACY_WIDTH):
            found[:, index, column] = np.square(floors[column]) + np.square(told[column])
    return found


def _object_camera(sheet: Mapping[str, Floats]) -> Columns:
    """At full range the deviation is that share of it, and it grows with the square."""
    growth = sheet["distance_noise"] / sheet["range"]
    return 0.0, growth, 0.0, sheet["bearing_noise"], 0.0


def _object_radar(sheet: Mapping[str, Floats]) -> Columns:
    return sheet["range_noise"], 0.0, 0.0, sheet["bearing_noise"], sheet["range_rate_noise"]


def _object_lidar(sheet: Mapping[str, Floats]) -> Columns:
    return sheet["range_noise"], 0.0, 0.0, sheet["bearing_noise"], 0.0


def _physical_camera(sheet: Mapping[str, Floats]) -> Columns:
    """A row of the ground at depth z is z²/(f·h) deep, f in pixels; a column is 1/f wide."""
    edges = np.array([tan(0.5 * angle) for angle in sheet["field_of_view"]])
    focal = 0.5 * sheet["columns"] / edges
    return 0.0, _HALF_PIXEL / (focal * sheet["mount.z"]), 0.0, 1.0 / focal, 0.0


def _physical_lidar(sheet: Mapping[str, Floats]) -> Columns:
    """The end of a face is anywhere between two beams."""
    spacing = sheet["field_of_view"] / sheet["beams"]
    bearing = np.sqrt(np.square(sheet["bearing_noise"]) + np.square(spacing) / 12.0)
    return sheet["range_noise"], 0.0, 0.0, bearing, 0.0


def _physical_radar(sheet: Mapping[str, Floats]) -> Columns:
    """Resolution / sqrt(2·SNR), at the weakest echo that is detected; stronger ones are better.

    Source:
        Curry (2005), "Radar system performance modeling", 2nd ed.
    """
    weakest = np.array([detection_threshold(rate) for rate in sheet["false_alarm_rate"]])
    share = 1.0 / np.sqrt(2.0 * weakest)
    return (
        share * sheet["range_resolution"],
        0.0,
        0.0,
        share * sheet["bearing_resolution"],
        share * sheet["range_rate_resolution"],
    )


def _ultrasonic(sheet: Mapping[str, Floats]) -> Columns:
    """The echo comes from anywhere in the cone."""
    return sheet["range_noise"], 0.0, 0.0, sheet["field_of_view"] / math.sqrt(12.0), 0.0


_MODELS: Final[
    dict[str, tuple[tuple[float, ...], Callable[[Mapping[str, Floats]], Columns] | None]]
] = {
    "ground_truth": (_CENTRES, None),
    "camera": (_CENTRES, _object_camera),
    "radar": (_CENTRES, _object_radar),
    "lidar": (_CENTRES, _object_lidar),
    "camera/physical": (_GROUND_CONTACTS, _physical_camera),
    "radar/physical": (_REFLECTIONS, _physical_radar),
    "lidar/physical": (_OUTLINES, _physical_lidar),
    "ultrasonic": (_ECHOES, _ultrasonic),
}
"""Floors of every model, and how its data sheet is read."""
