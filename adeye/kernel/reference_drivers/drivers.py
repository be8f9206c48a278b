"""Reference drivers of UN R157, tick by tick: how much each of them brakes for what it sees.

Each model looks at one other road user and returns a limit of the ego's acceleration: negative
while it brakes, 0 or the release of the pedal while it has not begun to brake, infinity where it
asks for nothing. What a driver remembers is in an array that the caller keeps; zeros are a driver
who has seen nothing yet. The channel that drives a scenario and the evaluation of scenes call the
same functions.

Their numbers follow from an edition of the rules, which is a legal text, and from variants. A
variant is a difference between that text and published code, each with a name of its own: of the
European Commission's Joint Research Centre (JRC-FSM), and of esmini, which is written after it.
``jrc`` and ``esmini`` are all of one.

In the scenes two or three vehicles drive on a straight road; the ego keeps its speed unless the
driver brakes, and nobody evades sideways. A scene is a row of numbers, so a grid of scenes is one
array, and each is evaluated by itself: the same bits in any order and number of threads.

Source:
    UN Regulation 157, 01 series of amendments, paragraph 5.2.5.2 (``reg157``) and annex 4 appendix
    3: careful and competent driver (``cc``), fuzzy safety model (``fsm``), parameters of the three
    scenarios; Mattas et al. (2020), "Fuzzy surrogate safety metrics for real-time assessment of
    rear-end collision risk"; Shalev-Shwartz, Shammah, Shashua (2017), "On a formal model of safe
    and scalable self-driving cars" (``rss``).
"""

from __future__ import annotations

import math
from typing import Final

from adeye.kernel.criticality import (
    required_deceleration,
    rss_lateral_distance,
    rss_longitudinal_distance,
    time_gap,
    time_to_collision,
)
from adeye.kernel.jit import compiled
from adeye.kernel.reference_drivers import reactions as columns
from adeye.kernel.reference_drivers.reactions import (
    Floats,
    critical_fuzzy_safety,
    cut_in_threshold,
    following_distance,
    is_ahead,
    is_lead_at_once,
    is_unknown,
    note_side,
    proactive_fuzzy_safety,
    react,
    respond,
)

# --- Reference drivers of UN R157, tick by tick: how much each of them brakes for what it sees ----


@compiled
def _is_dangerous_for_cc(
    view: Floats,
    parameters: Floats,
    state: Floats,
    is_cued: bool,  # noqa: FBT001 - compiled
) -> bool:
    """Tell whether the careful and competent driver would brake, had it evaluated the risk."""
    in_path = view[columns.LATERAL_GAP] <= 0.0
    if (
        in_path
        and -view[columns.OTHER_ACCELERATION]
        >= parameters[columns.CC_LEAD_BRAKING] - columns.ROUNDING
    ):
        return True
    closing = view[columns.EGO_SPEED] - view[columns.OTHER_SPEED]
    if state[columns.CAME_FROM_SIDE] > 0.0:
        near = time_to_collision(view[columns.GAP], closing) <= parameters[columns.CC_CRITICAL_TTC]
        return near and (in_path or is_cued)
    headway = time_gap(view[columns.GAP], view[columns.EGO_SPEED])
    return in_path and closing > 0.0 and (is_cued or headway <= parameters[columns.CC_HEADWAY])


@compiled
def _has_evaluated(
    view: Floats,
    parameters: Floats,
    state: Floats,
    is_watched: bool,  # noqa: FBT001 - compiled
    step: float,
) -> bool:
    """Tell whether the risk has been evaluated before this tick, and count the tick."""
    way = parameters[columns.CC_PERCEPTION_WAY]
    by_way = way < math.inf and state[columns.CAME_FROM_SIDE] > 0.0
    if by_way and view[columns.CUE] > parameters[columns.CC_WANDERING] + way:
        state[columns.PERCEIVED] = max(state[columns.PERCEIVED], parameters[columns.CC_PERCEPTION])
    evaluated = state[columns.PERCEIVED] >= parameters[columns.CC_PERCEPTION] - columns.ROUNDING
    if not is_watched:
        state[columns.PERCEIVED] = 0.0
    elif not by_way:
        state[columns.PERCEIVED] += step
    return evaluated


