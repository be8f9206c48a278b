"""Expand an ODD into test cases: counted first, made lazily, grouped by structure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.errors import SourceLocation, SpecError, SweepError
from adeye.spec.clock import period_ticks, ticks
from adeye.sweep.axes import Axis, AxisReader, default_values, quantity_or_text
from adeye.sweep.boundary import breaches
from adeye.sweep.case import TestCase
from adeye.sweep.design import Points, RandomDesign, Relation, full_factorial, zipped
from adeye.sweep.groups import Group, groups_of, varies
from adeye.sweep.overrides import Change, Variants

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault
    from adeye.spec.load import OddFiles
    from adeye.spec.odd import ScenarioUse
    from adeye.spec.scenario import LogicalScenario


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
    """

    files: OddFiles
    factors: tuple[Factor, ...]
    axes: Mapping[str, tuple[str, ...]]
    _groups: tuple[Group, ...]
    _variants: Variants

    @property
    def count(self) -> int:
        """Number of test cases."""
        return sum(factor.test_cases for factor in self.factors)

    def cases(self) -> Iterator[TestCase]:
        """Make the test cases in the order of the plan.

        Raises:
            SweepError: A point is outside the ODD and the ODD refuses such, or a value that the
                sweep writes into a file is not valid there.
        """
        for group in self._groups:
            yield from _cases(self.files, group, self._variants)


def expand(files: OddFiles) -> Expansion:
    """Count the test cases of an ODD and prepare their expansion.

    Args:
        files: The ODD and everything it names.

    Raises:
        SweepError: An axis, a relation or the number of test cases is not acceptable.
    """
    odd = files.odd.spec
    groups: list[Group] = []
    factors: list[Factor] = []
    axes: dict[str, tuple[str, ...]] = {}
    for number, use in enumerate(odd.scenarios):
        read, points = _points(files, number, use)
        axes[use.name] = tuple(axis.name for axis in read)
        for architecture in files.architectures.values():
            made = groups_of(files, number, architecture, read, points)
            groups += made
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
    expansion = Expansion(files, tuple(factors), axes, tuple(groups), Variants())
    _check_limit(expansion)
    _check_clock(files)
    return expansion


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


def _check_clock(files: OddFiles) -> None:
    step = files.odd.spec.step
    for loaded in files.architectures.values():
        try:
            check_rates(loaded.spec, step)
        except SpecError as error:
            part = tuple(error.message.split(":")[0].split("."))
            raise SpecError(
                error.message, where=loaded.locate(part), remedy=error.remedy
            ) from error


def check_rates(architecture: Architecture, step: float) -> None:
    """Check that every rate and delay of an architecture fits the master clock.

    Raises:
        SpecError: One does not; the message begins with its dotted path.
    """
    for name, sensor in architecture.sensors.items():
        period_ticks(sensor.rate, step, f"sensors.{name}.rate")
        ticks(sensor.latency, step, f"sensors.{name}.latency")
    for name, channel in architecture.channels.items():
        period_ticks(channel.rate, step, f"channels.{name}.rate")
        ticks(channel.delay, step, f"channels.{name}.delay")


def _points(files: OddFiles, number: int, use: ScenarioUse) -> tuple[tuple[Axis, ...], Points]:
    odd = files.odd
    scenario = files.scenarios[use.name]
    base = ("scenarios", number, "sweep")
    where = odd.locate(base)
    reader = AxisReader(files, use.name, scenario)
    sweep = use.sweep
    relations = [
        Relation(item, odd.locate((*base, "where", k))) for k, item in enumerate(sweep.where)
    ]
    relations += [
        Relation(item, scenario.locate(("constraints", k)))
        for k, item in enumerate(scenario.spec.constraints)
    ]
    fixed = default_values(scenario.spec)
    for name, text in use.parameters.items():
        at = odd.locate(("scenarios", number, "parameters", name))
        axis = reader.read(name, (text,), at)
        if axis.kind == "parameter":
            fixed[name] = float(axis.values[0])
    if sweep.design == "list":
        names = dict.fromkeys(name for point in sweep.points for name in point)
        for k, point in enumerate(sweep.points):
            if set(point) != set(names):
                missing = ", ".join(sorted(set(names) - set(point)))
                raise SweepError(
                    f"point {k + 1} has no {missing}",
                    where=odd.locate((*base, "points", k)),
                    remedy="Every point of a list names the same parameters.",
                )
        axes = tuple(
            reader.read(
                name,
                tuple(point[name] for point in sweep.points),
                odd.locate((*base, "points", 0, name)),
                distinct=False,
            )
            for name in names
        )
        return axes, zipped(axes, relations, fixed, where)
    axes = tuple(
        reader.read(
            name,
            spec,
            odd.locate((*base, "parameters", name)),
            distinct=sweep.design != "zip",
        )
        for name, spec in sweep.parameters.items()
    )
    if sweep.design == "zip":
        return axes, zipped(axes, relations, fixed, where)
    if sweep.design == "random":
        assert sweep.samples is not None
        _check_limit_of_samples(files, sweep.samples, where)
        design = RandomDesign(sweep.samples, odd.spec.seed, use.name)
        return axes, design.draw(axes, relations, fixed, where)
    return axes, full_factorial(axes, relations, fixed, where)


