"""Groups of a plan: the points of one scenario, architecture and fault entry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from adeye.errors import SourceLocation, SweepError
from adeye.spec.architecture import targets_of
from adeye.sweep.axes import Axis, has_path

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from adeye.spec.architecture import Architecture
    from adeye.spec.load import Loaded, OddFiles
    from adeye.spec.odd import ScenarioUse
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.design import Points

NO_FAULT = "none"
"""Name of the fault-free entry, the twin of every other."""


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
