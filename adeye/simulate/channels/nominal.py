"""The nominal channel: tracking, car following, lane keeping and emergency braking."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.jit import compiled, inlined
from adeye.signals import (
    DEGRADED,
    FAULT,
    OK,
    Bools,
    ControlCommand,
    Floats,
    Ints,
    Observation,
    spec_columns,
)
from adeye.simulate.channels.corridor import (
    PATH_GAP,
    PATH_REQUIRED,
    PATH_SPEED,
    PATH_WIDTH,
    view_path,
)
from adeye.simulate.channels.driving import (
    allowed_speed,
    channel_records,
    follow,
    is_number,
    path_of_lane,
    steer,
)
from adeye.simulate.channels.hooks import HOOKS, Hooks
from adeye.simulate.channels.perception.pose import POSE_D, POSE_SPEED, has_pose
from adeye.simulate.channels.perception.step import NOTE_END, Perception
from adeye.spec.channels import NominalParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext

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


# --- The built-in nominal channel on the batch ----------------------------------------------------


class NominalChannel:
    """Drives along its lane on what its linked sensors see, follows, and brakes in an emergency.

    It sees measurements only. Without a recent ego estimate its state is FAULT, with a linked
    sensor that does not deliver it is DEGRADED.
    """

    monitor_ids: tuple[str, ...] = ()
    hooks: tuple[str, ...] = HOOKS

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        names = tuple(NominalParameters.model_fields)
        fields = spec_columns(
            context.parameters, lambda item: {name: float(getattr(item, name)) for name in names}
        )
        self._channel_id = context.channel_id
        self._hooks = Hooks()
        self._perception = Perception(context, channel_records(context, fields))
        self._memory = np.zeros((runs, MEMORY_WIDTH))
        self._memory[:, MEMORY_PATH] = np.nan
        self._command = np.zeros((runs, 2))
        self._status = np.full(runs, FAULT, dtype=np.int64)
        self._path = np.zeros(PATH_WIDTH)

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Take in where a fault inside the channel is present from now on."""
        self._hooks.inject(hook, active, size)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation with one command per run."""
        seen = self._perception
        self._hooks.before(seen)
        seen.update(observation)
        self._hooks.after(seen)
        _act(
            seen.records,
            observation.time,
            seen.running,
            seen.segments,
            seen.pose,
            seen.tracks,
            seen.notes,
            seen.degraded,
            self._memory,
            self._command,
            self._status,
            self._path,
        )
        command = ControlCommand(
            self._channel_id,
            self._command[:, 0].copy(),
            self._command[:, 1].copy(),
            np.full(self._status.shape, observation.time),
            self._status.copy(),
            tracks=seen.shown.copy(),
        )
        return self._hooks.answer(command)


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    records: Any,
    time: float,
    running: Bools,
    segments: Floats,
    pose: Floats,
    tracks: Floats,
    notes: Floats,
    degraded: Bools,
    memory: Floats,
    command: Floats,
    status: Ints,
    path: Floats,
) -> None:
    for run in range(records.shape[0]):
        if not running[run]:
            continue
        state = nominal_step(
            records[run],
            time,
            segments[run],
            int(notes[run, NOTE_END]),
            pose[run],
            tracks[run],
            memory[run],
            command[run],
            path,
        )
        if state == OK and degraded[run]:
            state = DEGRADED
        status[run] = state
