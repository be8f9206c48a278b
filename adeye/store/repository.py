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

from contextlib import ExitStack
from datetime import UTC, date, datetime
from typing import TYPE_CHECKING, Any, Self

from adeye.store import schema, tables
from adeye.store import views as scenario_view
from adeye.store.block import JudgedBlock, RunBlock, run_block
from adeye.store.database import Database, create_parent
from adeye.store.evidence import verification
from adeye.store.evidence import verification as damage
from adeye.store.evidence import verification as soundness
from adeye.store.evidence.roots import Evidence
from adeye.store.location import Location, Place, locate
from adeye.store.owner import Owner
from adeye.store.read import bulk as compared
from adeye.store.read import bulk as figures
from adeye.store.read import campaigns as found
from adeye.store.read import campaigns as reading
from adeye.store.read import campaigns as summaries
from adeye.store.read.checking import unbegun_events
from adeye.store.read.rejudging import Again
from adeye.store.write import content, planning
from adeye.store.write import merge as merging
from adeye.store.write import queue as leasing
from adeye.store.write import results as recording
from adeye.store.write.queue import Queue
from adeye.store.write.studies import Hindsight

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
    from pathlib import Path

    from adeye.judge.verdict import Verdict
    from adeye.spec.concept import Concept
    from adeye.store.block import PlannedCases
    from adeye.store.read.bulk import Compared, Figures
    from adeye.store.records import (
        Artifact,
        Block,
        CampaignInfo,
        CampaignRecord,
        ContentRecord,
        DatabaseInfo,
        Finding,
        FsrStatus,
        NeverHeld,
        Plan,
        PlannedCase,
        Progress,
        ResultTable,
        RunRecord,
        RunRef,
        StoredCase,
        StoredRun,
        VerdictRecord,
        WorkState,
    )
    from adeye.store.write.merge import Copied, Merged, Origin

DEFAULT_LEASE_S = 60.0
DEFAULT_BLOCK_SIZE = 64


