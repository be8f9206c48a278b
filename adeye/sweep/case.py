"""The test case: one situation, one architecture, one fault entry; and what identifies it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from adeye.identity import digest, stream_seed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario


@dataclass(frozen=True)
class TestCase:
    """One row of the plan; scenario and architecture are shared between rows.

    Attributes:
        scenario_id: Id of the scenario in its ODD.
        scenario: With overrides by dotted path applied.
        parameters: Resolved scenario parameters in SI.
        architecture: With overrides by dotted path applied.
        faults: The faults of its entry; empty for ``none``.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        replicate: Number of the replicate, from 0.
        seed: Seed of the ODD.
        step: Master clock [s].
        point: Swept values in SI by the name that the sweep uses.
        inside_odd: Whether its planned attributes lie inside the ODD.
        attributes: The ODD's attributes, for leaving it during the run.
    """

    __test__ = False  # the field's word, not a class of tests

    scenario_id: str
    scenario: LogicalScenario
    parameters: Mapping[str, float]
    architecture: Architecture
    faults: tuple[Fault, ...]
    fault_entry: str
    replicate: int
    seed: int
    step: float
    point: Mapping[str, float | str]
    inside_odd: bool
    attributes: Attributes

    @cached_property
    def stream_seed(self) -> int:
        """Seed of its random streams: never architecture, faults, step or horizon."""
        return stream_seed(self.seed, self.replicate, self.scenario.scenario, self.parameters)

    @cached_property
    def situation_digest(self) -> str:
        """Identity of what happens around the ego, whatever drives it."""
        return digest(
            {
                "scenario": content_digest(self.scenario),
                "parameters": dict(self.parameters),
                "replicate": self.replicate,
                "seed": self.seed,
            }
        )

    @cached_property
    def digest(self) -> str:
        """Identity of the test case: situation, clock, executable architecture and faults."""
        return digest(
            {
                "situation": self.situation_digest,
                "step": self.step,
                "horizon": self.scenario.horizon,
                "tail": self.scenario.tail,
                "architecture": content_digest(self.architecture),
                "faults": [fault.executable() for fault in self.faults],
            }
        )


_CONTENT: dict[int, tuple[LogicalScenario | Architecture, str]] = {}


def content_digest(part: LogicalScenario | Architecture) -> str:
    """Hash the executable content of a scenario or architecture, once per shared record.

    Args:
        part: A frozen record; the reference is kept, so its identity is not reused.

    Returns:
        sha256 in hex.
    """
    known = _CONTENT.get(id(part))
    if known is None or known[0] is not part:
        known = (part, digest(part.executable()))
        _CONTENT[id(part)] = known
    return known[1]
