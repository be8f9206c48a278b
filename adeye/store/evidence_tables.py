"""The tables that keep evidence whole: ledger and seals, roots, sessions, withdrawals.

A row of another table is worth what these say about it: the ledger counts and sums what every
transaction added, a seal says the same of one run, and a root is one hash over a whole campaign.
"""

from __future__ import annotations

from typing import Final

from sqlalchemy import BigInteger, Column, ForeignKey, Index, Integer, String, Table

from adeye.store.column_kinds import (
    count_column,
    digest_column,
    flag_column,
    metadata,
    row_hash_column,
    text_column,
)

SEALED: Final = (
    "run", "metric", "timing", "criticality", "verdict", "event", "chain", "basis", "extreme",
    "kept_trace", "plugin",
)  # fmt: skip
"""What a run has rows in; ``plugin`` is every table of metrics of plug-ins."""


def _place_number() -> Column[int]:
    return Column("number", Integer, primary_key=True, autoincrement=False)


def _campaign(*, key: bool = False) -> Column[str]:
    return Column(
        "campaign_id", String(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


ledger = Table(
    "ledger",
    metadata,
    _place_number(),
    count_column("place", key=True),
    text_column("table_name"),
    flag_column("is_last"),
    count_column("row_count"),
    Column("total", String(32), nullable=False),
    text_column("detail"),
    row_hash_column(),
)
"""What transaction ``number`` added to a table: how many rows, the sum of their hashes (and of a
hash of this row, see ``ledger.offset``), and, but for tables that seals cover, which rows."""

seal = Table(
    "seal",
    metadata,
    Column("run_number", Integer, ForeignKey("run.number"), primary_key=True, autoincrement=False),
    count_column("number", key=True),
    *(Column(f"{name}_sum", BigInteger, nullable=False) for name in SEALED),
    row_hash_column(),
)
"""What transaction ``number`` of the ledger added to one run: by table, the sum of the row hashes
modulo 2**48."""

campaign_root = Table(
    "campaign_root",
    metadata,
    _campaign(key=True),
    count_column("leaves"),
    digest_column("root"),
    row_hash_column(),
)
"""Merkle root over a complete campaign, see ``roots``."""

session = Table(
    "session",
    metadata,
    _place_number(),
    _campaign(),
    text_column("at"),
    text_column("who"),
    text_column("host"),
    text_column("tool"),
    text_column("packages_digest"),
    text_column("cpu"),
    text_column("provenance"),
    row_hash_column(),
    Index(None, "campaign_id"),
)
"""Who planned, executed or judged a campaign, when, and with what; one row for each command."""

withdrawal = Table(
    "withdrawal",
    metadata,
    _place_number(),
    digest_column("result_digest", "run.result_digest"),
    text_column("at"),
    text_column("author"),
    text_column("reason"),
    row_hash_column(),
    Index(None, "result_digest"),
)
"""Results that are no evidence any more. They stay as they are."""

LEDGER: Final = (ledger, seal)
"""Tables that tell of all others, and are told of by none."""
