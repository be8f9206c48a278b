"""Tables about the cases of a campaign: counts of them, what pairs them, and their runs.

Every one can be told from plan and results, which ``verification`` does; they are there so that the
views need not look at a million test cases.
"""

from __future__ import annotations

from typing import Final

from sqlalchemy import CheckConstraint, Column, ForeignKey, Index, Integer, Table

from adeye.store.column_kinds import (
    coded,
    count_column,
    flag_column,
    metadata,
    row_hash_column,
    text_column,
)


def _campaign(*, key: bool = False) -> Column[str]:
    return Column(
        "campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


case_count = Table(
    "case_count",
    metadata,
    _campaign(key=True),
    text_column("scenario", key=True),
    text_column("architecture", key=True),
    text_column("fault_entry", key=True),
    count_column("planned"),
    row_hash_column(),
)
"""How many cases a campaign plans."""

case_match = Table(
    "case_match",
    metadata,
    _campaign(key=True),
    count_column("first_ordinal", key=True),
    count_column("ordinal", key=True),
    text_column("fault_entry"),
    row_hash_column(),
    sqlite_with_rowid=False,
)
"""Cases of several architectures in one situation of a scenario under the same faults: they go by
the first of them, so that those of one situation lie together and in the order of the plan."""

case_run = Table(
    "case_run",
    metadata,
    _campaign(key=True),
    count_column("ordinal", key=True),
    Column("run_number", Integer, ForeignKey("run.number"), nullable=False),
    row_hash_column(),
    sqlite_with_rowid=False,
)
"""The run of each case of the blocks that are done, by its number."""

case_tally = Table(
    "case_tally",
    metadata,
    Column("work_id", Integer, ForeignKey("work.id"), primary_key=True, autoincrement=False),
    _campaign(),
    text_column("scenario", key=True),
    text_column("architecture", key=True),
    text_column("fault_entry", key=True),
    count_column("runs"),
    count_column("exercised"),
    row_hash_column(),
    CheckConstraint("exercised BETWEEN 0 AND runs", name="exercised"),
    Index(None, "campaign_id"),
)
"""How many cases of a block that is done have a run, and a run that exercises an FSR."""

case_repeat = Table(
    "case_repeat",
    metadata,
    _campaign(key=True),
    text_column("fsr_id", key=True),
    text_column("architecture", key=True),
    text_column("scenario", key=True),
    count_column("passed"),
    count_column("exercised"),
    count_column("unheld"),
    row_hash_column(),
)
"""How many of the runs that PASS, or exercise, an FSR repeat the result of another such run, once
all blocks are done: over all scenarios (an empty word) whether one does or not, with the number of
rows of ``never_held``, so that none is lost unseen; in a scenario only where one does."""

never_held = Table(
    "never_held",
    metadata,
    _campaign(key=True),
    text_column("fsr_id", key=True),
    text_column("architecture", key=True),
    count_column("place", key=True),
    text_column("antecedent"),
    flag_column("decides"),
    row_hash_column(),
)
"""Implications below the top level whose antecedent held in no run that PASSes, once all blocks are
done; they decide where a run satisfies the FSR only because of that."""

RECOUNTED: Final = (case_count, case_match, case_run, case_tally, case_repeat, never_held)
"""Tables that plan and results tell whole: verification makes them again instead of trusting a
ledger, which would list a million of their rows."""
