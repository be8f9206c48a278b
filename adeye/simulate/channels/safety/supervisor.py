"""The safety channel with a supervisor: monitors of its own choice, levels, manoeuvres.

Monitors are small functions of one interface. Every one takes its rule and the evidence of one run,
and tells whether it fires. What is missing or no number makes it fire; at the start, what has never
been there is waited for as long as it may be old.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.kernel.criticality import rss_longitudinal_distance
from adeye.kernel.elementary import sin_cos, tan
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import REST_AREA as REST_AREA_KIND
from adeye.kernel.road import far_edge, ground_of, lane_way, place_on, right_edge, shoulder_width
from adeye.kernel.stops import ANYWHERE, ONLY_REST_AREA, ROADSIDE, STOP_LEVELS
from adeye.signals import (
    DEGRADED,
    FAULT,
    MANOEUVRE_MONITORS,
    OK,
    REFUGE_KIND,
    REFUGE_S,
    Floats,
    Ints,
    spec_columns,
)
from adeye.simulate.channels.corridor import PATH_GAP, PATH_SPEED, extent_of, offset_from_corridor
from adeye.simulate.channels.links import linked_channels
from adeye.simulate.channels.perception import tracks as columns
from adeye.simulate.channels.perception.pose import (
    MAX_AGE,
    POSE_ACCELERATION,
    POSE_ALIGN,
    POSE_D,
    POSE_HEADING,
    POSE_S,
    POSE_SPEED,
    POSE_X,
    POSE_Y,
    POSE_YAW_RATE,
)
from adeye.simulate.channels.perception.step import NOTE_END
from adeye.simulate.channels.safety import in_lane, planned_stop
from adeye.simulate.channels.safety.in_lane import Batch
from adeye.simulate.channels.safety.planned_stop import PlannedSafetyChannel, Plans
from adeye.simulate.channels.trajectory.cost import Others
from adeye.spec.architecture import HEALTH
from adeye.spec.supervisor import KINDS, MANOEUVRES, Monitor

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.ports import ChannelContext
    from adeye.signals import Bools, Observation
    from adeye.simulate.channels.hooks import Shown
    from adeye.spec.channels import SafetyParameters
    from adeye.spec.supervisor import Supervisor

# --- The kinds of monitors of a supervisor: small functions of one interface ----------------------

(
    CHANNEL_SILENT,
    CHANNEL_IMPLAUSIBLE,
    CHANNEL_STUCK,
    SENSOR_SILENT,
    OFF_ROAD,
    LANE_DEPARTURE,
    OBJECT_DANGER,
    CRITICAL_AREA,
    RSS_DANGER,
    ODD_EXIT,
    LAST_SAFE_STOP,
) = range(11)
"""Kinds, in the order of ``spec.supervisor.KINDS``."""

# Columns of a rule: what a monitor is, and from RULE_FIRST on its thresholds in the order of
# ``THRESHOLDS``.
(
    RULE_KIND,
    RULE_LEVEL,
    RULE_INCREMENT,
    RULE_DECREMENT,
    RULE_FAULT,
    RULE_HEAL,
    RULE_FIRST,
) = range(7)
RULE_ROW: Final = RULE_FIRST + 5

# Columns of what is known of a watched sensor.
(
    SENSOR_STAMP,  # of its newest sample [s], -1 before the first
    SENSOR_CAME,  # when the newest valid sample was first seen [s], 0 before the first
) = range(2)
SENSOR_ROW: Final = 2

# Columns of what is remembered of a channel's commands.
(
    CHANGE_ACCELERATION,  # of the newest command [m/s²]
    CHANGE_STEERING,  # [rad]
    CHANGE_STAMP,  # [s], -1 before the first
    CHANGE_JERK,  # largest since the monitors were asked [m/s³]
    CHANGE_RATE,  # of the steering angle [rad/s]
    CHANGE_SINCE,  # when the newest command was first given [s]
) = range(6)
CHANGE_ROW: Final = 6

_TIME_TOLERANCE: Final = 1e-9

assert len(KINDS) == LAST_SAFE_STOP + 1


class Watch(NamedTuple):
    """What the monitors of a batch look at beside ``in_lane.Batch``.

    Attributes:
        rules: (B, Q, RULE_ROW).
        watched: (Q, W) numbers of the channels or sensors that each watches, -1 for none.
        stamps: (B, H) time of the newest sample of each watched sensor [s].
        alive: (B, H) whether it delivers.
        sensors: (B, H, SENSOR_ROW) what is known of them; in and out.
        changes: (B, N, CHANGE_ROW) what is remembered of the linked channels; in and out.
        known: (B,) whether the ego has ever known where it is; in and out.
    """

    rules: Floats
    watched: Ints
    stamps: Floats
    alive: Bools
    sensors: Floats
    changes: Floats
    known: Bools


@inlined
def remember(batch: Batch, watch: Watch, run: int, time: float, knows_pose: bool) -> None:  # noqa: FBT001 - a kernel
    """Take down at every tick of the channel what the monitors ask for later."""
    if knows_pose:
        watch.known[run] = True
    for row in range(watch.stamps.shape[1]):
        sensor, stamp = watch.sensors[run, row], watch.stamps[run, row]
        if watch.alive[run, row] and stamp > sensor[SENSOR_STAMP]:
            sensor[SENSOR_CAME] = time
        sensor[SENSOR_STAMP] = stamp
    for channel in range(batch.numbers.shape[1]):
        if batch.heard[run, channel]:
            _compare(batch.numbers[run, channel], watch.changes[run, channel])


@inlined
def _compare(numbers: Floats, change: Floats) -> None:
    """Compare a command (3,) with the one before, and keep it."""
    age, is_first = numbers[2] - change[CHANGE_STAMP], change[CHANGE_STAMP] < 0.0
    if not age > 0.0:
        return
    other = abs(numbers[0] - change[CHANGE_ACCELERATION])
    turned = abs(numbers[1] - change[CHANGE_STEERING])
    if is_first or other + turned != 0.0:
        change[CHANGE_SINCE] = numbers[2]
    # A comparison with what is no number must not let it pass.
    if not (is_first or other / age <= change[CHANGE_JERK]):
        change[CHANGE_JERK] = other / age
    if not (is_first or turned / age <= change[CHANGE_RATE]):
        change[CHANGE_RATE] = turned / age
    change[CHANGE_ACCELERATION], change[CHANGE_STEERING] = numbers[0], numbers[1]
    change[CHANGE_STAMP] = numbers[2]


@inlined
def forget_changes(watch: Watch, run: int) -> None:
    """Begin to look for the largest changes anew."""
    for channel in range(watch.changes.shape[1]):
        watch.changes[run, channel, CHANGE_JERK] = 0.0
        watch.changes[run, channel, CHANGE_RATE] = 0.0


@inlined
def channel_silent(batch: Batch, run: int, channel: int, time: float, rule: Floats) -> bool:
    """Fire when a channel is in fault, or its command is too old."""
    timeout = rule[RULE_FIRST] + _TIME_TOLERANCE
    if not batch.heard[run, channel]:
        return bool(time > timeout)
    is_fresh = time - batch.numbers[run, channel, 2] <= timeout
    return bool(batch.channel_status[run, channel] == FAULT or not is_fresh)


@inlined
def channel_implausible(batch: Batch, watch: Watch, run: int, channel: int, rule: Floats) -> bool:
    """Fire when a command is no number, out of range, too quick, or no turn that is driven."""
    if not batch.heard[run, channel]:
        return False
    record, pose, change = (
        batch.seen.records[run],
        batch.seen.pose[run],
        watch.changes[run, channel],
    )
    acceleration, steering = batch.numbers[run, channel, 0], batch.numbers[run, channel, 1]
    if not (
        abs(acceleration) <= rule[RULE_FIRST]
        and abs(steering) <= record["max_steering_angle"] + _TIME_TOLERANCE
    ):
        return True
    speed = pose[POSE_SPEED]
    asked = speed * speed * tan(steering) / record["wheelbase"]
    error = asked - speed * pose[POSE_YAW_RATE]
    if batch.memory[run, in_lane.MEMORY_STOPPING] > 0.0:
        # Another manoeuvre is driven than the one that it asks for.
        error = 0.0
    is_plausible = (
        abs(asked) <= rule[RULE_FIRST + 1]
        and abs(error) <= rule[RULE_FIRST + 2]
        and change[CHANGE_JERK] <= rule[RULE_FIRST + 3]
        and change[CHANGE_RATE] <= rule[RULE_FIRST + 4]
    )
    return not is_plausible


@inlined
def channel_stuck(batch: Batch, watch: Watch, run: int, channel: int, rule: Floats) -> bool:
    """Fire when a moving vehicle is given the same command for too long, to the bit."""
    if not batch.heard[run, channel]:
        return False
    change = watch.changes[run, channel]
    held = change[CHANGE_STAMP] - change[CHANGE_SINCE]
    is_alive = held < rule[RULE_FIRST] - _TIME_TOLERANCE
    is_number = not math.isnan(change[CHANGE_ACCELERATION] + change[CHANGE_STEERING])
    return not (is_number and (is_alive or batch.seen.pose[run, POSE_SPEED] < rule[RULE_FIRST + 1]))


@inlined
def sensor_silent(watch: Watch, run: int, sensor: int, time: float, rule: Floats) -> bool:
    """Fire when no new sample has come for too long, or the newest one is too old."""
    known = watch.sensors[run, sensor]
    waited = time - known[SENSOR_CAME] <= rule[RULE_FIRST] + _TIME_TOLERANCE
    stamp = known[SENSOR_STAMP]
    is_young = stamp < 0.0 or time - stamp <= rule[RULE_FIRST + 1] + _TIME_TOLERANCE
    return not (waited and is_young)


@inlined
def off_road(batch: Batch, run: int, rule: Floats) -> bool:
    """Fire when the centre of the ego is where nothing carries a vehicle."""
    ground, pose = ground_of(batch.seen.grounds, run), batch.seen.pose[run]
    right, left = right_edge(ground, pose[POSE_S]), far_edge(ground, pose[POSE_S])
    return not right - rule[RULE_FIRST] <= pose[POSE_D] <= left + rule[RULE_FIRST]


@inlined
def lane_departure(batch: Batch, rule: Floats) -> bool:
    """Fire when the ego is too far from its lane or from the stop that is driven."""
    seen = batch.evidence
    is_near = abs(seen[in_lane.SEEN_OFFSET]) <= rule[RULE_FIRST]
    return not (is_near and seen[in_lane.SEEN_ON_LANES] > 0.0)


@inlined
def object_danger(batch: Batch, rule: Floats) -> bool:
    """Fire when an object in the path requires a deceleration from the threshold on."""
    return not batch.evidence[in_lane.SEEN_REQUIRED] < rule[RULE_FIRST]


@inlined
def critical_area(batch: Batch, run: int, rule: Floats) -> bool:
    """Fire when an object is in the strip that the ego is about to drive over.

    The strip lies along the road, about the line from the ego to the centre of its path, from the
    rear of the ego on.

    Args:
        batch: What is read.
        run: Which row is meant.
        rule: Its length is that of the ego and what it drives in a time [s], and its width is given
            in widths of the ego.
    """
    record, pose, tracks = batch.seen.records[run], batch.seen.pose[run], batch.seen.tracks[run]
    time, width_factor = rule[RULE_FIRST], rule[RULE_FIRST + 1]
    sine, cosine = sin_cos(pose[POSE_HEADING])
    road = pose[POSE_HEADING] - pose[POSE_ALIGN]
    behind = -0.5 * record["length"]
    ahead = 0.5 * record["length"] + pose[POSE_SPEED] * time
    half = 0.5 * width_factor * record["width"]
    ground = ground_of(batch.seen.grounds, run)
    for row in range(int(batch.seen.notes[run, NOTE_END])):
        track = tracks[row]
        if track[columns.TRACK_HITS] < record["confirm_hits"]:
            continue
        x = pose[POSE_X] + cosine * track[columns.TRACK_X] - sine * track[columns.TRACK_Y]
        y = pose[POSE_Y] + sine * track[columns.TRACK_X] + cosine * track[columns.TRACK_Y]
        s, d, heading, _ = place_on(ground, x, y)
        way = lane_way(pose[POSE_S], road, pose[POSE_D], s, heading)
        aside = abs(offset_from_corridor(d, batch.memory[run, in_lane.MEMORY_PATH], pose[POSE_D]))
        turn_sine, turn_cosine = sin_cos(pose[POSE_HEADING] - heading)
        forward = turn_cosine * track[columns.TRACK_VX] - turn_sine * track[columns.TRACK_VY]
        sideways = turn_sine * track[columns.TRACK_VX] + turn_cosine * track[columns.TRACK_VY]
        long, wide = extent_of(track, forward, sideways, ground)
        is_clear = (
            way - 0.5 * long >= ahead or way + 0.5 * long <= behind or aside - 0.5 * wide >= half
        )
        if not is_clear:
            return True
    return math.isnan(ahead + half)


@inlined
def rss_danger(batch: Batch, run: int, rule: Floats) -> bool:
    """Fire when the object ahead is nearer than the longitudinal safe distance of RSS."""
    safe = rss_longitudinal_distance(
        batch.seen.pose[run, POSE_SPEED],
        batch.path[PATH_SPEED],
        rule[RULE_FIRST],
        rule[RULE_FIRST + 1],
        rule[RULE_FIRST + 2],
        rule[RULE_FIRST + 3],
    )
    return not batch.path[PATH_GAP] >= safe


@inlined
def odd_exit(batch: Batch, run: int, rule: Floats) -> bool:
    """Fire when the ego leaves a speed or a part of the road."""
    pose = batch.seen.pose[run]
    is_inside = (
        pose[POSE_SPEED] <= rule[RULE_FIRST]
        and rule[RULE_FIRST + 1] <= pose[POSE_S] <= rule[RULE_FIRST + 2]
        and rule[RULE_FIRST + 3] <= pose[POSE_D] <= rule[RULE_FIRST + 4]
    )
    return not is_inside


@inlined
def of_watched(batch: Batch, watch: Watch, run: int, monitor: int, time: float) -> bool:
    """Tell whether a monitor of channels or sensors fires for any that it watches."""
    rule = watch.rules[run, monitor]
    kind = int(rule[RULE_KIND])
    for place in range(watch.watched.shape[1]):
        number = watch.watched[monitor, place]
        if number < 0:
            break
        if kind == CHANNEL_SILENT:
            fires = channel_silent(batch, run, number, time, rule)
        elif kind == CHANNEL_IMPLAUSIBLE:
            fires = channel_implausible(batch, watch, run, number, rule)
        elif kind == CHANNEL_STUCK:
            fires = channel_stuck(batch, watch, run, number, rule)
        else:
            fires = sensor_silent(watch, run, number, time, rule)
        if fires:
            return True
    return False


@inlined
def of_scene(batch: Batch, run: int, rule: Floats) -> bool:
    """Tell whether a monitor of the scene fires; the ego knows where it is."""
    kind = int(rule[RULE_KIND])
    if kind == OFF_ROAD:
        return off_road(batch, run, rule)
    if kind == LANE_DEPARTURE:
        return lane_departure(batch, rule)
    if kind == OBJECT_DANGER:
        return object_danger(batch, rule)
    if kind == CRITICAL_AREA:
        return critical_area(batch, run, rule)
    if kind == RSS_DANGER:
        return rss_danger(batch, run, rule)
    return odd_exit(batch, run, rule)


@inlined
def misses_pose(watch: Watch, run: int, time: float, knows_pose: bool) -> bool:  # noqa: FBT001 - a kernel
    """Tell whether a place that the ego should know by now is missing."""
    return not knows_pose and (watch.known[run] or time > MAX_AGE + _TIME_TOLERANCE)


@inlined
def count(state: Ints, fires: bool, rule: Floats) -> bool:  # noqa: FBT001 - a kernel
    """Count one evaluation of a monitor between the ends of its counter.

    Args:
        state: (STATE_WIDTH,) count and whether it is confirmed; in and out.
        fires: Whether the monitor fires.
        rule: (RULE_ROW,).

    Returns:
        Whether it is confirmed: from the upper end on, until the lower one is reached.
    """
    step = int(rule[RULE_INCREMENT]) if fires else -int(rule[RULE_DECREMENT])
    upper, lower = int(rule[RULE_FAULT]), int(rule[RULE_HEAL])
    state[0] = min(upper, max(lower, state[0] + step))
    if state[0] == upper:
        state[1] = 1
    elif state[0] == lower:
        state[1] = 0
    return bool(state[1] > 0)


@inlined
def steps_to_confirm(rule: Floats) -> float:
    """Return how many evaluations in a row confirm a monitor that is healed."""
    return float(np.ceil((rule[RULE_FAULT] - rule[RULE_HEAL]) / rule[RULE_INCREMENT]))


# --- Minimal-risk manoeuvres of a supervisor: which is asked for, and which is in force -----------

NONE, CONTINUE, REST_AREA, ROADSIDE_PARKING, STOP = range(5)
"""No manoeuvre, and those of ``spec.supervisor.MANOEUVRES`` in their order."""

assert len(MANOEUVRES) == STOP

# Columns of the settings.
(
    SET_EVERY,  # ticks of the channel from one evaluation of the monitors to the next
    SET_PATIENCE,  # [s]
    SET_LEAST,  # how far ahead a rest area must be [m]
    SET_SIGHT,  # how far ahead the map is searched [m]
    SET_OF_LEVEL,  # manoeuvre of level 1; those of the others follow
) = range(5)
SET_ROW: Final = 8

# Columns of the state.
(
    FORCE_ASKED,  # manoeuvre that the highest level asks for
    FORCE_HELD,  # that which is in force
    FORCE_WAITED,  # since it is [s]
    FORCE_LEVEL,  # highest level among the confirmed monitors, 0 for none
    FORCE_LEFT,  # ticks until the monitors are asked again
) = range(5)
FORCE_ROW: Final = 5


class Force(NamedTuple):
    """What decides about manoeuvres.

    Attributes:
        settings: (B, SET_ROW).
        state: (B, FORCE_ROW) in and out.
    """

    settings: Floats
    state: Floats


@inlined
def ask(state: Floats, settings: Floats, stopping: bool, period: float) -> None:  # noqa: FBT001 - a kernel
    """Take the manoeuvre that the level asks for.

    What has given way stays so while the level is the same; a lower level begins anew. Once the
    channel has taken over, the manoeuvre only becomes harder.

    Args:
        state: (FORCE_ROW,) in and out.
        settings: (SET_ROW,).
        stopping: Whether the channel has taken over.
        period: Since the previous call [s].
    """
    level = int(state[FORCE_LEVEL])
    asked = settings[SET_OF_LEVEL + level - 1] if level > 0 else float(NONE)
    held = state[FORCE_HELD]
    begins_anew = asked < state[FORCE_ASKED] and not stopping
    wanted = asked if begins_anew else max(held, asked)
    state[FORCE_ASKED], state[FORCE_HELD] = asked, wanted
    state[FORCE_WAITED] = (
        state[FORCE_WAITED] + period if wanted == held and not begins_anew else 0.0
    )


@inlined
def give_way(state: Floats, settings: Floats, has_rest_area: bool, has_parking: bool) -> None:  # noqa: FBT001 - a kernel
    """Let what cannot be had, or not in time, give way to the next manoeuvre.

    Args:
        state: (FORCE_ROW,) in and out.
        settings: (SET_ROW,).
        has_rest_area: Whether the map shows one ahead.
        has_parking: Whether the map shows a place to park at the side ahead.
    """
    if state[FORCE_HELD] == REST_AREA and not (has_rest_area and _is_patient(state, settings)):
        state[FORCE_HELD], state[FORCE_WAITED] = ROADSIDE_PARKING, 0.0
    if state[FORCE_HELD] == ROADSIDE_PARKING and not (has_parking and _is_patient(state, settings)):
        state[FORCE_HELD], state[FORCE_WAITED] = STOP, 0.0


@inlined
def look_ahead(settings: Floats, refuges: Floats, s: float) -> int:
    """Return the best kind of place to stop in that the map shows ahead.

    Args:
        settings: (SET_ROW,).
        refuges: (R, 5) parking bays and rest areas, see ``signals.REFUGE_COLUMNS``.
        s: Of the ego along the road [m].

    Returns:
        ``ONLY_REST_AREA``, ``ROADSIDE`` for a parking bay, ``ANYWHERE`` for neither.
    """
    best = ANYWHERE
    for row in range(refuges.shape[0]):
        ahead = refuges[row, REFUGE_S] - s
        if settings[SET_LEAST] < ahead <= settings[SET_SIGHT]:
            is_rest_area = refuges[row, REFUGE_KIND] == REST_AREA_KIND
            best = max(best, ONLY_REST_AREA if is_rest_area else ROADSIDE)
    return best


@inlined
def _is_patient(state: Floats, settings: Floats) -> bool:
    return bool(state[FORCE_WAITED] <= settings[SET_PATIENCE] + 1e-9)


@inlined
def show_manoeuvre(state: Floats, shown: Bools) -> None:
    """Write the columns of the manoeuvres (3, 2): asked for, and in force."""
    for row in range(3):
        shown[row, 0] = state[FORCE_ASKED] == REST_AREA + row
        shown[row, 1] = state[FORCE_HELD] == REST_AREA + row


# --- The supervised channel at one tick: ask the monitors, choose a manoeuvre, give a command -----

CHANNEL_KINDS: Final = SENSOR_SILENT
"""Kinds up to this one watch channels or sensors; the ones after it the scene."""

_UNHURRIED: Final = 1
"""Hardest level of the library of stops that brakes no harder than the stop deceleration."""


@inlined
def supervised_step(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    watch: Watch,
    force: Force,
    run: int,
    time: float,
    planned: bool,  # noqa: FBT001 - a kernel
    shows: bool,  # noqa: FBT001 - a kernel
) -> int:
    """Decide one run at one tick.

    Args:
        batch: What it reads and writes.
        plans: And of the stops.
        watch: And of the monitors.
        force: And of the manoeuvres.
        run: Which row is meant.
        time: [s].
        planned: Whether it plans its stops; without, it stops in its lane.
        shows: Whether somebody looks at the stops.

    Returns:
        OK; DEGRADED while a monitor is confirmed and the nominal channel is to go on;
        REQUESTS_AUTHORITY; or FAULT without a recent ego estimate.
    """
    state, memory, kept = force.state[run], batch.memory[run], plans.kept[run]
    knows_pose = in_lane.perceive(batch, run, time)
    others = Others(plans.others.objects[:0], plans.others.ways[:0])
    if knows_pose and planned:
        others = planned_stop.foresee(batch, plans, run)
    remember(batch, watch, run, time, knows_pose)
    if state[FORCE_LEFT] <= 0.0:
        state[FORCE_LEFT] = force.settings[run, SET_EVERY]
        _ask_monitors(batch, plans, watch, force, run, time, others, knows_pose)
    state[FORCE_LEFT] -= 1.0
    ask(
        state,
        force.settings[run],
        memory[in_lane.MEMORY_STOPPING] > 0.0,
        batch.seen.records[run]["period"],
    )
    if not knows_pose:
        kept[planned_stop.KEPT_STOP] = planned_stop.NO_STOP
        show_manoeuvre(state, batch.monitors[run, watch.rules.shape[1] :])
        return in_lane.coast(batch, run)
    _choose(batch, plans, force, run, others, planned, shows)
    show_manoeuvre(state, batch.monitors[run, watch.rules.shape[1] :])
    if memory[in_lane.MEMORY_STOPPING] <= 0.0:
        told = in_lane.shadow(batch, run, False)  # noqa: FBT003 - a kernel
    else:
        requests = state[FORCE_ASKED] >= REST_AREA
        is_danger = _is_danger(batch, watch, run)
        if planned:
            told = planned_stop.drive_stop(batch, plans, run, requests, is_danger)
        else:
            told = in_lane.stop_in_lane(batch, run, requests, is_danger)
    return DEGRADED if told == OK and state[FORCE_LEVEL] > 0.0 else told


@inlined
def _ask_monitors(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    watch: Watch,
    force: Force,
    run: int,
    time: float,
    others: Others,
    knows_pose: bool,  # noqa: FBT001 - a kernel
) -> None:
    """Ask every monitor, count, and find the highest level among the confirmed ones."""
    level = 0.0
    period = batch.seen.records[run]["period"]
    for monitor in range(watch.rules.shape[1]):
        rule = watch.rules[run, monitor]
        kind = int(rule[RULE_KIND])
        asks_pose = kind in (CHANNEL_IMPLAUSIBLE, CHANNEL_STUCK) or kind > CHANNEL_KINDS
        fires = asks_pose and misses_pose(watch, run, time, knows_pose)
        if kind <= CHANNEL_KINDS:
            fires = fires or of_watched(batch, watch, run, monitor, time)
        elif knows_pose and kind == LAST_SAFE_STOP:
            # One tick more, and the evaluations in which the monitor is confirmed.
            wait = (steps_to_confirm(rule) * force.settings[run, SET_EVERY] + 1.0) * period
            fires = planned_stop.is_last_stop(batch, plans, run, others, wait)
        elif knows_pose:
            fires = of_scene(batch, run, rule)
        counted = batch.states[run, monitor]
        if counted[in_lane.STATE_FROZEN]:
            fires = counted[in_lane.STATE_RAW] > 0
        else:
            counted[in_lane.STATE_RAW] = fires
            count(counted, fires, rule)
        confirmed = counted[in_lane.STATE_CONFIRMED] > 0
        batch.monitors[run, monitor, 0] = fires
        batch.monitors[run, monitor, 1] = confirmed
        if confirmed:
            level = max(level, rule[RULE_LEVEL])
    force.state[run, FORCE_LEVEL] = level
    forget_changes(watch, run)


@inlined
def _choose(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    force: Force,
    run: int,
    others: Others,
    planned: bool,  # noqa: FBT001 - a kernel
    shows: bool,  # noqa: FBT001 - a kernel
) -> None:
    """Take over where the manoeuvre wants it, and choose a stop for it."""
    state, memory, kept = force.state[run], batch.memory[run], plans.kept[run]
    was_stopping = memory[in_lane.MEMORY_STOPPING] > 0.0
    if not was_stopping:
        record, settings = batch.seen.records[run], force.settings[run]
        ground, s = ground_of(batch.seen.grounds, run), batch.seen.pose[run, POSE_S]
        shown = look_ahead(settings, ground.refuges, s)
        has_parking = shown > ANYWHERE or shoulder_width(ground, s) >= record["width"]
        give_way(state, settings, planned and shown == ONLY_REST_AREA, planned and has_parking)
    held = int(state[FORCE_HELD])
    if was_stopping:
        takes = state[FORCE_ASKED] >= REST_AREA
    elif held in (REST_AREA, ROADSIDE_PARKING):
        # Nothing hurries it, so a stop that brakes harder than the usual one is waited out.
        stop = _stop_of(batch, plans, run, others, held)
        takes = stop != planned_stop.NO_STOP and stop % STOP_LEVELS <= _UNHURRIED
    else:
        takes = held == STOP
    in_lane.update_stopping(
        memory, takes, batch.reason[run], batch.seen.pose[run, POSE_ACCELERATION]
    )
    if memory[in_lane.MEMORY_STOPPING] <= 0.0:
        kept[planned_stop.KEPT_STOP] = planned_stop.NO_STOP
        if was_stopping:
            state[FORCE_HELD] = state[FORCE_ASKED]
        if shows:
            planned_stop.ask_for_stop(
                batch, plans, run, others, ANYWHERE, 0.0, planned_stop.NO_STOP
            )
    elif planned:
        stop = _stop_of(batch, plans, run, others, held)
        if stop == planned_stop.NO_STOP:
            # What was begun can be had no more.
            state[FORCE_HELD] = STOP
            stop = _stop_of(batch, plans, run, others, STOP)
        planned_stop.take_stop(plans, run, stop)


@inlined
def _stop_of(batch: Batch, plans: Plans, run: int, others: Others, manoeuvre: int) -> int:
    """Choose a stop that a manoeuvre allows, ``NO_STOP`` if none is feasible."""
    places = ANYWHERE
    if manoeuvre == REST_AREA:
        places = ONLY_REST_AREA
    elif manoeuvre == ROADSIDE_PARKING:
        places = ROADSIDE
    kept = int(plans.kept[run, planned_stop.KEPT_STOP])
    stop = planned_stop.ask_for_stop(batch, plans, run, others, places, 0.0, kept)
    is_hurried = stop != planned_stop.NO_STOP and stop % STOP_LEVELS > _UNHURRIED
    if places != ANYWHERE and kept != planned_stop.NO_STOP and is_hurried:
        # A better place is not worth a harder braking.
        is_had = plans.found[kept, planned_stop.FOUND_FEASIBLE] > 0.0
        return kept if is_had and plans.found[kept, planned_stop.FOUND_PLACE] >= places else stop
    return stop


@inlined
def _is_danger(batch: Batch, watch: Watch, run: int) -> bool:
    """Tell whether an object ahead is a confirmed danger."""
    for monitor in range(watch.rules.shape[1]):
        is_kind = watch.rules[run, monitor, RULE_KIND] == OBJECT_DANGER
        if is_kind and batch.states[run, monitor, in_lane.STATE_CONFIRMED] > 0:
            return True
    return False


# --- The safety channel with a supervisor: monitors of its own choice, levels, manoeuvres ---------

_ENDLESS: Final = math.inf

THRESHOLDS: Final[Mapping[str, Mapping[str, float]]] = {
    "channel_silent": {"timeout": _ENDLESS},
    "channel_implausible": dict.fromkeys(
        (
            *("max_acceleration", "max_lateral_acceleration", "max_lateral_error"),
            *("max_jerk", "max_steering_rate"),
        ),
        _ENDLESS,
    ),
    "channel_stuck": {"timeout": _ENDLESS, "min_speed": 0.0},
    "sensor_silent": {"timeout": _ENDLESS, "max_age": _ENDLESS},
    "off_road": {"margin": 0.0},
    "lane_departure": {"max_offset": _ENDLESS},
    "object_danger": {"threshold": _ENDLESS},
    "critical_area": {"time": 0.0, "width_factor": 0.0},
    "rss_danger": dict.fromkeys(
        ("response_time", "acceleration", "least_braking", "most_braking"), 0.0
    ),
    "odd_exit": {
        "max_speed": _ENDLESS,
        "from_s": -_ENDLESS,
        "to_s": _ENDLESS,
        "from_d": -_ENDLESS,
        "to_d": _ENDLESS,
    },
    "last_safe_stop": {},
}
"""Thresholds of each kind in the order of a rule's columns, and what stands for one not given."""


