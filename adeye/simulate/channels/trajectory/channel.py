"""The trajectory channel: prediction, a fan of candidates, scoring, and control along the best.

One tick of its planner lays the fan, takes the candidate that costs least and refines its speed. A
path of the fan gives the lateral place over the way along the road, so it can be driven at any
speed, also to standstill. A profile gives way and speed over time. Every profile can be driven on
every path. Path: Werling, Ziegler, Kammel, Thrun (2010), "Optimal trajectory generation for dynamic
street scenarios in a Frenet frame", section IV, with the way as argument, as there for low speeds.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.fields import fields_of
from adeye.kernel import profiles
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import clip, lane_keeping_steering
from adeye.kernel.road import (
    Ground,
    center_at,
    center_beside,
    ground_of,
    is_beside,
    lane_left,
    lane_width,
    lanes_right,
    left_edge,
    offset_curvature,
    position,
    shoulder_middle,
    shoulder_width,
)
from adeye.signals import DEGRADED, FAULT, OK, ControlCommand, Floats, Ints, spec_columns
from adeye.simulate.channels import driving
from adeye.simulate.channels.hooks import POINTS, PerceivingChannel, Shown
from adeye.simulate.channels.perception.pose import (
    POSE_ALIGN,
    POSE_CURVATURE,
    POSE_D,
    POSE_S,
    POSE_SPEED,
    has_pose,
)
from adeye.simulate.channels.perception.tracks import BEHIND, TRACKS
from adeye.simulate.channels.trajectory import cost
from adeye.simulate.channels.trajectory.cost import SAMPLES, Others
from adeye.spec.channels import TrajectoryParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.simulate.channels.perception.step import Seen

# --- The fan of candidates: lateral paths along the road, and speed profiles along them -----------

# Lateral paths. Every one may be missing, except the first.
(
    KEEP,  # centre of the lane
    NUDGE_LEFT,  # a little beside it
    NUDGE_RIGHT,
    CHANGE_LEFT,  # lane to the left, without haste
    DODGE_LEFT,  # the same, as quickly as the assumed limits allow
    CHANGE_RIGHT,  # lane to the right, or the shoulder beside the rightmost
    DODGE_RIGHT,
) = range(7)
PATHS: Final = 7

PROFILES: Final = 7
"""Speed profiles, from the emergency deceleration to the largest acceleration."""

CANDIDATES: Final = PATHS * PROFILES

# Columns of the level of a profile.
(
    LEVEL_WANTED,  # acceleration that it leads to [m/s²]
    LEVEL_COST,  # what it costs on any path
) = range(2)
LEVEL_ROW: Final = 2

_SHARE: Final = 0.85
"""Share of the largest lateral acceleration that a quick path is laid out for. Our choice."""

_SETTLING: Final = 2.0
"""Least time of a path within the lane [s]. Our choice."""


@inlined
def set_accelerations(record: Any, levels: Floats) -> None:
    """Write the accelerations that the profiles lead to, in rising order.

    Args:
        record: Has ``comfort_deceleration``, ``emergency_deceleration`` and ``max_acceleration``.
        levels: (PROFILES + 1, LEVEL_ROW) out, but for the last row.
    """
    comfort, largest = record["comfort_deceleration"], record["max_acceleration"]
    emergency = max(comfort, record["emergency_deceleration"])
    levels[0, LEVEL_WANTED] = -emergency
    levels[1, LEVEL_WANTED] = -0.5 * (comfort + emergency)
    levels[2, LEVEL_WANTED] = -comfort
    levels[3, LEVEL_WANTED] = -0.4 * comfort
    levels[4, LEVEL_WANTED] = 0.0
    levels[5, LEVEL_WANTED] = 0.5 * largest
    levels[6, LEVEL_WANTED] = largest


@inlined
def quick_length(record: Any, speed: float, height: float) -> float:
    """Return the length of the shortest path that the assumed limits allow [m].

    Args:
        record: Has ``max_lateral_acceleration`` and ``max_curvature``.
        speed: [m/s].
        height: How far aside it leads [m].
    """
    largest = _SHARE * record["max_lateral_acceleration"]
    bend = _SHARE * record["max_curvature"]
    wide = profiles.PEAK * abs(height)
    return max(speed * math.sqrt(wide / largest), math.sqrt(wide / bend))


@inlined
def inside_length(record: Any, speed: float, height: float) -> float:
    """Return the length of a path within the lane, which has time [m]."""
    return max(_SETTLING * speed, quick_length(record, speed, height))


@inlined
def calm_length(record: Any, speed: float, height: float) -> float:
    """Return the length of a lane change without haste [m]."""
    return float(max(record["lane_change_time"] * speed, quick_length(record, speed, height)))


# --- The lateral paths of the fan at one tick, and what their targets cost ------------------------

# Columns of what the planner remembers.
(
    MEMORY_LANE,  # centre of the lane that it drives in or changes to [m], NaN before it drives
    MEMORY_WANTED,  # acceleration that it chose [m/s²]
    MEMORY_COMMAND,  # acceleration that it commanded on the way there [m/s²]
) = range(3)
MEMORY_WIDTH: Final = 3

_OUT: Final = 0.8
"""Share of a path to another lane at whose end the ego is out of the one before: of its height 94 %
are driven then."""

LOST: Final = 0.6
"""Lateral distance from its own path from which the planner begins anew [m]: somebody else has
driven. Our choice."""

_ONE_PLACE: Final = 0.01
"""Lateral places nearer than this are one target [m]."""


@inlined
def start_of_paths(
    ground: Ground, pose: Floats, memory: Floats, path: Floats
) -> tuple[float, float, float]:
    """Return the lateral state that the paths begin with: that of the path being driven.

    Args:
        ground: The road.
        pose: (POSE_WIDTH,).
        memory: (MEMORY_WIDTH,) in and out.
        path: (PATH_ROW,) that is being driven.

    Returns:
        Lateral place [m], slope and bend [1/m].
    """
    if not np.isnan(memory[MEMORY_LANE]):
        memory[MEMORY_LANE] = driving.path_in_lane(ground, pose[POSE_S], memory[MEMORY_LANE])
        d, slope, bend = profiles.at_path(path, pose[POSE_S] - path[profiles.PATH_START])
        if abs(d - pose[POSE_D]) < LOST:
            return d, slope, bend
    memory[MEMORY_LANE] = center_at(ground, pose[POSE_S], pose[POSE_D])
    # No target is this one, so no path counts as gone on with.
    path[profiles.PATH_TARGET] = math.nan
    return pose[POSE_D], sin_cos(pose[POSE_ALIGN])[0], 0.0


@compiled
def lay_paths(
    record: Any, ground: Ground, pose: Floats, memory: Floats, driven: Floats, paths: Floats
) -> None:
    """Lay the lateral paths of the fan.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        ground: The road.
        pose: (POSE_WIDTH,).
        memory: (MEMORY_WIDTH,) in and out.
        driven: (PATH_ROW,) path that is being driven.
        paths: (PATHS, PATH_ROW) out.
    """
    d, slope, bend = start_of_paths(ground, pose, memory, driven)
    s, center = pose[POSE_S], memory[MEMORY_LANE]
    room = 0.5 * (lane_width(ground, s, center) - record["width"])
    nudge = min(record["nudge"], max(0.0, room))
    for row in range(PATHS):
        target, lane = center, center
        if row == NUDGE_LEFT:
            target = center + nudge
        elif row == NUDGE_RIGHT:
            target = center - nudge
        elif row in (CHANGE_LEFT, DODGE_LEFT):
            target = lane = center_beside(ground, s, center, 1.0)
        elif row in (CHANGE_RIGHT, DODGE_RIGHT):
            target = lane = center_beside(ground, s, center, -1.0)
        if is_beside(ground, s, target):
            target, lane = shoulder_middle(ground, s), math.nan
        exists = _is_on_road(record, ground, row, s, target, d)
        paths[row, profiles.PATH_EXISTS] = 1.0 if exists else 0.0
        paths[row, profiles.PATH_LANE] = lane
        length = _length(record, row, pose[POSE_SPEED], target - d)
        if abs(target - driven[profiles.PATH_TARGET]) < _ONE_PLACE:
            # What has been begun is finished as it was begun.
            left = driven[profiles.PATH_START] + driven[profiles.PATH_LENGTH] - s
            length = min(length, left)
        profiles.lay_path(paths[row], s, d, slope, bend, target, length)
        _look_along(
            record, ground, pose[POSE_SPEED], center if np.isnan(lane) else lane, paths[row]
        )


@inlined
def _look_along(record: Any, ground: Ground, speed: float, lane: float, path: Floats) -> None:
    """Write what is left of the lanes that a path leads through, and what it costs to be in its.

    Args:
        record: Has ``length``, ``weight_lane_change`` and ``weight_change``.
        ground: The road.
        speed: Of the ego [m/s].
        lane: Centre of the lane that the path leads to, from the shoulder of that beside it [m].
        path: (PATH_ROW,) in and out.
    """
    s, d = path[profiles.PATH_START], path[profiles.PATH_0]
    far = driving.MOST_CHANGES * driving.way_to_change(speed)
    room, changes = lane_left(ground, s, lane, far)
    path[profiles.PATH_COST] = cost.leaving_cost(record, speed, room, abs(changes))
    if np.isnan(path[profiles.PATH_LANE]):
        room = math.inf
    elif abs(lane - d) > 0.5 * lane_width(ground, s, lane):
        # Until the ego is out of its lane, that must not have ended.
        here = lane_left(ground, s, d, far)[0]
        if _OUT * path[profiles.PATH_LENGTH] + 0.5 * record["length"] > here:
            room = min(room, here)
    path[profiles.PATH_ROOM] = room


@inlined
def _is_on_road(record: Any, ground: Ground, row: int, s: float, target: float, d: float) -> bool:
    """Tell whether a target can be had: on lanes or shoulder, and no more than a lane away."""
    if row == KEEP:
        return True
    half = 0.5 * record["width"]
    if row in (NUDGE_LEFT, NUDGE_RIGHT) and record["nudge"] <= 0.0:
        return False
    if is_beside(ground, s, target) and shoulder_width(ground, s) < record["width"]:
        return False
    highest = left_edge(ground, s) - half
    return bool(target <= highest and abs(target - d) <= 1.6 * lane_width(ground, s, d))


@inlined
def _length(record: Any, row: int, speed: float, height: float) -> float:
    if row in (DODGE_LEFT, DODGE_RIGHT):
        return quick_length(record, speed, height)
    if row in (CHANGE_LEFT, CHANGE_RIGHT):
        return calm_length(record, speed, height)
    return inside_length(record, speed, height)


@compiled
def path_cost(record: Any, path: Floats, row: int, memory: Floats, driven: Floats) -> float:
    """Return what the target of a path costs at any speed.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        path: (PATH_ROW,), its cost that of having to leave its lane.
        row: Which path of the fan it is.
        memory: (MEMORY_WIDTH,).
        driven: (PATH_ROW,) path that is being driven.
    """
    total = path[profiles.PATH_COST]
    if np.isnan(path[profiles.PATH_LANE]):
        total += record["weight_shoulder"]
    else:
        beside = path[profiles.PATH_TARGET] - path[profiles.PATH_LANE]
        total += record["weight_offset"] * beside * beside
        if abs(path[profiles.PATH_LANE] - memory[MEMORY_LANE]) > _ONE_PLACE:
            total += record["weight_lane_change"]
    is_kept = abs(path[profiles.PATH_TARGET] - driven[profiles.PATH_TARGET]) < _ONE_PLACE
    if not is_kept and row != KEEP:
        total += record["weight_change"]
    return float(total)


# --- One tick of the planner: lay the fan, take the candidate that costs least, refine its speed --

UNKNOWN: Final = -1
"""First sample of the first window while nobody has looked which objects are near."""

ROUNDS: Final = 4
"""How often the step between two accelerations is halved around the best: to a sixteenth."""


class Fan(NamedTuple):
    """What the planner reads and writes at one tick of one run.

    Attributes:
        record: Parameters, see ``channel.TrajectoryChannel``.
        ground: The road.
        pose: (POSE_WIDTH,).
        allowed: Speed that desire, limit and curves allow [m/s].
        others: The predicted objects.
        memory: (MEMORY_WIDTH,) in; the acceleration that is chosen and its lane, out.
        driven: (PATH_ROW,) path that is being driven, in and out.
        paths: (PATHS, PATH_ROW) out; scratch, as all that follows.
        profiles: (PROFILES + 1, SAMPLES, PROFILE_ROW) the last one is that chosen.
        windows: (PROFILES + 1, K, 2) see ``mark_interest``.
        line: (SAMPLES, LINE_ROW) lateral samples, in the end of the choice.
        levels: (PROFILES + 1, LEVEL_ROW) accelerations that they lead to, and their costs.
        costs: (CANDIDATES,) exact of all candidates only if they are shown.
    """

    record: Any
    ground: Ground
    pose: Floats
    allowed: float
    others: Others
    memory: Floats
    driven: Floats
    paths: Floats
    profiles: Floats
    windows: Ints
    line: Floats
    levels: Floats
    costs: Floats


@compiled
def add_profile(fan: Fan, column: int) -> None:
    """Drive a speed profile and note what it costs on any path."""
    record, memory, level = fan.record, fan.memory, fan.levels[column]
    profile = fan.profiles[column]
    speed, wanted = fan.pose[POSE_SPEED], level[LEVEL_WANTED]
    interval = record["horizon"] / SAMPLES
    profiles.fill_profile(
        speed, memory[MEMORY_COMMAND], wanted, record["max_jerk"], interval, 0.0, profile
    )
    level[LEVEL_COST] = cost.profile_cost(
        record, profile, wanted, memory[MEMORY_WANTED], speed, fan.allowed
    )
    # Nothing is known of the objects yet.
    fan.windows[column, 0, 0] = UNKNOWN


@compiled
def candidate_cost(fan: Fan, row: int, column: int, limit: float) -> float:
    """Return what a candidate costs; from a limit on some lower bound of it.

    Args:
        fan: What is read and written.
        row: Its path.
        column: Its profile.
        limit: Cost from which nobody needs to know more.
    """
    record, path, profile = fan.record, fan.paths[row], fan.profiles[column]
    window, others = fan.windows[column], fan.others
    total = path[profiles.PATH_COST] + fan.levels[column, LEVEL_COST]
    total += cost.end_cost(record, profile, path[profiles.PATH_ROOM])
    if total >= limit:
        return float(total)
    slowest = min(fan.pose[POSE_SPEED], profile[SAMPLES - 1, profiles.PROFILE_SPEED])
    is_lane = not np.isnan(path[profiles.PATH_LANE])
    place, target = (fan.pose[POSE_S], fan.pose[POSE_D]), path[profiles.PATH_TARGET]
    if cost.is_cut_up(record, fan.ground, place, target, is_lane, slowest, others):
        return math.inf
    total += drive_path(fan, path, profile, row == KEEP)
    count = others.objects.shape[0]
    if count > 0 and window[0, 0] == UNKNOWN:
        cost.mark_interest(record, profile, others, window)
    for item in range(count):
        if total >= limit:
            return float(total)
        if window[item, 0] < window[item, 1]:
            total += cost.object_cost(
                record,
                profile,
                fan.line,
                others.objects[item],
                others.ways[item],
                window[item],
                row >= CHANGE_LEFT,
            )
    return float(total)


@compiled
def drive_path(fan: Fan, path: Floats, profile: Floats, is_last_resort: bool) -> float:  # noqa: FBT001 - a kernel
    """Return what driving a path at a speed costs, see ``cost.drive_line``.

    Args:
        fan: What is read and written.
        path: (PATH_ROW,).
        profile: (SAMPLES, PROFILE_ROW).
        is_last_resort: Whether it is to be had in any case.
    """
    record, ground, pose = fan.record, fan.ground, fan.pose
    half = 0.5 * record["width"]
    # Who is beyond an edge already may come back.
    edge = lanes_right(ground, pose[POSE_S]) - shoulder_width(ground, pose[POSE_S])
    lowest = min(half + edge, pose[POSE_D])
    highest = max(left_edge(ground, pose[POSE_S]) - half, pose[POSE_D])
    return cost.drive_line(
        record,
        path,
        profile,
        pose[POSE_S] - path[profiles.PATH_START],
        pose[POSE_CURVATURE],
        lowest,
        highest,
        is_last_resort,
        fan.line,
    )


@compiled
def choose_candidate(fan: Fan, is_shown: bool) -> int:  # noqa: FBT001 - a kernel
    """Return the candidate of the fan that costs least; the first of several.

    Args:
        fan: What is read and written.
        is_shown: Whether somebody looks at the costs.
    """
    set_accelerations(fan.record, fan.levels)
    for column in range(PROFILES):
        add_profile(fan, column)
    best, least = KEEP * PROFILES, math.inf
    for row in range(PATHS):
        path = fan.paths[row]
        path[profiles.PATH_COST] = path_cost(
            fan.record, path, row, fan.memory, fan.driven
        ) + cost.lane_speed_cost(
            fan.record,
            path[profiles.PATH_TARGET],
            fan.pose[POSE_SPEED],
            fan.allowed,
            fan.others,
        )
        for column in range(PROFILES):
            place = row * PROFILES + column
            fan.costs[place] = math.inf
            if path[profiles.PATH_EXISTS] == 0.0:
                continue
            limit = math.inf if is_shown else least
            fan.costs[place] = candidate_cost(fan, row, column, limit)
            if fan.costs[place] < least:
                best, least = place, fan.costs[place]
    return best


@compiled
def refine(fan: Fan, best: int) -> None:
    """Look for a better acceleration between those of the fan, on the same path.

    Args:
        fan: What is read and written.
        best: Candidate of the fan that costs least.
    """
    row, column = best // PROFILES, best % PROFILES
    levels = fan.levels
    chosen, least = levels[column, LEVEL_WANTED], fan.costs[best]
    lower = chosen - levels[max(column - 1, 0), LEVEL_WANTED]
    upper = levels[min(column + 1, PROFILES - 1), LEVEL_WANTED] - chosen
    middle = chosen
    for step in range(2 * ROUNDS):
        if step % 2 == 0:
            lower, upper, middle = 0.5 * lower, 0.5 * upper, chosen
        trial = middle - lower if step % 2 == 0 else middle + upper
        if trial == middle:
            continue
        levels[PROFILES, LEVEL_WANTED] = trial
        add_profile(fan, PROFILES)
        total = candidate_cost(fan, row, PROFILES, least)
        if total < least:
            chosen, least = trial, total
    levels[PROFILES, LEVEL_WANTED] = chosen
    add_profile(fan, PROFILES)
    drive_path(fan, fan.paths[row], fan.profiles[PROFILES], True)  # noqa: FBT003 - a kernel
    fan.memory[MEMORY_WANTED] = chosen


@compiled
def plan_step(fan: Fan, is_shown: bool) -> int:  # noqa: FBT001 - a kernel
    """Choose path and acceleration of one run at one tick.

    Args:
        fan: What is read and written.
        is_shown: Whether somebody looks at the costs.

    Returns:
        The candidate of the fan that cost least.
    """
    lay_paths(fan.record, fan.ground, fan.pose, fan.memory, fan.driven, fan.paths)
    best = choose_candidate(fan, is_shown)
    refine(fan, best)
    path = fan.paths[best // PROFILES]
    if not np.isnan(path[profiles.PATH_LANE]):
        fan.memory[MEMORY_LANE] = path[profiles.PATH_LANE]
    for item in range(profiles.PATH_ROW):
        fan.driven[item] = path[item]
    return best


# --- From the chosen trajectory to the command, and to the places that are shown of it ------------

# Columns of a plan.
PLAN_X, PLAN_Y, PLAN_HEADING, PLAN_SPEED = range(4)
PLAN_ROW: Final = 4

SHOWN: Final = (3, 7, 11, 15)
"""Samples of a candidate that are shown, behind the place of the ego itself."""

_STARTING: Final = 0.2
"""Acceleration below which a standing ego stays [m/s²], so that it does not creep."""

_ROOM: Final = 1.3
"""How much more lateral acceleration than planned may be used to correct. Our choice."""


@inlined
def steer_along(record: Any, ground: Ground, pose: Floats, path: Floats) -> float:
    """Return the steering angle that keeps the ego on a path [rad].

    The curvature is fed forward from where the ego will be when the wheels have turned.

    Args:
        record: Has ``wheelbase``, ``max_steering_angle``, ``steering_lag``, ``period`` and
            ``max_lateral_acceleration``.
        ground: The road.
        pose: (POSE_WIDTH,).
        path: (PATH_ROW,).
    """
    way = pose[POSE_S] - path[profiles.PATH_START]
    d, slope, _ = profiles.at_path(path, way)
    ahead = way + pose[POSE_SPEED] * (record["steering_lag"] + 0.5 * record["period"])
    bend = profiles.at_path(path, ahead)[2]
    return lane_keeping_steering(
        pose[POSE_D] - d,
        wrap_to_pi(pose[POSE_ALIGN] - atan(slope)),
        offset_curvature(driving.road_bend(ground, pose), d) + bend,
        pose[POSE_SPEED],
        record["wheelbase"],
        0.5 * record["wheelbase"],
        driving.PREVIEW_TIME,
        driving.LEAST_PREVIEW,
        _ROOM * record["max_lateral_acceleration"],
        record["max_steering_angle"],
    )


@inlined
def accelerate(record: Any, speed: float, previous: float, wanted: float) -> float:
    """Return the commanded acceleration on the way to the wanted one [m/s²].

    The command is ahead of the profile by the period that it stands for; the brake's own lag is
    left to the next plan, which begins at the measured speed.

    Args:
        record: Has ``max_jerk`` and ``period``.
        speed: Of the ego [m/s].
        previous: Command at the previous tick [m/s²].
        wanted: By the chosen profile [m/s²].
    """
    if speed < driving.STANDSTILL and wanted < _STARTING:
        return -driving.HOLD_DECELERATION
    if speed < driving.STANDSTILL:
        previous = max(0.0, previous)
    change = record["max_jerk"] * record["period"]
    return clip(wanted, previous - change, previous + change)


@compiled
def show_plan(pose: Floats, segments: Floats, profile: Floats, line: Floats, plan: Floats) -> None:
    """Write the chosen trajectory in the map.

    Args:
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        profile: (SAMPLES, PROFILE_ROW).
        line: (SAMPLES, LINE_ROW).
        plan: (SAMPLES, PLAN_ROW) out.
    """
    for sample in range(SAMPLES):
        s = pose[POSE_S] + profile[sample, profiles.PROFILE_S]
        x, y, heading = position(segments, s, line[sample, cost.LINE_D])
        plan[sample, PLAN_X], plan[sample, PLAN_Y] = x, y
        plan[sample, PLAN_HEADING] = wrap_to_pi(heading + atan(line[sample, cost.LINE_SLOPE]))
        plan[sample, PLAN_SPEED] = profile[sample, profiles.PROFILE_SPEED]


@compiled
def show_candidates(
    pose: Floats, segments: Floats, paths: Floats, speeds: Floats, candidates: Floats
) -> None:
    """Write the places of the fan in the map; rows of candidates that cannot be had are NaN.

    Args:
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        paths: (PATHS, PATH_ROW).
        speeds: (PROFILES + 1, SAMPLES, PROFILE_ROW), the profiles.
        candidates: (CANDIDATES, POINTS, 2) out.
    """
    for place in range(CANDIDATES):
        path, profile = paths[place // PROFILES], speeds[place % PROFILES]
        candidates[place] = float("nan")
        if path[profiles.PATH_EXISTS] == 0.0:
            continue
        for point in range(POINTS):
            way = 0.0
            if point > 0:
                way = profile[SHOWN[point - 1], profiles.PROFILE_S]
            d = profiles.at_path(path, pose[POSE_S] + way - path[profiles.PATH_START])[0]
            x, y, _ = position(segments, pose[POSE_S] + way, d)
            candidates[place, point, 0], candidates[place, point, 1] = x, y


# --- The trajectory channel: prediction, a fan of candidates, scoring, and control along the best -


class TrajectoryChannel(PerceivingChannel):
    """Predicts what its linked sensors see, and drives the best of a fan of trajectories.

    It sees measurements only. Without a recent ego estimate its state is FAULT, with a linked
    sensor that does not deliver it is DEGRADED.
    """

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        numbers = spec_columns(context.parameters, _numbers)
        self._prepare(context, driving.channel_records(context, numbers), CANDIDATES)
        self._plans = Plans(
            memory=np.zeros((runs, MEMORY_WIDTH)),
            driven=np.zeros((runs, profiles.PATH_ROW)),
            plan=np.full((runs, SAMPLES, PLAN_ROW), np.nan),
            others=Others(
                np.zeros((TRACKS, profiles.OBJECT_ROW)),
                np.zeros((TRACKS, SAMPLES, profiles.WAY_ROW)),
            ),
            paths=np.zeros((PATHS, profiles.PATH_ROW)),
            profiles=np.zeros((PROFILES + 1, SAMPLES, profiles.PROFILE_ROW)),
            windows=np.zeros((PROFILES + 1, TRACKS, 2), dtype=np.int64),
            line=np.zeros((SAMPLES, cost.LINE_ROW)),
            levels=np.zeros((PROFILES + 1, LEVEL_ROW)),
            costs=np.zeros(CANDIDATES),
        )
        self._plans.memory[:, MEMORY_LANE] = np.nan
        self._plans.driven[:, profiles.PATH_TARGET] = np.nan

    def _decide(self, time: float) -> None:
        _act(self._seen, self._plans, time, self._command, self._status, self._shown)

    def _command_at(self, time: float) -> ControlCommand:
        return replace(super()._command_at(time), plan=self._plans.plan.copy())


class Plans(NamedTuple):
    """What the channel keeps of each run, and scratch for one.

    Attributes:
        memory: (B, MEMORY_WIDTH).
        driven: (B, PATH_ROW) path that is being driven.
        plan: (B, SAMPLES, PLAN_ROW) what is shown of the choice.
        others: Room for the predicted objects; scratch, as all that follows, see ``Fan``.
        paths: (PATHS, PATH_ROW).
        profiles: (PROFILES + 1, SAMPLES, PROFILE_ROW).
        windows: (PROFILES + 1, K, 2).
        line: (SAMPLES, LINE_ROW).
        levels: (PROFILES + 1, LEVEL_ROW).
        costs: (CANDIDATES,).
    """

    memory: Floats
    driven: Floats
    plan: Floats
    others: Others
    paths: Floats
    profiles: Floats
    windows: Ints
    line: Floats
    levels: Floats
    costs: Floats


def _numbers(item: TrajectoryParameters) -> dict[str, float]:
    """List what the compiled step reads of the channel's parameters."""
    numbers = fields_of(item, *TrajectoryParameters.model_fields)
    return numbers | {"behind": max(BEHIND, item.rear_sight)}


