"""The safety channel's decision at one tick: supervise, and the command that it would give."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from adeye.channels.corridor import PATH_GAP, PATH_REQUIRED, PATH_SPEED, view_path
from adeye.channels.driving import allowed_speed, follow, is_number, path_of_lane, steer
from adeye.channels.pose import POSE_ACCELERATION, POSE_D, POSE_SPEED, has_pose
from adeye.channels.safety.monitors import (
    OBJECT_DANGER,
    SEEN_D,
    SEEN_OFFSET,
    SEEN_POSE,
    SEEN_REQUIRED,
    gather_commands,
    run_monitors,
)
from adeye.channels.safety.stop import stop_acceleration
from adeye.kernel.jit import inlined
from adeye.signals import (
    FAULT,
    OK,
    REASON_DEFAULT,
    REASON_NONE,
    REASON_VOTED,
    REQUESTS_AUTHORITY,
    Bools,
    Floats,
    Ints,
)

# Columns of what the channel remembers beside pose, tracks and monitors.
(
    MEMORY_PATH,  # lateral place of its lane's centre [m], NaN before it knows where it is
    MEMORY_STOPPING,  # whether it is on the way to a safe stop
    MEMORY_BRAKING,  # acceleration of the stop at the previous tick [m/s²]
) = range(3)
MEMORY_WIDTH: Final = 3

NO_SWITCH: Final = -1
"""Reason that stands for a switch that is not linked."""


@inlined
def safety_step(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
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
    command: Floats,
    shown: Bools,
    path: Floats,
    seen: Floats,
) -> int:
    """Decide one run at one tick.

    Args:
        record: Parameters, see ``channel.SafetyChannel``.
        time: [s].
        segments: (K, 5) reference line of the road.
        end: Rows of tracks from here on are free places.
        numbers: (N, 3) acceleration, steering angle, stamp of the linked channels.
        channel_status: (N,) their states.
        reason: Why the acting channel acts, ``NO_SWITCH`` without link.
        pose: (POSE_WIDTH,).
        tracks: (K, TRACK_STATE).
        heard: (N,) whether each linked channel has given a usable command yet; in and out.
        states: (Q, STATE_WIDTH) debounce of the monitors; in and out.
        memory: (MEMORY_WIDTH,) in and out.
        command: (2,) acceleration [m/s²] and steering angle [rad]; in and out.
        shown: (Q, 2) raw and confirmed state of the monitors, out.
        path: (PATH_WIDTH,) scratch.
        seen: (EVIDENCE_WIDTH,) scratch.

    Returns:
        OK, REQUESTS_AUTHORITY, or FAULT without a recent ego estimate: then it coasts with the
        steering held.
    """
    knows_pose = has_pose(pose, time)
    seen[:] = 0.0
    path[:] = 0.0
    gather_commands(time, numbers, channel_status, heard, seen)
    if knows_pose:
        look(record, segments, pose, tracks, end, memory, path, seen)
    confirmed = run_monitors(record, seen, states, shown)
    if not knows_pose:
        command[0] = 0.0
        return FAULT
    update_stopping(memory, confirmed, reason, pose[POSE_ACCELERATION])
    is_danger = shown[OBJECT_DANGER, 1]
    command[0] = _acceleration(record, segments, pose, memory, path, is_danger)
    steering = steer(record, pose, memory[MEMORY_PATH])
    if not is_number(command[0], steering):
        command[0] = 0.0
        return FAULT
    command[1] = steering
    return REQUESTS_AUTHORITY if confirmed else OK


@inlined
def look(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    segments: Floats,
    pose: Floats,
    tracks: Floats,
    end: int,
    memory: Floats,
    path: Floats,
    seen: Floats,
) -> None:
    """Take the evidence of the scene: the lane, and the objects in the path."""
    nearest = path_of_lane(record, pose[POSE_D])
    offset = pose[POSE_D] - nearest
    # A lane is taken over once the ego is well inside it, so a departure leads back.
    if np.isnan(memory[MEMORY_PATH]) or abs(offset) <= 0.5 * record["max_lane_offset"]:
        memory[MEMORY_PATH] = nearest
    view_path(
        tracks,
        end,
        pose,
        segments,
        memory[MEMORY_PATH],
        record["length"],
        record["width"],
        record["lateral_margin"],
        record["confirm_hits"],
        path,
    )
    seen[SEEN_POSE] = 1.0
    seen[SEEN_REQUIRED] = path[PATH_REQUIRED]
    seen[SEEN_OFFSET] = offset
    seen[SEEN_D] = pose[POSE_D]


@inlined
def update_stopping(memory: Floats, confirmed: bool, reason: int, acceleration: float) -> None:  # noqa: FBT001 - a kernel
    """Begin a safe stop on a confirmed monitor; give it up once another channel acts by default.

    A stop goes on although its monitors have healed as long as authority was given on request, for
    staleness or is latched, and for good if the switch is not linked: to drive on from a safe stop
    is for somebody else to decide.
    """
    if confirmed:
        if memory[MEMORY_STOPPING] <= 0.0:
            memory[MEMORY_BRAKING] = min(0.0, acceleration)
        memory[MEMORY_STOPPING] = 1.0
    elif reason in (REASON_NONE, REASON_DEFAULT, REASON_VOTED):
        memory[MEMORY_STOPPING] = 0.0


@inlined
def _acceleration(
    record: Any,
    segments: Floats,
    pose: Floats,
    memory: Floats,
    path: Floats,
    is_danger: bool,  # noqa: FBT001 - a kernel
) -> float:
    if memory[MEMORY_STOPPING] > 0.0:
        memory[MEMORY_BRAKING] = stop_acceleration(
            record, memory[MEMORY_BRAKING], pose[POSE_SPEED], path[PATH_REQUIRED], is_danger
        )
        return float(memory[MEMORY_BRAKING])
    return shadow_acceleration(record, segments, pose, memory, path)


@inlined
def shadow_acceleration(
    record: Any, segments: Floats, pose: Floats, memory: Floats, path: Floats
) -> float:
    """Return the acceleration while no stop is asked for: car following [m/s²]."""
    allowed = allowed_speed(record, segments, pose, memory[MEMORY_PATH])
    return follow(
        record,
        pose[POSE_SPEED],
        allowed,
        path[PATH_GAP],
        path[PATH_SPEED],
        record["stop_deceleration"],
    )