class SupervisedSafetyChannel(PlannedSafetyChannel):
    """Supervises with the monitors that its parameters name, and does what their levels ask for.

    The monitors are asked at the supervisor's rate; each is confirmed and cleared by its counter.
    The highest level among the confirmed ones asks for a manoeuvre: to go on, to go on until a rest
    area or a place at the side of the road can be reached, or to stop at once. Three columns beside
    the monitors tell which is asked for, and which is in force.
    """

    def __init__(self, parameters: SafetyParameters) -> None:
        """Take the monitors from the parameters of any run; they are structure.

        Args:
            parameters: With a supervisor.
        """
        supervisor = _of(parameters)
        self._names = tuple(supervisor.monitors)
        self._watches = tuple(
            tuple(getattr(monitor, "watches", ())) for monitor in supervisor.monitors.values()
        )
        self._kinds = tuple(monitor.kind for monitor in supervisor.monitors.values())
        self._is_planned = parameters.stop == "planned"
        self.monitor_ids = (*self._names, *MANOEUVRE_MONITORS)

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        super().reset(context)
        runs, count = context.runs, len(self._names)
        columns = spec_columns(context.parameters, self._numbers_of)
        shape = (runs, count, RULE_ROW)
        rules = np.zeros(shape)
        for row in range(count):
            for column in range(RULE_ROW):
                rules[:, row, column] = columns[f"{row}/{column}"]
        settings = np.stack([columns[f"set/{column}"] for column in range(SET_ROW)], axis=1)
        settings[:, SET_EVERY] = np.round(1.0 / (settings[:, SET_EVERY] * context.period))
        for row in range(count):
            # A monitor begins healed.
            self._batch.states[:, row, 0] = rules[:, row, RULE_FIRST - 1].astype(np.int64)
        self._sensors, watched = self._wire(context)
        sensors, channels = len(self._sensors), len(linked_channels(context.links))
        known = np.zeros((runs, sensors, SENSOR_ROW))
        known[:, :, SENSOR_STAMP] = -1.0
        changes = np.zeros((runs, channels, CHANGE_ROW))
        changes[:, :, CHANGE_STAMP] = -1.0
        self._watch = Watch(
            rules=rules,
            watched=watched,
            stamps=np.full((runs, sensors), -1.0),
            alive=np.ones((runs, sensors), dtype=np.bool_),
            sensors=known,
            changes=changes,
            known=np.zeros(runs, dtype=np.bool_),
        )
        self._force = Force(settings, np.zeros((runs, FORCE_ROW)))

    def _wire(self, context: ChannelContext) -> tuple[tuple[str, ...], Ints]:
        """Return the links of the watched sensors, and what each monitor watches by number."""
        channels = linked_channels(context.links)
        sensors: list[str] = []
        widest = max([1, *map(len, self._watches)])
        watched = np.full((len(self._names), widest), -1, dtype=np.int64)
        for row, (kind, names) in enumerate(zip(self._kinds, self._watches, strict=True)):
            for place, name in enumerate(names):
                if kind != "sensor_silent":
                    watched[row, place] = channels.index(name)
                    continue
                link = f"{HEALTH}{name}" if f"{HEALTH}{name}" in context.links else name
                if link not in sensors:
                    sensors.append(link)
                watched[row, place] = sensors.index(link)
        return tuple(sensors), watched

    def _numbers_of(self, parameters: SafetyParameters) -> dict[str, float]:
        supervisor = _of(parameters)
        numbers: dict[str, float] = {}
        for row, (name, monitor) in enumerate(supervisor.monitors.items()):
            for column, value in enumerate(_rule(supervisor, name, monitor)):
                numbers[f"{row}/{column}"] = value
        asked = [float(MANOEUVRES.index(word) + 1) for word in supervisor.manoeuvres.values()]
        first = [supervisor.rate, supervisor.patience, supervisor.least_distance, supervisor.sight]
        assert len(first) == SET_OF_LEVEL
        return numbers | {f"set/{column}": value for column, value in enumerate(first + asked)}

    def _read(self, observation: Observation) -> None:
        super()._read(observation)
        for row, link in enumerate(self._sensors):
            measurement = observation.measurements[link]
            self._watch.stamps[:, row] = measurement.stamp
            self._watch.alive[:, row] = measurement.alive

    def _step(self, time: float) -> None:
        _act(
            self._batch,
            self._plans,
            self._watch,
            self._force,
            time,
            self._is_planned,
            self._shown,
        )


def _of(parameters: Any) -> Supervisor:
    supervisor: Supervisor = parameters.supervisor
    return supervisor


def _rule(supervisor: Supervisor, name: str, monitor: Monitor) -> list[float]:
    """List the columns of a rule, see ``RULE_KIND``."""
    counter = supervisor.counter_of(name)
    values = [KINDS.index(monitor.kind), monitor.level, counter.increment, counter.decrement]
    values += [counter.fault, counter.heal]
    rule = [float(value) for value in values]
    for field, missing in THRESHOLDS[monitor.kind].items():
        value = getattr(monitor, field)
        rule.append(missing if value is None else float(value))
    return rule + [0.0] * (RULE_ROW - len(rule))


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    watch: Watch,
    force: Force,
    time: float,
    planned: bool,  # noqa: FBT001 - a kernel
    shown: Shown,
) -> None:
    shows = planned and shown.chosen.shape[0] > 0
    for run in range(batch.seen.records.shape[0]):
        if batch.seen.running[run]:
            state = supervised_step(batch, plans, watch, force, run, time, planned, shows)
            in_lane.tell(batch, run, state)
            if shows:
                planned_stop.show_plan(batch, plans, run, state, shown)
