"""One tick of the planner: lay the fan, take the candidate that costs least, refine its speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.channels.pose import POSE_CURVATURE, POSE_D, POSE_S, POSE_SPEED
from adeye.channels.trajectory.candidates import (
    CHANGE_LEFT,
    KEEP,
    PATH_COST,
    PATH_EXISTS,
    PATH_LANE,
    PATH_ROW,
    PATH_START,
    PATH_TARGET,
    PATHS,
    PROFILE_SPEED,
    PROFILES,
    fill_profile,
    set_accelerations,
)
from adeye.channels.trajectory.fan import (
    MEMORY_COMMAND,
    MEMORY_LANE,
    MEMORY_WANTED,
    lay_paths,
    path_cost,
)
from adeye.channels.trajectory.obstacles import (
    is_cut_up,
    lane_speed_cost,
    mark_interest,
    object_cost,
)
from adeye.channels.trajectory.prediction import SAMPLES
from adeye.channels.trajectory.scoring import (
    fill_line,
    line_cost,
    profile_cost,
)
from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints

ROUNDS: Final = 4
"""How often the step between two accelerations is halved around the best: to a sixteenth."""


@compiled
def add_profile(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    acceleration: float,
    wanted: float,
    count: int,
    objects: Floats,
    ways: Floats,
    profile: Floats,
    window: Ints,
) -> None:
    """Drive a speed profile and find which objects it comes near.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        pose: (POSE_WIDTH,).
        acceleration: That it begins with [m/s²].
        wanted: That it leads to [m/s²].
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, SAMPLES, WAY_ROW).
        profile: (SAMPLES, PROFILE_ROW) out.
        window: (K, 2) out.
    """
    interval = record["horizon"] / SAMPLES
    fill_profile(pose[POSE_SPEED], acceleration, wanted, record["max_jerk"], interval, profile)
    mark_interest(record, profile, objects, ways, count, interval, window)


@compiled
def candidate_cost(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    base: float,
    row: int,
    path: Floats,
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
        base: What its path and its profile cost by themselves.
        row: Which path of the fan it is.
        path: (PATH_ROW,).
        profile: (SAMPLES, PROFILE_ROW).
        window: (K, 2) see ``mark_interest``.
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, SAMPLES, WAY_ROW).
        line: (SAMPLES, LINE_ROW) out, unless the base is beyond the limit.
        limit: Cost from which nobody needs to know more.
    """
    cost = base
    if cost >= limit:
        return cost
    half = 0.5 * record["width"]
    # Who is beyond an edge already may come back.
    lowest = min(half - record["shoulder"], pose[POSE_D])
    highest = max(record["lanes"] * record["lane_width"] - half, pose[POSE_D])
    fill_line(path, profile, pose[POSE_S] - path[PATH_START], line)
    cost += line_cost(record, profile, line, pose[POSE_CURVATURE], lowest, highest, row == KEEP)
    if cost >= limit:
        return cost
    slowest = min(pose[POSE_SPEED], profile[SAMPLES - 1, PROFILE_SPEED])
    if is_cut_up(record, path[PATH_TARGET], pose[POSE_D], slowest, objects, ways, count):
        return math.inf
    interval = record["horizon"] / SAMPLES
    for item in range(count):
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
    return cost


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
    wanted: Floats,
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
        wanted: (PROFILES + 1,) accelerations that the profiles lead to, out, but for the last.
        costs: (CANDIDATES,) out; exact of all candidates only if they are shown.
        is_shown: Whether somebody looks at the costs.
    """
    set_accelerations(record, wanted)
    begin, before = memory[MEMORY_COMMAND], memory[MEMORY_WANTED]
    best, least = KEEP * PROFILES, math.inf
    for row in range(PATHS):
        paths[row, PATH_COST] = path_cost(
            record, paths[row], row, memory, driven
        ) + lane_speed_cost(
            record, paths[row, PATH_TARGET], pose[POSE_SPEED], allowed, objects, ways, count
        )
        for column in range(PROFILES):
            if row == KEEP:
                add_profile(
                    record,
                    pose,
                    begin,
                    wanted[column],
                    count,
                    objects,
                    ways,
                    profiles[column],
                    windows[column],
                )
            place = row * PROFILES + column
            costs[place] = math.inf
            if paths[row, PATH_EXISTS] == 0.0:
                continue
            base = paths[row, PATH_COST] + profile_cost(
                record, profiles[column], wanted[column], before, pose[POSE_SPEED], allowed
            )
            costs[place] = candidate_cost(
                record,
                pose,
                base,
                row,
                paths[row],
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
    wanted: Floats,
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
        wanted: (PROFILES + 1,) accelerations; the last is scratch.
        costs: (CANDIDATES,).
    """
    row, column = best // PROFILES, best % PROFILES
    begin, before = memory[MEMORY_COMMAND], memory[MEMORY_WANTED]
    chosen, least = wanted[column], costs[best]
    lower = chosen - wanted[max(column - 1, 0)]
    upper = wanted[min(column + 1, PROFILES - 1)] - chosen
    profile, window = profiles[PROFILES], windows[PROFILES]
    for step in range(2 * ROUNDS):
        if step % 2 == 0:
            lower, upper = 0.5 * lower, 0.5 * upper
            middle = chosen
        trial = middle - lower if step % 2 == 0 else middle + upper
        if trial == middle:
            continue
        add_profile(record, pose, begin, trial, count, objects, ways, profile, window)
        base = path[PATH_COST] + profile_cost(
            record, profile, trial, before, pose[POSE_SPEED], allowed
        )
        cost = candidate_cost(
            record, pose, base, row, path, profile, window, count, objects, ways, line, least
        )
        if cost < least:
            chosen, least = trial, cost
    add_profile(record, pose, begin, chosen, count, objects, ways, profile, window)
    fill_line(path, profile, pose[POSE_S] - path[PATH_START], line)
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
    wanted: Floats,
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
        wanted: (PROFILES + 1,) scratch.
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
        wanted,
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
        wanted,
        costs,
    )
    if not np.isnan(paths[row, PATH_LANE]):
        memory[MEMORY_LANE] = paths[row, PATH_LANE]
    for item in range(PATH_ROW):
        driven[item] = paths[row, item]
    return best
