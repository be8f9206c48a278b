"""Any ``policy(observation) -> action`` as a channel on the batch.

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
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.channels.driving import channel_records
from adeye.channels.failures import ERROR, INVALID_OUTPUT, Failures, describe
from adeye.channels.links import no_command
from adeye.channels.policy.observation import Kinematics, action_limits, to_command
from adeye.errors import SpecError
from adeye.registry import Part, load_part
from adeye.signals import DEGRADED, FAULT, OK, ControlCommand, Floats, Observation, spec_columns
from adeye.spec.channels import TrackingParameters
from adeye.supervision import guest, is_asked

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.ports import ChannelContext
    from adeye.spec.channels import PolicyParameters
    from adeye.trace import ChannelEvent

_PERCEPTION = tuple(TrackingParameters.model_fields)


def load_policy(name: str, base_dir: Path) -> Part:
    """Load a policy and check that it can be asked.

    Args:
        name: ``./file.py:name`` or ``module:name``.
        base_dir: Folder of the file that names it.

    Raises:
        SpecError: There is no such thing, or it is no policy.
    """
    part = load_part(name, base_dir, is_nameable=_is_policy)
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
        fields = spec_columns(
            context.parameters,
            lambda item: {name: float(getattr(item, name)) for name in _PERCEPTION},
        )
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
                one = _row(shown, place)
                try:
                    actions[place] = _actions(asked.policy(one, [run]), (2,))
                except BaseException as error:
                    if is_asked(error):
                        raise
                    self._fail(int(run), time, error)
        commands = to_command(
            actions, self._low[runs], self._high[runs], normalised=asked.parameters.normalised
        )
        command.acceleration[runs], command.steering_angle[runs] = commands.T
        for run in runs:
            command.status[run] = DEGRADED if self._seen.degraded[run] else OK

    def _fail(self, run: int, time: float, error: BaseException) -> None:
        runs = np.zeros(self._failures.silent.shape[0], dtype=np.bool_)
        runs[run] = True
        outcome = INVALID_OUTPUT if isinstance(error, _WrongAnswerError) else ERROR
        detail = str(error) if outcome == INVALID_OUTPUT else describe(error)
        self._failures.add(runs, outcome, time, detail)


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
    if actions.shape != shape:
        msg = f"the policy returned an action of shape {actions.shape}, not {shape}"
        raise _WrongAnswerError(msg)
    return actions


def _row(shown: Any, place: int) -> Any:
    """Copy the observation of one run out of those of several: a view would lead to the others."""
    if isinstance(shown, dict):
        return {name: values[place].copy() for name, values in shown.items()}
    return shown[place].copy()
