"""The door to a database for whoever asks for campaigns and runs: nothing that writes is loaded.

What it takes to hold a database against its ledger, or to name what is altered, is loaded when it
is asked for.
"""

from __future__ import annotations

from contextlib import ExitStack
from typing import Self

from adeye.store import schema
from adeye.store.database import Database, Door, Part, reading
from adeye.store.evidence.vouched import Vouched
from adeye.store.location import Location, Place, locate
from adeye.store.read import campaigns as stored
from adeye.store.records import DatabaseInfo, Finding


class Reader(Door):
    """Plans, results and verdicts in one database; see ``repository`` for the contract."""

    @classmethod
    def open(cls, place: Place = None) -> Self:
        """Open a database that exists, by default ``.adeye/adeye.db``.

        Args:
            place: A path, ``sqlite:///PATH`` or ``postgresql://…``.

        Raises:
            InputError: The location is not supported, or there is nothing.
            PlatformError: It cannot be opened, is not ours, or has another schema version.
        """
        location = locate(place)
        schema.require_exists(location)
        return cls._opened(location)

    @classmethod
    def _opened(cls, location: Location, *, create: bool = False) -> Self:
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
        """Close, and tell content that broke its reader, see ``verification.close``."""
        if not isinstance(raised[1], Exception):
            self.close()
            return
        from adeye.store.evidence import verification

        verification.close(self, raised[1])

    evidence = Part(Vouched)
    """What vouches for results."""

    campaigns = reading(stored.campaigns)
    latest_campaign = reading(stored.latest_campaign)
    latest_ids = reading(stored.latest_ids)
    find_campaign = reading(stored.find_campaign)
    campaign_before = reading(stored.campaign_before)
    work_state = reading(stored.work_state)
    progress = reading(stored.progress)
    fsr_status = reading(stored.fsr_status)
    gate = reading(stored.gate)
    never_held = reading(stored.never_held)
    failed_channels = reading(stored.failed_channels)
    contacts = reading(stored.contacts)
    find_run = reading(stored.find_run)
    run_row = reading(stored.run_row)
    test_case_row = reading(stored.test_case_row)
    content = reading(stored.content)
    results = reading(stored.results)
    measures = reading(stored.measures)
    judged_digests = reading(stored.judged_digests)
    worst_runs = reading(stored.worst_runs)
    worst_run = reading(stored.worst_run)
    contested = reading(stored.contested)
    tried_again = reading(stored.tried_again)
    unmeasured = reading(stored.unmeasured)
    uncertified = reading(stored.uncertified)

    def info(self) -> DatabaseInfo:
        """Say what the database holds."""
        with self._database.read() as connection:
            return stored.info(connection, self.location)

    def verify(self) -> tuple[Finding, ...]:
        """Name everything in the database that is not as it was written."""
        from adeye.store.evidence import verification

        with self._database.read() as connection:
            return tuple(verification.verify(connection))
