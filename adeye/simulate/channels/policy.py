"""The policy channel: any ``policy(observation) -> action`` as a channel.

Kinematics: the ego as its channel knows it, and the nearest confirmed tracks, nearest first. The
vehicle frame has x forward and y to the left. Nothing else is known: no ground truth, no ids.

    def policy(observation):  # {"ego": (9,), "objects": (nearest, 7)}
        return acceleration, steering_angle

A policy is a function, an object that can be called, or an object with ``predict(observation)``
that returns the action and its next state; of a class, one object is made for each batch. It is
asked for each run, with the state that it returned last if ``predict`` has an argument ``state``.
If it says ``batched = True`` it is asked once a tick for all runs, with (B, ...) arrays and no
state; each action must then be the same, bit for bit, whatever runs stand beside it. What a policy
remembers otherwise would reach from run to run.
"""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.errors import SpecError
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import Ground, center_at, ground_of, left_edge, limit_at, offset_curvature
from adeye.plugins import Part, load_part
from adeye.signals import DEGRADED, FAULT, OK, ControlCommand, Floats, Observation
from adeye.simulate.channels.driving import channel_records, parameter_columns
from adeye.simulate.channels.guard import ERROR, INVALID_OUTPUT, Failures, describe
from adeye.simulate.channels.links import no_command
from adeye.simulate.channels.perception import tracks as columns
from adeye.simulate.channels.perception.pose import (
    POSE_ACCELERATION,
    POSE_ALIGN,
    POSE_CURVATURE,
    POSE_D,
    POSE_S,
    POSE_SPEED,
    POSE_YAW_RATE,
    has_pose,
)
from adeye.simulate.channels.perception.step import NOTE_END, Perception
from adeye.simulate.channels.perception.tracks import TRACKS
from adeye.spec.channels import TrackingParameters
from adeye.supervision import guest, is_asked, raised

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from adeye.ports import ChannelContext
    from adeye.signals import Bools
    from adeye.simulate.channels.perception.step import Seen
    from adeye.spec.architecture import Vehicle
    from adeye.spec.channels import PolicyParameters
    from adeye.trace import ChannelEvent

# --- What a policy observes and what it answers: scales and the arrays of a batch ---------

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
        seen: What the channel knows, see ``perception.step``.
        ego: (B, 9) features of the ego, in SI.
        objects: (B, K, 7) of the objects, the nearest first.
    """

    def __init__(self, context: ChannelContext, records: NDArray[np.void]) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Of the channel.
            records: (B,) parameters and vehicle, see ``driving.channel_records``.
        """
        runs = context.runs
        self._perception = Perception(context, records)
        self.seen: Seen = self._perception.seen
        self.ego: Floats = np.zeros((runs, len(EGO_FEATURES)))
        self.objects: Floats = np.zeros((runs, TRACKS, len(OBJECT_FEATURES)))
        self.is_known: Bools = np.zeros(runs, dtype=np.bool_)
        self.degraded: Bools = self.seen.degraded
        self.tracks: Floats = self.seen.shown

    def update(self, observation: Observation) -> None:
        """Take in the measurements of a tick."""
        self._perception.update(observation)
        _describe(self.seen, observation.time, self.is_known, self.ego, self.objects)

    def shown(self, runs: Any, parameters: PolicyParameters) -> Mapping[str, Any] | Any:
        """Return the observation of some runs: flat, or the ego and the objects by name.

        Args:
            runs: Their numbers.
            parameters: Say how it is laid out.
        """
        ego, objects = self.ego[runs], self.objects[runs, : parameters.nearest]
        if parameters.normalised:
            ego = np.clip(ego / _EGO_SCALES, -1.0, 1.0)
            objects = np.clip(objects / _OBJECT_SCALES, -1.0, 1.0)
        ego, objects = ego.astype(np.float32), objects.astype(np.float32)
        if parameters.observation == "kinematics_flat":
            return np.concatenate([ego, objects.reshape(len(ego), -1)], axis=1)
        return {EGO: ego, OBJECTS: objects}


@compiled
def _describe(seen: Seen, time: float, is_known: Bools, ego: Floats, objects: Floats) -> None:
    for run in range(seen.records.shape[0]):
        if seen.running[run]:
            record, end = seen.records[run], int(seen.notes[run, NOTE_END])
            is_known[run] = has_pose(seen.pose[run], time)
            _describe_ego(record, ground_of(seen.grounds, run), seen.pose[run], ego[run])
            _describe_objects(record, seen.pose[run], seen.tracks[run], end, objects[run])


