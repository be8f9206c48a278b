"""Scenes of UN R157 driven by a reference driver: cut-in, cut-out and braking lead.

Two or three vehicles on a straight road; the ego keeps its speed unless the driver brakes, and
nobody evades sideways. A scene is a row of numbers, so a grid of scenes is one array, and each is
evaluated by itself: the same bits in any order and number of threads.

Source:
    UN Regulation 157, 01 series of amendments, annex 4 appendix 3, parameters of the three
    scenarios.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled
from adeye.kernel.reference_drivers.drivers import reference_limit
from adeye.kernel.reference_drivers.parameters import (
    BESIDE,
    BRAKING_LEAD,
    CUE,
    CUT_IN,
    CUT_OUT,
    EGO_ACCELERATION,
    EGO_SPEED,
    GAP,
    INTRUSION,
    LATERAL_GAP,
    LATERAL_SPEED,
    LENGTHS,
    OTHER_ACCELERATION,
    OTHER_SPEED,
    OVERLAP,
    R_BRAKING_TIME,
    R_CONTACT,
    R_IMPACT_SPEED,
    R_MIN_GAP,
    REACTING,
    S_BRAKING,
    S_BRAKING_JERK,
    S_EGO_LENGTH,
    S_EGO_SPEED,
    S_EGO_WIDTH,
    S_FRONT_GAP,
    S_GAP,
    S_LANE_WIDTH,
    S_LATERAL_ACCELERATION,
    S_LATERAL_OFFSET,
    S_LATERAL_SPEED,
    S_OTHER_LENGTH,
    S_OTHER_SPEED,
    S_OTHER_WIDTH,
    SEMI_IMPLICIT,
    STATE_SIZE,
    VIEW_SIZE,
)
from adeye.kernel.reference_drivers.reactions import following_distance

Floats = NDArray[np.float64]

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
SCRATCH_SIZE: Final = VIEW_SIZE + STATE_SIZE + 11

SETTLED: Final = 0.01
"""Closing speed below which a driver who brakes has avoided the contact [m/s]; some of them come
to the other's speed for ever closer only."""

REVEALED: Final = 0.375
"""Off its lane's centre, a vehicle that cuts out shows what is in front of it [m]."""


@compiled
def _advance(speed: float, acceleration: float, step: float, integrator: int) -> float:
    """Return the way in one step [m]; the new speed is ``max(speed + acceleration step, 0)``."""
    reached = speed + acceleration * step
    if integrator == SEMI_IMPLICIT:
        return max(reached, 0.0) * step
    if reached < 0.0:
        return speed * speed / (-2.0 * acceleration)
    return step * (speed + 0.5 * acceleration * step)


@compiled
def _growth(scene: Floats, kind: int, step: float, integrator: int) -> float:
    """Return for how long the sideways speed of a cut-in grows [s]; 0 if it does not."""
    growing = scene[S_LATERAL_ACCELERATION]
    if kind != CUT_IN or not 0.0 < growing < math.inf:
        return 0.0
    if integrator == SEMI_IMPLICIT:
        # The published code grows in whole steps; the last of them may be a shorter one.
        return math.ceil(scene[S_LATERAL_SPEED] / (growing / (1.0 / step))) * step
    return scene[S_LATERAL_SPEED] / growing


@compiled
def _begin(scene: Floats, kind: int, own_gap: float, motion: Floats, result: Floats) -> None:
    """Set the vehicles where the scene begins and the result to nothing known."""
    result[R_CONTACT] = math.nan
    result[R_IMPACT_SPEED] = math.nan
    result[R_MIN_GAP] = math.inf
    result[R_BRAKING_TIME] = math.nan
    motion[SPEED] = motion[SPEED_BEFORE] = scene[S_EGO_SPEED]
    motion[OTHER] = motion[OTHER_BEFORE] = scene[S_OTHER_SPEED]
    motion[AHEAD] = own_gap if math.isnan(scene[S_GAP]) else scene[S_GAP]
    if motion[GROWTH] > 0.0:
        # The gap is that at the end of the growth.
        motion[AHEAD] += (scene[S_EGO_SPEED] - scene[S_OTHER_SPEED]) * motion[GROWTH]
    motion[FRONT] = scene[S_FRONT_GAP] if kind == CUT_OUT else math.inf
    motion[LATERAL] = abs(scene[S_LATERAL_OFFSET]) if kind == CUT_IN else 0.0
    motion[REVEAL] = 0.0
    motion[STOPPED] = 0.0
    motion[SIDEWAYS] = scene[S_LATERAL_SPEED]


