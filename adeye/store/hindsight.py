"""What executing other runs beside stored ones told: faults and takeovers in hindsight.

Both follow from the stored run and the version of what reads it, so that they are kept: whoever
asks again executes nothing. They belong to a run and change no count, verdict or gate.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from adeye.errors import IntegrityError
from adeye.evaluation.injections import Injection
from adeye.evaluation.takeovers import TAKEOVERS_VERSION, TakeoverClass
from adeye.evaluation.timeline import TIMELINE_VERSION, Timeline
from adeye.store import forking, summaries, tables
from adeye.store.benchmarks import Benchmarks
from adeye.store.certificates import Certificates
from adeye.store.encoding import Row, json_text, row
from adeye.store.halving import HalfSteps
from adeye.store.inserting import insert_rows
from adeye.store.reading import run_ref
from adeye.sweep.groups import NO_FAULT

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sqlalchemy import Connection

    from adeye.store.block import RunBlock
    from adeye.store.database import Database
    from adeye.store.rows import ForkRecord
    from adeye.store.stored import RunRef

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


class Hindsight:
    """Reads and keeps what was found out about runs, each method in one transaction."""

    def __init__(self, database: Database) -> None:
        """Use an open database of the current schema."""
        self._database = database

    @property
    def half_steps(self) -> HalfSteps:
        """Twins with half the step, and the numeric uncertainty that they told."""
        return HalfSteps(self._database)

    @property
    def benchmarks(self) -> Benchmarks:
        """Drives of reference drivers in the situations of stored runs."""
        return Benchmarks(self._database)

    @property
    def certificates(self) -> Certificates:
        """Certificates of determinism."""
        return Certificates(self._database)

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
        cases, case = tables.campaign_case, tables.test_case
        query = (
            select(cases, case.c.fault_entry)
            .join(tables.run, tables.run.c.result_digest == cases.c.result_digest)
            .join(case, case.c.digest == cases.c.test_case_digest)
            .where(cases.c.campaign_id == campaign)
            .order_by(cases.c.result_digest, cases.c.ordinal.desc())
        )
        with self._database.read() as connection:
            # Of several test cases with one result the first of the plan counts.
            found = {item.result_digest: item for item in connection.execute(query)}
        chosen = list(found.values())[:most]
        return [run_ref(item) for item in chosen if not only_faulty or item.fault_entry != NO_FAULT]

    def save_forks(self, forks: Sequence[ForkRecord], runs: RunBlock) -> None:
        """Save forks with their results and verdicts, in the same order; known ones stay."""
        with self._database.write() as connection:
            forking.save_forks(connection, forks, runs)

    def failed_among(self, campaign: str, ordinals: Sequence[int]) -> frozenset[int]:
        """Return those of a few hundred runs of a campaign that fail an FSR."""
        with self._database.read() as connection:
            return summaries.failed_among(connection, campaign, ordinals)

    def save_injections(self, found: Sequence[Injection]) -> None:
        """Keep what became of the faults of runs; what is known stays.

        Raises:
            IntegrityError: Something else was found before.
        """
        rows = [_injection_row(item) for item in found]
        with self._database.write() as connection:
            _insert_new(connection, tables.injection.name, rows)

    def injections(self, campaign: str) -> tuple[Injection, ...]:
        """Give what is known of the faults of a campaign's runs, by run."""
        with self._database.read() as connection:
            found = connection.exec_driver_sql(
                "SELECT c.scenario, c.architecture, t.fault_entry, i.* FROM injection i "
                "JOIN campaign_case c ON c.result_digest = i.result_digest "
                "JOIN test_case t ON t.digest = c.test_case_digest "
                "WHERE c.campaign_id = ? AND i.version = ? ORDER BY i.result_digest",
                (campaign, TIMELINE_VERSION),
            ).mappings()
            # Two cases of a campaign may be one test case.
            known = {item["result_digest"]: _injection(item) for item in found}
        return tuple(known.values())

    def exercised(self, campaign: str, fsrs: Iterable[str]) -> frozenset[tuple[str, str]]:
        """Give pairs of run and FSR: runs whose faults are known, and that exercised the FSR.

        Args:
            campaign: Id of the campaign.
            fsrs: Ids of the FSRs that are asked for.
        """
        with self._database.read() as connection:
            return frozenset(
                (run, fsr)
                for fsr in fsrs
                for (run,) in connection.exec_driver_sql(
                    "SELECT DISTINCT v.run FROM v_verdicts v JOIN injection i "
                    "ON i.result_digest = v.run "
                    "WHERE v.campaign = ? AND v.fsr = ? AND v.exercised = 1 "
                    "AND i.version = ?",
                    (campaign, fsr, TIMELINE_VERSION),
                )
            )

    def save_takeovers(self, found: Sequence[TakeoverLine]) -> None:
        """Keep what the decisions of runs were, beside their forks; what is known stays.

        Raises:
            IntegrityError: Something else was found before.
        """
        rows = [
            row(
                tables.takeover,
                (
                    item.fork,
                    TAKEOVERS_VERSION,
                    item.class_,
                    item.takeover_s,
                    item.violation_s,
                    item.fork_violation_s,
                ),
            )
            for item in found
        ]
        with self._database.write() as connection:
            _insert_new(connection, tables.takeover.name, rows)

    def takeovers(self, campaign: str) -> tuple[TakeoverLine, ...]:
        """Give what is known of the decisions of a campaign's runs, by run."""
        with self._database.read() as connection:
            found = connection.exec_driver_sql(
                "SELECT f.origin_digest, o.fork_digest, c.scenario, c.architecture, t.fault_entry, "
                "o.class, o.takeover_s, o.violation_s, o.fork_violation_s FROM takeover o "
                "JOIN fork f ON f.result_digest = o.fork_digest "
                "JOIN campaign_case c ON c.result_digest = f.origin_digest "
                "JOIN test_case t ON t.digest = c.test_case_digest "
                "WHERE c.campaign_id = ? AND o.version = ? ORDER BY f.origin_digest",
                (campaign, TAKEOVERS_VERSION),
            )
            known = {item[0]: TakeoverLine(*item) for item in found}
        return tuple(known.values())


