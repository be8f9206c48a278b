"""What executing other runs beside stored ones told: faults and takeovers in hindsight.

Both follow from the stored run and the version of what reads it, so that they are kept: whoever
asks again executes nothing. They belong to a run and change no count, verdict or gate.

No row of ``campaign_case`` names a fork, so no count, verdict or gate of a campaign sees it.

A drive is an ordinary test case: the situation of a run, driven by a reference driver. No row of
``campaign_case`` names it, so no count or verdict of a campaign sees it; only a gate that asks for
it does, through ``failures``.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import Connection

from adeye.errors import IntegrityError
from adeye.judge.preventability import (
    BENCHMARK_VERSION,
    SAME_HAZARD_S,
    TAKEOVERS_VERSION,
    Comparison,
    cell_of,
)
from adeye.signals import NO_FAULT
from adeye.store import tables
from adeye.store.block import RunBlock
from adeye.store.cases import JUDGED_CASES, standing
from adeye.store.database import Door, Part, reading, writing
from adeye.store.encoding import Row
from adeye.store.evidence.roots import Certificates
from adeye.store.ledger import insert_new, insert_rows, row_of
from adeye.store.read.campaigns import contact_of, executed_once, failed_among
from adeye.store.records import ContentRecord, ForkRecord, RunRef, of_row
from adeye.store.texts import json_text
from adeye.store.write.content import save_content
from adeye.store.write.half_steps import HalfSteps
from adeye.store.write.results import changed_case, record_judged_runs, record_runs

if TYPE_CHECKING:
    from adeye.judge.preventability import Cell, TakeoverClass
    from adeye.judge.timeline import Injection

# --- Save forks beside the campaigns, and find them: they belong to a run, never to a selection ---


def save_forks(connection: Connection, forks: Sequence[ForkRecord], block: RunBlock) -> None:
    """Save forks with their test cases, results and verdicts, unless they are there already.

    Args:
        connection: In a write transaction.
        forks: What each is a fork of.
        block: Their results, in the same order.

    Raises:
        IntegrityError: A result contradicts one that exists.
        ValueError: The results are not those of the forks.
    """
    if block.result_digests != tuple(fork.result_digest for fork in forks):
        raise ValueError("the results are not those of the forks")
    query = "SELECT test_case_digest FROM run WHERE result_digest = ?"
    cases = []
    for fork in forks:
        origin = connection.exec_driver_sql(query, (fork.origin,)).scalar_one()
        cases.append(changed_case(connection, origin, digest=fork.test_case))
    insert_rows(connection, tables.test_case, cases, ignore_existing=True)
    record_judged_runs(connection, block)
    rows = [
        row_of(tables.fork, fork, test_case_digest=fork.test_case, origin_digest=fork.origin)
        for fork in forks
    ]
    insert_rows(connection, tables.fork, rows, ignore_existing=True)


# --- Keep drives of reference drivers beside the campaigns, and find them -------------------------

# A drive that was withdrawn tells nothing, so that its cell is unknown.
_COMPARED = f"""
SELECT c.campaign_id, c.ordinal, c.scenario, c.architecture, t.fault_entry, b.result_digest AS run,
    b.model, b.edition, b.drive_digest AS drive,
    m.contact, m.contact_status, m.contact_actor, m.contact_time_s, r.realised, m.impact_speed_mps,
    n.contact AS drive_contact, n.contact_status AS drive_contact_status,
    n.contact_actor AS drive_contact_actor, n.contact_time_s AS drive_contact_time_s,
    CASE WHEN {standing("b.drive_digest")} THEN d.realised ELSE 0 END AS drive_realised,
    n.impact_speed_mps AS drive_impact_speed_mps