@compiled
def _act(
    seen: Seen, plans: Plans, time: float, command: Floats, status: Ints, shown: Shown
) -> None:
    shows = shown.chosen.shape[0] > 0
    for run in range(seen.records.shape[0]):
        if not seen.running[run]:
            continue
        best = trajectory_step(seen, plans, run, time, command[run], shows)
        status[run] = FAULT if best < 0 else OK
        if best >= 0 and seen.degraded[run]:
            status[run] = DEGRADED
        if shows:
            shown.chosen[run] = best
            shown.candidates[run] = np.nan
            shown.costs[run] = np.nan
            if best >= 0:
                show_candidates(
                    seen.pose[run],
                    seen.grounds.segments[run],
                    plans.paths,
                    plans.profiles,
                    shown.candidates[run],
                )
                for place in range(CANDIDATES):
                    shown.costs[run, place] = plans.costs[place]


@inlined
def trajectory_step(
    seen: Seen,
    plans: Plans,
    run: int,
    time: float,
    command: Floats,
    is_shown: bool,  # noqa: FBT001 - a kernel
) -> int:
    """Decide one run at one tick.

    Args:
        seen: What the channel has perceived.
        plans: What it keeps; in and out.
        run: Which row is meant.
        time: [s].
        command: (2,) acceleration [m/s²] and steering angle [rad]; in and out.
        is_shown: Whether somebody looks at the fan.

    Returns:
        The best candidate of the fan; -1 without a recent ego estimate: then it coasts with the
        steering held.
    """
    record, ground, pose = seen.records[run], ground_of(seen.grounds, run), seen.pose[run]
    memory, driven, plan = plans.memory[run], plans.driven[run], plans.plan[run]
    if not has_pose(pose, time):
        command[0] = memory[MEMORY_WANTED] = memory[MEMORY_COMMAND] = 0.0
        memory[MEMORY_LANE] = plan[:] = np.nan
        return -1
    others = cost.predict_objects(seen, run, record["horizon"] / SAMPLES, plans.others)
    allowed = driving.allowed_speed(record, ground, pose, pose[POSE_D])
    fan = Fan(
        record,
        ground,
        pose,
        allowed[0],
        others,
        memory,
        driven,
        plans.paths,
        plans.profiles,
        plans.windows,
        plans.line,
        plans.levels,
        plans.costs,
    )
    best = plan_step(fan, is_shown)
    speed = pose[POSE_SPEED]
    memory[MEMORY_WANTED] = driving.slow_down(
        record, ground, memory[MEMORY_WANTED], speed, allowed, record["emergency_deceleration"]
    )
    acceleration = accelerate(record, speed, command[0], memory[MEMORY_WANTED])
    steering = steer_along(record, ground, pose, driven)
    if not driving.is_number(acceleration, steering):
        command[0] = memory[MEMORY_WANTED] = memory[MEMORY_COMMAND] = 0.0
        memory[MEMORY_LANE] = plan[:] = np.nan
        return -1
    command[0], command[1] = acceleration, steering
    memory[MEMORY_COMMAND] = acceleration
    show_plan(pose, ground.segments, plans.profiles[PROFILES], plans.line, plan)
    return best
