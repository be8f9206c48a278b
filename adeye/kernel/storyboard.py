"""Scripted actors in road coordinates: actions begun by triggers, and the motion of a tick.

An actor moves along a base direction with a pace that follows a planned profile; a lane change
adds a lateral offset on top. Pace, way and offset do not accumulate errors over ticks, and the step
does not change where an actor ends.

What has wheels moves sideways only as it moves forward: below a pace at which its lane change would
ask for more than ``STEEPEST`` or for a circle tighter than ``TURNING_RADIUS``, the time of the lane
change runs slower in proportion to the pace, so that its path stays and it stands where it stops.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan, atan2, sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.postfix import Programs, is_satisfied
from adeye.kernel.road import Ground, Grounds, ground_of, lane_center, position
from adeye.kernel.strips import middle_of_lane

# --- Manoeuvres of a scripted actor as closed forms of the time since they began ------------------

Floats = NDArray[np.float64]

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
    SHIFT_SHAPE,  # SINUSOIDAL, LINEAR or CARRIED
    SHIFT_PACE,  # pace below which the time of the lane change runs slower [m/s]
    SHIFT_HELD,  # by how much that time is behind [s]
    SWAY,  # lateral speed in that time [m/s]
    WALKS,  # 1 for who steps sideways without moving forward
    SWAY_PHASES,  # of a carried one: three phases of duration [s], speed [m/s], acceleration [m/s²]
) = range(PHASES + 9, PHASES + 22)
ACTOR_WIDTH: Final = SWAY_PHASES + 9

SINUSOIDAL, LINEAR, CARRIED = range(3)
"""Shapes of a lane change; carried is one that begins with a lateral speed."""

STEEPEST: Final = math.tan(math.radians(30.0))
"""Way to the side over way along the road at the pace at which a lane change slows. Our choice."""

TURNING_RADIUS: Final = 6.0
"""Least radius that the centre of a vehicle drives [m], of a passenger car."""

MOST_DRIFT: Final = 0.2
"""Way to the side over way along the road of the middle of a lane, at most. Our choice."""

LATERAL_ACCELERATION: Final = 3.0
"""With which a lane change that begins with a lateral speed changes it [m/s²]: the most that UN R79
(5.6.2.1.3, table of specified maximum lateral accelerations) has systems for cars declare."""


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
            _plan_with_jerk(row[PHASES : PHASES + 9], pace, slope, coasted, target, rate, jerk)
            return
    change = target - pace
    row[PHASES] = abs(change) / rate
    row[PHASES + 1] = math.copysign(rate, change)


@compiled
def _plan_with_jerk(
    phases: Floats,
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
    phases[0], phases[1], phases[2] = first, slope, sign * first_jerk
    phases[3], phases[4], phases[5] = max(0.0, middle), sign * peak, 0.0
    phases[6], phases[7], phases[8] = peak / jerk, sign * peak, -sign * jerk


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
def plan_shift(row: Floats, tick: int, shift: float, lateral_speed: float, shape: float) -> None:
    """Plan a lane change from the present place and, of a vehicle, its heading.

    Without a lateral speed it is the sinusoid or the line. With one, it is changed with
    ``LATERAL_ACCELERATION`` to the greatest, kept, and taken back to zero at the new place, over
    the place and back if need be. A vehicle in a direction across the road turns into the road's.

    Args:
        row: (ACTOR_WIDTH,) in and out.
        tick: When it begins.
        shift: Lateral distance [m].
        lateral_speed: Greatest lateral speed [m/s].
        shape: ``SINUSOIDAL`` or ``LINEAR``.
    """
    slope, sway = row[ACROSS], row[SWAY]
    if sway != 0.0 and row[WALKS] == 0.0:
        slope += sway / max(row[PACE], row[SHIFT_PACE])
    slope /= abs(row[ALONG]) if row[ALONG] != 0.0 else math.inf
    if row[ACROSS] != 0.0:
        _turn_along(row)
    row[BASE], row[SHIFT], row[SHIFT_TICK] = row[D], shift, tick
    row[SHIFT_SHAPE], row[SHIFT_HELD], row[SHIFT_PACE] = shape, 0.0, 0.0
    row[SHIFT_DURATION] = shift_duration(shift, lateral_speed, shape)
    if row[WALKS] != 0.0:
        return
    bend = 0.0
    if slope != 0.0:
        bend = LATERAL_ACCELERATION
    elif shape == SINUSOIDAL and shift != 0.0:
        bend = 2.0 * lateral_speed * lateral_speed / abs(shift)
    least = max(lateral_speed / STEEPEST, math.sqrt(bend * TURNING_RADIUS))
    if slope != 0.0:
        pace = row[PACE]
        start = slope * max(pace, least)
        least = max(least, min(abs(start) / STEEPEST, pace))
        phases = row[SWAY_PHASES : SWAY_PHASES + 9]
        coasted = start * abs(start) / (2.0 * LATERAL_ACCELERATION)
        _plan_with_jerk(phases, 0.0, start, coasted, shift, lateral_speed, LATERAL_ACCELERATION)
        row[SHIFT_SHAPE], row[SHIFT_DURATION] = CARRIED, phases[0] + phases[3] + phases[6]
    row[SHIFT_PACE] = least


@compiled
def _turn_along(row: Floats) -> None:
    """Take the road's direction for the base, with the pace that there is along it."""
    part = abs(row[ALONG])
    row[ALONG], row[ACROSS] = math.copysign(1.0, row[ALONG]), 0.0
    row[PACE] *= part
    row[PACE_RATE] *= part
    row[PACE_START] *= part
    row[PACE_END] *= part
    row[PATH] *= part
    row[LIMIT] = math.inf
    for phase in range(PHASES, PHASES + 9, 3):
        row[phase + 1] *= part
        row[phase + 2] *= part