FROM benchmark b
JOIN run r ON r.result_digest = b.result_digest
JOIN metric m ON m.run_number = r.number
JOIN run d ON d.result_digest = b.drive_digest
JOIN metric n ON n.run_number = d.number
JOIN test_case a ON a.digest = d.test_case_digest
JOIN campaign_case c ON c.result_digest = b.result_digest
JOIN test_case t ON t.digest = c.test_case_digest AND t.situation_digest = a.situation_digest
WHERE c.campaign_id = ? AND b.version = ? AND {standing("c.result_digest")}
ORDER BY c.ordinal, b.model, b.edition"""  # noqa: S608 - own names

_FAILED = f"""SELECT c.ordinal, c.result_digest, v.signal FROM {JUDGED_CASES}
WHERE c.campaign_id = ? AND f.fsr_id = ? AND c.architecture = ? AND v.verdict = 'FAIL'
    AND {standing("c.result_digest")}"""  # noqa: S608 - the condition is a constant of this package

_OPEN = f"""
SELECT COUNT(DISTINCT c.result_digest)
FROM campaign_case c
JOIN run r ON r.result_digest = c.result_digest
JOIN metric m ON m.run_number = r.number
WHERE c.campaign_id = ?
    AND (m.contact_status <> 'value' OR m.contact IS NULL OR m.contact <> 0.0 OR r.realised = 0)
    AND NOT EXISTS (SELECT 1 FROM benchmark b
        WHERE b.result_digest = c.result_digest AND b.version = ?)
    AND {standing("c.result_digest")}"""  # noqa: S608 - own names


@dataclass(frozen=True, slots=True)
class DriveRecord:
    """A drive, and what it is held against.

    Attributes:
        result_digest: Of the run.
        model: Reference driver.
        edition: Of its rules.
        drive_digest: Of the result of the drive.
    """

    result_digest: str
    model: str
    edition: str
    drive_digest: str


class Benchmarks(Door):
    """Reads and keeps drives of reference drivers, each method in one transaction."""

    candidates = reading(executed_once)

    def result_of(self, result_digest: str) -> bool:
        """Tell whether there is a result."""
        return bool(self._ask("SELECT 1 FROM run WHERE result_digest = ?", result_digest))

    def comparisons(self, campaign: str) -> list[Comparison]:
        """Give what is known of the runs of a campaign, each run once by model and edition."""
        with self._database.read() as connection:
            found = _compared(connection, campaign)
        return list({(item.run, item.model, item.edition): item for item in found}.values())

    def of(self, campaign: str, edition: str) -> list[Comparison]:
        """Give what is known of the runs of a campaign by an edition of the models."""
        return [item for item in self.comparisons(campaign) if item.edition == edition]

    def open_contacts(self, campaign: str) -> int:
        """Count the runs with a contact, or of which it is not known, that have no drive."""
        ((found,),) = self._ask(_OPEN, campaign, BENCHMARK_VERSION)
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
            rows = [_stored_test_case(connection, *item) for item in cases]
            insert_rows(connection, tables.test_case, rows, ignore_existing=True)
            if block is not None:
                record_runs(connection, block)
            rows = [row_of(tables.benchmark, item, version=BENCHMARK_VERSION) for item in drives]
            insert_rows(connection, tables.benchmark, rows, ignore_existing=True)

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
        of_row(
            Comparison,
            item._mapping,
            cell=cell_of(
                contact_of(item.contact, item.contact_status, item.realised),
                contact_of(item.drive_contact, item.drive_contact_status, item.drive_realised),
                is_same=_is_same(item),
            ),
        )
        for item in found
    ]


def _is_same(item: Any) -> bool:
    """Tell whether two contacts are with one road user, and in one hazard."""
    times = item.contact_time_s, item.drive_contact_time_s
    is_near = None not in times and abs(times[0] - times[1]) <= SAME_HAZARD_S
    return bool(item.contact_actor == item.drive_contact_actor and is_near)


def _stored_test_case(
    connection: Connection, test_case: str, origin: str, architecture: str, situation: str
) -> Row:
    """Describe the test case of a drive: that of the run, with another architecture."""
    changed = changed_case(
        connection,
        origin,
        digest=test_case,
        architecture_digest=architecture,
        fault_entry=NO_FAULT,
        faults="[]",
    )
    if changed[1] != situation:
        raise IntegrityError(f"the drive for test case {origin[:12]} is of another situation")
    return changed


# --- What executing other runs beside stored ones told: faults and takeovers in hindsight ---------

_TIMES = tuple(f"{name}_s" for name in tables.MOMENTS)


@dataclass(frozen=True)
class TakeoverLine:
    """One run in hindsight.

    Attributes:
        run: Result digest.
        fork: Result digest of the fork with the other decision.
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        class_: What the decision was.
        takeover_s: When another channel than the default first acted [s]; None if none did.
        violation_s: When the run violates [s]; None if it does not.
        fork_violation_s: When the fork does [s].
    """

    run: str
    fork: str
    scenario: str
    architecture: str
    fault_entry: str
    class_: TakeoverClass
    takeover_s: float | None
    violation_s: float | None
    fork_violation_s: float | None


class Hindsight(Door):
    """Reads and keeps what was found out about runs, each method in one transaction."""

    save_forks = writing(save_forks)
    failed_among = reading(failed_among)

    half_steps = Part(HalfSteps)
    """Twins with half the step, and the numeric uncertainty that they told."""
    benchmarks = Part(Benchmarks)
    """Drives of reference drivers in the situations of stored runs."""
    certificates = Part(Certificates)
    """Certificates of determinism."""

    def executed(
        self, campaign: str, most: int | None = None, *, only_faulty: bool = False
    ) -> list[RunRef]:
        """Choose executed runs of a campaign, in an order that has nothing to do with them.

        Args:
            campaign: Id of the campaign.
            most: How many are chosen; None for all.
            only_faulty: Leave out, of those chosen, the runs without a fault.

        Returns:
            Those with the smallest digests: a digest is as good as a draw, and the same every time.
        """
        with self._database.read() as connection:
            found = executed_once(connection, campaign)
        chosen = sorted(found, key=lambda item: item.run.result_digest)[:most]
        return [item.run for item in chosen if not only_faulty or item.fault_entry != NO_FAULT]

    def save_injections(self, found: Sequence[Injection]) -> None:
        """Keep what became of the faults of runs; what is known stays.

        Raises:
            IntegrityError: Something else was found before.
        """
        rows = [_injection_row(item) for item in found]
        with self._database.write() as connection:
            _insert_new(connection, tables.injection.name, rows)

    def injections(self, campaign: str) -> tuple[Injection, ...]:
        """Give what is known of the faults of a campaign's runs, by run; none withdrawn."""
        from adeye.judge.timeline import TIMELINE_VERSION

        found = self._ask(
            "SELECT c.scenario, c.architecture, t.fault_entry, i.* FROM injection i "  # noqa: S608 - own names
            "JOIN campaign_case c ON c.result_digest = i.result_digest "
            "JOIN test_case t ON t.digest = c.test_case_digest "
            f"WHERE c.campaign_id = ? AND i.version = ? AND {standing('c.result_digest')} "
            "ORDER BY i.result_digest",
            *(campaign, TIMELINE_VERSION),
        )
        # Two cases of a campaign may be one test case.
        known = {item.result_digest: _injection(item._mapping) for item in found}
        return tuple(known.values())

    def exercised(self, campaign: str, fsrs: Iterable[str]) -> frozenset[tuple[str, str]]:
        """Give pairs of run and FSR: runs whose faults are known, and that exercised the FSR.

        Args:
            campaign: Id of the campaign.
            fsrs: Ids of the FSRs that are asked for.
        """
        from adeye.judge.timeline import TIMELINE_VERSION

        query = (
            "SELECT DISTINCT v.run FROM v_verdicts v JOIN injection i ON i.result_digest = v.run "
            "WHERE v.campaign = ? AND v.fsr = ? AND v.exercised = 1 AND i.version = ?"
        )
        return frozenset(
            (run, fsr)
            for fsr in fsrs
            for (run,) in self._ask(query, campaign, fsr, TIMELINE_VERSION)
        )

    def save_takeovers(self, found: Sequence[TakeoverLine]) -> None:
        """Keep what the decisions of runs were, beside their forks; what is known stays.

        Raises:
            IntegrityError: Something else was found before.
        """
        rows = [
            row_of(tables.takeover, item, fork_digest=item.fork, version=TAKEOVERS_VERSION)
            for item in found
        ]
        with self._database.write() as connection:
            _insert_new(connection, tables.takeover.name, rows)

    def takeovers(self, campaign: str) -> tuple[TakeoverLine, ...]:
        """Give what is known of the decisions of a campaign's runs, by run; none withdrawn."""
        found = self._ask(
            "SELECT f.origin_digest, o.fork_digest, c.scenario, c.architecture, t.fault_entry, "  # noqa: S608 - own names
            "o.class, o.takeover_s, o.violation_s, o.fork_violation_s FROM takeover o "
            "JOIN fork f ON f.result_digest = o.fork_digest "
            "JOIN campaign_case c ON c.result_digest = f.origin_digest "
            "JOIN test_case t ON t.digest = c.test_case_digest "
            "WHERE c.campaign_id = ? AND o.version = ? "
            f"AND {standing('c.result_digest', 'f.result_digest')} ORDER BY f.origin_digest",
            *(campaign, TAKEOVERS_VERSION),
        )
        known = {item[0]: TakeoverLine(*item) for item in found}
        return tuple(known.values())


