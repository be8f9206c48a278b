"""One frame of a camera: its memory, and what covers each pixel."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from adeye.kernel.detection_range import headlamp_share
from adeye.kernel.elementary import exp, log, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal_pair, uniform
from adeye.kernel.raster import (
    FORM_WIDTH,
    FORMS,
    NOTHING,
    VIEW_COLUMN,
    VIEW_COSINE,
    VIEW_FOCAL,
    VIEW_PITCH_COSINE,
    VIEW_PITCH_SINE,
    VIEW_ROW,
    VIEW_SINE,
    VIEW_WIDTH,
    aim,
    covers,
    fill,
    trace,
)
from adeye.signals import EGO_HEADING, EGO_X, EGO_Y, OBJECT_CLASSES, Floats, Ints
from adeye.simulate.sensors.sampling import Stream
from adeye.simulate.world.objects import CONTRAST, DEFAULT_SIZES
from adeye.simulate.world.weather import GREY, SUN_ILLUMINANCE

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
        owner=np.full((columns, rows), NOTHING, dtype=np.int64),
        span=span,
        forms=np.zeros((FORMS, FORM_WIDTH)),
        pinhole=np.zeros(VIEW_WIDTH),
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
            image.owner[column, row] = NOTHING
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
    aim(
        ego[EGO_X] + c * parameters["x"] - s * parameters["y"],
        ego[EGO_Y] + s * parameters["x"] + c * parameters["y"],
        parameters["z"],
        ego[EGO_HEADING] + parameters["yaw"],
        parameters["pitch_sine"],
        parameters["pitch_cosine"],
        parameters["focal"],
        columns,
        rows,
        view,
    )
    sun_column, sun_row = _find_sun(parameters, view, image.sun)
    first, stop = columns, 0
    for thing in range(objects.shape[0]):
        image.states[thing] = ABSENT
        lines, least, most = trace(view, objects[thing], sizes[thing], forms)
        if lines < 0:
            continue
        if image.sun[0] > 0.0 and covers(forms, lines, sun_column, sun_row):
            image.sun[0] = 0.0
        begin, end = fill(forms, lines, least, most, thing, image.nearness, image.owner, image.span)
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
    ahead = view[VIEW_COSINE] * x + view[VIEW_SINE] * y
    sine, cosine = view[VIEW_PITCH_SINE], view[VIEW_PITCH_COSINE]
    sun[1] = cosine * ahead - sine * z
    sun[2] = view[VIEW_SINE] * x - view[VIEW_COSINE] * y
    sun[3] = -sine * ahead - cosine * z
    if not sun[1] > 0.0:
        return 0.0, 0.0
    sun[0] = SUN_ILLUMINANCE * sun[1]
    focal = view[VIEW_FOCAL]
    return (
        focal * sun[2] / sun[1] - view[VIEW_COLUMN],
        focal * sun[3] / sun[1] - view[VIEW_ROW],
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
