"""The table of certificates: how deterministic a campaign was seen to be."""

from __future__ import annotations

from sqlalchemy import CheckConstraint, Column, ForeignKey, Integer, String, Table

from adeye.store.column_kinds import (
    count_column,
    metadata,
    one_of,
    row_hash_column,
    text_column,
)

certificate = Table(
    "certificate",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("campaign_id", String(32), ForeignKey("campaign.id"), nullable=False),
    text_column("at"),
    text_column("tool"),
    text_column("class"),
    count_column("executed"),
    count_column("asked"),
    count_column("sampled"),
    count_column("machine_dependent"),
    text_column("conditions"),
    text_column("findings"),
    row_hash_column(),
    one_of("class", ("portable", "same platform"), "class"),
    CheckConstraint("sampled BETWEEN 1 AND executed", name="sampled"),
)
