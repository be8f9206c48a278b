"""What the test cases of a section share: scenario, architecture and faults, overrides applied."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from adeye.errors import SpecError, SweepError
from adeye.sweep.axes import AxisReader, default_values
from adeye.sweep.clock import check_rates, check_times, guilty_path
from adeye.sweep.groups import varies
from adeye.sweep.overrides import Change

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault
    from adeye.spec.load import OddFiles
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.groups import Group
    from adeye.sweep.overrides import Variants
    from adeye.sweep.sections import Section

Changes = dict[str, tuple[Change, ...]]


@dataclass(frozen=True)
class Shared:
    """What many test cases have in common; see ``TestCase`` for the words.

    Attributes:
        scenario_id: Id of the scenario in its ODD.
        scenario: With overrides by dotted path applied.
        parameters: Resolved scenario parameters in SI, of those that vary the default.
        architecture: With overrides by dotted path applied.
        faults: The faults of the entry.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        seed: Seed of the ODD.
        step: Master clock [s].
        attributes: The ODD's attributes.
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


def _changes(group: Group, row: int, base: Changes) -> Changes:
    changes = {kind: list(items) for kind, items in base.items()}
    for axis in group.axes:
        if axis.kind != "parameter":
            text = axis.texts[int(group.points.levels[axis.name][row])]
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
