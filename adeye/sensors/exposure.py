"""Which pixels of a frame show what covers them.

A pixel shows its object if the contrast that distance, air, light, glare, lens and dirt leave, with
the pixel's noise, reaches the threshold. Noise may also show something where nothing is.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from adeye.kernel.components import GHOST
from adeye.kernel.detection_range import contrast_threshold
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.raster import (
    NEAR,
    NOTHING,
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
from adeye.sensors.imaging import ABSENT, EACH, HIDDEN, WHOLE, Image
from adeye.sensors.light import CONTRASTS, SHINE, beam, shown_contrast
from adeye.sensors.noise import GREATEST, noise_of, skip
from adeye.world.weather import veil

if TYPE_CHECKING:
    import numpy as np

    from adeye.signals import Floats, Ints

# Columns of a patch of the image: its rectangle [pixels], the share of the contrast that passes,
# the variance of its noise, and ``noise.log_of_miss`` of its pixels.
(
    PATCH_FIRST,
    PATCH_STOP,
    PATCH_TOP,
    PATCH_BOTTOM,
    PATCH_TRANSMISSION,
    PATCH_VARIANCE,
    PATCH_MISS,
) = range(7)
PATCH_WIDTH: Final = 7

_SURE: Final = 1e-9
"""Relative distance from the threshold within which each pixel is looked at on its own."""


@compiled
def expose(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    patches: Floats,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    objects: Floats,
    sizes: Floats,
    classes: Ints,
    image: Image,
    first: int,
    stop: int,
) -> tuple[int, int]:
    """Take from an image what is not seen, and add what noise shows where nothing is.

    Args:
        parameters: Record of the camera and the environment.
        patches: (P, PATCH_WIDTH).
        seed: Stream seed of the run.
        owner: Owner number of the camera.
        number: Number of the sample.
        objects: (M, 5) states.
        sizes: (M, 3) [m].
        classes: (M,).
        image: With the objects drawn; in and out.
        first: First column in use.
        stop: Column behind the last in use.

    Returns:
        First column in use, and the one behind the last.
    """
    is_clear = True
    for thing in range(objects.shape[0]):
        if image.states[thing] != ABSENT:
            image.states[thing] = _judge(
                parameters, classes[thing], objects[thing], sizes[thing], image
            )
            is_clear &= image.states[thing] == WHOLE
    begin, end = first, stop
    if is_clear:
        # Only what lies under a patch needs a look.
        begin, end = stop, first
        for patch in range(patches.shape[0]):
            begin = min(begin, max(first, int(patches[patch, PATCH_FIRST])))
            end = max(end, min(stop, int(patches[patch, PATCH_STOP])))
    for column in range(begin, end):
        top, bottom = _patched_rows(patches, column)
        for row in range(image.span[column, 0], image.span[column, 1]):
            thing = image.owner[column, row]
            if thing == NOTHING:
                continue
            state = image.states[thing]
            if state == EACH or top <= row < bottom:
                kind = classes[thing]
                image.owner[column, row] = _shown(
                    parameters, patches, seed, owner, number, kind, thing, column, row, image
                )
            elif state == HIDDEN:
                image.owner[column, row] = NOTHING
    return _add_ghosts(parameters, patches, seed, owner, number, image, first, stop)


@inlined
def _patched_rows(patches: Floats, column: int) -> tuple[int, int]:
    """Return the first row of a column under a patch, and the one behind the last."""
    top, bottom = math.inf, -math.inf
    for patch in range(patches.shape[0]):
        if patches[patch, PATCH_FIRST] <= column < patches[patch, PATCH_STOP]:
            top = min(top, patches[patch, PATCH_TOP])
            bottom = max(bottom, patches[patch, PATCH_BOTTOM])
    return (int(top), int(bottom)) if top < bottom else (0, 0)


@inlined
def _nearer(cosine: float, sine: float, half_sine: float, half_cosine: float) -> float:
    """Cosine of the least angle to a cone about a direction."""
    return 1.0 if cosine >= half_cosine else cosine * half_cosine + sine * half_sine


@inlined
def _further(cosine: float, sine: float, half_sine: float, half_cosine: float) -> float:
    """Cosine of the greatest angle to a cone about a direction."""
    return -1.0 if cosine <= -half_cosine else cosine * half_cosine - sine * half_sine


@compiled
def _judge(parameters: Any, kind: int, box: Floats, size: Floats, image: Image) -> int:
    """Tell whether all pixels of an object are sure to show it or sure not to.

    Contrast falls with the distance and the glare and grows with the light, so the best and the
    worst of the three on a ball around the box bound it.
    """
    view = image.pinhole
    x, y = box[0] - view[VIEW_X], box[1] - view[VIEW_Y]
    z = 0.5 * size[2] - view[VIEW_HEIGHT]
    centre = math.sqrt(x * x + y * y + z * z)
    radius = 0.5 * math.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2])
    if not centre > radius:
        return EACH
    half_sine = radius / centre
    half_cosine = math.sqrt(max(0.0, 1.0 - half_sine * half_sine))
    near, far = max(NEAR, centre - radius), centre + radius
    # Along the optical axis, to the right and down.
    forward = view[VIEW_COSINE] * x + view[VIEW_SINE] * y
    pitch_sine, pitch_cosine = view[VIEW_PITCH_SINE], view[VIEW_PITCH_COSINE]
    along = (pitch_cosine * forward - pitch_sine * z) / centre
    down = (-pitch_sine * forward - pitch_cosine * z) / centre
    right = (view[VIEW_SINE] * x - view[VIEW_COSINE] * y) / centre
    lit = _cosine_ahead(parameters, along, right, down)
    lit_sine = math.sqrt(max(0.0, 1.0 - lit * lit))
    ambient, lamps = parameters["illuminance"] + SHINE[kind], parameters["headlamps"]
    most = ambient + beam(lamps, _nearer(lit, lit_sine, half_sine, half_cosine), near)
    least = ambient + beam(lamps, _further(lit, lit_sine, half_sine, half_cosine), far)
    weak = strong = 0.0
    if image.sun[0] > 0.0:
        sun = image.sun[1] * along + image.sun[2] * right + image.sun[3] * down
        sun_sine = math.sqrt(max(0.0, 1.0 - sun * sun))
        strong = veil(image.sun[0], _nearer(sun, sun_sine, half_sine, half_cosine))
        weak = veil(image.sun[0], _further(sun, sun_sine, half_sine, half_cosine))
    passed, extinction = CONTRASTS[kind] * parameters["transmission"], parameters["extinction"]
    threshold, noise = parameters["threshold"], GREATEST * parameters["noise"]
    best = shown_contrast(passed, near, extinction, most, weak) + noise
    if best < (1.0 - _SURE) * contrast_threshold(threshold, most):
        return HIDDEN
    worst = shown_contrast(passed, far, extinction, least, strong) - noise
    if worst >= (1.0 + _SURE) * contrast_threshold(threshold, least):
        return WHOLE
    return EACH


@inlined
def _cosine_ahead(parameters: Any, along: float, right: float, down: float) -> float:
    """Cosine of the angle between a unit vector in the camera and the ego's heading."""
    return float(
        parameters["ahead_along"] * along
        + parameters["ahead_right"] * right
        + parameters["ahead_down"] * down
    )


