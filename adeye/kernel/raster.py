"""Boxes drawn into an image: a pinhole, and the nearest surface of each pixel wins.

A box is where three slabs meet. Along a ray through a pixel the inverse of the depth at which the
ray meets a plane is linear in the pixel's column and row, so the outline of a box is an
intersection of half-planes of the image and its surface the least of at most four linear forms:
exact at the centre of each pixel, without cutting polygons, also where a box reaches behind the
image plane or around the camera.

Pixels belong together that share an edge and a class, unless the depth jumps between them: where
one object ends in front of another a real image has an edge of brightness or texture.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.boxes import Turn
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined

# --- Boxes drawn into an image: a pinhole, and the nearest surface of each pixel wins -------------

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NEAR: Final = 0.1
"""Depth from which surfaces are drawn [m]; a box that reaches nearer shows its cut there."""

NOTHING: Final = -1
"""Owner of a pixel that no box covers."""

# Columns of a view: where a camera is and looks.
(
    VIEW_X,  # in the map [m]
    VIEW_Y,
    VIEW_HEIGHT,  # above the ground [m]
    VIEW_SINE,  # of the heading that it looks in
    VIEW_COSINE,
    VIEW_PITCH_SINE,  # of its pitch, positive with the nose down
    VIEW_PITCH_COSINE,
    VIEW_FOCAL,  # focal length [pixels]
    VIEW_COLUMN,  # column and row of the pixel (0, 0) from the optical axis [pixels]
    VIEW_ROW,
) = range(10)
VIEW_WIDTH: Final = 10

Place = tuple[float, float, float]
"""x, y in the map and height above the ground [m]."""

# Rows of the forms of a box: inverse depths where rays enter its slabs, where they leave them, and
# the lines that bound its outline.
_ENTRIES: Final = 0
_EXITS: Final = 4
_LINES: Final = 10
FORMS: Final = 32
FORM_WIDTH: Final = 4
_TINY: Final = 1e-9
"""Least distance from a face that is reckoned with [m], so that nothing is divided by zero."""


@inlined
def aim(
    place: Place, heading: float, pitch: Turn, focal: float, size: tuple[int, int], view: Floats
) -> None:
    """Describe a pinhole camera; its optical axis goes through the middle of the image.

    Args:
        place: Of the pinhole.
        heading: That it looks in [rad].
        pitch: Positive with the nose down.
        focal: Focal length [pixels].
        size: Columns and rows of the image.
        view: (VIEW_WIDTH,) out.
    """
    view[VIEW_X], view[VIEW_Y], view[VIEW_HEIGHT] = place
    view[VIEW_SINE], view[VIEW_COSINE] = sin_cos(heading)
    view[VIEW_PITCH_SINE], view[VIEW_PITCH_COSINE] = pitch
    view[VIEW_FOCAL] = focal
    view[VIEW_COLUMN], view[VIEW_ROW] = 0.5 - 0.5 * size[0], 0.5 - 0.5 * size[1]


@inlined
def _put(forms: Floats, row: int, scale: float, form: tuple[float, float, float]) -> None:
    forms[row, 0], forms[row, 1], forms[row, 2] = scale * form[0], scale * form[1], scale * form[2]


@inlined
def _cut_slab(
    forms: Floats,
    counts: tuple[int, int],
    slab: int,
    place: float,
    half: float,
    form: tuple[float, float, float],
) -> tuple[int, int]:
    """Add where rays enter and leave a slab.

    Args:
        forms: (FORMS, FORM_WIDTH) in and out.
        counts: Entries and exits so far.
        slab: Number of the slab.
        place: Of the camera across the slab, from its middle [m].
        half: Half of the slab's thickness [m].
        form: Growth of the place per depth along a ray, as a form of column and row.

    Returns:
        Entries and exits.
    """
    entries, exits = counts
    ahead, behind = half - place, -half - place
    if behind >= 0.0 or ahead <= 0.0:
        # From outside: the nearer face is where a ray enters, the other one where it leaves.
        enter, leave = (behind, ahead) if behind >= 0.0 else (ahead, behind)
        enter = max(enter, _TINY) if behind >= 0.0 else min(enter, -_TINY)
        leave = max(leave, _TINY) if behind >= 0.0 else min(leave, -_TINY)
        _put(forms, _ENTRIES + entries, 1.0 / enter, form)
        forms[_ENTRIES + entries, 3] = slab
        _put(forms, _EXITS + exits, 1.0 / leave, form)
        forms[_EXITS + exits, 3] = slab
        return entries + 1, exits + 1
    _put(forms, _EXITS + exits, 1.0 / max(ahead, _TINY), form)
    _put(forms, _EXITS + exits + 1, 1.0 / min(behind, -_TINY), form)
    forms[_EXITS + exits, 3] = forms[_EXITS + exits + 1, 3] = slab
    return entries, exits + 2


@inlined
def _add_line(forms: Floats, lines: int, free: float, column: float, row: float) -> int:
    """Add the bound free + column * c + row * r >= 0 as a bound of the row, if it is one."""
    place = _LINES + lines
    if row == 0.0:
        forms[place, 0], forms[place, 1], forms[place, 2] = free, column, 0.0
    else:
        forms[place, 0], forms[place, 1] = -free / row, -column / row
        forms[place, 2] = 1.0 if row > 0.0 else -1.0
    return lines + 1


@inlined
def _bound(forms: Floats, entries: int, exits: int, needs_sign: bool) -> int:  # noqa: FBT001
    """Add the lines of an outline: a ray enters every slab before it leaves any; count them."""
    lines = 0
    for entry in range(_ENTRIES, _ENTRIES + entries):
        if needs_sign:
            lines = _add_line(forms, lines, forms[entry, 0], forms[entry, 1], forms[entry, 2])
        for leave in range(_EXITS, _EXITS + exits):
            if forms[leave, 3] != forms[entry, 3]:
                lines = _add_line(
                    forms,
                    lines,
                    forms[entry, 0] - forms[leave, 0],
                    forms[entry, 1] - forms[leave, 1],
                    forms[entry, 2] - forms[leave, 2],
                )
    return lines


@compiled
def trace(view: Floats, box: Floats, size: Floats, forms: Floats) -> tuple[int, float, float]:
    """Find the outline and the surface of a box that stands on the ground.

    Args:
        view: (VIEW_WIDTH,) of the camera.
        box: (>= 3,) x [m], y [m], heading [rad] in the map.
        size: (3,) length, width, height [m].
        forms: (FORMS, FORM_WIDTH) out, for ``fill`` and ``covers``.

    Returns:
        Number of lines of the outline, -1 where nothing of the box can be seen (behind the camera,
        or a number is NaN); least and greatest column that it may reach, infinite if it reaches
        nearer than ``NEAR``.
    """
    s, c = sin_cos(box[2])
    dx, dy = view[VIEW_X] - box[0], view[VIEW_Y] - box[1]
    half_length, half_width, half_height = 0.5 * size[0], 0.5 * size[1], 0.5 * size[2]
    up = view[VIEW_HEIGHT] - half_height
    # The axes of the box seen from the camera: its heading about that of the view.
    along = c * view[VIEW_COSINE] + s * view[VIEW_SINE]
    aside = s * view[VIEW_COSINE] - c * view[VIEW_SINE]
    sine, cosine = view[VIEW_PITCH_SINE], view[VIEW_PITCH_COSINE]
    place_1, place_2 = dx * c + dy * s, dy * c - dx * s
    depth = -(place_1 * along - place_2 * aside) * cosine + up * sine
    reach = (abs(along) * half_length + abs(aside) * half_width) * cosine + abs(sine) * half_height
    if not depth + reach > NEAR or not depth < math.inf:
        return -1, 0.0, 0.0
    step = 1.0 / view[VIEW_FOCAL]
    column, row = view[VIEW_COLUMN] * step, view[VIEW_ROW] * step
    form_1 = _in_pixels((along * cosine, -aside, -along * sine), column, row, step)
    form_2 = _in_pixels((-aside * cosine, -along, aside * sine), column, row, step)
    form_3 = _in_pixels((-sine, 0.0, -cosine), column, row, step)
    counts = _cut_slab(forms, (0, 0), 0, place_1, half_length, form_1)
    counts = _cut_slab(forms, counts, 1, place_2, half_width, form_2)
    entries, exits = _cut_slab(forms, counts, 2, up, half_height, form_3)
    is_cut = not depth - reach > NEAR
    needs_sign = is_cut or entries == 3
    if is_cut:
        forms[_ENTRIES + entries, 0] = 1.0 / NEAR
        forms[_ENTRIES + entries, 1] = forms[_ENTRIES + entries, 2] = 0.0
        forms[_ENTRIES + entries, 3] = 3.0
        entries += 1
    lines = _bound(forms, entries, exits, needs_sign)
    for spare in range(_ENTRIES + entries, _ENTRIES + 4):
        forms[spare, 0], forms[spare, 1], forms[spare, 2] = math.inf, 0.0, 0.0
    if is_cut:
        return lines, -math.inf, math.inf
    least, most = _columns(
        (depth, place_1 * aside + place_2 * along),
        (along * cosine * half_length, -aside * half_length),
        (-aside * cosine * half_width, -along * half_width),
        abs(sine) * half_height,
    )
    focal = view[VIEW_FOCAL]
    return lines, focal * least - view[VIEW_COLUMN], focal * most - view[VIEW_COLUMN]


@inlined
def _in_pixels(
    form: tuple[float, float, float], column: float, row: float, step: float
) -> tuple[float, float, float]:
    """Turn a form of a ray's direction into one of its column and row in the image."""
    free, right, down = form
    return free + column * right + row * down, step * right, step * down


