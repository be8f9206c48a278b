"""What a policy observes and what it answers: spaces, scales and the arrays of a batch.

Kinematics: the ego as its channel knows it, and the nearest confirmed tracks, nearest first. The
vehicle frame has x forward and y to the left. Nothing else is known: no ground truth, no ids.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.channels.driving import lane_at
from adeye.channels.perception import NOTE_END, Perception
from adeye.channels.pose import (
    POSE_ACCELERATION,
    POSE_ALIGN,
    POSE_CURVATURE,
    POSE_D,
    POSE_SPEED,
    POSE_YAW_RATE,
    has_pose,
)
from adeye.channels.tracks import (
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
    TRACKS,
)
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import lane_center, offset_curvature

if TYPE_CHECKING:
    from collections.abc import Mapping

    import gymnasium
    from numpy.typing import NDArray

    from adeye.ports import ChannelContext
    from adeye.signals import Bools, Floats, Observation
    from adeye.spec.architecture import Vehicle
    from adeye.spec.channels import PolicyParameters

EGO_FEATURES: Final = {
    "speed": 40.0,  # [m/s]
    "acceleration": 10.0,  # [m/s²]
    "yaw_rate": 1.0,  # [rad/s]
    "heading": 1.0,  # against the road [rad]
    "lane_offset": 5.0,  # from the centre of the nearest lane, to the left [m]
    "to_right_edge": 20.0,  # of the rightmost lane [m]
    "to_left_edge": 20.0,
    "curvature": 0.02,  # of the lane [1/m]
    "desired_speed": 40.0,  # [m/s]
}
"""Features of the ego, in this order, and what each is divided by to be normalised."""

OBJECT_FEATURES: Final = {
    "present": 1.0,  # 1 for an object, 0 for an empty row
    "x": 200.0,  # [m]
    "y": 50.0,
    "vx": 40.0,  # against the ego's velocity [m/s]
    "vy": 20.0,
    "length": 20.0,  # [m]
    "width": 5.0,
}
"""Features of an object, in this order, and what each is divided by to be normalised."""

EGO: Final = "ego"
OBJECTS: Final = "objects"
_EGO_SCALES: Final = np.array(list(EGO_FEATURES.values()))
_OBJECT_SCALES: Final = np.array(list(OBJECT_FEATURES.values()))


def observation_space(parameters: PolicyParameters) -> gymnasium.Space[Any]:
    """Return the space that observations are in.

    Args:
        parameters: Say whether it is flat and normalised, and how many objects there are.

    Returns:
        ``Dict(ego=Box(9,), objects=Box(nearest, 7))``; flat, the ego's features before those of
        the objects in one Box.
    """
    from gymnasium import spaces

    limit = 1.0 if parameters.normalised else np.inf
    rows = {EGO: (len(EGO_FEATURES),), OBJECTS: (parameters.nearest, len(OBJECT_FEATURES))}
    if parameters.observation == "kinematics_flat":
        size = sum(int(np.prod(shape)) for shape in rows.values())
        return spaces.Box(-limit, limit, (size,), np.float32)
    return spaces.Dict(
        {name: spaces.Box(-limit, limit, shape, np.float32) for name, shape in rows.items()}
    )


def action_space(parameters: PolicyParameters, vehicle: Vehicle) -> gymnasium.Space[Any]:
    """Return the space that actions are in: acceleration [m/s²] and steering angle [rad].

    Args:
        parameters: Say whether it is normalised: then each is from -1 to 1.
        vehicle: Its limits are those of the space.
    """
    from gymnasium import spaces

    low, high = action_limits(vehicle)
    if parameters.normalised:
        low, high = np.full(2, -1.0), np.ones(2)
    return spaces.Box(low.astype(np.float32), high.astype(np.float32), (2,), np.float32)


def action_limits(vehicle: Vehicle) -> tuple[Floats, Floats]:
    """Return the least and the largest action (2,) that the vehicle can follow [m/s²], [rad]."""
    high = np.array([vehicle.max_acceleration, vehicle.max_steering_angle])
    return np.array([-vehicle.max_deceleration, -vehicle.max_steering_angle]), high


def to_command(actions: Floats, low: Floats, high: Floats, *, normalised: bool) -> Floats:
    """Turn actions into accelerations and steering angles; what is outside is cut.

    Args:
        actions: (..., 2).
        low: Least action (..., 2) [m/s²], [rad].
        high: Largest action.
        normalised: Whether actions are from -1 to 1; 0 is neither braking nor steering.

    Returns:
        (..., 2) [m/s²], [rad]; NaN where an action is no finite number.
    """
    # Infinity would be cut to full throttle and pass for an answer.
    actions = np.where(np.isfinite(actions), actions, np.nan)
    if normalised:
        actions = np.where(actions < 0.0, -actions * low, actions * high)
    cut: Floats = np.clip(actions, low, high)
    return cut


class Kinematics:
    """Observes the kinematics of a batch, from what is linked to the channel.

    Attributes:
        is_known: (B,) whether there is a recent ego estimate.
        degraded: (B,) whether a linked sensor does not deliver.
        tracks: (B, K, 6) confirmed tracks, see ``signals.TRACK_COLUMNS``.
    """

    def __init__(self, context: ChannelContext, records: NDArray[np.void]) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Of the channel.
            records: (B,) parameters, vehicle and road, see ``driving.channel_records``.
        """
        runs = context.runs
        self._perception = Perception(context, records)
        self._ego = np.zeros((runs, len(EGO_FEATURES)))
        self._objects = np.zeros((runs, TRACKS, len(OBJECT_FEATURES)))
        self.is_known: Bools = np.zeros(runs, dtype=np.bool_)
        self.degraded: Bools = self._perception.degraded
        self.tracks: Floats = self._perception.shown

    def update(self, observation: Observation) -> None:
        """Take in the measurements of a tick."""
        seen = self._perception
        seen.update(observation)
        _describe(
            seen.records,
            observation.time,
            seen.running,
            seen.pose,
            seen.tracks,
            seen.notes,
            self.is_known,
            self._ego,
            self._objects,
        )

    def shown(self, runs: Any, parameters: PolicyParameters) -> Mapping[str, Any] | Any:
        """Return the observation of some runs, of ``observation_space``, B of them.

        Args:
            runs: Their numbers.
            parameters: Say how it is laid out.
        """
        ego, objects = self._ego[runs], self._objects[runs, : parameters.nearest]
        if parameters.normalised:
            ego = np.clip(ego / _EGO_SCALES, -1.0, 1.0)
            objects = np.clip(objects / _OBJECT_SCALES, -1.0, 1.0)
        ego, objects = ego.astype(np.float32), objects.astype(np.float32)
        if parameters.observation == "kinematics_flat":
            return np.concatenate([ego, objects.reshape(len(ego), -1)], axis=1)
        return {EGO: ego, OBJECTS: objects}


