"""Expand an ODD into test cases: counted first, made lazily, grouped by structure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.errors import SpecError, SweepError
from adeye.spec.clock import period_ticks, ticks
from adeye.spec.scenario import Value
from adeye.sweep.axes import AxisReader, default_values
from adeye.sweep.boundary import Breach, breaches
from adeye.sweep.case import TestCase
from adeye.sweep.groups import Group, groups_of, varies
from adeye.sweep.overrides import Change, Variants
from adeye.sweep.points import read_points

if TYPE_CHECKING:
    from collections.abc import Iterator

    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault
    from adeye.spec.load import Loaded, OddFiles
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
        read, points = read_points(files, number)
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
    for architecture in files.architectures.values():
        try:
            check_rates(architecture.spec, step)
        except SpecError as error:
            raise _placed(error, architecture) from error
    for scenario in files.scenarios.values():
        try:
            check_times(scenario.spec, step)
        except SpecError as error:
            raise _placed(error, scenario) from error


def _placed(error: SpecError, loaded: Loaded[Any]) -> SpecError:
    """Find the place of an error whose message begins with a dotted path."""
    where = loaded.locate(_path(error))
    return SpecError(error.message, where=where, remedy=error.remedy)


def _path(error: SpecError) -> tuple[str, ...]:
    return tuple(error.message.split(":")[0].split("."))


def check_times(scenario: LogicalScenario, step: float) -> None:
    """Check that horizon and tail of a scenario fit the master clock.

    Raises:
        SpecError: One does not; the message begins with its name.
    """
    ticks(scenario.horizon, step, "horizon")
    ticks(scenario.tail, step, "tail")


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


def _cases(files: OddFiles, group: Group, variants: Variants) -> Iterator[TestCase]:
    odd = files.odd.spec
    base, fixed = _fixed(files, group)
    defaults = {**default_values(group.scenario.spec), **fixed}
    written = {axis.name: {str(text): text for text in axis.texts} for axis in group.axes}
    found: dict[int, list[Breach]] = {}
    for row in group.rows:
        changes = _changes(group, int(row), base, written)
        scenario = variants.of(group.scenario, changes["scenario"])
        architecture = variants.of(group.architecture, changes["architecture"])
        _check_varied_clock(scenario, architecture, changes, odd.step)
        parameters = dict(defaults)
        for axis in group.axes:
            if axis.kind == "parameter":
                parameters[axis.name] = float(group.points.columns[axis.name][row])
        if id(scenario) not in found:
            found[id(scenario)] = _breaches(files, group, scenario, defaults)
        is_outside = any(breach.outside[row] for breach in found[id(scenario)])
        if is_outside and odd.outside == "refuse":
            raise _outside(files, group, scenario, parameters)
        faults = tuple(_fault(files, k, changes, variants) for k in group.faults)
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
                inside_odd=not is_outside,
                attributes=odd.attributes,
            )


Changes = dict[str, tuple[Change, ...]]
Written = Mapping[str, Mapping[str, Value]]
"""By axis, the values as the user wrote them, numbers as numbers."""


def _fixed(files: OddFiles, group: Group) -> tuple[Changes, dict[str, float]]:
    reader = AxisReader(files, group.use.name, group.scenario)
    changes: dict[str, list[Change]] = {"scenario": [], "architecture": [], "faults": []}
    values: dict[str, float] = {}
    number = files.odd.spec.scenarios.index(group.use)
    for name, text in group.use.parameters.items():
        where = files.odd.locate(("scenarios", number, "parameters", name))
        axis = reader.read(name, (text,), where)
        if axis.kind == "parameter":
            values[name] = float(axis.values[0])
        elif varies(axis, group.architecture.spec, tuple(group.entry.split("+"))):
            changes[axis.kind].append(Change(axis.path, text, where))
    return {kind: tuple(items) for kind, items in changes.items()}, values


def _changes(group: Group, row: int, base: Changes, written: Written) -> Changes:
    changes = {kind: list(items) for kind, items in base.items()}
    for axis in group.axes:
        if axis.kind != "parameter":
            text = written[axis.name][str(group.points.texts[axis.name][row])]
            changes[axis.kind].append(Change(axis.path, text, axis.where))
    return {kind: tuple(items) for kind, items in changes.items()}


def _check_varied_clock(
    scenario: LogicalScenario, architecture: Architecture, changes: Changes, step: float
) -> None:
    """Check what a sweep changed against the master clock."""
    try:
        if changes["scenario"]:
            check_times(scenario, step)
        if changes["architecture"]:
            check_rates(architecture, step)
    except SpecError as error:
        changed = [*changes["scenario"], *changes["architecture"]]
        guilty = [change for change in changed if change.path == _path(error)]
        where = (guilty or changed)[-1].where
        raise SweepError(error.message, where=where, remedy=error.remedy) from error


def _fault(files: OddFiles, number: int, changes: Changes, variants: Variants) -> Fault:
    fault = files.odd.spec.faults[number]
    own = tuple(
        replace(change, path=change.path[1:])
        for change in changes["faults"]
        if change.path[0] == fault.id
    )
    return variants.fault(fault, files.odd.content["faults"][number], own)


def _breaches(
    files: OddFiles, group: Group, scenario: LogicalScenario, defaults: Mapping[str, float]
) -> list[Breach]:
    columns: dict[str, Any] = dict(defaults)
    for axis in group.axes:
        if axis.kind == "parameter":
            columns[axis.name] = group.points.columns[axis.name]
    return breaches(scenario, columns, group.points.count, files.odd.spec.attributes)


def _outside(
    files: OddFiles, group: Group, scenario: LogicalScenario, parameters: Mapping[str, float]
) -> SweepError:
    """Say which attribute one point leaves: it alone is evaluated."""
    first = breaches(scenario, parameters, 1, files.odd.spec.attributes)[0]
    return SweepError(
        f"{group.use.name}: {first.text}",
        where=group.where,
        remedy="Narrow the sweep, widen the ODD, or set `outside: robustness`.",
    )


def _plain(value: Any) -> float | str:
    return str(value) if isinstance(value, str | np.str_) else float(value)
