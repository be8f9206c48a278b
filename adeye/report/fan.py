"""The trajectories that a channel chose from, as the replay draws them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.report.replay import Candidate, FanView

if TYPE_CHECKING:
    from adeye.trace import Trace

PERIOD: Final = 0.5
"""Time between two fans that are drawn [s]: each tick would make a run ten times as large."""

PLACES: Final = 1
"""Decimals of embedded places: a decimetre, less than a pixel of the view."""

WORTHLESS: Final = 1000.0
"""Cost above the best from which a candidate is not desirable at all: that of a collision."""


def fan_of(trace: Trace, run: int, channel: int, held: Any) -> FanView | None:
    """Return the fans of a channel that are drawn.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        channel: Index of the channel.
        held: (rows,) row of the trace that each row of the replay shows.

    Returns:
        None for a channel that shows none.
    """
    costs = trace["candidate_costs"][run, :, channel]
    if not np.isfinite(costs[held]).any():
        return None
    every = max(1, round(PERIOD / trace.layout.context.step))
    fans = tuple(
        _fan(
            trace["candidates"][run, row, channel],
            costs[row],
            int(trace["chosen"][run, row, channel]),
        )
        for row in held[::every]
    )
    return FanView(every=every, fans=fans)


def _fan(places: Any, costs: Any, chosen: int) -> tuple[Candidate, ...]:
    """List the candidates, the least desirable first and the chosen one last."""
    there = np.isfinite(places).all(axis=(1, 2)) & ~np.isnan(costs)
    least = float(costs[there].min()) if there.any() else 0.0
    rounded = np.round(places.astype(np.float64), PLACES) + 0.0
    order = sorted(np.flatnonzero(there), key=lambda row: (row == chosen, -costs[row], row))
    return tuple(
        Candidate(
            desirability=round(desirability(float(costs[row]), least), 2),
            is_chosen=bool(row == chosen),
            # The first place is that of the ego, which is known.
            points=tuple((float(x), float(y)) for x, y in rounded[row, 1:]),
        )
        for row in order
    )


def desirability(cost: float, least: float) -> float:
    """Return how desirable a candidate is, from 1 for the best down to 0; logarithmic.

    Args:
        cost: Infinity for one that limits of vehicle or road, or others on it, forbid.
        least: Cost of the best.

    >>> desirability(2.0, 2.0), round(desirability(12.0, 2.0), 2), desirability(math.inf, 2.0)
    (1.0, 0.65, 0.0)
    """
    if math.isinf(cost):
        return 0.0
    beyond = cost - least
    return max(0.0, 1.0 - math.log1p(max(0.0, beyond)) / math.log1p(WORTHLESS))
