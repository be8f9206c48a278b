"""Renew leases while their holder lives: slow blocks keep theirs, a stopped runner loses them."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

from adeye.errors import AdeyeError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from adeye.store.repository import Repository
    from adeye.store.stored import Block

BEATS_PER_LEASE = 4
"""Renewals in the time of a lease: some may fail before it ends."""


@contextmanager
def renewing(
    repository: Repository, held: Callable[[], Iterable[Block]], lease_s: float
) -> Iterator[None]:
    """Renew the leases of blocks from a thread of its own.

    A lease that cannot be renewed, because the database is busy or somebody took the block over, is
    left as it is: who completes a block is told by the database.

    Args:
        repository: The database.
        held: Gives the blocks that are held now; called from the thread.
        lease_s: For how long they are leased from each renewal on [s].
    """
    over = threading.Event()

    def beat() -> None:
        while not over.wait(lease_s / BEATS_PER_LEASE):
            for block in held():
                if over.is_set():
                    return
                try:
                    repository.renew_lease(block, lease_s)
                except AdeyeError:
                    # The next beat tries again; the lease tells everybody else how long to wait.
                    continue

    thread = threading.Thread(target=beat, name="heartbeat", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
