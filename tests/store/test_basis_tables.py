from adeye.store import tables
from adeye.store import tables as basis_tables


def test_tables_of_judging_again_are_insert_only_and_in_no_result_hash() -> None:
    for table in (basis_tables.uid_set, *basis_tables.BASIS_RESULTS):
        assert table in tables.INSERT_ONLY
    assert set(basis_tables.BASIS_RESULTS) <= set(tables.RESULTS)
