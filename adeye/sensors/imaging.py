"""One frame of a camera: its memory, and what covers each pixel."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
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
from adeye.signals import EGO_HEADING, EGO_X, EGO_Y, Floats, Ints
from adeye.world.weather import SUN_ILLUMINANCE

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