@compiled
def _describe(  # noqa: PLR0913, PLR0917 - a kernel
    records: Any,
    time: float,
    running: Bools,
    pose: Floats,
    tracks: Floats,
    notes: Floats,
    is_known: Bools,
    ego: Floats,
    objects: Floats,
) -> None:
    for run in range(records.shape[0]):
        if running[run]:
            record, end = records[run], int(notes[run, NOTE_END])
            is_known[run] = has_pose(pose[run], time)
            _describe_ego(record, pose[run], ego[run])
            _describe_objects(record, pose[run], tracks[run], end, objects[run])


@inlined
def _describe_ego(record: Any, pose: Floats, ego: Floats) -> None:
    """Write the features of the ego, in the order of ``EGO_FEATURES``."""
    d, width = pose[POSE_D], record["lane_width"]
    lane = lane_at(d, width, int(record["lanes"]))
    ego[0] = pose[POSE_SPEED]
    ego[1] = pose[POSE_ACCELERATION]
    ego[2] = pose[POSE_YAW_RATE]
    ego[3] = pose[POSE_ALIGN]
    ego[4] = d - lane_center(lane, width)
    ego[5] = d
    ego[6] = record["lanes"] * width - d
    ego[7] = offset_curvature(pose[POSE_CURVATURE], d)
    ego[8] = min(record["desired_speed"], record["speed_limit"])


@inlined
def _describe_objects(record: Any, pose: Floats, tracks: Floats, end: int, objects: Floats) -> None:
    """Write the features of the confirmed tracks, the nearest first; the other rows are 0."""
    objects[:] = 0.0
    count = 0
    for row in range(end):
        track = tracks[row]
        if track[TRACK_HITS] < record["confirm_hits"]:
            continue
        x, y = track[TRACK_X], track[TRACK_Y]
        place = count
        # Eight at most: each is put where it belongs among those before it.
        while place > 0 and _is_nearer(x, y, objects[place - 1]):
            for column in range(objects.shape[1]):
                objects[place, column] = objects[place - 1, column]
            place -= 1
        objects[place, 0] = 1.0
        objects[place, 1], objects[place, 2] = x, y
        objects[place, 3] = track[TRACK_VX] - pose[POSE_SPEED]
        objects[place, 4] = track[TRACK_VY]
        objects[place, 5], objects[place, 6] = track[TRACK_LENGTH], track[TRACK_WIDTH]
        count += 1


@inlined
def _is_nearer(x: float, y: float, row: Floats) -> bool:
    return bool(x * x + y * y < row[1] * row[1] + row[2] * row[2])
