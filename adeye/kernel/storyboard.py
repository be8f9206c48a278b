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
    SHIFT_TICK,
    SWAY,
    D,
    S,
    advance,
    hold_shift,
    pace_at,
    plan_pace,
    plan_shift,
    shift_at,
    shift_time,
)
from adeye.kernel.postfix import run_program
from adeye.kernel.road import position

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Columns of an action.
ACTION_ACTOR, ACTION_KIND, ACTION_TARGET, ACTION_RATE, ACTION_JERK, ACTION_SHAPE = range(6)
ACTION_RELATIVE, ACTION_DELAY = range(6, 8)
"""Variable that a target speed is added to, -1 for none; ticks from its condition to its begin."""
ACTION_WIDTH: Final = 8
CHANGE_TO, CHANGE_BY, CHANGE_SPEED, CROSS = range(4)
"""Kinds: to a lateral place, by a lateral distance, to a speed, across to a lateral place."""

EVENT_VARIABLES: Final = ("begun", "begun_at", "since", "ended")
"""What a condition may ask of an event, in the order of the variables: each for all events."""

IS_OVER: Final = 1e-9
"""How much earlier than by its plan an action may count as ended [s]: rounding."""

STANDSTILL: Final = 1e-9
"""Speed below which an actor keeps its heading [m/s]."""


@compiled
def begin_action(row: Floats, action: Floats, tick: int, other: float = 0.0) -> None:
    """Begin an action of an actor at a tick.

    Args:
        row: (ACTOR_WIDTH,) in and out.
        action: (ACTION_WIDTH,) what it does.
        tick: When.
        other: Speed that a target speed is added to [m/s].
    """
    kind, target = int(action[ACTION_KIND]), action[ACTION_TARGET]
    rate = action[ACTION_RATE]
    if kind == CHANGE_SPEED:
        plan_pace(row, tick, max(0.0, target + other), rate, action[ACTION_JERK])
        return
    shift = target if kind == CHANGE_BY else target - row[D]
    if kind == CROSS:
        row[BASE] = row[D]
        row[SHIFT_TICK] = tick
        row[SHIFT] = row[SHIFT_DURATION] = 0.0
        row[ALONG], row[ACROSS] = 0.0, math.copysign(1.0, shift)
        row[PACE], row[PACE_RATE], row[PATH] = rate, 0.0, 0.0
        plan_pace(row, tick, rate, 1.0, math.inf)
        row[LIMIT], row[LIMIT_D] = abs(shift), target
        return
    plan_shift(row, tick, shift, rate, action[ACTION_SHAPE])


@compiled
def is_over(row: Floats, kind: int, tick: int, step: float) -> bool:
    """Tell whether the action of a kind that an actor does last has come to its end.

    Args:
        row: (ACTOR_WIDTH,) at the tick.
        kind: Of the action.
        tick: When.
        step: Master clock [s].
    """
    if kind == CHANGE_SPEED:
        duration = row[PHASES] + row[PHASES + 3] + row[PHASES + 6]
        return bool((tick - row[PACE_TICK]) * step >= duration - IS_OVER)
    if kind == CROSS:
        return bool(math.isinf(row[LIMIT]))
    return bool(shift_time(row, tick, step) >= row[SHIFT_DURATION] - IS_OVER)


@compiled
def is_replaced(action: Floats, other: Floats) -> bool:
    """Tell whether another action (ACTION_WIDTH,), begun with or after this one, takes its place.

    Speeds replace speeds, lane changes and crossings each other; a crossing sets the speed too.
    """
    is_speed, sets_speed = action[ACTION_KIND] == CHANGE_SPEED, other[ACTION_KIND] == CHANGE_SPEED
    return bool(
        action[ACTION_ACTOR] == other[ACTION_ACTOR]
        and (is_speed == sets_speed or (is_speed and other[ACTION_KIND] == CROSS))
    )


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
    held = hold_shift(row, tick, step, driven, pace)
    offset, rate, bend = shift_at(row, shift_time(row, tick, step))
    row[SWAY] = rate
    if held < 1.0:
        bend = held * held * bend
        if pace > 0.0:
            bend += held * rate * slope / pace
        rate = held * rate
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
def end_actions(
    running: Bools,
    actions: Floats,
    tick: int,
    step: float,
    begun: Floats,
    actors: Floats,
    ended: Bools,
) -> None:
    """Note which actions have come to their end at a tick.

    Args:
        running: (B,).
        actions: (B, V, ACTION_WIDTH).
        tick: Number of the tick.
        step: Master clock [s].
        begun: (B, V) times, see ``begin_events``.
        actors: (B, A, ACTOR_WIDTH).
        ended: (B, V) in and out.
    """
    for run in range(running.shape[0]):
        for event in range(begun.shape[1]):
            if running[run] and math.isfinite(begun[run, event]) and not ended[run, event]:
                action = actions[run, event]
                row = actors[run, int(action[ACTION_ACTOR])]
                ended[run, event] = is_over(row, int(action[ACTION_KIND]), tick, step)


