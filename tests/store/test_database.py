import os
import sqlite3
import threading
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import InputError, IntegrityError, PlatformError
from adeye.store import database as database_module
from adeye.store.database import Database, create_parent, database_path, errors_in_words


@pytest.fixture
def database(tmp_path: Path) -> Database:
    opened = Database(tmp_path / "a.db")
    with opened.write() as connection:
        connection.exec_driver_sql("CREATE TABLE t (x INTEGER UNIQUE)")
    return opened


def values(database: Database) -> list[int]:
    with database.read() as connection:
        return list(connection.exec_driver_sql("SELECT x FROM t ORDER BY x").scalars())


@pytest.mark.parametrize(
    ("location", "path"),
    [
        (None, ".adeye/adeye.db"),
        ("", ".adeye/adeye.db"),
        ("a/b.db", "a/b.db"),
        (Path("a:b.db"), "a:b.db"),
        ("sqlite:///a/b.db", "a/b.db"),
        ("sqlite:////a/b.db", "/a/b.db"),
    ],
)
def test_location_names_a_file(location: str | Path | None, path: str) -> None:
    assert database_path(location) == Path(path)


@pytest.mark.parametrize(
    "url", ["postgresql://me:canary@host/db", "sqlite://", "sqlite:///:memory:"]
)
def test_other_locations_are_refused_without_their_password(url: str) -> None:
    with pytest.raises(InputError, match="is not supported") as caught:
        database_path(url)
    assert "canary" not in str(caught.value)


def fail_half_way(database: Database) -> None:
    with database.write() as connection:
        connection.exec_driver_sql("INSERT INTO t VALUES (1)")
        raise RuntimeError("half way")


def test_write_that_raises_leaves_nothing(database: Database) -> None:
    with pytest.raises(RuntimeError, match="half way"):
        fail_half_way(database)
    assert values(database) == []


def test_reader_sees_one_state_and_never_waits_for_the_writer(database: Database) -> None:
    with database.read() as reader:
        assert reader.exec_driver_sql("SELECT count(*) FROM t").scalar() == 0
        with database.write() as writer:
            writer.exec_driver_sql("INSERT INTO t VALUES (1)")
        assert reader.exec_driver_sql("SELECT count(*) FROM t").scalar() == 0
    assert values(database) == [1]


def test_writers_of_several_threads_wait_for_each_other(database: Database) -> None:
    def add(first: int) -> None:
        for number in range(first, first + 20):
            with database.write() as connection:
                connection.exec_driver_sql("INSERT INTO t VALUES (?)", (number,))

    threads = [threading.Thread(target=add, args=(100 * index,)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(values(database)) == 80


def test_child_uses_connections_of_its_own(database: Database) -> None:
    assert values(database) == []
    pid = os.fork()
    if pid == 0:
        with database.write() as connection:
            connection.exec_driver_sql("INSERT INTO t VALUES (7)")
        os._exit(0)
    _, status = os.waitpid(pid, 0)
    assert status == 0
    assert values(database) == [7]


def test_connections_keep_the_rules(database: Database) -> None:
    with database.read() as connection:
        found = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar()
            for name in ("journal_mode", "foreign_keys", "trusted_schema", "busy_timeout")
        }
    assert found == {
        "journal_mode": "wal",
        "foreign_keys": 1,
        "trusted_schema": 0,
        "busy_timeout": 30_000,
    }


def test_locked_database_is_named_with_a_remedy(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(database_module, "BUSY_TIMEOUT_S", 0.05)
    impatient = Database(database.path)
    with (
        database.write(),
        pytest.raises(PlatformError, match=r"a\.db is locked .* Wait"),
        impatient.write(),
    ):
        pass


def test_file_that_is_no_database_is_named(tmp_path: Path) -> None:
    path = tmp_path / "no.db"
    path.write_bytes(b"This is a text, not a database. " * 40)
    with pytest.raises(PlatformError, match=r"no\.db is not a database"), Database(path).read():
        pass


def test_folder_instead_of_a_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(PlatformError, match="cannot be opened"), Database(tmp_path).read():
        pass


def test_parent_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(PlatformError, match="folder cannot be made"):
        create_parent(tmp_path / "file" / "a.db")


def fill_the_disk(database: Database) -> None:
    with database.write() as connection:
        pages = connection.exec_driver_sql("PRAGMA page_count").scalar()
        connection.exec_driver_sql(f"PRAGMA max_page_count = {pages}")
        connection.exec_driver_sql(
            "WITH RECURSIVE n(i) AS (SELECT 2 UNION ALL SELECT i + 1 FROM n LIMIT 100000) "
            "INSERT INTO t SELECT i FROM n"
        )


def test_full_disk_is_named_and_keeps_what_was_committed(database: Database) -> None:
    with database.write() as connection:
        connection.exec_driver_sql("INSERT INTO t VALUES (1)")
    with pytest.raises(PlatformError, match=r"the disk is full.*Free some space") as caught:
        fill_the_disk(database)
    assert caught.value.exit_code == 5
    assert values(Database(database.path)) == [1]


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("SQLITE_CORRUPT_VTAB", IntegrityError),
        ("SQLITE_CONSTRAINT_UNIQUE", IntegrityError),
        ("SQLITE_READONLY_DBMOVED", PlatformError),
        ("SQLITE_IOERR_WRITE", PlatformError),
        ("SQLITE_NOMEM", PlatformError),
        ("", PlatformError),
    ],
)
def test_every_cause_has_its_exit_code(name: str, kind: type[Exception]) -> None:
    error = sqlite3.OperationalError("details")
    if name:
        error.sqlite_errorname = name
    with pytest.raises(kind, match="details"), errors_in_words(Path("a.db")):
        raise error


def test_connections_of_another_process_are_not_used(database: Database) -> None:
    with database.read() as before:
        parents = before.connection.dbapi_connection
    database._pid = -1
    with database.read() as after:
        assert after.connection.dbapi_connection is not parents
    assert database._pid == os.getpid()


class BusyConnection:
    """Answers that the database is locked, a number of times."""

    def __init__(self, times: int) -> None:
        self.times = times

    def execute(self, _sql: str) -> sqlite3.Cursor:
        if self.times > 0:
            self.times -= 1
            error = sqlite3.OperationalError("database is locked")
            error.sqlite_errorname = "SQLITE_BUSY"
            raise error
        return sqlite3.connect(":memory:").execute("SELECT 'wal'")


def test_first_switch_to_wal_waits_for_the_lock() -> None:
    connection: Any = BusyConnection(3)
    database_module._enter_wal(connection)
    assert connection.times == 0


def test_first_switch_to_wal_does_not_wait_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(database_module, "BUSY_TIMEOUT_S", 0.0)
    connection: Any = BusyConnection(1000)
    with pytest.raises(sqlite3.OperationalError, match="locked"):
        database_module._enter_wal(connection)


def test_message_that_is_not_utf_8_is_damage_in_words(tmp_path: Path) -> None:
    # SQLite quotes a damaged schema as it is.
    with (
        pytest.raises(IntegrityError, match=r"a\.db is damaged: a text in it is not UTF-8"),
        errors_in_words(tmp_path / "a.db"),
    ):
        b"malformed database schema (\xa7)".decode("utf-8")
