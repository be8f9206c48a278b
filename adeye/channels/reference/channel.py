"""The built-in reference channel on the batch."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.channels.driving import (
    HOLD_DECELERATION,
    IDM_EXPONENT,
    STANDSTILL,
    allowed_speed,
    channel_records,
    is_number,
    path_of_lane,
    steer,
)
from adeye.channels.pose import (
    POSE_D,
    POSE_REAR,
    POSE_SPEED,
    POSE_WIDTH,
    clear_pose,
    has_pose,
    update_pose,
)
from adeye.channels.reference.scene import (
    THING_ACCELERATION,
    THING_FORWARD,
    THING_IS_NEW,
    THING_SIZE,
    THING_STATE,
    THINGS,
    VISIBLE,
    look_at,
    update_things,
)
from adeye.channels.sight import Sight
from adeye.kernel.control import idm_acceleration
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.reference_columns import (
    EGO_ACCELERATION,
    GAP,
    LATERAL_GAP,
    PARAMETER_SIZE,
    VIEW_SIZE,
)
from adeye.kernel.reference_distances import following_distance
from adeye.kernel.reference_drivers import reference_limit
from adeye.kernel.reference_parameters import MODELS, parameters_of, vector
from adeye.signals import FAULT, OK, Bools, ControlCommand, Floats, Ints, Observation, spec_columns

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.spec.reference import ReferenceParameters

# Columns of what the driver remembers beside the objects.
(
    MEMORY_PATH,  # lateral place of its lane's centre [m], NaN before it knows where it is
    MEMORY_SPEED,  # at the previous tick [m/s], NaN before
) = range(2)
MEMORY_WIDTH: Final = 2

_NUMBERS: Final = ("standstill_gap", "max_acceleration", "comfort_deceleration")

_BRAKES: Final = 0.5
"""Deceleration of a lead from which on it brakes, and the model alone answers [m/s²]."""

_LATE: Final = 1e-6
"""Age from which on a sample is not that of the tick [s]."""


class ReferenceChannel:
    """Keeps its lane and brakes as a reference driver of UN R157 does, on ground truth.

    It links one sensor of ground truth; without a sample of the tick its state is FAULT. Where the
    model asks for nothing it drives at the desired speed and follows at the model's distance.
    """

    monitor_ids: tuple[str, ...] = ()

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        fields = spec_columns(
            context.parameters,
            lambda item: {name: float(getattr(item, name)) for name in _NUMBERS},
        )
        self._channel_id = context.channel_id
        self._sight = Sight(context)
        self._records = channel_records(context, fields)
        self._segments: Floats = np.ascontiguousarray(context.road.segments)
        specs: list[ReferenceParameters] = list(context.parameters)
        self._models: Ints = np.array([MODELS[item.model] for item in specs], dtype=np.int64)
        self._parameters: Floats = np.zeros((runs, PARAMETER_SIZE))
        for run, item in enumerate(specs):
            found = parameters_of(item.model, item.edition, item.variant)
            self._parameters[run] = vector(found)
        self._pose: Floats = np.zeros((runs, POSE_WIDTH))
        self._pose[:, POSE_REAR] = [0.5 * vehicle.wheelbase for vehicle in context.vehicles]
        self._things: Floats = np.zeros((runs, THINGS, THING_SIZE))
        self._memory: Floats = np.full((runs, MEMORY_WIDTH), np.nan)
        self._command: Floats = np.zeros((runs, 2))
        self._status: Ints = np.full(runs, FAULT, dtype=np.int64)
        self._view: Floats = np.zeros(VIEW_SIZE)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation with one command per run."""
        sight = self._sight
        sight.take(observation.measurements, observation.time)
        _act(
            self._records,
            self._models,
            self._parameters,
            observation.time,
            observation.running.copy(),
            self._segments,
            sight.estimate,
            sight.estimate_stamp,
            sight.masks[0],
            sight.detections[0],
            self._pose,
            self._things,
            self._memory,
            self._command,
            self._status,
            self._view,
        )
        return ControlCommand(
            self._channel_id,
            self._command[:, 0].copy(),
            self._command[:, 1].copy(),
            np.full(self._status.shape, observation.time),
            self._status.copy(),
        )


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    records: Any,
    models: Ints,
    parameters: Floats,
    time: float,
    running: Bools,
    segments: Floats,
    estimate: Floats,
    stamp: Floats,
    masks: Bools,
    detections: Floats,
    pose: Floats,
    things: Floats,
    memory: Floats,
    command: Floats,
    status: Ints,
    view: Floats,
) -> None:
    for run in range(records.shape[0]):
        if not running[run]:
            continue
        record = records[run]
        # The filter of the pose takes noise out, and here is none.
        clear_pose(pose[run])
        if time - stamp[run] <= _LATE:
            update_pose(pose[run], segments[run], estimate[run], stamp[run], time, record["period"])
        status[run] = FAULT
        if not has_pose(pose[run], time):
            command[run, 0] = 0.0
            memory[run, MEMORY_SPEED] = math.nan
            continue
        if math.isnan(memory[run, MEMORY_PATH]):
            memory[run, MEMORY_PATH] = path_of_lane(record, pose[run, POSE_D])
        path_d = memory[run, MEMORY_PATH]
        update_things(
            things[run],
            pose[run],
            segments[run],
            path_d,
            masks[run],
            detections[run],
            record["period"],
        )
        acceleration = _longitudinal(
            record,
            models[run],
            parameters[run],
            segments[run],
            pose[run],
            things[run],
            memory[run],
            view,
        )
        steering = steer(record, pose[run], path_d)
        command[run, 0] = 0.0
        if is_number(acceleration, steering):
            command[run, 0] = acceleration
            command[run, 1] = steering
            status[run] = OK


