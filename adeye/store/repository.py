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

from collections.abc import Sequence
from pathlib import Path
from typing import Self

from adeye.store import schema
from adeye.store.database import Part, create_parent, reading, sharing, writing
from adeye.store.evidence import ledger_check, verification
from adeye.store.evidence.roots import Evidence
from adeye.store.location import Location, Place, locate
from adeye.store.read.bulk import read_compared, read_figures, read_made
from adeye.store.read.checking import (
    idle_events,
    injected_faults,
    unbegun_events,
)
from adeye.store.read.reader import Reader
from adeye.store.read.rejudging import Again
from adeye.store.records import Finding
from adeye.store.write import content, merge, planning
from adeye.store.write import queue as leasing
from adeye.store.write.merge import Copied, Merged, Origin
from adeye.store.write.queue import Queue
from adeye.store.write.studies import Hindsight


class Repository(Reader):
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
        return cls._opened(location, create=create)

    def reopen(self) -> None:
        """Go on with what is at the place of the database by now; see ``Database.reopen``."""
        self._database.reopen()

    # Plans

    save_content = writing(content.save_content)
    save_concept = writing(content.save_concept)

    plan_campaign = writing(planning.plan_campaign)

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

    queue = Part(Queue)
    """The work of a campaign, as runners share it."""
    claim_block = sharing(leasing.claim_block)
    renew_lease = sharing(leasing.renew_lease)
    release_block = sharing(leasing.release_block)
    fail_block = sharing(leasing.fail_block)
    quarantine_block = sharing(leasing.quarantine_block)
    complete_block = sharing(leasing.complete_block, shared=False)

    # Judging again

    again = Part(Again)
    """What judging results again needs, and where it goes."""

    # Forks and hindsight

    hindsight = Part(Hindsight)
    """What executing other runs beside stored ones told."""
    evidence = Part(Evidence)
    """What vouches for results."""

    # Reading

    unbegun_events = reading(unbegun_events)
    idle_events = reading(idle_events)
    injected_faults = reading(injected_faults)
    figures = reading(read_figures)
    compared = reading(read_compared)
    made = reading(read_made)

    # Integrity

    def unsound(self, campaign: str) -> tuple[Finding, ...]:
        """Name what is not as it was written of all that the summaries of a campaign rest on."""
        with self._database.read() as connection:
            return tuple(verification.unsound(connection, campaign))

    require_sound = reading(verification.require_sound)
    require_no_campaign_gone = reading(ledger_check.require_no_campaign_gone)
