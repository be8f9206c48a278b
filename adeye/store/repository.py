"""The only door to the database.

Contract:

- A repository may be shared between threads, and used after a fork; every method is one
  transaction, committed when it returns and rolled back when it raises. Nothing is cached.
- Any number of processes may use one database. A block belongs to the process that claimed it,
  until its lease ends or that process is dead; then the next claim takes it over, and whatever its
  former owner still brings is dropped (``complete_block`` returns False).
- Plans, runs, metrics, verdicts, events and tallies are only ever added. A result belongs to its
  test case and engine; a campaign selects results. Adding the same result again changes nothing;
  adding a different one for the same identity is an ``IntegrityError``.
- What the database or the disk refuses is a ``PlatformError``, a wrong request an ``InputError``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Self

from adeye.judge.verdict import Verdict
from adeye.store import schema
from adeye.store.block import JudgedBlock, PlannedCases, RunBlock
from adeye.store.database import Database, Door, create_parent, reading, sharing, writing
from adeye.store.evidence import verification
from adeye.store.evidence.roots import Evidence
from adeye.store.location import Location, Place, locate
from adeye.store.owner import Owner
from adeye.store.read import campaigns as stored
from adeye.store.read.bulk import read_compared, read_figures
from adeye.store.read.checking import unbegun_events
from adeye.store.read.rejudging import Again
from adeye.store.records import (
    Block,
    CampaignRecord,
    DatabaseInfo,
    Finding,
    Plan,
    RunRef,
    VerdictRecord,
)
from adeye.store.views import ensure_scenario_views
from adeye.store.write import content, merge, planning
from adeye.store.write import queue as leasing
from adeye.store.write.merge import Copied, Merged, Origin
from adeye.store.write.queue import Queue
from adeye.store.write.studies import Hindsight

DEFAULT_LEASE_S = 60.0
DEFAULT_BLOCK_SIZE = 64


class Repository(Door):
    """Plans, results and verdicts in one database; see the module for the contract."""

    @classmethod
    def open(cls, place: Place = None, *, create: bool = True) -> Self:
        """Open a database, by default ``.adeye/adeye.db``.

        Args:
            place: A path, ``sqlite:///PATH`` or ``postgresql://…``.
            create: Make it if it does not exist; otherwise that is an input error.

        Raises:
            InputError: The location is not supported, or does not exist and may not be made.
            PlatformError: It cannot be opened, is not ours, or has another schema version.
        """
        location = locate(place)
        (create_parent if create else schema.require_exists)(location)
        with ExitStack() as unless_opened:
            database = Database(location)
            unless_opened.callback(database.close)
            with database.read() as connection:
                is_new = schema.read_version(connection) is None
            if create and is_new:
                schema.upgrade_database(database)
            with database.read() as connection:
                schema.require_current(connection, location)
            unless_opened.pop_all()
        return cls(database)

    @property
    def location(self) -> Location:
        """Where the database is."""
        return self._database.location

    def close(self) -> None:
        """Close the connections of this process."""
        self._database.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Close, and tell content that broke its reader, see ``damage``."""
        verification.close(self, raised[1])

    # Plans

    save_content = writing(content.save_content)
    save_concept = writing(content.save_concept)

    def plan_campaign(
        self,
        record: CampaignRecord,
        cases: Iterable[PlannedCases],
        *,
        block_size: int = DEFAULT_BLOCK_SIZE,
        report: Callable[[int], None] | None = None,
    ) -> Plan:
        """Save a campaign with its content, test cases and work, before anything runs.

        The same selection again is the same campaign: no row changes. Results that exist are
        reused; a block in which nothing is missing is done at once.

        Args:
            record: The campaign.
            cases: Test cases in the order of their ordinals.
            block_size: Most test cases in one block of work.
            report: Called with the number of test cases that are planned so far.

        Raises:
            InputError: There are no test cases.
            ValueError: The record does not say how each FSR of its concept is judged.
        """
        with self._database.write() as connection:
            plan = planning.plan_campaign(connection, record, cases, block_size, report)
            if plan.is_new:
                ensure_scenario_views(connection)
            return plan

    # Work

    def merge(self, source: str | Path | Origin) -> Merged:
        """Add what another database has, in one transaction; see ``store.write.merge``.

        Args:
            source: The other database, which is only read.
        """
        return merge.merge(self._database, source)

    def copy(self, source: Location, campaigns: Sequence[str]) -> Copied:
        """Fill this empty database with campaigns of another one; see ``store.write.merge``.

        Args:
            source: The other database, which is only read.
            campaigns: Their ids.
        """
        return merge.copy(self._database, source, campaigns)

    @property
    def queue(self) -> Queue:
        """The work of a campaign, as runners share it."""
        return Queue(self._database)

    def claim_block(
        self,
        owner: Owner | None = None,
        lease_s: float = DEFAULT_LEASE_S,
        *,
        campaign: str | None = None,
    ) -> Block | None:
        """Lease the next free block, also one whose owner is dead or late; None if there is none.

        Its cases may be none, if what it needed came in since; complete it as well.
        """
        holder = owner or Owner.current()
        return self._database.change(
            lambda connection: leasing.claim_block(connection, holder, lease_s, campaign),
            shared=True,
        )

    renew_lease = sharing(leasing.renew_lease)
    release_block = sharing(leasing.release_block)
    fail_block = sharing(leasing.fail_block)
    quarantine_block = sharing(leasing.quarantine_block)

    def complete_block(
        self,
        block: Block,
        runs: RunBlock | None,
        verdicts: JudgedBlock | None = None,
    ) -> bool:
        """Save everything that a block needed, in one transaction.

        Args:
            block: As claimed.
            runs: Results of ``block.to_execute`` with their verdicts.
            verdicts: Verdicts of ``block.to_judge``.

        Returns:
            False if the block was taken over; then nothing was saved.

        Raises:
            IntegrityError: A result or verdict contradicts one that exists.
            ValueError: A result or verdict is missing, or is not of this block.
        """
        return self._database.change(
            lambda connection: leasing.complete_block(connection, block, runs, verdicts)
        )

    work_state = reading(stored.work_state)

    # Judging again

    @property
    def again(self) -> Again:
        """What judging results again needs, and where it goes."""
        return Again(self._database)

    # Forks and hindsight

    @property
    def hindsight(self) -> Hindsight:
        """What executing other runs beside stored ones told."""
        return Hindsight(self._database)

    @property
    def evidence(self) -> Evidence:
        """What vouches for results."""
        return Evidence(self._database)

    # Reading

    campaigns = reading(stored.campaigns)
    latest_campaign = reading(stored.latest_campaign)
    find_campaign = reading(stored.find_campaign)
    progress = reading(stored.progress)
    fsr_status = reading(stored.fsr_status)
    gate = reading(stored.gate)
    never_held = reading(stored.never_held)
    failed_channels = reading(stored.failed_channels)
    contacts = reading(stored.contacts)
    unbegun_events = reading(unbegun_events)
    find_run = reading(stored.find_run)
    run_row = reading(stored.run_row)
    test_case_row = reading(stored.test_case_row)
    content = reading(stored.content)
    results = reading(stored.results)
    figures = reading(read_figures)
    compared = reading(read_compared)

    def worst_runs(
        self,
        campaign: str,
        fsr: str,
        *,
        architecture: str | None = None,
        scenario: str | None = None,
        verdict: Verdict | None = None,
        limit: int = 3,
    ) -> tuple[tuple[RunRef, VerdictRecord], ...]:
        """Return the runs with the least robustness for an FSR, failed ones first."""
        with self._database.read() as connection:
            return stored.worst_runs(
                connection,
                campaign,
                fsr,
                limit=limit,
                architecture=architecture,
                scenario=scenario,
                verdict=None if verdict is None else verdict.value,
            )

    # Integrity

    def verify(self) -> tuple[Finding, ...]:
        """Name everything in the database that is not as it was written."""
        with self._database.read() as connection:
            return tuple(verification.verify(connection))

    def unsound(self, campaign: str) -> tuple[Finding, ...]:
        """Name what is not as it was written of all that the summaries of a campaign rest on."""
        with self._database.read() as connection:
            return tuple(verification.unsound(connection, campaign))

    def info(self) -> DatabaseInfo:
        """Say what the database holds."""
        with self._database.read() as connection:
            return stored.info(connection, self.location)
