"""The nominal channel: tracking, car following, lane keeping and emergency braking."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel import profiles
from adeye.kernel.criticality import required_deceleration
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import center_at, center_beside, ground_of, lane_left, lane_of, lane_width
from adeye.kernel.strips import LEAST_TO_DRIVE
from adeye.signals import DEGRADED, FAULT, OK, Floats, Ints
from adeye.simulate.channels import corridor, driving
from adeye.simulate.channels.hooks import PerceivingChannel
from adeye.simulate.channels.perception.pose import POSE_D, POSE_S, POSE_SPEED, has_pose
from adeye.simulate.channels.perception.tracks import BEHIND, TRACKS
from adeye.simulate.channels.trajectory.cost import SAMPLES, Others, is_cut_up, predict_objects
from adeye.spec.channels import NominalParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.simulate.channels.perception.step import Seen

# --- The nominal channel's decision at one tick: follow, keep the lane, or brake in an emergency --

# Columns of what the channel remembers beside pose and tracks.
(
    MEMORY_PATH,  # lateral place of its lane's centre [m], NaN before it knows where it is
    MEMORY_EMERGENCY,  # whether it brakes in an emergency
    MEMORY_ASIDE,  # how far to the left of that its line still is, on the way there [m]
    MEMORY_GAP,  # for how long there has been a gap in the lane to change to [s]
) = range(4)
MEMORY_WIDTH: Final = 4

LATERAL_SPEED: Final = 1.2
MOST_SLOPE: Final = 0.3
"""Of a lane change [m/s], and against the way that is driven. Our choice."""

GAP_TIME: Final = 1.0
"""For so long there must be a gap before it is taken [s]: by then everybody who is seen has a
track. Our choice."""
INTERVAL: Final = 0.25
"""Between two samples of what is predicted before a lane is entered [s]."""
FOLLOWER_DECELERATION: Final = 3.0
"""What a lane change may ask of who comes from behind [m/s²]: as the trajectory channel."""

RELEASE: Final = 0.3
"""Share of the emergency threshold below which the required deceleration ends an emergency. Our
choice: by then nine tenths of the closing speed that called for it are gone."""


@inlined
def nominal_step(  # noqa: PLR0913, PLR0917 - a kernel
    seen: Seen,
    run: int,
    time: float,
    memory: Floats,
    command: Floats,
    path: Floats,
    others: Others,
) -> int:
    """Decide one run at one tick.

    Args:
        seen: What the channel has perceived.
        run: Which row is meant.
        time: [s].
        memory: (MEMORY_WIDTH,) in and out.
        command: (2,) acceleration [m/s²] and steering angle [rad]; in and out.
        path: (PATH_WIDTH,) scratch.
        others: Scratch.

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
    speed = pose[POSE_SPEED]
    room = leave_lane(seen, run, memory, path, others)
    path_d = memory[MEMORY_PATH] + memory[MEMORY_ASIDE]
    corridor.view_path(seen, run, memory[MEMORY_PATH], path)
    hardest = hardest_braking(record)
    allowed = driving.allowed_speed(record, ground, pose, path_d)
    acceleration = driving.follow(
        record, ground, speed, allowed, path[corridor.PATH_GAP], path[corridor.PATH_SPEED], hardest
    )
    acceleration = driving.stand_before(record, speed, room, acceleration, hardest)
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


@compiled
def leave_lane(seen: Seen, run: int, memory: Floats, path: Floats, others: Others) -> float:
    """Change the lane where the ego's ends and there is a gap beside it.

    Args:
        seen: What the channel has perceived.
        run: Which row is meant.
        memory: (MEMORY_WIDTH,) in and out.
        path: (PATH_WIDTH,) scratch.
        others: Scratch.

    Returns:
        What is left of the lane that the ego has to stand in [m], infinity for none.
    """
    record, ground, pose = seen.records[run], ground_of(seen.grounds, run), seen.pose[run]
    s, d, speed, center = pose[POSE_S], pose[POSE_D], pose[POSE_SPEED], memory[MEMORY_PATH]
    rate = min(LATERAL_SPEED, MOST_SLOPE * speed)
    aside = max(0.0, abs(memory[MEMORY_ASIDE]) - rate * record["period"])
    memory[MEMORY_ASIDE] = math.copysign(aside, memory[MEMORY_ASIDE])
    way = driving.way_to_change(speed)
    if aside > 0.0:
        go_back(seen, run, memory, path, others)
        # Of the lane that is entered or gone back to: to leave the other there was room.
        return lane_left(ground, s, memory[MEMORY_PATH], driving.MOST_CHANGES * way)[0]
    room, changes = lane_left(ground, s, d, driving.MOST_CHANGES * way)
    if changes == 0 or room >= abs(changes) * way:
        return room
    target = center_beside(ground, s, center, math.copysign(1.0, changes))
    if lane_of(ground, s, target) < 0 or lane_width(ground, s, target) < LEAST_TO_DRIVE:
        return room
    takes = abs(target - center) * max(speed / LATERAL_SPEED, 1.0 / MOST_SLOPE)
    # Its steering is behind the line by its preview.
    behind = max(driving.LEAST_PREVIEW, driving.PREVIEW_TIME * speed)
    is_out = takes + behind + 0.5 * record["length"] <= room
    is_free = is_out and has_gap(seen, run, target, path, others)
    memory[MEMORY_GAP] = memory[MEMORY_GAP] + record["period"] if is_free else 0.0
    if memory[MEMORY_GAP] > GAP_TIME:
        memory[MEMORY_PATH], memory[MEMORY_ASIDE] = target, center - target
        memory[MEMORY_GAP] = 0.0
    return room


