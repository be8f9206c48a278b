import re
import sqlite3

import pytest
from sqlalchemy import CheckConstraint

from adeye.judge.verdict import Verdict
from adeye.store import tables
from adeye.store.tables import FIRST_METRIC_IDS


def test_tables_are_those_of_the_design() -> None:
    expected = (
        "odd scenario architecture concept hazardous_event safety_goal fsr element allocation "
        "assumption decomposition decomposition_child dependent_failure element_relation "
        "test_case campaign campaign_use campaign_case campaign_fsr work run metric verdict "
        "event chain fork timing criticality injection takeover benchmark tally artifact half_step "
        "uncertainty uid_set basis extreme kept_trace ledger seal campaign_root session withdrawal "
        "certificate case_count case_match case_run case_tally case_repeat "
        "never_held"
    )
    assert set(tables.metadata.tables) == set(expected.split())


def test_a_row_can_have_every_verdict_but_not_run() -> None:
    assert set(tables.RUN_VERDICTS) == {str(item) for item in Verdict} - {"NOT_RUN"}


def test_only_the_queue_and_the_list_of_files_can_change() -> None:
    changing = set(tables.metadata.tables.values()) - set(tables.INSERT_ONLY)
    assert {table.name for table in changing} == {"work", "artifact"}


def test_every_insert_only_table_ends_with_its_hash() -> None:
    assert {list(table.columns)[-1].name for table in tables.INSERT_ONLY} == {"row_hash"}


def test_constraints_have_names_so_that_migrations_can_find_them() -> None:
    named = [
        str(constraint.name)
        for table in tables.metadata.tables.values()
        for constraint in table.constraints
        if isinstance(constraint, CheckConstraint)
    ]
    assert all(re.match(r"^[a-z_0-9]+$", name) for name in named)


def test_metric_ids_are_identifiers_without_repeats() -> None:
    assert len(set(tables.METRIC_IDS)) == len(tables.METRIC_IDS)
    assert all(name.isidentifier() for name in tables.METRIC_IDS)


@pytest.mark.parametrize(
    ("value", "status"), [(None, "'value'"), ("1.0", "'no_conflict'"), ("1.0", "'unheard_of'")]
)
def test_metric_value_and_status_must_agree(
    raw: sqlite3.Connection, value: str | None, status: str
) -> None:
    columns = ["run_number", "row_hash"]
    values = ["1", "'x'"]
    for name in FIRST_METRIC_IDS:
        columns += [name, f"{name}_status"]
        values += [value or "NULL", status]
    sql = f"INSERT INTO metric ({', '.join(columns)}) VALUES ({', '.join(values)})"  # noqa: S608
    with pytest.raises(sqlite3.IntegrityError, match=r"(?i)check constraint.*ck_metric_"):
        raw.execute(sql)
