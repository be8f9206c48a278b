"""Cut a plan into blocks of work: which ordinals, and whether anything is missing there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.store import tables
from adeye.store.accounts import account_whole
from adeye.store.pending import lacks_result, lacks_verdict
from adeye.store.recording import write_tallies

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from sqlalchemy import Connection


def block_bounds(ends: Iterable[int], block_size: int) -> Iterator[tuple[int, int]]:
    """Cut ordinals into blocks that cross no end of a stretch.

    Args:
        ends: Ordinals behind the last case of each stretch of one structure.
        block_size: Most ordinals in a block.

    Raises:
        ValueError: A block would have no ordinal.
    """
    if block_size < 1:
        msg = f"block_size is {block_size}, at least 1 is needed"
        raise ValueError(msg)
    start = 0
    for end in ends:
        for first in range(start, end, block_size):
            yield first, min(first + block_size, end)
        start = end


def save_work(
    connection: Connection, campaign_id: str, ends: Iterable[int], block_size: int
) -> None:
    """Save the blocks of a campaign; those that need nothing are done at once, with tallies."""
    for first, end in block_bounds(ends, block_size):
        if lacks_result(connection, campaign_id, first, end):
            kind = "execute"
        elif lacks_verdict(connection, campaign_id, first, end):
            kind = "judge"
        else:
            kind = "reused"
        inserted = connection.execute(
            tables.work.insert()
            .values(
                campaign_id=campaign_id,
                kind=kind,
                from_ordinal=first,
                to_ordinal=end,
                state="done" if kind == "reused" else "pending",
                attempt=0,
                failures=0,
            )
            .returning(tables.work.c.id)
        )
        work_id = inserted.scalar_one()
        if kind == "reused":
            write_tallies(connection, work_id)
    # If everything is known already, no block comes to an end later.
    account_whole(connection, campaign_id)
