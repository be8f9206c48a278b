"""Keep drives of reference drivers beside the campaigns, and find them.

A drive is an ordinary test case: the situation of a run, driven by a reference driver. No row of
``campaign_case`` names it, so no count or verdict of a campaign sees it; only a gate that asks for
it does, through ``failures``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from adeye.errors import IntegrityError
from adeye.evaluation.preventability import BENCHMARK_VERSION, Cell, Comparison, cell_of
from adeye.store import tables
from adeye.store.content import save_content
from adeye.store.encoding import insert_rows, row
from adeye.store.pending import JUDGED
from adeye.store.reading import run_ref
from adeye.store.recording import record_runs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sqlalchemy import Connection

    from adeye.store.block import RunBlock
    from adeye.store.database import Database
    from adeye.store.rows import ContentRecord
    from adeye.store.stored import RunRef

_COMPARED = """
SELECT c.campaign_id, c.ordinal, c.scenario, c.architecture, t.fault_entry, b.result_digest AS run,
    b.model, b.edition, b.drive_digest AS drive,
    m.contact, m.contact_status, r.realised, m.impact_speed_mps,
    n.contact AS drive_contact, n.contact_status AS drive_contact_status,
    d.realised AS drive_realised, n.impact_speed_mps AS drive_impact_speed_mps
FROM benchmark b
JOIN run r ON r.result_digest = b.result_digest
JOIN metric m ON m.run_number = r.number
JOIN run d ON d.result_digest = b.drive_digest
JOIN metric n ON n.run_number = d.number
JOIN test_case a ON a.digest = d.test_case_digest
JOIN campaign_case c ON c.result_digest = b.result_digest
JOIN test_case t ON t.digest = c.test_case_digest AND t.situation_digest = a.situation_digest
WHERE c.campaign_id = ? AND b.version = ?
ORDER BY c.ordinal, b.model, b.edition"""

_FAILED = f"""
SELECT c.ordinal, c.result_digest, v.signal
FROM campaign_case c
JOIN campaign_fsr f ON {JUDGED}
JOIN run r ON r.result_digest = c.result_digest
JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
WHERE c.campaign_id = ? AND f.fsr_id = ? AND c.architecture = ? AND v.verdict = 'FAIL'"""  # noqa: S608 - the condition is a constant of this package

_OPEN = """
SELECT COUNT(DISTINCT c.result_digest)
FROM campaign_case c
JOIN run r ON r.result_digest = c.result_digest
JOIN metric m ON m.run_number = r.number
WHERE c.campaign_id = ?
    AND (m.contact_status <> 'value' OR m.contact IS NULL OR m.contact <> 0.0 OR r.realised = 0)
    AND NOT EXISTS (SELECT 1 FROM benchmark b
        WHERE b.result_digest = c.result_digest AND b.version = ?)"""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A run of a campaign, and what tells whether there was a conflict.

    Attributes:
        run: Where it stands.
        contact: Whether the ego touched something; None if it is not known.
        required_mps2: Largest required deceleration [m/s²]; None if it has none.
    """

    run: RunRef
    contact: bool | None
    required_mps2: float | None


@dataclass(frozen=True, slots=True)
class DriveRecord:
    """A drive, and what it is held against.

    Attributes:
        origin: Result digest of the run.
        model: Reference driver.
        edition: Of its rules.
        drive: Result digest of the drive.
    """

    origin: str
    model: str
    edition: str
    drive: str


