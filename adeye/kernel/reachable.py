"""How far ahead of the ego an object matters: as far as the ego gets before it can stand."""

from __future__ import annotations

from typing import Final

from adeye.kernel.criticality import stopping_distance
from adeye.kernel.jit import compiled
from adeye.kernel.motion import GRAVITY

REACTION_TIME: Final = 1.0
"""From what is there to full braking [s]: sensing, deciding, building up pressure. Our choice."""

BRAKING: Final = 6.0
"""Deceleration of an emergency stop on a dry road [m/s²], as UN R157, 5.2.5.2 takes it."""


@compiled
def reachable_distance(speed: float, friction: float) -> float:
    """Way ahead that the ego covers whatever it does: reaction at its speed, then braking [m].

    Args:
        speed: Of the ego [m/s].
        friction: Tyre-road friction coefficient, which limits the braking.

    Returns:
        ``speed reaction + speed**2 / (2 min(braking, friction g))``.

    Source:
        Stopping sight distance as of road design (AASHTO, A policy on geometric design of highways
        and streets, 3.2.2), with the values above for a driver's.

    >>> reachable_distance(12.0, 1.0), round(reachable_distance(12.0, 0.3), 1)
    (24.0, 36.5)
    """
    return stopping_distance(speed, REACTION_TIME, min(BRAKING, friction * GRAVITY))