@inlined
def _columns(
    centre: tuple[float, float],
    length: tuple[float, float],
    width: tuple[float, float],
    tilt: float,
) -> tuple[float, float]:
    """Return the least and greatest tangent to the right at which a box in front can be.

    Args:
        centre: Its depth and its place to the right, from the camera [m].
        length: What half its length adds to both [m].
        width: What half its width adds to both [m].
        tilt: What half its height adds to the depth, both ways [m].
    """
    least, most = math.inf, -math.inf
    for corner in range(4):
        a = 1.0 if corner & 1 else -1.0
        b = 1.0 if corner & 2 else -1.0
        depth = centre[0] + a * length[0] + b * width[0]
        right = centre[1] + a * length[1] + b * width[1]
        # The nearer of the upper and the lower corner is further from the middle.
        far, near = right / (depth + tilt), right / (depth - tilt)
        least = min(least, far, near)
        most = max(most, far, near)
    return least, most


@inlined
def covers(forms: Floats, lines: int, column: float, row: float) -> bool:
    """Tell whether a box covers a point, which may lie outside of the image.

    Args:
        forms: (FORMS, FORM_WIDTH) of the box, see ``trace``.
        lines: Of its outline.
        column: [pixels].
        row: [pixels].
    """
    for line in range(_LINES, _LINES + lines):
        edge = forms[line, 0] + forms[line, 1] * column
        if forms[line, 2] > 0.0:
            is_inside = row >= edge
        elif forms[line, 2] < 0.0:
            is_inside = row <= edge
        else:
            is_inside = edge >= 0.0
        if not is_inside:
            return False
    return True


