"""Which places of a trace are on the road, and in a parking bay or rest area."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.refuges import mark_in_refuge, mark_on_road
from adeye.signals import PLACE_D, PLACE_HEADING, PLACE_S

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, RoadMap, SceneContext


def on_road(road: RoadMap, places: Floats) -> Bools:
    """Tell which places are on a lane, the shoulder, a parking bay, rest area or free verge.

    Before the begin of the road and behind its end there is none.

    Args:
        road: Of B runs.
        places: (B, T, 6), see ``signals.PLACE_COLUMNS``; what is no number is not on the road.
    """
    left = road.lanes * road.lane_width
    s, d = places[..., PLACE_S], places[..., PLACE_D]
    marks: Bools = mark_on_road(road.refuges, road.shoulder, road.verge, left, s, d)
    return np.asarray(marks & road.covers(s))


def in_refuge(context: SceneContext, places: Floats, headings: Floats) -> Bools:
    """Tell where the body of the ego is wholly in a parking bay or rest area.

    Args:
        context: Road and size of the ego of B runs.
        places: (B, T, 6) of its centre, see ``signals.PLACE_COLUMNS``.
        headings: (B, T) in the map [rad].
    """
    road, align = context.road, headings - places[..., PLACE_HEADING]
    s, d = places[..., PLACE_S], places[..., PLACE_D]
    marks: Bools = mark_in_refuge(road.refuges, road.shoulder, context.ego_size, s, d, align)
    return marks
