"""The catalogue of a database: its tables, views and triggers, and what was altered."""

from collections.abc import Iterator
from typing import Any

import pytest
from sqlalchemy import Connection

from adeye.store import catalogue as catalog
from adeye.store import tables
from adeye.store.database import Database
from adeye.store.repository import Repository
from adeye.store.schema import trigger_ddl
from adeye.store.views import view_ddl
from tests.store.conftest import Store
from tests.store.raw import on_sqlite, unguarded


@pytest.fixture
def connection(repository: Repository) -> Iterator[Connection]:
    database = Database(repository.location)
    with database.read() as opened:
        yield opened
    database.close()


def expected(connection: Connection) -> dict[str, str]:
    triggers = {text.split(maxsplit=3)[2]: text for text in trigger_ddl(connection.dialect.name)}
    return {**triggers, **view_ddl()}


def test_tables_and_columns_are_those_of_the_code(connection: Connection) -> None:
    assert catalog.table_names(connection) == sorted({*tables.metadata.tables, "alembic_version"})
    for table in tables.metadata.sorted_tables:
        assert catalog.column_names(connection, table.name) == table.columns.keys()
    assert catalog.column_names(connection, "nothing") == []
    assert not catalog.is_empty(connection)
    assert catalog.size_bytes(connection) > 100_000


def test_views_tell_what_made_them(connection: Connection) -> None:
    told = {name: catalog.mark(connection, text) for name, text in view_ddl().items()}
    assert catalog.views(connection).items() >= told.items()


def test_nothing_is_altered_in_a_new_database(connection: Connection) -> None:
    assert list(catalog.altered(connection, expected(connection))) == []
    assert list(catalog.damaged_pages(connection)) == []
    assert list(catalog.dangling(connection, tables.metadata.sorted_tables)) == []


def test_view_that_says_something_else_and_trigger_that_is_gone_are_named(
    raw: Any, connection: Connection
) -> None:
    raw.execute("DROP VIEW v_campaigns")
    raw.execute("CREATE VIEW v_campaigns AS SELECT id AS campaign FROM campaign")
    raw.execute("DROP TRIGGER run_no_delete")
    found = dict(catalog.altered(connection, expected(connection)))
    assert found == {
        "v_campaigns": "is not as this release makes it",
        "run_no_delete": "is missing",
    }


@pytest.mark.parametrize("place", ["postgresql"], indirect=True)
@pytest.mark.parametrize(
    "change",
    [
        "ALTER TABLE run DISABLE TRIGGER run_no_delete",
        "CREATE OR REPLACE FUNCTION insert_only() RETURNS trigger LANGUAGE plpgsql "
        "AS 'BEGIN RETURN OLD; END'",
        "CREATE RULE quiet AS ON INSERT TO verdict WHERE NEW.verdict = 'FAIL' DO INSTEAD NOTHING",
        "CREATE FUNCTION round(float8, integer) RETURNS numeric LANGUAGE sql AS 'SELECT 9'",
        "CREATE FUNCTION insert_only(integer) RETURNS integer LANGUAGE sql AS 'SELECT 9'",
        "CREATE POLICY quiet ON verdict USING (verdict <> 'FAIL')",
        "CREATE TRIGGER quiet BEFORE INSERT ON verdict FOR EACH ROW "
        "EXECUTE FUNCTION suppress_redundant_updates_trigger()",
    ],
)
def test_guard_of_a_server_that_guards_no_more_is_named(
    raw: Any, connection: Connection, change: str
) -> None:
    raw.execute(change)
    assert len(list(catalog.altered(connection, expected(connection)))) == 1


def test_row_whose_parent_is_gone_is_named(store: Store, connection: Connection) -> None:
    campaign = store.campaign(2)
    unguarded(store.raw)
    store.raw.execute("DELETE FROM campaign_case WHERE campaign_id = ?", (campaign,))
    store.raw.execute("DELETE FROM campaign")
    found = list(catalog.dangling(connection, tables.metadata.sorted_tables))
    assert {parent for _, _, parent in found} == {"campaign"}
    assert "work" in {table for table, _, _ in found}


@on_sqlite
def test_text_that_is_no_text_can_be_read(connection: Connection) -> None:
    statement = "SELECT CAST(x'ff41' AS TEXT)"
    with catalog.readable(connection):
        assert connection.exec_driver_sql(statement).scalar_one() == "\udcffA"
