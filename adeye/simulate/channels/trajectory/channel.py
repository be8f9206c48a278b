"""The trajectory channel: prediction, a fan of candidates, scoring, and control along the best."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.kernel.elementary import tan
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import OBJECT_ROW, PATH_ROW, PATH_TARGET, PROFILE_ROW, WAY_ROW
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
from adeye.simulate.channels.driving import allowed_speed, channel_records, is_number
from adeye.simulate.channels.hooks import HOOKS, Hooks
from adeye.simulate.channels.perception.pose import POSE_D, POSE_SPEED, has_pose
from adeye.simulate.channels.perception.step import NOTE_END, Perception
from adeye.simulate.channels.perception.tracks import BEHIND, TRACKS
from adeye.simulate.channels.trajectory.candidates import (
    CANDIDATES,
    LEVEL_ROW,
    MEMORY_COMMAND,
    MEMORY_LANE,
    MEMORY_WANTED,
    MEMORY_WIDTH,
    PATHS,
    PROFILES,
)
from adeye.simulate.channels.trajectory.cost import LINE_ROW, SAMPLES, predict_objects
from adeye.simulate.channels.trajectory.planner import (
    PLAN_ROW,
    POINTS,
    accelerate,
    plan_step,
    show_candidates,
    show_plan,
    steer_along,
)
from adeye.spec.channels import TrajectoryParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.spec.architecture import Vehicle


class TrajectoryChannel:
    """Predicts what its linked sensors see, and drives the best of a fan of trajectories.

    It sees measurements only. Without a recent ego estimate its state is FAULT, with a linked
    sensor that does not deliver it is DEGRADED.
    """

    monitor_ids: tuple[str, ...] = ()
    hooks: tuple[str, ...] = HOOKS

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        self._channel_id = context.channel_id
        self._hooks = Hooks()
        numbers = spec_columns(context.parameters, _numbers)
        limits = spec_columns(context.vehicles, _limits)
        self._perception = Perception(context, channel_records(context, numbers | limits))
        self._memory = np.zeros((runs, MEMORY_WIDTH))
        self._memory[:, MEMORY_LANE] = np.nan
        self._driven = np.zeros((runs, PATH_ROW))
        self._driven[:, PATH_TARGET] = np.nan
        self._command = np.zeros((runs, 2))
        self._status = np.full(runs, FAULT, dtype=np.int64)
        self._plan = np.full((runs, SAMPLES, PLAN_ROW), np.nan)
        self._shows = context.shows_candidates
        fans = runs if self._shows else 0
        self._candidates = np.full((fans, CANDIDATES, POINTS, 2), np.nan)
        self._costs = np.full((fans, CANDIDATES), np.nan)
        self._chosen = np.full(fans, -1, dtype=np.int64)
        self._scratch = (
            np.zeros((TRACKS, OBJECT_ROW)),
            np.zeros((TRACKS, SAMPLES, WAY_ROW)),
            np.zeros((PATHS, PATH_ROW)),
            np.zeros((PROFILES + 1, SAMPLES, PROFILE_ROW)),
            np.zeros((PROFILES + 1, TRACKS, 2), dtype=np.int64),
            np.zeros((SAMPLES, LINE_ROW)),
            np.zeros((PROFILES + 1, LEVEL_ROW)),
            np.zeros(CANDIDATES),
        )

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
            self._driven,
            self._command,
            self._status,
            self._plan,
            self._shows,
            self._candidates,
            self._costs,
            self._chosen,
            self._scratch,
        )
        command = ControlCommand(
            self._channel_id,
            self._command[:, 0].copy(),
            self._command[:, 1].copy(),
            np.full(self._status.shape, observation.time),
            self._status.copy(),
            plan=self._plan.copy(),
            tracks=seen.shown.copy(),
            candidates=self._candidates.copy() if self._shows else None,
            candidate_costs=self._costs.copy() if self._shows else None,
            chosen=self._chosen.copy() if self._shows else None,
        )
        return self._hooks.answer(command)


def _numbers(item: TrajectoryParameters) -> dict[str, float]:
    """List what the compiled step reads of the channel's parameters."""
    numbers = {name: float(getattr(item, name)) for name in TrajectoryParameters.model_fields}
    return numbers | {"behind": max(BEHIND, item.rear_sight)}


