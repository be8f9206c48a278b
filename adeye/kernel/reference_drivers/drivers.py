"""Reference drivers of UN R157, tick by tick: how much each of them brakes for what it sees.

Each model looks at one other road user and returns a limit of the ego's acceleration: negative
while it brakes, 0 or the release of the pedal while it has not begun to brake, infinity where it
asks for nothing. What a driver remembers is in an array that the caller keeps; zeros are a driver
who has seen nothing yet. The channel that drives a scenario and the evaluation of scenes call the
same functions.

Source:
    UN Regulation 157, 01 series of amendments, annex 4 appendix 3: careful and competent driver
    (``cc``) and fuzzy safety model (``fsm``); Mattas et al. (2020), "Fuzzy surrogate safety metrics
    for real-time assessment of rear-end collision risk"; Shalev-Shwartz, Shammah, Shashua (2017),
    "On a formal model of safe and scalable self-driving cars" (``rss``).

Source:
    UN Regulation 157, 01 series of amendments, paragraph 5.2.5.2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.criticality import (
    required_deceleration,
    rss_lateral_distance,
    rss_longitudinal_distance,
    time_gap,
    time_to_collision,
)
from adeye.kernel.jit import compiled
from adeye.kernel.reference_drivers.parameters import (
    CAME_FROM_SIDE,
    CC,
    CC_CRITICAL_TTC,
    CC_EMERGENCY_BRAKING,
    CC_EMERGENCY_JERK,
    CC_FULL_OVERLAP,
    CC_HEADWAY,
    CC_LEAD_AT_ONCE,
    CC_LEAD_BRAKING,
    CC_PERCEPTION,
    CC_PERCEPTION_WAY,
    CC_WANDERING,
    CUE,
    DECELERATION,
    DELAY,
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
    REG157_LEAD_AT_ONCE,
    REG157_LEAD_BRAKING,
    REG157_LOOKS_AHEAD,
    REG157_RELEASES,
    REG157_RESERVE,
    RSS,
    RSS_ACCELERATION,
    RSS_FLUCTUATION,
    RSS_LATERAL_ACCELERATION,
    RSS_LATERAL_BRAKING,
    RSS_LEAST_BRAKING,
    RSS_MOST_BRAKING,
    RSS_OTHER_ONLY,
)
from adeye.kernel.reference_drivers.reactions import (
    ROUNDING,
    critical_fuzzy_safety,
    cut_in_threshold,
    is_ahead,
    is_lead_at_once,
    is_unknown,
    note_side,
    proactive_fuzzy_safety,
    react,
    respond,
)

# --- The cut-in rule of UN R157 made a driver who brakes as late as it allows ---------------------

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


# --- Reference drivers of UN R157, tick by tick: how much each of them brakes for what it sees ----


@compiled
def _is_dangerous_for_cc(
    view: Floats,
    parameters: Floats,
    state: Floats,
    is_cued: bool,  # noqa: FBT001 - compiled
) -> bool:
    """Tell whether the careful and competent driver would brake, had it evaluated the risk."""
    in_path = view[LATERAL_GAP] <= 0.0
    if in_path and -view[OTHER_ACCELERATION] >= parameters[CC_LEAD_BRAKING] - ROUNDING:
        return True
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    if state[CAME_FROM_SIDE] > 0.0:
        near = time_to_collision(view[GAP], closing) <= parameters[CC_CRITICAL_TTC]
        return near and (in_path or is_cued)
    headway = time_gap(view[GAP], view[EGO_SPEED])
    return in_path and closing > 0.0 and (is_cued or headway <= parameters[CC_HEADWAY])


@compiled
def _has_evaluated(
    view: Floats,
    parameters: Floats,
    state: Floats,
    is_watched: bool,  # noqa: FBT001 - compiled
    step: float,
) -> bool:
    """Tell whether the risk has been evaluated before this tick, and count the tick."""
    way = parameters[CC_PERCEPTION_WAY]
    by_way = way < math.inf and state[CAME_FROM_SIDE] > 0.0
    if by_way and view[CUE] > parameters[CC_WANDERING] + way:
        state[PERCEIVED] = max(state[PERCEIVED], parameters[CC_PERCEPTION])
    evaluated = state[PERCEIVED] >= parameters[CC_PERCEPTION] - ROUNDING
    if not is_watched:
        state[PERCEIVED] = 0.0
    elif not by_way:
        state[PERCEIVED] += step
    return evaluated


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
    if is_unknown(view):
        return math.nan
    note_side(view, state)
    in_path = view[LATERAL_GAP] <= 0.0
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    is_cued = view[CUE] > parameters[CC_WANDERING]
    dangerous = is_ahead(view, parameters) and _is_dangerous_for_cc(
        view, parameters, state, is_cued
    )
    if parameters[CC_LEAD_AT_ONCE] > 0.0:
        dangerous = dangerous or is_lead_at_once(view, parameters, state)
    watched = is_cued or dangerous or (in_path and state[CAME_FROM_SIDE] > 0.0)
    evaluated = _has_evaluated(view, parameters, state, watched, step)
    if dangerous and evaluated:
        state[REACTING] = 1.0
    elif (closing <= 0.0 and view[GAP] > 0.0) or not (in_path or is_cued):
        state[REACTING] = 0.0
        state[DECELERATION] = 0.0
    limit = math.inf
    if state[REACTING] > 0.0:
        limit = respond(parameters, state, parameters[MOST], step)
    emergency = _emergency(view, parameters, state, step)
    return min(limit, -emergency) if emergency > 0.0 else limit


@compiled
def _concerns_fsm(view: Floats, parameters: Floats) -> bool:
    """Tell whether the other is in the path, or will be before the ego has passed it."""
    if not is_ahead(view, parameters):
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
    if is_unknown(view):
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
    return react(parameters, state, wanted > ROUNDING, wanted, step)


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
    if is_unknown(view):
        return math.nan
    is_dangerous = False
    if is_ahead(view, parameters):
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
    return react(parameters, state, is_dangerous, parameters[MOST], step)


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
