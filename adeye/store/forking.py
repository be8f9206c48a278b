"""Save forks beside the campaigns, and find them: they belong to a run, never to a selection.

No row of ``campaign_case`` names a fork, so no count, verdict or gate of a campaign sees it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sqlalchemy import select

from adeye.store import tables
from adeye.store.block import JudgedBlock
from adeye.store.encoding import row
from adeye.store.inserting import insert_rows
from adeye.store.recording import record_runs, record_verdicts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sqlalchemy import Connection

    from adeye.store.block import RunBlock
    from adeye.store.rows import ForkRecord


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
