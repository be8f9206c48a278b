"""Check quickly what the summaries of a campaign are read from: its plan, blocks and tallies.

Verdicts are folded from tallies, which are few. Whether the results behind them are as they were
written takes a look at every row, which is what ``verification`` does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sqlalchemy import func, select, text

from adeye.store import tables
from adeye.store.stored import Finding
from adeye.store.summaries import progress
from adeye.store.verification import altered_definitions, altered_rows

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection

_TOO_MANY = text(
    "SELECT fsr, architecture, scenario, planned, n_not_run FROM v_fsr_status "
    "WHERE campaign = :campaign AND n_not_run < 0"
)

_UNCOUNTED = text("""
    SELECT DISTINCT f.fsr_id, f.architecture FROM campaign_fsr f
    LEFT JOIN case_repeat a ON a.campaign_id = f.campaign_id AND a.fsr_id = f.fsr_id
        AND a.architecture = f.architecture AND a.scenario = ''
    WHERE f.campaign_id = :campaign AND f.applicable = 1
        AND NOT EXISTS (
            SELECT 1 FROM work w WHERE w.campaign_id = f.campaign_id AND w.state <> 'done')
        AND COALESCE(a.unheld, -1) <> (
            SELECT COUNT(*) FROM never_held h WHERE h.campaign_id = f.campaign_id
                AND h.fsr_id = f.fsr_id AND h.architecture = f.architecture)
    ORDER BY f.fsr_id, f.architecture""")


def unsound(connection: Connection, campaign: str) -> Iterator[Finding]:
    """Name what is not as it was written among all that the summaries of a campaign rest on.

    Args:
        connection: In a transaction.
        campaign: Id of the campaign.
    """
    yield from altered_definitions(connection)
    counted = (tables.tally, tables.case_repeat, tables.never_held)
    for table in (tables.campaign, tables.campaign_fsr, *counted):
        own = table.c.id if table is tables.campaign else table.c.campaign_id
        rows = connection.execute(table.select().where(own == campaign))
        yield from altered_rows(table, map(tuple, rows))
    yield from _lost(connection, campaign)
    for item in connection.execute(_TOO_MANY, {"campaign": campaign}):
        judged = f"{item.planned - item.n_not_run} verdicts for {item.planned} planned cases"
        yield Finding("tally", f"{item.fsr} {item.architecture} {item.scenario}", judged)
    for item in connection.execute(_UNCOUNTED, {"campaign": campaign}):
        problem = "what counts once, or never held, is missing"
        yield Finding("case_repeat", f"{item.fsr_id} {item.architecture}", problem)


def _lost(connection: Connection, campaign: str) -> Iterator[Finding]:
    """Compare counts of what was planned, of what is in blocks, and of what is there."""
    work = tables.work
    plan = tables.campaign.select().where(tables.campaign.c.id == campaign)
    planned = connection.execute(plan).one().planned
    blocks = select(func.coalesce(func.sum(work.c.to_ordinal - work.c.from_ordinal), 0))
    covered = connection.execute(blocks.where(work.c.campaign_id == campaign)).scalar_one()
    found = progress(connection, campaign)
    if found.planned != planned:
        problem = f"{found.planned} of {planned} planned cases are there"
        yield Finding("campaign_case", campaign, problem)
    if covered != planned:
        yield Finding("work", campaign, f"blocks cover {covered} of {planned} cases")
    if found.executed < found.accounted:
        problem = f"{found.executed} results are there, blocks of {found.accounted} cases are done"
        yield Finding("run", campaign, problem)
