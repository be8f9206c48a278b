"""What a run is besides a run of a campaign, and how far the blocks of a campaign are."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from adeye.store import tables
from adeye.store.owner import clock_now, is_abandoned
from adeye.store.rows import ForkRecord
from adeye.store.stored import WorkState
from adeye.store.tables import work

if TYPE_CHECKING:
    from sqlalchemy import Connection, Row


def find_fork(connection: Connection, result_digest: str) -> ForkRecord | None:
    """Say what a run is a fork of; None if it is none."""
    table = tables.fork
    found = connection.execute(table.select().where(table.c.result_digest == result_digest)).first()
    return None if found is None else _fork(found)


@dataclass(frozen=True, slots=True)
class DriveRef:
    """A drive of a reference driver that no campaign has planned.

    Attributes:
        origin: Result digest of a run that it is held against.
        test_case: Of the drive.
        architecture: Id of the architecture that the driver is.
    """

    origin: str
    test_case: str
    architecture: str


def find_drive(connection: Connection, result_digest: str) -> DriveRef | None:
    """Say what a run is held against; None if it is no drive, or a run of a campaign too."""
    found = connection.exec_driver_sql(
        "SELECT b.result_digest, r.test_case_digest, a.id FROM benchmark b "
        "JOIN run r ON r.result_digest = b.drive_digest "
        "JOIN test_case t ON t.digest = r.test_case_digest "
        "JOIN architecture a ON a.digest = t.architecture_digest "
        "WHERE b.drive_digest = ? AND NOT EXISTS "
        "(SELECT 1 FROM campaign_case c WHERE c.result_digest = b.drive_digest) "
        "ORDER BY b.result_digest LIMIT 1",
        (result_digest,),
    ).first()
    return None if found is None else DriveRef(*found)


def fork_of_case(connection: Connection, test_case: str) -> ForkRecord | None:
    """Say what the runs of a test case are forks of; None if it is the case of no fork.

    All forks of one test case have the same authority from the same tick.
    """
    table = tables.fork
    found = connection.execute(
        table.select()
        .where(table.c.test_case_digest == test_case)
        .order_by(table.c.result_digest)
        .limit(1)
    ).first()
    return None if found is None else _fork(found)


def _fork(found: Row[Any]) -> ForkRecord:
    return ForkRecord(
        found.result_digest,
        found.test_case_digest,
        found.origin_digest,
        found.from_tick,
        found.authority,
    )


def find_half_step(connection: Connection, result_digest: str) -> tuple[str, str] | None:
    """Give test case and run with the whole step of a twin; None if it is none."""
    table = tables.half_step
    found = connection.execute(table.select().where(table.c.result_digest == result_digest)).first()
    return None if found is None else (found.test_case_digest, found.origin_digest)


def work_state(connection: Connection, campaign_id: str) -> WorkState:
    """Count the blocks of a campaign by state; a block whose owner is gone counts as pending."""
    blocks = connection.execute(select(work).where(work.c.campaign_id == campaign_id)).all()
    now = clock_now(connection)
    counted = Counter(
        "pending" if block.state == "leased" and is_abandoned(block, now) else block.state
        for block in blocks
    )
    return WorkState(
        pending=counted["pending"],
        leased=counted["leased"],
        done=counted["done"],
        quarantined=counted["quarantined"],
    )
