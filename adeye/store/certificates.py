"""Keep certificates of determinism beside their campaigns, and say which runs can have one."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from adeye.store import tables
from adeye.store.encoding import json_text, row, utc_text
from adeye.store.inserting import insert_rows
from adeye.store.reading import run_ref

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.store.database import Database
    from adeye.store.stored import RunRef


@dataclass(frozen=True, slots=True)
class Executed:
    """A run of a campaign that has a result.

    Attributes:
        run: Where it stands.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        machine_dependent: Whether a deadline or limit of the machine ended a channel in it.
    """

    run: RunRef
    fault_entry: str
    machine_dependent: bool

    @property
    def stratum(self) -> tuple[str, str, str]:
        """Scenario, architecture and fault entry."""
        return self.run.scenario, self.run.architecture, self.fault_entry


@dataclass(frozen=True)
class CertificateRecord:
    """A certificate as the database holds it, see ``campaign.certificate.Certificate``.

    Attributes:
        campaign: Id.
        tool: Release of adeye.
        class_: ``portable`` or ``same platform``.
        executed: Runs that have a result.
        asked: Size of the sample that was asked for.
        sampled: Runs that were executed again.
        machine_dependent: Runs that were left out.
        conditions: With the runs compared under each.
        findings: Runs that differ; none certifies.
        at: UTC time of day; empty before it is saved.
    """

    campaign: str
    tool: str
    class_: str
    executed: int
    asked: int
    sampled: int
    machine_dependent: int
    conditions: Sequence[Mapping[str, Any]]
    findings: Sequence[Mapping[str, Any]]
    at: str = ""


class Certificates:
    """Reads and keeps certificates, each method in one transaction."""

    def __init__(self, database: Database) -> None:
        """Use an open database of the current schema."""
        self._database = database

    def executed(self, campaign: str) -> list[Executed]:
        """List the executed runs of a campaign, each once, in the order of the plan."""
        cases, case, run = tables.campaign_case, tables.test_case, tables.run
        query = (
            select(cases, case.c.fault_entry, run.c.machine_dependent)
            .join(run, run.c.result_digest == cases.c.result_digest)
            .join(case, case.c.digest == cases.c.test_case_digest)
            .where(cases.c.campaign_id == campaign)
            .order_by(cases.c.ordinal.desc())
        )
        with self._database.read() as connection:
            # Of several test cases with one result the first of the plan counts.
            found = {item.result_digest: item for item in connection.execute(query)}
        return [
            Executed(run_ref(item), item.fault_entry, bool(item.machine_dependent))
            for item in sorted(found.values(), key=lambda item: item.ordinal)
        ]

    def save(self, found: CertificateRecord) -> None:
        """Keep a certificate; earlier ones stay."""
        table = tables.certificate
        with self._database.write() as connection:
            number = connection.exec_driver_sql(
                "SELECT COALESCE(MAX(number), 0) + 1 FROM certificate"
            ).scalar_one()
            values = [
                number,
                found.campaign,
                utc_text(None),
                found.tool,
                found.class_,
                *(found.executed, found.asked, found.sampled, found.machine_dependent),
                json_text(list(found.conditions)),
                json_text(list(found.findings)),
            ]
            insert_rows(connection, table, [row(table, values)])

    def of(self, campaign: str) -> tuple[CertificateRecord, ...]:
        """Give the certificates of a campaign, the newest first."""
        table = tables.certificate
        query = (
            table.select().where(table.c.campaign_id == campaign).order_by(table.c.number.desc())
        )
        with self._database.read() as connection:
            stored = connection.execute(query).mappings().all()
        return tuple(
            CertificateRecord(
                campaign=item["campaign_id"],
                tool=item["tool"],
                class_=item["class"],
                executed=item["executed"],
                asked=item["asked"],
                sampled=item["sampled"],
                machine_dependent=item["machine_dependent"],
                conditions=json.loads(item["conditions"]),
                findings=json.loads(item["findings"]),
                at=item["at"],
            )
            for item in stored
        )
