"""Save forks beside the campaigns, and find them: they belong to a run, never to a selection.

No row of ``campaign_case`` names a fork, so no count, verdict or gate of a campaign sees it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from adeye.store import tables
from adeye.store.block import JudgedBlock
from adeye.store.encoding import row
from adeye.store.inserting import insert_rows
from adeye.store.recording import record_runs, record_verdicts
from adeye.store.rows import ForkRecord

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sqlalchemy import Connection, Row

    from adeye.store.block import RunBlock


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
        msg = "the results are not those of the forks"
        raise ValueError(msg)
    insert_rows(
        connection,
        tables.test_case,
        [_test_case(connection, fork) for fork in forks],
        ignore_existing=True,
    )
    recorded = record_runs(connection, block)
    record_verdicts(
        connection,
        JudgedBlock(block.result_digests, block.verdicts),
        results=block.results,
        existing=recorded.existing,
        differing=recorded.differing,
    )
    rows = [
        row(
            tables.fork,
            (fork.result_digest, fork.test_case, fork.origin, fork.from_tick, fork.authority),
        )
        for fork in forks
    ]
    insert_rows(connection, tables.fork, rows, ignore_existing=True)


def _test_case(connection: Connection, fork: ForkRecord) -> tuple[object, ...]:
    """Describe the test case of a fork: its origin's, under the identity of its own."""
    case, run = tables.test_case, tables.run
    found = connection.execute(
        select(case)
        .join(run, run.c.test_case_digest == case.c.digest)
        .where(run.c.result_digest == fork.origin)
    ).one()
    return row(case, (fork.test_case, *tuple(found)[1:-1]))


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
