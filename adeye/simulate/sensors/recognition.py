"""From a frame to detections: connected parts, their place from where they touch the ground.

Only the image is used: which pixels show what, their class, and edges between surfaces. The range
follows from the lowest row of a part, where the object stands on the flat ground, and has the error
of half a pixel there, ``z² / (f h) / 2``. Where that row cannot be seen, the size that the class
has must do.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from adeye.delivery import insert
from adeye.kernel.detection_range import contrast_threshold
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.raster import (
    PART_CONTACT,
    PART_FIRST,
    PART_LAST,
    PART_NEAREST,
    PART_PIXELS,
    PART_STOP,
    PART_TOP,
    RUN_CLASS,
    RUN_COLUMN,
    RUN_PARENT,
    RUN_STOP,
    VIEW_COLUMN,
    VIEW_FOCAL,
    VIEW_HEIGHT,
    VIEW_PITCH_COSINE,
    VIEW_PITCH_SINE,
    VIEW_ROW,
    find_parts,
    main_owner,
)
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_LENGTH,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    OBJECT_CLASSES,
    Floats,
    Ints,
)
from adeye.simulate.sensors.exposure import contrast_at, patch_at
from adeye.simulate.sensors.imaging import Image
from adeye.simulate.sensors.sampling import Found
from adeye.simulate.world.objects import DEFAULT_SIZES

_TYPICAL: Final = {
    **DEFAULT_SIZES,
    "parked_car": DEFAULT_SIZES["car"],
    "parked_truck": DEFAULT_SIZES["truck"],
}
SIZES: Final = np.array([_TYPICAL.get(kind, (0.0, 0.0, 0.0)) for kind in OBJECT_CLASSES])
"""Length, width and height (11, 3) that a class is taken to have [m]; 0 where it varies."""

_LOWEST: Final = 0.25
"""Least distance of a ground contact below the horizon that gives a range [pixels]."""

# Columns of what is found: the first two and the sizes as in a detection.
(
    FOUND_X,
    FOUND_Y,
    FOUND_LENGTH,
    FOUND_WIDTH,
    FOUND_CLASS,
    FOUND_PIXELS,
    FOUND_SOURCE,
) = range(7)
FOUND: Final = 7


class Memory(NamedTuple):
    """Memory of a camera for one frame after the other.

    Attributes:
        image: The frame.
        runs: (columns * rows, RUN_WIDTH) scratch.
        votes: (M,) scratch.
        items: (K, 7) scratch.
        order: (K,) scratch.
    """

    image: Image
    runs: Ints
    votes: Ints
    items: Floats
    order: Ints


@compiled
def recognise(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    patches: Floats,
    classes: Ints,
    memory: Memory,
    first: int,
    stop: int,
    run: int,
    found: Found,
) -> None:
    """Detect what an image shows; the largest parts if there are more than fit.

    Args:
        parameters: Record of the camera and the environment.
        patches: (P, PATCH_WIDTH).
        classes: (M,) of the objects.
        memory: With the image, exposed.
        first: First column in use.
        stop: Column behind the last in use.
        run: Whose image it is.
        found: Out.
    """
    image, runs, items = memory.image, memory.runs, memory.items
    count = find_parts(first, stop, image.span, image.owner, image.nearness, classes, runs)
    kept = 0
    for part in range(count):
        if runs[part, RUN_PARENT] != part or not _is_accepted(
            parameters, patches, runs, part, image
        ):
            continue
        place = _room(items, kept, float(runs[part, PART_PIXELS]))
        if place < 0 or not _locate(parameters, runs[part], image, items[place]):
            continue
        items[place, FOUND_PIXELS] = runs[part, PART_PIXELS]
        items[place, FOUND_SOURCE] = main_owner(part, count, image.owner, runs, memory.votes)
        kept = max(kept, place + 1)
    _name_once(items, kept)
    for place in range(kept):
        x, y = items[place, FOUND_X], items[place, FOUND_Y]
        insert(memory.order, items, place, place, x * x + y * y)
    for row in range(kept):
        item, detection = items[memory.order[row]], found.detections[run, row]
        found.mask[run, row] = True
        found.source[run, row] = int(item[FOUND_SOURCE])
        detection[DETECTION_X], detection[DETECTION_Y] = item[FOUND_X], item[FOUND_Y]
        detection[DETECTION_LENGTH] = item[FOUND_LENGTH]
        detection[DETECTION_WIDTH] = item[FOUND_WIDTH]
        detection[DETECTION_CLASS] = item[FOUND_CLASS]


@inlined
def _is_accepted(parameters: Any, patches: Floats, runs: Ints, part: int, image: Image) -> bool:
    """Tell whether a part is large enough, the larger the fainter it is.

    What is told from its background needs a product of contrast and angular size that rises as the
    light falls (Rose 1948, see ``contrast_threshold``). So a part counts as many rows as it fills,
    times the share of its contrast that is left in its nearest pixel; rounded. Of a sliver at a
    side of the image nothing can be told: uprights lean where the camera is pitched, so its lower
    end is not where the object stands.
    """
    rows = runs[part, PART_STOP] - runs[part, PART_TOP]
    columns = runs[part, PART_LAST] - runs[part, PART_FIRST] + 1
    if rows < parameters["min_rows"] or columns < parameters["min_columns"]:
        return False
    if _is_cut(runs[part], image.owner.shape[0]) and not columns > parameters["lean"]:
        return False
    kind = runs[part, RUN_CLASS]
    if kind < 0:
        return True
    nearest = runs[runs[part, PART_NEAREST]]
    column, row = nearest[RUN_COLUMN], nearest[RUN_STOP] - 1
    transmission, _, _ = patch_at(patches, column, row)
    share, illuminance = contrast_at(parameters, kind, transmission, column, row, image)
    share /= contrast_threshold(1.0, illuminance)
    return bool(rows * share >= parameters["min_rows"] - 0.5)


@inlined
def _is_cut(part: Ints, columns: int) -> bool:
    """Tell whether a part touches the left or the right edge of the image."""
    return bool(part[PART_FIRST] == 0 or part[PART_LAST] == columns - 1)


@inlined
def _room(found: Floats, kept: int, pixels: float) -> int:
    """Return where a part of so many pixels goes: behind the others, or over a smaller one."""
    if kept < found.shape[0]:
        return kept
    least = 0
    for place in range(1, kept):
        if found[place, FOUND_PIXELS] < found[least, FOUND_PIXELS]:
            least = place
    return least if found[least, FOUND_PIXELS] < pixels else -1


@inlined
def _name_once(found: Floats, kept: int) -> None:
    """Name an object as the source of its largest part only, if it shows in several."""
    for place in range(kept):
        for other in range(place):
            thing = found[place, FOUND_SOURCE]
            if thing >= 0.0 and found[other, FOUND_SOURCE] == thing:
                is_larger = found[place, FOUND_PIXELS] > found[other, FOUND_PIXELS]
                found[other if is_larger else place, FOUND_SOURCE] = -1.0


@inlined
def _depth_of_ground(image: Image, row: float) -> float:
    """Return the depth at which the ground shows in a row [m], infinite from the horizon up."""
    view = image.pinhole
    down = (row + view[VIEW_ROW]) / view[VIEW_FOCAL]
    slope = view[VIEW_PITCH_SINE] + down * view[VIEW_PITCH_COSINE]
    if not slope * view[VIEW_FOCAL] >= _LOWEST:
        return math.inf
    return float(view[VIEW_HEIGHT] / slope)


@inlined
def _depth(part: Ints, size: Floats, image: Image) -> float:
    """Return the depth of a part [m], infinite where nothing tells it.

    Where its contact with the ground is hidden or below the image, no more of it can be seen than
    all, so height and width of its class (seen from behind) and the lower edge of the image bound
    the depth from above; the least bound is taken, because near is the safe side. The lower edge
    alone tells nothing: it goes along with the ego, and so would what is placed there.
    """
    columns, rows = image.owner.shape
    is_cut = part[PART_STOP] == rows
    if is_cut and size[2] <= 0.0:
        return math.inf
    if part[PART_CONTACT] >= 0 and not is_cut:
        # Of the row that the contact lies in only its lower neighbour is known to be free.
        depth = _depth_of_ground(image, part[PART_CONTACT] + 0.5)
        if depth < math.inf:
            return depth
    depth = _depth_of_ground(image, rows - 0.5) if is_cut else math.inf
    focal = image.pinhole[VIEW_FOCAL]
    if size[2] > 0.0:
        depth = min(depth, focal * size[2] / (part[PART_STOP] - part[PART_TOP]))
    if size[1] > 0.0 and not _is_cut(part, columns):
        depth = min(depth, focal * size[1] / (part[PART_LAST] - part[PART_FIRST] + 1))
    if depth == math.inf:
        depth = _depth_of_ground(image, part[PART_STOP] - 0.5)
    return depth


@inlined
def _locate(parameters: Any, part: Ints, image: Image, item: Floats) -> bool:
    """Find place and size of a part in the vehicle frame; tell whether its range is known.

    The nearest face is seen. What stands behind it follows from the class: the object is taken to
    lie along the road, so its centre is half of the class's length behind a face ahead, half of its
    width behind a face beside. So tracks get a length that a face alone does not tell, and meet the
    boxes of sensors that report centres. Where one side of the image cuts it, what is seen may be
    anywhere along its flank and is taken for the centre, which errs by half of the length at most.
    """
    view = image.pinhole
    kind = part[RUN_CLASS]
    size = SIZES[max(kind, 0)]
    length, usual = (size[0], size[1]) if kind >= 0 else (0.0, 0.0)
    depth = _depth(part, size if kind >= 0 else SIZES[-1], image)
    if not depth < math.inf:
        return False
    bottom = part[PART_CONTACT] if part[PART_CONTACT] >= 0 else part[PART_STOP] - 1
    down = (bottom + 0.5 + view[VIEW_ROW]) / view[VIEW_FOCAL]
    middle = 0.5 * (part[PART_FIRST] + part[PART_LAST])
    right = depth * (middle + view[VIEW_COLUMN]) / view[VIEW_FOCAL]
    along = depth * (view[VIEW_PITCH_COSINE] - down * view[VIEW_PITCH_SINE])
    sine, cosine = parameters["yaw_sine"], parameters["yaw_cosine"]
    x, y = cosine * along + sine * right, sine * along - cosine * right
    width = usual
    behind = aside = 0.0
    columns = image.owner.shape[0]
    if abs(x) < abs(y):
        aside = math.copysign(0.5 * usual, y)
    elif not _is_cut(part, columns):
        behind = math.copysign(0.5 * length, x)
        width = depth * (part[PART_LAST] - part[PART_FIRST] + 1) / view[VIEW_FOCAL]
    elif part[PART_LAST] - part[PART_FIRST] == columns - 1:
        behind = math.copysign(0.5 * length, x)
    item[FOUND_X] = parameters["x"] + x + behind
    item[FOUND_Y] = parameters["y"] + y + aside
    item[FOUND_LENGTH], item[FOUND_WIDTH], item[FOUND_CLASS] = length, width, kind
    return True
