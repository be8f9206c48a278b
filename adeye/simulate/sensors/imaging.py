"""One frame of a camera: what covers each pixel, and which pixels show it.

A pixel shows its object if the contrast that distance, air, light, glare, lens and dirt leave, with
the pixel's noise, reaches the threshold. Noise may also show something where nothing is.

Contrast falls with the distance and the glare and grows with the light and the transmission, so the
best and the worst of each, over a cone of directions and a span of distances, bound what any pixel
in there can have. Where the threshold lies between, each pixel is to be looked at on its own.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from adeye.kernel import raster
from adeye.kernel.detection_range import contrast_threshold, headlamp_share
from adeye.kernel.elementary import exp, log, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal_pair, uniform
from adeye.signals import EGO_HEADING, EGO_X, EGO_Y, OBJECT_CLASSES, Floats, Ints
from adeye.simulate.sensors.sampling import Stream
from adeye.simulate.world.objects import CONTRAST, DEFAULT_SIZES
from adeye.simulate.world.weather import GREY, SUN_ILLUMINANCE, veil

# --- One frame of a camera: its memory, and what covers each pixel --------------------------------

# Columns of a part of an image: pixels of one object in a few columns, under patches or not.
(
    PART_FIRST,  # its rectangle: first column and last, first row and last
    PART_LAST,
    PART_TOP,
    PART_BOTTOM,
    PART_NEAREST,  # greatest and least inverse depth [1/m]
    PART_FARTHEST,
    PART_DIMMEST,  # least and greatest share of the contrast that the patches on it let pass
    PART_CLEAREST,
    PART_VARIANCE,  # greatest variance of the patches' noise
) = range(9)
PART_WIDTH: Final = 9

# What of an object is shown: nothing is drawn, no pixel, each pixel on its own, every pixel.
ABSENT, HIDDEN, EACH, WHOLE = range(4)


class Image(NamedTuple):
    """Memory of one frame, used for one run after the other; between two frames it is empty.

    Attributes:
        nearness: (columns, rows) inverse depth [1/m], 0 where nothing is.
        owner: (columns, rows) object that a pixel shows, ``NOTHING`` or ``GHOST``.
        span: (columns, 2) first row in use and the one behind the last.
        forms: (FORMS, FORM_WIDTH) of the box that is drawn.
        pinhole: (VIEW_WIDTH,) where the camera is and looks, see ``kernel.raster``.
        sun: (4,) illuminance by the sun on the lens [lx]; unit vector to it along the optical axis,
            to the right and down in the image.
        states: (M,) what of each object is shown.
        parts: (2 M, PART_WIDTH) what is judged together of a few columns, see ``PART_FIRST``: of
            each object first the pixels outside of patches, then those under one.
        part_states: (2 M,) what of each part is shown.
    """

    nearness: Floats
    owner: Ints
    span: Ints
    forms: Floats
    pinhole: Floats
    sun: Floats
    states: Ints
    parts: Floats
    part_states: Ints


def empty_image(columns: int, rows: int, objects: int) -> Image:
    """Make the memory of a frame.

    Args:
        columns: Of the image.
        rows: Of the image.
        objects: M.
    """
    span = np.zeros((columns, 2), dtype=np.int64)
    span[:, 0] = rows
    return Image(
        nearness=np.zeros((columns, rows)),
        owner=np.full((columns, rows), raster.NOTHING, dtype=np.int64),
        span=span,
        forms=np.zeros((raster.FORMS, raster.FORM_WIDTH)),
        pinhole=np.zeros(raster.VIEW_WIDTH),
        sun=np.zeros(4),
        states=np.zeros(objects, dtype=np.int64),
        parts=np.zeros((2 * objects, PART_WIDTH)),
        part_states=np.zeros(2 * objects, dtype=np.int64),
    )


@inlined
def wipe(image: Image, first: int, stop: int) -> None:
    """Empty the columns of an image that are in use."""
    for column in range(first, stop):
        for row in range(image.span[column, 0], image.span[column, 1]):
            image.nearness[column, row] = 0.0
            image.owner[column, row] = raster.NOTHING
        image.span[column, 0] = image.owner.shape[1]
        image.span[column, 1] = 0


@compiled
def draw(
    parameters: Any, ego: Floats, objects: Floats, sizes: Floats, image: Image
) -> tuple[int, int]:
    """Draw the objects of one run into an empty image; the nearest one takes a pixel.

    Args:
        parameters: Record of the camera and the environment.
        ego: (7,) state.
        objects: (M, 5) states.
        sizes: (M, 3) [m].
        image: In and out.

    Returns:
        First column in use, and the one behind the last.
    """
    view, forms = image.pinhole, image.forms
    columns, rows = image.owner.shape
    s, c = sin_cos(ego[EGO_HEADING])
    x = ego[EGO_X] + c * parameters["x"] - s * parameters["y"]
    y = ego[EGO_Y] + s * parameters["x"] + c * parameters["y"]
    place, heading = (x, y, parameters["z"]), ego[EGO_HEADING] + parameters["yaw"]
    pitch = parameters["pitch_sine"], parameters["pitch_cosine"]
    raster.aim(place, heading, pitch, parameters["focal"], (columns, rows), view)
    sun_column, sun_row = _find_sun(parameters, view, image.sun)
    first, stop = columns, 0
    for thing in range(objects.shape[0]):
        image.states[thing] = ABSENT
        lines, least, most = raster.trace(view, objects[thing], sizes[thing], forms)
        if lines < 0:
            continue
        if image.sun[0] > 0.0 and raster.covers(forms, lines, sun_column, sun_row):
            image.sun[0] = 0.0
        begin, end = raster.fill(
            forms, lines, least, most, thing, image.nearness, image.owner, image.span
        )
        if begin < end:
            image.states[thing] = EACH
            first, stop = min(first, begin), max(stop, end)
    return first, stop


@inlined
def _find_sun(parameters: Any, view: Floats, sun: Floats) -> tuple[float, float]:
    """Note how the sun shines on the lens; return where it is in the image [pixels]."""
    sun[0] = 0.0
    if not parameters["sun_z"] >= 0.0:
        return 0.0, 0.0
    x, y, z = parameters["sun_x"], parameters["sun_y"], parameters["sun_z"]
    ahead = view[raster.VIEW_COSINE] * x + view[raster.VIEW_SINE] * y
    sine, cosine = view[raster.VIEW_PITCH_SINE], view[raster.VIEW_PITCH_COSINE]
    sun[1] = cosine * ahead - sine * z
    sun[2] = view[raster.VIEW_SINE] * x - view[raster.VIEW_COSINE] * y
    sun[3] = -sine * ahead - cosine * z
    if not sun[1] > 0.0:
        return 0.0, 0.0
    sun[0] = SUN_ILLUMINANCE * sun[1]
    focal = view[raster.VIEW_FOCAL]
    return (
        focal * sun[2] / sun[1] - view[raster.VIEW_COLUMN],
        focal * sun[3] / sun[1] - view[raster.VIEW_ROW],
    )


# --- How well a camera tells an object from what is behind it: light, air, glare, noise of light --

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


# --- Noise of pixels: how often it alone crosses the threshold, and where -------------------------

GREATEST: Final = 8.6
"""No draw of ``kernel.random.normal`` lies further out: sqrt(-2 ln(2**-53)) = 8.57."""

_ROOT_TWO_PI: Final = 2.50662827463100050242
_FEW: Final = 1e-5
_FAR: Final = 1_000_000_000


@compiled
def upper_tail(x: float) -> float:
    """Probability that a standard normal number is at least x.

    Args:
        x: Not negative.

    Source:
        Abramowitz and Stegun (1964), 26.2.11 (series, near) and 26.2.14 (continued fraction, far).

    >>> round(upper_tail(1.0), 10), upper_tail(6.0) < 1e-9
    (0.1586552539, True)
    """
    density = exp(-0.5 * x * x) / _ROOT_TWO_PI
    if x < 3.0:
        term = total = x
        for odd in range(3, 121, 2):
            term *= x * x / odd
            total += term
        return 0.5 - density * total
    rest = x
    for numerator in range(60, 0, -1):
        rest = x + numerator / rest
    return density / rest


@compiled
def log_of_miss(threshold: float, sigma: float) -> float:
    """Logarithm of the probability that noise alone stays below the threshold; 0 for certain.

    Args:
        threshold: Positive.
        sigma: Standard deviation of the noise, in the same unit.
    """
    if not (sigma > 0.0 and threshold < GREATEST * sigma):
        return 0.0
    crossing = upper_tail(threshold / sigma)
    if crossing < _FEW:
        return -crossing - 0.5 * crossing * crossing
    return log(1.0 - crossing)


@inlined
def skip(missing: float, stream: Stream, index: int) -> int:
    """Draw how many pixels in a row noise alone leaves below the threshold.

    The geometric distribution: as if every pixel had its own draw, for one draw per crossing.

    Args:
        missing: ``log_of_miss`` of the pixels, negative.
        stream: Of the run.
        index: Of the draw.
    """
    count = log(uniform(stream.seed, stream.owner, stream.number, index)) / missing
    return int(count) if count < _FAR else _FAR


@inlined
def noise_of(pixel: int, stream: Stream) -> float:
    """Draw the standard normal noise of a pixel; two of them share a pair."""
    one, other = normal_pair(stream.seed, stream.owner, stream.number, pixel >> 1)
    return other if pixel & 1 else one


# --- What is sure of many pixels at once: that they show their object, or that they do not --------

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


Pair = tuple[float, float]
Cone = tuple[float, float, float, float]


@compiled
def _judge_cone(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any, kind: int, cone: Cone, between: Pair, passes: Pair, sigma: float, sun: Floats
) -> int:
    """Tell whether all pixels in a cone are sure to show an object of a class or sure not to.

    Args:
        parameters: Record of the camera and the environment.
        kind: Class of the object.
        cone: Axis of the cone as a unit vector in the camera, along the optical axis, to the right
            and down, and the sine of half of its opening angle, which is below 90 degrees.
        between: Least and greatest distance of the surface in it [m].
        passes: Least and greatest share of the contrast that patches of the lens let pass.
        sigma: Greatest standard deviation of the noise.
        sun: (4,) see ``Image``.
    """
    along, right, down, half_sine = cone
    (near, far), (dimmest, clearest) = between, passes
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
    x, y = box[0] - view[raster.VIEW_X], box[1] - view[raster.VIEW_Y]
    z = 0.5 * size[2] - view[raster.VIEW_HEIGHT]
    centre = math.sqrt(x * x + y * y + z * z)
    radius = 0.5 * math.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2])
    if not centre > radius:
        return EACH
    # Along the optical axis, to the right and down.
    forward = view[raster.VIEW_COSINE] * x + view[raster.VIEW_SINE] * y
    pitch_sine, pitch_cosine = view[raster.VIEW_PITCH_SINE], view[raster.VIEW_PITCH_COSINE]
    along = (pitch_cosine * forward - pitch_sine * z) / centre
    down = (-pitch_sine * forward - pitch_cosine * z) / centre
    right = (view[raster.VIEW_SINE] * x - view[raster.VIEW_COSINE] * y) / centre
    cone = (along, right, down, radius / centre)
    between = (max(raster.NEAR, centre - radius), centre + radius)
    return _judge_cone(parameters, kind, cone, between, (1.0, 1.0), parameters["noise"], image.sun)


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
    focal = view[raster.VIEW_FOCAL]
    left = (part[PART_FIRST] + view[raster.VIEW_COLUMN]) / focal
    right = (part[PART_LAST] + view[raster.VIEW_COLUMN]) / focal
    top = (part[PART_TOP] + view[raster.VIEW_ROW]) / focal
    bottom = (part[PART_BOTTOM] + view[raster.VIEW_ROW]) / focal
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
    half_sine = (1.0 + _SURE) * math.sqrt(greatest) / length
    cone = (1.0 / length, across / length, down / length, half_sine)
    between = (nearest / part[PART_NEAREST], math.sqrt(farthest) / part[PART_FARTHEST])
    passes = (part[PART_DIMMEST], part[PART_CLEAREST])
    return _judge_cone(parameters, kind, cone, between, passes, math.sqrt(variance), image.sun)


# --- Which pixels of a frame show what covers them ------------------------------------------------

# Columns of a patch of the image: its rectangle [pixels], the share of the contrast that passes,
# the variance of its noise, and ``log_of_miss`` of its pixels.
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

STRIP: Final = 8
"""Columns in which the pixels of an object are judged together. Our choice: few enough that glare
does not change much from side to side."""


@compiled
def expose(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    patches: Floats,
    stream: Stream,
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
        stream: Of the run.
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
            image.states[thing] = judge_box(
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
    for left in range(begin, end, STRIP):
        right = min(left + STRIP, end)
        if _part(parameters, patches, classes, image, left, right):
            for column in range(left, right):
                _expose_column(parameters, patches, stream, classes, image, column)
    return _add_ghosts(parameters, patches, stream, image, first, stop)


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
def _worst_patches(patches: Floats, column: int) -> tuple[float, float, float]:
    """Return what patches on a column let pass, at least and at most, and their variance."""
    dimmest, clearest, variance, count = 1.0, 0.0, 0.0, 0
    for patch in range(patches.shape[0]):
        if patches[patch, PATCH_FIRST] <= column < patches[patch, PATCH_STOP]:
            dimmest = min(dimmest, patches[patch, PATCH_TRANSMISSION])
            clearest = max(clearest, patches[patch, PATCH_TRANSMISSION])
            variance = max(variance, patches[patch, PATCH_VARIANCE])
            count += 1
    # Between two of them there may be a gap.
    return dimmest, clearest if count == 1 else 1.0, variance


@inlined
def _end_of_run(image: Image, column: int, row: int, limit: int) -> int:
    """Return the row behind the last in a column that shows the same as a row, up to a limit."""
    thing = image.owner[column, row]
    end = row + 1
    while end < limit and image.owner[column, end] == thing:
        end += 1
    return end


@compiled
def _part(
    parameters: Any, patches: Floats, classes: Ints, image: Image, left: int, right: int
) -> bool:
    """Part what some columns show by object, under patches or not, and judge each part.

    Args:
        parameters: Record of the camera and the environment.
        patches: (P, PATCH_WIDTH).
        classes: (M,).
        image: With the objects drawn; its parts are written.
        left: First column.
        right: Column behind the last.

    Returns:
        Whether any pixel is not sure to show its object.
    """
    parts, states = image.parts, image.part_states
    for number in range(parts.shape[0]):
        states[number] = ABSENT
    for column in range(left, right):
        top, bottom = _patched_rows(patches, column)
        row, stop = image.span[column, 0], image.span[column, 1]
        while row < stop:
            is_patched = top <= row < bottom
            limit = min(stop, bottom if is_patched else (top if row < top else stop))
            thing = image.owner[column, row]
            end = _end_of_run(image, column, row, limit)
            if thing != raster.NOTHING:
                number = 2 * thing + (1 if is_patched else 0)
                if is_patched or image.states[thing] == EACH:
                    _add_run(patches, image, number, column, row, end)
                else:
                    states[number] = image.states[thing]
            row = end
    is_sure = True
    for number in range(parts.shape[0]):
        if states[number] == EACH:
            states[number] = judge_part(parameters, classes[number // 2], parts[number], image)
        is_sure &= states[number] == ABSENT or states[number] == WHOLE
    return not is_sure


@inlined
def _add_run(patches: Floats, image: Image, number: int, column: int, row: int, end: int) -> None:
    """Add the pixels of a column from a row to the one before an end to a part."""
    part = image.parts[number]
    near = far = image.nearness[column, row]
    for other in range(row + 1, end):
        near = max(near, image.nearness[column, other])
        far = min(far, image.nearness[column, other])
    dimmest = clearest = 1.0
    variance = 0.0
    if number & 1:
        dimmest, clearest, variance = _worst_patches(patches, column)
    if image.part_states[number] == ABSENT:
        image.part_states[number] = EACH
        part[PART_FIRST], part[PART_TOP], part[PART_BOTTOM] = column, row, end - 1
        part[PART_NEAREST], part[PART_FARTHEST] = near, far
        part[PART_DIMMEST], part[PART_CLEAREST], part[PART_VARIANCE] = dimmest, clearest, variance
    part[PART_LAST] = column
    part[PART_TOP] = min(part[PART_TOP], row)
    part[PART_BOTTOM] = max(part[PART_BOTTOM], end - 1)
    part[PART_NEAREST] = max(part[PART_NEAREST], near)
    part[PART_FARTHEST] = min(part[PART_FARTHEST], far)
    part[PART_DIMMEST] = min(part[PART_DIMMEST], dimmest)
    part[PART_CLEAREST] = max(part[PART_CLEAREST], clearest)
    part[PART_VARIANCE] = max(part[PART_VARIANCE], variance)


@inlined
def _expose_column(
    parameters: Any,
    patches: Floats,
    stream: Stream,
    classes: Ints,
    image: Image,
    column: int,
) -> None:
    """Take from a column what is not seen, once its parts are judged."""
    top, bottom = _patched_rows(patches, column)
    row, stop = image.span[column, 0], image.span[column, 1]
    while row < stop:
        is_patched = top <= row < bottom
        limit = min(stop, bottom if is_patched else (top if row < top else stop))
        thing = image.owner[column, row]
        end = _end_of_run(image, column, row, limit)
        if thing != raster.NOTHING:
            state = image.part_states[2 * thing + (1 if is_patched else 0)]
            if state == HIDDEN:
                for pixel in range(row, end):
                    image.owner[column, pixel] = raster.NOTHING
            elif state == EACH:
                kind = classes[thing]
                for pixel in range(row, end):
                    image.owner[column, pixel] = _shown(
                        parameters, patches, stream, kind, thing, column, pixel, image
                    )
        row = end


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
    right = (column + view[raster.VIEW_COLUMN]) / view[raster.VIEW_FOCAL]
    down = (row + view[raster.VIEW_ROW]) / view[raster.VIEW_FOCAL]
    length = math.sqrt(1.0 + right * right + down * down)
    distance = length / image.nearness[column, row]
    lit = cosine_ahead(parameters, 1.0, right, down) / length
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
    stream: Stream,
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
        return raster.NOTHING
    contrast, illuminance = contrast_at(parameters, kind, CONTRASTS[kind], column, row, image)
    contrast *= transmission
    threshold = contrast_threshold(parameters["threshold"], illuminance)
    noise = 0.0
    if variance > 0.0:
        pixel = column * image.owner.shape[1] + row
        noise = math.sqrt(variance) * noise_of(pixel, stream)
    if not contrast + noise >= threshold:
        return raster.NOTHING
    return thing if contrast >= noise else raster.GHOST


@inlined
def _add_ghosts(
    parameters: Any,
    patches: Floats,
    stream: Stream,
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
        place = skip(missing, stream, index)
        while place < (right - left) * height:
            column, row = left + place // height, top + place % height
            _, _, noisiest = patch_at(patches, column, row)
            if noisiest == region and image.nearness[column, row] == 0.0:
                image.owner[column, row] = raster.GHOST
                image.span[column, 0] = min(image.span[column, 0], row)
                image.span[column, 1] = max(image.span[column, 1], row + 1)
                first, stop = min(first, column), max(stop, column + 1)
            index += 1
            place += 1 + skip(missing, stream, index)
    return first, stop
