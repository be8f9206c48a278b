"""Compiled: encounters in the plane with all objects, ahead, beside and behind, in each run.

Bounds that cost little leave out what cannot be the worst; nothing that they leave out changes a
result.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.bodies import reach_of, turn
from adeye.evaluation.metrics.statuses import CODES
from adeye.kernel.encounter import (
    closest_encounter,
    passing_line,
    worst_time_to_collision,
)
from adeye.kernel.geometry import box_distance
from adeye.kernel.jit import allocating, inlined
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    Floats,
    Ints,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Codes = NDArray[np.int8]

PLANAR_TTC, WTTC, DCE, TTCE = range(4)
ENCOUNTERS: Final = 4
"""Number of the quantities, all worse when smaller."""

ENCOUNTER_DISTANCE: Final = 1.0
"""Predicted distance up to which two bodies encounter each other, for the time to closest encounter
[m]. Our choice: about half of what separates cars in neighbouring lanes."""

ENCOUNTER_HORIZON: Final = 10.0
"""How far ahead a constant velocity predicts an encounter [s]. Our choice."""

_TOUCHING: Final = 1e-9
"""Distance at which two bodies pass below which it is looked whether they touch [m]."""

_VALUE: Final = CODES["value"]
_FREE: Final = CODES["no_conflict"]
_UNDEFINED: Final = CODES["undefined"]
_ERROR: Final = CODES["error"]


@allocating
def worst_encounters(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    length: Ints,
    ego: Floats,
    ego_size: Floats,
    objects: Floats,
    sizes: Floats,
    contact: Ints,
    gaps: Floats,
    actor_count: int,
    grip: Floats,
    values: Floats,
    rows: Ints,
    actors: Ints,
    codes: Codes,
) -> None:
    """Find the worst encounters of B runs, the earliest among equals.

    Args:
        length: (B,) rows that a run has.
        ego: (B, T, 7).
        ego_size: (B, 3).
        objects: (B, T, M, 5).
        sizes: (B, M, 3).
        contact: (B, T) object that the ego touches, -1 for none.
        gaps: (B, T) gap of ``conflict``: NaN at a row with an input that is not finite.
        actor_count: How many of the objects are actors; the others cannot accelerate.
        grip: (B,) largest acceleration of ego and actors in any direction [m/s²].
        values: (4, B) out: times to collision in the plane and in the worst case [s], distance of
            closest encounter [m], time to it while it is no more than ``ENCOUNTER_DISTANCE`` [s].
        rows: (4, B) out.
        actors: (4, B) out.
        codes: (4, B) out: index into the statuses of metrics.
    """
    turns = np.zeros((objects.shape[2] + 1, 3))
    reach = np.zeros(objects.shape[2])
    for run in range(length.shape[0]):
        turns[:] = math.nan
        own_reach = reach_of(ego_size[run, 0], ego_size[run, 1])
        for thing in range(objects.shape[2]):
            reach[thing] = own_reach + reach_of(sizes[run, thing, 0], sizes[run, thing, 1])
        for quantity in range(ENCOUNTERS):
            values[quantity, run] = math.inf
            rows[quantity, run], actors[quantity, run] = 0, -1
            codes[quantity, run] = _FREE if length[run] else _UNDEFINED
        for row in range(length[run]):
            if math.isnan(gaps[run, row]):
                codes[:, run] = _ERROR
                break
            touched = contact[run, row]
            if touched >= 0:
                for quantity in range(ENCOUNTERS):
                    _keep(quantity, 0.0, touched, run, row, values, rows, actors)
                continue
            _measure_row(
                run, row, ego, ego_size, objects, sizes, actor_count, grip[run], turns, reach,
                values, rows, actors,
            )  # fmt: skip
        for quantity in range(ENCOUNTERS):
            if actors[quantity, run] >= 0 and codes[quantity, run] != _ERROR:
                codes[quantity, run] = _VALUE


@inlined
def _keep(  # noqa: PLR0913, PLR0917 - where it is kept
    quantity: int,
    value: float,
    thing: int,
    run: int,
    row: int,
    values: Floats,
    rows: Ints,
    actors: Ints,
) -> None:
    if value < values[quantity, run]:
        values[quantity, run] = value
        rows[quantity, run], actors[quantity, run] = row, thing


@inlined
def _measure_row(  # noqa: C901, PLR0912, PLR0913, PLR0917 - a part of the kernel
    run: int,
    row: int,
    ego: Floats,
    ego_size: Floats,
    objects: Floats,
    sizes: Floats,
    actor_count: int,
    grip: float,
    turns: Floats,
    reach: Floats,
    values: Floats,
    rows: Ints,
    actors: Ints,
) -> None:
    x, y = ego[run, row, EGO_X], ego[run, row, EGO_Y]
    heading, speed = ego[run, row, EGO_HEADING], ego[run, row, EGO_SPEED]
    length, width = ego_size[run, 0], ego_size[run, 1]
    is_turned = False
    for thing in range(objects.shape[2]):
        o_heading = objects[run, row, thing, OBJECT_HEADING]
        o_speed = objects[run, row, thing, OBJECT_SPEED]
        dx = objects[run, row, thing, OBJECT_X] - x
        dy = objects[run, row, thing, OBJECT_Y] - y
        square = dx * dx + dy * dy
        # Each bound is a little on the safe side. The first one needs no trigonometry: one minus a
        # cosine is at most half of its angle squared.
        most = 2.0 * grip if thing < actor_count else grip
        angle, slower = o_heading - heading, o_speed - speed
        rate = math.sqrt(slower * slower + abs(speed * o_speed) * angle * angle)
        within = max(values[DCE, run], ENCOUNTER_DISTANCE) + ENCOUNTER_HORIZON * rate
        within = 1.0000001 * (reach[thing] + max(within, values[PLANAR_TTC, run] * rate))
        soon = values[WTTC, run]
        bound = 1.0000001 * (reach[thing] + soon * (rate + 0.5 * most * soon))
        if square > within * within and square > bound * bound:
            continue
        o_length, o_width = sizes[run, thing, 0], sizes[run, thing, 1]
        if not is_turned:
            turn(turns, 0, heading)
            is_turned = True
        turn(turns, thing + 1, o_heading)
        rate_x = o_speed * turns[thing + 1, 2] - speed * turns[0, 2]
        rate_y = o_speed * turns[thing + 1, 1] - speed * turns[0, 1]
        rate = math.sqrt(rate_x * rate_x + rate_y * rate_y)
        opening = dx * rate_x + dy * rate_y
        bound = 1.0000001 * (reach[thing] + soon * (rate + 0.5 * most * soon))
        if square <= bound * bound:
            worst = worst_time_to_collision(dx, dy, rate_x, rate_y, reach[thing], most)
            _keep(WTTC, worst, thing, run, row, values, rows, actors)
        enough = 1.0000001 * (reach[thing] + values[DCE, run])
        near = reach[thing] + ENCOUNTER_DISTANCE
        # Whether it could matter how far apart they are now.
        is_near = square <= enough * enough or (values[TTCE, run] > 0.0 and square <= near * near)
        if square > reach[thing] * reach[thing]:
            if opening >= 0.0:
                if not is_near:
                    continue
            else:
                line, first, last = passing_line(
                    dx, dy, rate_x, rate_y, (turns[0, 1], turns[0, 2]), length, width,
                    (turns[thing + 1, 1], turns[thing + 1, 2]), o_length, o_width,
                )  # fmt: skip
                if line > _TOUCHING:
                    if last >= 0.0 and first <= ENCOUNTER_HORIZON:
                        _keep(DCE, line, thing, run, row, values, rows, actors)
                        if line <= ENCOUNTER_DISTANCE:
                            time = max(first, 0.0)
                            _keep(TTCE, time, thing, run, row, values, rows, actors)
                        continue
                    if not is_near:
                        continue
                else:
                    bound = 1.0000001 * (reach[thing] + values[PLANAR_TTC, run] * rate)
                    if square > bound * bound and values[DCE, run] <= 0.0:
                        continue
        time, distance = closest_encounter(
            dx, dy, rate_x, rate_y, heading, length, width, o_heading, o_length, o_width
        )
        if distance <= 0.0:
            _keep(PLANAR_TTC, time, thing, run, row, values, rows, actors)
        if time > ENCOUNTER_HORIZON:
            time = 0.0
            distance = box_distance(
                x, y, heading, length, width, x + dx, y + dy, o_heading, o_length, o_width
            )
        _keep(DCE, distance, thing, run, row, values, rows, actors)
        if distance <= ENCOUNTER_DISTANCE:
            _keep(TTCE, time, thing, run, row, values, rows, actors)
