"""Databases in files: their rules, their errors in words, and archives that nobody may write."""

import json
import os
import re
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import InputError, IntegrityError, PlatformError
from adeye.store import sqlite
from adeye.store.database import Database, errors_in_words
from adeye.store.location import Location
from adeye.store.read import query
from adeye.store.read.query import run_query
from adeye.store.repository import Repository
from tests.project import Executed
from tests.refusals import refused
from tests.stored import known, stored


@pytest.fixture
def database(tmp_path: Path) -> Database:
    opened = Database(tmp_path / "a.db")
    with opened.write() as connection:
        connection.exec_driver_sql("CREATE TABLE t (x INTEGER UNIQUE)")
    return opened


def test_connections_keep_the_rules(database: Database) -> None:
    rules = {"journal_mode": "wal", "foreign_keys": 1, "trusted_schema": 0, "busy_timeout": 30_000}
    with database.read() as connection:
        for name, value in rules.items():
            assert connection.exec_driver_sql(f"PRAGMA {name}").scalar() == value, name


@pytest.mark.slow
def test_log_of_a_large_transaction_does_not_stay(database: Database) -> None:
    log = Path(f"{database.location.path}-wal")
    with database.write() as connection:
        connection.exec_driver_sql("CREATE TABLE large (content BLOB)")
        connection.exec_driver_sql("INSERT INTO large VALUES (ZEROBLOB(80000000))")
    assert log.stat().st_size > 80_000_000
    for number in range(2):
        with database.write() as connection:
            connection.exec_driver_sql("INSERT INTO t VALUES (?)", (number,))
    assert log.stat().st_size <= 32 * 2**20


def test_locked_database_is_named(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sqlite, "BUSY_TIMEOUT_S", 0.05)
    impatient = Database(database.location)
    with (
        database.write(),
        pytest.raises(PlatformError, match=r"a\.db is locked .* Wait"),
        impatient.write(),
    ):
        pass


def test_what_is_no_database_is_named(tmp_path: Path) -> None:
    path = tmp_path / "no.db"
    path.write_bytes(b"This is a text, not a database. " * 40)
    with pytest.raises(PlatformError, match=r"no\.db is not a database"), Database(path).read():
        pass
    refused(InputError, Database, tmp_path, says="is a folder")


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
    with Database(database.location).read() as connection:
        assert connection.exec_driver_sql("SELECT x FROM t").scalars().all() == [1]


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
    with pytest.raises(kind, match="details"), errors_in_words(Location.of_file(Path("a.db"))):
        raise error


class BusyConnection:
    """Answers that the database is locked, a number of times."""

    def __init__(self, times: int) -> None:
        self.times = iter(range(times))

    def execute(self, _sql: str) -> sqlite3.Cursor:
        if next(self.times, None) is not None:
            error = sqlite3.OperationalError("database is locked")
            error.sqlite_errorname = "SQLITE_BUSY"
            raise error
        return sqlite3.connect(":memory:").execute("SELECT 'wal'")


def test_first_switch_to_wal_waits_for_the_lock(monkeypatch: pytest.MonkeyPatch) -> None:
    connection: Any = BusyConnection(3)
    sqlite._enter_wal(connection)
    assert next(connection.times, None) is None
    monkeypatch.setattr(sqlite, "BUSY_TIMEOUT_S", 0.0)
    connection = BusyConnection(1000)
    refused(sqlite3.OperationalError, sqlite._enter_wal, connection, says="locked")


def test_message_that_is_not_utf_8_is_damage_in_words(tmp_path: Path) -> None:
    # SQLite quotes a damaged schema as it is.
    with (
        pytest.raises(IntegrityError, match=r"a\.db is damaged: a text in it is not UTF-8"),
        errors_in_words(Location.of_file(tmp_path / "a.db")),
    ):
        b"malformed database schema (\xa7)".decode("utf-8")


VERBS = (
    ("db", "info"),
    ("db", "verify"),
    ("query", "SELECT COUNT(*) AS runs FROM v_runs"),
    ("gate",),
    ("matrix",),
    ("show", "RUN"),
    ("export", "--format", "csv", "-o", "OUT"),
)
SCRIPT: str = stored("plugins")["verbs"]
WITHOUT_RIGHTS = "--bounding-set=-dac_override,-dac_read_search,-fowner"


@pytest.fixture
def archive(tmp_path: Path, mini: Executed) -> Iterator[Path]:
    """A database in a folder that can be made one that nobody may write into."""
    folder = tmp_path / "archive"
    folder.mkdir()
    yield Path(shutil.copy(mini.db, folder / "a.db"))
    folder.chmod(0o755)


