"""The tables that keep evidence whole: ledger and seals, roots, sessions, withdrawals.

A row of another table is worth what these say about it: the ledger counts and sums what every
transaction added, a seal says the same of one run, and a root is one hash over a whole campaign.
"""

from __future__ import annotations

from typing import Final

from sqlalchemy import BigInteger, Column, ForeignKey, Index, Integer, String, Table

from adeye.store import column_kinds

_text, _count = column_kinds.text_column, column_kinds.count_column
_digest, _row_hash = column_kinds.digest_column, column_kinds.row_hash_column

SEALED: Final = (
    "run", "metric", "timing", "criticality", "verdict", "event", "chain", "basis", "extreme",
    "kept_trace", "plugin",
)  # fmt: skip
"""What a run has rows in; ``plugin`` is every table of metrics of plug-ins."""


def _number() -> Column[int]:
    return Column("number", Integer, primary_key=True, autoincrement=False)


def _campaign(*, key: bool = False) -> Column[str]:
    return Column(
        "campaign_id", String(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


ledger = Table(
    "ledger",
    column_kinds.metadata,
    _number(),
    _count("place", key=True),
    _text("table_name"),
    column_kinds.flag_column("is_last"),
    _count("row_count"),
    Column("total", String(32), nullable=False),
    _text("detail"),
    _row_hash(),
)
"""What transaction ``number`` added to a table: how many rows, the sum of their hashes (and of a
hash of this row, see ``ledger.offset``), and, but for tables that seals cover, which rows."""

seal = Table(
    "seal",
    column_kinds.metadata,
    Column("run_number", Integer, ForeignKey("run.number"), primary_key=True, autoincrement=False),
    _count("number", key=True),
    *(Column(f"{name}_sum", BigInteger, nullable=False) for name in SEALED),
    _row_hash(),
)
"""What transaction ``number`` of the ledger added to one run: by table, the sum of the row hashes
modulo 2**48."""

campaign_root = Table(
    "campaign_root",
    column_kinds.metadata,
    _campaign(key=True),
    _count("leaves"),
    _digest("root"),
    _row_hash(),
)
"""Merkle root over a complete campaign, see ``roots``."""

session = Table(
    "session",
    column_kinds.metadata,
    _number(),
    _campaign(),
    _text("at"),
    _text("who"),
    _text("host"),
    _text("tool"),
    _text("packages_digest"),
    _text("cpu"),
    _text("provenance"),
    _row_hash(),
    Index(None, "campaign_id"),
)
"""Who planned, executed or judged a campaign, when, and with what; one row for each command."""

withdrawal = Table(
    "withdrawal",
    column_kinds.metadata,
    _number(),
    _digest("result_digest", "run.result_digest"),
    _text("at"),
    _text("author"),
    _text("reason"),
    _row_hash(),
    Index(None, "result_digest"),
)
"""Results that are no evidence any more. They stay as they are."""

LEDGER: Final = (ledger, seal)
"""Tables that tell of all others, and are told of by none."""
