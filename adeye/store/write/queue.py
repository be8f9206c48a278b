"""The work of a campaign as runners share it: what they want of it, and what others hold.

A block is what is leased, completed and counted, always as a whole. So a block of which only a part
is wanted is cut before it is leased: the wanted stretch becomes a block of its own, and the others
wait, to be claimed by whoever wants them.

Claim and completion are one transaction each. ``attempt`` counts the claims of a block and fences
off a worker whose lease was taken over: whatever it brings later is dropped.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any, Final

import numpy as np
from sqlalchemy import Connection, Row, Select, func, select, text, update

from adeye.signals import Bools
from adeye.store.accounts import account_whole
from adeye.store.block import JudgedBlock, RunBlock
from adeye.store.cases import JUDGED_CASES, open_cases
from adeye.store.database import Door, reading, sharing
from adeye.store.owner import Owner, boot_clock_s, clock_now, is_abandoned
from adeye.store.records import RAISED, Block
from adeye.store.tables import work
from adeye.store.texts import utc_text
from adeye.store.write import results
from adeye.store.write.half_steps import judge_with_uncertainty

# --- Which test cases of a campaign a runner wants, and the cutting of blocks that it wants in
# part.


@dataclass
class WantedBlocks:
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

    def stretches(self, first: int, end: int) -> list[tuple[int, int]]:
        """Cut a range of ordinals where wanted and unwanted ones meet."""
        if self.ordinals is None:
            return [(first, end)]
        chosen = self.ordinals[first:end]
        cuts = (np.flatnonzero(chosen[1:] != chosen[:-1]) + 1 + first).tolist()
        return list(zip([first, *cuts], [*cuts, end], strict=True))


def add_block(
    connection: Connection, campaign_id: str, kind: str, bounds: tuple[int, int], **others: Any
) -> int:
    """Add a block of work, which is free unless told otherwise; return its number.

    Args:
        connection: In a write transaction.
        campaign_id: The campaign.
        kind: Of work.
        bounds: Its first ordinal, and the one behind its last.
        others: Columns that are not those of a new block.
    """
    new: dict[str, Any] = {"state": "pending", "attempt": 0, "failures": 0}
    made = work.insert().values(
        campaign_id=campaign_id,
        kind=kind,
        from_ordinal=bounds[0],
        to_ordinal=bounds[1],
        **new | others,
    )
    return int(connection.execute(made.returning(work.c.id)).scalar_one())


def cut_block(connection: Connection, block: Row[Any], wanted: WantedBlocks) -> tuple[int, int]:
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
    if len(stretches) == 1 or results.tallied(connection, block.id):
        return whole
    assert wanted.ordinals is not None
    own = next(item for item in stretches if wanted.ordinals[item[0]])
    connection.execute(
        update(work).where(work.c.id == block.id).values(from_ordinal=own[0], to_ordinal=own[1])
    )
    kept = {"failures": block.failures, "detail": block.detail}
    for stretch in stretches:
        if stretch != own:
            add_block(connection, block.campaign_id, block.kind, stretch, **kept)
    return own


# --- The queue of work: claim a block, renew, release, fail or complete it ------------------------

# A word that is no column keeps the search for a digest from becoming one through all ordinals.
_SHARES_NOTHING: Final = text("""NOT EXISTS (
    SELECT 1 FROM work held
    JOIN campaign_case own ON own.campaign_id = work.campaign_id
        AND own.ordinal >= work.from_ordinal AND own.ordinal < work.to_ordinal
    JOIN campaign_case other ON other.result_digest = own.result_digest
        AND other.campaign_id || '' = own.campaign_id AND other.ordinal >= held.from_ordinal
        AND other.ordinal < held.to_ordinal
    WHERE held.campaign_id = work.campaign_id AND held.state = 'leased' AND held.owner = :owner)""")
"""That a block has no result of one that its owner executes already: it will have it by then."""
DEFAULT_LEASE_S: Final = 60.0
MAX_FAILURES: Final = 3
"""Infrastructure errors of a block before it is split or quarantined."""


def claim_block(
    connection: Connection,
    owner: Owner | None = None,
    lease_s: float = DEFAULT_LEASE_S,
    *,
    campaign: str | None = None,
    wanted: WantedBlocks | None = None,
) -> Block | None:
    """Lease the next free block: pending, or leased by an owner that is dead or late; else None.

    Its cases may be none, if what it needed came in since; complete it as well.

    Args:
        connection: In a write transaction.
        owner: Who leases it; None for this process.
        lease_s: For how long [s].
        campaign: Id of one campaign; None for any.
        wanted: Only blocks with a test case that is wanted. One that is wanted in part is cut, and
            its other test cases become blocks of their own.
    """
    candidates = select(work).order_by(work.c.id)
    if campaign is not None:
        candidates = candidates.where(work.c.campaign_id == campaign)
    asked, holder = wanted or WantedBlocks(), (owner or Owner.current()).to_text()
    pending = candidates.where(work.c.state == "pending", _SHARES_NOTHING).params(owner=holder)
    leased = candidates.where(work.c.state == "leased")
    now = clock_now(connection)
    if asked.is_anything:
        # On a server others claim at the same time: what one of them looks at is left to it.
        found = connection.execute(_unlocked(pending.limit(1))).first()
    else:
        found = _first_unlocked(connection, asked, connection.execute(pending).all())
    if found is None:
        late = [item for item in connection.execute(leased).all() if is_abandoned(item, now)]
        found = _first_unlocked(connection, asked, late)
    if found is None:
        return None
    bounds = cut_block(connection, found, asked)
    attempt = found.attempt + 1
    connection.execute(
        update(work)
        .where(work.c.id == found.id)
        .values(state="leased", owner=holder, attempt=attempt, **_lease(now, lease_s))
    )
    cases = open_cases(connection, found.campaign_id, *bounds)
    return Block(found.id, found.campaign_id, attempt, cases, bounds)


def _unlocked(query: Select[Any]) -> Select[Any]:
    """Lock what a query finds, without what somebody else looks at; on SQLite nobody else does."""
    return query.with_for_update(skip_locked=True)


def _first_unlocked(
    connection: Connection, asked: WantedBlocks, blocks: Sequence[Row[Any]]
) -> Row[Any] | None:
    """Lock the first block that is wanted and still as it was seen."""
    for block in blocks:
        if asked.wants(block):
            same = select(work).where(
                work.c.id == block.id,
                work.c.state == block.state,
                work.c.attempt == block.attempt,
            )
            found = connection.execute(_unlocked(same)).first()
            if found is not None:
                return found
    return None


def open_elsewhere(
    connection: Connection, campaign_id: str, wanted: WantedBlocks, mine: Collection[int]
) -> int:
    """Count the wanted test cases in blocks that are not done, and not with the caller.

    Free ones count, too: somebody may be about to claim them, and they are nobody's until then.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
        wanted: What is wanted.
        mine: Numbers of the blocks that the caller holds.
    """
    found = select(work).where(
        work.c.campaign_id == campaign_id, work.c.state.in_(["pending", "leased"])
    )
    return sum(
        item.to_ordinal - item.from_ordinal
        for item in connection.execute(found.order_by(work.c.id)).all()
        if item.id not in mine and wanted.wants(item)
    )


def _lease(now: datetime, lease_s: float) -> dict[str, Any]:
    return {
        "until": utc_text(now + timedelta(seconds=lease_s)),
        "until_boot_s": boot_clock_s() + lease_s,
    }


def _change(connection: Connection, block: Block, **values: Any) -> bool:
    """Compare and set: only the present holder of the lease can change a block."""
    changed = connection.execute(
        update(work)
        .where(work.c.id == block.id, work.c.state == "leased", work.c.attempt == block.attempt)
        .values(**values)
    )
    return changed.rowcount == 1


def is_held(connection: Connection, block: Block) -> bool:
    """Tell whether the lease of a block is still that of whoever claimed it so."""
    found = connection.execute(
        select(work.c.attempt).where(work.c.id == block.id, work.c.state == "leased")
    ).scalar()
    return found == block.attempt


_FREE: Final[Mapping[str, Any]] = {"owner": None, "until": None, "until_boot_s": None}


def renew_lease(connection: Connection, block: Block, lease_s: float) -> bool:
    """Extend a lease; False if the block was taken over."""
    return _change(connection, block, **_lease(clock_now(connection), lease_s))


def release_block(connection: Connection, block: Block) -> bool:
    """Give a block back untouched; False if it was taken over."""
    return _change(connection, block, state="pending", **_FREE)


def quarantine_block(connection: Connection, block: Block, detail: str) -> bool:
    """Set a block aside with the reason; its runs stay NOT_RUN. False if it was taken over."""
    return _change(connection, block, state="quarantined", detail=detail, **_FREE)


def fail_block(connection: Connection, block: Block, detail: str) -> str | None:
    """Record an infrastructure error: retry, then halve the block, then quarantine the one case.

    Returns:
        The state that the block has now, None if it was taken over.
    """
    found = connection.execute(select(work).where(work.c.id == block.id)).one()
    failures = found.failures + 1
    if failures < MAX_FAILURES:
        values = {"state": "pending", "failures": failures, "detail": detail, **_FREE}
        return "pending" if _change(connection, block, **values) else None
    # What was counted of the whole block does not count for a half.
    if found.to_ordinal - found.from_ordinal == 1 or results.tallied(connection, block.id):
        return "quarantined" if quarantine_block(connection, block, detail) else None
    # Each half gets one try, so that a single bad case costs log2(size) more attempts.
    middle = (found.from_ordinal + found.to_ordinal) // 2
    half = {"failures": MAX_FAILURES - 1, "detail": detail}
    if not _change(connection, block, to_ordinal=middle, state="pending", **half, **_FREE):
        return None
    other = middle, found.to_ordinal
    add_block(connection, found.campaign_id, found.kind, other, **half)
    return "pending"


def note_failure(
    connection: Connection, campaign_id: str, bounds: tuple[int, int], detail: str
) -> None:
    """Note with the blocks that have one of some ordinals what it failed with elsewhere."""
    connection.execute(
        update(work)
        .where(
            work.c.campaign_id == campaign_id,
            work.c.from_ordinal < bounds[1],
            work.c.to_ordinal > bounds[0],
            work.c.detail.is_(None),
        )
        .values(detail=detail)
    )


def requeue_quarantined(connection: Connection, campaign_id: str) -> int:
    """Make quarantined blocks pending again; return how many.

    Who runs them again has been told what they failed with: that is said, and no longer refused.
    """
    changed = connection.execute(
        update(work)
        .where(work.c.campaign_id == campaign_id, work.c.state == "quarantined")
        .values(state="pending", failures=0, detail=func.replace(work.c.detail, RAISED, ""))
    )
    return changed.rowcount


def complete_block(
    connection: Connection, block: Block, runs: RunBlock | None, judged: JudgedBlock | None = None
) -> bool:
    """Save everything that a block needed, and its tallies; False if it was taken over.

    Args:
        connection: In a write transaction.
        block: As claimed.
        runs: Results of ``block.to_execute`` with their verdicts.
        judged: Verdicts of ``block.to_judge``.

    Raises:
        IntegrityError: A result or verdict contradicts one that exists.
        ValueError: Something that the block needs is missing, or a result is not of the block.
    """
    # What it failed with before stays told.
    if not _change(connection, block, state="done", **_FREE):
        return False
    expected = {case.result_digest for case in block.cases}
    foreign = {digest for part in (runs, judged) if part for digest in part.result_digests}
    foreign -= expected
    if foreign:
        raise ValueError(f"block {block.id}: results {sorted(foreign)} are not of this block")
    recorded = results.record_judged_runs(connection, runs) if runs else results.NOTHING
    if judged and judged.result_digests:
        results.require_same_traces(connection, judged)
        results.record_basis(connection, judged.result_digests, judged.basis)
        results.record_verdicts(connection, judged)
    elif runs and not recorded.existing:
        counted = results.count_block(connection, block.id, runs)
        if counted is not None:
            counted.save(connection)
            account_whole(connection, block.campaign)
            return True
    bounds = connection.execute(
        select(work.c.from_ordinal, work.c.to_ordinal).where(work.c.id == block.id)
    ).one()
    judge_with_uncertainty(connection, block.campaign, *bounds)
    still_open = open_cases(connection, block.campaign, *bounds)
    if still_open:
        msg = f"block {block.id} is not complete: {still_open[0]} and {len(still_open) - 1} more"
        raise ValueError(msg)
    results.write_tallies(connection, block.id)
    account_whole(connection, block.campaign)
    return True


def close_blocks(connection: Connection, campaign_id: str) -> int:
    """Count what has all its results although nobody completed its block; return how many blocks.

    Results may come from elsewhere. A free block that lacks some of them is cut, so that the rest
    is counted.
    """
    closed = 0
    free = select(work).where(work.c.campaign_id == campaign_id, work.c.state == "pending")
    waiting = list(connection.execute(free.order_by(work.c.id)).all())
    while waiting:
        block = waiting.pop()
        first, end = block.from_ordinal, block.to_ordinal
        has_all = np.ones(end, dtype=np.bool_)
        has_all[[case.ordinal for case in open_cases(connection, campaign_id, first, end)]] = False
        if not has_all[first:end].any():
            continue
        bounds = cut_block(connection, block, WantedBlocks(has_all))
        if bounds != (first, end):
            others = free.where(work.c.from_ordinal >= first, work.c.to_ordinal <= end)
            waiting += [item for item in connection.execute(others).all() if item.id != block.id]
        elif not has_all[first:end].all():
            # It was counted in part already, so it stays whole and open.
            continue
        connection.execute(update(work).where(work.c.id == block.id).values(state="done", **_FREE))
        results.write_tallies(connection, block.id)
        closed += 1
    if closed:
        account_whole(connection, campaign_id)
    return closed


# --- The work of a campaign as runners share it: what they want of it, and what others hold -------

_CHUNK: Final = 1_000


@dataclass(frozen=True, slots=True)
class NamedCase:
    """A test case by the names that people give, which stay when its content is edited.

    Attributes:
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        replicate: Number of the replicate.
        point: Swept values in SI as JSON.
    """

    scenario: str
    architecture: str
    fault_entry: str
    replicate: int
    point: str


class Queue(Door):
    """The blocks of campaigns in one database, each method in one transaction."""

    open_elsewhere = reading(open_elsewhere)
    requeue_quarantined = sharing(requeue_quarantined)

    def cases(self, campaign: str) -> Iterator[tuple[int, NamedCase, bool]]:
        """Read the test cases of a campaign: ordinal, names, and whether there is a result."""
        with self._database.read() as connection:
            found = connection.exec_driver_sql(
                "SELECT c.ordinal, c.scenario, c.architecture, t.fault_entry, t.replicate, "
                "c.point, r.number FROM campaign_case c "
                "JOIN test_case t ON t.digest = c.test_case_digest "
                "LEFT JOIN run r ON r.result_digest = c.result_digest "
                "WHERE c.campaign_id = ? ORDER BY c.ordinal",
                (campaign,),
                execution_options={"yield_per": _CHUNK},
            )
            for ordinal, *names, number in found:
                yield ordinal, NamedCase(*names), number is not None

    def failed(self, campaign: str) -> frozenset[int]:
        """List the ordinals of a campaign of which a mandatory FSR has a FAIL or an ERROR."""
        found = self._ask(
            f"SELECT DISTINCT c.ordinal FROM {JUDGED_CASES} "  # noqa: S608 - own names
            "WHERE c.campaign_id = ? AND f.mandatory = 1 AND v.verdict IN ('FAIL', 'ERROR')",
            campaign,
        )
        return frozenset(item.ordinal for item in found)

    def earlier(self, campaign: str) -> list[str]:
        """List the other campaigns of the same ODD id, the one that was used last first."""
        found = self._ask(
            "SELECT v.campaign FROM v_campaigns v JOIN campaign c ON c.odd_id = v.odd "
            "WHERE c.id = ? AND v.campaign <> ? ORDER BY v.recency, v.campaign",
            *(campaign, campaign),
        )
        return [str(item.campaign) for item in found]
