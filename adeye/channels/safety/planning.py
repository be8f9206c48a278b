"""The planned stop at one tick: supervise, plan, and the command that it would give."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from adeye.channels.corridor import PATH_REQUIRED
from adeye.channels.perception import NOTE_END
from adeye.channels.pose import POSE_ACCELERATION, POSE_D, POSE_S, POSE_SPEED
from adeye.channels.safety.monitors import (
    MONITOR_IDS,
    OBJECT_DANGER,
    SEEN_D,
    SEEN_OFFSET,
    run_monitors,
)
from adeye.channels.safety.planner import FOUND_COST, FOUND_FEASIBLE, NO_STOP, plan_stop
from adeye.channels.safety.stop import brake
from adeye.channels.safety.supervision import (
    MEMORY_BRAKING,
    MEMORY_PATH,
    MEMORY_STOPPING,
    Batch,
    answer,
    coast,
    follow_lane,
    perceive,
    shadow,
    update_stopping,
)
from adeye.channels.trajectory.following import steer_along
from adeye.channels.trajectory.prediction import predict_objects
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_ROW,
    PATH_START,
    PROFILE_ACCELERATION,
    PROFILE_S,
    PROFILE_SPEED,
    at_path,
)
from adeye.kernel.refuge_stops import ANYWHERE
from adeye.kernel.road import position
from adeye.kernel.stops import (
    REFUGE,
    STOP_INTERVAL,
    STOP_LEVELS,
    STOP_SAMPLES,
    STOPS,
    STRAIGHT,
    path_of,
    profile_of,
    stop_jerk,
    stop_level,
)
from adeye.signals import FAULT, Floats, Ints

LAST_SAFE_STOP: Final = len(MONITOR_IDS)
"""Column of the monitor that the planner adds."""

POINTS: Final = 5
"""Places of a stop that are shown, the first that of the ego."""

# Columns of what is kept of the choice.
(
    KEPT_STOP,  # number of the stop, NO_STOP for none
    KEPT_FEASIBLE,  # whether it was feasible at the last plan
) = range(2)
KEPT_ROW: Final = 2


class Plans(NamedTuple):
    """What a tick of the planner reads and writes beside ``supervision.Batch``.

    Attributes:
        rules: (B, RULES) rating of each kind of place.
        refuges: (B, R, 5) parking bays and rest areas, see ``signals.REFUGE_COLUMNS``.
        kept: (B, KEPT_ROW) choice so far; in and out.
        driven: (B, PATH_ROW) its path; in and out.
        objects: (K, OBJECT_ROW) scratch, as all that follows.
        ways: (K, STOP_SAMPLES, WAY_ROW).
        paths: (LAID_PATHS, PATH_ROW).
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW).
        line: (STOP_SAMPLES, 2).
        found: (STOPS, FOUND_ROW) what is found of the stops.
    """

    rules: Floats
    refuges: Floats
    kept: Floats
    driven: Floats
    objects: Floats
    ways: Floats
    paths: Floats
    profiles: Floats
    line: Floats
    found: Floats


@inlined
def planned_step(batch: Batch, plans: Plans, run: int, time: float, shows: bool) -> int:  # noqa: FBT001 - a kernel
    """Decide one run at one tick; as ``supervision.safety_step``, with a planned stop.

    Args:
        batch: What it reads and writes.
        plans: And of the stops.
        run: Which row is meant.
        time: [s].
        shows: Whether somebody looks at the stops.

    Returns:
        OK, REQUESTS_AUTHORITY, or FAULT without a recent ego estimate.
    """
    record, shown, kept = batch.records[run], batch.monitors[run], plans.kept[run]
    knows_pose = perceive(batch, run, time)
    count = 0
    shown[LAST_SAFE_STOP, 0] = False
    if knows_pose:
        count = foresee(batch, plans, run)
        # One tick more, and those in which the monitor is confirmed.
        wait = (record["confirm_ticks"] + 1.0) * record["period"]
        shown[LAST_SAFE_STOP, 0] = is_last_stop(batch, plans, run, count, wait)
    confirmed = run_monitors(record, batch.evidence, batch.states[run], shown)
    if not knows_pose:
        kept[KEPT_STOP] = NO_STOP
        return coast(batch, run)
    memory = batch.memory[run]
    update_stopping(memory, confirmed, batch.reason[run], batch.pose[run, POSE_ACCELERATION])
    is_stopping = memory[MEMORY_STOPPING] > 0.0
    if not is_stopping:
        kept[KEPT_STOP] = NO_STOP
    if is_stopping or shows:
        stop = ask_for_stop(batch, plans, run, count, ANYWHERE, 0.0, int(kept[KEPT_STOP]))
        if is_stopping:
            take_stop(plans, run, stop)
    if not is_stopping:
        return shadow(batch, run, confirmed)
    return drive_stop(batch, plans, run, confirmed, shown[OBJECT_DANGER, 1])


@inlined
def foresee(batch: Batch, plans: Plans, run: int) -> int:
    """Predict the objects, take the stop that is driven for the lane; return how many there are."""
    record, pose = batch.records[run], batch.pose[run]
    if _is_driven(batch.memory[run], plans.kept[run]):
        _look_along(pose, batch.memory[run], plans.driven[run], batch.evidence)
    return predict_objects(
        batch.tracks[run],
        int(batch.notes[run, NOTE_END]),
        pose,
        batch.segments[run],
        record["length"],
        record["lane_width"],
        int(record["lanes"]),
        record["confirm_hits"],
        STOP_INTERVAL,
        plans.objects,
        plans.ways,
    )


@inlined
def ask_for_stop(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    run: int,
    count: int,
    places: int,
    wait: float,
    kept: int,
    any_will_do: bool = False,  # noqa: FBT001, FBT002 - a kernel
) -> int:
    """Choose a stop in some places that begins after a while [s], see ``planner.plan_stop``."""
    return plan_stop(
        batch.records[run],
        plans.rules[run],
        batch.segments[run],
        plans.refuges[run],
        places,
        any_will_do,
        batch.pose[run],
        wait,
        batch.memory[run, MEMORY_PATH],
        count,
        plans.objects,
        plans.ways,
        kept,
        plans.driven[run],
        plans.paths,
        plans.profiles,
        plans.line,
        plans.found,
    )


@inlined
def take_stop(plans: Plans, run: int, stop: int) -> None:
    """Keep a choice and its path."""
    kept, driven = plans.kept[run], plans.driven[run]
    kept[KEPT_STOP], kept[KEPT_FEASIBLE] = stop, plans.found[stop, FOUND_FEASIBLE]
    for item in range(PATH_ROW):
        driven[item] = plans.paths[path_of(stop), item]


@inlined
def drive_stop(batch: Batch, plans: Plans, run: int, requests: bool, is_danger: bool) -> int:  # noqa: FBT001 - a kernel
    """Give the command of the stop that is kept.

    Args:
        batch: What is read and written.
        plans: And of the stops.
        run: Which row is meant.
        requests: Whether authority is wanted.
        is_danger: Whether an object ahead is a confirmed danger.
    """
    record, pose = batch.records[run], batch.pose[run]
    stop, memory = int(plans.kept[run, KEPT_STOP]), batch.memory[run]
    if _drives_on(plans, stop):
        # On the way to a refuge nothing makes the ego faster.
        memory[MEMORY_BRAKING] = min(0.0, follow_lane(batch, run))
        acceleration = float(memory[MEMORY_BRAKING])
    else:
        is_in_lane = stop // STOP_LEVELS <= STRAIGHT
        acceleration = _stop(record, pose, memory, stop, batch.path, is_in_lane, is_danger)
    return answer(batch, run, acceleration, steer_along(record, pose, plans.driven[run]), requests)


@inlined
def _drives_on(plans: Plans, stop: int) -> bool:
    """Tell whether a stop is one in a refuge that does not brake yet."""
    first = plans.profiles[profile_of(stop), 0]
    is_ahead = stop // STOP_LEVELS == REFUGE and first[PROFILE_SPEED] > 0.0
    return bool(is_ahead and first[PROFILE_ACCELERATION] >= 0.0)


@inlined
def _is_driven(memory: Floats, kept: Floats) -> bool:
    """Tell whether the ego is in a stop that was chosen."""
    return bool(memory[MEMORY_STOPPING] > 0.0 and kept[KEPT_STOP] != NO_STOP)


@inlined
def _look_along(pose: Floats, memory: Floats, driven: Floats, seen: Floats) -> None:
    """Take a departure for one from the stop that is driven, wherever that leads."""
    way = pose[POSE_S] - driven[PATH_START]
    seen[SEEN_OFFSET] = pose[POSE_D] - at_path(driven, way)[0]
    seen[SEEN_D] = memory[MEMORY_PATH]


@inlined
def is_last_stop(batch: Batch, plans: Plans, run: int, count: int, wait: float) -> bool:
    """Tell whether no safe stop is left, after a while [s] or in the stop that the ego is in."""
    if _is_driven(batch.memory[run], plans.kept[run]):
        return bool(plans.kept[run, KEPT_FEASIBLE] <= 0.0)
    stop = ask_for_stop(batch, plans, run, count, ANYWHERE, wait, NO_STOP, True)  # noqa: FBT003
    return bool(plans.found[stop, FOUND_FEASIBLE] <= 0.0)


@inlined
def _stop(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    memory: Floats,
    stop: int,
    path: Floats,
    is_in_lane: bool,  # noqa: FBT001 - a kernel
    is_danger: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return the acceleration of a stop; in the lane, an object ahead may ask for more [m/s²]."""
    level = stop % STOP_LEVELS
    memory[MEMORY_BRAKING] = brake(
        record,
        memory[MEMORY_BRAKING],
        pose[POSE_SPEED],
        stop_level(record, level),
        stop_jerk(level),
        path[PATH_REQUIRED] if is_in_lane else 0.0,
        is_in_lane and is_danger,
    )
    return float(memory[MEMORY_BRAKING])


