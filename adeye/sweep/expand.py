"""Expand an ODD into test cases: counted first, made lazily, grouped by structure.

The templates of JSON are those of ``case``, so that a column holds what a ``TestCase`` would say.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, overload

import numpy as np

from adeye.errors import (
    ExpressionError,
    InputError,
    SourceLocation,
    SweepError,
    Together,
    placed,
    suggest,
)
from adeye.identity import JsonRows, digests, stream_seeds
from adeye.spec.quantity import require_dimension
from adeye.sweep import groups
from adeye.sweep.axes import Axis, AxisReader, Variants, default_values
from adeye.sweep.boundary import breaches
from adeye.sweep.case import Shared, TestCase, case_json, situation_json
from adeye.sweep.covering import covering
from adeye.sweep.design import Points, Relation, Space, full_factorial, zipped
from adeye.sweep.sampling import filling_points, random_points
from adeye.sweep.values import quantity_or_text
from adeye.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from adeye.spec.architecture import Architecture
    from adeye.spec.load import OddFiles
    from adeye.spec.odd import Axis as AxisSpec
    from adeye.spec.odd import ScenarioUse, Sweep
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.sampling import FillingKind

# --- Consecutive test cases as columns: identities and JSON without a record for each of them -----


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

    section: groups.Section
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
    files: OddFiles, section: groups.Section, shared: Shared, low: int, high: int
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


def _refusal(
    section: groups.Section, shared: Shared, parameters: Mapping[str, float]
) -> SweepError:
    """Say which attribute one point leaves: it alone is evaluated."""
    first = breaches(shared.scenario, parameters, 1, shared.attributes)[0]
    return SweepError(
        f"{section.group.use.name}: {first.text}",
        where=section.group.where,
        remedy="Narrow the sweep, widen the ODD, or set `outside: robustness`.",
    )


# --- The points of one scenario of an ODD: its axes, its relations and its design -----------------


def read_points(
    files: OddFiles, number: int, refused: Mapping[str, InputError] = MappingProxyType({})
) -> tuple[tuple[Axis, ...], Points]:
    """Read the sweep of a scenario and find its feasible points.

    Args:
        files: The ODD and everything it names.
        number: Of the scenario in the ODD.
        refused: Places at which it cannot start, and why.

    Returns:
        The axes and the points of the design.

    Raises:
        SweepError: An axis or a relation is not acceptable, or no point is feasible.
    """
    use = files.odd.spec.scenarios[number]
    reader = AxisReader(files, use.name, files.scenarios[use.name], refused)
    axes: tuple[Axis, ...] = ()
    fixed = default_values(files.scenarios[use.name].spec)
    together = Together()
    with together:
        axes = _axes(files, number, reader)
    for name, text in use.parameters.items():
        at = files.odd.locate(("scenarios", number, "parameters", name))
        with together:
            axis = reader.read(name, (text,), at)
            _refuse_varied(axis, axes)
            if axis.kind == "parameter":
                fixed[name] = float(axis.values[0])
    together.finish()
    relations = _relations(files, number, axes)
    where = files.odd.locate(("scenarios", number, "sweep"))
    return axes, _designed(files, use, Space(axes, relations, fixed, where))


def _refuse_varied(fixed: Axis, axes: Sequence[Axis]) -> None:
    """Refuse what a use fixes and varies, or fixes a part of what it varies, and the reverse."""
    for axis in axes:
        one, other = fixed.name.split("."), axis.name.split(".")
        length = min(len(one), len(other))
        if one[:length] == other[:length]:
            raise SweepError(
                f"{fixed.name} is fixed for this use, and {axis.name} is swept at {axis.where}",
                where=fixed.where,
                remedy="Remove one of them.",
            )


def _designed(files: OddFiles, use: ScenarioUse, space: Space) -> Points:
    sweep = use.sweep
    if sweep.design in {"pairwise", "t_wise"}:
        return covering(space, sweep.strength or 2)
    if sweep.samples is not None:
        _check_samples(files, sweep.samples, space.where)
        seed = files.odd.spec.seed
        if sweep.design == "random":
            return random_points(space, sweep.samples, seed, use.name)
        kind: FillingKind = "lhs" if sweep.design == "lhs" else "sobol"
        return filling_points(space, kind, sweep.samples, seed, use.name)
    combine = full_factorial if sweep.design == "full_factorial" else zipped
    return combine(space)


def _axes(files: OddFiles, number: int, reader: AxisReader) -> tuple[Axis, ...]:
    sweep = files.odd.spec.scenarios[number].sweep
    at: tuple[str | int, ...] = ("parameters",)
    written: Mapping[str, AxisSpec] = sweep.parameters
    if sweep.design == "list":
        at = ("points", 0)
        names = _listed(files, number, sweep)
        written = {name: tuple(point[name] for point in sweep.points) for name in names}
    distinct = sweep.design not in {"list", "zip"}
    axes: list[Axis] = []
    together = Together()
    for name, spec in written.items():
        where = files.odd.locate(("scenarios", number, "sweep", *at, name))
        with together:
            axes.append(reader.read(name, spec, where, distinct=distinct))
    together.finish()
    return tuple(axes)


def _listed(files: OddFiles, number: int, sweep: Sweep) -> tuple[str, ...]:
    """Return the names that every point of a list has."""
    names = tuple(dict.fromkeys(name for point in sweep.points for name in point))
    for at, point in enumerate(sweep.points):
        missing = [name for name in names if name not in point]
        if missing:
            raise SweepError(
                f"point {at + 1} has no {', '.join(missing)}",
                where=files.odd.locate(("scenarios", number, "sweep", "points", at)),
                remedy="Every point of a list names the same parameters.",
            )
    return names


def _relations(files: OddFiles, number: int, axes: Sequence[Axis]) -> list[Relation]:
    use = files.odd.spec.scenarios[number]
    scenario = files.scenarios[use.name]
    relations = [
        Relation(item, files.odd.locate(("scenarios", number, "sweep", "where", at)))
        for at, item in enumerate(use.sweep.where)
    ]
    relations += [
        Relation(item, scenario.locate(("constraints", at)))
        for at, item in enumerate(scenario.spec.constraints)
    ]
    known: dict[str, Dimension | None] = {axis.name: _dimension(axis) for axis in axes}
    for name, parameter in scenario.spec.parameters.items():
        known[name] = quantity_or_text(parameter.default)[1]
    for relation in relations:
        _check_relation(relation, known)
    return relations


def _check_relation(relation: Relation, known: Mapping[str, Dimension | None]) -> None:
    for name in sorted(relation.expression.names - known.keys()):
        raise SweepError(
            f"'{relation.expression.text}' names {name!r}, which the sweep does not have",
            where=relation.where,
            remedy=suggest(name, sorted(known)),
        )
    with placed(relation.where, caught=ExpressionError, raised=SweepError):
        require_dimension(relation.expression, Dimension.NONE, known)


def _dimension(axis: Axis) -> Dimension | None:
    """Tell what an axis by path measures; None for text."""
    found = {quantity_or_text(text)[1] for text in axis.texts}
    return found.pop() if len(found) == 1 else None


def _check_samples(files: OddFiles, samples: int, where: SourceLocation) -> None:
    limit = files.odd.spec.max_test_cases
    if samples > limit:
        raise SweepError(
            f"{samples:,} samples are above the limit of {limit:,} test cases",
            where=where,
            remedy="Draw fewer, or raise max_test_cases in the ODD.",
        )


# --- Expand an ODD into test cases: counted first, made lazily, grouped by structure --------------

CHUNK: Final = 1_024
"""Test cases that are made together."""


@dataclass(frozen=True)
class Factor:
    """How the test cases of one scenario and architecture are counted.

    Attributes:
        scenario: Id of the scenario in the ODD.
        architecture: Id of the architecture.
        raw: Combinations before constraints.
        points: Feasible points, without axes that the architecture does not have.
        fault_entries: Entries that fit the architecture, ``none`` first.
        replicates: Number of replicates.
        test_cases: How many test cases this makes.
    """

    scenario: str
    architecture: str
    raw: int
    points: int
    fault_entries: tuple[str, ...]
    replicates: int
    test_cases: int


@dataclass(frozen=True)
class Expansion:
    """The counted plan of an ODD; test cases are made as they are asked for.

    Attributes:
        files: The ODD and everything it names.
        factors: How the test cases are counted.
        axes: Swept names by scenario.
        points: Points of the design by scenario.
        sections: Its test cases in order, those together that share one variant of each file.
    """

    files: OddFiles
    factors: tuple[Factor, ...]
    axes: Mapping[str, tuple[str, ...]]
    points: Mapping[str, Points]
    sections: tuple[groups.Section, ...]
    _variants: Variants

    @property
    def count(self) -> int:
        """Number of test cases."""
        return sum(factor.test_cases for factor in self.factors)

    def cases(self, start: int = 0, stop: int | None = None) -> Iterator[TestCase]:
        """Make the test cases of an ordinal range, by default all, in the order of the plan.

        Args:
            start: First ordinal.
            stop: Ordinal behind the last.

        Raises:
            SweepError: A point is outside the ODD and the ODD refuses such, or a value that the
                sweep writes into a file is not valid there.
        """
        for columns in self.columns(start, stop):
            yield from columns.cases()

    def columns(
        self, start: int = 0, stop: int | None = None, size: int = CHUNK
    ) -> Iterator[CaseColumns]:
        """Make the test cases of an ordinal range as columns; those before cost nothing.

        Args:
            start: First ordinal.
            stop: Ordinal behind the last.
            size: Most test cases at once.

        Raises:
            SweepError: As for ``cases``.
        """
        end = self.count if stop is None else min(stop, self.count)
        for section, low, high in groups.overlapping(self.sections, start, end):
            shared = self.shared(section)
            for first in range(low, high, size):
                yield columns_of(self.files, section, shared, first, min(first + size, high))

    def played(self) -> list[tuple[str, LogicalScenario, bool]]:
        """List the scenarios as they are executed, and whether that is inside the ODD.

        What differs in neither length nor lanes is listed once.
        """
        found: dict[object, tuple[str, LogicalScenario, bool]] = {}
        for section in self.sections:
            shared = self.shared(section)
            spec, ways = shared.scenario, {True}
            if self.files.odd.spec.outside == "robustness":
                columns = columns_of(self.files, section, shared, 0, len(section))
                ways = set(columns.is_inside.tolist())
            for is_inside in ways:
                key = shared.scenario_id, spec.horizon, spec.tail, spec.world.road.lanes, is_inside
                found.setdefault(key, (shared.scenario_id, spec, is_inside))
        return list(found.values())

    def shared(self, section: groups.Section) -> Shared:
        """Apply what the sweep writes into the files of a section.

        Raises:
            SweepError: A value is not valid where the sweep writes it.
        """
        return groups.shared_of(self.files, section, self._variants)


def expand(
    files: OddFiles, refused: Mapping[str, Mapping[str, InputError]] | None = None
) -> Expansion:
    """Count the test cases of an ODD and prepare their expansion.

    Args:
        files: The ODD and everything it names.
        refused: By scenario the places at which it cannot start, and why.

    Raises:
        SweepError: An axis, a relation or the number of test cases is not acceptable.
    """
    odd = files.odd.spec
    every: list[groups.Group] = []
    factors: list[Factor] = []
    axes: dict[str, tuple[str, ...]] = {}
    designed: dict[str, Points] = {}
    together = Together()
    for number, use in enumerate(odd.scenarios):
        with together:
            read, points = read_points(files, number, (refused or {}).get(use.name, {}))
            axes[use.name] = tuple(axis.name for axis in read)
            designed[use.name] = points
            first = len(every)
            for architecture in files.architectures.values():
                made = groups.groups_of(files, number, architecture, read, points)
                every += made
                cases = sum(len(group.rows) for group in made) * odd.replicates
                entries = tuple(group.entry for group in made)
                factors.append(
                    Factor(
                        use.name,
                        architecture.spec.architecture,
                        points.raw,
                        len(made[0].rows),
                        entries,
                        odd.replicates,
                        cases,
                    )
                )
            _require_injected(files, number, read, every[first:])
    together.finish()
    sections = groups.sections_of(every, odd.replicates)
    expansion = Expansion(files, tuple(factors), axes, designed, sections, Variants())
    _check_limit(expansion)
    groups.check_clock(files, odd.step)
    return expansion


def _require_injected(
    files: OddFiles, number: int, axes: Sequence[Axis], made: Sequence[groups.Group]
) -> None:
    """Refuse what a use varies or fixes of a fault that none of its test cases has."""
    use = files.odd.spec.scenarios[number]
    reader = AxisReader(files, use.name, files.scenarios[use.name])
    written = [(axis.name, axis.kind, axis.path, axis.where) for axis in axes]
    for name in use.parameters:
        where = files.odd.locate(("scenarios", number, "parameters", name))
        written.append((name, *reader.resolve(name, where), where))
    injected = {files.odd.spec.faults[fault].id for group in made for fault in group.faults}
    for name, kind, path, where in written:
        if kind == "faults" and path[0] not in injected:
            raise SweepError(
                f"{name}: no test case of scenario {use.name} has fault {path[0]}, so that this "
                "changes no run",
                where=where,
                remedy=f"Name {path[0]} in `faults` of the scenario, or remove this.",
            )


def _check_limit(expansion: Expansion) -> None:
    odd = expansion.files.odd
    if expansion.count > odd.spec.max_test_cases:
        worst = max(expansion.factors, key=lambda factor: factor.test_cases)
        raise SweepError(
            f"the plan has {expansion.count:,} test cases, above the limit of "
            f"{odd.spec.max_test_cases:,}; most are in {worst.scenario} with "
            f"{worst.architecture} ({worst.test_cases:,})",
            where=odd.locate(("scenarios",)),
            remedy="Narrow the sweeps, or raise max_test_cases in the ODD.",
        )


# --- The test cases of a plan as a sequence that makes them when they are asked for ---------------

KEPT_CHUNKS: Final = 4
"""Chunks of test cases that are kept: a block touches two, and the next begins where it ends."""


class LazyCases(Sequence["TestCase"]):
    """Test cases by ordinal; a chunk around what is asked for is made at once and kept a while.

    Asking twice may give two records, which are equal.
    """

    def __init__(self, expansion: Expansion) -> None:
        """Make nothing yet."""
        self._expansion = expansion
        self._kept: OrderedDict[int, list[TestCase]] = OrderedDict()

    def __len__(self) -> int:
        """Count the test cases, without making any."""
        return self._expansion.count

    @overload
    def __getitem__(self, index: int) -> TestCase: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[TestCase]: ...

    def __getitem__(self, index: int | slice) -> TestCase | Sequence[TestCase]:
        """Make one test case, or those of a slice.

        Raises:
            IndexError: There is no test case of this ordinal.
        """
        if isinstance(index, slice):
            return [self._at(ordinal) for ordinal in range(*index.indices(len(self)))]
        ordinal = index + len(self) if index < 0 else index
        if not 0 <= ordinal < len(self):
            raise IndexError(f"test case {index} of {len(self)}")
        return self._at(ordinal)

    def __iter__(self) -> Iterator[TestCase]:
        """Make one chunk after the other, and keep none."""
        return self._expansion.cases()

    def _at(self, ordinal: int) -> TestCase:
        number, place = divmod(ordinal, CHUNK)
        if number in self._kept:
            self._kept.move_to_end(number)
        else:
            first = number * CHUNK
            self._kept[number] = list(self._expansion.cases(first, first + CHUNK))
            if len(self._kept) > KEPT_CHUNKS:
                self._kept.popitem(last=False)
        return self._kept[number][place]