def _check_limit_of_samples(files: OddFiles, samples: int, where: SourceLocation) -> None:
    limit = files.odd.spec.max_test_cases
    if samples > limit:
        raise SweepError(
            f"{samples:,} samples are above the limit of {limit:,} test cases",
            where=where,
            remedy="Draw fewer, or raise max_test_cases in the ODD.",
        )


def _cases(files: OddFiles, group: Group, variants: Variants) -> Iterator[TestCase]:
    odd = files.odd.spec
    base, fixed = _fixed(files, group)
    defaults = {**default_values(group.scenario.spec), **fixed}
    seen_outside: dict[int, NDArray[np.bool_]] = {}
    for row in group.rows:
        changes = _changes(group, int(row), base)
        scenario = variants.of(group.scenario, changes["scenario"], group.where)
        architecture = variants.of(group.architecture, changes["architecture"], group.where)
        if changes["architecture"]:
            check_rates(architecture, odd.step)
        parameters = dict(defaults)
        for axis in group.axes:
            if axis.kind == "parameter":
                parameters[axis.name] = float(group.points.columns[axis.name][row])
        if id(scenario) not in seen_outside:
            seen_outside[id(scenario)] = _outside(files, group, scenario, defaults)
        faults = tuple(_fault(files, k, changes, variants, group.where) for k in group.faults)
        point = {axis.name: _plain(group.points.columns[axis.name][row]) for axis in group.axes}
        for replicate in range(odd.replicates):
            yield TestCase(
                scenario_id=group.use.name,
                scenario=scenario,
                parameters=parameters,
                architecture=architecture,
                faults=faults,
                fault_entry=group.entry,
                replicate=replicate,
                seed=odd.seed,
                step=odd.step,
                point=point,
                inside_odd=not bool(seen_outside[id(scenario)][row]),
                attributes=odd.attributes,
            )


Changes = dict[str, tuple[Change, ...]]


def _fixed(files: OddFiles, group: Group) -> tuple[Changes, dict[str, float]]:
    reader = AxisReader(files, group.use.name, group.scenario)
    changes: dict[str, list[Change]] = {"scenario": [], "architecture": [], "faults": []}
    values: dict[str, float] = {}
    for name, text in group.use.parameters.items():
        axis = reader.read(name, (text,), group.where)
        if axis.kind == "parameter":
            values[name] = float(axis.values[0])
        elif varies(axis, group.architecture.spec, tuple(group.entry.split("+"))):
            changes[axis.kind].append((axis.path, text))
    return {kind: tuple(items) for kind, items in changes.items()}, values


def _changes(group: Group, row: int, base: Changes) -> Changes:
    changes = {kind: list(items) for kind, items in base.items()}
    for axis in group.axes:
        if axis.kind != "parameter":
            text = str(group.points.texts[axis.name][row])
            value, dimension = quantity_or_text(text)
            plain = dimension is not None and dimension.label == "a plain number"
            changes[axis.kind].append((axis.path, float(value) if plain else text))
    return {kind: tuple(items) for kind, items in changes.items()}


def _fault(
    files: OddFiles, number: int, changes: Changes, variants: Variants, where: SourceLocation
) -> Fault:
    fault = files.odd.spec.faults[number]
    own = tuple((path[1:], value) for path, value in changes["faults"] if path[0] == fault.id)
    return variants.fault(fault, files.odd.content["faults"][number], own, where)


def _outside(
    files: OddFiles, group: Group, scenario: LogicalScenario, defaults: Mapping[str, float]
) -> NDArray[np.bool_]:
    count = group.points.count
    columns: dict[str, Any] = dict(defaults)
    for axis in group.axes:
        if axis.kind == "parameter":
            columns[axis.name] = group.points.columns[axis.name]
    outside = np.zeros(count, dtype=bool)
    for breach in breaches(scenario, columns, count, files.odd.spec.attributes):
        if files.odd.spec.outside == "refuse":
            raise SweepError(
                f"{group.use.name}: {breach.text}",
                where=group.where,
                remedy="Narrow the sweep, widen the ODD, or set `outside: robustness`.",
            )
        outside |= breach.outside
    return outside


def _plain(value: Any) -> float | str:
    return str(value) if isinstance(value, str | np.str_) else float(value)
