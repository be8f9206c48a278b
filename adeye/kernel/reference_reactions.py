"""What the reference drivers share: what is ahead, the delay, the ramp, the end of a danger."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled
from adeye.kernel.reference_columns import (
    BESIDE,
    CAME_FROM_SIDE,
    COASTING,
    DECELERATION,
    DELAY,
    DELAYED,
    EGO_SPEED,
    GAP,
    JERK,
    LATERAL_GAP,
    LENGTHS,
    OTHER_ACCELERATION,
    OTHER_SPEED,
    REACTING,
    VIEW_SIZE,
)

__all__ = ["ROUNDING", "is_ahead", "is_lead_at_once", "is_unknown", "note_side", "react", "respond"]

Floats = NDArray[np.float64]

# Sums of steps may miss a time by their rounding, differences a deceleration or nothing.
ROUNDING: Final = 1e-9


@compiled
def is_unknown(view: Floats) -> bool:
    """Tell whether something that is seen is no number."""
    total = 0.0
    for column in range(VIEW_SIZE):
        total += 0.0 * view[column]
    return math.isnan(total)


@compiled
def is_ahead(view: Floats, parameters: Floats) -> bool:
    """Tell whether the other is ahead of the ego, or as far beside it as counts."""
    return view[GAP] >= -parameters[BESIDE] * view[LENGTHS]


@compiled
def note_side(view: Floats, state: Floats) -> None:
    """Note whether the other is one that cuts in; who is no longer nearer is a lead."""
    if view[LATERAL_GAP] > 0.0:
        state[CAME_FROM_SIDE] = 1.0
    elif view[EGO_SPEED] <= view[OTHER_SPEED]:
        state[CAME_FROM_SIDE] = 0.0


@compiled
def is_lead_at_once(view: Floats, parameters: Floats, state: Floats) -> bool:
    """Tell whether a lead brakes or closes in, or did so since: the answer goes to standstill."""
    if view[LATERAL_GAP] > 0.0 or state[CAME_FROM_SIDE] > 0.0 or not is_ahead(view, parameters):
        return False
    closes = view[EGO_SPEED] - view[OTHER_SPEED] > ROUNDING
    return closes or view[OTHER_ACCELERATION] < -ROUNDING or state[REACTING] > 0.0


@compiled
def respond(parameters: Floats, state: Floats, most: float, step: float) -> float:
    """Return the acceleration of one tick of a driver who has decided to brake [m/s^2]."""
    if state[DELAYED] < parameters[DELAY] - ROUNDING:
        state[DELAYED] += step
        state[DECELERATION] = parameters[COASTING]
    else:
        state[DECELERATION] = min(state[DECELERATION] + parameters[JERK] * step, most)
    return 0.0 - state[DECELERATION]


@compiled
def react(
    parameters: Floats,
    state: Floats,
    is_dangerous: bool,  # noqa: FBT001 - compiled
    most: float,
    step: float,
) -> float:
    """Return the limit of a driver who brakes as long as there is danger, and no longer.

    How hard it braked is remembered: a danger that flickers is no new ramp each time.
    """
    if is_dangerous:
        state[REACTING] = 1.0
        return respond(parameters, state, most, step)
    state[REACTING] = 0.0
    return math.inf
