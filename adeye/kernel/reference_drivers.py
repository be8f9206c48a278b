"""Reference drivers of UN R157, tick by tick: how much each of them brakes for what it sees.

Each model looks at one other road user and returns a limit of the ego's acceleration: negative
while it brakes, 0 or the release of the pedal while it has not begun to brake, infinity where it
asks for nothing. What a driver remembers is in an array that the caller keeps; zeros are a driver
who has seen nothing yet. The channel that drives a scenario and the evaluation of scenes call the
same functions.

Source:
    UN Regulation 157, 01 series of amendments: paragraph 5.2.5.2 (``reg157``), annex 4 appendix 3,
    careful and competent driver (``cc``) and fuzzy safety model (``fsm``); Mattas et al. (2020),
    "Fuzzy surrogate safety metrics for real-time assessment of rear-end collision risk";
    Shalev-Shwartz, Shammah, Shashua (2017), "On a formal model of safe and scalable self-driving
    cars" (``rss``).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.criticality import required_deceleration, time_gap, time_to_collision
from adeye.kernel.fuzzy_safety import critical_fuzzy_safety, proactive_fuzzy_safety
from adeye.kernel.jit import compiled
from adeye.kernel.reference_columns import (
    BESIDE,
    CAME_FROM_SIDE,
    CC,
    CC_CRITICAL_TTC,
    CC_EMERGENCY_BRAKING,
    CC_EMERGENCY_JERK,
    CC_FULL_OVERLAP,
    CC_HEADWAY,
    CC_LEAD_BRAKING,
    CC_PERCEPTION,
    CC_WANDERING,
    COASTING,
    CUE,
    DECELERATION,
    DELAY,
    DELAYED,
    EGO_ACCELERATION,
    EGO_SPEED,
    EMERGENCY,
    FSM,
    FSM_COMFORTABLE,
    FSM_LATERAL_GUARD,
    FSM_LEAD_BRAKING,
    FSM_MARGIN,
    FSM_RAW_ACCELERATION,
    GAP,
    INTRUSION,
    JERK,
    LATERAL_GAP,
    LATERAL_SPEED,
    LENGTHS,
    MOST,
    OTHER_ACCELERATION,
    OTHER_SPEED,
    OVERLAP,
    PERCEIVED,
    REACTING,
    REG157,
    REG157_GUARD,
    REG157_INTRUSION,
    REG157_LATERAL_GAP,
    REG157_LEAD_BRAKING,
    REG157_LOOKS_AHEAD,
    RSS,
    RSS_ACCELERATION,
    RSS_FLUCTUATION,
    RSS_LATERAL_ACCELERATION,
    RSS_LATERAL_BRAKING,
    RSS_LEAST_BRAKING,
    RSS_MOST_BRAKING,
    RSS_OTHER_ONLY,
    VIEW_SIZE,
)
from adeye.kernel.reference_distances import cut_in_threshold
from adeye.kernel.rss import rss_lateral_distance, rss_longitudinal_distance

__all__ = [
    "cc_limit",
    "fsm_limit",
    "reference_limit",
    "reg157_limit",
    "rss_limit",
]

Floats = NDArray[np.float64]

# Sums of steps may miss a time by their rounding, differences a deceleration or nothing.
_ROUNDING: Final = 1e-9


@compiled
def _is_unknown(view: Floats) -> bool:
    """Tell whether something that is seen is no number."""
    total = 0.0
    for column in range(VIEW_SIZE):
        total += 0.0 * view[column]
    return math.isnan(total)


@compiled
def _is_ahead(view: Floats, parameters: Floats) -> bool:
    return view[GAP] >= -parameters[BESIDE] * view[LENGTHS]


@compiled
def _respond(parameters: Floats, state: Floats, most: float, step: float) -> float:
    """Return the acceleration of one tick of a driver who has decided to brake [m/s^2]."""
    if state[DELAYED] < parameters[DELAY] - _ROUNDING:
        state[DELAYED] += step
        state[DECELERATION] = parameters[COASTING]
    else:
        state[DECELERATION] = min(state[DECELERATION] + parameters[JERK] * step, most)
    return 0.0 - state[DECELERATION]


@compiled
def _is_dangerous_for_cc(
    view: Floats,
    parameters: Floats,
    state: Floats,
    is_cued: bool,  # noqa: FBT001 - compiled
) -> bool:
    """Tell whether the careful and competent driver would brake, had it evaluated the risk."""
    in_path = view[LATERAL_GAP] <= 0.0
    if in_path and -view[OTHER_ACCELERATION] >= parameters[CC_LEAD_BRAKING] - _ROUNDING:
        return True
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    if state[CAME_FROM_SIDE] > 0.0:
        near = time_to_collision(view[GAP], closing) <= parameters[CC_CRITICAL_TTC]
        return near and (in_path or is_cued)
    headway = time_gap(view[GAP], view[EGO_SPEED])
    return in_path and closing > 0.0 and (is_cued or headway <= parameters[CC_HEADWAY])


@compiled
def _emergency(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the deceleration of the automatic emergency braking after a cut-in [m/s^2]."""
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    near = time_to_collision(view[GAP], closing) <= parameters[CC_CRITICAL_TTC]
    wrapped = view[OVERLAP] >= parameters[CC_FULL_OVERLAP]
    if state[CAME_FROM_SIDE] > 0.0 and wrapped and near and closing > 0.0:
        begun = max(state[EMERGENCY], state[DECELERATION])
        grown = begun + parameters[CC_EMERGENCY_JERK] * step
        state[EMERGENCY] = min(grown, parameters[CC_EMERGENCY_BRAKING])
    else:
        state[EMERGENCY] = 0.0
    return state[EMERGENCY]


