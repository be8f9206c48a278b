"""The cut-in rule of UN R157 made a driver who brakes as late as it allows.

Source:
    UN Regulation 157, 01 series of amendments, paragraph 5.2.5.2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.criticality import required_deceleration, time_to_collision
from adeye.kernel.jit import compiled
from adeye.kernel.reference_columns import (
    DELAY,
    EGO_SPEED,
    GAP,
    INTRUSION,
    LATERAL_GAP,
    MOST,
    OTHER_ACCELERATION,
    OTHER_SPEED,
    REACTING,
    REG157_GUARD,
    REG157_INTRUSION,
    REG157_LATERAL_GAP,
    REG157_LEAD_AT_ONCE,
    REG157_LEAD_BRAKING,
    REG157_LOOKS_AHEAD,
    REG157_RELEASES,
    REG157_RESERVE,
)
from adeye.kernel.reference_distances import cut_in_threshold
from adeye.kernel.reference_reactions import (
    ROUNDING,
    is_ahead,
    is_lead_at_once,
    is_unknown,
    note_side,
    react,
)

__all__ = ["reg157_limit"]

Floats = NDArray[np.float64]


@compiled
def _brakes_too_hard(view: Floats, parameters: Floats, step: float) -> bool:
    """Tell whether a lead that brakes on would ask the cut-in rule for all of its braking."""
    braking = -view[OTHER_ACCELERATION]
    if braking <= 0.0:
        return False
    if braking >= parameters[REG157_LEAD_BRAKING] - ROUNDING:
        return True
    time = parameters[DELAY] + parameters[REG157_GUARD] + parameters[REG157_LOOKS_AHEAD] * step
    speed = view[OTHER_SPEED]
    rolling = min(time, speed / braking)
    room = view[GAP] + rolling * (speed - 0.5 * braking * rolling) - view[EGO_SPEED] * time
    required = required_deceleration(
        room, view[EGO_SPEED], max(speed - braking * time, 0.0), -braking
    )
    return required >= parameters[MOST]


@compiled
def reg157_limit(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the acceleration that the cut-in rule of paragraph 5.2.5.2 allows [m/s^2].

    The rule is made a driver who brakes as late as it allows: in the last tick whose TTC is above
    the threshold, for a vehicle that has intruded into the lane. Of a lead that brakes, it is
    counted that it brakes on; one that brakes hard is answered at once.

    Args:
        view: What it sees, shape (VIEW_SIZE,).
        parameters: ``CutInRule.vector()``.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing, NaN if something in the view is.
    """
    if is_unknown(view):
        return math.nan
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    is_in = (
        view[LATERAL_GAP] <= parameters[REG157_LATERAL_GAP]
        or view[INTRUSION] >= parameters[REG157_INTRUSION]
    )
    is_dangerous = False
    if is_in and is_ahead(view, parameters) and closing > 0.0:
        threshold = cut_in_threshold(closing, parameters[REG157_RESERVE], parameters[MOST])
        # A TTC at constant speeds is one step shorter in the next tick, which would be too late.
        late = time_to_collision(view[GAP], closing) - parameters[REG157_LOOKS_AHEAD] * step
        keeps = state[REACTING] > 0.0 and parameters[REG157_RELEASES] == 0.0
        is_dangerous = late <= threshold + parameters[REG157_GUARD] or keeps
    if view[LATERAL_GAP] <= 0.0 and is_ahead(view, parameters):
        is_dangerous = is_dangerous or _brakes_too_hard(view, parameters, step)
    if parameters[REG157_LEAD_AT_ONCE] > 0.0:
        note_side(view, state)
        is_dangerous = is_dangerous or is_lead_at_once(view, parameters, state)
    return react(parameters, state, is_dangerous, parameters[MOST], step)
