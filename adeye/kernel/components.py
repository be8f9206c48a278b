"""Connected parts of an image: runs of each column, joined with those beside them.

Pixels belong together that share an edge and a class, unless the depth jumps between them: where
one object ends in front of another a real image has an edge of brightness or texture.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.raster import NOTHING

__all__ = ["GHOST", "RUN_WIDTH", "find_parts", "main_owner"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

GHOST: Final = -2
"""Owner of a pixel that shows something where nothing is; its class is unknown, -1."""

_MIXED: Final = -3
"""Owner of a run or part that has several."""

EDGE: Final = 0.15
"""Jump of the inverse depth between two surfaces, as a share of the larger one, from which they
are told apart. Our choice: a gap of a car's length at 25 m, of a lorry's at 70 m."""

# Columns of a run: a stretch of a column, and whether the pixel below it shows nothing. Of the
# first run of a part also the part: where it is, its lowest row with nothing below (-1 for none),
# its pixels, its owner and its nearest run.
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
) = range(15)
RUN_WIDTH: Final = 15


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
    run[PART_NEAREST] = index


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
    if nearness[run[RUN_COLUMN], run[RUN_STOP] - 1] > near:
        part[PART_NEAREST] = index


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