@inlined
def _rows(forms: Floats, lines: int, column: float, rows: int) -> tuple[int, int]:
    """Return the first row of a box in a column and the one behind its last."""
    low, high = 0.0, float(rows - 1)
    for line in range(_LINES, _LINES + lines):
        edge = forms[line, 0] + forms[line, 1] * column
        if forms[line, 2] > 0.0:
            low = edge if edge > low else low
        elif forms[line, 2] < 0.0:
            high = edge if edge < high else high
        elif edge < 0.0:
            return 0, 0
    if not low <= high:
        return 0, 0
    return math.ceil(low), math.floor(high) + 1


@compiled
def fill(
    forms: Floats,
    lines: int,
    least: float,
    most: float,
    thing: int,
    nearness: Floats,
    owner: Ints,
    span: Ints,
) -> tuple[int, int]:
    """Draw a box: it takes the pixels in which it is nearer than what is there.

    Args:
        forms: (FORMS, FORM_WIDTH) of the box, see ``trace``.
        lines: Of its outline.
        least: Column before which it has no pixel.
        most: Column behind which it has no pixel.
        thing: Its number, the new owner of its pixels.
        nearness: (columns, rows) inverse depth of what is seen [1/m], 0 for nothing; in and out.
        owner: (columns, rows) whose surface it is; in and out.
        span: (columns, 2) first row in use and the one behind the last; in and out.

    Returns:
        First column that was drawn in, and the one behind the last.
    """
    columns, rows = nearness.shape
    first = math.ceil(max(least, 0.0)) if least < columns else columns
    last = math.floor(min(most, columns - 1.0)) if most >= 0.0 else -1
    for column in range(first, last + 1):
        at = float(column)
        top, stop = _rows(forms, lines, at, rows)
        if top >= stop:
            continue
        span[column, 0] = min(span[column, 0], top)
        span[column, 1] = max(span[column, 1], stop)
        free_0, slope_0 = forms[0, 0] + forms[0, 1] * at, forms[0, 2]
        free_1, slope_1 = forms[1, 0] + forms[1, 1] * at, forms[1, 2]
        free_2, slope_2 = forms[2, 0] + forms[2, 1] * at, forms[2, 2]
        free_3 = forms[3, 0] + forms[3, 1] * at
        for row in range(top, stop):
            near = min(free_0 + slope_0 * row, free_1 + slope_1 * row)
            near = min(near, free_2 + slope_2 * row)
            near = min(near, free_3)
            if near > nearness[column, row]:
                nearness[column, row] = near
                owner[column, row] = thing
    return first, last + 1


