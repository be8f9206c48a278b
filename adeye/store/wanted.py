"""Which test cases of a campaign a runner wants, and the cutting of blocks that it wants in part.

A block is what is leased, completed and counted, always as a whole. So a block of which only a part
is wanted is cut before it is leased: the wanted stretch becomes a block of its own, and the others
wait, to be claimed by whoever wants them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import update

from adeye.store.recording import tallied
from adeye.store.tables import work

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sqlalchemy import Connection, Row

    from adeye.signals import Bools


@dataclass
class Wanted:
    """What a runner claims.

    Attributes:
        ordinals: (N,) whether each test case of the campaign is wanted; None for all.
        aside: Numbers of blocks that are not claimed again.
        within: Ordinals from which and below which a block has to lie; None for anywhere.
    """

    ordinals: Bools | None = None
    aside: set[int] = field(default_factory=set)
    within: tuple[int, int] | None = None

    @property
    def is_anything(self) -> bool:
        """Whether no free block is refused."""
        return self.ordinals is None and self.within is None and not self.aside

    def wants(self, block: Row[Any]) -> bool:
        """Tell whether a row of ``work`` has a test case that is wanted."""
        if block.id in self.aside:
            return False
        first, end = block.from_ordinal, block.to_ordinal
        if self.within is not None and not (self.within[0] <= first and end <= self.within[1]):
            return False
        return self.ordinals is None or bool(self.ordinals[first:end].any())

    def first(self, blocks: Iterable[Row[Any]]) -> Row[Any] | None:
        """Return the first of some rows of ``work`` that is wanted."""
        return next((block for block in blocks if self.wants(block)), None)

    def stretches(self, first: int, end: int) -> list[tuple[int, int]]:
        """Cut a range of ordinals where wanted and unwanted ones meet."""
        if self.ordinals is None:
            return [(first, end)]
        chosen = self.ordinals[first:end]
        cuts = (np.flatnonzero(chosen[1:] != chosen[:-1]) + 1 + first).tolist()
        return list(zip([first, *cuts], [*cuts, end], strict=True))


def cut_block(connection: Connection, block: Row[Any], wanted: Wanted) -> tuple[int, int]:
    """Cut a free block so that its number stands for its first wanted stretch alone.

    The other stretches become blocks of their own, which are free. A block of which something is
    counted stays whole: all its cases have results then, and its count would be of no part.

    Args:
        connection: In a write transaction.
        block: A row of ``work`` that may be claimed and has a wanted test case.
        wanted: What is wanted.

    Returns:
        First ordinal of the block, and the one behind its last.
    """
    whole = block.from_ordinal, block.to_ordinal
    stretches = wanted.stretches(*whole)
    if len(stretches) == 1 or tallied(connection, block.id):
        return whole
    assert wanted.ordinals is not None
    own = next(item for item in stretches if wanted.ordinals[item[0]])
    connection.execute(
        update(work).where(work.c.id == block.id).values(from_ordinal=own[0], to_ordinal=own[1])
    )
    free = {"owner": None, "until": None, "until_boot_s": None, "state": "pending", "attempt": 0}
    kept = {name: getattr(block, name) for name in ("campaign_id", "kind", "failures", "detail")}
    for first, end in stretches:
        if (first, end) != own:
            connection.execute(
                work.insert().values(from_ordinal=first, to_ordinal=end, **kept, **free)
            )
    return own