def _limits(vehicle: Vehicle) -> dict[str, float]:
    """List what the compiled step reads of the vehicle beside what all channels do."""
    return {
        "max_curvature": tan(vehicle.max_steering_angle) / vehicle.wheelbase,
        "steering_lag": vehicle.steering_lag,
    }


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
    driven: Floats,
    command: Floats,
    status: Ints,
    plan: Floats,
    shows: bool,  # noqa: FBT001 - a kernel
    candidates: Floats,
    costs: Floats,
    chosen: Ints,
    scratch: tuple[Floats, Floats, Floats, Floats, Ints, Floats, Floats, Floats],
) -> None:
    for run in range(records.shape[0]):
        if not running[run]:
            continue
        best = trajectory_step(
            records[run],
            time,
            segments[run],
            int(notes[run, NOTE_END]),
            pose[run],
            tracks[run],
            memory[run],
            driven[run],
            command[run],
            plan[run],
            shows,
            scratch,
        )
        status[run] = FAULT if best < 0 else OK
        if best >= 0 and degraded[run]:
            status[run] = DEGRADED
        if shows:
            chosen[run] = best
            candidates[run] = np.nan
            costs[run] = np.nan
            if best >= 0:
                _, _, paths, profiles, _, _, _, fan = scratch
                show_candidates(pose[run], segments[run], paths, profiles, candidates[run])
                for place in range(CANDIDATES):
                    costs[run, place] = fan[place]


@inlined
def trajectory_step(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    time: float,
    segments: Floats,
    end: int,
    pose: Floats,
    tracks: Floats,
    memory: Floats,
    driven: Floats,
    command: Floats,
    plan: Floats,
    is_shown: bool,  # noqa: FBT001 - a kernel
    scratch: tuple[Floats, Floats, Floats, Floats, Ints, Floats, Floats, Floats],
) -> int:
    """Decide one run at one tick.

    Args:
        record: Parameters, vehicle and road.
        time: [s].
        segments: (R, 5) reference line of the road.
        end: Rows of tracks from here on are free places.
        pose: (POSE_WIDTH,).
        tracks: (K, TRACK_STATE).
        memory: (MEMORY_WIDTH,) in and out.
        driven: (PATH_ROW,) path that is being driven, in and out.
        command: (2,) acceleration [m/s²] and steering angle [rad]; in and out.
        plan: (SAMPLES, PLAN_ROW) out.
        is_shown: Whether somebody looks at the fan.
        scratch: Objects, their ways, paths, profiles, windows, line, levels, costs.

    Returns:
        The best candidate of the fan; -1 without a recent ego estimate: then it coasts with the
        steering held.
    """
    objects, ways, paths, profiles, windows, line, levels, costs = scratch
    if not has_pose(pose, time):
        command[0] = memory[MEMORY_WANTED] = memory[MEMORY_COMMAND] = 0.0
        memory[MEMORY_LANE] = plan[:] = np.nan
        return -1
    count = predict_objects(
        tracks,
        end,
        pose,
        segments,
        record["length"],
        record["lane_width"],
        int(record["lanes"]),
        record["confirm_hits"],
        record["horizon"] / SAMPLES,
        objects,
        ways,
    )
    allowed = allowed_speed(record, segments, pose, pose[POSE_D])
    best = plan_step(
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
    acceleration = accelerate(record, pose[POSE_SPEED], command[0], memory[MEMORY_WANTED])
    steering = steer_along(record, pose, driven)
    if not is_number(acceleration, steering):
        command[0] = memory[MEMORY_WANTED] = memory[MEMORY_COMMAND] = 0.0
        memory[MEMORY_LANE] = plan[:] = np.nan
        return -1
    command[0], command[1] = acceleration, steering
    memory[MEMORY_COMMAND] = acceleration
    show_plan(pose, segments, profiles[PROFILES], line, plan)
    return best