@inlined
def _describe_ego(record: Any, ground: Ground, pose: Floats, ego: Floats) -> None:
    """Write the features of the ego, in the order of ``EGO_FEATURES``."""
    s, d = pose[POSE_S], pose[POSE_D]
    ego[0] = pose[POSE_SPEED]
    ego[1] = pose[POSE_ACCELERATION]
    ego[2] = pose[POSE_YAW_RATE]
    ego[3] = pose[POSE_ALIGN]
    ego[4] = d - center_at(ground, s, d)
    ego[5] = d
    ego[6] = left_edge(ground, s) - d
    ego[7] = offset_curvature(pose[POSE_CURVATURE], d)
    ego[8] = min(record["desired_speed"], limit_at(ground, s, d))


@inlined
def _describe_objects(record: Any, pose: Floats, tracks: Floats, end: int, objects: Floats) -> None:
    """Write the features of the confirmed tracks, the nearest first; the other rows are 0."""
    objects[:] = 0.0
    count = 0
    for row in range(end):
        track = tracks[row]
        if track[columns.TRACK_HITS] < record["confirm_hits"]:
            continue
        x, y = track[columns.TRACK_X], track[columns.TRACK_Y]
        place = count
        # Eight at most: each is put where it belongs among those before it.
        while place > 0 and _is_nearer(x, y, objects[place - 1]):
            for column in range(objects.shape[1]):
                objects[place, column] = objects[place - 1, column]
            place -= 1
        objects[place, 0] = 1.0
        objects[place, 1], objects[place, 2] = x, y
        objects[place, 3] = track[columns.TRACK_VX] - pose[POSE_SPEED]
        objects[place, 4] = track[columns.TRACK_VY]
        objects[place, 5], objects[place, 6] = (
            track[columns.TRACK_LENGTH],
            track[columns.TRACK_WIDTH],
        )
        count += 1


@inlined
def _is_nearer(x: float, y: float, row: Floats) -> bool:
    return bool(x * x + y * y < row[1] * row[1] + row[2] * row[2])


# --- Any ``policy(observation) -> action`` as a channel on the batch ------------------------------


def load_policy(name: str, base_dir: Path) -> Part:
    """Load a policy and check that it can be asked.

    Args:
        name: ``./file.py:name`` or ``module:name``.
        base_dir: Folder of the file that names it.

    Raises:
        SpecError: There is no such thing, or it is no policy.
    """
    part = load_part(name, base_dir, is_nameable=_is_policy)
    with guest(part.name, "policy"):
        if _is_policy(part.obj):
            return part
    raise SpecError(
        f"{part.name} is no policy",
        remedy="Name a function of the observation, or something with predict().",
    )


def _is_policy(thing: Any) -> bool:
    """Tell whether something can be asked, or makes objects that can."""
    if inspect.ismodule(thing):
        return False
    has_predict = callable(getattr(thing, "predict", None))
    is_asked = "__call__" in dir(thing) if inspect.isclass(thing) else callable(thing)
    return has_predict or is_asked


