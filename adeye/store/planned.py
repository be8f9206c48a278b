"""Consecutive test cases of a plan as columns: what planning saves, without a record for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from adeye.store.encoding import json_text
from adeye.store.rows import require_seed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.store.rows import ContentRecord, EngineKey, PlannedCase


@dataclass(frozen=True)
class PlannedCases:
    """Test cases that share content, faults, clock, engine and structure; N of them.

    Attributes:
        scenario: Id of the scenario in the ODD.
        scenario_content: Executable content of the scenario, overrides applied.
        architecture: Id of the architecture.
        architecture_content: Executable content of the architecture, overrides applied.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        faults: Executable content of the faults of the entry.
        seed: Seed of the ODD.
        step_s: Master clock [s].
        engine: Engine that executes them.
        structure: Test cases of different structure never share a block.
        test_cases: (N,) digests.
        situations: (N,) digests of the situations.
        parameters: (N,) resolved scenario parameters in SI, as JSON.
        points: (N,) swept values in SI by the name that the sweep uses, as JSON.
        replicates: (N,) numbers of the replicates, from 0.
        inside_odd: (N,) whether the planned attributes lie inside the ODD.
        point_index: (N,) places in the plan of the ODD.
    """

    scenario: str
    scenario_content: ContentRecord
    architecture: str
    architecture_content: ContentRecord
    fault_entry: str
    faults: Sequence[Mapping[str, Any]]
    seed: int
    step_s: float
    engine: EngineKey
    structure: str
    test_cases: Sequence[str]
    situations: Sequence[str]
    parameters: Sequence[str]
    points: Sequence[str]
    replicates: Sequence[int]
    inside_odd: Sequence[bool]
    point_index: Sequence[int]

    def __post_init__(self) -> None:
        require_seed(self.seed)

    def __len__(self) -> int:
        """Number of test cases."""
        return len(self.test_cases)

    @classmethod
    def of(cls, case: PlannedCase) -> PlannedCases:
        """Take one test case."""
        return cls(
            scenario=case.scenario,
            scenario_content=case.scenario_content,
            architecture=case.architecture,
            architecture_content=case.architecture_content,
            fault_entry=case.fault_entry,
            faults=case.faults,
            seed=case.seed,
            step_s=case.step_s,
            engine=case.engine,
            structure=case.structure,
            test_cases=(case.test_case,),
            situations=(case.situation,),
            parameters=(json_text(dict(case.parameters)),),
            points=(json_text(dict(case.point)),),
            replicates=(case.replicate,),
            inside_odd=(case.inside_odd,),
            point_index=(case.point_index,),
        )