# --- Connected parts of an image: runs of each column, joined with those beside them --------------

GHOST: Final = -2
"""Owner of a pixel that shows something where nothing is; its class is unknown, -1."""

_MIXED: Final = -3
"""Owner of a run or part that has several."""

EDGE: Final = 0.15
"""Jump of the inverse depth between two surfaces, as a share of the larger one, from which they
are told apart. Our choice: a gap of a car's length at 25 m, of a lorry's at 70 m."""

# Columns of a run: a stretch of a column, and whether the pixel below it shows nothing. Of the
# first run of a part also the part: where it is, its lowest row with nothing below (-1 for none),
# its pixels, its owner and its nearest run: of equally near ones the leftmost and the rightmost.
(
    RUN_COLUMN,
    RUN_TOP,
    RUN_STOP,
    RUN_CLASS,
    RUN_OWNER,
    RUN_OPEN,
    RUN_PARENT,
    PART_FIRST,
    PART_LAST,
    PART_TOP,
    PART_STOP,
    PART_CONTACT,
    PART_PIXELS,
    PART_OWNER,
    PART_NEAREST,
    PART_NEAREST_LAST,
) = range(16)
RUN_WIDTH: Final = 16


@inlined
def _class_of(thing: int, classes: Ints) -> int:
    return -1 if thing < 0 else int(classes[thing])


@inlined
def _is_edge(one: float, other: float) -> bool:
    return abs(one - other) > EDGE * max(one, other)


@inlined
def _end_run(
    column: int, row: int, stop: int, owner: Ints, nearness: Floats, classes: Ints
) -> tuple[int, int]:
    """Follow a run down from its first row; return the row behind its last and its owner."""
    thing = whose = owner[column, row]
    kind = _class_of(thing, classes)
    row += 1
    while row < stop:
        other = owner[column, row]
        if other != thing:
            if other == NOTHING or _class_of(other, classes) != kind:
                break
            if _is_edge(nearness[column, row - 1], nearness[column, row]):
                break
            thing = other
            whose = _MIXED
        row += 1
    return row, whose


@inlined
def _find_runs(
    column: int,
    span: Ints,
    owner: Ints,
    nearness: Floats,
    classes: Ints,
    runs: Ints,
    count: int,
) -> int:
    """Add the runs of a column, from the top down; return how many there are now."""
    row, stop = span[column, 0], span[column, 1]
    while row < stop:
        if owner[column, row] == NOTHING:
            row += 1
            continue
        end, whose = _end_run(column, row, stop, owner, nearness, classes)
        run = runs[count]
        run[RUN_COLUMN], run[RUN_TOP], run[RUN_STOP] = column, row, end
        run[RUN_CLASS] = _class_of(owner[column, row], classes)
        run[RUN_OWNER] = whose
        is_free = end < owner.shape[1] and (end == stop or owner[column, end] == NOTHING)
        run[RUN_OPEN] = 1 if is_free else 0
        run[RUN_PARENT] = count
        count += 1
        row = end
    return count


@inlined
def _root(runs: Ints, run: int) -> int:
    while runs[run, RUN_PARENT] != run:
        runs[run, RUN_PARENT] = runs[runs[run, RUN_PARENT], RUN_PARENT]
        run = runs[run, RUN_PARENT]
    return run


@inlined
def _touch(left: Ints, right: Ints, owner: Ints, nearness: Floats) -> bool:
    """Tell whether two runs of one class in neighbouring columns belong together."""
    if left[RUN_CLASS] != right[RUN_CLASS]:
        return False
    top, stop = max(left[RUN_TOP], right[RUN_TOP]), min(left[RUN_STOP], right[RUN_STOP])
    if left[RUN_OWNER] == right[RUN_OWNER] and left[RUN_OWNER] != _MIXED:
        return bool(top < stop)
    here, there = left[RUN_COLUMN], right[RUN_COLUMN]
    for row in range(top, stop):
        if owner[here, row] == owner[there, row]:
            return True
        if not _is_edge(nearness[here, row], nearness[there, row]):
            return True
    return False


