"""The nominal channel: tracking, car following, lane keeping and emergency braking."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import center_at, ground_of
from adeye.signals import DEGRADED, FAULT, OK, Floats, Ints
from adeye.simulate.channels import corridor, driving
from adeye.simulate.channels.hooks import PerceivingChannel
from adeye.simulate.channels.perception.pose import POSE_D, POSE_S, POSE_SPEED, has_pose
from adeye.spec.channels import NominalParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.simulate.channels.perception.step import Seen

# --- The nominal channel's decision at one tick: follow, keep the lane, or brake in an emergency --

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
def nominal_step(
    seen: Seen, run: int, time: float, memory: Floats, command: Floats, path: Floats
) -> int:
    """Decide one run at one tick.

    Args:
        seen: What the channel has perceived.
        run: Which row is meant.
        time: [s].
        memory: (MEMORY_WIDTH,) in and out.
        command: (2,) acceleration [m/s²] and steering angle [rad]; in and out.
        path: (PATH_WIDTH,) scratch.

    Returns:
        OK, or FAULT without a recent ego estimate: then it coasts with the steering held.
    """
    record, ground, pose = seen.records[run], ground_of(seen.grounds, run), seen.pose[run]
    if not has_pose(pose, time):
        command[0] = 0.0
        return FAULT
    if np.isnan(memory[MEMORY_PATH]):
        memory[MEMORY_PATH] = center_at(ground, pose[POSE_S], pose[POSE_D])
    memory[MEMORY_PATH] = driving.path_in_lane(ground, pose[POSE_S], memory[MEMORY_PATH])
    path_d = memory[MEMORY_PATH]
    corridor.view_path(seen, run, path_d, path)
    speed = pose[POSE_SPEED]
    hardest = min(record["emergency_threshold"], record["emergency_deceleration"])
    allowed = driving.allowed_speed(record, ground, pose, path_d)
    acceleration = driving.follow(
        record, ground, speed, allowed, path[corridor.PATH_GAP], path[corridor.PATH_SPEED], hardest
    )
    memory[MEMORY_EMERGENCY] = is_emergency(
        memory[MEMORY_EMERGENCY] > 0.0, path[corridor.PATH_REQUIRED], record["emergency_threshold"]
    )
    if memory[MEMORY_EMERGENCY] > 0.0:
        acceleration = -record["emergency_deceleration"]
    steering = driving.steer(record, ground, pose, path_d)
    if not driving.is_number(acceleration, steering):
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


# --- The built-in nominal channel on the batch ----------------------------------------------------


class NominalChannel(PerceivingChannel):
    """Drives along its lane on what its linked sensors see, follows, and brakes in an emergency.

    It sees measurements only. Without a recent ego estimate its state is FAULT, with a linked
    sensor that does not deliver it is DEGRADED.
    """

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        fields = driving.parameter_columns(context, NominalParameters.model_fields)
        self._prepare(context, driving.channel_records(context, fields))
        self._memory = np.zeros((context.runs, MEMORY_WIDTH))
        self._memory[:, MEMORY_PATH] = np.nan
        self._path = np.zeros(corridor.PATH_WIDTH)

    def _decide(self, time: float) -> None:
        _act(self._seen, time, self._memory, self._command, self._status, self._path)


@compiled
def _act(
    seen: Seen, time: float, memory: Floats, command: Floats, status: Ints, path: Floats
) -> None:
    for run in range(seen.records.shape[0]):
        if seen.running[run]:
            state = nominal_step(seen, run, time, memory[run], command[run], path)
            status[run] = DEGRADED if state == OK and seen.degraded[run] else state
