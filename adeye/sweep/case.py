"""The test case: one situation, one architecture, one fault entry; and what identifies it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Final, Self, TypeAlias

from adeye.identity import JsonRows, digest, digests, stream_seed
from adeye.spec.odd import Attributes
from adeye.spec.scenario import LogicalScenario
from adeye.spec.sensors import model_name
from adeye.sweep.axes import MOST_VARIANTS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault

# --- The test case: one situation, one architecture, one fault entry; and what identifies it ------


@dataclass(frozen=True, slots=True)
class AuthorityOverride:
    """Who acts from a tick on, whatever the switch decides: what makes a fork of a run.

    Attributes:
        from_tick: First tick at which it holds.
        channel: Id of the channel that acts.
    """

    from_tick: int
    channel: str


SCENARIOS: Final = "scenarios/"
"""Begins the keys of folders that are those of scenarios; no architecture is called so."""


@dataclass(frozen=True)
class Shared:
    """What many test cases have in common.

    Attributes:
        scenario_id: Id of the scenario in its ODD.
        scenario: With overrides by dotted path applied.
        parameters: Resolved scenario parameters in SI; what many share has of those that vary the
            default.
        architecture: With overrides by dotted path applied.
        faults: The faults of the entry; empty for ``none``.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        seed: Seed of the ODD.
        step: Master clock [s].
        attributes: The ODD's attributes, for leaving it during the run.
    """

    scenario_id: str
    scenario: LogicalScenario
    parameters: Mapping[str, float]
    architecture: Architecture
    faults: tuple[Fault, ...]
    fault_entry: str
    seed: int
    step: float
    attributes: Attributes

    @property
    def place_key(self) -> str:
        """Under what the folder of the scenario's file is kept, beside those of architectures."""
        return f"{SCENARIOS}{self.scenario_id}"

    @property
    def fmus(self) -> int:
        """Number of FMUs that are no channels."""
        return len(self.architecture.fmus) + len(self.scenario.drivers)


@dataclass(frozen=True)
class TestCase(Shared):
    """One row of the plan; scenario and architecture are shared between rows.

    Attributes:
        replicate: Number of the replicate, from 0.
        point: Swept values in SI by the name that the sweep uses.
        inside_odd: Whether its planned attributes lie inside the ODD.
        override: Another authority than that of the switch; None in every test case of a plan.
    """

    __test__ = False  # the field's word, not a class of tests

    replicate: int
    point: Mapping[str, float | str]
    inside_odd: bool
    override: AuthorityOverride | None = None

    @cached_property
    def stream_seed(self) -> int:
        """Seed of its random streams: never architecture, faults, step or horizon."""
        return stream_seed(self.seed, self.replicate, self.scenario.scenario, self.parameters)

    @cached_property
    def situation_digest(self) -> str:
        """Identity of what happens around the ego, whatever drives it."""
        parameters = JsonRows.of(self.parameters, ()).texts({}, 1)
        values = {"parameters": parameters, "replicate": [str(self.replicate)]}
        return digests(situation_json(self.scenario, self.seed).texts(values, 1))[0]

    @cached_property
    def digest(self) -> str:
        """Identity of the test case: situation, clock, architecture, faults and override."""
        rows = case_json(
            self.scenario, self.architecture, self.faults, self.step, override=self.override
        )
        return digests(rows.texts({"situation": [f'"{self.situation_digest}"']}, 1))[0]

    def identified(self, seed: int, situation: str, digest: str) -> Self:
        """Take identities that were computed for many test cases at once.

        Args:
            seed: What ``stream_seed`` would be.
            situation: What ``situation_digest`` would be.
            digest: What ``digest`` would be.

        Returns:
            Itself.
        """
        vars(self).update(stream_seed=seed, situation_digest=situation, digest=digest)
        return self


def lone_case(
    scenario: LogicalScenario,
    architecture: Architecture,
    parameters: Mapping[str, float],
    *,
    step: float,
    seed: int = 0,
    replicate: int = 0,
) -> TestCase:
    """Make a test case that is of no ODD and has no faults.

    Args:
        scenario: The scenario.
        architecture: The architecture.
        parameters: Values of the scenario's parameters in SI.
        step: Master clock [s].
        seed: Of its random streams.
        replicate: Number of the replicate, from 0.
    """
    return TestCase(
        scenario_id=scenario.scenario,
        scenario=scenario,
        parameters=parameters,
        architecture=architecture,
        faults=(),
        fault_entry="none",
        replicate=replicate,
        seed=seed,
        step=step,
        point=parameters,
        inside_odd=True,
        attributes=Attributes(),
    )


def situation_json(scenario: LogicalScenario, seed: int) -> JsonRows:
    """Define what identifies a situation: scenario, seed, parameters and replicate."""
    shared = {"scenario": content_digest(scenario), "seed": seed}
    return JsonRows.of(shared, ("parameters", "replicate"))


