"""Versions of the schema: made, upgraded, refused, and never changed by hand."""

import hashlib
import multiprocessing
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Dialect, create_engine
from sqlalchemy.dialects import postgresql, sqlite

from adeye.errors import InputError, PlatformError
from adeye.store import catalogue as catalog
from adeye.store import schema, tables
from adeye.store.database import Database
from adeye.store.read.checking import check_campaign
from adeye.store.read.export import open_export
from adeye.store.read.query import run_query
from adeye.store.repository import Repository
from adeye.store.schema import trigger_ddl
from adeye.store.tables import metadata
from adeye.store.views import view_ddl
from tests.hostile_sql import STATEMENTS
from tests.refusals import refused
from tests.store.conftest import Store
from tests.store.raw import unguarded
from tests.stored import stored

HELD = {"sqlite": "0017 b0be6d5d607fb470", "postgresql": "0017 fad6cfbc6646b67a"}
"""Version, and digest of all statements that make it."""

NEXT: str = stored("plugins")["next_version"]


@pytest.fixture
def next_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    folder = tmp_path / "migrations"
    shutil.copytree(Path(schema.__file__).parent / "migrations", folder)
    (folder / "versions" / "0018_noticed.py").write_text(NEXT)
    monkeypatch.setattr(schema, "_FOLDER", folder)
    monkeypatch.setattr(schema, "_HEAD", "0018")
    return "0018"


def set_version(path: Path, version: str) -> None:
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = ?", (version,))


def ddl(path: Path) -> dict[str, str]:
    connection = sqlite3.connect(path)
    found = connection.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL")
    statements = {name: " ".join(sql.split()) for name, sql in found}
    connection.close()
    statements.pop("alembic_version", None)
    return statements


def there(repository: Repository) -> set[str]:
    """List tables and views."""
    with repository._database.read() as connection:
        return {*catalog.table_names(connection), *catalog.views(connection)}


@pytest.mark.slow
def test_new_database_is_the_one_that_the_code_describes(tmp_path: Path) -> None:
    schema.upgrade(tmp_path / "made.db")
    engine = create_engine(f"sqlite:///{tmp_path / 'described.db'}")
    metadata.create_all(engine)
    with engine.begin() as connection:
        for statement in (*trigger_ddl(), *view_ddl().values()):
            connection.exec_driver_sql(statement)
    engine.dispose()
    assert ddl(tmp_path / "made.db") == ddl(tmp_path / "described.db")


@pytest.mark.parametrize(
    "dialect",
    [sqlite.dialect(), postgresql.dialect()],  # type: ignore[no-untyped-call]
)
def test_what_a_version_holds_changes_with_its_number_only(dialect: Dialect) -> None:
    text = "\n".join(statement for _, statement in schema.statements(dialect))
    held = f"{schema.head()} {hashlib.sha256(text.encode()).hexdigest()[:16]}"
    # Another table, column, view or rule is a new version with a migration that leads to it.
    assert held == HELD[dialect.name]


def test_head_is_that_of_the_migrations() -> None:
    scripts = ScriptDirectory(Path(schema.__file__).parent / "migrations")
    assert scripts.get_current_head() == schema.head()
    assert schema.head() in schema.known_versions()


def test_upgrade_of_the_newest_version_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "er" / "a.db"
    assert schema.current(path) is None
    assert schema.upgrade(path) == schema.head() == schema.current(path)
    before = path.read_bytes()
    assert schema.upgrade(path) == schema.head()
    assert path.read_bytes() == before


def test_older_database_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.db"
    schema.upgrade(path)
    monkeypatch.setattr(schema, "_HEAD", "0099")
    refused(PlatformError, Repository.open, path, says="'adeye db upgrade'")


def test_database_is_upgraded(store: Store, request: pytest.FixtureRequest) -> None:
    campaign = store.campaign(8)
    results = store.result_hash(campaign)
    before = there(store.repository)
    version = request.getfixturevalue("next_version")
    place = store.repository.location
    assert schema.upgrade(place) == version == schema.current(place)
    after = there(store.repository)
    assert set(after) - set(before) == {"noticed"}
    assert set(before) - set(after) == {"v_check"}
    assert store.result_hash(campaign) == results


