"""The traffic as a Gymnasium vector environment: drive it, or train on it, without any sensor.

>>> import gymnasium
>>> "adeye/Traffic-v0" in gymnasium.registry
True
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from adeye.errors import SpecError, UsageError
from adeye.kernel.random import owner_id, uniform
from adeye.signals import Bools, Floats, Ints, Scene
from adeye.simulate.traffic import make_traffic
from adeye.simulate.world.clock import require_step
from adeye.spec.architecture import Architecture
from adeye.spec.load import load_architecture, load_scenario
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.axes import default_values
from adeye.sweep.case import TestCase, lone_case
from adeye.sweep.values import quantity_or_text
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.simulate.traffic import Traffic

ENV_ID: Final = "adeye/Traffic-v0"

CONTACT_REWARD: Final = -100.0
"""Reward of the tick in which the ego touches something, beside the way that it drove."""

MAX_DRAWS: Final = 1000
"""Attempts to draw parameters that satisfy a scenario's constraints."""

OPTIONS: Final = ("cases", "reset_mask")
"""What ``reset`` can be told."""

Observation = dict[str, Any]


@dataclass(eq=False)
class _Group:
    """Runs that began together, in a traffic of their own.

    Attributes:
        traffic: What drives them.
        scene: As they are.
        runs: (N,) those of the environment that are still theirs.
        rows: (N,) where each of them is in the traffic.
        size: Runs of the traffic.
    """

    traffic: Traffic
    scene: Scene
    runs: Ints
    rows: Ints
    size: int

    def step(self, command: Floats) -> None:
        """Advance by one tick; runs that are no longer theirs are let go."""
        own = np.zeros((self.size, 2))
        own[self.rows] = command[self.runs]
        self.scene = self.traffic.step(own)

    def without(self, left: Bools) -> None:
        """Give up runs (B,)."""
        kept = ~left[self.runs]
        self.runs, self.rows = self.runs[kept], self.rows[kept]