@compiled
def _cut_in(scene: Floats, time: float, step: float, integrator: int, motion: Floats) -> None:
    """Move a vehicle that cuts in sideways, at a speed that may grow at first."""
    whole = motion[GROWTH]
    # At the end of the growth it is as far away as the scene says.
    ahead = abs(scene[S_LATERAL_OFFSET])
    motion[SIDEWAYS] = scene[S_LATERAL_SPEED]
    if time >= whole - 0.5 * step * (integrator == SEMI_IMPLICIT):
        motion[LATERAL] = max(ahead - scene[S_LATERAL_SPEED] * (time - whole), 0.0)
        return
    growing = scene[S_LATERAL_ACCELERATION]
    motion[SIDEWAYS] = min(growing * time, scene[S_LATERAL_SPEED])
    # The published code drives each step at the speed that it has before.
    early = step if integrator == SEMI_IMPLICIT else 0.0
    ahead += 0.5 * growing * (whole * (whole - early) - time * (time - early))
    motion[LATERAL] = ahead


@compiled
def _shift(
    scene: Floats, kind: int, time: float, step: float, integrator: int, motion: Floats
) -> None:
    """Move the other sideways; see what a vehicle that cuts out reveals or hits."""
    if kind == CUT_IN:
        _cut_in(scene, time, step, integrator, motion)
    if kind != CUT_OUT or motion[STOPPED] > 0.0:
        return
    motion[LATERAL] = scene[S_LATERAL_SPEED] * time
    if motion[FRONT] <= 0.0 and motion[LATERAL] < scene[S_OTHER_WIDTH]:
        # Who has hit the standing vehicle stays where it is.
        motion[STOPPED] = 1.0
        motion[OTHER] = 0.0
        motion[REVEAL] = 0.0
    elif motion[LATERAL] > REVEALED:
        motion[REVEAL] = 1.0


@compiled
def _look(scene: Floats, kind: int, step: float, motion: Floats, view: Floats) -> None:
    """Fill in what the ego sees."""
    is_revealed = motion[REVEAL] > 0.0
    lateral = motion[LATERAL]
    half = 0.5 * (scene[S_EGO_WIDTH] + scene[S_OTHER_WIDTH])
    smaller = min(scene[S_EGO_WIDTH], scene[S_OTHER_WIDTH])
    seen = 0.0 if is_revealed else lateral
    view[EGO_SPEED] = motion[SPEED]
    view[EGO_ACCELERATION] = (motion[SPEED] - motion[SPEED_BEFORE]) / step
    view[LENGTHS] = scene[S_EGO_LENGTH] + scene[S_OTHER_LENGTH]
    view[LATERAL_GAP] = seen - half
    view[OVERLAP] = min(max(half - seen, 0.0), smaller) / smaller
    view[INTRUSION] = 0.5 * (scene[S_LANE_WIDTH] + scene[S_OTHER_WIDTH]) - seen
    view[GAP] = motion[AHEAD]
    view[OTHER_SPEED] = motion[OTHER]
    view[OTHER_ACCELERATION] = (motion[OTHER] - motion[OTHER_BEFORE]) / step
    view[LATERAL_SPEED] = 0.0
    view[CUE] = lateral if kind == CUT_OUT else 0.0
    if is_revealed:
        # The standing vehicle is further on by the one that leaves and by what was before it.
        view[GAP] = motion[AHEAD] + scene[S_OTHER_LENGTH] + motion[FRONT]
        view[OTHER_SPEED] = 0.0
        view[OTHER_ACCELERATION] = 0.0
    elif kind == CUT_OUT and motion[STOPPED] == 0.0:
        view[LATERAL_SPEED] = -scene[S_LATERAL_SPEED]
    elif kind == CUT_IN and lateral > 0.0 and scene[S_LATERAL_SPEED] > 0.0:
        view[LATERAL_SPEED] = motion[SIDEWAYS]
        view[CUE] = scene[S_LANE_WIDTH] - lateral


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
    result[R_MIN_GAP] = min(result[R_MIN_GAP], max(gap, 0.0))
    if gap > 0.0:
        return False
    result[R_CONTACT] = 1.0
    result[R_IMPACT_SPEED] = closing
    return True


@compiled
def _touches(scene: Floats, motion: Floats, view: Floats, result: Floats) -> bool:
    """Note least gap and contact; tell whether there is one."""
    if motion[REVEAL] > 0.0:
        # Who looks at the standing vehicle can still run into the one that leaves.
        lateral = motion[LATERAL] - 0.5 * (scene[S_EGO_WIDTH] + scene[S_OTHER_WIDTH])
        closing = motion[SPEED] - motion[OTHER]
        if _note(lateral, motion[AHEAD], view[LENGTHS], closing, result):
            return True
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    return _note(view[LATERAL_GAP], view[GAP], view[LENGTHS], closing, result)


