"""Count what a process asks of database, files, processes and pipes, and let the n-th fail.

Everything is put in place of what the standard library offers, in a process of its own; adeye knows
nothing of it.
"""

from __future__ import annotations

import builtins
import errno
import io
import mmap
import os
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from multiprocessing import connection as pipes
from multiprocessing import util as multiprocessing_util
from pathlib import Path
from typing import Any, Final

from adeye.store.repository import Repository

KINDS: Final = ("database", "file", "process", "pipe")
DATABASE_ERRORS: Final = (
    ("SQLITE_IOERR_WRITE", "disk I/O error"),
    ("SQLITE_FULL", "database or disk is full"),
    ("SQLITE_CANTOPEN", "unable to open database file"),
    ("SQLITE_BUSY", "database is locked"),
)
WIDTH: Final = 8


class Calls:
    """How many calls there were, in a file that another process may read meanwhile."""

    def __init__(self, path: str, nth: int, *, is_fatal: bool) -> None:
        with open(path, "r+b") as file:  # noqa: PTH123 - pathlib's is replaced, too
            self._map = mmap.mmap(file.fileno(), WIDTH)
        self._nth = nth
        self._is_fatal = is_fatal
        self.made = 0

    def is_to_fail(self) -> bool:
        """Count one, and tell whether it is the one that fails."""
        self.made += 1
        self._map[:WIDTH] = self.made.to_bytes(WIDTH, "little")
        if self.made == self._nth and self._is_fatal:
            os.kill(os.getpid(), signal.SIGKILL)
        return self.made == self._nth


def count(path: str, kind: str = "database", nth: int = 0, *, is_fatal: bool = False) -> None:
    """Count calls of one kind in a file of eight bytes; let the n-th fail, none if it is 0.

    Where that is fatal, the process is killed instead.
    """
    calls = Calls(path, nth, is_fatal=is_fatal)
    {
        "database": _database_calls,
        "file": _file_calls,
        "process": _process_calls,
        "pipe": _pipe_calls,
    }[kind](calls)


def time_database(path: str) -> None:
    """Keep in a file how long this process waited for locks and commits of the database [s].

    Those are the calls in which others can be in the way: beginning to write, and committing.
    """
    waited = 0.0

    def timed(function: Callable[..., Any], *arguments: Any) -> Any:
        nonlocal waited
        if arguments and not arguments[0].startswith("BEGIN"):
            return function(*arguments)
        before = time.perf_counter()
        try:
            return function(*arguments)
        finally:
            waited += time.perf_counter() - before
            Path(path).write_text(str(waited), "ascii")

    _put_around_statements(timed)


def count_method(path: str, name: str, *answer: Any, pause_s: float = 0.0) -> None:
    """Count how often a method of the repository returned, with this answer if one is given.

    Each call is made after a pause.
    """
    calls = Calls(path, 0, is_fatal=False)
    method = getattr(Repository, name)

    def counted(*arguments: Any, **options: Any) -> Any:
        time.sleep(pause_s)
        found = method(*arguments, **options)
        if not answer or found in answer:
            calls.is_to_fail()
        return found

    setattr(Repository, name, counted)


def move_clock(seconds: float) -> None:
    """Let the wall clock of this process be wrong."""
    from adeye.store import texts
    from adeye.store.write import queue as leasing

    class Moved(datetime):
        @classmethod
        def now(cls, tz: Any = None) -> Any:
            return datetime.now(tz or UTC) + timedelta(seconds=seconds)

    for module in (texts, leasing):
        if hasattr(module, "datetime"):
            module.datetime = Moved  # type: ignore[attr-defined]


def _database_calls(calls: Calls) -> None:
    """Statements and commits; what is looked up, too, because it also may not be readable."""

    def checked(function: Callable[..., Any], *arguments: Any) -> Any:
        if calls.is_to_fail():
            name, text = DATABASE_ERRORS[calls.made % len(DATABASE_ERRORS)]
            error = sqlite3.OperationalError(text)
            error.sqlite_errorname = name
            raise error
        return function(*arguments)

    _put_around_statements(checked)


def _put_around_statements(around: Callable[..., Any]) -> None:
    """Hand every statement and commit of connections made from now on to a function."""
    connect = sqlite3.connect

    class Cursor(sqlite3.Cursor):
        def execute(self, *arguments: Any) -> Any:
            return around(super().execute, *arguments)

        def executemany(self, *arguments: Any) -> Any:
            return around(super().executemany, *arguments)

    class Connection(sqlite3.Connection):
        def cursor(self, factory: Any = Cursor) -> Any:
            return super().cursor(factory)

        def commit(self) -> None:
            around(super().commit)

    def connected(*arguments: Any, **options: Any) -> Any:
        return connect(*arguments, **{"factory": Connection, **options})

    sqlite3.connect = sqlite3.dbapi2.connect = connected


def _file_calls(calls: Calls) -> None:
    """Opening, writing, renaming and deleting; reading only what belongs to the project."""
    here = str(Path.cwd())

    def check(path: Any) -> None:
        if calls.is_to_fail():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    def ours(path: Any) -> bool:
        return isinstance(path, str | os.PathLike) and (
            not os.path.isabs(path) or str(path).startswith(here)  # noqa: PTH117
        )

    opened = io.open

    def opening(file: Any, mode: str = "r", *arguments: Any, **options: Any) -> Any:
        writes = bool(set(mode) & set("wax+"))
        if not (ours(file) or (writes and isinstance(file, str | os.PathLike | int))):
            return opened(file, mode, *arguments, **options)
        if not isinstance(file, int):
            check(file)
        found = opened(file, mode, *arguments, **options)
        if writes:
            write = found.write

            def writing(content: Any) -> Any:
                check(file)
                return write(content)

            found.write = writing  # type: ignore[method-assign]
        return found

    builtins.open = io.open = opening
    for name in ("replace", "rename", "mkdir", "fsync"):
        setattr(os, name, _checked(getattr(os, name), check))


def _checked(function: Callable[..., Any], check: Callable[[Any], None]) -> Callable[..., Any]:
    def checked(path: Any, *arguments: Any, **options: Any) -> Any:
        check(path)
        return function(path, *arguments, **options)

    return checked


def _process_calls(calls: Calls) -> None:
    def check(_: Any) -> None:
        if calls.is_to_fail():
            raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    subprocess._fork_exec = _checked(subprocess._fork_exec, check)  # type: ignore[attr-defined]
    spawn = multiprocessing_util.spawnv_passfds
    multiprocessing_util.spawnv_passfds = _checked(spawn, check)


def _pipe_calls(calls: Calls) -> None:
    receive = pipes.Connection.recv

    def receiving(end: Any) -> Any:
        if calls.is_to_fail():
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return receive(end)

    pipes.Connection.recv = receiving  # type: ignore[method-assign,assignment]