@inlined
def contrast_at(
    parameters: Any, kind: int, contrast: float, column: int, row: int, image: Image
) -> tuple[float, float]:
    """Return the contrast that a surface in a pixel has behind the lens, and its illuminance [lx].

    Args:
        parameters: Record of the camera and the environment.
        kind: Class of the surface.
        contrast: Without lens, air and glare.
        column: Of the pixel.
        row: Of the pixel.
        image: With the surface in it.
    """
    view = image.pinhole
    right = (column + view[VIEW_COLUMN]) / view[VIEW_FOCAL]
    down = (row + view[VIEW_ROW]) / view[VIEW_FOCAL]
    length = math.sqrt(1.0 + right * right + down * down)
    distance = length / image.nearness[column, row]
    lit = _cosine_ahead(parameters, 1.0, right, down) / length
    illuminance = parameters["illuminance"] + SHINE[kind]
    illuminance += beam(parameters["headlamps"], lit, distance)
    veiling = 0.0
    if image.sun[0] > 0.0:
        cosine = (image.sun[1] + image.sun[2] * right + image.sun[3] * down) / length
        veiling = veil(image.sun[0], cosine)
    passed = contrast * parameters["transmission"]
    shown = shown_contrast(passed, distance, parameters["extinction"], illuminance, veiling)
    return shown, illuminance


