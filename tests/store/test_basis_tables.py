from adeye.store import basis_tables, tables


def test_tables_of_judging_again_are_insert_only_and_in_no_result_hash() -> None:
    for table in (basis_tables.uid_set, *basis_tables.RESULTS):
        assert table in tables.INSERT_ONLY
    assert set(basis_tables.RESULTS) <= set(tables.RESULTS)
