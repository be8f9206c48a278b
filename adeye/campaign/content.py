"""Test cases as stored content and back: what makes a run reproducible from the database alone."""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import IntegrityError
from adeye.spec.architecture import Architecture
from adeye.spec.fault import FAULT
from adeye.spec.odd import Attributes
from adeye.spec.quantity import SI, Record
from adeye.spec.scenario import LogicalScenario
from adeye.store.content import FOLDER
from adeye.store.rows import ContentRecord
from adeye.sweep.case import AuthorityOverride, TestCase

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from adeye.store.stored import StoredCase

FOLDERS: Final = "plugin_folders"
"""Key of a campaign's provenance: folder of each architecture's file, which names its plug-ins.

Not in what is stored of the architecture: its digest would hang on where the files are.
"""


class Contents:
    """Makes one content record for each scenario or architecture record of a plan."""

    def __init__(self) -> None:
        self._made: dict[int, tuple[Record, ContentRecord]] = {}

    def scenario(self, scenario: LogicalScenario) -> ContentRecord:
        """Describe a scenario, overrides applied."""
        version = scenario.provenance.version
        return self._of(scenario, scenario.scenario, version)

    def architecture(self, architecture: Architecture) -> ContentRecord:
        """Describe an architecture, overrides applied."""
        return self._of(architecture, architecture.architecture, "")

    def _of(self, record: Record, name: str, version: str) -> ContentRecord:
        known = self._made.get(id(record))
        if known is None or known[0] is not record:
            known = (record, ContentRecord(name, version, record.model_dump(mode="json")))
            self._made[id(record)] = known
        return known[1]


def recreate(
    stored: StoredCase, scenario_id: str, odd: Mapping[str, Any], *, inside_odd: bool
) -> TestCase:
    """Make a test case from what the database holds.

    Args:
        stored: The test case.
        scenario_id: Id of the scenario in the ODD.
        odd: Stored content of the ODD.
        inside_odd: Whether its planned attributes lie inside the ODD.

    Raises:
        IntegrityError: What comes out has another digest than what went in.
    """
    architecture = {name: value for name, value in stored.architecture.items() if name != FOLDER}
    fork = stored.fork
    case = TestCase(
        scenario_id=scenario_id,
        scenario=LogicalScenario.model_validate(stored.scenario, context=SI),
        parameters=dict(stored.parameters),
        architecture=Architecture.model_validate(architecture, context=SI),
        faults=tuple(FAULT.validate_python(fault, context=SI) for fault in stored.faults),
        fault_entry=stored.fault_entry,
        replicate=stored.replicate,
        seed=stored.seed,
        step=stored.step_s,
        point={},
        inside_odd=inside_odd,
        attributes=Attributes.model_validate(odd["attributes"], context=SI),
        override=None if fork is None else AuthorityOverride(fork.from_tick, fork.authority),
    )
    if case.digest != stored.test_case:
        raise IntegrityError(
            f"test case {stored.test_case[:12]} does not come out of the database as it went in"
        )
    return case


def folder_of_plugins(
    stored: StoredCase, provenances: Iterable[Mapping[str, Any]], architecture: str
) -> Path:
    """Find the folder of the file that names the plug-ins of a test case.

    Args:
        stored: The test case; it tells where the folder was if an older release stored it.
        provenances: Where the campaign was planned and executed; the first folder counts that is
            there, else the first.
        architecture: Id of the architecture.
    """
    told = (item.get(FOLDERS, {}).get(architecture) for item in provenances)
    first: Path | None = None
    for name in chain((stored.architecture.get(FOLDER),), told):
        if name is not None:
            first = first or Path(name)
            if Path(name).is_dir():
                return Path(name)
    return first or Path()
