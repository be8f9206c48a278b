"""The tables of twins with half the step, and of what they told."""

from __future__ import annotations

from sqlalchemy import CheckConstraint, Column, ForeignKey, Index, String, Table

from adeye.store.column_kinds import (
    count_column,
    digest_column,
    metadata,
    number_column,
    one_of,
    row_hash_column,
    text_column,
)

half_step = Table(
    "half_step",
    metadata,
    digest_column("result_digest", "run.result_digest", key=True),
    digest_column("test_case_digest", "test_case.digest"),
    digest_column("origin_digest"),
    row_hash_column(),
    Index(None, "test_case_digest"),
    Index(None, "origin_digest"),
)
uncertainty = Table(
    "uncertainty",
    metadata,
    Column("campaign_id", String(32), ForeignKey("campaign.id"), primary_key=True, nullable=False),
    text_column("scenario", key=True),
    text_column("architecture", key=True),
    text_column("kind", key=True),
    text_column("name", key=True),
    text_column("unit", key=True),
    count_column("sampled"),
    count_column("pairs"),
    number_column("p95"),
    number_column("largest"),
    number_column("uncertainty"),
    count_column("differing"),
    text_column("changes"),
    Column("fsr_digest", String(64), nullable=True),
    Column("judged_digest", String(64), nullable=True),
    row_hash_column(),
    one_of("kind", ("metric", "fsr"), "kind"),
    CheckConstraint("pairs BETWEEN 0 AND sampled", name="pairs"),
    CheckConstraint("(pairs = 0) = (p95 IS NULL)", name="p95"),
    CheckConstraint("(kind = 'fsr') = (judged_digest IS NOT NULL)", name="judged"),
)
