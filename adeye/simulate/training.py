"""What a policy channel observes as a Gymnasium environment: train there what drives here.

The sensors that are linked to the channel look at the traffic, and the agent observes what the
channel makes of that; its action becomes a command as the channel's, at its rate and with its
delay. Nobody else drives: there is neither a switch nor another channel.

>>> import gymnasium
>>> "adeye/Policy-v0" in gymnasium.registry
True
"""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import gymnasium
import numpy as np
from gymnasium import spaces

from adeye.errors import UsageError
from adeye.simulate.channels.driving import channel_records, parameter_columns
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.policy import (
    EGO,
    EGO_FEATURES,
    OBJECT_FEATURES,
    OBJECTS,
    Kinematics,
    action_limits,
    row_of,
    to_command,
)
from adeye.simulate.channels.rack import ChannelRack, Contexts
from adeye.simulate.mirror import as_driven
from adeye.simulate.sensors.rig import Rig
from adeye.simulate.traffic import make_traffic
from adeye.simulate.traffic.env import draw_case, require_seed, rewards
from adeye.simulate.world.clock import require_step, ticks
from adeye.spec.architecture import Architecture
from adeye.spec.channels import PolicyChannel, TrackingParameters
from adeye.spec.load import load_architecture, load_scenario
from adeye.spec.scenario import LogicalScenario

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.signals import Floats, Measurement, Scene
    from adeye.simulate.traffic import Traffic
    from adeye.spec.channels import PolicyParameters

ENV_ID: Final = "adeye/Policy-v0"