@pytest.mark.parametrize(
    ("version", "told"),
    [("0001", "before.*again"), ("0013", "before.*again"), ("9999", "Use the newer release")],
)
def test_database_of_another_release_is_refused(tmp_path: Path, version: str, told: str) -> None:
    path = tmp_path / "a.db"
    schema.upgrade(path)
    set_version(path, version)
    before = path.read_bytes()
    for action in (schema.upgrade, Repository.open):
        refused(PlatformError, action, path, says=f"{version}.*{told}")
    assert path.read_bytes() == before
    assert schema.current(path) == version


READERS: dict[str, Callable[[Path], object]] = {
    "repository": lambda path: Repository.open(path, create=False),
    "query": lambda path: run_query(path, "SELECT 1"),
    "export": lambda path: open_export(path, None).__enter__(),
    "checks": lambda path: check_campaign(path, "1"),
}


def test_copy_without_its_log_is_told_what_it_lacks(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    path.touch()
    refused(PlatformError, READERS["query"], path, says="ends in -wal beside the original")


def test_database_of_someone_else_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    path.touch()
    for _ in range(2):
        for reader in READERS.values():
            refused(PlatformError, reader, path, says="not made by adeye")
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("CREATE TABLE IF NOT EXISTS theirs (x)")
    for action in (schema.upgrade, Repository.open):
        refused(PlatformError, action, path, says="did not make")
    assert set(ddl(path)) == {"theirs"}


def test_missing_database_is_an_input_error_for_readers_and_not_made(tmp_path: Path) -> None:
    for reader in READERS.values():
        refused(InputError, reader, tmp_path / "a.db", says=r"no such file.*Run a campaign")
    assert list(tmp_path.iterdir()) == []


def test_failed_migration_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.db"
    whole = schema._migrate

    def fail_after(connection: Any, *, is_new: bool) -> None:
        whole(connection, is_new=is_new)
        raise RuntimeError("power cut")

    monkeypatch.setattr(schema, "_migrate", fail_after)
    refused(RuntimeError, schema.upgrade, path, says="power cut")
    assert ddl(path) == {}
    monkeypatch.undo()
    assert schema.upgrade(path) == schema.head()


def open_and_close(path: Path, failures: "multiprocessing.Queue[str]") -> None:
    try:
        Repository.open(path).close()
    except Exception as error:  # noqa: BLE001 - reported by the parent
        failures.put(repr(error))


def test_many_first_users_make_one_database(tmp_path: Path) -> None:
    context = multiprocessing.get_context("fork")
    failures: multiprocessing.Queue[str] = context.Queue()
    processes = [
        context.Process(target=open_and_close, args=(tmp_path / "a.db", failures)) for _ in range(6)
    ]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
    assert failures.empty()
    assert [process.exitcode for process in processes] == [0] * 6


def test_stored_rows_are_never_changed_or_deleted(store: Store) -> None:
    store.everything()
    for table in (item.name for item in tables.INSERT_ONLY):
        count = f"SELECT count(*) FROM {table}"  # noqa: S608 - a table of this package
        before = store.raw.execute(count).fetchone()
        assert before != (0,), table
        for statement in ("UPDATE {} SET row_hash = 'x'", "DELETE FROM {}"):
            with pytest.raises(sqlite3.IntegrityError, match=f"{table} is insert-only"):
                store.raw.execute(statement.format(table))
        assert store.raw.execute(count).fetchone() == before, table
    assert store.repository.verify() == ()


def test_dialect_without_triggers_is_an_error() -> None:
    refused(KeyError, trigger_ddl, "mysql")


# --- the catalogue of a database: its tables, views and triggers, and what was altered


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


@pytest.mark.parametrize("place", ["postgresql"], indirect=True)
@pytest.mark.parametrize("change", STATEMENTS["unguarding"])
def test_guard_that_guards_no_more(raw: Any, connection: Connection, change: str) -> None:
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
