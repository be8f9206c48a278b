"""The planned stop at one tick: supervise, plan, and the command that it would give."""

from __future__ import annotations

import math
from typing import Any, Final

from adeye.channels.corridor import PATH_REQUIRED
from adeye.channels.driving import is_number, steer
from adeye.channels.pose import POSE_ACCELERATION, POSE_D, POSE_S, POSE_SPEED, has_pose
from adeye.channels.safety.monitors import (
    MONITOR_IDS,
    OBJECT_DANGER,
    SEEN_D,
    SEEN_OFFSET,
    gather_commands,
    run_monitors,
)
from adeye.channels.safety.planner import FOUND_COST, FOUND_FEASIBLE, NO_STOP, plan_stop
from adeye.channels.safety.stop import brake
from adeye.channels.safety.supervision import (
    MEMORY_BRAKING,
    MEMORY_PATH,
    MEMORY_STOPPING,
    look,
    shadow_acceleration,
    update_stopping,
)
from adeye.channels.trajectory.following import steer_along
from adeye.channels.trajectory.prediction import predict_objects
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_ROW,
    PATH_START,
    PROFILE_S,
    at_path,
)
from adeye.kernel.road import position
from adeye.kernel.stops import (
    STOP_INTERVAL,
    STOP_LEVELS,
    STOP_SAMPLES,
    STOPS,
    STRAIGHT,
    stop_jerk,
    stop_level,
)
from adeye.signals import (
    FAULT,
    OK,
    REQUESTS_AUTHORITY,
    Bools,
    Floats,
    Ints,
)

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


