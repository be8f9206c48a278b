"""What the predicted objects cost a candidate: collisions, too little distance, who is cut up.

What is predicted of an object is in ``kernel.profiles``. Road coordinates are taken as straight
over the length of a body.

Costs are sums of terms >= 0, so that a candidate can be dropped as soon as it costs more than the
best so far. The terms and their weights are our choice; what they are made of is cited where used.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.kernel import profiles as profiles
from adeye.kernel.boxes import placed_box_distance
from adeye.kernel.criticality import required_deceleration
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import at_path, margin_at, predict_body
from adeye.kernel.road import Ground, ground_of, lane_width, limit_at, place_on
from adeye.signals import FIRST_FREE, LAST_FREE
from adeye.simulate.channels.corridor import MAX_SPEED_VARIANCE, extent_of
from adeye.simulate.channels.driving import room_to_stand, way_to_change
from adeye.simulate.channels.perception import tracks as columns
from adeye.simulate.channels.perception.pose import POSE_HEADING, POSE_S, POSE_X, POSE_Y
from adeye.simulate.channels.perception.step import NOTE_END

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints
    from adeye.simulate.channels.perception.step import Seen

# --- Where the tracks will be: in road coordinates, at the sample times of the candidates ---------

SAMPLES: Final = 16
"""Times at which candidates and predictions are compared, evenly over the horizon."""


class Others(NamedTuple):
    """The predicted objects.

    Attributes:
        objects: (K, OBJECT_ROW).
        ways: (K, N, WAY_ROW), N samples.
    """

    objects: Floats
    ways: Floats


@compiled
def predict_objects(seen: Seen, run: int, interval: float, room: Others) -> Others:
    """Predict the confirmed tracks.

    Args:
        seen: What the channel has perceived.
        run: Which row is meant.
        interval: Time between two samples [s]; the first is one interval ahead.
        room: Where they are written.

    Returns:
        As many of it as there are objects.
    """
    record, ground, pose = seen.records[run], ground_of(seen.grounds, run), seen.pose[run]
    objects, ways = room.objects, room.ways
    count = 0
    sine, cosine = sin_cos(pose[POSE_HEADING])
    for row in range(int(seen.notes[run, NOTE_END])):
        track = seen.tracks[run, row]
        is_confirmed = track[columns.TRACK_HITS] >= record["confirm_hits"]
        if not is_confirmed or track[columns.TRACK_VAR_VX] > MAX_SPEED_VARIANCE:
            continue
        x = pose[POSE_X] + cosine * track[columns.TRACK_X] - sine * track[columns.TRACK_Y]
        y = pose[POSE_Y] + sine * track[columns.TRACK_X] + cosine * track[columns.TRACK_Y]
        s, d, heading, _ = place_on(ground, x, y)
        turn_sine, turn_cosine = sin_cos(pose[POSE_HEADING] - heading)
        forward = turn_cosine * track[columns.TRACK_VX] - turn_sine * track[columns.TRACK_VY]
        sideways = turn_sine * track[columns.TRACK_VX] + turn_cosine * track[columns.TRACK_VY]
        if not np.isfinite(s + d + forward + sideways):
            continue
        body = objects[count]
        long, wide = extent_of(track, forward, sideways, ground)
        body[profiles.OBJECT_LENGTH], body[profiles.OBJECT_WIDTH] = long, wide
        body[profiles.OBJECT_S], body[profiles.OBJECT_D] = s - pose[POSE_S], d
        body[profiles.OBJECT_SPEED] = forward
        reach = 0.5 * (record["length"] + long)
        body[profiles.OBJECT_BEHIND] = 1.0 if body[profiles.OBJECT_S] <= -reach else 0.0
        is_free = FIRST_FREE <= track[columns.TRACK_CLASS] <= LAST_FREE
        is_sure = (
            abs(sideways) - math.sqrt(track[columns.TRACK_VAR_VY]) >= profiles.MIN_LATERAL_SPEED
        )
        if not is_free and not is_sure:
            sideways = 0.0
        braking = track[columns.TRACK_BRAKING]
        predict_body(ground, s, body, sideways, is_free, braking, interval, ways[count])
        count += 1
    return Others(objects[:count], ways[:count])


# --- What a candidate costs by itself: progress, comfort, limits of vehicle and road --------------

# Columns of the sample of a candidate.
(
    LINE_D,  # lateral place [m]
    LINE_SLOPE,  # its change along the road
) = range(2)
LINE_ROW: Final = 2

_SPEEDING: Final = 200.0
_SPEEDING_FROM: Final = 0.5
"""What it costs to become faster than allowed by more than this [m/s], against being slower. Our
choice."""

PROGRESS_KNEE: Final = 1.0
"""Error of the speed from which the cost grows with its amount, no longer squared [m/s]."""


@inlined
def rounded_square(error: float, knee: float) -> float:
    """Return the square up to a knee, and go on with its slope beyond (Huber's function).

    >>> rounded_square(0.5, 1.0), rounded_square(-3.0, 1.0)
    (0.25, 5.0)
    """
    size = abs(error)
    return size * size if size <= knee else knee * (2.0 * size - knee)


@compiled
def profile_cost(
    record: Any, profile: Floats, wanted: float, previous: float, speed: float, allowed: float
) -> float:
    """Return what a speed profile costs on any path: progress and comfort.

    Args:
        record: Has the weights of progress, comfort and jerk.
        profile: (SAMPLES, PROFILE_ROW).
        wanted: Acceleration that it leads to [m/s²].
        previous: That of the previous choice [m/s²].
        speed: Of the ego now [m/s].
        allowed: Speed that desire, limit and curves allow [m/s].
    """
    progress = 0.0
    for sample in range(SAMPLES):
        missing = allowed - profile[sample, profiles.PROFILE_SPEED]
        cost = rounded_square(missing, PROGRESS_KNEE)
        progress += cost if missing > 0.0 else 2.0 * cost
        # To escape by speeding up is for no one to rely on.
        faster = profile[sample, profiles.PROFILE_SPEED] - max(allowed, speed) - _SPEEDING_FROM
        progress += _SPEEDING * rounded_square(max(0.0, faster), PROGRESS_KNEE)
    share = wanted / record["comfort_deceleration"]
    change = wanted - previous
    total = record["weight_progress"] * progress / SAMPLES
    total += record["weight_comfort"] * share * share
    return float(total + record["weight_jerk"] * change * change)


@compiled
def drive_line(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    path: Floats,
    profile: Floats,
    begun: float,
    curvature: float,
    lowest: float,
    highest: float,
    is_last_resort: bool,  # noqa: FBT001 - a kernel
    line: Floats,
) -> float:
    """Return what driving a path at a speed costs; infinity where limits or road do not allow it.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        path: (PATH_ROW,).
        profile: (SAMPLES, PROFILE_ROW).
        begun: Way along the path that is behind the ego [m].
        curvature: Of the road [1/m].
        lowest: Lateral places that the ego's centre may be at [m].
        highest: [m].
        is_last_resort: Whether it is to be had in any case; the vehicle then does what it can.
        line: (SAMPLES, LINE_ROW) out, up to what is not allowed.
    """
    along = 1.0 / (record["emergency_deceleration"] * record["emergency_deceleration"])
    across = 1.0 / (record["max_lateral_acceleration"] * record["max_lateral_acceleration"])
    comfort = 0.0
    for sample in range(SAMPLES):
        d, slope, bend = at_path(path, begun + profile[sample, profiles.PROFILE_S])
        line[sample, LINE_D], line[sample, LINE_SLOPE] = d, slope
        square = profile[sample, profiles.PROFILE_SPEED] * profile[sample, profiles.PROFILE_SPEED]
        aside = square * bend
        lateral = square * curvature + aside
        braking = profile[sample, profiles.PROFILE_ACCELERATION]
        # The ellipse of what the tyres are taken to hold.
        used = along * braking * braking + across * lateral * lateral
        if not is_last_resort and (used > 1.0 or d < lowest or d > highest):
            return math.inf
        comfort += aside * aside
    scale = record["comfort_deceleration"] * record["comfort_deceleration"]
    return float(record["weight_comfort"] * comfort / (scale * SAMPLES))


# --- What the predicted objects cost a candidate: collisions, too little distance, who is cut up --

HEADWAY_KNEE: Final = 0.4
"""Missing share of the distance from which the cost grows with its amount."""

_LATE: Final = 0.2
"""What a collision at the end of the horizon costs against one now."""

_HARD: Final = 10.0
"""Closing speed that doubles the cost of a collision [m/s]."""

_BLOCKED: Final = 0.5
"""From which depth on a collision forbids to leave the lane. Our choice."""

_LONG_RUN: Final = 2.0
"""What a slower lane costs against the speed that is missing within the horizon, and how many
desired distances ahead its traffic counts. Our choice."""

_TURN_SLACK: Final = 0.5
"""How much longer a body that is turned may be along the road [m]."""

_MOST_REQUIRED: Final = 20.0
"""Required deceleration beyond which more makes no difference [m/s²]."""

_LEAVING: Final = 30.0
_MOST_URGENT: Final = 8.0
"""What a lane that has to be left costs at least for each change, and how many times as much where
little of it is left. Our choice."""

_OVER: Final = 10.0
"""What each metre costs that the ego comes nearer to the end of its lane than it should. Our
choice."""

_REACTION: Final = 0.4
_DISTANCE_TIME: Final = 1.0
"""UN R79 5.6.4.7: who comes from behind begins to brake 0.4 s after the lane change has begun, and
must not come nearer than the way of 1 s of the one in front."""


@inlined
def desired_gap(record: Any, speed: float) -> float:
    """Return the distance that the ego keeps behind an object at a speed [m]."""
    return float(record["standstill_gap"] + record["time_gap"] * speed)


@compiled
def mark_interest(record: Any, profile: Floats, others: Others, window: Ints) -> None:
    """Find at which samples a speed profile comes near each object along the road, on any path.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        profile: (SAMPLES, PROFILE_ROW).
        others: With SAMPLES each.
        window: (K, 2) first sample and the one behind the last, out.
    """
    objects, ways = others.objects, others.ways
    interval = record["horizon"] / SAMPLES
    for row in range(objects.shape[0]):
        first, last = SAMPLES, 0
        if objects[row, profiles.OBJECT_BEHIND] == 0.0:
            reach = 0.5 * (record["length"] + objects[row, profiles.OBJECT_LENGTH])
            faster = objects[row, profiles.OBJECT_GROWTH]
            for sample in range(SAMPLES):
                ahead = ways[row, sample, profiles.WAY_S] - profile[sample, profiles.PROFILE_S]
                speed = profile[sample, profiles.PROFILE_SPEED]
                margin = margin_at(
                    record["lateral_margin"],
                    record["uncertainty_growth"],
                    faster,
                    (sample + 1) * interval,
                )
                swept = 0.5 * abs(speed - ways[row, sample, profiles.WAY_SPEED]) * interval
                near = reach + margin + swept + _TURN_SLACK
                if -near < ahead < max(near, reach + desired_gap(record, speed)):
                    first, last = min(first, sample), sample + 1
            ends = ways[row, SAMPLES - 1, profiles.WAY_S] - profile[SAMPLES - 1, profiles.PROFILE_S]
            closes = (
                profile[SAMPLES - 1, profiles.PROFILE_SPEED]
                > ways[row, SAMPLES - 1, profiles.WAY_SPEED]
            )
            if ends > 0.0 and (closes or objects[row, profiles.OBJECT_BRAKING] < 0.0):
                first, last = min(first, SAMPLES - 1), SAMPLES
        window[row, 0], window[row, 1] = first, last


@compiled
def object_cost(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    profile: Floats,
    line: Floats,
    body: Floats,
    way: Floats,
    window: Ints,
    is_leaving: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return what an object costs a candidate: a collision, too little distance, braking to come.

    To leave the lane into somebody is no way out, whatever lies ahead: that costs infinity.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        profile: (SAMPLES, PROFILE_ROW).
        line: (SAMPLES, LINE_ROW).
        body: (OBJECT_ROW,).
        way: (SAMPLES, WAY_ROW).
        window: (2,) see ``mark_interest``.
        is_leaving: Whether the candidate leaves the lane.
    """
    headway = worst = 0.0
    interval = record["horizon"] / SAMPLES
    for sample in range(window[0], window[1]):
        time = (sample + 1) * interval
        speed = profile[sample, profiles.PROFILE_SPEED]
        ahead = way[sample, profiles.WAY_S] - profile[sample, profiles.PROFILE_S]
        across = way[sample, profiles.WAY_D] - line[sample, LINE_D]
        margin = margin_at(
            record["lateral_margin"],
            record["uncertainty_growth"],
            body[profiles.OBJECT_GROWTH],
            time,
        )
        if (
            ahead > 0.0
            and abs(across) < 0.5 * (record["width"] + body[profiles.OBJECT_WIDTH]) + margin
        ):
            gap = ahead - 0.5 * (record["length"] + body[profiles.OBJECT_LENGTH])
            wanted = desired_gap(record, speed)
            headway += rounded_square(max(0.0, wanted - gap) / wanted, HEADWAY_KNEE)
            if sample == SAMPLES - 1:
                headway_end = _required_at_end(
                    record, gap, speed, way[sample, profiles.WAY_SPEED], body
                )
                worst = max(worst, headway_end)
        closing = abs(speed - way[sample, profiles.WAY_SPEED])
        depth = overlap(
            record, ahead, across, line[sample, LINE_SLOPE], body, closing * interval, margin
        )
        if depth > _BLOCKED and is_leaving:
            return math.inf
        if depth > 0.0:
            soon = 1.0 - (1.0 - _LATE) * time / (SAMPLES * interval)
            hard = 1.0 + closing * closing / (_HARD * _HARD)
            worst = max(worst, record["weight_collision"] * depth * soon * hard)
    return float(record["weight_headway"] * headway / SAMPLES + worst)


@inlined
def end_cost(record: Any, profile: Floats, room: float) -> float:
    """Return what the end of the lane costs: the braking to come, as for who stands there.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        profile: (SAMPLES, PROFILE_ROW).
        room: What is left of the lane [m], infinity where it goes on.
    """
    if room == math.inf:
        return 0.0
    way = float(profile[SAMPLES - 1, profiles.PROFILE_S])
    speed = float(profile[SAMPLES - 1, profiles.PROFILE_SPEED])
    left = room_to_stand(record, room) - way
    if left > 0.0 or way == 0.0:
        return _cost_of(record, required_deceleration(left, speed, 0.0, 0.0))
    # Where it is too late for any braking, the least way beyond is best.
    return float(_cost_of(record, _MOST_REQUIRED) - _OVER * left)


@inlined
def leaving_cost(record: Any, speed: float, room: float, changes: int) -> float:
    """Return what a lane costs that has to be left: the more, the less of it is left.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        speed: Of the ego [m/s].
        room: What is left of the lane [m].
        changes: How many lead to one that goes on.
    """
    needed = changes * way_to_change(speed)
    if room >= needed:
        return 0.0
    # Dearer than the change itself, even where that is cheap.
    once = max(_LEAVING, 2.0 * (record["weight_lane_change"] + record["weight_change"]))
    return float(once * changes * min(_MOST_URGENT, needed / max(room, 1.0)))


@inlined
def _required_at_end(
    record: Any, gap: float, speed: float, front_speed: float, body: Floats
) -> float:
    """Return the cost of the deceleration that is required at the end of the horizon.

    Up to the emergency deceleration like braking now, beyond it like a collision at the end.
    """
    room = gap - 0.5 * record["standstill_gap"]
    braking = body[profiles.OBJECT_BRAKING] if front_speed > 0.0 else 0.0
    required = required_deceleration(room, speed, max(0.0, front_speed), braking)
    return _cost_of(record, required)


@inlined
def _cost_of(record: Any, required: float) -> float:
    """Return the cost of a deceleration that is required at the end of the horizon."""
    required = min(required, _MOST_REQUIRED)
    share = required / record["comfort_deceleration"]
    cost = record["weight_comfort"] * share * share
    beyond = required / record["emergency_deceleration"] - 1.0
    if beyond > 0.0:
        cost += record["weight_collision"] * _LATE * min(1.0, beyond)
    return float(cost)


@inlined
def overlap(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    ahead: float,
    across: float,
    slope: float,
    body: Floats,
    swept: float,
    margin: float,
) -> float:
    """Return how far ego and object are into one another: 0 at the margin, 1 from contact on.

    Args:
        record: Has ``length`` and ``width`` of the ego.
        ahead: Centre of the object from the ego's, along the road [m].
        across: The same to the left [m].
        slope: Of the ego's path.
        body: (OBJECT_ROW,).
        swept: Way that the two move past one another between two samples [m].
        margin: Distance from which it counts [m].
    """
    length, width = record["length"] + swept, record["width"]
    side = 0.5 * (width + body[profiles.OBJECT_WIDTH])
    lean = 0.5 * (
        length * abs(slope) + body[profiles.OBJECT_LENGTH] * abs(body[profiles.OBJECT_SINE])
    )
    # A turned body reaches less far than this to each side, and most are not near.
    if abs(across) >= side + lean + margin:
        return 0.0
    if abs(ahead) >= 0.5 * (length + body[profiles.OBJECT_LENGTH]) + _TURN_SLACK + margin:
        return 0.0
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    sine = slope * cosine
    placed = (
        cosine * ahead + sine * across,
        cosine * across - sine * ahead,
        body[profiles.OBJECT_SINE] * cosine - body[profiles.OBJECT_COSINE] * sine,
        body[profiles.OBJECT_COSINE] * cosine + body[profiles.OBJECT_SINE] * sine,
    )
    size = (body[profiles.OBJECT_LENGTH], body[profiles.OBJECT_WIDTH])
    apart = placed_box_distance(placed, (length, width), size, 0.0)
    if apart <= 0.0:
        return 1.0
    return (margin - apart) / margin if apart < margin else 0.0


@compiled
def is_cut_up(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    ground: Ground,
    place: tuple[float, float],
    target: float,
    is_lane: bool,  # noqa: FBT001 - a kernel
    ego_speed: float,
    others: Others,
) -> bool:
    """Tell whether a lane change would cut up somebody who comes from behind, seen or not.

    It would if that vehicle had to brake harder than ``follower_deceleration`` to keep its
    distance. Where the sensors do not see, one at the speed limit is taken to be. Not asked any
    more once the ego's body is in the lane.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        ground: The road.
        place: s and d of the ego now [m].
        target: Lateral place of the lane that is to be entered [m].
        is_lane: False for the shoulder, where nobody is taken to drive who is not seen.
        ego_speed: Its lowest speed over the horizon [m/s].
        others: The predicted objects.

    Source:
        UN R79, 5.6.4.7: the critical distance at the beginning of a lane change.
    """
    s, d = place
    if abs(target - d) <= 0.5 * (lane_width(ground, s, d) + record["width"]):
        return False
    unseen = record["rear_sight"] - 0.5 * record["length"]
    if is_lane and unseen < critical_distance(record, limit_at(ground, s, target), ego_speed):
        return True
    for row in range(others.objects.shape[0]):
        body = others.objects[row]
        side = 0.5 * (record["width"] + body[profiles.OBJECT_WIDTH]) + record["lateral_margin"]
        last = others.ways[row, others.ways.shape[1] - 1, profiles.WAY_D]
        if body[profiles.OBJECT_BEHIND] == 0.0 or (
            abs(body[profiles.OBJECT_D] - target) > side and abs(last - target) > side
        ):
            continue
        gap = -body[profiles.OBJECT_S] - 0.5 * (record["length"] + body[profiles.OBJECT_LENGTH])
        if gap < critical_distance(record, body[profiles.OBJECT_SPEED], ego_speed):
            return True
    return False


@inlined
def critical_distance(record: Any, rear_speed: float, ego_speed: float) -> float:
    """Return the distance to who comes from behind below which a lane change is critical [m].

    Args:
        record: Has ``follower_deceleration``.
        rear_speed: [m/s].
        ego_speed: [m/s].

    Source:
        UN R79, 5.6.4.7.
    """
    closing = max(0.0, rear_speed - ego_speed)
    braking = closing * closing / (2.0 * record["follower_deceleration"])
    return float(closing * _REACTION + braking + ego_speed * _DISTANCE_TIME)


@inlined
def lane_speed_cost(
    record: Any, target: float, speed: float, allowed: float, others: Others
) -> float:
    """Return what the speed of the traffic in a lane costs beyond the horizon.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        target: Lateral place of the path [m].
        speed: Of the ego [m/s].
        allowed: Speed that desire, limit and curves allow [m/s].
        others: The predicted objects.
    """
    slowest = allowed
    for row in range(others.objects.shape[0]):
        body = others.objects[row]
        side = 0.5 * (record["width"] + body[profiles.OBJECT_WIDTH]) + record["lateral_margin"]
        ahead = body[profiles.OBJECT_S]
        is_near = 0.0 < ahead < _LONG_RUN * desired_gap(record, speed)
        if is_near and abs(others.ways[row, SAMPLES - 1, profiles.WAY_D] - target) < side:
            slowest = min(slowest, max(0.0, body[profiles.OBJECT_SPEED]))
    missing = rounded_square(allowed - slowest, PROGRESS_KNEE)
    return float(_LONG_RUN * record["weight_progress"] * missing)