@compiled
def cc_limit(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the acceleration that the careful and competent driver allows [m/s^2].

    It evaluates a vehicle that leaves the zone in which vehicles wander in their lane, and brakes
    for one that cuts in once the TTC is critical, for one that a cut-out reveals at once. For a
    lead in its lane it brakes when that brakes hard, or when it closes in within the driver's own
    headway; the regulation says no more than the former. It brakes until the other is ahead and the
    gap stops closing.

    Args:
        view: What it sees, shape (VIEW_SIZE,).
        parameters: ``CarefulDriver.vector()``.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing, NaN if something in the view is.
    """
    if _is_unknown(view):
        return math.nan
    in_path = view[LATERAL_GAP] <= 0.0
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    if not in_path:
        state[CAME_FROM_SIDE] = 1.0
    elif closing <= 0.0:
        state[CAME_FROM_SIDE] = 0.0
    is_cued = view[CUE] > parameters[CC_WANDERING]
    dangerous = _is_ahead(view, parameters) and _is_dangerous_for_cc(
        view, parameters, state, is_cued
    )
    watched = is_cued or dangerous or (in_path and state[CAME_FROM_SIDE] > 0.0)
    evaluated = state[PERCEIVED] >= parameters[CC_PERCEPTION] - _ROUNDING
    state[PERCEIVED] = state[PERCEIVED] + step if watched else 0.0
    if dangerous and evaluated:
        state[REACTING] = 1.0
    elif (closing <= 0.0 and view[GAP] > 0.0) or not (in_path or is_cued):
        state[REACTING] = 0.0
        state[DECELERATION] = 0.0
    limit = math.inf
    if state[REACTING] > 0.0:
        limit = _respond(parameters, state, parameters[MOST], step)
    emergency = _emergency(view, parameters, state, step)
    return min(limit, -emergency) if emergency > 0.0 else limit


@compiled
def _concerns_fsm(view: Floats, parameters: Floats) -> bool:
    """Tell whether the other is in the path, or will be before the ego has passed it."""
    if not _is_ahead(view, parameters):
        return False
    if view[LATERAL_GAP] <= 0.0:
        return True
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    if view[LATERAL_SPEED] <= 0.0 or closing <= 0.0:
        return False
    passed = (view[GAP] + view[LENGTHS]) / closing
    return view[LATERAL_GAP] / view[LATERAL_SPEED] < passed + parameters[FSM_LATERAL_GUARD]


@compiled
def fsm_limit(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the acceleration that the fuzzy safety model allows [m/s^2].

    Args:
        view: What it sees, shape (VIEW_SIZE,).
        parameters: ``FuzzyDriver.vector()``.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing, NaN if something in the view is.
    """
    if _is_unknown(view):
        return math.nan
    wanted = 0.0
    if _concerns_fsm(view, parameters):
        comfortable = parameters[FSM_COMFORTABLE]
        critical = critical_fuzzy_safety(
            view[GAP],
            view[EGO_SPEED],
            view[OTHER_SPEED],
            view[EGO_ACCELERATION],
            parameters[DELAY],
            comfortable,
            parameters[MOST],
            parameters[FSM_RAW_ACCELERATION] > 0.0,
        )
        if critical > 0.0:
            wanted = comfortable + critical * (parameters[MOST] - comfortable)
        else:
            wanted = comfortable * proactive_fuzzy_safety(
                view[GAP],
                view[EGO_SPEED],
                view[OTHER_SPEED],
                parameters[DELAY],
                comfortable,
                parameters[MOST],
                parameters[FSM_LEAD_BRAKING],
                parameters[FSM_MARGIN],
            )
    # At its own distance, only rounding makes this model want to brake.
    return _react(parameters, state, wanted > _ROUNDING, wanted, step)


@compiled
def _react(
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
        return _respond(parameters, state, most, step)
    state[REACTING] = 0.0
    return math.inf


@compiled
def rss_limit(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the acceleration that responsibility-sensitive safety allows [m/s^2].

    The situation is dangerous when both the longitudinal and the lateral distance are too short;
    after the response time the ego brakes until one of them is long enough.

    Args:
        view: What it sees, shape (VIEW_SIZE,).
        parameters: ``ResponsibleDriver.vector()``.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing, NaN if something in the view is.
    """
    if _is_unknown(view):
        return math.nan
    is_dangerous = False
    if _is_ahead(view, parameters):
        only = parameters[RSS_OTHER_ONLY] > 0.0
        lateral = rss_lateral_distance(
            abs(view[LATERAL_SPEED]) if only else view[LATERAL_SPEED],
            0.0,
            parameters[DELAY],
            0.0 if only else parameters[DELAY],
            parameters[RSS_LATERAL_ACCELERATION],
            parameters[RSS_LATERAL_BRAKING],
            parameters[RSS_FLUCTUATION],
        )
        is_dangerous = view[LATERAL_GAP] < lateral and view[GAP] < rss_longitudinal_distance(
            view[EGO_SPEED],
            view[OTHER_SPEED],
            parameters[DELAY],
            parameters[RSS_ACCELERATION],
            parameters[RSS_LEAST_BRAKING],
            parameters[RSS_MOST_BRAKING],
        )
    return _react(parameters, state, is_dangerous, parameters[MOST], step)


@compiled
def _brakes_too_hard(view: Floats, parameters: Floats, step: float) -> bool:
    """Tell whether a lead that brakes on would ask the cut-in rule for all of its braking."""
    braking = -view[OTHER_ACCELERATION]
    if braking <= 0.0:
        return False
    if braking >= parameters[REG157_LEAD_BRAKING] - _ROUNDING:
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
    if _is_unknown(view):
        return math.nan
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    is_in = (
        view[LATERAL_GAP] <= parameters[REG157_LATERAL_GAP]
        or view[INTRUSION] >= parameters[REG157_INTRUSION]
    )
    is_dangerous = False
    if is_in and _is_ahead(view, parameters) and closing > 0.0:
        threshold = cut_in_threshold(closing, parameters[DELAY], parameters[MOST])
        # A TTC at constant speeds is one step shorter in the next tick, which would be too late.
        late = time_to_collision(view[GAP], closing) - parameters[REG157_LOOKS_AHEAD] * step
        is_dangerous = late <= threshold + parameters[REG157_GUARD] or state[REACTING] > 0.0
    if view[LATERAL_GAP] <= 0.0 and _is_ahead(view, parameters):
        is_dangerous = is_dangerous or _brakes_too_hard(view, parameters, step)
    return _react(parameters, state, is_dangerous, parameters[MOST], step)


@compiled
def reference_limit(
    model: int, view: Floats, parameters: Floats, state: Floats, step: float
) -> float:
    """Return the acceleration that one of the reference drivers allows [m/s^2].

    Args:
        model: CC, FSM, RSS or REG157.
        view: What it sees, shape (VIEW_SIZE,).
        parameters: ``vector()`` of its parameters.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing, NaN if something in the view is or the model is none.
    """
    if model == CC:
        return cc_limit(view, parameters, state, step)
    if model == FSM:
        return fsm_limit(view, parameters, state, step)
    if model == RSS:
        return rss_limit(view, parameters, state, step)
    if model == REG157:
        return reg157_limit(view, parameters, state, step)
    return math.nan
