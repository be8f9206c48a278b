"""The kinds of monitors of a supervisor: small functions of one interface.

Every one takes its rule and the evidence of one run, and tells whether it fires. What is missing or
no number makes it fire; at the start, what has never been there is waited for as long as it may be
old.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from adeye.kernel.criticality import rss_longitudinal_distance
from adeye.kernel.elementary import sin_cos, tan
from adeye.kernel.jit import inlined
from adeye.kernel.road import lane_way, local, right_edge
from adeye.signals import FAULT
from adeye.simulate.channels.corridor import PATH_GAP, PATH_SPEED, offset_from_corridor
from adeye.simulate.channels.perception.pose import (
    MAX_AGE,
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
from adeye.simulate.channels.perception.tracks import (
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
)
from adeye.simulate.channels.safety.in_lane import (
    MEMORY_PATH,
    MEMORY_STOPPING,
    SEEN_D,
    SEEN_OFFSET,
    SEEN_REQUIRED,
    Batch,
)
from adeye.spec.supervisor import KINDS

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints

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
# ``supervisor.THRESHOLDS``.
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
    if batch.memory[run, MEMORY_STOPPING] > 0.0:
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
def off_road(batch: Batch, refuges: Floats, run: int, rule: Floats) -> bool:
    """Fire when the centre of the ego is where nothing carries a vehicle."""
    record, pose = batch.seen.records[run], batch.seen.pose[run]
    right = right_edge(refuges, pose[POSE_S], record["shoulder"], record["verge"])
    left = record["lanes"] * record["lane_width"]
    return not right - rule[RULE_FIRST] <= pose[POSE_D] <= left + rule[RULE_FIRST]


@inlined
def lane_departure(batch: Batch, run: int, rule: Floats) -> bool:
    """Fire when the ego is too far from its lane or from the stop that is driven."""
    record, seen = batch.seen.records[run], batch.evidence
    is_near = abs(seen[SEEN_OFFSET]) <= rule[RULE_FIRST]
    return not (is_near and 0.0 <= seen[SEEN_D] <= record["lanes"] * record["lane_width"])


@inlined
def object_danger(batch: Batch, rule: Floats) -> bool:
    """Fire when an object in the path requires a deceleration from the threshold on."""
    return not batch.evidence[SEEN_REQUIRED] < rule[RULE_FIRST]


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
    for row in range(int(batch.seen.notes[run, NOTE_END])):
        track = tracks[row]
        if track[TRACK_HITS] < record["confirm_hits"]:
            continue
        x = pose[POSE_X] + cosine * track[TRACK_X] - sine * track[TRACK_Y]
        y = pose[POSE_Y] + sine * track[TRACK_X] + cosine * track[TRACK_Y]
        s, d, heading, _ = local(batch.seen.segments[run], x, y)
        way = lane_way(pose[POSE_S], road, pose[POSE_D], s, heading)
        aside = abs(offset_from_corridor(d, batch.memory[run, MEMORY_PATH], pose[POSE_D]))
        long, wide = 0.5 * track[TRACK_LENGTH], 0.5 * track[TRACK_WIDTH]
        is_clear = way - long >= ahead or way + long <= behind or aside - wide >= half
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
def of_scene(batch: Batch, refuges: Floats, run: int, rule: Floats) -> bool:
    """Tell whether a monitor of the scene fires; the ego knows where it is."""
    kind = int(rule[RULE_KIND])
    if kind == OFF_ROAD:
        return off_road(batch, refuges, run, rule)
    if kind == LANE_DEPARTURE:
        return lane_departure(batch, run, rule)
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