@compiled
def shift_time(row: Floats, tick: int, step: float) -> float:
    """Return the time of the lane change at a tick [s], see the module."""
    return (tick - row[SHIFT_TICK]) * step - row[SHIFT_HELD]


@compiled
def hold_shift(row: Floats, tick: int, step: float, driven: float, pace: float) -> float:
    """Slow a lane change over the tick before the given one, and return by which factor at its end.

    Args:
        row: (ACTOR_WIDTH,) in and out, with the pace of the tick before.
        tick: Number of the tick.
        step: Master clock [s].
        driven: Way since the tick before [m].
        pace: At the tick [m/s].
    """
    least, before = row[SHIFT_PACE], row[PACE]
    if pace >= least and before >= least:
        return 1.0
    if shift_time(row, tick - 1, step) >= row[SHIFT_DURATION]:
        return 1.0
    if pace <= 0.0 and before <= 0.0:
        # In whole ticks, so that who stands does not move by as much as a rounding error.
        row[SHIFT_TICK] += 1.0
    elif pace <= least and before <= least:
        row[SHIFT_HELD] += step - driven / least
    else:
        low, high = min(pace, before), max(pace, before)
        row[SHIFT_HELD] += 0.5 * step * (least - low) * (least - low) / ((high - low) * least)
    return min(1.0, pace / least)


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
    if row[SHIFT_SHAPE] == CARRIED:
        offset, left = 0.0, elapsed
        for phase in range(SWAY_PHASES, SWAY_PHASES + 9, 3):
            t, rate, bend = min(left, row[phase]), row[phase + 1], row[phase + 2]
            offset += t * (rate + 0.5 * t * bend)
            if left < row[phase]:
                return offset, rate + bend * t, bend
            left -= row[phase]
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


# --- Scripted actors in road coordinates: actions begun by triggers, and the motion of a tick -----

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Columns of an action.
ACTION_ACTOR, ACTION_KIND, ACTION_TARGET, ACTION_RATE, ACTION_JERK, ACTION_SHAPE = range(6)
ACTION_RELATIVE, ACTION_DELAY = range(6, 8)
"""Variable that a target speed is added to, -1 for none; ticks from its condition to its begin."""
ACTION_LANE: Final = 8
"""Lane on a road told strip by strip whose centre is the target when it begins, -1 for none."""
ACTION_WIDTH: Final = 9
CHANGE_TO, CHANGE_BY, CHANGE_SPEED, CROSS = range(4)
"""Kinds: to a lateral place, by a lateral distance, to a speed, across to a lateral place."""

EVENT_VARIABLES: Final = ("begun", "begun_at", "since", "ended")
"""What a condition may ask of an event, in the order of the variables: each for all events."""

IS_OVER: Final = 1e-9
"""How much earlier than by its plan an action may count as ended [s]: rounding."""

STANDSTILL: Final = 1e-9
"""Speed below which an actor keeps its heading [m/s]."""


class Script(NamedTuple):
    """The storyboard of a batch with V events.

    Attributes:
        actions: (B, V, ACTION_WIDTH).
        programs: Of the triggers.
        numbers: (B, V) program of each event.
        order: (V,) the events in the order in which those of one tick act.
    """

    actions: Floats
    programs: Programs
    numbers: Ints
    order: Ints


