"""Compiled: what the ego demands of who follows it in its path."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.bodies import ALONG, HALF_LENGTH, HALF_WIDTH, D, on_road, turn
from adeye.evaluation.conflict import limited_demand
from adeye.evaluation.metrics.statuses import CODES
from adeye.kernel.criticality import required_deceleration, time_to_collision
from adeye.kernel.jit import allocating
from adeye.kernel.road import lane_way
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    OBJECT_HEADING,
    OBJECT_SPEED,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
    Floats,
    Ints,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Codes = NDArray[np.int8]

REAR_TTC, REAR_DEMAND = range(2)

_VALUE: Final = CODES["value"]
_FREE: Final = CODES["no_conflict"]
_UNDEFINED: Final = CODES["undefined"]
_ERROR: Final = CODES["error"]


@allocating
def worst_followers(  # noqa: C901, PLR0913, PLR0917 - a kernel over the whole scene
    length: Ints,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    objects: Floats,
    places: Floats,
    sizes: Floats,
    contact: Ints,
    gaps: Floats,
    values: Floats,
    rows: Ints,
    actors: Ints,
    codes: Codes,
) -> None:
    """Find the worst of who follows the ego in B runs, the earliest among equals.

    Somebody follows who is behind the ego along the road, whose extent across it overlaps the
    ego's, with a gap, and who drives the same way.

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
        values: (2, B) out: time to collision [s], required deceleration [m/s²].
        rows: (2, B) out.
        actors: (2, B) out.
        codes: (2, B) out: index into the statuses of metrics.
    """
    turns = np.zeros((objects.shape[2] + 1, 3))
    for run in range(length.shape[0]):
        turns[:] = math.nan
        values[REAR_TTC, run], values[REAR_DEMAND, run] = math.inf, -math.inf
        rows[:, run], actors[:, run] = 0, -1
        codes[:, run] = _UNDEFINED
        for row in range(length[run]):
            if math.isnan(gaps[run, row]):
                codes[:, run] = _ERROR
                break
            if contact[run, row] >= 0:
                continue
            if codes[REAR_TTC, run] == _UNDEFINED:
                codes[:, run] = _FREE
            s, d = ego_place[run, row, PLACE_S], ego_place[run, row, PLACE_D]
            most = 0.5 * (ego_size[run, 0] + ego_size[run, 1])
            for thing in range(objects.shape[2]):
                behind = s - places[run, row, thing, PLACE_S]
                beside = places[run, row, thing, PLACE_D] - d
                wide = most + 0.5 * (sizes[run, thing, 0] + sizes[run, thing, 1])
                if behind <= 0.0 or abs(beside) >= wide:
                    continue
                turn(turns, 0, ego[run, row, EGO_HEADING] - ego_place[run, row, PLACE_HEADING])
                turned = objects[run, row, thing, OBJECT_HEADING]
                turn(turns, thing + 1, turned - places[run, row, thing, PLACE_HEADING])
                own = on_road(
                    s, d, ego[run, row, EGO_SPEED], ego_size[run, 0], ego_size[run, 1],
                    turns[0, 1], turns[0, 2],
                )  # fmt: skip
                other = on_road(
                    s - behind, d + beside, objects[run, row, thing, OBJECT_SPEED],
                    sizes[run, thing, 0], sizes[run, thing, 1], turns[thing + 1, 1],
                    turns[thing + 1, 2],
                )  # fmt: skip
                # The follower drives the gap, so that it is as long as on the follower's lane.
                there = places[run, row, thing]
                apart = lane_way(
                    there[PLACE_S], there[PLACE_HEADING], there[PLACE_D],
                    s, ego_place[run, row, PLACE_HEADING],
                )  # fmt: skip
                gap = apart - own[HALF_LENGTH] - other[HALF_LENGTH]
                apart = abs(other[D] - own[D]) - own[HALF_WIDTH] - other[HALF_WIDTH]
                if gap <= 0.0 or apart >= 0.0 or other[ALONG] <= 0.0:
                    continue
                ttc = time_to_collision(gap, other[ALONG] - own[ALONG])
                if ttc < values[REAR_TTC, run]:
                    values[REAR_TTC, run] = ttc
                    rows[REAR_TTC, run], actors[REAR_TTC, run] = row, thing
                    codes[REAR_TTC, run] = _VALUE
                slowing = ego[run, row, EGO_ACCELERATION] * turns[0, 2]
                ahead = max(own[ALONG], 0.0)
                demand = limited_demand(required_deceleration(gap, other[ALONG], ahead, slowing))
                if demand > values[REAR_DEMAND, run]:
                    values[REAR_DEMAND, run] = demand
                    rows[REAR_DEMAND, run], actors[REAR_DEMAND, run] = row, thing
                    codes[REAR_DEMAND, run] = _VALUE
