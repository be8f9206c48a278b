"""Group test cases into batches: one structure inside a batch, only values vary."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Protocol

from adeye.identity import digest
from adeye.spec.scenario import LogicalScenario
from adeye.spec.sensors import model_name
from adeye.sweep.overrides import MOST_VARIANTS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault
    from adeye.sweep.case import TestCase

_KNOWN: dict[int, tuple[Any, str]] = {}


class Structured(Protocol):
    """What tells the structure of a test case."""

    @property
    def scenario_id(self) -> str:
        """Id of the scenario in its ODD."""

    @property
    def scenario(self) -> LogicalScenario:
        """The scenario, overrides applied."""

    @property
    def architecture(self) -> Architecture:
        """The architecture, overrides applied."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The faults of its entry."""

    @property
    def fault_entry(self) -> str:
        """Name of the entry."""

    @property
    def step(self) -> float:
        """Master clock [s]."""


def structure_key(case: Structured) -> str:
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
    known = _KNOWN.get(id(part))
    if known is None or known[0] is not part:
        made = _of_scenario(part) if isinstance(part, LogicalScenario) else _of_architecture(part)
        known = (part, digest(made))
        if len(_KNOWN) >= MOST_VARIANTS:
            _KNOWN.clear()
        _KNOWN[id(part)] = known
    return known[1]


def _of_scenario(scenario: LogicalScenario) -> Any:
    content = scenario.executable()
    content["environment"] = None
    return content | {
        "environment": {
            key: text
            for key, text in scenario.environment.model_dump(mode="json").items()
            if key != "illumination"
        }
    }


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
