"""Groups of a plan: the points of one scenario, architecture and fault entry."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.errors import InputError, SourceLocation, SpecError, SweepError
from adeye.signals import NO_FAULT
from adeye.simulate.world.clock import period_ticks, ticks
from adeye.spec.architecture import targets_of
from adeye.sweep.axes import Axis, AxisReader, Change, default_values, has_path
from adeye.sweep.case import Shared

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault
    from adeye.spec.load import Loaded, OddFiles
    from adeye.spec.odd import ScenarioUse
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.axes import Variants
    from adeye.sweep.design import Points

# --- Groups of a plan: the points of one scenario, architecture and fault entry -------------------


@dataclass(frozen=True)
class Group:
    """Points of one scenario, architecture and fault entry.

    Attributes:
        use: The scenario's place in the ODD.
        scenario: Its file.
        architecture: The architecture's file.
        faults: Indices of the entry's faults in the ODD.
        entry: ``none``, or the ids of its faults joined by ``+``.
        axes: Those that vary something here.
        points: The points of the design.
        rows: Which of them differ in these axes.
        where: Place of the sweep, for messages.
    """

    use: ScenarioUse
    scenario: Loaded[LogicalScenario]
    architecture: Loaded[Architecture]
    faults: tuple[int, ...]
    entry: str
    axes: tuple[Axis, ...]
    points: Points
    rows: NDArray[np.int64]
    where: SourceLocation


def groups_of(
    files: OddFiles,
    number: int,
    architecture: Loaded[Architecture],
    axes: tuple[Axis, ...],
    points: Points,
) -> list[Group]:
    """Combine the points of a scenario with the fault entries that an architecture can have.

    Args:
        files: The ODD and everything it names.
        number: Of the scenario in the ODD.
        architecture: Its file.
        axes: Of the scenario's sweep.
        points: Of its design.

    Returns:
        One group per fault entry, ``none`` first; an entry with a fault whose target the
        architecture does not have is left out, as is an axis that varies nothing in it.

    Raises:
        SweepError: No architecture has the target of a fault that is used.
    """
    use = files.odd.spec.scenarios[number]
    where = files.odd.locate(("scenarios", number, "sweep"))
    groups: list[Group] = []
    for ids in _entries(files, use):
        faults = tuple(k for k, fault in enumerate(files.odd.spec.faults) if fault.id in ids)
        targets = [files.odd.spec.faults[k].target for k in faults]
        if not set(targets) <= set(targets_of(architecture.spec)):
            continue
        varied = tuple(axis for axis in axes if varies(axis, architecture.spec, ids))
        groups.append(
            Group(
                use,
                files.scenarios[use.name],
                architecture,
                faults,
                "+".join(ids) or NO_FAULT,
                varied,
                points,
                points.distinct(tuple(axis.name for axis in varied)),
                where,
            )
        )
    return groups


def varies(axis: Axis, architecture: Architecture, faults: tuple[str, ...]) -> bool:
    """Tell whether an axis varies anything in an architecture with some faults."""
    if axis.kind == "architecture":
        return has_path(architecture, axis.path)
    if axis.kind == "faults":
        return axis.path[0] in faults
    return True


def _entries(files: OddFiles, use: ScenarioUse) -> list[tuple[str, ...]]:
    """List the fault entries, each in the ODD's order, so that a pair is the same either way."""
    odd = files.odd
    order = [fault.id for fault in odd.spec.faults]
    written = order if use.faults is None else use.faults
    entries: list[tuple[str, ...]] = [()]
    for entry in written:
        names = {entry} if isinstance(entry, str) else set(entry)
        ids = tuple(name for name in order if name in names)
        if ids not in entries:
            entries.append(ids)
    for number, fault in enumerate(odd.spec.faults):
        if any(fault.id in ids for ids in entries) and fault.target not in _targets(files):
            raise SweepError(
                f"fault {fault.id}: no architecture has {fault.target}",
                where=odd.locate(("faults", number, "target")),
                remedy=f"There are: {', '.join(_alike(fault.port, _targets(files)))}.",
            )
    return entries


def _targets(files: OddFiles) -> set[str]:
    return {target for item in files.architectures.values() for target in targets_of(item.spec)}


def _alike(port: str, targets: set[str]) -> list[str]:
    """List the targets of one kind, or all if there is none."""
    return sorted(name for name in targets if name.split(".")[0] == port) or sorted(targets)


# --- Sections of a plan: consecutive test cases that differ in parameter values and replicate
# only.


@dataclass(frozen=True, eq=False)
class Section:
    """Consecutive test cases with one scenario, one architecture and one set of faults.

    Overrides by dotted path are applied once for all of them; a batch never leaves a section
    without need, because its points follow each other in the plan.

    Attributes:
        group: Whose points these are.
        rows: Which points of the design.
        replicates: Test cases of each point.
        first: Ordinal of the first test case.
    """

    group: Group
    rows: NDArray[np.int64]
    replicates: int
    first: int

    def __len__(self) -> int:
        """Number of test cases."""
        return len(self.rows) * self.replicates

    @property
    def end(self) -> int:
        """Ordinal behind the last test case."""
        return self.first + len(self)


