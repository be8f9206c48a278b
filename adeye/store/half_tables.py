"""The tables of twins with half the step, and of what they told."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sqlalchemy import CheckConstraint, Column, ForeignKey, Index, Table

from adeye.store.column_kinds import (
    coded,
    count_column,
    digest_column,
    metadata,
    number_column,
    one_of,
    row_hash_column,
    text_column,
)

if TYPE_CHECKING:
    from sqlalchemy import Connection

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
    Column("campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=True, nullable=False),
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
    Column("fsr_digest", coded(64), nullable=True),
    Column("judged_digest", coded(64), nullable=True),
    row_hash_column(),
    one_of("kind", ("metric", "fsr"), "kind"),
    CheckConstraint("pairs BETWEEN 0 AND sampled", name="pairs"),
    CheckConstraint("(pairs = 0) = (p95 IS NULL)", name="p95"),
    CheckConstraint("(kind = 'fsr') = (judged_digest IS NOT NULL)", name="judged"),
)


def plain_digests(connection: Connection, campaign_id: str) -> dict[str, str]:
    """Give the digest of each FSR of a campaign without what half the step told.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
    """
    found = connection.exec_driver_sql(
        "SELECT f.fsr_id, COALESCE(u.fsr_digest, f.fsr_digest) FROM campaign_fsr f "
        "LEFT JOIN uncertainty u ON u.judged_digest = f.fsr_digest WHERE f.campaign_id = ?",
        (campaign_id,),
    )
    return {str(name): str(digest) for name, digest in found}
