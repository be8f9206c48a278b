"""Connections and transactions of the SQLite database, and its errors in words.

One transaction per ``read`` or ``write``; ``write`` takes the write lock at once, so that what it
reads cannot change before it writes. SQLite in WAL mode: readers never wait for the writer.
"""

from __future__ import annotations

import os
import sqlite3
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import URL, create_engine, event
from sqlalchemy.exc import DBAPIError

from adeye.errors import InputError, IntegrityError, PlatformError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Engine

DEFAULT_PATH: Final = Path(".adeye") / "adeye.db"
BUSY_TIMEOUT_S: Final = 30.0
_WRITES: Final = "adeye_writes"

_PRAGMAS: Final = (
    "PRAGMA foreign_keys = ON",
    "PRAGMA synchronous = NORMAL",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
    # Digests as keys touch pages all over an index, so blocks come cheaper the more are at hand
    # (64 MiB) and the later they go from the log into the file (32 MiB).
    "PRAGMA cache_size = -65536",
    "PRAGMA wal_autocheckpoint = 8192",
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


def database_path(location: str | Path | None = None) -> Path:
    """Find the database file that a location names.

    Args:
        location: A path, ``sqlite:///PATH``, or None for ``.adeye/adeye.db``.

    Raises:
        InputError: The location is a URL of another kind of database.
    """
    if location is None or location == "":
        return DEFAULT_PATH
    text = str(location)
    scheme, separator, rest = text.partition("://")
    if isinstance(location, Path) or not separator:
        return Path(text)
    path = rest.removeprefix("/")
    if scheme != "sqlite" or not path or path == ":memory:":
        # The URL may hold a password, so only its scheme is shown.
        raise InputError(
            f"database: {scheme}://… is not supported, only a file is",
            remedy="Give a path or sqlite:///PATH.",
        )
    return Path(path)


@contextmanager
def errors_in_words(path: Path) -> Iterator[None]:
    """Translate what the driver raises.

    Raises:
        PlatformError: The database cannot be used here and now.
        IntegrityError: Its content contradicts itself.
    """
    try:
        yield
    except DBAPIError as error:
        raise _in_words(error.orig or error, path) from error
    except sqlite3.Error as error:
        raise _in_words(error, path) from error
    except UnicodeDecodeError as error:
        # Also the driver's own message, where it quotes a damaged schema.
        raise IntegrityError(
            f"database {path} is damaged: a text in it is not UTF-8. "
            "Restore it from a copy, or move it away and run again."
        ) from error


def _in_words(error: BaseException, path: Path) -> PlatformError | IntegrityError:
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


class Database:
    """One database file.

    May be shared between threads: each uses its own connection. After a fork the child opens its
    own connections. Nothing is held between transactions.
    """

    def __init__(self, path: Path, *, is_read_only: bool = False) -> None:
        """Prepare for a file that need not exist yet, unless it is only read.

        Args:
            path: The file.
            is_read_only: Whether nothing is ever written, not even what a damaged or foreign file
                would make SQLite write.
        """
        self.path = path
        self._engine = _make_reader(path) if is_read_only else _make_engine(path)
        self._pid = os.getpid()

    @contextmanager
    def read(self) -> Iterator[Connection]:
        """Give a connection that sees one state of the database throughout."""
        with errors_in_words(self.path), self._connect() as connection:
            yield connection

    @contextmanager
    def write(self) -> Iterator[Connection]:
        """Give a connection with the write lock; commit at the end, roll back on any error."""
        with errors_in_words(self.path), self._connect() as connection:
            connection.execution_options(**{_WRITES: True})
            with connection.begin():
                yield connection

    def close(self) -> None:
        """Close all connections of this process."""
        self._engine.dispose()

    def _connect(self) -> Connection:
        if os.getpid() != self._pid:
            # Connections of the parent must not be used, nor closed, by its child.
            self._engine.dispose(close=False)
            self._pid = os.getpid()
        return self._engine.connect()


def create_parent(path: Path) -> None:
    """Make the folder of a database.

    Raises:
        PlatformError: The folder cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PlatformError(
            f"database {path}: its folder cannot be made ({error.strerror}). "
            "Choose another place with --db."
        ) from error


def _make_engine(path: Path) -> Engine:
    engine = create_engine(
        URL.create("sqlite", database=str(path)), connect_args={"timeout": BUSY_TIMEOUT_S}
    )

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _record: object) -> None:
        # Transactions begin where this module says so, not where the driver guesses.
        connection.isolation_level = None
        for pragma in _PRAGMAS:
            connection.execute(pragma)
        _enter_wal(connection)

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get(_WRITES, False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _make_reader(path: Path) -> Engine:
    """Make an engine for a file of somebody else: it is read, and nothing in it is executed."""
    query = {"mode": "ro", "uri": "true"}
    engine = create_engine(URL.create("sqlite", database=path.resolve().as_uri(), query=query))

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
