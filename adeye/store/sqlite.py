"""SQLite: its connections, its transactions, and its errors in words.

Who may not write here reads all the same: an archive, a mounted medium, the folder of a colleague.
SQLite then needs the files of the log beside the database, or to be told that nobody writes it.
"""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.exc import DBAPIError

from adeye.errors import IntegrityError, PlatformError
from adeye.store.location import Location

BUSY_TIMEOUT_S: Final = 30.0

_LOG_PAGES: Final = 8192

_PRAGMAS: Final = (
    "PRAGMA foreign_keys = ON",
    "PRAGMA synchronous = NORMAL",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
    # Digests as keys touch pages all over an index, so blocks come cheaper the more are at hand
    # (64 MiB) and the later they go from the log into the file (32 MiB).
    "PRAGMA cache_size = -65536",
    f"PRAGMA wal_autocheckpoint = {_LOG_PAGES}",
    # The plan of a large campaign is one transaction; its log does not stay as large beside it.
    f"PRAGMA journal_size_limit = {_LOG_PAGES * 4096}",
)

_READ_ONLY: Final = (
    "PRAGMA query_only = ON",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
)

_CAUSES: Final = (
    ("SQLITE_BUSY", "is locked by another process", "Wait for it to finish, or end it."),
    ("SQLITE_LOCKED", "is locked by another process", "Wait for it to finish, or end it."),
    ("SQLITE_FULL", "cannot grow: the disk is full", "Free some space and run again."),
    ("SQLITE_READONLY", "is read-only", "Give this user write access to file and folder."),
    ("SQLITE_CANTOPEN", "cannot be opened", "Check that folder and file can be read and written."),
    ("SQLITE_PERM", "cannot be opened", "Check that folder and file can be read and written."),
    ("SQLITE_NOTADB", "is not a database", "Name another file, or move this one away."),
    ("SQLITE_IOERR", "cannot be read or written", "Check free space, limits and the disk."),
)


@contextmanager
def errors_in_words(location: Location) -> Iterator[None]:
    """Translate what the driver raises; see ``database.errors_in_words``."""
    try:
        yield
    except (DBAPIError, sqlite3.Error) as error:
        raise _in_words(getattr(error, "orig", None) or error, location) from error
    except UnicodeDecodeError as error:
        # Also the driver's own message, where it quotes a damaged schema.
        raise IntegrityError(
            f"database {location} is damaged: a text in it is not UTF-8. "
            "Restore it from a copy, or move it away and run again."
        ) from error


def _in_words(error: BaseException, path: Location) -> PlatformError | IntegrityError:
    name = str(getattr(error, "sqlite_errorname", ""))
    if name.startswith("SQLITE_CANTOPEN") and path.path is not None and _is_logged(path.path):
        return PlatformError(
            f"database {path} cannot be read here: its log {path.path.name}-wal holds what is not "
            "in the file yet, and this user may not write into the folder. Copy both to a folder "
            "of your own, or let the owner run 'adeye db info', which brings them together."
        )
    if name.startswith("SQLITE_CONSTRAINT"):
        return IntegrityError(
            f"database {path} refused a change: {error}. "
            "Run 'adeye db verify'; rows of results are never changed or deleted."
        )
    if name.startswith("SQLITE_CORRUPT"):
        return IntegrityError(
            f"database {path} is damaged: {error}. "
            "Restore it from a copy, or move it away and run again."
        )
    for prefix, cause, remedy in _CAUSES:
        if name.startswith(prefix):
            return PlatformError(f"database {path} {cause} ({error}). {remedy}")
    return PlatformError(f"database {path}: {error}. Run 'adeye db verify'.")


def make_engine(location: Location, writes_option: str) -> Engine:
    """Prepare connections.

    Args:
        location: A file.
        writes_option: Execution option of a connection whose transaction writes.
    """
    if location.path is not None and not _may_write(location.path):
        return make_reader(location, writes_option)
    return _engine(location.url, _PRAGMAS, writes_option)


def make_reader(location: Location, _writes_option: str) -> Engine:
    """Prepare connections to a file of somebody else: it is read, and nothing in it is executed."""
    assert location.path is not None
    query = {**reading_options(location.path), "uri": "true"}
    url = URL.create("sqlite", database=location.path.resolve().as_uri(), query=query)
    return _engine(url, _READ_ONLY)


def _engine(url: URL, pragmas: Sequence[str], writes_option: str = "") -> Engine:
    """Prepare connections, which never write without an option for it."""
    engine = create_engine(url, connect_args={"timeout": BUSY_TIMEOUT_S})

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _record: object) -> None:
        # Transactions begin where this module says so, not where the driver guesses.
        connection.isolation_level = None
        for pragma in pragmas:
            connection.execute(pragma)
        if writes_option:
            _enter_wal(connection)

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get(writes_option)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def reading_options(path: Path) -> dict[str, str]:
    """Say how to open a file that is only read, as parameters of its URI.

    Where no log can be made beside it and none is there, nobody writes it.
    """
    is_still = not os.access(path.resolve().parent, os.W_OK) and not (
        _is_logged(path) or _beside(path, "-shm").exists()
    )
    return {"mode": "ro", **({"immutable": "1"} if is_still else {})}


def still_state(path: Path) -> tuple[int, ...] | None:
    """Tell by what a change of a file shows that is taken for one that nobody writes; else None."""
    if "immutable" not in reading_options(path):
        return None
    found = path.stat()
    return found.st_mtime_ns, found.st_size, found.st_ino


def _may_write(path: Path) -> bool:
    if not path.exists():
        return True
    return os.access(path, os.W_OK) and os.access(path.resolve().parent, os.W_OK)


def _is_logged(path: Path) -> bool:
    """Tell whether what was written lies in a log beside the file and not in it."""
    logs = (_beside(path, suffix) for suffix in ("-wal", "-journal"))
    return any(log.exists() and log.stat().st_size > 0 for log in logs)


def _beside(path: Path, suffix: str) -> Path:
    real = path.resolve()
    return real.with_name(f"{real.name}{suffix}")


def _enter_wal(connection: sqlite3.Connection) -> None:
    """Switch to WAL mode; SQLite does not wait for the lock that the first switch needs."""
    deadline = time.monotonic() + BUSY_TIMEOUT_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL").fetchone()
        except sqlite3.OperationalError as error:
            if error.sqlite_errorname != "SQLITE_BUSY" or time.monotonic() > deadline:
                raise
            time.sleep(0.01)
        else:
            return