@inlined
def planned_step(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    rules: Floats,
    time: float,
    segments: Floats,
    end: int,
    numbers: Floats,
    channel_status: Ints,
    reason: int,
    pose: Floats,
    tracks: Floats,
    heard: Bools,
    states: Ints,
    memory: Floats,
    kept: Floats,
    driven: Floats,
    command: Floats,
    shown: Bools,
    path: Floats,
    seen: Floats,
    shows: bool,  # noqa: FBT001 - a kernel
    scratch: tuple[Floats, Floats, Floats, Floats, Floats, Floats],
) -> int:
    """Decide one run at one tick; as ``supervision.safety_step``, with a planned stop.

    Args:
        record: Parameters, vehicle and road.
        rules: (RULES,) rating of each kind of place.
        time: [s].
        segments: (R, 5) reference line of the road.
        end: Rows of tracks from here on are free places.
        numbers: (N, 3) acceleration, steering angle, stamp of the linked channels.
        channel_status: (N,) their states.
        reason: Why the acting channel acts, ``NO_SWITCH`` without link.
        pose: (POSE_WIDTH,).
        tracks: (K, TRACK_STATE).
        heard: (N,) whether each linked channel has given a usable command yet; in and out.
        states: (Q, STATE_WIDTH) debounce of the monitors; in and out.
        memory: (MEMORY_WIDTH,) in and out.
        kept: (KEPT_ROW,) choice so far; in and out.
        driven: (PATH_ROW,) its path; in and out.
        command: (2,) acceleration [m/s²] and steering angle [rad]; in and out.
        shown: (Q, 2) raw and confirmed state of the monitors, out.
        path: (PATH_WIDTH,) scratch.
        seen: (EVIDENCE_WIDTH,) scratch.
        shows: Whether somebody looks at the stops.
        scratch: Objects, their ways, paths, profiles, line, what is found of the stops.

    Returns:
        OK, REQUESTS_AUTHORITY, or FAULT without a recent ego estimate.
    """
    objects, ways, paths, profiles, line, found = scratch
    knows_pose = has_pose(pose, time)
    seen[:] = 0.0
    path[:] = 0.0
    gather_commands(time, numbers, channel_status, heard, seen)
    count = 0
    shown[LAST_SAFE_STOP, 0] = False
    if knows_pose:
        look(record, segments, pose, tracks, end, memory, path, seen)
        if _is_driven(memory, kept):
            _look_along(pose, memory, driven, seen)
        count = predict_objects(
            tracks,
            end,
            pose,
            segments,
            record["length"],
            record["lane_width"],
            int(record["lanes"]),
            record["confirm_hits"],
            STOP_INTERVAL,
            objects,
            ways,
        )
        shown[LAST_SAFE_STOP, 0] = _is_last_stop(
            record, rules, segments, pose, memory, kept, count, driven, scratch
        )
    confirmed = run_monitors(record, seen, states, shown)
    if not knows_pose:
        command[0] = 0.0
        kept[KEPT_STOP] = NO_STOP
        return FAULT
    update_stopping(memory, confirmed, reason, pose[POSE_ACCELERATION])
    is_stopping = memory[MEMORY_STOPPING] > 0.0
    if not is_stopping:
        kept[KEPT_STOP] = NO_STOP
    if is_stopping or shows:
        stop = plan_stop(
            record,
            rules,
            segments,
            pose,
            0.0,
            memory[MEMORY_PATH],
            count,
            objects,
            ways,
            int(kept[KEPT_STOP]),
            driven,
            paths,
            profiles,
            line,
            found,
        )
        if is_stopping:
            kept[KEPT_STOP], kept[KEPT_FEASIBLE] = stop, found[stop, FOUND_FEASIBLE]
            for item in range(PATH_ROW):
                driven[item] = paths[stop // STOP_LEVELS, item]
    if is_stopping:
        acceleration = _stop(record, pose, memory, int(kept[KEPT_STOP]), path, shown)
        steering = steer_along(record, pose, driven)
    else:
        acceleration = shadow_acceleration(record, segments, pose, memory, path)
        steering = steer(record, pose, memory[MEMORY_PATH])
    if not is_number(acceleration, steering):
        command[0] = 0.0
        return FAULT
    command[0], command[1] = acceleration, steering
    return REQUESTS_AUTHORITY if confirmed else OK


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
def _is_last_stop(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    rules: Floats,
    segments: Floats,
    pose: Floats,
    memory: Floats,
    kept: Floats,
    count: int,
    driven: Floats,
    scratch: tuple[Floats, Floats, Floats, Floats, Floats, Floats],
) -> bool:
    """Tell whether no safe stop is left, if the ego waits or in the stop that it is in."""
    objects, ways, paths, profiles, line, found = scratch
    if _is_driven(memory, kept):
        return bool(kept[KEPT_FEASIBLE] <= 0.0)
    # One tick more, and those in which the monitor is confirmed.
    wait = (record["confirm_ticks"] + 1.0) * record["period"]
    stop = plan_stop(
        record,
        rules,
        segments,
        pose,
        wait,
        memory[MEMORY_PATH],
        count,
        objects,
        ways,
        NO_STOP,
        driven,
        paths,
        profiles,
        line,
        found,
    )
    return bool(found[stop, FOUND_FEASIBLE] <= 0.0)


@inlined
def _stop(
    record: Any, pose: Floats, memory: Floats, stop: int, path: Floats, shown: Bools
) -> float:
    """Return the acceleration of a stop; in the lane, an object ahead may ask for more [m/s²]."""
    level = stop % STOP_LEVELS
    is_in_lane = stop // STOP_LEVELS <= STRAIGHT
    memory[MEMORY_BRAKING] = brake(
        record,
        memory[MEMORY_BRAKING],
        pose[POSE_SPEED],
        stop_level(record, level),
        stop_jerk(level),
        path[PATH_REQUIRED] if is_in_lane else 0.0,
        is_in_lane and shown[OBJECT_DANGER, 1],
    )
    return float(memory[MEMORY_BRAKING])


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
        paths: (STOP_PATHS, PATH_ROW).
        profiles: (STOP_LEVELS, STOP_SAMPLES, PROFILE_ROW).
        found: (STOPS, FOUND_ROW).
        places: (STOPS, POINTS, 2) out, NaN for stops that do not exist.
        costs: (STOPS,) out, infinity for stops that are not feasible.
    """
    for stop in range(STOPS):
        path, profile = paths[stop // STOP_LEVELS], profiles[stop % STOP_LEVELS]
        if path[PATH_EXISTS] == 0.0:
            continue
        is_feasible = found[stop, FOUND_FEASIBLE] > 0.0
        costs[stop] = found[stop, FOUND_COST] if is_feasible else math.inf
        for point in range(POINTS):
            way = profile[STOP_SAMPLES - 1, PROFILE_S] * point / (POINTS - 1.0)
            d = at_path(path, pose[POSE_S] + way - path[PATH_START])[0]
            x, y, _ = position(segments, pose[POSE_S] + way, d)
            places[stop, point, 0], places[stop, point, 1] = x, y
