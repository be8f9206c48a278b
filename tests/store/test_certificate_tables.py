"""The table of certificates is only added to, and holds none that certifies nothing."""

from __future__ import annotations

from adeye.store import tables
from adeye.store.evidence_tables import certificate


def test_certificates_are_insert_only_and_in_no_result_hash() -> None:
    assert certificate in tables.INSERT_ONLY
    assert certificate not in tables.RESULTS
    assert set(tables.NONDETERMINISTIC["certificate"]) == {"number", "at", "row_hash"}
