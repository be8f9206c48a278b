"""The trajectory channel: prediction, a fan of candidates, scoring, and control along the best."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from adeye.kernel.elementary import tan
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import OBJECT_ROW, PATH_ROW, PATH_TARGET, PROFILE_ROW, WAY_ROW
from adeye.signals import DEGRADED, FAULT, OK, ControlCommand, Floats, Ints, spec_columns
from adeye.simulate.channels.driving import allowed_speed, channel_records, is_number
from adeye.simulate.channels.hooks import PerceivingChannel, Shown
from adeye.simulate.channels.perception.pose import POSE_D, POSE_SPEED, has_pose
from adeye.simulate.channels.perception.tracks import BEHIND, TRACKS
from adeye.simulate.channels.trajectory.cost import LINE_ROW, SAMPLES, Others, predict_objects
from adeye.simulate.channels.trajectory.planner import (
    CANDIDATES,
    LEVEL_ROW,
    MEMORY_COMMAND,
    MEMORY_LANE,
    MEMORY_WANTED,
    MEMORY_WIDTH,
    PATHS,
    PLAN_ROW,
    PROFILES,
    Fan,
    accelerate,
    plan_step,
    show_candidates,
    show_plan,
    steer_along,
)
from adeye.spec.channels import TrajectoryParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.simulate.channels.perception.step import Seen
    from adeye.spec.architecture import Vehicle


class TrajectoryChannel(PerceivingChannel):
    """Predicts what its linked sensors see, and drives the best of a fan of trajectories.

    It sees measurements only. Without a recent ego estimate its state is FAULT, with a linked
    sensor that does not deliver it is DEGRADED.
    """

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        numbers = spec_columns(context.parameters, _numbers)
        limits = spec_columns(context.vehicles, _limits)
        records = channel_records(context, numbers | limits)
        self._prepare(context, records, CANDIDATES)
        self._plans = Plans(
            memory=np.zeros((runs, MEMORY_WIDTH)),
            driven=np.zeros((runs, PATH_ROW)),
            plan=np.full((runs, SAMPLES, PLAN_ROW), np.nan),
            others=Others(np.zeros((TRACKS, OBJECT_ROW)), np.zeros((TRACKS, SAMPLES, WAY_ROW))),
            paths=np.zeros((PATHS, PATH_ROW)),
            profiles=np.zeros((PROFILES + 1, SAMPLES, PROFILE_ROW)),
            windows=np.zeros((PROFILES + 1, TRACKS, 2), dtype=np.int64),
            line=np.zeros((SAMPLES, LINE_ROW)),
            levels=np.zeros((PROFILES + 1, LEVEL_ROW)),
            costs=np.zeros(CANDIDATES),
        )
        self._plans.memory[:, MEMORY_LANE] = np.nan
        self._plans.driven[:, PATH_TARGET] = np.nan

    def _decide(self, time: float) -> None:
        _act(self._seen, self._plans, time, self._command, self._status, self._shown)

    def _command_at(self, time: float) -> ControlCommand:
        return replace(super()._command_at(time), plan=self._plans.plan.copy())


class Plans(NamedTuple):
    """What the channel keeps of each run, and scratch for one.

    Attributes:
        memory: (B, MEMORY_WIDTH).
        driven: (B, PATH_ROW) path that is being driven.
        plan: (B, SAMPLES, PLAN_ROW) what is shown of the choice.
        others: Room for the predicted objects; scratch, as all that follows, see ``planner.Fan``.
        paths: (PATHS, PATH_ROW).
        profiles: (PROFILES + 1, SAMPLES, PROFILE_ROW).
        windows: (PROFILES + 1, K, 2).
        line: (SAMPLES, LINE_ROW).
        levels: (PROFILES + 1, LEVEL_ROW).
        costs: (CANDIDATES,).
    """

    memory: Floats
    driven: Floats
    plan: Floats
    others: Others
    paths: Floats
    profiles: Floats
    windows: Ints
    line: Floats
    levels: Floats
    costs: Floats


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
def _act(
    seen: Seen, plans: Plans, time: float, command: Floats, status: Ints, shown: Shown
) -> None:
    shows = shown.chosen.shape[0] > 0
    for run in range(seen.records.shape[0]):
        if not seen.running[run]:
            continue
        best = trajectory_step(seen, plans, run, time, command[run], shows)
        status[run] = FAULT if best < 0 else OK
        if best >= 0 and seen.degraded[run]:
            status[run] = DEGRADED
        if shows:
            shown.chosen[run] = best
            shown.candidates[run] = np.nan
            shown.costs[run] = np.nan
            if best >= 0:
                show_candidates(
                    seen.pose[run],
                    seen.segments[run],
                    plans.paths,
                    plans.profiles,
                    shown.candidates[run],
                )
                for place in range(CANDIDATES):
                    shown.costs[run, place] = plans.costs[place]


@inlined
def trajectory_step(
    seen: Seen,
    plans: Plans,
    run: int,
    time: float,
    command: Floats,
    is_shown: bool,  # noqa: FBT001 - a kernel
) -> int:
    """Decide one run at one tick.

    Args:
        seen: What the channel has perceived.
        plans: What it keeps; in and out.
        run: Which row is meant.
        time: [s].
        command: (2,) acceleration [m/s²] and steering angle [rad]; in and out.
        is_shown: Whether somebody looks at the fan.

    Returns:
        The best candidate of the fan; -1 without a recent ego estimate: then it coasts with the
        steering held.
    """
    record, segments, pose = seen.records[run], seen.segments[run], seen.pose[run]
    memory, driven, plan = plans.memory[run], plans.driven[run], plans.plan[run]
    if not has_pose(pose, time):
        command[0] = memory[MEMORY_WANTED] = memory[MEMORY_COMMAND] = 0.0
        memory[MEMORY_LANE] = plan[:] = np.nan
        return -1
    others = predict_objects(seen, run, record["horizon"] / SAMPLES, plans.others)
    allowed = allowed_speed(record, segments, pose, pose[POSE_D])
    fan = Fan(
        record,
        pose,
        allowed,
        others,
        memory,
        driven,
        plans.paths,
        plans.profiles,
        plans.windows,
        plans.line,
        plans.levels,
        plans.costs,
    )
    best = plan_step(fan, is_shown)
    acceleration = accelerate(record, pose[POSE_SPEED], command[0], memory[MEMORY_WANTED])
    steering = steer_along(record, pose, driven)
    if not is_number(acceleration, steering):
        command[0] = memory[MEMORY_WANTED] = memory[MEMORY_COMMAND] = 0.0
        memory[MEMORY_LANE] = plan[:] = np.nan
        return -1
    command[0], command[1] = acceleration, steering
    memory[MEMORY_COMMAND] = acceleration
    show_plan(pose, segments, plans.profiles[PROFILES], plans.line, plan)
    return best
