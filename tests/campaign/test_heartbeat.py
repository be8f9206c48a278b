"""Leases are renewed as long as the block inside runs, and no longer."""

from __future__ import annotations

import threading
from typing import Any, cast

from adeye.campaign.run import renewing
from adeye.errors import PlatformError
from adeye.store.records import Block


class Leases:
    """Remembers what was renewed, and says when it was so often enough."""

    def __init__(self, enough: int, *, fails: bool = False) -> None:
        self.renewed: list[tuple[int, float]] = []
        self.is_enough = threading.Event()
        self._enough, self._fails = enough, fails

    def renew_lease(self, block: Block, lease_s: float) -> bool:
        self.renewed.append((block.id, lease_s))
        if len(self.renewed) >= self._enough:
            self.is_enough.set()
        if self._fails:
            msg = "database is locked"
            raise PlatformError(msg)
        return True


def beaten(leases: Leases) -> None:
    blocks = [Block(number, "c", 1, ()) for number in (3, 4)]
    with renewing(cast("Any", leases), lambda: blocks, 0.04):
        assert leases.is_enough.wait(timeout=30.0)


def test_every_block_that_is_held_is_renewed_again_and_again() -> None:
    leases = Leases(6)
    beaten(leases)
    assert leases.renewed[:4] == [(3, 0.04), (4, 0.04)] * 2


def test_what_cannot_be_renewed_now_is_tried_again() -> None:
    leases = Leases(4, fails=True)
    beaten(leases)


def test_nothing_is_renewed_after_the_end() -> None:
    beaten(Leases(1))
    assert "heartbeat" not in {thread.name for thread in threading.enumerate()}
