"""What is sure of many pixels at once: that they show their object, or that they do not.

Contrast falls with the distance and the glare and grows with the light and the transmission, so the
best and the worst of each, over a cone of directions and a span of distances, bound what any pixel
in there can have. Where the threshold lies between, each pixel is to be looked at on its own.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from adeye.kernel.detection_range import contrast_threshold
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.raster import (
    NEAR,
    VIEW_COLUMN,
    VIEW_COSINE,
    VIEW_FOCAL,
    VIEW_HEIGHT,
    VIEW_PITCH_COSINE,
    VIEW_PITCH_SINE,
    VIEW_ROW,
    VIEW_SINE,
    VIEW_X,
    VIEW_Y,
)
from adeye.sensors.imaging import (
    EACH,
    HIDDEN,
    PART_BOTTOM,
    PART_CLEAREST,
    PART_DIMMEST,
    PART_FARTHEST,
    PART_FIRST,
    PART_LAST,
    PART_NEAREST,
    PART_TOP,
    PART_VARIANCE,
    WHOLE,
    Image,
)
from adeye.sensors.light import CONTRASTS, SHINE, beam, shown_contrast
from adeye.sensors.noise import GREATEST
from adeye.world.weather import veil

if TYPE_CHECKING:
    from adeye.signals import Floats

_SURE: Final = 1e-9
"""Relative distance from the threshold within which each pixel is looked at on its own."""


@inlined
def _nearer(cosine: float, sine: float, half_sine: float, half_cosine: float) -> float:
    """Cosine of the least angle to a cone about a direction."""
    return 1.0 if cosine >= half_cosine else cosine * half_cosine + sine * half_sine


@inlined
def _further(cosine: float, sine: float, half_sine: float, half_cosine: float) -> float:
    """Cosine of the greatest angle to a cone about a direction."""
    return -1.0 if cosine <= -half_cosine else cosine * half_cosine - sine * half_sine


@inlined
def cosine_ahead(parameters: Any, along: float, right: float, down: float) -> float:
    """Cosine of the angle between a unit vector in the camera and the ego's heading."""
    return float(
        parameters["ahead_along"] * along
        + parameters["ahead_right"] * right
        + parameters["ahead_down"] * down
    )


@compiled
def _judge_cone(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    kind: int,
    along: float,
    right: float,
    down: float,
    half_sine: float,
    near: float,
    far: float,
    dimmest: float,
    clearest: float,
    sigma: float,
    sun: Floats,
) -> int:
    """Tell whether all pixels in a cone are sure to show an object of a class or sure not to.

    Args:
        parameters: Record of the camera and the environment.
        kind: Class of the object.
        along: Axis of the cone as a unit vector in the camera.
        right: Of the same.
        down: Of the same.
        half_sine: Sine of half of its opening angle, which is below 90 degrees.
        near: Least distance of the surface in it [m].
        far: Greatest one [m].
        dimmest: Least share of the contrast that patches of the lens let pass.
        clearest: Greatest one.
        sigma: Greatest standard deviation of the noise.
        sun: (4,) see ``Image``.
    """
    half_cosine = math.sqrt(max(0.0, 1.0 - half_sine * half_sine))
    lit = cosine_ahead(parameters, along, right, down)
    lit_sine = math.sqrt(max(0.0, 1.0 - lit * lit))
    ambient, lamps = parameters["illuminance"] + SHINE[kind], parameters["headlamps"]
    most = ambient + beam(lamps, _nearer(lit, lit_sine, half_sine, half_cosine), near)
    least = ambient + beam(lamps, _further(lit, lit_sine, half_sine, half_cosine), far)
    weak = strong = 0.0
    if sun[0] > 0.0:
        cosine = sun[1] * along + sun[2] * right + sun[3] * down
        sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
        strong = veil(sun[0], _nearer(cosine, sine, half_sine, half_cosine))
        weak = veil(sun[0], _further(cosine, sine, half_sine, half_cosine))
    passed, extinction = CONTRASTS[kind] * parameters["transmission"], parameters["extinction"]
    threshold, noise = parameters["threshold"], GREATEST * sigma
    best = clearest * shown_contrast(passed, near, extinction, most, weak) + noise
    if best < (1.0 - _SURE) * contrast_threshold(threshold, most):
        return HIDDEN
    worst = dimmest * shown_contrast(passed, far, extinction, least, strong) - noise
    if worst >= (1.0 + _SURE) * contrast_threshold(threshold, least):
        return WHOLE
    return EACH


