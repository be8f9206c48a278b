"""Sums of the row hashes of one campaign by table: what a manifest says of its tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from adeye.store.ledger import MODULUS, hash_sum
from adeye.store.pending import JUDGED

if TYPE_CHECKING:
    from sqlalchemy import Connection

_CHUNK: Final = 5_000
_RUNS: Final = ("metric", "timing", "criticality", "event", "chain")
_RUN: Final = "JOIN run r ON r.result_digest = c.result_digest"
_SOURCES: Final = {
    "campaign": "SELECT t.row_hash FROM campaign t WHERE t.id = ?",
    "campaign_fsr": "SELECT t.row_hash FROM campaign_fsr t WHERE t.campaign_id = ?",
    "campaign_case": "SELECT t.row_hash FROM campaign_case t WHERE t.campaign_id = ?",
    "test_case": "SELECT t.row_hash FROM campaign_case c "
    "JOIN test_case t ON t.digest = c.test_case_digest WHERE c.campaign_id = ?",
    "run": f"SELECT r.row_hash FROM campaign_case c {_RUN} WHERE c.campaign_id = ?",  # noqa: S608
    **{
        name: f"SELECT t.row_hash FROM campaign_case c {_RUN} "  # noqa: S608 - own names
        f"JOIN {name} t ON t.run_number = r.number WHERE c.campaign_id = ?"
        for name in _RUNS
    },
    "verdict": f"SELECT v.row_hash FROM campaign_case c {_RUN} "  # noqa: S608 - own names
    f"JOIN campaign_fsr f ON {JUDGED} "
    "JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest "
    "WHERE c.campaign_id = ?",
}


def campaign_sums(connection: Connection, campaign: str) -> dict[str, tuple[int, str]]:
    """Count and sum the row hashes of a campaign by table.

    What other campaigns add later changes none of them.

    Args:
        connection: In a transaction.
        campaign: Id of the campaign.

    Returns:
        By table: rows, and the sum of their hashes modulo 2**128 in hex.
    """
    sums: dict[str, tuple[int, str]] = {}
    for name, query in _SOURCES.items():
        found = connection.exec_driver_sql(
            query, (campaign,), execution_options={"yield_per": _CHUNK}
        )
        count, total = 0, 0
        for part in found.partitions(_CHUNK):
            hashes = [str(item[0]) for item in part]
            count, total = count + len(hashes), (total + hash_sum(hashes)) % MODULUS
        sums[name] = count, f"{total:032x}"
    return sums
