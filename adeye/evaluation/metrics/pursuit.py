"""Compiled: the worst of what is left against objects in the path, run by run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.following import (
    DST,
    FOLLOWING,
    is_worse_when_larger,
    measure_following,
)
from adeye.evaluation.metrics.scans import ERROR, NO_CONFLICT, UNDEFINED, VALUE
from adeye.kernel.jit import allocating

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Floats, Ints

    Codes = NDArray[np.int8]
    Shorts = NDArray[np.int16]


@allocating
def worst_following(  # noqa: C901, PLR0913, PLR0917 - a kernel over the whole scene
    length: Ints,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    objects: Floats,
    places: Floats,
    sizes: Floats,
    contact: Ints,
    gaps: Floats,
    ahead: Shorts,
    limits: Floats,
    values: Floats,
    rows: Ints,
    actors: Ints,
    codes: Codes,
) -> None:
    """Find the worst of each quantity in B runs, the earliest among equals.

    Args:
        length: (B,) rows that a run has.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        objects: (B, T, M, 5).
        places: (B, T, M, 6).
        sizes: (B, M, 3).
        contact: (B, T) object that the ego touches, -1 for none.
        gaps: (B, T) gap of ``conflict``: NaN at a row with an input that is not finite.
        ahead: (B, T) its object, -1 where nobody is in the path.
        limits: (B, 3) largest braking, lateral acceleration and acceleration of the ego [m/s²].
        values: (10, B) out.
        rows: (10, B) out.
        actors: (10, B) out.
        codes: (10, B) out: index into the statuses of metrics. A deceleration to safety time is
            ``undefined`` if at any row the safety time is lost already.
    """
    found, who = np.zeros(FOLLOWING), np.zeros(FOLLOWING, dtype=np.int64)
    turns = np.zeros((objects.shape[2] + 1, 3))
    for run in range(length.shape[0]):
        turns[:] = math.nan
        for quantity in range(FOLLOWING):
            values[quantity, run] = -math.inf if is_worse_when_larger(quantity) else math.inf
            rows[quantity, run], actors[quantity, run] = 0, -1
            codes[quantity, run] = UNDEFINED
        is_free, is_lost = False, False
        for row in range(length[run]):
            if math.isnan(gaps[run, row]):
                codes[:, run] = ERROR
                break
            if ahead[run, row] < 0 and contact[run, row] < 0:
                is_free = True
                continue
            measure_following(
                run, row, ego, ego_place, ego_size, objects, places, sizes, contact, limits, turns,
                found, who,
            )  # fmt: skip
            for quantity in range(FOLLOWING):
                if who[quantity] < 0:
                    is_free |= contact[run, row] < 0
                    continue
                value = found[quantity]
                if quantity == DST and value == math.inf:
                    is_lost = True
                sign = -1.0 if is_worse_when_larger(quantity) else 1.0
                if sign * value < sign * values[quantity, run]:
                    values[quantity, run] = value
                    rows[quantity, run], actors[quantity, run] = row, who[quantity]
                    codes[quantity, run] = VALUE
        for quantity in range(FOLLOWING):
            if is_free and codes[quantity, run] == UNDEFINED:
                codes[quantity, run] = NO_CONFLICT
        if is_lost and codes[DST, run] != ERROR:
            codes[DST, run] = UNDEFINED