@compiled
def judge_box(parameters: Any, kind: int, box: Floats, size: Floats, image: Image) -> int:
    """Tell whether all pixels of an object outside of patches are sure to show it or sure not to.

    A ball around the box bounds distance and direction.

    Args:
        parameters: Record of the camera and the environment.
        kind: Class of the object.
        box: (>= 3,) x [m], y [m], heading [rad].
        size: (3,) [m].
        image: For where the camera is and looks, and the sun.
    """
    view = image.pinhole
    x, y = box[0] - view[VIEW_X], box[1] - view[VIEW_Y]
    z = 0.5 * size[2] - view[VIEW_HEIGHT]
    centre = math.sqrt(x * x + y * y + z * z)
    radius = 0.5 * math.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2])
    if not centre > radius:
        return EACH
    # Along the optical axis, to the right and down.
    forward = view[VIEW_COSINE] * x + view[VIEW_SINE] * y
    pitch_sine, pitch_cosine = view[VIEW_PITCH_SINE], view[VIEW_PITCH_COSINE]
    along = (pitch_cosine * forward - pitch_sine * z) / centre
    down = (-pitch_sine * forward - pitch_cosine * z) / centre
    right = (view[VIEW_SINE] * x - view[VIEW_COSINE] * y) / centre
    return _judge_cone(
        parameters,
        kind,
        along,
        right,
        down,
        radius / centre,
        max(NEAR, centre - radius),
        centre + radius,
        1.0,
        1.0,
        parameters["noise"],
        image.sun,
    )


@compiled
def judge_part(parameters: Any, kind: int, part: Floats, image: Image) -> int:
    """Tell whether all pixels of a part are sure to show its object or sure not to.

    Args:
        parameters: Record of the camera and the environment.
        kind: Class of the object.
        part: (PART_WIDTH,).
        image: For where the camera looks, and the sun.
    """
    view = image.pinhole
    focal = view[VIEW_FOCAL]
    left = (part[PART_FIRST] + view[VIEW_COLUMN]) / focal
    right = (part[PART_LAST] + view[VIEW_COLUMN]) / focal
    top = (part[PART_TOP] + view[VIEW_ROW]) / focal
    bottom = (part[PART_BOTTOM] + view[VIEW_ROW]) / focal
    across, down = 0.5 * (left + right), 0.5 * (top + bottom)
    length = math.sqrt(1.0 + across * across + down * down)
    # The corners are furthest from the middle, and one of them from the camera.
    greatest, farthest = 0.0, 0.0
    for corner in range(4):
        a = left if corner & 1 else right
        b = top if corner & 2 else bottom
        square = 1.0 + a * a + b * b
        u, v, w = across * b - down * a, down - b, a - across
        greatest = max(greatest, (u * u + v * v + w * w) / square)
        farthest = max(farthest, square)
    a, b = max(0.0, left, -right), max(0.0, top, -bottom)
    nearest = math.sqrt(1.0 + a * a + b * b)
    variance = parameters["noise"] * parameters["noise"] + part[PART_VARIANCE]
    return _judge_cone(
        parameters,
        kind,
        1.0 / length,
        across / length,
        down / length,
        (1.0 + _SURE) * math.sqrt(greatest) / length,
        nearest / part[PART_NEAREST],
        math.sqrt(farthest) / part[PART_FARTHEST],
        part[PART_DIMMEST],
        part[PART_CLEAREST],
        math.sqrt(variance),
        image.sun,
    )