class Events(NamedTuple):
    """What has become of the V events of a storyboard.

    Attributes:
        due: (B, V) tick at which each begins, -1 before its condition has held.
        begun: (B, V) times, NaN before, inf for one that is lost.
        ended: (B, V) whether its action has ended or another has taken its place.
    """

    due: Ints
    begun: Floats
    ended: Bools


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
def follow_lanes(
    running: Bools,
    script: Script,
    actors: Floats,
    places: Floats,
    grounds: Grounds,
    objects: Floats,
) -> None:
    """Move actors that keep a lane with its middle, and aim at lanes where they are, over a tick.

    Args:
        running: (B,).
        script: The storyboard; the targets of its lane changes are written.
        actors: (B, A, ACTOR_WIDTH) in and out.
        places: (B, A) where they were along the road [m]; those that follow no storyboard stay.
        grounds: Of B runs, told strip by strip.
        objects: (B, M, 5) out, the first A rows.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        ground = ground_of(grounds, run)
        for actor in range(actors.shape[1]):
            # Asked here, for the call with all that a road has is what costs.
            if actors[run, actor, S] != places[run, actor]:
                _follow_lane(actors[run, actor], ground, places[run, actor], objects[run, actor])
        for event in range(script.actions.shape[1]):
            action = script.actions[run, event]
            if action[ACTION_LANE] >= 0.0:
                s = actors[run, int(action[ACTION_ACTOR]), S]
                action[ACTION_TARGET] = lane_center(ground, s, int(action[ACTION_LANE]))


@compiled
def _follow_lane(row: Floats, ground: Ground, before: float, out: Floats) -> None:
    """Move an actor sideways as far as the middle of its lane has moved since a place before."""
    way = row[S] - before
    if row[ACROSS] != 0.0 or row[WALKS] != 0.0:
        return
    drift = middle_of_lane(ground.slabs, ground.strips, row[S], row[D])
    drift -= middle_of_lane(ground.slabs, ground.strips, before, row[D])
    # Where another lane begins under it, or none is, it keeps its place.
    if drift == 0.0 or not abs(drift) <= MOST_DRIFT * abs(way):
        return
    row[D] += drift
    row[BASE] += drift
    row[HEADING] += atan(drift / way)
    write_actor(row, ground.segments, out[3], out[4], out)


@compiled
def end_actions(
    running: Bools, script: Script, tick: int, step: float, events: Events, actors: Floats
) -> None:
    """Note which actions have come to their end at a tick.

    Args:
        running: (B,).
        script: The storyboard.
        tick: Number of the tick.
        step: Master clock [s].
        events: In and out.
        actors: (B, A, ACTOR_WIDTH).
    """
    begun, ended = events.begun, events.ended
    for run in range(running.shape[0]):
        for event in range(begun.shape[1]):
            if running[run] and math.isfinite(begun[run, event]) and not ended[run, event]:
                action = script.actions[run, event]
                row = actors[run, int(action[ACTION_ACTOR])]
                ended[run, event] = is_over(row, int(action[ACTION_KIND]), tick, step)


@compiled
def begin_events(
    running: Bools,
    script: Script,
    variables: Floats,
    first_event: int,
    tick: int,
    now: float,
    events: Events,
    actors: Floats,
) -> None:
    """Begin every event whose condition first holds at a tick, or did a delay ago.

    Events that wait for others to begin see them at the same tick: the conditions are evaluated
    again until no further event begins. Of two that begin at one tick and of which one takes the
    place of the other, the later in the order acts; the other is lost.

    Args:
        running: (B,).
        script: The storyboard.
        variables: (B, W) trigger variables at the tick, in and out (``EVENT_VARIABLES``).
        first_event: Column of the first variable of the first event.
        tick: Number of the tick.
        now: Its time [s].
        events: In and out.
        actors: (B, A, ACTOR_WIDTH) in and out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        begun, began = events.begun[run], False
        while _begin_events_once(script, run, variables[run], tick, now, events):
            began = True
            _tell_events(variables[run], first_event, now, begun, events.ended[run])
        if not began:
            continue
        for event in script.order:
            if begun[event] == now:
                action, other = script.actions[run, event], 0.0
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
    script: Script, run: int, variables: Floats, tick: int, now: float, events: Events
) -> bool:
    due, begun = events.due[run], events.begun[run]
    began = False
    for event in range(begun.shape[0]):
        if not math.isnan(begun[event]):
            continue
        if due[event] < 0 and is_satisfied(script.programs, script.numbers[run, event], variables):
            due[event] = tick + int(script.actions[run, event, ACTION_DELAY])
        if 0 <= due[event] <= tick:
            begun[event] = now
            began = True
    if began:
        _take_places(script.actions[run], script.order, now, begun, events.ended[run])
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
