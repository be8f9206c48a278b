"""Check what a plan would simulate before anything runs: formulas, onsets, values, plug-ins."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from adeye.campaign.parts import load_parts
from adeye.errors import ExpressionError, InputError, SourceLocation, SpecError, suggest
from adeye.spec.expression import to_program
from adeye.spec.quantity import require_dimension
from adeye.sweep.structure import batches
from adeye.units import Dimension
from adeye.world.check import check_scenario
from adeye.world.compile import compile_world
from adeye.world.triggers import trigger_variables

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from adeye.spec.fault import Fault
    from adeye.spec.load import Loaded, OddFiles
    from adeye.spec.odd import ScenarioUse
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.case import TestCase

BATCH = 1_024


def check_scenarios(files: OddFiles) -> None:
    """Check the formulas and references of every scenario.

    Raises:
        SpecError: The first that is wrong, with its place.
    """
    for item in files.scenarios.values():
        for loc, message in check_scenario(item.spec):
            raise SpecError(message, where=item.locate(loc))


def check_onsets(files: OddFiles) -> None:
    """Check the onset conditions of the faults against the scenarios that they occur in.

    Raises:
        SpecError: A condition names what a scenario does not have, or cannot be computed.
    """
    for number, fault in enumerate(files.odd.spec.faults):
        where = files.odd.locate(("faults", number, "onset", "when"))
        for use in files.odd.spec.scenarios:
            if fault.id in _fault_ids(use, files):
                _check_onset(fault, files.scenarios[use.name].spec, use.name, where)


def check_cases(files: OddFiles, cases: Sequence[TestCase]) -> None:
    """Check what a sweep makes of the files: every variant and every value of the worlds.

    Args:
        files: The ODD and everything it names.
        cases: The test cases of the plan.

    Raises:
        SpecError: A variant of a scenario or of a plug-in's parameters is not valid, an onset
            condition is not, or a value is not possible.
    """
    sweeps = {
        use.name: files.odd.locate(("scenarios", number, "sweep"))
        for number, use in enumerate(files.odd.spec.scenarios)
    }
    for case in _first_of_each(cases, lambda item: (id(item.scenario), item.faults)):
        _check_variant(files, case, sweeps[case.scenario_id])
    for case in _first_of_each(cases, lambda item: id(item.architecture)):
        loaded = files.architectures[case.architecture.architecture]
        if case.architecture is not loaded.spec:
            _check_parts(loaded, case, sweeps[case.scenario_id])
    worlds = _first_of_each(cases, lambda item: (item.situation_digest, item.architecture.vehicle))
    for batch in batches(worlds, BATCH):
        _check_worlds(files.scenarios[batch[0].scenario_id], batch)


def _fault_ids(use: ScenarioUse, files: OddFiles) -> set[str]:
    if use.faults is None:
        return {fault.id for fault in files.odd.spec.faults}
    return {
        name for entry in use.faults for name in ((entry,) if isinstance(entry, str) else entry)
    }


def _check_onset(fault: Fault, scenario: LogicalScenario, name: str, where: SourceLocation) -> None:
    condition = fault.onset.when
    if condition is None:
        return
    known = trigger_variables(scenario)
    for variable in sorted(condition.names - known.keys()):
        raise SpecError(
            f"fault {fault.id}: scenario {name} has nothing named {variable!r}",
            where=where,
            remedy=suggest(variable, known),
        )
    try:
        require_dimension(condition, Dimension.NONE, dict(known))
        to_program(condition, {variable: at for at, variable in enumerate(known)})
    except ExpressionError as error:
        raise SpecError(
            f"fault {fault.id}: {error.message}", where=where, remedy=error.remedy
        ) from error


def _first_of_each(cases: Sequence[TestCase], key: Any) -> Iterator[TestCase]:
    seen: set[Any] = set()
    for case in cases:
        own = key(case)
        if own not in seen:
            seen.add(own)
            yield case


def _check_variant(files: OddFiles, case: TestCase, where: SourceLocation) -> None:
    if case.scenario is not files.scenarios[case.scenario_id].spec:
        for loc, message in check_scenario(case.scenario):
            raise SpecError(
                f"with the swept values, {'.'.join(map(str, loc))}: {message}", where=where
            )
    planned = {fault.id: fault for fault in files.odd.spec.faults}
    for fault in case.faults:
        if fault is not planned[fault.id]:
            _check_onset(fault, case.scenario, case.scenario_id, where)


def _check_parts(loaded: Loaded[Any], case: TestCase, where: SourceLocation) -> None:
    try:
        load_parts(replace(loaded, spec=case.architecture))
    except InputError as error:
        raise SpecError(
            f"with the swept values, {error.message}", where=where, remedy=error.remedy
        ) from error


def _check_worlds(loaded: Loaded[LogicalScenario], batch: Sequence[TestCase]) -> None:
    """Compute the initial worlds; a message begins with the dotted path of its formula."""
    try:
        compile_world(batch)
    except InputError as error:
        path = tuple(error.message.split(":")[0].split("."))
        where = error.where or loaded.locate(path)
        raise SpecError(error.message, where=where, remedy=error.remedy) from error