@compiled
def _is_past(
    scene: Floats, kind: int, view: Floats, parameters: Floats, state: Floats, ttc_end: float
) -> bool:
    """Tell whether no contact can happen any more."""
    gap = view[GAP]
    # Beside an ego that stands, one that cuts in can still touch its side.
    is_safe = view[EGO_SPEED] <= 0.0 and (gap > 0.0 or view[LATERAL_SPEED] <= 0.0)
    if gap <= -view[LENGTHS] or is_safe:
        return True
    closing = view[EGO_SPEED] - view[OTHER_SPEED]
    is_settled = closing < SETTLED and view[OTHER_ACCELERATION] == 0.0 and state[REACTING] > 0.0
    if kind == BRAKING_LEAD:
        calm = scene[S_BRAKING] <= 0.0 or view[OTHER_SPEED] <= 0.0
        return calm and (closing <= 0.0 or is_settled)
    if kind == CUT_OUT:
        return False
    if gap > 0.0 and (closing <= 0.0 or (is_settled and view[LATERAL_GAP] <= 0.0)):
        return True
    if view[LATERAL_GAP] > 0.0 or ttc_end == math.inf:
        return False
    is_ahead = gap >= -parameters[BESIDE] * view[LENGTHS]
    return is_ahead and abs(gap) > ttc_end * abs(closing)


@compiled
def drive_scene(
    scene: Floats,
    kind: int,
    model: int,
    parameters: Floats,
    step: float,
    integrator: int,
    ttc_end: float,
    scratch: Floats,
    result: Floats,
    moves_first: bool = False,  # noqa: FBT001, FBT002 - compiled
) -> None:
    """Let a reference driver drive one scene.

    Args:
        scene: Shape (SCENE_SIZE,).
        kind: CUT_IN, CUT_OUT or BRAKING_LEAD.
        model: CC, FSM, RSS or REG157.
        parameters: Of that model.
        step: Length of a tick [s].
        integrator: EXACT or SEMI_IMPLICIT.
        ttc_end: TTC above which a cut-in ends without contact at lateral overlap [s], as in the
            published code; infinity: never.
        scratch: Shape (SCRATCH_SIZE,).
        result: Shape (RESULT_SIZE,); filled in.
        moves_first: Whether the vehicles move a step before the driver looks at them, as in the
            published code where the sideways speed does not grow.
    """
    view = scratch[:VIEW_SIZE]
    state = scratch[VIEW_SIZE : VIEW_SIZE + STATE_SIZE]
    motion = scratch[VIEW_SIZE + STATE_SIZE :]
    state[:] = 0.0
    own_gap = following_distance(model, parameters, scene[S_EGO_SPEED])
    motion[GROWTH] = _growth(scene, kind, step, integrator)
    _begin(scene, kind, own_gap, motion, result)
    first = 0
    if moves_first and not (kind == CUT_IN and 0.0 < scene[S_LATERAL_ACCELERATION] < math.inf):
        first = 1
        _move(motion, 0.0, 0.0, step, integrator)
    for tick in range(int(LONGEST / step) + 1):
        time = (tick + first) * step
        _shift(scene, kind, time, step, integrator, motion)
        _look(scene, kind, step, motion, view)
        if _touches(scene, motion, view, result):
            return
        limit = reference_limit(model, view, parameters, state, step)
        if math.isnan(limit):
            return
        if _is_past(scene, kind, view, parameters, state, ttc_end):
            result[R_CONTACT] = 0.0
            return
        if limit < 0.0 and math.isnan(result[R_BRAKING_TIME]):
            result[R_BRAKING_TIME] = time
        braking = 0.0
        if kind == BRAKING_LEAD:
            braking = min(scene[S_BRAKING_JERK] * (tick + 0.5) * step, scene[S_BRAKING])
        _move(motion, min(limit, 0.0), braking, step, integrator)


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
    """Let a reference driver drive many scenes; see ``drive_scene``.

    Args:
        scenes: Shape (N, SCENE_SIZE).
        kind: Of all of them.
        model: CC, FSM, RSS or REG157.
        parameters: Of that model.
        step: Length of a tick [s].
        integrator: EXACT or SEMI_IMPLICIT.
        ttc_end: TTC that ends a cut-in [s]; infinity: none.
        scratch: Shape (SCRATCH_SIZE,).
        results: Shape (N, RESULT_SIZE); filled in.
        moves_first: See there.
    """
    for k in range(scenes.shape[0]):
        drive_scene(
            scenes[k],
            kind,
            model,
            parameters,
            step,
            integrator,
            ttc_end,
            scratch,
            results[k],
            moves_first,
        )