def _injection_row(item: Injection) -> Row:
    times = item.times
    return row(
        tables.injection,
        (
            item.run,
            TIMELINE_VERSION,
            *(getattr(times, name) for name in _TIMES),
            times.fdti_s,
            times.frti_s,
            times.fhti_s,
            times.emergency_operation_s,
            item.ftti_s,
            item.fault_free_violation_s,
            item.class_,
            json_text(asdict(item.without_mechanism)),
            json_text(list(item.twins)),
        ),
    )


def _injection(item: Any) -> Injection:
    return Injection(
        run=item["result_digest"],
        scenario=item["scenario"],
        architecture=item["architecture"],
        fault_entry=item["fault_entry"],
        times=Timeline(**{name: item[name] for name in _TIMES}),
        without_mechanism=Timeline(**json.loads(item["without_mechanism"])),
        fault_free_violation_s=item["fault_free_violation_s"],
        class_=item["class"],
        twins=tuple(json.loads(item["twins"])),
    )


def _insert_new(connection: Connection, name: str, rows: Iterable[Row]) -> None:
    """Insert rows whose key, the digest and the version, is not there yet."""
    table = tables.metadata.tables[name]
    key = next(iter(table.primary_key.columns)).name
    new: dict[tuple[str, int], Row] = {}
    for item in rows:
        known = connection.exec_driver_sql(
            f"SELECT row_hash FROM {name} WHERE {key} = ? AND version = ?",  # noqa: S608 - own names
            (item[0], item[1]),
        ).scalar()
        known = new.get((item[0], item[1]), (known,))[-1]
        if known is None:
            new[item[0], item[1]] = item
        elif known != item[-1]:
            raise IntegrityError(
                f"{name} of run {item[0][:12]}: something else was found before. Its twins or its "
                "fork do not come out as they did; `adeye replay` tells whether the run does."
            )
    insert_rows(connection, table, list(new.values()))
