"""The nominal channel's decision at one tick: follow, keep the lane, or brake in an emergency."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from adeye.channels.corridor import PATH_GAP, PATH_REQUIRED, PATH_SPEED, view_path
from adeye.channels.driving import allowed_speed, follow, is_number, path_of_lane, steer
from adeye.channels.pose import POSE_D, POSE_SPEED, has_pose
from adeye.kernel.jit import inlined
from adeye.signals import FAULT, OK, Floats

# Columns of what the channel remembers beside pose and tracks.
(
    MEMORY_PATH,  # lateral place of its lane's centre [m], NaN before it knows where it is
    MEMORY_EMERGENCY,  # whether it brakes in an emergency
) = range(2)
MEMORY_WIDTH: Final = 2

RELEASE: Final = 0.3
"""Share of the emergency threshold below which the required deceleration ends an emergency. Our
choice: by then nine tenths of the closing speed that called for it are gone."""


@inlined
def nominal_step(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    time: float,
    segments: Floats,
    end: int,
    pose: Floats,
    tracks: Floats,
    memory: Floats,
    command: Floats,
    path: Floats,
) -> int:
    """Decide one run at one tick.

    Args:
        record: Parameters, see ``channel.NominalChannel``.
        time: [s].
        segments: (K, 5) reference line of the road.
        end: Rows of tracks from here on are free places.
        pose: (POSE_WIDTH,).
        tracks: (K, TRACK_STATE).
        memory: (MEMORY_WIDTH,) in and out.
        command: (2,) acceleration [m/s²] and steering angle [rad]; in and out.
        path: (PATH_WIDTH,) scratch.

    Returns:
        OK, or FAULT without a recent ego estimate: then it coasts with the steering held.
    """
    if not has_pose(pose, time):
        command[0] = 0.0
        return FAULT
    if np.isnan(memory[MEMORY_PATH]):
        memory[MEMORY_PATH] = path_of_lane(record, pose[POSE_D])
    path_d = memory[MEMORY_PATH]
    view_path(
        tracks,
        end,
        pose,
        segments,
        path_d,
        record["length"],
        record["width"],
        record["lateral_margin"],
        record["confirm_hits"],
        path,
    )
    speed = pose[POSE_SPEED]
    hardest = min(record["emergency_threshold"], record["emergency_deceleration"])
    allowed = allowed_speed(record, segments, pose, path_d)
    acceleration = follow(record, speed, allowed, path[PATH_GAP], path[PATH_SPEED], hardest)
    memory[MEMORY_EMERGENCY] = is_emergency(
        memory[MEMORY_EMERGENCY] > 0.0, path[PATH_REQUIRED], record["emergency_threshold"]
    )
    if memory[MEMORY_EMERGENCY] > 0.0:
        acceleration = -record["emergency_deceleration"]
    steering = steer(record, pose, path_d)
    if not is_number(acceleration, steering):
        command[0] = 0.0
        return FAULT
    command[0] = acceleration
    command[1] = steering
    return OK


@inlined
def is_emergency(was: bool, required: float, threshold: float) -> bool:  # noqa: FBT001 - a kernel
    """Tell whether to brake in an emergency, with hysteresis.

    Args:
        was: Whether it did at the previous tick.
        required: Required deceleration [m/s²]; 0 at standstill and with nothing in the path.
        threshold: From which it begins [m/s²].
    """
    if was:
        return required > RELEASE * threshold
    return required >= threshold