@compiled
def begin_events(
    running: Bools,
    ops: Ints,
    args: Floats,
    lengths: Ints,
    programs: Ints,
    variables: Floats,
    first_event: int,
    actions: Floats,
    order: Ints,
    tick: int,
    now: float,
    due: Ints,
    begun: Floats,
    ended: Bools,
    actors: Floats,
) -> None:
    """Begin every event whose condition first holds at a tick, or did a delay ago.

    Events that wait for others to begin see them at the same tick: the conditions are evaluated
    again until no further event begins. Of two that begin at one tick and of which one takes the
    place of the other, the later in the order acts; the other is lost.

    Args:
        running: (B,).
        ops: (P, L) operations of the trigger programs.
        args: (P, L) their arguments.
        lengths: (P,) how many of them belong to each program.
        programs: (B, V) program of each event.
        variables: (B, W) trigger variables at the tick, in and out (``EVENT_VARIABLES``).
        first_event: Column of the first variable of the first event.
        actions: (B, V, ACTION_WIDTH).
        order: (V,) the events in the order in which they act.
        tick: Number of the tick.
        now: Its time [s].
        due: (B, V) tick at which each begins, -1 before its condition has held, in and out.
        begun: (B, V) times, NaN before, inf for one that is lost, in and out.
        ended: (B, V) whether its action has ended or another has taken its place, in and out.
        actors: (B, A, ACTOR_WIDTH) in and out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        began = False
        while _begin_events_once(
            ops,
            args,
            lengths,
            programs[run],
            variables[run],
            actions[run],
            order,
            tick,
            now,
            due[run],
            begun[run],
            ended[run],
        ):
            began = True
            _tell_events(variables[run], first_event, now, begun[run], ended[run])
        if not began:
            continue
        for event in order:
            if begun[run, event] == now:
                action, other = actions[run, event], 0.0
                if action[ACTION_RELATIVE] >= 0.0:
                    other = variables[run, int(action[ACTION_RELATIVE])]
                begin_action(actors[run, int(action[ACTION_ACTOR])], action, tick, other)


@compiled
def _tell_events(
    variables: Floats, first_event: int, now: float, begun: Floats, ended: Bools
) -> None:
    """Write what has become true of events at a tick into the variables of a run."""
    events = begun.shape[0]
    for event in range(events):
        column = first_event + event
        variables[column] = 1.0 if math.isfinite(begun[event]) else 0.0
        if begun[event] == now:
            variables[column + events], variables[column + 2 * events] = now, 0.0
        elif math.isinf(begun[event]):
            variables[column + events] = variables[column + 2 * events] = math.nan
        variables[column + 3 * events] = 1.0 if ended[event] else 0.0


@compiled
def _begin_events_once(
    ops: Ints,
    args: Floats,
    lengths: Ints,
    programs: Ints,
    variables: Floats,
    actions: Floats,
    order: Ints,
    tick: int,
    now: float,
    due: Ints,
    begun: Floats,
    ended: Bools,
) -> bool:
    began = False
    for event in range(begun.shape[0]):
        if not math.isnan(begun[event]):
            continue
        if due[event] < 0:
            program = programs[event]
            length = lengths[program]
            value = run_program(ops[program, :length], args[program, :length], variables)
            # NaN compares false: an undefined condition begins nothing.
            if value > 0.0 or value < 0.0:
                due[event] = tick + int(actions[event, ACTION_DELAY])
        if 0 <= due[event] <= tick:
            begun[event] = now
            began = True
    if began:
        _take_places(actions, order, now, begun, ended)
    return began


@compiled
def _take_places(actions: Floats, order: Ints, now: float, begun: Floats, ended: Bools) -> None:
    """Let what begins at a tick take the place of what began before, in time or in the order."""
    for late in range(len(order)):
        event = order[late]
        if begun[event] != now:
            continue
        for place in range(len(order)):
            other = order[place]
            if other == event or not is_replaced(actions[other], actions[event]):
                continue
            if begun[other] == now and place < late:
                begun[other] = math.inf
            elif begun[other] < now:
                ended[other] = True
