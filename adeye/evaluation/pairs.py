"""Compiled: how near the ego is to one object at every row of its runs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.bodies import HALF_LENGTH, are_finite, on_road, turn
from adeye.kernel.geometry import box_distance
from adeye.kernel.jit import allocating
from adeye.kernel.road import lane_way
from adeye.signals import (
    EGO_HEADING,
    EGO_X,
    EGO_Y,
    OBJECT_ACCELERATION,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
)
from adeye.world.triggers import road_gap

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints


@allocating
def measure_object(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    first: Ints,
    end: Ints,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    states: Floats,
    places: Floats,
    sizes: Floats,
    contact: Ints,
    thing: int,
    distances: Floats,
    gaps: Floats,
) -> None:
    """Measure body distance and signed gap to one object at some rows of B runs.

    Args:
        first: (B,) first row.
        end: (B,) row behind the last.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        states: (B, T, 5) of the object.
        places: (B, T, 6) of the object.
        sizes: (B, 3) of the object.
        contact: (B, T) object that the ego touches, -1 for none.
        thing: Index of the object.
        distances: (B, T) out [m], or (B, 0) if they are not wanted.
        gaps: (B, T) out [m]: ahead > 0, behind < 0, 0 side by side; or (B, 0).
    """
    turns = np.zeros((2, 3))
    for run in range(first.shape[0]):
        turns[:] = math.nan
        own, own_place, state, place = ego[run], ego_place[run], states[run], places[run]
        own_length, own_width = ego_size[run, 0], ego_size[run, 1]
        length, width = sizes[run, 0], sizes[run, 1]
        for row in range(first[run], end[run]):
            x, y, heading = own[row, EGO_X], own[row, EGO_Y], own[row, EGO_HEADING]
            ox, oy, o_heading = (
                state[row, OBJECT_X],
                state[row, OBJECT_Y],
                state[row, OBJECT_HEADING],
            )
            s, os = own_place[row, PLACE_S], place[row, PLACE_S]
            is_finite = are_finite(
                x, y, heading, own[row, OBJECT_SPEED], own[row, OBJECT_ACCELERATION], s,
                own_place[row, PLACE_D], own_place[row, PLACE_HEADING], own_length, own_width,
            ) and are_finite(
                ox, oy, o_heading, state[row, OBJECT_SPEED], state[row, OBJECT_ACCELERATION], os,
                place[row, PLACE_D], place[row, PLACE_HEADING], length, width,
            )  # fmt: skip
            if gaps.shape[1]:
                gaps[run, row] = math.nan
                if is_finite:
                    turn(turns, 0, heading - own_place[row, PLACE_HEADING])
                    turn(turns, 1, o_heading - place[row, PLACE_HEADING])
                    body = on_road(s, 0.0, 0.0, own_length, own_width, turns[0, 1], turns[0, 2])
                    other = on_road(os, 0.0, 0.0, length, width, turns[1, 1], turns[1, 2])
                    apart = lane_way(
                        s, own_place[row, PLACE_HEADING], own_place[row, PLACE_D],
                        os, place[row, PLACE_HEADING],
                    )  # fmt: skip
                    gaps[run, row] = road_gap(apart, body[HALF_LENGTH], other[HALF_LENGTH])
            if distances.shape[1]:
                distances[run, row] = 0.0
                if not is_finite:
                    distances[run, row] = math.nan
                elif contact[run, row] != thing:
                    distances[run, row] = box_distance(
                        x, y, heading, own_length, own_width, ox, oy, o_heading, length, width
                    )
