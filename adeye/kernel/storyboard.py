"""Scripted actors in road coordinates: manoeuvres with closed forms, begun by triggers.

An actor moves along a base direction with a pace that follows a planned profile; a lane change
adds a lateral offset on top. Pace and offset are functions of the time since their manoeuvre
began, so no error accumulates over ticks and the step does not change where an actor ends.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.postfix import run_program
from adeye.kernel.road import position

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Columns of a scripted actor's state.
(
    S,  # place along the road's reference line [m]
    D,  # lateral place, from the reference line to the left [m]
    HEADING,  # relative to the road [rad]
    ALONG,  # base direction: component along the road
    ACROSS,  # base direction: component to the left
    PACE,  # speed in the base direction [m/s]
    PACE_RATE,  # its rate of change [m/s²]
    PACE_TICK,  # when the pace profile began
    PACE_START,  # pace at that time [m/s]
    PACE_END,  # pace after the last phase [m/s]
    PHASES,  # three phases of duration [s], acceleration [m/s²], jerk [m/s³]
) = range(11)
(
    PATH,  # way since the pace profile began [m]
    LIMIT,  # way at which the actor stops, inf for none [m]
    LIMIT_D,  # lateral place at that way [m]
    BASE,  # lateral place without the lane change [m]
    SHIFT_TICK,  # when the lane change began
    SHIFT,  # lateral distance of the lane change [m]
    SHIFT_DURATION,  # [s]
    SHIFT_SHAPE,  # SINUSOIDAL or LINEAR
) = range(PHASES + 9, PHASES + 17)
ACTOR_WIDTH: Final = PHASES + 17

SINUSOIDAL, LINEAR = range(2)

# Columns of an action.
ACTION_ACTOR, ACTION_KIND, ACTION_TARGET, ACTION_RATE, ACTION_JERK, ACTION_SHAPE = range(6)
ACTION_WIDTH: Final = 6
CHANGE_TO, CHANGE_BY, CHANGE_SPEED, CROSS = range(4)
"""Kinds: to a lateral place, by a lateral distance, to a speed, across to a lateral place."""

STANDSTILL: Final = 1e-9
"""Speed below which an actor keeps its heading [m/s]."""


@compiled
def place_actor(row: Floats, s: float, d: float, heading: float, speed: float) -> None:
    """Set an actor's state at the start of a run: constant speed in its heading.

    Args:
        row: (ACTOR_WIDTH,) out.
        s: Along the road [m].
        d: From the reference line to the left [m].
        heading: Relative to the road [rad].
        speed: [m/s].
    """
    row[:] = 0.0
    row[S], row[D], row[BASE] = s, d, d
    row[HEADING] = heading
    across, along = sin_cos(heading)
    # A half turn is meant exactly, and sin(pi) is 1e-16.
    row[ALONG] = along if abs(along) > 1e-12 else 0.0
    row[ACROSS] = across if abs(across) > 1e-12 else 0.0
    row[PACE] = row[PACE_START] = row[PACE_END] = speed
    row[LIMIT] = math.inf


@compiled
def plan_pace(row: Floats, tick: int, target: float, rate: float, jerk: float) -> None:
    """Plan the way from the present pace and acceleration to a target pace.

    With a limit on jerk the acceleration is a trapezium: phases of jerk, constant acceleration and
    opposite jerk that end with the target pace and no acceleration. A limit that would carry the
    pace below zero on the way (hard braking already under way) is dropped.

    Args:
        row: (ACTOR_WIDTH,) in and out.
        tick: When it begins.
        target: Pace at the end [m/s].
        rate: Greatest acceleration or deceleration [m/s²].
        jerk: Greatest jerk [m/s³], inf for no limit.
    """
    pace, slope = row[PACE], row[PACE_RATE]
    row[LIMIT] -= row[PATH]
    row[PATH] = 0.0
    row[PACE_TICK] = tick
    row[PACE_START] = pace
    row[PACE_END] = target
    row[PHASES : PHASES + 9] = 0.0
    if not math.isinf(jerk):
        # Pace that is reached if the acceleration is taken back at once.
        coasted = pace + slope * abs(slope) / (2.0 * jerk)
        if coasted >= 0.0:
            _plan_with_jerk(row, pace, slope, coasted, target, rate, jerk)
            return
    change = target - pace
    row[PHASES] = abs(change) / rate
    row[PHASES + 1] = math.copysign(rate, change)


@compiled
def _plan_with_jerk(
    row: Floats,
    pace: float,
    slope: float,
    coasted: float,
    target: float,
    rate: float,
    jerk: float,
) -> None:
    sign = math.copysign(1.0, target - coasted)
    start = sign * slope
    gain = sign * (target - pace)
    if start > rate:
        first_jerk, peak = -jerk, rate
        first = (start - rate) / jerk
        middle = (gain - (start * start - rate * rate) / (2.0 * jerk)) / rate - rate / (2.0 * jerk)
    else:
        first_jerk = jerk
        peak = min(rate, math.sqrt(max(0.0, jerk * gain + 0.5 * start * start)))
        peak = max(peak, start)
        first = (peak - start) / jerk
        middle = 0.0
        if peak > 0.0:
            middle = (gain - peak * peak / jerk + 0.5 * start * start / jerk) / peak
    row[PHASES], row[PHASES + 1], row[PHASES + 2] = first, slope, sign * first_jerk
    row[PHASES + 3], row[PHASES + 4], row[PHASES + 5] = max(0.0, middle), sign * peak, 0.0
    row[PHASES + 6], row[PHASES + 7], row[PHASES + 8] = peak / jerk, sign * peak, -sign * jerk


@compiled
def pace_at(row: Floats, elapsed: float) -> tuple[float, float, float]:
    """Way [m], pace [m/s] and its rate [m/s²] some time after the profile began.

    Args:
        row: (ACTOR_WIDTH,).
        elapsed: [s], not negative.
    """
    way, pace, left = 0.0, row[PACE_START], elapsed
    for phase in range(PHASES, PHASES + 9, 3):
        duration, slope, jerk = row[phase], row[phase + 1], row[phase + 2]
        t = min(left, duration)
        way += t * (pace + t * (0.5 * slope + t * jerk / 6.0))
        pace += t * (slope + 0.5 * t * jerk)
        if left < duration:
            return way, max(0.0, pace), slope + jerk * t
        left -= duration
    return way + row[PACE_END] * left, row[PACE_END], 0.0


@compiled
def shift_duration(shift: float, lateral_speed: float, shape: float) -> float:
    """Duration of a lane change whose greatest lateral speed is given [s].

    A sinusoid ``d(t) = shift (1 - cos(pi t / T)) / 2`` is fastest half-way, ``pi shift / (2 T)``.

    Args:
        shift: Lateral distance [m].
        lateral_speed: Greatest lateral speed [m/s].
        shape: ``SINUSOIDAL`` or ``LINEAR``.
    """
    duration = abs(shift) / lateral_speed
    return duration * (0.5 * math.pi) if shape == SINUSOIDAL else duration


@compiled
def shift_at(row: Floats, elapsed: float) -> tuple[float, float, float]:
    """Lateral offset [m], its rate [m/s] and acceleration [m/s²] since the lane change began.

    Args:
        row: (ACTOR_WIDTH,).
        elapsed: [s], not negative.
    """
    shift, duration = row[SHIFT], row[SHIFT_DURATION]
    if elapsed >= duration:
        return shift, 0.0, 0.0
    share = elapsed / duration
    if row[SHIFT_SHAPE] == LINEAR:
        return shift * share, shift / duration, 0.0
    omega = math.pi / duration
    sine, cosine = sin_cos(math.pi * share)
    return (
        0.5 * shift * (1.0 - cosine),
        0.5 * shift * omega * sine,
        0.5 * shift * omega * omega * cosine,
    )


@compiled
def advance(segments: Floats, s: float, d: float, way: float) -> float:
    """Move along the road at a lateral place and return the new place along it [m].

    A lane left of the reference line is shorter in a left curve by ``1 - curvature * d``.

    Args:
        segments: (K, 5) reference line.
        s: Place along the road [m].
        d: Lateral place, constant [m].
        way: Distance driven [m], negative against the road's direction.
    """
    last = segments.shape[0] - 1
    k, start = 0, 0.0
    while k < last and s >= start + segments[k, 3]:
        start += segments[k, 3]
        k += 1
    while True:
        # Beyond the centre of a curve there is no place along the road; creep instead.
        factor = max(1e-3, 1.0 - segments[k, 4] * d)
        if way >= 0.0:
            room = (start + segments[k, 3] - s) * factor
            if k == last or way <= room:
                return s + way / factor
            way -= room
            start += segments[k, 3]
            s = start
            k += 1
        else:
            room = (s - start) * factor
            if k == 0 or -way <= room:
                return s + way / factor
            way += room
            s = start
            k -= 1
            start -= segments[k, 3]


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
    step: float,
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
        step: Master clock [s].
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
                step,
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
    step: float,
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
            begun[event] = tick * step
            begin_action(actors[int(actions[event, ACTION_ACTOR])], actions[event], tick)
            began = True
    return began