@inlined
def _longitudinal(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    model: int,
    parameters: Floats,
    segments: Floats,
    pose: Floats,
    things: Floats,
    memory: Floats,
    view: Floats,
) -> float:
    """Return the acceleration of the driver [m/s²], NaN if something is no number."""
    speed, path_d = pose[POSE_SPEED], memory[MEMORY_PATH]
    before = memory[MEMORY_SPEED]
    memory[MEMORY_SPEED] = speed
    view[EGO_ACCELERATION] = 0.0 if math.isnan(before) else (speed - before) / record["period"]
    limit = math.inf
    lead, nearest = -1, math.inf
    for row in range(things.shape[0]):
        seen = look_at(record, things, row, pose, path_d, view)
        if seen != VISIBLE:
            for column in range(THING_STATE, THING_SIZE):
                # Who brakes for the vehicle ahead does not begin anew with what it reveals.
                things[row, column] = things[seen, column] if seen >= 0 else 0.0
            continue
        wanted = reference_limit(
            model, view, parameters, things[row, THING_STATE:], record["period"]
        )
        if math.isnan(wanted):
            return math.nan
        limit = min(limit, wanted)
        if view[LATERAL_GAP] <= 0.0 and 0.0 <= view[GAP] < nearest:
            lead, nearest = row, view[GAP]
    room = following_distance(model, parameters, speed) - record["standstill_gap"]
    wanted = idm_acceleration(
        speed,
        nearest,
        things[lead, THING_FORWARD] if lead >= 0 else 0.0,
        allowed_speed(record, segments, pose, path_d),
        max(room, 0.0) / max(speed, 1.0),
        record["standstill_gap"],
        record["max_acceleration"],
        record["comfort_deceleration"],
        IDM_EXPONENT,
        record["comfort_deceleration"],
    )
    if lead >= 0:
        is_new = things[lead, THING_IS_NEW] > 0.0
        # What is new in the path, and a lead that brakes, is the model's own business: a driver
        # who eased off meanwhile would be better than the model.
        if is_new or things[lead, THING_ACCELERATION] < -_BRAKES:
            wanted = 0.0
    wanted = min(wanted, limit)
    if speed < STANDSTILL and wanted <= 0.0:
        return -HOLD_DECELERATION
    return wanted
