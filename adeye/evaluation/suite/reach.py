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
from adeye.kernel.elementary import atan, atan2, cos, sin, tan
from adeye.spec.sensors import model_name
from adeye.world.weather import (
    SUN_ILLUMINANCE,
    camera_range,
    contrast_behind_veil,
    glare_contrast,
    lidar_range,
    light_extinction,
    light_share,
    radar_rain_extinction,
    range_in_extinction,
    sun_cosine,
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
    if condition.sun_elevation_rad is not None:
        cosine = _toward_sun(spec, condition.sun_elevation_rad)
        share *= glare_contrast(cosine, condition.illuminance)
    far = camera_range(spec.range, condition.rain_mps, condition.visibility_m, share)
    return Reach(0.0, far)


def _toward_sun(spec: Camera | PhysicalCamera, elevation: float) -> float:
    """Cosine of the angle from a sun straight ahead to the nearest level line of sight in view."""
    yaw = abs(atan2(sin(spec.mount.yaw), cos(spec.mount.yaw)))
    aside = max(0.0, yaw - 0.5 * spec.field_of_view)
    return float(sun_cosine(cos(aside), sin(aside), elevation, 0.0))


def _behind_lens(spec: PhysicalCamera, condition: Condition) -> float:
    """Share of the contrast that lens and glare leave; own headlamps do not count against glare."""
    elevation = condition.sun_elevation_rad
    if elevation is None:
        return float(spec.transmission)
    ahead = sun_cosine(cos(spec.mount.yaw), sin(spec.mount.yaw), elevation, 0.0)
    facing = cos(spec.mount.pitch) * ahead - sin(spec.mount.pitch) * sin(elevation)
    cosine = _toward_sun(spec, elevation)
    veiled = contrast_behind_veil(SUN_ILLUMINANCE * facing, cosine, condition.illuminance)
    return float(spec.transmission * veiled)


def _physical_camera(sensor: Sensor, target: Target, condition: Condition) -> Reach:
    """Both rows and contrast must suffice, with sky, street and headlamps for light.

    Only rows within the image count: a camera that looks down or up loses what is far or near.
    """
    spec = cast("PhysicalCamera", sensor)
    rows = float(spec.min_pixel_height)
    focal = focal_length(spec.columns, spec.field_of_view)
    tall = pixel_range(target.height_m, focal, rows)
    extinction = light_extinction(condition.rain_mps, condition.visibility_m)
    clear = contrast_range(
        target.contrast * _behind_lens(spec, condition),
        spec.contrast_threshold,
        extinction,
        condition.illuminance,
        spec.headlamps * headlamp_share(cos(spec.mount.yaw)),
    )
    return _longest_stretch(
        min(tall, clear),
        lambda distance: _rows_shown(spec, target, distance, focal) >= rows * (1.0 - 1e-9),
    )


def _rows_shown(spec: PhysicalCamera, target: Target, distance: float, focal: float) -> float:
    """Count the rows of the image that a target fills at a distance."""
    foot = atan2(-spec.mount.z, distance) + spec.mount.pitch
    top = atan2(target.height_m - spec.mount.z, distance) + spec.mount.pitch
    half = 0.5 * spec.rows
    # A right angle off the axis is outside of every image.
    limit = atan(half / focal)
    low, high = max(foot, -limit), min(top, limit)
    return float(focal * (tan(high) - tan(low))) if low < high else 0.0


def _longest_stretch(far: float, is_seen: Callable[[float], bool]) -> Reach:
    """Return the longest stretch up to a distance without a gap."""
    best = NOTHING
    start: float | None = None
    for distance in [*np.arange(_STEP, far, _STEP).tolist(), far]:
        if is_seen(distance):
            start = distance if start is None else start
            if distance - start > best.far - best.near:
                best = Reach(start, distance)
        else:
            start = None
    # The nearest look stands for all that is nearer.
    return Reach(0.0, best.far) if best.near == _STEP else best


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
    return _longest_stretch(
        _lidar(sensor, target, condition).far,
        lambda distance: _returns(spec, target, distance) >= spec.min_points,
    )


def _returns(spec: PhysicalLidar, target: Target, distance: float) -> float:
    """Count the returns that a target gives at a distance, as far as the mean loss leaves them."""
    spacing = spec.field_of_view / spec.beams
    beams = min(float(spec.beams), sure_beams(target.width_m, distance, spacing))
    layers = 0
    for layer in range(spec.layers):
        part = layer / (spec.layers - 1) - 0.5 if spec.layers > 1 else 0.0
        down = spec.mount.pitch - part * spec.vertical_field_of_view
        layers += GROUND <= spec.mount.z - distance * tan(down) <= target.height_m
    return float(beams * layers * (1.0 - spec.drop_out))


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