@inlined
def go_back(seen: Seen, run: int, memory: Floats, path: Floats, others: Others) -> None:
    """Go back to the lane that is being left if there is no gap beside it any more.

    Not once the ego's body is in the other lane, nor where it could not stand before the end of
    its own any more.

    Args:
        seen: What the channel has perceived.
        run: Which row is meant.
        memory: (MEMORY_WIDTH,) in and out.
        path: (PATH_WIDTH,) scratch.
        others: Scratch.
    """
    record, ground, pose = seen.records[run], ground_of(seen.grounds, run), seen.pose[run]
    s, d, speed, target = pose[POSE_S], pose[POSE_D], pose[POSE_SPEED], memory[MEMORY_PATH]
    if abs(target - d) <= 0.5 * (lane_width(ground, s, d) + record["width"]):
        return
    room = lane_left(ground, s, d, driving.MOST_CHANGES * driving.way_to_change(speed))[0]
    left = driving.room_to_stand(record, room)
    if required_deceleration(left, speed, 0.0, 0.0) > hardest_braking(record):
        return
    if not has_gap(seen, run, target, path, others):
        memory[MEMORY_PATH] = center_at(ground, s, d)
        memory[MEMORY_ASIDE] += target - memory[MEMORY_PATH]
        memory[MEMORY_GAP] = 0.0


@inlined
def has_gap(seen: Seen, run: int, target: float, path: Floats, others: Others) -> bool:
    """Tell whether a lane beside the ego has a gap for it, as the trajectory channel would.

    Args:
        seen: What the channel has perceived.
        run: Which row is meant.
        target: Centre of the lane [m].
        path: (PATH_WIDTH,) scratch.
        others: Scratch.
    """
    record, ground, pose = seen.records[run], ground_of(seen.grounds, run), seen.pose[run]
    corridor.view_path(seen, run, target, path)
    if (
        path[corridor.PATH_GAP] < record["standstill_gap"]
        or path[corridor.PATH_REQUIRED] >= record["comfort_deceleration"]
    ):
        return False
    known = predict_objects(seen, run, INTERVAL, others)
    for row in range(known.objects.shape[0]):
        body = known.objects[row]
        side = 0.5 * (record["width"] + body[profiles.OBJECT_WIDTH]) + record["lateral_margin"]
        # Who is beside the ego is neither ahead nor behind.
        is_beside = body[profiles.OBJECT_S] <= 0.0 and body[profiles.OBJECT_BEHIND] == 0.0
        if is_beside and abs(body[profiles.OBJECT_D] - target) <= side:
            return False
    place = pose[POSE_S], pose[POSE_D]
    return not is_cut_up(record, ground, place, target, True, pose[POSE_SPEED], known)  # noqa: FBT003 - a kernel


@inlined
def hardest_braking(record: Any) -> float:
    """Return the largest deceleration that is no emergency braking [m/s²]."""
    return float(min(record["emergency_threshold"], record["emergency_deceleration"]))


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
        fields["follower_deceleration"] = FOLLOWER_DECELERATION
        fields["behind"] = np.maximum(BEHIND, fields["rear_sight"])
        self._prepare(context, driving.channel_records(context, fields))
        self._memory = np.zeros((context.runs, MEMORY_WIDTH))
        self._memory[:, MEMORY_PATH] = np.nan
        self._path = np.zeros(corridor.PATH_WIDTH)
        self._others = Others(
            np.zeros((TRACKS, profiles.OBJECT_ROW)),
            np.zeros((TRACKS, SAMPLES, profiles.WAY_ROW)),
        )

    def _decide(self, time: float) -> None:
        memory, scratch = self._memory, self._path
        _act(self._seen, time, memory, self._command, self._status, scratch, self._others)


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    seen: Seen,
    time: float,
    memory: Floats,
    command: Floats,
    status: Ints,
    path: Floats,
    others: Others,
) -> None:
    for run in range(seen.records.shape[0]):
        if seen.running[run]:
            state = nominal_step(seen, run, time, memory[run], command[run], path, others)
            status[run] = DEGRADED if state == OK and seen.degraded[run] else state