class Repository:
    """Plans, results and verdicts in one database; see the module for the contract."""

    def __init__(self, database: Database) -> None:
        """Use an open database of the current schema; see ``open``."""
        self._database = database

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
        damage.close(self, raised[1])

    # Plans

    def save_content(self, kind: str, record: ContentRecord) -> str:
        """Save an ``odd``, ``scenario``, ``architecture`` or ``concept``; return its digest."""
        with self._database.write() as connection:
            return content.save_content(connection, kind, record)

    def save_concept(self, concept: Concept) -> str:
        """Save a concept with its parts; return its digest."""
        with self._database.write() as connection:
            return content.save_concept(connection, concept)

    def plan_campaign(
        self,
        record: CampaignRecord,
        cases: Iterable[PlannedCases | PlannedCase],
        *,
        block_size: int = DEFAULT_BLOCK_SIZE,
        report: Callable[[int], None] | None = None,
    ) -> Plan:
        """Save a campaign with its content, test cases and work, before anything runs.

        The same selection again is the same campaign: no row changes. Results that exist are
        reused; a block in which nothing is missing is done at once.

        Args:
            record: The campaign.
            cases: Test cases in the order of their ordinals, many together or one by one.
            block_size: Most test cases in one block of work.
            report: Called with the number of test cases that are planned so far.

        Raises:
            InputError: There are no test cases.
            ValueError: The record does not say how each FSR of its concept is judged.
        """
        with self._database.write() as connection:
            plan = planning.plan_campaign(connection, record, cases, block_size, report)
            if plan.is_new:
                scenario_view.ensure_scenario_views(connection)
            return plan

    # Work

    def merge(self, source: str | Path | Origin) -> Merged:
        """Add what another database has, in one transaction; see ``store.write.merge``.

        Args:
            source: The other database, which is only read.
        """
        return merging.merge(self._database, source)

    def copy(self, source: Location, campaigns: Sequence[str]) -> Copied:
        """Fill this empty database with campaigns of another one; see ``store.write.merge``.

        Args:
            source: The other database, which is only read.
            campaigns: Their ids.
        """
        return merging.copy(self._database, source, campaigns)

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

    def renew_lease(self, block: Block, lease_s: float = DEFAULT_LEASE_S) -> bool:
        """Extend a lease; False if the block was taken over."""
        return self._database.change(
            lambda connection: leasing.renew_lease(connection, block, lease_s), shared=True
        )

    def release_block(self, block: Block) -> bool:
        """Give a block back untouched; False if it was taken over."""
        return self._database.change(
            lambda connection: leasing.release_block(connection, block), shared=True
        )

    def fail_block(self, block: Block, detail: str) -> str | None:
        """Record an infrastructure error: ``pending``, ``quarantined``; None if taken over."""
        return self._database.change(
            lambda connection: leasing.fail_block(connection, block, detail), shared=True
        )

    def quarantine_block(self, block: Block, detail: str) -> bool:
        """Set a block aside; its runs stay NOT_RUN. False if it was taken over."""
        return self._database.change(
            lambda connection: leasing.quarantine_block(connection, block, detail), shared=True
        )

    def complete_block(
        self,
        block: Block,
        runs: RunBlock | Sequence[RunRecord] | None,
        verdicts: JudgedBlock | Mapping[str, Sequence[VerdictRecord]] | None = None,
    ) -> bool:
        """Save everything that a block needed, in one transaction.

        Args:
            block: As claimed.
            runs: Results of ``block.to_execute`` with their verdicts, in columns or one by one.
            verdicts: Verdicts of ``block.to_judge``, in columns or by result digest.

        Returns:
            False if the block was taken over; then nothing was saved.

        Raises:
            IntegrityError: A result or verdict contradicts one that exists.
            ValueError: A result or verdict is missing, or is not of this block.
        """
        made = runs if isinstance(runs, RunBlock) else run_block(runs or (), tables.METRIC_IDS)
        judged = verdicts if isinstance(verdicts, JudgedBlock) else JudgedBlock.of(verdicts or {})
        return self._database.change(
            lambda connection: leasing.complete_block(connection, block, made, judged)
        )

    def work_state(self, campaign: str) -> WorkState:
        """Count the blocks of a campaign by state."""
        with self._database.read() as connection:
            return found.work_state(connection, campaign)

    def add_artifact(self, artifact: Artifact) -> None:
        """Note a kept file by the digest of its content."""
        with self._database.write() as connection:
            recording.record_artifact(connection, artifact)

    # Judging again

    @property
    def again(self) -> Again:
        """What judging results again needs, and where it goes."""
        return Again(self._database)

    def add_verdicts(self, verdicts: Mapping[str, Sequence[VerdictRecord]]) -> int:
        """Add verdicts to results that exist, by result digest; return how many were new."""
        with self._database.write() as connection:
            return recording.record_verdicts(connection, JudgedBlock.of(verdicts))

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

    def campaigns(self) -> tuple[CampaignInfo, ...]:
        """List campaigns, the newest first."""
        with self._database.read() as connection:
            return reading.campaigns(connection)

    def latest_campaign(self, odd: str | None = None) -> CampaignInfo | None:
        """Return the campaign that was planned last, of one ODD if its id is given."""
        with self._database.read() as connection:
            return reading.latest_campaign(connection, odd)

    def find_campaign(self, name: str | None = None) -> CampaignInfo:
        """Find a campaign by its id, the beginning of it, or its number; without, the latest."""
        with self._database.read() as connection:
            return reading.find_campaign(connection, name)

    def progress(self, campaign: str) -> Progress:
        """Count planned, executed and accounted test cases."""
        with self._database.read() as connection:
            return summaries.progress(connection, campaign)

    def fsr_status(self, campaign: str) -> tuple[FsrStatus, ...]:
        """Count the verdicts of every FSR by architecture and scenario."""
        with self._database.read() as connection:
            return summaries.fsr_status(connection, campaign)

    def gate(self, campaign: str, *, on: date | None = None) -> tuple[FsrStatus, ...]:
        """Fold every mandatory FSR for every architecture; waivers must be valid on a day."""
        with self._database.read() as connection:
            return summaries.gate(connection, campaign, on or datetime.now(UTC).date())

    def never_held(self, campaign: str) -> dict[tuple[str, str], tuple[NeverHeld, ...]]:
        """List the nested implications that no run asked for, by FSR and architecture."""
        with self._database.read() as connection:
            return summaries.never_held(connection, campaign)

    def failed_channels(
        self, campaign: str, about: Sequence[tuple[str, str]] = ()
    ) -> tuple[tuple[str, str, str, bool, int], ...]:
        """Count the runs in which a channel failed, apart where an FSR about the channel passes."""
        with self._database.read() as connection:
            return summaries.failed_channels(connection, campaign, about)

    def contacts(self, campaign: str) -> dict[str, int]:
        """Count the runs that a contact ended, by architecture."""
        with self._database.read() as connection:
            return summaries.contacts(connection, campaign)

    def unbegun_events(self, campaign: str) -> tuple[tuple[str, str, bool], ...]:
        """List the events that began in no run, see ``checking.unbegun_events``."""
        with self._database.read() as connection:
            return unbegun_events(connection, campaign)

    def find_run(self, name: str, *, campaign: str | None = None) -> RunRef:
        """Find a run by the beginning of its result digest, or its ordinal in a campaign."""
        with self._database.read() as connection:
            return reading.find_run(connection, name, campaign)

    def run_row(self, result_digest: str) -> StoredRun | None:
        """Read a result with metrics, verdicts and events; None if it was not executed yet."""
        with self._database.read() as connection:
            return reading.run_row(connection, result_digest)

    def test_case_row(self, test_case: str) -> StoredCase:
        """Read a test case with the content that it needs to be made again."""
        with self._database.read() as connection:
            return reading.test_case_row(connection, test_case)

    def artifacts(self, result_digest: str) -> tuple[Artifact, ...]:
        """List the kept files of a run."""
        with self._database.read() as connection:
            return reading.artifacts(connection, result_digest)

    def content(self, kind: str, digest: str) -> Any:
        """Read an ``odd``, ``scenario``, ``architecture`` or ``concept``."""
        with self._database.read() as connection:
            return reading.content(connection, kind, digest)

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
            return summaries.worst_runs(
                connection,
                campaign,
                fsr,
                limit=limit,
                architecture=architecture,
                scenario=scenario,
                verdict=None if verdict is None else verdict.value,
            )

    def results(self, campaign: str) -> ResultTable:
        """Return every executed run of a campaign as the view ``v_runs`` shows it."""
        with self._database.read() as connection:
            return summaries.results(connection, campaign)

    def figures(self, campaign: str) -> Figures:
        """Return every executed run of a campaign as columns."""
        with self._database.read() as connection:
            return figures.read_figures(connection, campaign)

    def compared(self, campaign: str, of: Collection[str], *, is_named: bool = False) -> Compared:
        """Return the planned cases of some architectures with all that compares them."""
        with self._database.read() as connection:
            return compared.read_compared(connection, campaign, of, is_named=is_named)

    # Integrity

    def result_table_hash(self, campaign: str) -> str:
        """Hash the results of a campaign; equal for every execution of one plan."""
        with self._database.read() as connection:
            return summaries.result_table_hash(connection, campaign)

    def verify(self) -> tuple[Finding, ...]:
        """Name everything in the database that is not as it was written."""
        with self._database.read() as connection:
            return tuple(verification.verify(connection))

    def unsound(self, campaign: str) -> tuple[Finding, ...]:
        """Name what is not as it was written of all that the summaries of a campaign rest on."""
        with self._database.read() as connection:
            return tuple(soundness.unsound(connection, campaign))

    def info(self) -> DatabaseInfo:
        """Say what the database holds."""
        with self._database.read() as connection:
            return summaries.info(connection, self.location)
