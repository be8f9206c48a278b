"""How far an object-level camera, radar or lidar reaches in the weather and light of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.sight import DISTANCE, DX, DY
from adeye.world.weather import (
    camera_range,
    glare_contrast,
    lidar_range,
    light_share,
    sun_cosine,
)

if TYPE_CHECKING:
    from adeye.signals import Floats

CAMERA: Final = 0
RADAR: Final = 1
LIDAR: Final = 2
"""Kinds of object-level sensor."""


@compiled
def fill_reach(kind: int, parameters: Any, reflectivity: Floats, reach: Floats) -> None:
    """Compute the range that weather and light leave for each object; glare is left out.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        parameters: (B,) records of the sensor's parameters and the conditions.
        reflectivity: (B, M) of each object.
        reach: (B, M) out [m].
    """
    for run in range(reach.shape[0]):
        for thing in range(reach.shape[1]):
            reach[run, thing] = _reach(kind, parameters[run], reflectivity[run, thing])


@compiled
def _reach(kind: int, parameters: Any, reflectivity: float) -> float:
    if kind == LIDAR:
        return lidar_range(
            parameters["range"],
            reflectivity,
            parameters["reference_reflectivity"],
            parameters["rain"],
            parameters["visibility"],
        )
    if kind == CAMERA:
        return _seen_from(parameters, 1.0)
    return float(parameters["range"])


@inlined
def _seen_from(parameters: Any, contrast: float) -> float:
    """Range of a camera at a share of the contrast [m]."""
    share = light_share(parameters["night_range"], parameters["illuminance"])
    return camera_range(
        parameters["range"], parameters["rain"], parameters["visibility"], share * contrast
    )


@inlined
def reach_in_glare(parameters: Any, reach: float, look: Floats) -> float:
    """Range of a camera that is left for an object when the sun stands above the horizon [m].

    Args:
        parameters: Record of the sensor's parameters and the conditions.
        reach: Without glare [m].
        look: (OUTLINE_WIDTH,) where the object is from the camera.
    """
    distance = look[DISTANCE]
    if distance <= 0.0:
        return reach
    contrast = glare_contrast(
        sun_cosine(
            look[DX] / distance,
            look[DY] / distance,
            parameters["sun_elevation"],
            parameters["sun_azimuth"],
        ),
        parameters["illuminance"],
    )
    return _seen_from(parameters, contrast) if contrast < 1.0 else reach
