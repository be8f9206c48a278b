"""Scripted actors in road coordinates: actions begun by triggers, and the motion of a tick."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan2
from adeye.kernel.jit import compiled
from adeye.kernel.manoeuvre import (
    ACROSS,
    ALONG,
    BASE,
    HEADING,
    LIMIT,
    LIMIT_D,
    PACE,
    PACE_END,
    PACE_RATE,
    PACE_START,
    PACE_TICK,
    PATH,
    PHASES,
    SHIFT,
    SHIFT_DURATION,
    SHIFT_SHAPE,
    SHIFT_TICK,
    D,
    S,
    advance,
    pace_at,
    plan_pace,
    shift_at,
    shift_duration,
)
from adeye.kernel.postfix import run_program
from adeye.kernel.road import position

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Columns of an action.
ACTION_ACTOR, ACTION_KIND, ACTION_TARGET, ACTION_RATE, ACTION_JERK, ACTION_SHAPE = range(6)
ACTION_WIDTH: Final = 6
CHANGE_TO, CHANGE_BY, CHANGE_SPEED, CROSS = range(4)
"""Kinds: to a lateral place, by a lateral distance, to a speed, across to a lateral place."""

STANDSTILL: Final = 1e-9
"""Speed below which an actor keeps its heading [m/s]."""


@compiled
def begin_action(row: Floats, action: Floats, tick: int) -> None:
    """Begin an action of an actor at a tick.

    Args:
        row: (ACTOR_WIDTH,) in and out.
        action: (ACTION_WIDTH,) what it does.
        tick: When.
    """
    kind, target = int(action[ACTION_KIND]), action[ACTION_TARGET]
    rate = action[ACTION_RATE]
    if kind == CHANGE_SPEED:
        plan_pace(row, tick, target, rate, action[ACTION_JERK])
        return
    shift = target if kind == CHANGE_BY else target - row[D]
    row[BASE] = row[D]
    row[SHIFT_TICK] = tick
    if kind == CROSS:
        row[SHIFT] = row[SHIFT_DURATION] = 0.0
        row[ALONG], row[ACROSS] = 0.0, math.copysign(1.0, shift)
        row[PACE], row[PACE_RATE], row[PATH] = rate, 0.0, 0.0
        plan_pace(row, tick, rate, 1.0, math.inf)
        row[LIMIT], row[LIMIT_D] = abs(shift), target
        return
    row[SHIFT] = shift
    row[SHIFT_SHAPE] = action[ACTION_SHAPE]
    row[SHIFT_DURATION] = shift_duration(shift, rate, action[ACTION_SHAPE])


@compiled
def move_actor(row: Floats, segments: Floats, tick: int, step: float, out: Floats) -> None:
    """Move one scripted actor to the time of a tick.

    Args:
        row: (ACTOR_WIDTH,) in and out.
        segments: (K, 5) reference line.
        tick: The tick to move to.
        step: Master clock [s].
        out: (5,) x, y, heading, speed, acceleration in the map, out.
    """
    way, pace, slope = pace_at(row, (tick - row[PACE_TICK]) * step)
    arrived = way >= row[LIMIT]
    if arrived:
        way, pace, slope = row[LIMIT], 0.0, 0.0
    driven = way - row[PATH]
    offset, rate, bend = shift_at(row, (tick - row[SHIFT_TICK]) * step)
    row[BASE] += row[ACROSS] * driven
    if arrived:
        row[BASE] = row[LIMIT_D]
    d = row[BASE] + offset
    row[S] = advance(segments, row[S], 0.5 * (row[D] + d), row[ALONG] * driven)
    row[D], row[PATH], row[PACE], row[PACE_RATE] = d, way, pace, slope
    if arrived:
        row[PACE_START] = row[PACE_END] = row[PATH] = 0.0
        row[PHASES : PHASES + 9] = 0.0
        row[PACE_TICK], row[LIMIT] = tick, math.inf
    along, across = row[ALONG] * pace, row[ACROSS] * pace + rate
    speed, acceleration = pace, slope
    if rate != 0.0 or bend != 0.0:
        speed = math.sqrt(along * along + across * across)
        if speed > STANDSTILL:
            push = row[ALONG] * slope * along + (row[ACROSS] * slope + bend) * across
            acceleration = push / speed
    if speed > STANDSTILL:
        row[HEADING] = atan2(across, along)
    write_actor(row, segments, speed, acceleration, out)


@compiled
def write_actor(
    row: Floats, segments: Floats, speed: float, acceleration: float, out: Floats
) -> None:
    """Write an actor's place in the map.

    Args:
        row: (ACTOR_WIDTH,).
        segments: (K, 5) reference line.
        speed: [m/s].
        acceleration: Along its heading [m/s²].
        out: (5,) x, y, heading, speed, acceleration, out.
    """
    out[0], out[1], heading = position(segments, row[S], row[D])
    out[2] = heading + row[HEADING]
    out[3] = speed
    out[4] = acceleration


@compiled
def move_actors(
    running: Bools,
    scripted: Bools,
    actors: Floats,
    segments: Floats,
    tick: int,
    step: float,
    objects: Floats,
) -> None:
    """Move the scripted actors of all runs that have not ended to a tick.

    Args:
        running: (B,).
        scripted: (A,) which actors follow the storyboard.
        actors: (B, A, ACTOR_WIDTH) in and out.
        segments: (B, K, 5) reference lines.
        tick: The tick to move to.
        step: Master clock [s].
        objects: (B, M, 5) out, the first A rows where scripted.
    """
    for run in range(running.shape[0]):
        if running[run]:
            for actor in range(scripted.shape[0]):
                if scripted[actor]:
                    move_actor(actors[run, actor], segments[run], tick, step, objects[run, actor])


@compiled
def begin_events(
    running: Bools,
    ops: Ints,
    args: Floats,
    lengths: Ints,
    programs: Ints,
    variables: Floats,
    first_begun: int,
    actions: Floats,
    tick: int,
    time: float,
    begun: Floats,
    actors: Floats,
) -> None:
    """Begin every event whose condition first holds at a tick.

    Events that wait for others to begin see them at the same tick: the conditions are evaluated
    again until no further event begins.

    Args:
        running: (B,).
        ops: (P, L) operations of the trigger programs.
        args: (P, L) their arguments.
        lengths: (P,) how many of them belong to each program.
        programs: (B, V) program of each event.
        variables: (B, W) trigger variables at the tick, in and out (``<event>.begun``).
        first_begun: Column of the first event's ``begun``.
        actions: (B, V, ACTION_WIDTH).
        tick: Number of the tick.
        time: Of it [s].
        begun: (B, V) times, NaN before, in and out.
        actors: (B, A, ACTOR_WIDTH) in and out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        again = True
        while again:
            again = _begin_events_once(
                ops,
                args,
                lengths,
                programs[run],
                variables[run],
                actions[run],
                tick,
                time,
                begun[run],
                actors[run],
            )
            for event in range(begun.shape[1]):
                variables[run, first_begun + event] = 0.0 if math.isnan(begun[run, event]) else 1.0


@compiled
def _begin_events_once(
    ops: Ints,
    args: Floats,
    lengths: Ints,
    programs: Ints,
    variables: Floats,
    actions: Floats,
    tick: int,
    time: float,
    begun: Floats,
    actors: Floats,
) -> bool:
    began = False
    for event in range(begun.shape[0]):
        if not math.isnan(begun[event]):
            continue
        program = programs[event]
        length = lengths[program]
        value = run_program(ops[program, :length], args[program, :length], variables)
        # NaN compares false: an undefined condition begins nothing.
        if value > 0.0 or value < 0.0:
            begun[event] = time
            begin_action(actors[int(actions[event, ACTION_ACTOR])], actions[event], tick)
            began = True
    return began