class TrafficVectorEnv(VectorEnv[Observation, Floats, Any]):
    """A batch of runs of one scenario; the actions are ego commands.

    - Action: (B, 2) acceleration [m/s²] and steering angle [rad]. They act through the ego's
      actuators, which limit them.
    - Observation: the scene as it is, see ``signals.Scene``; ``begun`` says which storyboard events
      have begun.
    - Reward: way that the ego drove along the road in the tick [m], plus ``CONTACT_REWARD`` when it
      touches something.
    - Terminated: contact, or the goal and its tail. Truncated: horizon and tail.

    Runs that have ended are not reset: stepping them changes nothing and gives reward 0.
    ``reset(options={"reset_mask": ...})`` begins only those that it names anew.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as its base class declares it
        "autoreset_mode": AutoresetMode.DISABLED,
        "render_modes": [],
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        scenario: LogicalScenario | str | Path,
        architecture: Architecture | str | Path,
        step: float = 0.05,
        backend: str = "highway",
    ) -> None:
        """Prepare a batch of runs.

        Args:
            num_envs: Number of runs B.
            scenario: The scenario, or its file.
            architecture: Its vehicle is the ego; a record or a file.
            step: Master clock [s].
            backend: Name of the traffic implementation.

        Raises:
            InputError: A file or a value in it cannot be used.
            UsageError: There is no run.
        """
        if num_envs < 1:
            raise UsageError(f"num_envs is {num_envs}", remedy="Give at least 1 run.")
        require_step(step)
        self.num_envs = num_envs
        # Where the FMUs of a vehicle and of actors are looked for.
        self._folder = self._scenario_folder = Path()
        if isinstance(scenario, LogicalScenario):
            self._scenario = scenario
        else:
            read = load_scenario(scenario)
            self._scenario, self._scenario_folder = read.spec, read.path.parent
        if isinstance(architecture, Architecture):
            self._architecture = architecture
        else:
            loaded = load_architecture(architecture)
            self._architecture, self._folder = loaded.spec, loaded.path.parent
        self._step = step
        self._backend = backend
        make_traffic(backend)
        self._groups: list[_Group] = []
        self._cases: list[TestCase] = []
        self._time: Floats = np.zeros(num_envs)
        self._terminated: Bools = np.zeros(num_envs, dtype=np.bool_)
        self._truncated: Bools = np.zeros(num_envs, dtype=np.bool_)
        self._seed = 0
        self._episode = 0
        vehicle = self._architecture.vehicle
        high = np.array([vehicle.max_acceleration, vehicle.max_steering_angle])
        low = np.array([-vehicle.max_deceleration, -vehicle.max_steering_angle])
        self.single_action_space = spaces.Box(low, high, dtype=np.float64)
        self.single_observation_space = _observation_space(self._scenario)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin the runs, or some of them anew.

        Args:
            seed: Starts the draws from the scenario's ranges; without it they go on where the
                last reset left them, from seed 0 at first.
            options: ``{"cases": [...]}`` gives the test cases, one per run that begins; without it
                they are drawn. ``{"reset_mask": ...}``, (B,) truth values, says which runs begin;
                the others go on where they are.

        Returns:
            The observation, and the scenario parameters of each run.

        Raises:
            UsageError: The number of test cases is wrong, their scenario has other objects, an
                option is unknown, the seed is no whole number from 0, or the mask is none or leaves
                out a run that has never begun.
            SpecError: No draw satisfies the scenario's constraints.
        """
        options = options or {}
        begins = self._masked(options)
        require_seed(seed)
        super().reset(seed=seed)
        if seed is not None:
            self._seed, self._episode = seed, 0
        given = options.get("cases")
        runs = np.flatnonzero(begins)
        cases = self._draw(runs) if given is None else list(given)
        self._check(cases, len(runs))
        traffic = make_traffic(self._backend)
        traffic.base_dir, traffic.scenario_dir = self._folder, self._scenario_folder
        _, scene = traffic.reset(cases)
        for group in self._groups:
            group.without(begins)
        self._groups = [group for group in self._groups if len(group.runs)]
        self._groups.append(_Group(traffic, scene, runs, np.arange(len(runs)), len(runs)))
        known = dict(enumerate(self._cases)) | dict(zip(runs.tolist(), cases, strict=True))
        self._cases = [known[number] for number in range(self.num_envs)]
        self._time = np.where(begins, scene.time, self._time)
        self._note_ended()
        names = self._cases[0].parameters
        parameters = {
            name: np.array([case.parameters[name] for case in self._cases]) for name in names
        }
        return self._observe(), {"parameters": parameters}

    def step(self, actions: Floats) -> tuple[Observation, Floats, Bools, Bools, dict[str, Any]]:
        """Advance every run that has not ended by one tick.

        Args:
            actions: (B, 2) acceleration [m/s²] and steering angle [rad].

        Returns:
            Observation, reward, terminated, truncated and the impact speed at contact [m/s].

        Raises:
            UsageError: The runs were not reset, or the actions have another shape.
        """
        given = np.asarray(actions)
        if given.dtype.kind not in "fiu" or np.ma.is_masked(actions):
            raise UsageError(
                f"actions are {'masked' if given.dtype.kind in 'fiu' else given.dtype}",
                remedy="Give a number for each.",
            )
        command = given.astype(np.float64)
        if not self._groups:
            raise UsageError("the environment was not reset", remedy="Call reset() first.")
        if command.shape != (self.num_envs, 2):
            raise UsageError(
                f"actions have shape {command.shape}, not ({self.num_envs}, 2)",
                remedy="Give acceleration and steering angle of every run.",
            )
        running, before = self._gathered("running"), self._gathered("ego_place")[:, 0]
        if not np.isfinite(command[running]).all():
            raise UsageError(
                "an action of a run that has not ended is not finite",
                remedy="Give a number for acceleration and steering angle.",
            )
        for group in self._groups:
            group.step(command)
            self._time[group.runs] = np.where(
                running[group.runs], group.scene.time, self._time[group.runs]
            )
        reward = rewards(
            running, before, self._gathered("ego_place")[:, 0], self._gathered("contact")
        )
        self._note_ended()
        info = {"impact_speed": self._gathered("impact_speed")}
        return self._observe(), reward, self._terminated.copy(), self._truncated.copy(), info

    def _masked(self, options: Mapping[str, Any]) -> Bools:
        """Return which runs begin (B,).

        Raises:
            UsageError: An option is unknown, or the mask cannot be used.
        """
        if unknown := sorted(set(options) - set(OPTIONS)):
            raise UsageError(
                f"reset has no option {unknown[0]!r}", remedy=f"Give {' or '.join(OPTIONS)}."
            )
        if "reset_mask" not in options:
            return np.ones(self.num_envs, dtype=np.bool_)
        mask = np.asarray(options["reset_mask"])
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
            raise UsageError(
                f"reset_mask is {mask.dtype} of shape {mask.shape}"
                f"{'' if mask.any() else ' and names no run'}",
                remedy=f"Give {self.num_envs} truth values, at least one of them true.",
            )
        if not self._groups and not mask.all():
            raise UsageError(
                "reset_mask leaves out runs that have never begun", remedy="Call reset() first."
            )
        return mask.copy()

    def _gathered(self, name: str) -> NDArray[Any]:
        """Return an array of the scene (B, ...), each run from the group that it is of."""
        return self._joined([getattr(group.scene, name) for group in self._groups])

    def _joined(self, parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
        made = np.empty((self.num_envs, *parts[0].shape[1:]), dtype=parts[0].dtype)
        for group, part in zip(self._groups, parts, strict=True):
            made[group.runs] = part[group.rows]
        return made

    def _note_ended(self) -> None:
        ended = ~self._gathered("running")
        arrived = self._joined([group.traffic.ending.arrived for group in self._groups])
        self._terminated = ended & ((self._gathered("contact") >= 0) | arrived)
        self._truncated = ended & ~self._terminated

    def _observe(self) -> Observation:
        return {
            "time": self._time.copy(),
            **{
                name: self._gathered(name)
                for name in ("ego", "ego_place", "objects", "object_places")
            },
            "begun": np.isfinite(self._gathered("begun")).astype(np.int8),
            "contact": self._gathered("contact"),
            "foreign_contact": self._gathered("foreign_contact").astype(np.int64),
            "running": self._gathered("running").astype(np.int64),
        }

    def _check(self, cases: Sequence[TestCase], runs: int) -> None:
        if len(cases) != runs:
            raise UsageError(
                f"{len(cases)} test cases for {runs} runs",
                remedy="Give one test case per run.",
            )
        for case in cases:
            if not isinstance(case, TestCase):
                raise UsageError(
                    f"{shown(case)} is no test case", remedy="Give those of a plan: plan.cases."
                )
            if _observation_space(case.scenario) != self.single_observation_space:
                raise UsageError(
                    f"scenario {case.scenario.scenario!r} has other objects or events than "
                    f"{self._scenario.scenario!r}, which the environment was made for",
                    remedy="Make an environment of its own for it.",
                )

    def _draw(self, runs: Ints) -> list[TestCase]:
        first = self._episode * self.num_envs
        self._episode += 1
        return [self._draw_case(first + number) for number in runs.tolist()]

    def _draw_case(self, sample: int) -> TestCase:
        return draw_case(self._scenario, self._architecture, self._step, self._seed, sample)


class TrafficEnv(gymnasium.Env[Observation, Floats]):
    """One run of ``TrafficVectorEnv``, with the same spaces, rewards and ends."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as its base class declares it
    render_mode: None = None

    def __init__(self, **given: Any) -> None:
        """Prepare a run; it is told what ``TrafficVectorEnv`` is told."""
        self._vector = TrafficVectorEnv(1, **given)
        self.action_space = self._vector.single_action_space
        self.observation_space = self._vector.single_observation_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin the run, see ``TrafficVectorEnv.reset``."""
        require_seed(seed)
        super().reset(seed=seed)
        seen, info = self._vector.reset(seed=seed, options=options)
        values = {name: value[0].item() for name, value in info["parameters"].items()}
        return self._first(seen), {"parameters": values}

    def step(self, action: Floats) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance the run by one tick, see ``TrafficVectorEnv.step``."""
        command = np.asarray(action, dtype=np.float64)[np.newaxis]
        seen, reward, terminated, truncated, info = self._vector.step(command)
        told = {"impact_speed": float(info["impact_speed"][0])}
        return self._first(seen), reward[0].item(), bool(terminated[0]), bool(truncated[0]), told

    def _first(self, seen: Observation) -> Observation:
        known: Any = self.observation_space
        return {
            name: seen[name][0] if isinstance(space, spaces.Discrete) else np.array(seen[name][0])
            for name, space in known.spaces.items()
        }


def require_seed(seed: object) -> None:
    """Refuse what is no seed of a run: every other is a run of its own.

    Raises:
        UsageError: It is neither None nor a whole number that is not negative.
    """
    is_seed = isinstance(seed, int) and not isinstance(seed, bool) and seed >= 0
    if seed is not None and not is_seed:
        raise UsageError(f"reset: the seed is {shown(seed)}", remedy="Give a whole number from 0.")


def draw_case(
    scenario: LogicalScenario, architecture: Architecture, step: float, seed: int, sample: int
) -> TestCase:
    """Draw a test case from the ranges of a scenario.

    Args:
        scenario: The scenario.
        architecture: The architecture.
        step: Master clock [s].
        seed: Any whole number that is not negative.
        sample: Number of the run.

    Raises:
        SpecError: No draw satisfies the scenario's constraints.
    """
    for attempt in range(MAX_DRAWS):
        values = draw_parameters(scenario, seed, sample, attempt)
        if all(bool(item.evaluate(values)) for item in scenario.constraints):
            return lone_case(scenario, architecture, values, step=step, seed=seed, replicate=sample)
    raise SpecError(
        f"none of {MAX_DRAWS} draws satisfies the constraints of {scenario.scenario!r}",
        remedy="Narrow the ranges of its parameters.",
    )


def rewards(running: Bools, before: Floats, after: Floats, contact: Ints) -> Floats:
    """Return the way that each ego drove in a tick (B,) [m], plus ``CONTACT_REWARD`` at contact.

    Args:
        running: (B,) which runs had not ended before the tick.
        before: (B,) where the egos were along the road [m].
        after: (B,) where they are.
        contact: (B,) object that each touches, -1 for none.
    """
    way: Floats = np.where(running, after - before, 0.0)
    return way + CONTACT_REWARD * (running & (contact >= 0))


def draw_parameters(
    scenario: LogicalScenario, seed: int, sample: int, attempt: int
) -> dict[str, float]:
    """Draw each parameter uniformly from its range; without a range it has its default.

    Args:
        scenario: Its parameters.
        seed: Any whole number that is not negative.
        sample: Number of the run.
        attempt: Number of the attempt to satisfy the constraints.

    Returns:
        Values in SI by name.
    """
    values = default_values(scenario)
    # A remainder would give the draws of a small seed to a large one.
    stream = np.uint64(seed if seed < 2**64 else owner_id(str(seed)))
    for name, parameter in scenario.parameters.items():
        if parameter.range is not None:
            low, high = (float(quantity_or_text(end)[0]) for end in parameter.range)
            share = uniform(stream, np.uint64(owner_id(name)), sample, attempt)
            values[name] = low + share * (high - low)
    return values


def _observation_space(scenario: LogicalScenario) -> spaces.Dict:
    things = len(scenario.actors) + len(scenario.world.objects)

    def box(*shape: int) -> spaces.Box:
        return spaces.Box(-np.inf, np.inf, shape, dtype=np.float64)

    return spaces.Dict(
        {
            "time": spaces.Box(0.0, np.inf, (), dtype=np.float64),
            "ego": box(7),
            "ego_place": box(6),
            "objects": box(things, 5),
            "object_places": box(things, 6),
            "begun": spaces.Box(0, 1, (len(scenario.storyboard),), dtype=np.int8),
            "contact": spaces.Discrete(things + 1, start=-1),
            "foreign_contact": spaces.Discrete(2),
            "running": spaces.Discrete(2),
        }
    )


def register() -> None:
    """Make ``gymnasium.make`` and ``make_vec`` find the environment; once is enough."""
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(
            ENV_ID,
            entry_point="adeye.simulate.traffic.env:TrafficEnv",
            vector_entry_point="adeye.simulate.traffic.env:TrafficVectorEnv",
        )


register()
