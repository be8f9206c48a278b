from adeye.store import evidence_tables, tables


def test_seal_has_a_sum_for_every_table_with_rows_of_a_run() -> None:
    of_runs = {table.name for table in tables.RESULTS}
    assert of_runs | {"plugin"} == set(evidence_tables.SEALED)
    columns = [column.name for column in evidence_tables.seal.columns]
    assert columns[2:-1] == [f"{name}_sum" for name in evidence_tables.SEALED]


def test_tables_of_evidence_are_insert_only() -> None:
    assert set(evidence_tables.LEDGER) < set(tables.INSERT_ONLY)
    assert evidence_tables.withdrawal in tables.INSERT_ONLY
