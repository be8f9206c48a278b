"""Compiled: how far away sensors have who comes from behind in the next lane."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.bodies import are_finite
from adeye.evaluation.metrics.scans import ERROR, NOT_APPLICABLE, VALUE
from adeye.kernel.jit import allocating, inlined
from adeye.kernel.road import lane_way
from adeye.signals import (
    EGO_SPEED,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats, Ints

    Codes = NDArray[np.int8]

REAR_RESPONSE: Final = 0.4
REAR_BRAKING: Final = 3.0
REAR_TIME_GAP: Final = 1.0
"""What UN R79, 5.6.4.7 grants who comes from behind when the ego changes
lanes: 0.4 s to respond, 3 m/s² of braking, and at its end 1 s of the ego's speed as distance."""

NEXT_LANE: Final = 1.5
"""Lateral distance of centres up to which a vehicle is in the next lane [lane widths]."""


@allocating
def rear_margins(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    length: Ints,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    objects: Floats,
    places: Floats,
    sizes: Floats,
    lane_width: Floats,
    detected: Bools,
    sensors: Ints,
) -> tuple[Floats, Ints, Ints, Codes]:
    """Find who comes from behind in the next lane and is seen latest for what a lane change needs.

    Whoever is nearer than that from the start does not count: no sensor could have seen it.

    Args:
        length: (B,) rows that a run has.
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        objects: (B, T, M, 5).
        places: (B, T, M, 6).
        sizes: (B, M, 3).
        lane_width: (B,) [m].
        detected: (B, T, S, M).
        sensors: Those that count.

    Returns:
        Distance behind the ego at the first detection less the critical one (B,) [m], with 0 for
        the distance of who is never detected while behind; rows (B,), objects (B,), statuses (B,).
    """
    runs = length.shape[0]
    margins, rows = np.full(runs, math.inf), np.zeros(runs, dtype=np.int64)
    worst = np.full(runs, -1, dtype=np.int64)
    codes = np.full(runs, NOT_APPLICABLE, dtype=np.int8)
    for run in range(runs):
        for thing in range(objects.shape[2]):
            could_be_seen = is_seen = False
            margin, last = math.inf, 0
            for row in range(length[run] - 1):
                behind, critical = _approach(
                    ego[run, row], ego_place[run, row], ego_size[run], objects[run, row, thing],
                    places[run, row, thing], sizes[run, thing], lane_width[run],
                )  # fmt: skip
                if math.isnan(behind):
                    codes[run] = ERROR
                    break
                for place in range(sensors.shape[0]):
                    is_seen |= detected[run, row, sensors[place], thing]
                if behind <= 0.0:
                    continue
                could_be_seen |= behind > critical
                margin, last = -critical, row
                if is_seen:
                    margin = behind - critical
                    break
            if could_be_seen and margin < margins[run]:
                margins[run], rows[run], worst[run] = margin, last, thing
        if worst[run] >= 0 and sensors.shape[0] > 0 and codes[run] != ERROR:
            codes[run] = VALUE
    return margins, rows, worst, codes


@inlined
def _approach(  # noqa: PLR0913, PLR0917 - a part of the kernel
    own: Floats,
    place: Floats,
    size: Floats,
    other: Floats,
    other_place: Floats,
    other_size: Floats,
    lane_width: float,
) -> tuple[float, float]:
    """Return how far behind the ego somebody faster in the next lane is, and what is critical [m].

    Returns:
        The distance along the lane of the other, 0 for everybody else, NaN with a number that is
        not finite; and the critical distance of ``REAR_RESPONSE`` and its fellows.
    """
    if not are_finite(
        own[EGO_SPEED], place[PLACE_S], place[PLACE_D], size[0], size[1],
        other[OBJECT_SPEED], other_place[PLACE_S], other_place[PLACE_D], other_size[0],
        other[OBJECT_X] + other[OBJECT_Y] + other[OBJECT_HEADING] + other_size[1],
    ):  # fmt: skip
        return math.nan, math.nan
    # Who comes from behind drives the way, so that it is as long as on that lane.
    behind = lane_way(
        other_place[PLACE_S], other_place[PLACE_HEADING], other_place[PLACE_D],
        place[PLACE_S], place[PLACE_HEADING],
    ) - 0.5 * (size[0] + other_size[0])  # fmt: skip
    beside = abs(place[PLACE_D] - other_place[PLACE_D])
    closing = other[OBJECT_SPEED] - own[EGO_SPEED]
    is_next = 0.5 * (size[1] + other_size[1]) <= beside < NEXT_LANE * lane_width
    if behind <= 0.0 or closing <= 0.0 or not is_next:
        return 0.0, 0.0
    braked = closing * closing / (2.0 * REAR_BRAKING)
    return behind, closing * REAR_RESPONSE + braked + own[EGO_SPEED] * REAR_TIME_GAP
