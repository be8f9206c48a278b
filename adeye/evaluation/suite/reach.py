"""From where to where a sensor detects a target in some conditions, by closed forms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple, cast

import numpy as np

from adeye.kernel.detection_range import (
    contrast_range,
    cross_section_range,
    focal_length,
    headlamp_share,
    pixel_range,
    sure_beams,
)
from adeye.kernel.elementary import cos, tan
from adeye.spec.sensors import model_name
from adeye.world.weather import (
    camera_range,
    lidar_range,
    light_extinction,
    light_share,
    radar_rain_extinction,
    range_in_extinction,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.evaluation.suite.conditions import Condition
    from adeye.evaluation.suite.targets import Target
    from adeye.spec.sensors import (
        Camera,
        Lidar,
        PhysicalCamera,
        PhysicalLidar,
        PhysicalRadar,
        Radar,
        Sensor,
        Ultrasonic,
    )

GROUND: Final = 0.2
"""A return from lower than this is taken for the ground [m]. Our choice."""

_STEP: Final = 0.25
"""Distance between two looks of a lidar [m]."""


class Reach(NamedTuple):
    """Nearest and farthest distance at which a target is detected [m]; no range if equal."""

    near: float
    far: float


NOTHING: Final = Reach(0.0, 0.0)


def reach_of(sensor: Sensor, target: Target, condition: Condition) -> Reach | None:
    """Compute from where to where a sensor detects a target that stands alone.

    Args:
        sensor: Its record.
        target: What is to be seen.
        condition: Weather and light.

    Returns:
        None for a sensor that does not look around, or a plug-in, of which nothing is known.
    """
    model = _MODELS.get(model_name(sensor))
    return None if model is None else model(sensor, target, condition)


def _camera(sensor: Sensor, _target: Target, condition: Condition) -> Reach:
    spec = cast("Camera", sensor)
    share = light_share(spec.night_range, condition.illuminance)
    if share <= 0.0:
        return NOTHING
    far = camera_range(spec.range, condition.rain_mps, condition.visibility_m, share)
    return Reach(0.0, far)


def _physical_camera(sensor: Sensor, target: Target, condition: Condition) -> Reach:
    """Both rows and contrast must suffice, with sky, street and headlamps for light."""
    spec = cast("PhysicalCamera", sensor)
    rows = float(spec.min_pixel_height)
    tall = pixel_range(target.height_m, focal_length(spec.columns, spec.field_of_view), rows)
    extinction = light_extinction(condition.rain_mps, condition.visibility_m)
    clear = contrast_range(
        target.contrast * spec.transmission,
        spec.contrast_threshold,
        extinction,
        condition.illuminance,
        spec.headlamps * headlamp_share(cos(spec.mount.yaw)),
    )
    return Reach(0.0, min(tall, clear))


def _radar(sensor: Sensor, _target: Target, _condition: Condition) -> Reach:
    return Reach(0.0, cast("Radar", sensor).range)


def _physical_radar(sensor: Sensor, target: Target, condition: Condition) -> Reach:
    """Straight ahead of the antenna: z·exp(extinction·z / 2) is the range in clear air.

    The power falls with exp(-2·extinction·z) / z⁴.
    """
    spec = cast("PhysicalRadar", sensor)
    reference = spec.reference_cross_section
    clear = cross_section_range(spec.range, target.cross_section_m2, reference)
    extinction = radar_rain_extinction(condition.rain_mps)
    return Reach(0.0, range_in_extinction(clear, 0.5 * extinction))


def _lidar(sensor: Sensor, target: Target, condition: Condition) -> Reach:
    spec = cast("Lidar | PhysicalLidar", sensor)
    far = lidar_range(
        spec.range,
        target.reflectivity,
        spec.reference_reflectivity,
        condition.rain_mps,
        condition.visibility_m,
    )
    return Reach(0.0, far)


def _physical_lidar(sensor: Sensor, target: Target, condition: Condition) -> Reach:
    """Enough beams must hit the target between the ground and its top.

    Layers leave gaps: what counts is the longest stretch without one.
    """
    spec = cast("PhysicalLidar", sensor)
    far = _lidar(sensor, target, condition).far
    best = NOTHING
    start: float | None = None
    for distance in [*np.arange(_STEP, far, _STEP).tolist(), far]:
        if _returns(spec, target, distance) >= spec.min_points:
            start = distance if start is None else start
            if distance - start > best.far - best.near:
                best = Reach(start, distance)
        else:
            start = None
    # The nearest look stands for all that is nearer.
    return Reach(0.0, best.far) if best.near == _STEP else best


def _returns(spec: PhysicalLidar, target: Target, distance: float) -> float:
    """Count the returns that a target gives for sure at a distance."""
    spacing = spec.field_of_view / spec.beams
    beams = min(float(spec.beams), sure_beams(target.width_m, distance, spacing))
    layers = 0
    for layer in range(spec.layers):
        part = layer / (spec.layers - 1) - 0.5 if spec.layers > 1 else 0.0
        down = spec.mount.pitch - part * spec.vertical_field_of_view
        layers += GROUND <= spec.mount.z - distance * tan(down) <= target.height_m
    return beams * layers


def _ultrasonic(sensor: Sensor, _target: Target, _condition: Condition) -> Reach:
    spec = cast("Ultrasonic", sensor)
    return Reach(min(spec.blind_zone, spec.range), spec.range)


_MODELS: Final[dict[str, Callable[[Sensor, Target, Condition], Reach]]] = {
    "camera": _camera,
    "camera/physical": _physical_camera,
    "radar": _radar,
    "radar/physical": _physical_radar,
    "lidar": _lidar,
    "lidar/physical": _physical_lidar,
    "ultrasonic": _ultrasonic,
}
