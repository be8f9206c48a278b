from adeye.store import tables
from adeye.store import tables as case_tables


def test_accounts_are_insert_only_and_in_no_result_hash() -> None:
    accounts = {
        *(case_tables.case_count, case_tables.case_match),
        *(case_tables.case_run, case_tables.case_tally),
    }
    assert accounts <= set(tables.INSERT_ONLY)
    assert not accounts & set(tables.RESULTS)
