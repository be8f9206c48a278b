"""One tick of the planner: lay the fan, take the candidate that costs least, refine its speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.control import lane_keeping_steering
from adeye.kernel.elementary import atan
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import clip
from adeye.kernel.profiles import (
    PATH_COST,
    PATH_EXISTS,
    PATH_LANE,
    PATH_ROW,
    PATH_START,
    PATH_TARGET,
    PROFILE_S,
    PROFILE_SPEED,
    at_path,
    fill_profile,
)
from adeye.kernel.road import offset_curvature, position
from adeye.simulate.channels.driving import (
    HOLD_DECELERATION,
    LEAST_PREVIEW,
    PREVIEW_TIME,
    STANDSTILL,
)
from adeye.simulate.channels.perception.pose import (
    POSE_ALIGN,
    POSE_CURVATURE,
    POSE_D,
    POSE_S,
    POSE_SPEED,
)
from adeye.simulate.channels.trajectory.candidates import (
    CANDIDATES,
    CHANGE_LEFT,
    KEEP,
    LEVEL_COST,
    LEVEL_WANTED,
    MEMORY_COMMAND,
    MEMORY_LANE,
    MEMORY_WANTED,
    PATHS,
    PROFILES,
    lay_paths,
    path_cost,
    set_accelerations,
)
from adeye.simulate.channels.trajectory.cost import (
    LINE_D,
    LINE_SLOPE,
    SAMPLES,
    drive_line,
    is_cut_up,
    lane_speed_cost,
    mark_interest,
    object_cost,
    profile_cost,
)

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints

# --- One tick of the planner: lay the fan, take the candidate that costs least, refine its speed --

UNKNOWN: Final = -1
"""First sample of the first window while nobody has looked which objects are near."""

ROUNDS: Final = 4
"""How often the step between two accelerations is halved around the best: to a sixteenth."""


@compiled
def add_profile(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    allowed: float,
    memory: Floats,
    level: Floats,
    profile: Floats,
    window: Ints,
) -> None:
    """Drive a speed profile and note what it costs on any path.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        allowed: Speed that desire, limit and curves allow [m/s].
        memory: (MEMORY_WIDTH,).
        level: (LEVEL_ROW,) acceleration that it leads to, in; its cost, out.
        profile: (SAMPLES, PROFILE_ROW) out.
        window: (K, 2) out; nothing is known of the objects yet.
    """
    speed, wanted = pose[POSE_SPEED], level[LEVEL_WANTED]
    interval = record["horizon"] / SAMPLES
    fill_profile(speed, memory[MEMORY_COMMAND], wanted, record["max_jerk"], interval, 0.0, profile)
    level[LEVEL_COST] = profile_cost(record, profile, wanted, memory[MEMORY_WANTED], speed, allowed)
    window[0, 0] = UNKNOWN


@compiled
def candidate_cost(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    row: int,
    path: Floats,
    level: Floats,
    profile: Floats,
    window: Ints,
    count: int,
    objects: Floats,
    ways: Floats,
    line: Floats,
    limit: float,
) -> float:
    """Return what a candidate costs; from a limit on some lower bound of it.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        row: Which path of the fan it is.
        path: (PATH_ROW,).
        level: (LEVEL_ROW,) of its profile.
        profile: (SAMPLES, PROFILE_ROW).
        window: (K, 2) see ``mark_interest``, in and out.
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, SAMPLES, WAY_ROW).
        line: (SAMPLES, LINE_ROW) scratch.
        limit: Cost from which nobody needs to know more.
    """
    cost = path[PATH_COST] + level[LEVEL_COST]
    if cost >= limit:
        return float(cost)
    slowest = min(pose[POSE_SPEED], profile[SAMPLES - 1, PROFILE_SPEED])
    is_lane, target = not np.isnan(path[PATH_LANE]), path[PATH_TARGET]
    if is_cut_up(record, target, is_lane, pose[POSE_D], slowest, objects, ways, count):
        return math.inf
    cost += drive_path(record, pose, path, profile, row == KEEP, line)
    interval = record["horizon"] / SAMPLES
    if count > 0 and window[0, 0] == UNKNOWN:
        mark_interest(record, profile, objects, ways, count, interval, window)
    for item in range(count):
        if cost >= limit:
            return float(cost)
        if window[item, 0] < window[item, 1]:
            cost += object_cost(
                record,
                profile,
                line,
                objects[item],
                ways[item],
                window[item],
                interval,
                row >= CHANGE_LEFT,
            )
    return float(cost)


@compiled
def drive_path(
    record: Any,
    pose: Floats,
    path: Floats,
    profile: Floats,
    is_last_resort: bool,  # noqa: FBT001 - a kernel
    line: Floats,
) -> float:
    """Return what driving a path at a speed costs, see ``scoring.drive_line``.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        path: (PATH_ROW,).
        profile: (SAMPLES, PROFILE_ROW).
        is_last_resort: Whether it is to be had in any case.
        line: (SAMPLES, LINE_ROW) out.
    """
    half = 0.5 * record["width"]
    # Who is beyond an edge already may come back.
    lowest = min(half - record["shoulder"], pose[POSE_D])
    highest = max(record["lanes"] * record["lane_width"] - half, pose[POSE_D])
    return drive_line(
        record,
        path,
        profile,
        pose[POSE_S] - path[PATH_START],
        pose[POSE_CURVATURE],
        lowest,
        highest,
        is_last_resort,
        line,
    )


@compiled
def choose_candidate(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    allowed: float,
    count: int,
    objects: Floats,
    ways: Floats,
    memory: Floats,
    driven: Floats,
    paths: Floats,
    profiles: Floats,
    windows: Ints,
    line: Floats,
    levels: Floats,
    costs: Floats,
    is_shown: bool,  # noqa: FBT001 - a kernel
) -> int:
    """Return the candidate of the fan that costs least; the first of several.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        allowed: Speed that desire, limit and curves allow [m/s].
        count: How many objects there are.
        objects: (K, OBJECT_ROW) see ``prediction``.
        ways: (K, SAMPLES, WAY_ROW).
        memory: (MEMORY_WIDTH,).
        driven: (PATH_ROW,) path that is being driven.
        paths: (PATHS, PATH_ROW) of the fan; their costs, out.
        profiles: (PROFILES + 1, SAMPLES, PROFILE_ROW) out, but for the last.
        windows: (PROFILES + 1, K, 2) out, but for the last.
        line: (SAMPLES, LINE_ROW) scratch.
        levels: (PROFILES + 1, LEVEL_ROW) of the profiles, out, but for the last.
        costs: (CANDIDATES,) out; exact of all candidates only if they are shown.
        is_shown: Whether somebody looks at the costs.
    """
    set_accelerations(record, levels)
    for column in range(PROFILES):
        add_profile(
            record, pose, allowed, memory, levels[column], profiles[column], windows[column]
        )
    best, least = KEEP * PROFILES, math.inf
    for row in range(PATHS):
        paths[row, PATH_COST] = path_cost(
            record, paths[row], row, memory, driven
        ) + lane_speed_cost(
            record, paths[row, PATH_TARGET], pose[POSE_SPEED], allowed, objects, ways, count
        )
        for column in range(PROFILES):
            place = row * PROFILES + column
            costs[place] = math.inf
            if paths[row, PATH_EXISTS] == 0.0:
                continue
            costs[place] = candidate_cost(
                record,
                pose,
                row,
                paths[row],
                levels[column],
                profiles[column],
                windows[column],
                count,
                objects,
                ways,
                line,
                math.inf if is_shown else least,
            )
            if costs[place] < least:
                best, least = place, costs[place]
    return best


@compiled
def refine(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    allowed: float,
    count: int,
    objects: Floats,
    ways: Floats,
    memory: Floats,
    best: int,
    path: Floats,
    profiles: Floats,
    windows: Ints,
    line: Floats,
    levels: Floats,
    costs: Floats,
) -> None:
    """Look for a better acceleration between those of the fan, on the same path.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        allowed: Speed that desire, limit and curves allow [m/s].
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, SAMPLES, WAY_ROW).
        memory: (MEMORY_WIDTH,) in; the acceleration that is chosen, out.
        best: Candidate of the fan that costs least.
        path: (PATH_ROW,) its path.
        profiles: (PROFILES + 1, SAMPLES, PROFILE_ROW); the last is the chosen profile, out.
        windows: (PROFILES + 1, K, 2); the last is scratch.
        line: (SAMPLES, LINE_ROW) lateral samples of the choice, out.
        levels: (PROFILES + 1, LEVEL_ROW); the last is that chosen, out.
        costs: (CANDIDATES,).
    """
    row, column = best // PROFILES, best % PROFILES
    chosen, least = levels[column, LEVEL_WANTED], costs[best]
    lower = chosen - levels[max(column - 1, 0), LEVEL_WANTED]
    upper = levels[min(column + 1, PROFILES - 1), LEVEL_WANTED] - chosen
    level, profile, window = levels[PROFILES], profiles[PROFILES], windows[PROFILES]
    middle = chosen
    for step in range(2 * ROUNDS):
        if step % 2 == 0:
            lower, upper, middle = 0.5 * lower, 0.5 * upper, chosen
        trial = middle - lower if step % 2 == 0 else middle + upper
        if trial == middle:
            continue
        level[LEVEL_WANTED] = trial
        add_profile(record, pose, allowed, memory, level, profile, window)
        cost = candidate_cost(
            record, pose, row, path, level, profile, window, count, objects, ways, line, least
        )
        if cost < least:
            chosen, least = trial, cost
    level[LEVEL_WANTED] = chosen
    add_profile(record, pose, allowed, memory, level, profile, window)
    drive_path(record, pose, path, profile, True, line)  # noqa: FBT003 - a kernel
    memory[MEMORY_WANTED] = chosen


@compiled
def plan_step(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    allowed: float,
    count: int,
    objects: Floats,
    ways: Floats,
    memory: Floats,
    driven: Floats,
    paths: Floats,
    profiles: Floats,
    windows: Ints,
    line: Floats,
    levels: Floats,
    costs: Floats,
    is_shown: bool,  # noqa: FBT001 - a kernel
) -> int:
    """Choose path and acceleration of one run at one tick.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        allowed: Speed that desire, limit and curves allow [m/s].
        count: How many objects there are.
        objects: (K, OBJECT_ROW) see ``prediction``.
        ways: (K, SAMPLES, WAY_ROW).
        memory: (MEMORY_WIDTH,) in and out.
        driven: (PATH_ROW,) path that is being driven, in and out.
        paths: (PATHS, PATH_ROW) out.
        profiles: (PROFILES + 1, SAMPLES, PROFILE_ROW) out; the last one is that chosen.
        windows: (PROFILES + 1, K, 2) scratch.
        line: (SAMPLES, LINE_ROW) lateral samples of the choice, out.
        levels: (PROFILES + 1, LEVEL_ROW) scratch.
        costs: (CANDIDATES,) out; exact of all candidates only if they are shown.
        is_shown: Whether somebody looks at the costs.

    Returns:
        The candidate of the fan that cost least.
    """
    lay_paths(record, pose, memory, driven, paths)
    best = choose_candidate(
        record,
        pose,
        allowed,
        count,
        objects,
        ways,
        memory,
        driven,
        paths,
        profiles,
        windows,
        line,
        levels,
        costs,
        is_shown,
    )
    row = best // PROFILES
    refine(
        record,
        pose,
        allowed,
        count,
        objects,
        ways,
        memory,
        best,
        paths[row],
        profiles,
        windows,
        line,
        levels,
        costs,
    )
    if not np.isnan(paths[row, PATH_LANE]):
        memory[MEMORY_LANE] = paths[row, PATH_LANE]
    for item in range(PATH_ROW):
        driven[item] = paths[row, item]
    return best


# --- From the chosen trajectory to the command, and to the places that are shown of it ------------

# Columns of a plan.
PLAN_X, PLAN_Y, PLAN_HEADING, PLAN_SPEED = range(4)
PLAN_ROW: Final = 4

SHOWN: Final = (3, 7, 11, 15)
"""Samples of a candidate that are shown, behind the place of the ego itself."""

POINTS: Final = len(SHOWN) + 1

_STARTING: Final = 0.2
"""Acceleration below which a standing ego stays [m/s²], so that it does not creep."""

_ROOM: Final = 1.3
"""How much more lateral acceleration than planned may be used to correct. Our choice."""


@inlined
def steer_along(record: Any, pose: Floats, path: Floats) -> float:
    """Return the steering angle that keeps the ego on a path [rad].

    The curvature is fed forward from where the ego will be when the wheels have turned.

    Args:
        record: Has ``wheelbase``, ``max_steering_angle``, ``steering_lag``, ``period`` and
            ``max_lateral_acceleration``.
        pose: (POSE_WIDTH,).
        path: (PATH_ROW,).
    """
    way = pose[POSE_S] - path[PATH_START]
    d, slope, _ = at_path(path, way)
    ahead = way + pose[POSE_SPEED] * (record["steering_lag"] + 0.5 * record["period"])
    bend = at_path(path, ahead)[2]
    return lane_keeping_steering(
        pose[POSE_D] - d,
        wrap_to_pi(pose[POSE_ALIGN] - atan(slope)),
        offset_curvature(pose[POSE_CURVATURE], d) + bend,
        pose[POSE_SPEED],
        record["wheelbase"],
        0.5 * record["wheelbase"],
        PREVIEW_TIME,
        LEAST_PREVIEW,
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
    if speed < STANDSTILL and wanted < _STARTING:
        return -HOLD_DECELERATION
    if speed < STANDSTILL:
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
        s = pose[POSE_S] + profile[sample, PROFILE_S]
        x, y, heading = position(segments, s, line[sample, LINE_D])
        plan[sample, PLAN_X], plan[sample, PLAN_Y] = x, y
        plan[sample, PLAN_HEADING] = wrap_to_pi(heading + atan(line[sample, LINE_SLOPE]))
        plan[sample, PLAN_SPEED] = profile[sample, PROFILE_SPEED]


@compiled
def show_candidates(
    pose: Floats, segments: Floats, paths: Floats, profiles: Floats, candidates: Floats
) -> None:
    """Write the places of the fan in the map; rows of candidates that cannot be had are NaN.

    Args:
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        paths: (PATHS, PATH_ROW).
        profiles: (PROFILES + 1, SAMPLES, PROFILE_ROW).
        candidates: (CANDIDATES, POINTS, 2) out.
    """
    for place in range(CANDIDATES):
        path, profile = paths[place // PROFILES], profiles[place % PROFILES]
        candidates[place] = float("nan")
        if path[PATH_EXISTS] == 0.0:
            continue
        for point in range(POINTS):
            way = 0.0
            if point > 0:
                way = profile[SHOWN[point - 1], PROFILE_S]
            d = at_path(path, pose[POSE_S] + way - path[PATH_START])[0]
            x, y, _ = position(segments, pose[POSE_S] + way, d)
            candidates[place, point, 0], candidates[place, point, 1] = x, y