class PolicyChannel:
    """Asks a policy what to do about what its linked sensors see.

    Without a recent ego estimate its state is FAULT and the policy is not asked; with a linked
    sensor that does not deliver it is DEGRADED. What the policy raises or answers is the failure
    of this channel, in that run; of a batched policy an exception is one in all of them.
    """

    monitor_ids: tuple[str, ...] = ()

    def __init__(self, base_dir: Path) -> None:
        """Remember where policies are looked for.

        Args:
            base_dir: Folder of the file that names them.
        """
        self._base_dir = base_dir
        self._failures = Failures("", 0)

    @property
    def events(self) -> list[ChannelEvent | None]:
        """First failure of the channel in each run, or None."""
        return self._failures.events

    def reset(self, context: ChannelContext) -> None:
        """Load the policy and prepare for the runs of a batch."""
        runs = context.runs
        self._failures = Failures(context.channel_id, runs)
        self._previous = no_command(context.channel_id, runs)
        fields = parameter_columns(context, TrackingParameters.model_fields)
        self._seen = Kinematics(context, channel_records(context, fields))
        self._asked: list[_Asked] = []
        for parameters in dict.fromkeys(context.parameters):
            members = [item == parameters for item in context.parameters]
            policy = _Policy(load_policy(parameters.policy, self._base_dir))
            self._asked.append(_Asked(parameters, np.flatnonzero(members), policy))
        limits = [action_limits(vehicle) for vehicle in context.vehicles]
        self._low = np.array([low for low, _ in limits])
        self._high = np.array([high for _, high in limits])

    def act(self, observation: Observation) -> ControlCommand:
        """Ask the policy in every run that has not ended."""
        self._seen.update(observation)
        command = self._previous.copy()
        command.tracks = self._seen.tracks.copy()
        is_open = observation.running & ~self._failures.silent
        command.stamp[is_open] = observation.time
        command.status[is_open] = FAULT
        command.acceleration[is_open] = 0.0
        for asked in self._asked:
            runs = asked.runs[(is_open & self._seen.is_known)[asked.runs]]
            if len(runs):
                self._ask(asked, runs, observation.time, command)
        self._previous = self._failures.hold(command, self._previous)
        return self._previous

    def _ask(self, asked: _Asked, runs: Any, time: float, command: ControlCommand) -> None:
        """Ask for the actions of some runs and write them into the command."""
        shown = self._seen.shown(runs, asked.parameters)
        if asked.policy.is_batched:
            # What it raises is contained by the guard around this channel.
            actions = _actions(asked.policy(shown, runs), (len(runs), 2))
        else:
            actions = np.full((len(runs), 2), np.nan)
            for place, run in enumerate(runs):
                one = row_of(shown, place)
                try:
                    actions[place] = _actions(asked.policy(one, [run]), (2,))
                except BaseException as error:
                    if is_asked(error):
                        raise
                    raised(error)
                    self._fail(int(run), time, error)
        commands = to_command(
            actions, self._low[runs], self._high[runs], normalised=asked.parameters.normalised
        )
        command.acceleration[runs], command.steering_angle[runs] = commands.T
        for run in runs:
            command.status[run] = DEGRADED if self._seen.degraded[run] else OK

    def _fail(self, run: int, time: float, error: BaseException) -> None:
        outcome = INVALID_OUTPUT if isinstance(error, _WrongAnswerError) else ERROR
        detail = str(error) if outcome == INVALID_OUTPUT else describe(error)
        self._failures.add(run, outcome, time, detail)


class _WrongAnswerError(ValueError):
    """The policy answered with something that is no action."""


class _Asked:
    """Runs whose policy is asked in one way."""

    def __init__(self, parameters: PolicyParameters, runs: Any, policy: _Policy) -> None:
        self.parameters = parameters
        self.runs = runs
        self.policy = policy


class _Policy:
    """A policy with the states that it has returned, one for each run."""

    def __init__(self, part: Part) -> None:
        self._name = part.name
        policy = part.build() if inspect.isclass(part.obj) else part.obj
        self.is_batched = getattr(policy, "batched", False) is True
        self._predicts = callable(getattr(policy, "predict", None))
        self._ask = policy.predict if self._predicts else policy
        known = _parameters(self._ask) if self._predicts else ()
        self._options: dict[str, Any] = {"deterministic": True} if "deterministic" in known else {}
        self._has_state = "state" in known and not self.is_batched
        self._states: dict[int, Any] = {}

    def __call__(self, observation: Any, runs: Any) -> Any:
        """Return what the policy answers for some runs."""
        with guest(self._name):
            return self._answer(observation, runs)

    def _answer(self, observation: Any, runs: Any) -> Any:
        if not self._predicts:
            return self._ask(observation)
        options = self._options.copy()
        if self._has_state:
            options["state"] = self._states.get(int(runs[0]))
        answer = self._ask(observation, **options)
        if not isinstance(answer, tuple) or len(answer) != 2:
            msg = f"predict() returned {type(answer).__name__}, not (action, state)"
            raise _WrongAnswerError(msg)
        if self._has_state:
            self._states[int(runs[0])] = answer[1]
        return answer[0]


def _parameters(method: Any) -> tuple[str, ...]:
    try:
        return tuple(inspect.signature(method).parameters)
    except (TypeError, ValueError):
        return ()


def _actions(answer: Any, shape: tuple[int, ...]) -> Floats:
    """Read an answer as actions; whether they are finite is for the guard to see."""
    try:
        actions: Floats = np.asarray(answer, dtype=np.float64)
    except (TypeError, ValueError) as error:
        msg = f"the policy returned {type(answer).__name__}, not numbers"
        raise _WrongAnswerError(msg) from error
    if np.ma.is_masked(answer):
        msg = "the policy returned masked numbers"
        raise _WrongAnswerError(msg)
    if actions.shape != shape:
        msg = f"the policy returned an action of shape {actions.shape}, not {shape}"
        raise _WrongAnswerError(msg)
    return actions


def row_of(shown: Any, place: int) -> Any:
    """Copy the observation of one run out of those of several: a view would lead to the others."""
    if isinstance(shown, dict):
        return {name: values[place].copy() for name, values in shown.items()}
    return shown[place].copy()