def as_reader(db: Path, *verbs: tuple[str, ...]) -> tuple[list[int], str]:
    """Run verbs as somebody whom the rights of files bind; return their codes and words."""
    (db.parent.parent / "out").mkdir(exist_ok=True)
    reading = sqlite3.connect(f"file:{db}?immutable=1", uri=True)
    (run,) = reading.execute("SELECT result_digest FROM run LIMIT 1").fetchone()
    reading.close()
    meant = {"OUT": str(db.parent.parent / "out"), "RUN": run}
    given = [[meant.get(word, word) for word in verb] for verb in verbs]
    words = [sys.executable, "-c", SCRIPT, str(db), json.dumps(given)]
    if os.getuid() == 0:
        words = ["setpriv", WITHOUT_RIGHTS, *words]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=db.parent.parent)
    codes = [int(code) for code in re.findall(r"^ended with (\d+)$", done.stdout, re.MULTILINE)]
    return codes, done.stdout + done.stderr


needs_rights = pytest.mark.skipif(
    os.getuid() == 0 and shutil.which("setpriv") is None, reason="root may write everywhere"
)


@pytest.mark.slow
@needs_rights
@pytest.mark.parametrize(("file", "folder"), [(0o444, 0o555), (0o644, 0o555), (0o444, 0o755)])
def test_archive_that_nobody_may_write_is_read(archive: Path, file: int, folder: int) -> None:
    before = archive.read_bytes()
    archive.chmod(file)
    archive.parent.chmod(folder)
    codes, said = as_reader(archive, *VERBS)
    assert len(codes) == len(VERBS), said
    assert 5 not in codes, said
    assert (codes[:3], codes[5:]) == ([0, 0, 0], [0, 0]), said
    assert "defect of adeye" not in said
    assert folder == 0o755 or [item.name for item in archive.parent.iterdir()] == ["a.db"]
    assert archive.read_bytes() == before


@pytest.mark.slow
@needs_rights
def test_who_writes_into_an_archive_is_told(archive: Path) -> None:
    archive.parent.chmod(0o555)
    codes, said = as_reader(archive, ("db", "withdraw", "RUN", "--author", "A", "--reason", "B"))
    assert codes == [5]
    assert "is read-only" in said
    assert "write access to file and folder" in said


@pytest.mark.slow
@needs_rights
def test_log_that_is_not_in_the_file_yet_is_read_or_named(archive: Path) -> None:
    writing = sqlite3.connect(archive)
    writing.execute("PRAGMA wal_autocheckpoint = 0")
    writing.execute("CREATE TABLE more (x)")
    writing.commit()
    archive.parent.chmod(0o555)
    # Beside a writer the log is read, too.
    codes, said = as_reader(archive, ("query", "SELECT COUNT(*) FROM more"))
    assert codes == [0], said
    archive.parent.chmod(0o755)
    log = Path(f"{archive}-wal").read_bytes()
    writing.close()
    # As a copy has it that was made while somebody wrote.
    Path(f"{archive}-wal").write_bytes(log)
    archive.parent.chmod(0o555)
    codes, said = as_reader(archive, ("db", "info"))
    assert codes == [5]
    assert "a.db-wal holds what is not in the file yet" in said


def test_file_that_is_written_after_all_while_it_is_read_is_not_believed(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = known(database.location.path)
    database.close()
    monkeypatch.setattr(sqlite, "_may_write", lambda _: False)
    monkeypatch.setattr("os.access", lambda *_: False)
    reader = Database(path)
    with reader.read() as connection:
        assert connection.exec_driver_sql("SELECT COUNT(*) FROM t").scalar() == 0
    with (
        pytest.raises(PlatformError, match="was written while it was read"),
        reader.read() as connection,
        sqlite3.connect(path) as other,
    ):
        other.execute("INSERT INTO t VALUES (1)")
    other.close()


def test_query_of_a_file_that_is_written_after_all_is_not_believed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.db"
    Repository.open(path).close()
    monkeypatch.setattr("os.access", lambda *_: False)
    assert run_query(path, "SELECT COUNT(*) FROM run").rows == ((0,),)
    fetch = query._fetch

    def late(*given: Any) -> Any:
        found = fetch(*given)
        path.write_bytes(path.read_bytes() + bytes(4096))
        return found

    monkeypatch.setattr(query, "_fetch", late)
    with pytest.raises(PlatformError, match="was written while it was read"):
        run_query(path, "SELECT COUNT(*) FROM run")


def test_database_that_was_removed_or_exchanged_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    with Repository.open(path) as repository:
        repository.campaigns()
        repository.reopen()
        content = path.read_bytes()
        path.unlink()
        refused(PlatformError, repository.reopen, says="is gone: it was removed")
        path.touch()
        repository.reopen()
        refused(PlatformError, repository.campaigns)
        path.write_bytes(content)
