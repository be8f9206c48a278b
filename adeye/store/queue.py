"""The work of a campaign as runners share it: what they want of it, and what others hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sqlalchemy import select

from adeye.evaluation.verdict import Verdict
from adeye.store import leasing, pending
from adeye.store.column_kinds import is_true
from adeye.store.owner import Owner
from adeye.store.tables import campaign_case, campaign_fsr, run, test_case, verdict

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from adeye.store.database import Database
    from adeye.store.stored import Block
    from adeye.store.wanted import Wanted

_CHUNK: Final = 1_000
_BAD: Final = (Verdict.FAIL.value, Verdict.ERROR.value)


@dataclass(frozen=True, slots=True)
class NamedCase:
    """A test case by the names that people give, which stay when its content is edited.

    Attributes:
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        replicate: Number of the replicate.
        point: Swept values in SI as JSON.
    """

    scenario: str
    architecture: str
    fault_entry: str
    replicate: int
    point: str


class Queue:
    """The blocks of campaigns in one database, each method in one transaction."""

    def __init__(self, database: Database) -> None:
        """Use an open database of the current schema."""
        self._database = database

    def claim(self, campaign: str, wanted: Wanted, lease_s: float) -> Block | None:
        """Lease the next free block that has a wanted test case; None if there is none.

        A block that is wanted in part is cut, and its other test cases become blocks of their own.

        Args:
            campaign: Id of the campaign.
            wanted: What is wanted.
            lease_s: For how long [s].
        """
        owner = Owner.current()
        return self._database.change(
            lambda connection: leasing.claim_block(connection, owner, lease_s, campaign, wanted),
            shared=True,
        )

    def open_elsewhere(self, campaign: str, wanted: Wanted, mine: Collection[int]) -> int:
        """Count the wanted test cases in blocks that are not done, and not with the caller.

        Args:
            campaign: Id of the campaign.
            wanted: What is wanted.
            mine: Numbers of the blocks that the caller holds.
        """
        with self._database.read() as connection:
            return leasing.open_elsewhere(connection, campaign, wanted, mine)

    def requeue_quarantined(self, campaign: str) -> int:
        """Make quarantined blocks pending again; return how many."""
        return self._database.change(
            lambda connection: leasing.requeue_quarantined(connection, campaign), shared=True
        )

    def cases(self, campaign: str) -> Iterator[tuple[int, NamedCase, bool]]:
        """Read the test cases of a campaign: ordinal, names, and whether there is a result."""
        query = (
            select(
                campaign_case.c.ordinal,
                campaign_case.c.scenario,
                campaign_case.c.architecture,
                test_case.c.fault_entry,
                test_case.c.replicate,
                campaign_case.c.point,
                run.c.number,
            )
            .join(test_case, test_case.c.digest == campaign_case.c.test_case_digest)
            .outerjoin(run, run.c.result_digest == campaign_case.c.result_digest)
            .where(campaign_case.c.campaign_id == campaign)
            .order_by(campaign_case.c.ordinal)
        )
        with self._database.read() as connection:
            found = connection.execute(query, execution_options={"yield_per": _CHUNK})
            for ordinal, *names, number in found:
                yield ordinal, NamedCase(*names), number is not None

    def failed(self, campaign: str) -> frozenset[int]:
        """List the ordinals of a campaign of which a mandatory FSR has a FAIL or an ERROR."""
        query = (
            select(campaign_case.c.ordinal)
            .select_from(
                campaign_case.join(run, run.c.result_digest == campaign_case.c.result_digest)
                .join(campaign_fsr, pending.is_judged())
                .join(
                    verdict,
                    (verdict.c.run_number == run.c.number)
                    & (verdict.c.fsr_digest == campaign_fsr.c.fsr_digest),
                )
            )
            .where(
                campaign_case.c.campaign_id == campaign,
                is_true(campaign_fsr.c.mandatory),
                verdict.c.verdict.in_(_BAD),
            )
            .distinct()
        )
        with self._database.read() as connection:
            return frozenset(connection.execute(query).scalars())

    def earlier(self, campaign: str) -> list[str]:
        """List the other campaigns of the same ODD id, the one that was used last first."""
        with self._database.read() as connection:
            found = connection.exec_driver_sql(
                "SELECT v.campaign FROM v_campaigns v JOIN campaign c ON c.odd_id = v.odd "
                "WHERE c.id = ? AND v.campaign <> ? ORDER BY v.recency, v.campaign",
                (campaign, campaign),
            )
            return [str(item) for item in found.scalars()]
