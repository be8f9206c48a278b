"""The tables: which there are, which can change, and what they refuse."""

import re
import sqlite3

import pytest
from sqlalchemy import CheckConstraint
from sqlalchemy.exc import IntegrityError

from adeye.identity import digest
from adeye.judge.verdict import Verdict
from adeye.store import tables
from adeye.store.tables import METRIC_IDS, TABLES
from tests.store.conftest import Store

RECORDED = "07962e33f5440c95de8ab04f4cff4860f7b93917639ef768558644f06e5c6d47"


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


def test_every_metric_stands_in_one_table() -> None:
    assert tuple(name for ids in tables.TABLES.values() for name in ids) == METRIC_IDS
    assert len(set(METRIC_IDS)) == len(METRIC_IDS)
    assert all(name.isidentifier() for name in METRIC_IDS)
    for table, ids in tables.TABLES.items():
        columns = [column.name for column in tables.metadata.tables[table].columns]
        assert columns[1:-1:4] == list(ids)


def test_metrics_in_result_hashes_are_those_of_the_first_schema() -> None:
    assert digest(list(TABLES["metric"])) == RECORDED


def test_seal_has_a_sum_for_every_table_with_rows_of_a_run() -> None:
    of_runs = {table.name for table in tables.RESULTS}
    assert of_runs | {"plugin"} == set(tables.SEALED)
    columns = [column.name for column in tables.seal.columns]
    assert columns[2:-1] == [f"{name}_sum" for name in tables.SEALED]
    assert set(tables.BASIS_RESULTS) < set(tables.RESULTS)
    assert not {*tables.RECOUNTED, tables.certificate} & set(tables.RESULTS)


@pytest.mark.parametrize(
    ("columns", "values"),
    [
        ("pairs, p95", "13, 0.5"),
        ("pairs, p95", "0, 0.5"),
        ("pairs, p95", "11, CAST(NULL AS REAL)"),
        ("judged_digest", "NULL"),
        ("kind", "'other'"),
    ],
)
def test_contradicting_uncertainty_is_refused(store: Store, columns: str, values: str) -> None:
    store.halved(store.campaign(4))
    store.raw.execute("DROP TRIGGER uncertainty_no_update")
    with pytest.raises(sqlite3.IntegrityError, match=r"(?i)check"):
        store.raw.execute(f"UPDATE uncertainty SET ({columns}) = (SELECT {values})")  # noqa: S608


def test_relations_of_elements_are_rows_that_stay(store: Store) -> None:
    concept = store.example.concept()
    camera = concept.elements[0].model_copy(
        update={"resources": ("power", "power"), "supplier": "one", "provides": ("objects",)}
    )
    key = store.repository.save_concept(concept.model_copy(update={"elements": (camera,)}))
    found = store.rows("SELECT * FROM element_relation ORDER BY kind")
    assert [row[:4] for row in found] == [
        (key, "camera", "provides", "objects"),
        (key, "camera", "resource", "power"),
        (key, "camera", "supplier", "one"),
    ]
    assert store.repository.verify() == ()
    for action in ("UPDATE element_relation SET name = 'x'", "DELETE FROM element_relation"):
        with pytest.raises((sqlite3.IntegrityError, IntegrityError), match="insert-only"):
            store.raw.execute(action)


@pytest.mark.parametrize(
    ("value", "status"), [(None, "'value'"), ("1.0", "'no_conflict'"), ("1.0", "'unheard_of'")]
)
def test_value_and_status_agree(raw: sqlite3.Connection, value: str | None, status: str) -> None:
    columns = ["run_number", "row_hash"]
    values = ["1", "'x'"]
    for name in TABLES["metric"]:
        columns += [name, f"{name}_status"]
        values += [value or "NULL", status]
    sql = f"INSERT INTO metric ({', '.join(columns)}) VALUES ({', '.join(values)})"  # noqa: S608
    with pytest.raises(sqlite3.IntegrityError, match=r"(?i)check constraint.*ck_metric_"):
        raw.execute(sql)