@compiled
def _emergency(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the deceleration of the automatic emergency braking after a cut-in [m/s^2]."""
    closing = view[columns.EGO_SPEED] - view[columns.OTHER_SPEED]
    near = time_to_collision(view[columns.GAP], closing) <= parameters[columns.CC_CRITICAL_TTC]
    wrapped = view[columns.OVERLAP] >= parameters[columns.CC_FULL_OVERLAP]
    if state[columns.CAME_FROM_SIDE] > 0.0 and wrapped and near and closing > 0.0:
        begun = max(state[columns.EMERGENCY], state[columns.DECELERATION])
        grown = begun + parameters[columns.CC_EMERGENCY_JERK] * step
        state[columns.EMERGENCY] = min(grown, parameters[columns.CC_EMERGENCY_BRAKING])
    else:
        state[columns.EMERGENCY] = 0.0
    return state[columns.EMERGENCY]


@compiled
def cc_limit(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the acceleration that the careful and competent driver allows [m/s^2].

    It evaluates a vehicle that leaves the zone in which vehicles wander in their lane, and brakes
    for one that cuts in once the TTC is critical, for one that a cut-out reveals at once. For a
    lead in its lane it brakes when that brakes hard, or when it closes in within the driver's own
    headway; the regulation says no more than the former. It brakes until the other is ahead and the
    gap stops closing.

    Args:
        view: What it sees, shape (VIEW_SIZE,), all known.
        parameters: ``CarefulDriver.vector()``.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing.
    """
    note_side(view, state)
    in_path = view[columns.LATERAL_GAP] <= 0.0
    closing = view[columns.EGO_SPEED] - view[columns.OTHER_SPEED]
    is_cued = view[columns.CUE] > parameters[columns.CC_WANDERING]
    dangerous = is_ahead(view, parameters) and _is_dangerous_for_cc(
        view, parameters, state, is_cued
    )
    if parameters[columns.CC_LEAD_AT_ONCE] > 0.0:
        dangerous = dangerous or is_lead_at_once(view, parameters, state)
    watched = is_cued or dangerous or (in_path and state[columns.CAME_FROM_SIDE] > 0.0)
    evaluated = _has_evaluated(view, parameters, state, watched, step)
    if dangerous and evaluated:
        state[columns.REACTING] = 1.0
    elif (closing <= 0.0 and view[columns.GAP] > 0.0) or not (in_path or is_cued):
        state[columns.REACTING] = 0.0
        state[columns.DECELERATION] = 0.0
    limit = math.inf
    if state[columns.REACTING] > 0.0:
        limit = respond(parameters, state, parameters[columns.MOST], step)
    emergency = _emergency(view, parameters, state, step)
    return min(limit, -emergency) if emergency > 0.0 else limit


@compiled
def _concerns_fsm(view: Floats, parameters: Floats) -> bool:
    """Tell whether the other is in the path, or will be before the ego has passed it."""
    if not is_ahead(view, parameters):
        return False
    if view[columns.LATERAL_GAP] <= 0.0:
        return True
    closing = view[columns.EGO_SPEED] - view[columns.OTHER_SPEED]
    if view[columns.LATERAL_SPEED] <= 0.0 or closing <= 0.0:
        return False
    passed = (view[columns.GAP] + view[columns.LENGTHS]) / closing
    return (
        view[columns.LATERAL_GAP] / view[columns.LATERAL_SPEED]
        < passed + parameters[columns.FSM_LATERAL_GUARD]
    )


@compiled
def fsm_limit(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the acceleration that the fuzzy safety model allows [m/s^2].

    Args:
        view: What it sees, shape (VIEW_SIZE,), all known.
        parameters: ``FuzzyDriver.vector()``.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing.
    """
    wanted = 0.0
    if _concerns_fsm(view, parameters):
        comfortable = parameters[columns.FSM_COMFORTABLE]
        critical = critical_fuzzy_safety(
            view[columns.GAP],
            view[columns.EGO_SPEED],
            view[columns.OTHER_SPEED],
            view[columns.EGO_ACCELERATION],
            parameters[columns.DELAY],
            comfortable,
            parameters[columns.MOST],
            parameters[columns.FSM_RAW_ACCELERATION] > 0.0,
        )
        if critical > 0.0:
            wanted = comfortable + critical * (parameters[columns.MOST] - comfortable)
        else:
            wanted = comfortable * proactive_fuzzy_safety(
                view[columns.GAP],
                view[columns.EGO_SPEED],
                view[columns.OTHER_SPEED],
                parameters[columns.DELAY],
                comfortable,
                parameters[columns.MOST],
                parameters[columns.FSM_LEAD_BRAKING],
                parameters[columns.FSM_MARGIN],
            )
    # At its own distance, only rounding makes this model want to brake.
    return react(parameters, state, wanted > columns.ROUNDING, wanted, step)


@compiled
def rss_limit(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the acceleration that responsibility-sensitive safety allows [m/s^2].

    The situation is dangerous when both the longitudinal and the lateral distance are too short;
    after the response time the ego brakes until one of them is long enough.

    Args:
        view: What it sees, shape (VIEW_SIZE,), all known.
        parameters: ``ResponsibleDriver.vector()``.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing.
    """
    is_dangerous = False
    if is_ahead(view, parameters):
        only = parameters[columns.RSS_OTHER_ONLY] > 0.0
        lateral = rss_lateral_distance(
            abs(view[columns.LATERAL_SPEED]) if only else view[columns.LATERAL_SPEED],
            0.0,
            parameters[columns.DELAY],
            0.0 if only else parameters[columns.DELAY],
            parameters[columns.RSS_LATERAL_ACCELERATION],
            parameters[columns.RSS_LATERAL_BRAKING],
            parameters[columns.RSS_FLUCTUATION],
        )
        is_dangerous = view[columns.LATERAL_GAP] < lateral and view[
            columns.GAP
        ] < rss_longitudinal_distance(
            view[columns.EGO_SPEED],
            view[columns.OTHER_SPEED],
            parameters[columns.DELAY],
            parameters[columns.RSS_ACCELERATION],
            parameters[columns.RSS_LEAST_BRAKING],
            parameters[columns.RSS_MOST_BRAKING],
        )
    return react(parameters, state, is_dangerous, parameters[columns.MOST], step)


@compiled
def _brakes_too_hard(view: Floats, parameters: Floats, step: float) -> bool:
    """Tell whether a lead that brakes on would ask the cut-in rule for all of its braking."""
    braking = -view[columns.OTHER_ACCELERATION]
    if braking <= 0.0:
        return False
    if braking >= parameters[columns.REG157_LEAD_BRAKING] - columns.ROUNDING:
        return True
    time = (
        parameters[columns.DELAY]
        + parameters[columns.REG157_GUARD]
        + parameters[columns.REG157_LOOKS_AHEAD] * step
    )
    speed = view[columns.OTHER_SPEED]
    rolling = min(time, speed / braking)
    room = (
        view[columns.GAP]
        + rolling * (speed - 0.5 * braking * rolling)
        - view[columns.EGO_SPEED] * time
    )
    required = required_deceleration(
        room, view[columns.EGO_SPEED], max(speed - braking * time, 0.0), -braking
    )
    return required >= parameters[columns.MOST]


@compiled
def reg157_limit(view: Floats, parameters: Floats, state: Floats, step: float) -> float:
    """Return the acceleration that the cut-in rule of paragraph 5.2.5.2 allows [m/s^2].

    The rule is made a driver who brakes as late as it allows: in the last tick whose TTC is above
    the threshold, for a vehicle that has intruded into the lane. Of a lead that brakes, it is
    counted that it brakes on; one that brakes hard is answered at once.

    Args:
        view: What it sees, shape (VIEW_SIZE,), all known.
        parameters: ``CutInRule.vector()``.
        state: What it remembers, shape (STATE_SIZE,); changed in place.
        step: Length of the tick [s].

    Returns:
        Infinity where it asks for nothing.
    """
    closing = view[columns.EGO_SPEED] - view[columns.OTHER_SPEED]
    is_in = (
        view[columns.LATERAL_GAP] <= parameters[columns.REG157_LATERAL_GAP]
        or view[columns.INTRUSION] >= parameters[columns.REG157_INTRUSION]
    )
    is_dangerous = False
    if is_in and is_ahead(view, parameters) and closing > 0.0:
        threshold = cut_in_threshold(
            closing, parameters[columns.REG157_RESERVE], parameters[columns.MOST]
        )
        # A TTC at constant speeds is one step shorter in the next tick, which would be too late.
        late = (
            time_to_collision(view[columns.GAP], closing)
            - parameters[columns.REG157_LOOKS_AHEAD] * step
        )
        keeps = state[columns.REACTING] > 0.0 and parameters[columns.REG157_RELEASES] == 0.0
        is_dangerous = late <= threshold + parameters[columns.REG157_GUARD] or keeps
    if view[columns.LATERAL_GAP] <= 0.0 and is_ahead(view, parameters):
        is_dangerous = is_dangerous or _brakes_too_hard(view, parameters, step)
    if parameters[columns.REG157_LEAD_AT_ONCE] > 0.0:
        note_side(view, state)
        is_dangerous = is_dangerous or is_lead_at_once(view, parameters, state)
    return react(parameters, state, is_dangerous, parameters[columns.MOST], step)


@compiled
def reference_limit(
    model: int,
    view: Floats,
    parameters: Floats,
    state: Floats,
    step: float,
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
    if is_unknown(view):
        return math.nan
    if model == columns.CC:
        return cc_limit(view, parameters, state, step)
    if model == columns.FSM:
        return fsm_limit(view, parameters, state, step)
    if model == columns.RSS:
        return rss_limit(view, parameters, state, step)
    if model == columns.REG157:
        return reg157_limit(view, parameters, state, step)
    return math.nan


# --- Scenes of UN R157 driven by a reference driver: cut-in, cut-out and braking lead -------------

LONGEST: Final = 300.0
"""After which a scene is given up [s]."""

# Where the vehicles are, one number each.
SPEED: Final = 0
SPEED_BEFORE: Final = 1
OTHER: Final = 2
OTHER_BEFORE: Final = 3
AHEAD: Final = 4
FRONT: Final = 5
LATERAL: Final = 6
REVEAL: Final = 7
STOPPED: Final = 8
SIDEWAYS: Final = 9
GROWTH: Final = 10
"""For how long the sideways speed grows [s]."""
SCRATCH_SIZE: Final = columns.VIEW_SIZE + columns.STATE_SIZE + 11

SETTLED: Final = 0.01
"""Closing speed below which a driver who brakes has avoided the contact [m/s]; some of them come
to the other's speed for ever closer only."""

REVEALED: Final = 0.375
"""Off its lane's centre, a vehicle that cuts out shows what is in front of it [m]."""


@compiled
def _advance(speed: float, acceleration: float, step: float, integrator: int) -> float:
    """Return the way in one step [m]; the new speed is ``max(speed + acceleration step, 0)``."""
    reached = speed + acceleration * step
    if integrator == columns.SEMI_IMPLICIT:
        return max(reached, 0.0) * step
    if reached < 0.0:
        return speed * speed / (-2.0 * acceleration)
    return step * (speed + 0.5 * acceleration * step)


@compiled
def _growth(scene: Floats, kind: int, step: float, integrator: int) -> float:
    """Return for how long the sideways speed of a cut-in grows [s]; 0 if it does not."""
    growing = scene[columns.S_LATERAL_ACCELERATION]
    if kind != columns.CUT_IN or not 0.0 < growing < math.inf:
        return 0.0
    if integrator == columns.SEMI_IMPLICIT:
        # The published code grows in whole steps; the last of them may be a shorter one.
        return math.ceil(scene[columns.S_LATERAL_SPEED] / (growing / (1.0 / step))) * step
    return scene[columns.S_LATERAL_SPEED] / growing


@compiled
def _begin(
    scene: Floats,
    kind: int,
    own_gap: float,
    motion: Floats,
    result: Floats,
) -> None:
    """Set the vehicles where the scene begins and the result to nothing known."""
    result[columns.R_CONTACT] = math.nan
    result[columns.R_IMPACT_SPEED] = math.nan
    result[columns.R_MIN_GAP] = math.inf
    result[columns.R_BRAKING_TIME] = math.nan
    motion[SPEED] = motion[SPEED_BEFORE] = scene[columns.S_EGO_SPEED]
    motion[OTHER] = motion[OTHER_BEFORE] = scene[columns.S_OTHER_SPEED]
    motion[AHEAD] = own_gap if math.isnan(scene[columns.S_GAP]) else scene[columns.S_GAP]
    if motion[GROWTH] > 0.0:
        # The gap is that at the end of the growth.
        motion[AHEAD] += (scene[columns.S_EGO_SPEED] - scene[columns.S_OTHER_SPEED]) * motion[
            GROWTH
        ]
    motion[FRONT] = scene[columns.S_FRONT_GAP] if kind == columns.CUT_OUT else math.inf
    motion[LATERAL] = abs(scene[columns.S_LATERAL_OFFSET]) if kind == columns.CUT_IN else 0.0
    motion[REVEAL] = 0.0
    motion[STOPPED] = 0.0
    motion[SIDEWAYS] = scene[columns.S_LATERAL_SPEED]


@compiled
def _cut_in(scene: Floats, time: float, step: float, integrator: int, motion: Floats) -> None:
    """Move a vehicle that cuts in sideways, at a speed that may grow at first."""
    whole = motion[GROWTH]
    # At the end of the growth it is as far away as the scene says.
    ahead = abs(scene[columns.S_LATERAL_OFFSET])
    motion[SIDEWAYS] = scene[columns.S_LATERAL_SPEED]
    if time >= whole - 0.5 * step * (integrator == columns.SEMI_IMPLICIT):
        motion[LATERAL] = max(ahead - scene[columns.S_LATERAL_SPEED] * (time - whole), 0.0)
        return
    growing = scene[columns.S_LATERAL_ACCELERATION]
    motion[SIDEWAYS] = min(growing * time, scene[columns.S_LATERAL_SPEED])
    # The published code drives each step at the speed that it has before.
    early = step if integrator == columns.SEMI_IMPLICIT else 0.0
    ahead += 0.5 * growing * (whole * (whole - early) - time * (time - early))
    motion[LATERAL] = ahead


@compiled
def _shift(
    scene: Floats,
    kind: int,
    time: float,
    step: float,
    integrator: int,
    motion: Floats,
) -> None:
    """Move the other sideways; see what a vehicle that cuts out reveals or hits."""
    if kind == columns.CUT_IN:
        _cut_in(scene, time, step, integrator, motion)
    if kind != columns.CUT_OUT or motion[STOPPED] > 0.0:
        return
    motion[LATERAL] = scene[columns.S_LATERAL_SPEED] * time
    if motion[FRONT] <= 0.0 and motion[LATERAL] < scene[columns.S_OTHER_WIDTH]:
        # Who has hit the standing vehicle stays where it is.
        motion[STOPPED] = 1.0
        motion[OTHER] = 0.0
        motion[REVEAL] = 0.0
    elif motion[LATERAL] > REVEALED:
        motion[REVEAL] = 1.0


@compiled
def _look(
    scene: Floats,
    kind: int,
    step: float,
    motion: Floats,
    view: Floats,
) -> None:
    """Fill in what the ego sees."""
    is_revealed = motion[REVEAL] > 0.0
    lateral = motion[LATERAL]
    half = 0.5 * (scene[columns.S_EGO_WIDTH] + scene[columns.S_OTHER_WIDTH])
    smaller = min(scene[columns.S_EGO_WIDTH], scene[columns.S_OTHER_WIDTH])
    seen = 0.0 if is_revealed else lateral
    view[columns.EGO_SPEED] = motion[SPEED]
    view[columns.EGO_ACCELERATION] = (motion[SPEED] - motion[SPEED_BEFORE]) / step
    view[columns.LENGTHS] = scene[columns.S_EGO_LENGTH] + scene[columns.S_OTHER_LENGTH]
    view[columns.LATERAL_GAP] = seen - half
    view[columns.OVERLAP] = min(max(half - seen, 0.0), smaller) / smaller
    view[columns.INTRUSION] = (
        0.5 * (scene[columns.S_LANE_WIDTH] + scene[columns.S_OTHER_WIDTH]) - seen
    )
    view[columns.GAP] = motion[AHEAD]
    view[columns.OTHER_SPEED] = motion[OTHER]
    view[columns.OTHER_ACCELERATION] = (motion[OTHER] - motion[OTHER_BEFORE]) / step
    view[columns.LATERAL_SPEED] = 0.0
    view[columns.CUE] = lateral if kind == columns.CUT_OUT else 0.0
    if is_revealed:
        # The standing vehicle is further on by the one that leaves and by what was before it.
        view[columns.GAP] = motion[AHEAD] + scene[columns.S_OTHER_LENGTH] + motion[FRONT]
        view[columns.OTHER_SPEED] = 0.0
        view[columns.OTHER_ACCELERATION] = 0.0
    elif kind == columns.CUT_OUT and motion[STOPPED] == 0.0:
        view[columns.LATERAL_SPEED] = -scene[columns.S_LATERAL_SPEED]
    elif kind == columns.CUT_IN and lateral > 0.0 and scene[columns.S_LATERAL_SPEED] > 0.0:
        view[columns.LATERAL_SPEED] = motion[SIDEWAYS]
        view[columns.CUE] = scene[columns.S_LANE_WIDTH] - lateral


@compiled
def _move(
    motion: Floats, acceleration: float, braking: float, step: float, integrator: int
) -> None:
    """Advance ego and other by one step."""
    way = _advance(motion[OTHER], -braking, step, integrator)
    motion[AHEAD] += way - _advance(motion[SPEED], acceleration, step, integrator)
    motion[FRONT] -= way
    motion[SPEED_BEFORE] = motion[SPEED]
    motion[SPEED] = max(motion[SPEED] + acceleration * step, 0.0)
    motion[OTHER_BEFORE] = motion[OTHER]
    motion[OTHER] = max(motion[OTHER] - braking * step, 0.0)


@compiled
def _note(lateral_gap: float, gap: float, lengths: float, closing: float, result: Floats) -> bool:
    """Note least gap and contact with one vehicle; tell whether there is one."""
    if lateral_gap >= 0.0 or gap <= -lengths:
        return False
    result[columns.R_MIN_GAP] = min(result[columns.R_MIN_GAP], max(gap, 0.0))
    if gap > 0.0:
        return False
    result[columns.R_CONTACT] = 1.0
    result[columns.R_IMPACT_SPEED] = closing
    return True


@compiled
def _touches(
    scene: Floats,
    motion: Floats,
    view: Floats,
    result: Floats,
) -> bool:
    """Note least gap and contact; tell whether there is one."""
    if motion[REVEAL] > 0.0:
        # Who looks at the standing vehicle can still run into the one that leaves.
        lateral = motion[LATERAL] - 0.5 * (
            scene[columns.S_EGO_WIDTH] + scene[columns.S_OTHER_WIDTH]
        )
        closing = motion[SPEED] - motion[OTHER]
        if _note(lateral, motion[AHEAD], view[columns.LENGTHS], closing, result):
            return True
    closing = view[columns.EGO_SPEED] - view[columns.OTHER_SPEED]
    return _note(
        view[columns.LATERAL_GAP], view[columns.GAP], view[columns.LENGTHS], closing, result
    )


@compiled
def _is_past(
    scene: Floats,
    kind: int,
    view: Floats,
    parameters: Floats,
    state: Floats,
    ttc_end: float,
) -> bool:
    """Tell whether no contact can happen any more."""
    gap = view[columns.GAP]
    # Beside an ego that stands, one that cuts in can still touch its side.
    is_safe = view[columns.EGO_SPEED] <= 0.0 and (gap > 0.0 or view[columns.LATERAL_SPEED] <= 0.0)
    if gap <= -view[columns.LENGTHS] or is_safe:
        return True
    closing = view[columns.EGO_SPEED] - view[columns.OTHER_SPEED]
    is_settled = (
        closing < SETTLED
        and view[columns.OTHER_ACCELERATION] == 0.0
        and state[columns.REACTING] > 0.0
    )
    if kind == columns.BRAKING_LEAD:
        calm = scene[columns.S_BRAKING] <= 0.0 or view[columns.OTHER_SPEED] <= 0.0
        return calm and (closing <= 0.0 or is_settled)
    if kind == columns.CUT_OUT:
        return False
    if gap > 0.0 and (closing <= 0.0 or (is_settled and view[columns.LATERAL_GAP] <= 0.0)):
        return True
    if view[columns.LATERAL_GAP] > 0.0 or ttc_end == math.inf:
        return False
    is_ahead = gap >= -parameters[columns.BESIDE] * view[columns.LENGTHS]
    return is_ahead and abs(gap) > ttc_end * abs(closing)


@compiled
def drive_scenes(
    scenes: Floats,
    kind: int,
    model: int,
    parameters: Floats,
    step: float,
    integrator: int,
    ttc_end: float,
    scratch: Floats,
    results: Floats,
    moves_first: bool = False,  # noqa: FBT001, FBT002 - compiled
) -> None:
    """Let a reference driver drive many scenes.

    Args:
        scenes: Shape (N, SCENE_SIZE).
        kind: CUT_IN, CUT_OUT or BRAKING_LEAD, of all of them.
        model: CC, FSM, RSS or REG157.
        parameters: Of that model.
        step: Length of a tick [s].
        integrator: EXACT or SEMI_IMPLICIT.
        ttc_end: TTC above which a cut-in ends without contact at lateral overlap [s], as in the
            published code; infinity: never.
        scratch: Shape (SCRATCH_SIZE,).
        results: Shape (N, RESULT_SIZE); filled in.
        moves_first: Whether the vehicles move a step before the driver looks at them, as in the
            published code where the sideways speed does not grow.
    """
    view = scratch[: columns.VIEW_SIZE]
    state = scratch[columns.VIEW_SIZE : columns.VIEW_SIZE + columns.STATE_SIZE]
    motion = scratch[columns.VIEW_SIZE + columns.STATE_SIZE :]
    for k in range(scenes.shape[0]):
        scene, result = scenes[k], results[k]
        state[:] = 0.0
        own_gap = following_distance(model, parameters, scene[columns.S_EGO_SPEED])
        motion[GROWTH] = _growth(scene, kind, step, integrator)
        _begin(scene, kind, own_gap, motion, result)
        first = 0
        if moves_first and not (
            kind == columns.CUT_IN and 0.0 < scene[columns.S_LATERAL_ACCELERATION] < math.inf
        ):
            first = 1
            _move(motion, 0.0, 0.0, step, integrator)
        for tick in range(int(LONGEST / step) + 1):
            time = (tick + first) * step
            _shift(scene, kind, time, step, integrator, motion)
            _look(scene, kind, step, motion, view)
            if _touches(scene, motion, view, result):
                break
            limit = reference_limit(model, view, parameters, state, step)
            if math.isnan(limit):
                break
            if _is_past(scene, kind, view, parameters, state, ttc_end):
                result[columns.R_CONTACT] = 0.0
                break
            if limit < 0.0 and math.isnan(result[columns.R_BRAKING_TIME]):
                result[columns.R_BRAKING_TIME] = time
            braking = 0.0
            if kind == columns.BRAKING_LEAD:
                braking = min(
                    scene[columns.S_BRAKING_JERK] * (tick + 0.5) * step, scene[columns.S_BRAKING]
                )
            _move(motion, min(limit, 0.0), braking, step, integrator)