def sections_of(groups: Iterable[Group], replicates: int) -> tuple[Section, ...]:
    """Cut groups into sections, in the order of the plan.

    Points that what the sweep writes into files makes alike stand together, in the order of the
    first of them; the other axes vary inside a section as the design says.

    Args:
        groups: In the order of the plan.
        replicates: Test cases of each point.
    """
    sections: list[Section] = []
    first = 0
    for group in groups:
        for rows in _alike_sections(group):
            sections.append(Section(group, rows, replicates, first))
            first = sections[-1].end
    return tuple(sections)


def overlapping(
    sections: Sequence[Section], start: int, stop: int
) -> Iterator[tuple[Section, int, int]]:
    """Find what an ordinal range has of each section, without looking at those before.

    Args:
        sections: All of a plan.
        start: First ordinal.
        stop: Ordinal behind the last.

    Yields:
        A section, and the range counted from its first test case.
    """
    at = bisect_right(sections, start, key=lambda section: section.first) - 1
    while at < len(sections) and sections[at].first < stop:
        section = sections[at]
        low, high = max(start, section.first), min(stop, section.end)
        if low < high:
            yield section, low - section.first, high - section.first
        at += 1


def _alike_sections(group: Group) -> list[NDArray[np.int64]]:
    """Split the points of a group by what they write into files."""
    codes = np.zeros(len(group.rows), dtype=np.int64)
    for axis in group.axes:
        if axis.kind != "parameter":
            known: dict[tuple[type, object], int] = {}
            # 1 and 1.0 are written differently.
            same = [known.setdefault((type(text), text), len(known)) for text in axis.texts]
            levels = group.points.levels[axis.name][group.rows]
            _, codes = np.unique(
                codes * len(known) + np.array(same, dtype=np.int64)[levels], return_inverse=True
            )
    _, first, which = np.unique(codes, return_index=True, return_inverse=True)
    if len(first) == 1:
        return [group.rows]
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    own = rank[which]
    order = np.argsort(own, kind="stable")
    return np.split(group.rows[order], np.flatnonzero(np.diff(own[order])) + 1)


# --- Check times and rates of scenarios and architectures against the master clock ----------------


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
        ticks(sensor.jitter, step, f"sensors.{name}.jitter")
    for name, channel in architecture.channels.items():
        period_ticks(channel.rate, step, f"channels.{name}.rate")
        ticks(channel.delay, step, f"channels.{name}.delay")
    ticks(architecture.switch.handover, step, "switch.handover")


def check_clock(files: OddFiles, step: float) -> None:
    """Check that all times of an ODD's files fit a master clock.

    Raises:
        SpecError: One does not.
    """
    checked: tuple[tuple[Callable[[Any, float], None], Mapping[str, Loaded[Any]]], ...] = (
        (check_rates, files.architectures),
        (check_times, files.scenarios),
    )
    for check, loaded in checked:
        for item in loaded.values():
            try:
                check(item.spec, step)
            except SpecError as error:
                where = item.locate(guilty_path(error))
                raise SpecError(error.message, where=where, remedy=error.remedy) from error


def guilty_path(error: InputError) -> tuple[str, ...]:
    """Read the dotted path that the message of such an error begins with."""
    return tuple(error.message.split(":")[0].split("."))


# --- What the test cases of a section share: scenario, architecture and faults, overrides applied -

Changes = dict[str, tuple[Change, ...]]


def shared_of(files: OddFiles, section: Section, variants: Variants) -> Shared:
    """Apply what the sweep writes into files.

    Args:
        files: The ODD and everything it names.
        section: Whose test cases.
        variants: Records that were made before.

    Raises:
        SweepError: A value that the sweep writes into a file is not valid there.
    """
    group, odd = section.group, files.odd.spec
    base, fixed = _fixed(files, group)
    changes = _changes(group, int(section.rows[0]), base)
    scenario = variants.of(group.scenario, changes["scenario"])
    architecture = variants.of(group.architecture, changes["architecture"])
    _check_varied_clock(scenario, architecture, changes, odd.step)
    return Shared(
        scenario_id=group.use.name,
        scenario=scenario,
        parameters={**default_values(group.scenario.spec), **fixed},
        architecture=architecture,
        faults=tuple(_fault(files, number, changes, variants) for number in group.faults),
        fault_entry=group.entry,
        seed=odd.seed,
        step=odd.step,
        attributes=odd.attributes,
    )


def _fixed(files: OddFiles, group: Group) -> tuple[Changes, dict[str, float]]:
    reader = AxisReader(files, group.use.name, group.scenario)
    changes: Changes = {"scenario": (), "architecture": (), "faults": ()}
    values: dict[str, float] = {}
    number = files.odd.spec.scenarios.index(group.use)
    for name, text in group.use.parameters.items():
        where = files.odd.locate(("scenarios", number, "parameters", name))
        axis = reader.read(name, (text,), where)
        if axis.kind == "parameter":
            values[name] = float(axis.values[0])
        elif varies(axis, group.architecture.spec, tuple(group.entry.split("+"))):
            changes[axis.kind] += (Change(axis.path, axis.texts[0], where),)
    return changes, values


def _changes(group: Group, row: int, base: Changes) -> Changes:
    changes = dict(base)
    for axis in group.axes:
        if axis.kind != "parameter":
            text = axis.texts[int(group.points.levels[axis.name][row])]
            changes[axis.kind] += (Change(axis.path, text, axis.where),)
    return changes


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
        guilty = [change for change in changed if change.path == guilty_path(error)]
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
