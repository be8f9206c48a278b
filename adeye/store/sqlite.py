"""SQLite: its connections, its transactions, and its errors in words."""

from __future__ import annotations

import sqlite3
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import URL, create_engine, event
from sqlalchemy.exc import DBAPIError

from adeye.errors import IntegrityError, PlatformError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Engine

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
    except DBAPIError as error:
        raise _in_words(error.orig or error, location) from error
    except sqlite3.Error as error:
        raise _in_words(error, location) from error
    except UnicodeDecodeError as error:
        # Also the driver's own message, where it quotes a damaged schema.
        raise IntegrityError(
            f"database {location} is damaged: a text in it is not UTF-8. "
            "Restore it from a copy, or move it away and run again."
        ) from error


def _in_words(error: BaseException, path: Location) -> PlatformError | IntegrityError:
    name = str(getattr(error, "sqlite_errorname", ""))
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
    engine = create_engine(location.url, connect_args={"timeout": BUSY_TIMEOUT_S})

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _record: object) -> None:
        # Transactions begin where this module says so, not where the driver guesses.
        connection.isolation_level = None
        for pragma in _PRAGMAS:
            connection.execute(pragma)
        _enter_wal(connection)

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get(writes_option)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def make_reader(location: Location, _writes_option: str) -> Engine:
    """Prepare connections to a file of somebody else: it is read, and nothing in it is executed."""
    assert location.path is not None
    query = {"mode": "ro", "uri": "true"}
    url = URL.create("sqlite", database=location.path.resolve().as_uri(), query=query)
    engine = create_engine(url)

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _record: object) -> None:
        connection.isolation_level = None
        for pragma in _READ_ONLY:
            connection.execute(pragma)

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        connection.exec_driver_sql("BEGIN")

    return engine


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