@inlined
def patch_at(patches: Floats, column: int, row: int) -> tuple[float, float, int]:
    """Return transmission and noise variance of the patches on a pixel, and the noisiest one.

    Where patches overlap, the worst of each counts; without one it is 1, 0 and -1.
    """
    transmission, variance, noisiest = 1.0, 0.0, -1
    for patch in range(patches.shape[0]):
        is_in = patches[patch, PATCH_FIRST] <= column < patches[patch, PATCH_STOP]
        if is_in and patches[patch, PATCH_TOP] <= row < patches[patch, PATCH_BOTTOM]:
            transmission = min(transmission, patches[patch, PATCH_TRANSMISSION])
            if patches[patch, PATCH_VARIANCE] > variance:
                variance, noisiest = patches[patch, PATCH_VARIANCE], patch
    return transmission, variance, noisiest


@compiled
def _shown(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    patches: Floats,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    kind: int,
    thing: int,
    column: int,
    row: int,
    image: Image,
) -> int:
    """Tell what a pixel that an object covers shows: the object, ``GHOST`` or ``NOTHING``.

    If noise lifts it over the threshold and is the greater part, its class is not told.
    """
    transmission, variance, _ = patch_at(patches, column, row)
    variance += parameters["noise"] * parameters["noise"]
    if transmission <= 0.0 and variance <= 0.0:
        return NOTHING
    contrast, illuminance = contrast_at(parameters, kind, CONTRASTS[kind], column, row, image)
    contrast *= transmission
    threshold = contrast_threshold(parameters["threshold"], illuminance)
    noise = 0.0
    if variance > 0.0:
        pixel = column * image.owner.shape[1] + row
        noise = math.sqrt(variance) * noise_of(pixel, seed, owner, number)
    if not contrast + noise >= threshold:
        return NOTHING
    return thing if contrast >= noise else GHOST


@inlined
def _add_ghosts(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    patches: Floats,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    image: Image,
    first: int,
    stop: int,
) -> tuple[int, int]:
    """Show something where nothing is and noise alone crosses the threshold.

    Region by region: the image without its noisy patches, then each of these.
    """
    columns, rows = image.owner.shape
    for region in range(-1, patches.shape[0]):
        left, right, top, bottom = 0, columns, 0, rows
        missing = parameters["miss"]
        if region >= 0:
            left, right = int(patches[region, PATCH_FIRST]), int(patches[region, PATCH_STOP])
            top, bottom = int(patches[region, PATCH_TOP]), int(patches[region, PATCH_BOTTOM])
            # Without noise of its own its pixels belong to the rest of the image.
            missing = patches[region, PATCH_MISS] if patches[region, PATCH_VARIANCE] > 0 else 0.0
        if not missing < 0.0:
            continue
        index = (region + 2) * columns * rows
        height = bottom - top
        place = skip(missing, seed, owner, number, index)
        while place < (right - left) * height:
            column, row = left + place // height, top + place % height
            _, _, noisiest = patch_at(patches, column, row)
            if noisiest == region and image.nearness[column, row] == 0.0:
                image.owner[column, row] = GHOST
                image.span[column, 0] = min(image.span[column, 0], row)
                image.span[column, 1] = max(image.span[column, 1], row + 1)
                first, stop = min(first, column), max(stop, column + 1)
            index += 1
            place += 1 + skip(missing, seed, owner, number, index)
    return first, stop
