"""Compiled: which objects matter, since when, and whether sensors and channel have them.

An object *matters* at a row if it is the nearest in the path, no farther than the ego gets before
it can stand (``kernel.reachable``), and half of its extent is to be seen from the ego's centre.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.metrics.scans import ERROR, NOT_APPLICABLE, VALUE
from adeye.kernel.jit import allocating, inlined
from adeye.kernel.occlusion import visible_fraction
from adeye.kernel.reachable import reachable_distance
from adeye.signals import (
    EGO_SPEED,
    EGO_X,
    EGO_Y,
)
from adeye.trace import NO_TRACKS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.evaluation.samples import Shorts
    from adeye.signals import Bools, Floats, Ints

    Codes = NDArray[np.int8]

LEAST_SEEN: Final = 0.5
"""Share of an object's extent that must be to be seen for it to matter. Our choice, as the usual
``min_visible`` of sensors."""


@inlined
def matters(
    gap: float,
    thing: int,
    ego: Floats,
    friction: float,
    objects: Floats,
    sizes: Floats,
) -> bool:
    """Tell whether the nearest object in the path matters at a row, see the module.

    Args:
        gap: To it [m].
        thing: Index of it, -1 for none.
        ego: (7,).
        friction: Of the road.
        objects: (M, 5).
        sizes: (M, 3).
    """
    if thing < 0 or not gap <= reachable_distance(ego[EGO_SPEED], friction):
        return False
    return bool(visible_fraction(ego[EGO_X], ego[EGO_Y], thing, objects, sizes) >= LEAST_SEEN)


@allocating
def worst_latencies(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    length: Ints,
    gaps: Floats,
    ahead: Shorts,
    ego: Floats,
    friction: Floats,
    objects: Floats,
    sizes: Floats,
    detected: Bools,
    sensors: Ints,
) -> tuple[Ints, Ints, Ints, Codes]:
    """Find the object that a sensor has latest after it first mattered.

    Args:
        length: (B,) rows that a run has.
        gaps: (B, T) to the nearest object in the path [m].
        ahead: (B, T) that object, -1 for none.
        ego: (B, T, 7).
        friction: (B,).
        objects: (B, T, M, 5).
        sizes: (B, M, 3).
        detected: (B, T, S, M).
        sensors: Those that count.

    Returns:
        Rows (B,) from mattering to detection, 0 if it was detected before; rows (B,) of the
        detection, the last one if there is none; objects (B,); and statuses (B,).
    """
    runs = length.shape[0]
    late, rows = np.zeros(runs, dtype=np.int64), np.zeros(runs, dtype=np.int64)
    worst = np.full(runs, -1, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    since = np.zeros(objects.shape[2], dtype=np.int64)
    for run in range(runs):
        since[:] = -1
        for row in range(length[run]):
            thing = ahead[run, row]
            if not gaps[run, row] > -math.inf:
                codes[run] = ERROR
            # Of the last row nothing is decided, so nothing can be detected at it.
            elif (
                row < length[run] - 1
                and thing >= 0
                and since[thing] < 0
                and matters(
                    gaps[run, row], thing, ego[run, row], friction[run], objects[run, row],
                    sizes[run],
                )
            ):  # fmt: skip
                since[thing] = row
        if codes[run] == ERROR or sensors.shape[0] == 0:
            continue
        for thing in range(objects.shape[2]):
            if since[thing] >= 0:
                first = _first_detection(detected[run], sensors, thing, length[run] - 1)
                after = max(0, first - since[thing])
                if after > late[run] or worst[run] < 0:
                    late[run], rows[run], worst[run] = after, max(first, since[thing]), thing
                    codes[run] = VALUE
    return late, rows, worst, codes


@inlined
def _first_detection(detected: Bools, sensors: Ints, thing: int, end: int) -> int:
    """Return the first row (T, S, M) at which a sensor has an object, ``end`` if none has."""
    for row in range(end):
        for place in range(sensors.shape[0]):
            if detected[row, sensors[place], thing]:
                return row
    return end


@allocating
def worst_missed(  # noqa: C901, PLR0913, PLR0917 - a kernel over the whole scene
    length: Ints,
    gaps: Floats,
    ahead: Shorts,
    ego: Floats,
    friction: Floats,
    objects: Floats,
    sizes: Floats,
    errors: Floats,
) -> tuple[Ints, Ints, Ints, Codes]:
    """Find the object that matters at most rows without being tracked.

    Args:
        length: (B,) rows that a run has.
        gaps: (B, T) to the nearest object in the path [m].
        ahead: (B, T) that object, -1 for none.
        ego: (B, T, 7).
        friction: (B,).
        objects: (B, T, M, 5).
        sizes: (B, M, 3).
        errors: (B, T, M, 2) of the channel's tracks [m], NaN for an object without one.

    Returns:
        Rows (B,) at which it is missed, the first of them (B,), the object (B,) and statuses (B,):
        ``not_applicable`` where none matters.
    """
    runs = length.shape[0]
    most, rows = np.zeros(runs, dtype=np.int64), np.zeros(runs, dtype=np.int64)
    worst = np.full(runs, -1, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    # Of each object: at how many rows it is missed, -1 before it matters, and the first of them.
    missed = np.zeros(objects.shape[2], dtype=np.int64)
    first = np.zeros(objects.shape[2], dtype=np.int64)
    for run in range(runs):
        missed[:] = -1
        first[:] = 0
        for row in range(length[run] - 1):
            thing = ahead[run, row]
            if not gaps[run, row] > -math.inf:
                codes[run] = ERROR
            if thing < 0:
                continue
            is_tracked = math.isfinite(errors[run, row, thing, 0])
            if is_tracked and missed[thing] >= 0:
                continue
            if matters(
                gaps[run, row], thing, ego[run, row], friction[run], objects[run, row], sizes[run]
            ):
                missed[thing] = max(0, missed[thing])
                if not is_tracked:
                    first[thing] = row if missed[thing] == 0 else first[thing]
                    missed[thing] += 1
        if codes[run] == ERROR:
            continue
        for thing in range(objects.shape[2]):
            if missed[thing] > most[run] or (missed[thing] == 0 and worst[run] < 0):
                most[run], rows[run], worst[run] = missed[thing], first[thing], thing
                codes[run] = VALUE
    return most, rows, worst, codes


@allocating
def false_rows(length: Ints, false: Codes) -> tuple[Ints, Ints, Codes]:
    """Count the rows with a false track.

    Args:
        length: (B,) rows that a run has.
        false: (B, T) false tracks, ``NO_TRACKS`` where the channel shows none.

    Returns:
        Rows (B,), the first of them (B,) and statuses (B,): ``not_applicable`` where the channel
        never shows its tracks.
    """
    runs = length.shape[0]
    counts, rows = np.zeros(runs, dtype=np.int64), np.zeros(runs, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    for run in range(runs):
        for row in range(length[run] - 1):
            if false[run, row] != NO_TRACKS:
                codes[run] = VALUE
            if false[run, row] > 0:
                if counts[run] == 0:
                    rows[run] = row
                counts[run] += 1
    return counts, rows, codes


RANGE, POSITION = range(2)
"""What ``pooled_errors`` makes of the errors: root mean square along the line of sight, 95th
percentile of the distance."""


@allocating
def pooled_errors(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    length: Ints,
    gaps: Floats,
    ahead: Shorts,
    ego: Floats,
    friction: Floats,
    errors: Floats,
    what: int,
) -> tuple[Floats, Ints, Ints, Codes]:
    """Pool the errors of the tracks of what is nearest in the path and within the ego's reach.

    Args:
        length: (B,) rows that a run has.
        gaps: (B, T) to the nearest object in the path [m].
        ahead: (B, T) that object, -1 for none.
        ego: (B, T, 7).
        friction: (B,).
        errors: (B, T, M, 2) of the channel's tracks [m], NaN for an object without one.
        what: ``RANGE`` or ``POSITION``.

    Returns:
        Pooled errors (B,) [m], rows (B,) with the largest, its objects (B,) and statuses (B,):
        ``not_applicable`` where no such object is tracked.
    """
    runs = length.shape[0]
    values, rows = np.zeros(runs), np.zeros(runs, dtype=np.int64)
    worst = np.full(runs, -1, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    sizes = np.zeros(gaps.shape[1])
    for run in range(runs):
        count, most, total = 0, -1.0, 0.0
        for row in range(length[run] - 1):
            gap, thing = gaps[run, row], ahead[run, row]
            if not gap > -math.inf:
                codes[run] = ERROR
                break
            if thing < 0 or not gap <= reachable_distance(ego[run, row, EGO_SPEED], friction[run]):
                continue
            along, across = errors[run, row, thing, 0], errors[run, row, thing, 1]
            if not math.isfinite(along + across):
                continue
            size = abs(along)
            if what == POSITION:
                size = math.sqrt(along * along + across * across)
            sizes[count] = size
            total += size * size
            count += 1
            if size > most:
                most, rows[run], worst[run] = size, row, thing
        if count and codes[run] != ERROR:
            codes[run] = VALUE
            values[run] = math.sqrt(total / count)
            if what == POSITION:
                ordered = np.sort(sizes[:count])
                # The least value that 95 of 100 do not exceed.
                values[run] = ordered[(95 * count + 99) // 100 - 1]
    return values, rows, worst, codes