class PolicyEnv(gymnasium.Env[Any, Any]):
    """One run of a scenario as a policy channel of an architecture sees and drives it.

    - Observation and action: those of the channel, see ``channels.policy``.
    - A step lasts from a tick of the channel to its next.
    - Reward: way along the road [m], plus ``CONTACT_REWARD`` when the ego touches something.
    - Terminated: contact, or the goal and its tail. Truncated: horizon and tail, or the road ends.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as its base class declares it
    render_mode: None = None

    def __init__(
        self,
        *,
        scenario: LogicalScenario | str | Path,
        architecture: Architecture | str | Path,
        step: float = 0.05,
        backend: str = "batch",
    ) -> None:
        """Prepare.

        Args:
            scenario: The scenario, or its file.
            architecture: Has one channel of kind ``policy``, whose policy itself is not asked; a
                record or a file.
            step: Master clock [s].
            backend: Name of the traffic implementation.

        Raises:
            InputError: A file or a value in it cannot be used.
        """
        require_step(step)
        self._folder = Path()
        if not isinstance(architecture, Architecture):
            self._folder, architecture = (
                Path(architecture).parent,
                load_architecture(architecture).spec,
            )
        if not isinstance(scenario, LogicalScenario):
            scenario = load_scenario(scenario).spec
        found = {
            name: spec
            for name, spec in architecture.channels.items()
            if isinstance(spec, PolicyChannel)
        }
        if len(found) != 1:
            raise UsageError(
                f"{architecture.architecture} has {len(found)} channels of kind policy, not one",
                remedy="Give its nominal channel kind: policy.",
            )
        self._scenario, self._architecture = scenario, architecture
        ((self._channel, self._spec),) = found.items()
        self._step, self._backend = step, backend
        self._parameters: PolicyParameters = self._spec.parameters
        self._delay = ticks(self._spec.delay, step, f"channels.{self._channel}.delay")
        self._seed = self._episode = 0
        low, high = action_limits(architecture.vehicle)
        self._low, self._high = low, high
        if self._parameters.normalised:
            low, high = -np.ones(2), np.ones(2)
        self.action_space = spaces.Box(low.astype(np.float32), high.astype(np.float32))
        self.observation_space = _observed(self._parameters)
        self._traffic: Traffic | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin a run, and let the ego coast until its channel knows where it is.

        Args:
            seed: Starts the draws from the scenario's ranges; without it they go on.
            options: There are none.

        Returns:
            The observation, and the scenario's parameters.

        Raises:
            UsageError: An option is given, or the seed is no whole number from 0.
            SpecError: No draw satisfies the scenario's constraints.
        """
        if options:
            raise UsageError(f"reset has no option {min(options)!r}", remedy="Leave it away.")
        require_seed(seed)
        super().reset(seed=seed)
        if seed is not None:
            self._seed, self._episode = seed, 0
        drawn = draw_case(self._scenario, self._architecture, self._step, self._seed, self._episode)
        self._episode += 1
        cases = as_driven([drawn])
        self.close()
        self._traffic = traffic = make_traffic(self._backend)
        traffic.base_dir = self._folder
        context, scene = traffic.reset(cases)
        self._scene: Scene = scene
        told = Contexts(cases, context).of(self._channel)
        self._every = round(told.period / self._step)
        records = channel_records(told, parameter_columns(told, TrackingParameters.model_fields))
        self._seen = Kinematics(told, records)
        self._rig = Rig(cases, context, self._folder)
        self._rack = ChannelRack(cases, context, self._folder, only=())
        self._waiting: deque[tuple[int, Floats]] = deque()
        self._acting = np.zeros((1, 2))
        self._look(self._rig.sense(self._scene))
        while not self._seen.is_known[0] and self._scene.running[0]:
            self._advance()
        return self._shown(), {"parameters": dict(drawn.parameters)}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Drive up to the next tick of the channel.

        Args:
            action: (2,) of acceleration and steering angle.

        Raises:
            UsageError: The run was not reset, or the action is not finite.
        """
        if self._traffic is None:
            raise UsageError("the environment was not reset", remedy="Call reset() first.")
        command = to_command(
            np.asarray(action, dtype=np.float64)[np.newaxis],
            self._low,
            self._high,
            normalised=self._parameters.normalised,
        )
        if not np.isfinite(command).all():
            raise UsageError("the action is not finite", remedy="Give two numbers.")
        if not self._seen.is_known[0]:
            # The channel would say fault, and nobody would act.
            command = np.array([[0.0, self._acting[0, 1]]])
        self._waiting.append((self._scene.tick + self._delay, command))
        reward = self._advance()
        ending = self._traffic.ending
        ended, touched = not self._scene.running[0], bool(self._scene.contact[0] >= 0)
        terminated = ended and (touched or bool(ending.arrived[0]))
        info = {"impact_speed": float(self._scene.impact_speed[0])}
        return self._shown(), reward, terminated, ended and not terminated, info

    def close(self) -> None:
        """End what moves vehicles outside of this process."""
        if self._traffic is not None:
            self._traffic.close()
            self._traffic = None

    def _advance(self) -> float:
        """Drive to the channel's next tick, and return the reward."""
        traffic, reward = self._traffic, 0.0
        assert traffic is not None
        for _ in range(self._every):
            while self._waiting and self._waiting[0][0] <= self._scene.tick:
                self._acting = self._waiting.popleft()[1]
            before = self._scene
            self._scene = scene = traffic.step(self._acting)
            places = before.ego_place[:, 0], scene.ego_place[:, 0]
            reward += float(rewards(before.running, *places, scene.contact)[0])
            readings = self._rig.sense(scene)
        self._look(readings)
        return reward

    def _look(self, readings: Mapping[str, Measurement]) -> None:
        """Show the channel what is linked to it."""
        self._seen.update(
            observe(
                self._spec.links,
                self._scene.time,
                self._rack.detect(readings),
                {},
                None,
                self._scene.running,
                protect=False,
            )
        )

    def _shown(self) -> Any:
        return row_of(self._seen.shown([0], self._parameters), 0)


def _observed(parameters: PolicyParameters) -> spaces.Space[Any]:
    """Return the space of what a policy channel observes."""
    most = 1.0 if parameters.normalised else np.inf

    def box(*shape: int) -> spaces.Box:
        return spaces.Box(-most, most, shape, dtype=np.float32)

    ego, objects = len(EGO_FEATURES), (parameters.nearest, len(OBJECT_FEATURES))
    if parameters.observation == "kinematics_flat":
        return box(ego + objects[0] * objects[1])
    return spaces.Dict({EGO: box(ego), OBJECTS: box(*objects)})


def register() -> None:
    """Make ``gymnasium.make`` and ``make_vec`` find the environment; once is enough."""
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(ENV_ID, entry_point="adeye.simulate.training:PolicyEnv")


register()