def case_json(
    scenario: LogicalScenario,
    architecture: Architecture,
    faults: Sequence[Fault],
    step: float,
    *,
    override: AuthorityOverride | None = None,
) -> JsonRows:
    """Define what identifies a test case: its situation, clock, architecture and faults.

    An override is named where there is one only, so that other test cases keep their identity.
    """
    shared: dict[str, object] = {
        "step": step,
        "horizon": scenario.horizon,
        "tail": scenario.tail,
        "architecture": content_digest(architecture),
        "faults": [fault.executable() for fault in faults],
    }
    if override is not None:
        shared["authority"] = {"from_tick": override.from_tick, "channel": override.channel}
    return JsonRows.of(shared, ("situation",))


_Digests: TypeAlias = "dict[int, tuple[LogicalScenario | Architecture, str]]"
"""By identity of the record, which is its own while the reference is kept."""
_CONTENT: _Digests = {}
_NAMELESS: _Digests = {}
_STRUCTURE: _Digests = {}


def _once(
    known: _Digests, part: LogicalScenario | Architecture, content: Callable[[], object]
) -> str:
    """Hash something of a shared record once."""
    found = known.get(id(part))
    if found is None or found[0] is not part:
        found = (part, digest(content()))
        if len(known) >= MOST_VARIANTS:
            known.clear()
        known[id(part)] = found
    return found[1]


def content_digest(part: LogicalScenario | Architecture) -> str:
    """Hash the executable content of a scenario or architecture, once per shared record.

    Args:
        part: A frozen record.

    Returns:
        sha256 in hex.
    """
    return _once(_CONTENT, part, part.executable)


def nameless_digest(scenario: LogicalScenario) -> str:
    """Hash the executable content of a scenario but for its id, as ``content_digest`` does."""
    return _once(_NAMELESS, scenario, lambda: {**scenario.executable(), "scenario": ""})


# --- Group test cases into batches: one structure inside a batch, only values vary ----------------


def structure_key(case: Shared) -> str:
    """Hash what must be equal inside a batch.

    Scenario, actors, storyboard, sensors, channels, links, rates, latencies, switch policy, fault
    models and step are structure; every other number may vary from run to run.

    Args:
        case: A test case, or what many share.
    """
    faults = [
        [
            *(fault.id, fault.target, fault.model),
            fault.onset.when.text if fault.onset.when else "",
            *(getattr(fault, name) for name in fault.STRUCTURE),
        ]
        for fault in case.faults
    ]
    return digest(
        [
            case.scenario_id,
            _structure(case.scenario),
            _structure(case.architecture),
            faults,
            case.fault_entry,
            case.step,
        ]
    )


def batches(cases: Iterable[TestCase], size: int) -> Iterator[list[TestCase]]:
    """Cut consecutive test cases of one structure into batches.

    Args:
        cases: In the order of the plan.
        size: Most test cases in a batch.
    """
    batch: list[TestCase] = []
    key = ""
    for case in cases:
        own = structure_key(case)
        if batch and (own != key or len(batch) == size):
            yield batch
            batch = []
        key = own
        batch.append(case)
    if batch:
        yield batch


def _structure(part: LogicalScenario | Architecture) -> str:
    if isinstance(part, LogicalScenario):
        return _once(_STRUCTURE, part, partial(_of_scenario, part))
    return _once(_STRUCTURE, part, partial(_of_architecture, part))


def _of_scenario(scenario: LogicalScenario) -> Any:
    content, environment = scenario.executable(), scenario.environment.model_dump(mode="json")
    environment.pop("illumination")
    if scenario.world.road.kind == "imported":
        # Places of a map are values: their roads differ in numbers only.
        content["world"] = scenario.world.model_dump(mode="json", exclude={"map", "place", "road"})
        content["traffic"] = scenario.world.road.traffic
    return {**content, "environment": environment}


def _of_architecture(architecture: Architecture) -> Any:
    sensors = {
        name: [model_name(sensor), sensor.rate, sensor.latency, sensor.jitter, _free(sensor)]
        for name, sensor in architecture.sensors.items()
    }
    channels = {
        name: [channel.kind, list(channel.links), channel.rate, channel.delay, _free(channel)]
        for name, channel in architecture.channels.items()
    }
    switch = architecture.switch
    policy = [switch.policy, list(switch.priority), switch.default, switch.latch]
    return [architecture.architecture, list(sensors.items()), list(channels.items()), policy]


def _free(part: Any) -> str:
    """What shapes the arrays of a part; parameters of a plug-in are opaque, so they are, too."""
    shapes = {name: _shape(getattr(part, name)) for name in getattr(part, "STRUCTURE", ())}
    # What a part does not have shapes nothing.
    shaped = {name: shape for name, shape in shapes.items() if shape is not None}
    parameters = getattr(part, "parameters", None)
    if isinstance(parameters, dict):
        shaped["parameters"] = parameters
    return json.dumps(shaped, sort_keys=True) if shaped else ""


def _shape(value: Any) -> Any:
    """A number shapes by its value, named records by their names."""
    return list(value) if isinstance(value, dict) else value