class Benchmarks:
    """Reads and keeps drives of reference drivers, each method in one transaction."""

    def __init__(self, database: Database) -> None:
        """Use an open database of the current schema."""
        self._database = database

    def candidates(self, campaign: str) -> list[Candidate]:
        """List the executed runs of a campaign, each once, in the order of the plan."""
        cases, run, metric = tables.campaign_case, tables.run, tables.metric
        names = ("contact", "contact_status", "max_required_deceleration_mps2")
        query = (
            select(cases, run.c.realised, *(metric.c[name] for name in names))
            .join(run, run.c.result_digest == cases.c.result_digest)
            .join(metric, metric.c.run_number == run.c.number)
            .where(cases.c.campaign_id == campaign)
            .order_by(cases.c.ordinal.desc())
        )
        with self._database.read() as connection:
            # Of several test cases with one result the first of the plan counts.
            found = {item.result_digest: item for item in connection.execute(query)}
        ordered = sorted(found.values(), key=lambda item: item.ordinal)
        return [
            Candidate(
                run_ref(item),
                _contact(item.contact, item.contact_status, item.realised),
                item.max_required_deceleration_mps2,
            )
            for item in ordered
        ]

    def result_of(self, result_digest: str) -> bool:
        """Tell whether there is a result."""
        run = tables.run
        query = select(run.c.number).where(run.c.result_digest == result_digest)
        with self._database.read() as connection:
            return connection.execute(query).first() is not None

    def comparisons(self, campaign: str) -> list[Comparison]:
        """Give what is known of the runs of a campaign, each run once by model and edition."""
        with self._database.read() as connection:
            found = _compared(connection, campaign)
        return list({(item.run, item.model, item.edition): item for item in found}.values())

    def open_contacts(self, campaign: str) -> int:
        """Count the runs with a contact, or of which it is not known, that have no drive."""
        with self._database.read() as connection:
            found = connection.exec_driver_sql(_OPEN, (campaign, BENCHMARK_VERSION)).scalar_one()
        return int(found)

    def save(
        self,
        architectures: Sequence[ContentRecord],
        cases: Sequence[tuple[str, str, str, str]],
        block: RunBlock | None,
        drives: Sequence[DriveRecord],
    ) -> None:
        """Save drives with their test cases and results; what is known stays.

        Args:
            architectures: Content of the drivers.
            cases: Of each drive: its test case, that of the run, the digest of its architecture's
                content, and its situation.
            block: Results of drives that were executed, without verdicts.
            drives: What they are held against.

        Raises:
            IntegrityError: A result contradicts one that exists.
        """
        with self._database.write() as connection:
            for content in architectures:
                save_content(connection, "architecture", content)
            rows = [_test_case(connection, *item) for item in cases]
            insert_rows(connection, tables.test_case, rows, ignore_existing=True)
            if block is not None:
                record_runs(connection, block)
            insert_rows(
                connection,
                tables.benchmark,
                [
                    row(
                        tables.benchmark,
                        (item.origin, item.model, item.edition, BENCHMARK_VERSION, item.drive),
                    )
                    for item in drives
                ],
                ignore_existing=True,
            )

    def failures(
        self, campaign: str, fsr: str, architecture: str, edition: str
    ) -> list[dict[str, Cell]]:
        """Give for each run that FAILs an FSR the cell by model.

        Args:
            campaign: Id of the campaign.
            fsr: Id of the FSR.
            architecture: Id of the architecture.
            edition: Of the models.

        Returns:
            Cells by model of every failure of a contact, ``unknown`` under an empty name where no
            drive is known; nothing at all where the FSR fails of something else.
        """
        with self._database.read() as connection:
            cells: dict[str, dict[str, Cell]] = {}
            for item in _compared(connection, campaign):
                if item.edition == edition:
                    cells.setdefault(item.run, {})[item.model] = item.cell
            failed = connection.exec_driver_sql(_FAILED, (campaign, fsr, architecture)).all()
        nothing: dict[str, Cell] = {"": "unknown"}
        return [
            cells.get(item.result_digest, nothing) if item.signal == "contact" else {}
            for item in failed
        ]


def _compared(connection: Connection, campaign: str) -> list[Comparison]:
    found = connection.exec_driver_sql(_COMPARED, (campaign, BENCHMARK_VERSION)).all()
    return [
        Comparison(
            run=item.run,
            scenario=item.scenario,
            architecture=item.architecture,
            fault_entry=item.fault_entry,
            model=item.model,
            edition=item.edition,
            drive=item.drive,
            cell=cell_of(
                _contact(item.contact, item.contact_status, item.realised),
                _contact(item.drive_contact, item.drive_contact_status, item.drive_realised),
            ),
            impact_speed_mps=item.impact_speed_mps,
            drive_impact_speed_mps=item.drive_impact_speed_mps,
        )
        for item in found
    ]


def _contact(value: Any, status: str, realised: Any) -> bool | None:
    """Read whether there was a contact; None where that says nothing about the situation."""
    if status != "value" or value not in {0.0, 1.0} or not realised:
        return None
    return bool(value)


def _test_case(
    connection: Connection, test_case: str, origin: str, architecture: str, situation: str
) -> tuple[object, ...]:
    """Describe the test case of a drive: that of the run, with another architecture."""
    case = tables.test_case
    found = connection.execute(select(case).where(case.c.digest == origin)).one()
    if found.situation_digest != situation:
        raise IntegrityError(f"the drive for test case {origin[:12]} is of another situation")
    changed = {
        **found._mapping,
        "digest": test_case,
        "architecture_digest": architecture,
        "fault_entry": "none",
        "faults": "[]",
    }
    return row(case, tuple(changed.values())[:-1])