def _injection_row(item: Injection) -> Row:
    from adeye.judge.timeline import TIMELINE_VERSION

    own = (*_TIMES, "fdti_s", "frti_s", "fhti_s")
    return row_of(
        tables.injection,
        item,
        result_digest=item.run,
        version=TIMELINE_VERSION,
        eoti_s=item.times.emergency_operation_s,
        without_mechanism=json_text(asdict(item.without_mechanism)),
        twins=json_text(list(item.twins)),
        **{name: getattr(item.times, name) for name in own},
    )


def _injection(item: Any) -> Injection:
    from adeye.judge.timeline import Injection, Timeline

    return of_row(
        Injection,
        item,
        run=item["result_digest"],
        times=of_row(Timeline, item),
        without_mechanism=Timeline(**json.loads(item["without_mechanism"])),
        twins=tuple(json.loads(item["twins"])),
        failed="",
    )


def _insert_new(connection: Connection, name: str, rows: Iterable[Row]) -> None:
    """Insert rows whose key, the digest and the version, is not there yet."""

    def refuse(item: Row) -> None:
        raise IntegrityError(
            f"{name} of run {item[0][:12]}: something else was found before. Its twins or its "
            "fork do not come out as they did; `adeye replay` tells whether the run does."
        )

    insert_new(connection, tables.metadata.tables[name], rows, refuse)
