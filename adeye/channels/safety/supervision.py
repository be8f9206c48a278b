"""The safety channel's decision at one tick: supervise, and the command that it would give."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from adeye.channels.corridor import PATH_GAP, PATH_REQUIRED, PATH_SPEED, view_path
from adeye.channels.driving import allowed_speed, follow, is_number, path_of_lane, steer
from adeye.channels.perception import NOTE_END
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
    DEGRADED,
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


class Batch(NamedTuple):
    """What a tick of the channel reads and writes, run by run.

    Attributes:
        records: (B,) parameters, see ``channel.SafetyChannel``.
        segments: (B, K, 5) reference line of the road.
        running: (B,) runs that have not ended; the others are left alone.
        numbers: (B, N, 3) acceleration, steering angle, stamp of the linked channels.
        channel_status: (B, N) their states.
        reason: (B,) why the acting channel acts, ``NO_SWITCH`` without link.
        pose: (B, POSE_WIDTH).
        tracks: (B, K, TRACK_STATE).
        notes: (B, NOTE_WIDTH), see ``perception``.
        degraded: (B,) whether a linked sensor does not deliver.
        heard: (B, N) whether each linked channel has given a usable command yet; in and out.
        states: (B, Q, 2) debounce of the monitors; in and out.
        memory: (B, MEMORY_WIDTH) in and out.
        command: (B, 2) acceleration [m/s²] and steering angle [rad]; in and out.
        status: (B,) out.
        monitors: (B, Q, 2) raw and confirmed state of the monitors, out.
        path: (PATH_WIDTH,) scratch.
        evidence: (EVIDENCE_WIDTH,) scratch.
    """

    records: Any
    segments: Floats
    running: Bools
    numbers: Floats
    channel_status: Ints
    reason: Ints
    pose: Floats
    tracks: Floats
    notes: Floats
    degraded: Bools
    heard: Bools
    states: Ints
    memory: Floats
    command: Floats
    status: Ints
    monitors: Bools
    path: Floats
    evidence: Floats


@inlined
def safety_step(batch: Batch, run: int, time: float) -> int:
    """Decide one run at one tick.

    Args:
        batch: What it reads and writes.
        run: Which row is meant.
        time: [s].

    Returns:
        OK, REQUESTS_AUTHORITY, or FAULT without a recent ego estimate: then it coasts with the
        steering held.
    """
    record, pose, memory = batch.records[run], batch.pose[run], batch.memory[run]
    shown = batch.monitors[run]
    knows_pose = perceive(batch, run, time)
    confirmed = run_monitors(record, batch.evidence, batch.states[run], shown)
    if not knows_pose:
        return coast(batch, run)
    update_stopping(memory, confirmed, batch.reason[run], pose[POSE_ACCELERATION])
    if memory[MEMORY_STOPPING] > 0.0:
        return stop_in_lane(batch, run, confirmed, shown[OBJECT_DANGER, 1])
    return shadow(batch, run, confirmed)


@inlined
def perceive(batch: Batch, run: int, time: float) -> bool:
    """Take the evidence of linked channels and scene; tell whether the ego knows where it is."""
    seen, path = batch.evidence, batch.path
    seen[:] = 0.0
    path[:] = 0.0
    gather_commands(time, batch.numbers[run], batch.channel_status[run], batch.heard[run], seen)
    pose = batch.pose[run]
    if not has_pose(pose, time):
        return False
    look(
        batch.records[run],
        batch.segments[run],
        pose,
        batch.tracks[run],
        int(batch.notes[run, NOTE_END]),
        batch.memory[run],
        path,
        seen,
    )
    return True


@inlined
def coast(batch: Batch, run: int) -> int:
    """Coast with the steering held, for want of anything better."""
    batch.command[run, 0] = 0.0
    return FAULT


@inlined
def answer(batch: Batch, run: int, acceleration: float, steering: float, requests: bool) -> int:  # noqa: FBT001 - a kernel
    """Give a command, unless it is no number.

    Args:
        batch: What is read and written.
        run: Which row is meant.
        acceleration: [m/s²].
        steering: [rad].
        requests: Whether authority is wanted.
    """
    if not is_number(acceleration, steering):
        return coast(batch, run)
    batch.command[run, 0], batch.command[run, 1] = acceleration, steering
    return REQUESTS_AUTHORITY if requests else OK


@inlined
def tell(batch: Batch, run: int, state: int) -> None:
    """Write the state of the channel; one without all of its sensors is degraded."""
    batch.status[run] = DEGRADED if state == OK and batch.degraded[run] else state


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
def stop_in_lane(batch: Batch, run: int, requests: bool, is_danger: bool) -> int:  # noqa: FBT001 - a kernel
    """Give the command of the in-lane stop.

    Args:
        batch: What is read and written.
        run: Which row is meant.
        requests: Whether authority is wanted.
        is_danger: Whether an object ahead is a confirmed danger.
    """
    record, pose, memory = batch.records[run], batch.pose[run], batch.memory[run]
    memory[MEMORY_BRAKING] = stop_acceleration(
        record, memory[MEMORY_BRAKING], pose[POSE_SPEED], batch.path[PATH_REQUIRED], is_danger
    )
    steering = steer(record, pose, memory[MEMORY_PATH])
    return answer(batch, run, float(memory[MEMORY_BRAKING]), steering, requests)


@inlined
def shadow(batch: Batch, run: int, requests: bool) -> int:  # noqa: FBT001 - a kernel
    """Give the command while no stop is driven: car following in the lane."""
    record, pose = batch.records[run], batch.pose[run]
    steering = steer(record, pose, batch.memory[run, MEMORY_PATH])
    return answer(batch, run, follow_lane(batch, run), steering, requests)


@inlined
def follow_lane(batch: Batch, run: int) -> float:
    """Return the acceleration of car following in the lane [m/s²]."""
    record, pose, path = batch.records[run], batch.pose[run], batch.path
    return follow(
        record,
        pose[POSE_SPEED],
        allowed_speed(record, batch.segments[run], pose, batch.memory[run, MEMORY_PATH]),
        path[PATH_GAP],
        path[PATH_SPEED],
        record["stop_deceleration"],
    )
