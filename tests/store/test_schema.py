"""Versions of the schema: made, upgraded, refused, and never changed by hand."""

import hashlib
import multiprocessing
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Dialect, create_engine
from sqlalchemy.dialects import postgresql, sqlite

from adeye.errors import InputError, PlatformError
from adeye.judge.stl.batch import NEEDED
from adeye.store import catalogue as catalog
from adeye.store import schema, tables
from adeye.store.read.checking import check_campaign
from adeye.store.read.export import open_export
from adeye.store.read.query import run_query
from adeye.store.repository import Repository
from adeye.store.schema import trigger_ddl
from adeye.store.tables import metadata
from adeye.store.views import view_ddl
from tests.store.conftest import Store

HELD = {"sqlite": "0010 c4e783b289ed56f1", "postgresql": "0010 c232d36fad8b7354"}
"""Version, and digest of all statements that make it."""

NEXT = """
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("CREATE TABLE noticed (number INTEGER PRIMARY KEY, row_hash TEXT)")
    op.execute("DROP VIEW v_check")
"""
"""A version that comes after this one."""


@pytest.fixture
def next_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    folder = tmp_path / "migrations"
    shutil.copytree(Path(schema.__file__).parent / "migrations", folder)
    (folder / "versions" / "0011_noticed.py").write_text(NEXT)
    monkeypatch.setattr(schema, "_FOLDER", folder)
    monkeypatch.setattr(schema, "_HEAD", "0011")
    return "0011"


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


@pytest.mark.slow
def test_no_migration_is_missing(tmp_path: Path) -> None:
    schema.upgrade(tmp_path / "a.db")
    engine = create_engine(f"sqlite:///{tmp_path / 'a.db'}")
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, metadata) == []
    engine.dispose()


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


def test_older_database_is_refused_until_it_is_upgraded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.db"
    schema.upgrade(path)
    monkeypatch.setattr(schema, "_HEAD", "0099")
    with pytest.raises(PlatformError, match="'adeye db upgrade'"):
        Repository.open(path)


def test_database_is_upgraded_by_the_migrations_that_came_after_it(
    store: Store, request: pytest.FixtureRequest
) -> None:
    campaign = store.campaign(8)
    results = store.result_hash(campaign)
    before = there(store.repository)
    version = request.getfixturevalue("next_version")
    assert (
        schema.upgrade(store.repository.location)
        == version
        == schema.current(store.repository.location)
    )
    after = there(store.repository)
    assert set(after) - set(before) == {"noticed"}
    assert set(before) - set(after) == {"v_check"}
    assert store.result_hash(campaign) == results


@pytest.mark.parametrize(
    ("version", "told"),
    [
        ("0001", "0001, of a version from before.*again"),
        ("0007", "0007, of a version from before.*again"),
        ("9999", "9999.*Use the newer release"),
    ],
)
def test_database_of_a_newer_release_or_from_before_the_first_is_refused(
    tmp_path: Path, version: str, told: str
) -> None:
    path = tmp_path / "a.db"
    schema.upgrade(path)
    set_version(path, version)
    before = path.read_bytes()
    for action in (schema.upgrade, Repository.open):
        with pytest.raises(PlatformError, match=told):
            action(path)
    assert path.read_bytes() == before
    assert schema.current(path) == version


READERS: dict[str, Callable[[Path], object]] = {
    "repository": lambda path: Repository.open(path, create=False),
    "query": lambda path: run_query(path, "SELECT 1"),
    "export": lambda path: open_export(path, None).__enter__(),
    "checks": lambda path: check_campaign(path, "1"),
}


def test_database_of_someone_else_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    path.touch()
    for _ in range(2):
        for reader in READERS.values():
            with pytest.raises(PlatformError, match="not made by adeye"):
                reader(path)
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("CREATE TABLE IF NOT EXISTS theirs (x)")
    for action in (schema.upgrade, Repository.open):
        with pytest.raises(PlatformError, match="did not make"):
            action(path)
    assert set(ddl(path)) == {"theirs"}


def test_missing_database_is_an_input_error_for_readers_and_not_made(tmp_path: Path) -> None:
    for reader in READERS.values():
        with pytest.raises(InputError, match=r"no such file.*Run a campaign"):
            reader(tmp_path / "a.db")
    assert list(tmp_path.iterdir()) == []


def test_migration_that_fails_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.db"
    whole = schema._migrate

    def fail_after(connection: Any, *, is_new: bool) -> None:
        whole(connection, is_new=is_new)
        raise RuntimeError("power cut")

    monkeypatch.setattr(schema, "_migrate", fail_after)
    with pytest.raises(RuntimeError, match="power cut"):
        schema.upgrade(path)
    assert ddl(path) == {}
    monkeypatch.undo()
    assert schema.upgrade(path) == schema.head()


def open_and_close(path: Path, failures: "multiprocessing.Queue[str]") -> None:
    try:
        Repository.open(path).close()
    except Exception as error:  # noqa: BLE001 - reported by the parent
        failures.put(repr(error))


@pytest.mark.slow
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


@pytest.mark.slow
def test_stored_rows_are_never_changed_or_deleted(store: Store) -> None:
    store.example.decompose()
    campaign = store.campaign(4)
    store.hindsight(campaign)
    store.halved(campaign)
    store.campaign(2)
    store.campaign(4)
    store.vouched(campaign)
    store.example.repeat(NEEDED)
    store.campaign(8)
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
    with pytest.raises(KeyError):
        trigger_ddl("mysql")
