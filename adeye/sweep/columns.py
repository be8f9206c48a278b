"""Consecutive test cases as columns: identities and JSON without a record for each of them.

The templates of JSON are those of ``case``, so that a column holds what a ``TestCase`` would say.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.errors import SweepError
from adeye.identity import JsonRows, digests, stream_seeds
from adeye.sweep.boundary import breaches
from adeye.sweep.case import TestCase, case_json, situation_json

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.spec.architecture import Architecture
    from adeye.spec.load import OddFiles
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.sections import Section
    from adeye.sweep.shared import Shared


@dataclass(frozen=True)
class World:
    """What the initial world of a test case is computed from."""

    scenario: LogicalScenario
    parameters: Mapping[str, float]
    architecture: Architecture
    step: float
    stream_seed: int


@dataclass(frozen=True, eq=False)
class CaseColumns:
    """Consecutive test cases of one section; a column has as many entries as there are cases.

    Attributes:
        section: Which one.
        shared: What they have in common.
        first: Ordinal of the first.
        rows: (P,) points of the design that they have.
        points: (N,) position of each test case's point in ``rows``.
        replicate: Number of the replicate.
        is_inside: (P,) whether the planned attributes of a point lie inside the ODD.
    """

    section: Section
    shared: Shared
    first: int
    rows: NDArray[np.int64]
    points: NDArray[np.int64]
    replicate: list[int]
    is_inside: NDArray[np.bool_]

    def __len__(self) -> int:
        """Number of test cases."""
        return len(self.replicate)

    @cached_property
    def inside_odd(self) -> list[bool]:
        """Whether the planned attributes lie inside the ODD."""
        return self._spread(self.is_inside.tolist())

    @cached_property
    def parameters_json(self) -> list[str]:
        """Resolved scenario parameters in SI, as canonical JSON."""
        varied = self._varied
        fixed = {k: v for k, v in self.shared.parameters.items() if k not in varied}
        rows = JsonRows.of(fixed, varied)
        return self._spread(rows.texts(self._texts(rows.varied), len(self.rows)))

    @cached_property
    def point_json(self) -> list[str]:
        """Swept values by the name that the sweep uses, as canonical JSON."""
        rows = JsonRows.of({}, (axis.name for axis in self.section.group.axes))
        return self._spread(rows.texts(self._texts(rows.varied), len(self.rows)))

    @cached_property
    def situation_digest(self) -> list[str]:
        """Identities of the situations."""
        values = {"parameters": self.parameters_json, "replicate": list(map(str, self.replicate))}
        rows = situation_json(self.shared.scenario, self.shared.seed)
        return digests(rows.texts(values, len(self)))

    @cached_property
    def digest(self) -> list[str]:
        """Identities of the test cases."""
        shared = self.shared
        rows = case_json(shared.scenario, shared.architecture, shared.faults, shared.step)
        quoted = [f'"{situation}"' for situation in self.situation_digest]
        return digests(rows.texts({"situation": quoted}, len(self)))

    @cached_property
    def stream_seed(self) -> list[int]:
        """Seeds of the random streams."""
        scenario = self.shared.scenario.scenario
        return stream_seeds(self.shared.seed, scenario, self.replicate, self.parameters_json)

    def cases(self) -> list[TestCase]:
        """Make the test cases."""
        shared = self.shared
        names = [axis.name for axis in self.section.group.axes]
        return [
            TestCase(
                scenario_id=shared.scenario_id,
                scenario=shared.scenario,
                parameters=parameters,
                architecture=shared.architecture,
                faults=shared.faults,
                fault_entry=shared.fault_entry,
                replicate=replicate,
                seed=shared.seed,
                step=shared.step,
                point=point,
                inside_odd=inside,
                attributes=shared.attributes,
            ).identified(seed, situation, digest)
            for parameters, replicate, point, inside, seed, situation, digest in zip(
                self._spread(self._parameters()),
                self.replicate,
                self._spread(self._mappings({}, names)),
                self.inside_odd,
                self.stream_seed,
                self.situation_digest,
                self.digest,
                strict=True,
            )
        ]

    def worlds(self) -> list[World]:
        """Give what the initial world of each point is computed from, without random streams."""
        shared = self.shared
        return [
            World(shared.scenario, parameters, shared.architecture, shared.step, 0)
            for parameters in self._parameters()
        ]

    @property
    def _varied(self) -> list[str]:
        return [axis.name for axis in self.section.group.axes if axis.kind == "parameter"]

    def _parameters(self) -> list[dict[str, Any]]:
        return self._mappings(self.shared.parameters, self._varied)

    def _mappings(self, constant: Mapping[str, Any], names: Sequence[str]) -> list[dict[str, Any]]:
        if not names:
            return [dict(constant)] * len(self.rows)
        points = self.section.group.points
        columns = [points.column(name, self.rows).tolist() for name in names]
        return [
            {**constant, **dict(zip(names, values, strict=True))}
            for values in zip(*columns, strict=True)
        ]

    def _texts(self, names: Iterable[str]) -> dict[str, list[str]]:
        points = self.section.group.points
        return {name: points.texts(name, self.rows) for name in names}

    def _spread(self, column: list[Any]) -> list[Any]:
        """Repeat what a point has for each of its replicates."""
        if self.section.replicates == 1:
            return column
        return [column[point] for point in self.points.tolist()]


def columns_of(
    files: OddFiles, section: Section, shared: Shared, low: int, high: int
) -> CaseColumns:
    """Make the columns of some test cases of a section.

    Args:
        files: The ODD and everything it names.
        section: Which one.
        shared: What its test cases have in common.
        low: First test case, counted from the section's first.
        high: Behind the last.

    Raises:
        SweepError: A point is outside the ODD and the ODD refuses such.
    """
    point, replicate = np.divmod(np.arange(low, high), section.replicates)
    start = low // section.replicates
    rows = section.rows[start : int(point[-1]) + 1]
    points = section.group.points
    columns: dict[str, Any] = dict(shared.parameters)
    for axis in section.group.axes:
        if axis.kind == "parameter":
            columns[axis.name] = points.column(axis.name, rows)
    outside = np.zeros(len(rows), dtype=np.bool_)
    for breach in breaches(shared.scenario, columns, len(rows), shared.attributes):
        outside |= breach.outside
    if outside.any() and files.odd.spec.outside == "refuse":
        at = int(np.argmax(outside))
        raise _refusal(
            section,
            shared,
            {name: float(np.broadcast_to(value, len(rows))[at]) for name, value in columns.items()},
        )
    return CaseColumns(
        section=section,
        shared=shared,
        first=section.first + low,
        rows=rows,
        points=point - start,
        replicate=replicate.tolist(),
        is_inside=~outside,
    )


def _refusal(section: Section, shared: Shared, parameters: Mapping[str, float]) -> SweepError:
    """Say which attribute one point leaves: it alone is evaluated."""
    first = breaches(shared.scenario, parameters, 1, shared.attributes)[0]
    return SweepError(
        f"{section.group.use.name}: {first.text}",
        where=section.group.where,
        remedy="Narrow the sweep, widen the ODD, or set `outside: robustness`.",
    )