@inlined
def show_plan(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    run: int,
    state: int,
    candidates: Floats,
    costs: Floats,
    chosen: Ints,
) -> None:
    """Write the stops of a run and the choice, for pictures.

    Args:
        batch: What is read.
        plans: And of the stops.
        run: Which row is meant.
        state: Of the channel; in FAULT it has no stops.
        candidates: (B, STOPS, POINTS, 2) out.
        costs: (B, STOPS) out.
        chosen: (B,) out.
    """
    chosen[run] = NO_STOP
    candidates[run] = np.nan
    costs[run] = np.nan
    if state != FAULT:
        chosen[run] = int(plans.kept[run, KEPT_STOP])
        show_stops(
            batch.pose[run],
            batch.segments[run],
            plans.paths,
            plans.profiles,
            plans.found,
            candidates[run],
            costs[run],
        )


@compiled
def show_stops(  # noqa: PLR0913, PLR0917 - a kernel
    pose: Floats,
    segments: Floats,
    paths: Floats,
    profiles: Floats,
    found: Floats,
    places: Floats,
    costs: Floats,
) -> None:
    """Write the places of all stops in the map, and what they cost.

    Args:
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        paths: (LAID_PATHS, PATH_ROW).
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW).
        found: (STOPS, FOUND_ROW).
        places: (STOPS, POINTS, 2) out, NaN for stops that do not exist.
        costs: (STOPS,) out, infinity for stops that are not feasible.
    """
    for stop in range(STOPS):
        path, profile = paths[path_of(stop)], profiles[profile_of(stop)]
        if path[PATH_EXISTS] == 0.0:
            continue
        is_feasible = found[stop, FOUND_FEASIBLE] > 0.0
        costs[stop] = found[stop, FOUND_COST] if is_feasible else math.inf
        for point in range(POINTS):
            way = profile[STOP_SAMPLES - 1, PROFILE_S] * point / (POINTS - 1.0)
            d = at_path(path, pose[POSE_S] + way - path[PATH_START])[0]
            x, y, _ = position(segments, pose[POSE_S] + way, d)
            places[stop, point, 0], places[stop, point, 1] = x, y