@inlined
def _link(runs: Ints, before: int, here: int, count: int, owner: Ints, nearness: Floats) -> None:
    """Join the runs of a column, from ``here`` on, with those of the one before."""
    left = before
    for right in range(here, count):
        while left < here and runs[left, RUN_STOP] <= runs[right, RUN_TOP]:
            left += 1
        other = left
        while other < here and runs[other, RUN_TOP] < runs[right, RUN_STOP]:
            if _touch(runs[other], runs[right], owner, nearness):
                one, two = _root(runs, other), _root(runs, right)
                runs[max(one, two), RUN_PARENT] = min(one, two)
            other += 1


@inlined
def _begin_part(run: Ints, index: int) -> None:
    run[PART_FIRST] = run[PART_LAST] = run[RUN_COLUMN]
    run[PART_TOP], run[PART_STOP] = run[RUN_TOP], run[RUN_STOP]
    run[PART_CONTACT] = run[RUN_STOP] - 1 if run[RUN_OPEN] > 0 else -1
    run[PART_PIXELS] = run[RUN_STOP] - run[RUN_TOP]
    run[PART_OWNER] = run[RUN_OWNER]
    run[PART_NEAREST] = run[PART_NEAREST_LAST] = index


@inlined
def _add_run(part: Ints, run: Ints, index: int, nearness: Floats, runs: Ints) -> None:
    """Add a run to the part that it belongs to."""
    part[PART_LAST] = max(part[PART_LAST], run[RUN_COLUMN])
    part[PART_TOP] = min(part[PART_TOP], run[RUN_TOP])
    part[PART_STOP] = max(part[PART_STOP], run[RUN_STOP])
    if run[RUN_OPEN] > 0:
        part[PART_CONTACT] = max(part[PART_CONTACT], run[RUN_STOP] - 1)
    part[PART_PIXELS] += run[RUN_STOP] - run[RUN_TOP]
    if part[PART_OWNER] != run[RUN_OWNER]:
        part[PART_OWNER] = _MIXED
    nearest = runs[part[PART_NEAREST]]
    near = nearness[nearest[RUN_COLUMN], nearest[RUN_STOP] - 1]
    here = nearness[run[RUN_COLUMN], run[RUN_STOP] - 1]
    if here > near:
        part[PART_NEAREST] = part[PART_NEAREST_LAST] = index
    elif here == near:
        part[PART_NEAREST_LAST] = index


@compiled
def find_parts(
    first: int,
    stop: int,
    span: Ints,
    owner: Ints,
    nearness: Floats,
    classes: Ints,
    runs: Ints,
) -> int:
    """Find the connected parts of an image.

    Args:
        first: Column to begin with.
        stop: Column to stop at.
        span: (columns, 2) first row in use and the one behind the last.
        owner: (columns, rows) object that each pixel shows, ``NOTHING`` or ``GHOST``.
        nearness: (columns, rows) inverse depth [1/m].
        classes: (M,) class of each object.
        runs: (columns * rows, RUN_WIDTH) out; a run that is its own parent is a part, too.

    Returns:
        Number of runs.
    """
    count, before = 0, 0
    for column in range(first, stop):
        here = count
        count = _find_runs(column, span, owner, nearness, classes, runs, count)
        _link(runs, before, here, count, owner, nearness)
        before = here
    for index in range(count):
        # The least number of a part is its root, so a part is begun before it grows.
        root = _root(runs, index)
        if root == index:
            _begin_part(runs[index], index)
        else:
            _add_run(runs[root], runs[index], index, nearness, runs)
    return count


@compiled
def main_owner(part: int, count: int, owner: Ints, runs: Ints, votes: Ints) -> int:
    """Return the object that most pixels of a part show, -1 for none.

    Args:
        part: Its number among the runs.
        count: Number of runs.
        owner: (columns, rows) object that each pixel shows.
        runs: (>= count, RUN_WIDTH) of ``find_parts``.
        votes: (M,) scratch.
    """
    if runs[part, PART_OWNER] != _MIXED:
        return max(int(runs[part, PART_OWNER]), -1)
    votes[:] = 0
    for index in range(part, count):
        if _root(runs, index) == part:
            for row in range(runs[index, RUN_TOP], runs[index, RUN_STOP]):
                thing = owner[runs[index, RUN_COLUMN], row]
                if thing >= 0:
                    votes[thing] += 1
    chosen = -1
    for thing in range(votes.shape[0]):
        if votes[thing] > 0 and (chosen < 0 or votes[thing] > votes[chosen]):
            chosen = thing
    return chosen
