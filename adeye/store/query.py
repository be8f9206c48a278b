"""Run SQL that a person typed: read-only, one statement, bounded in time and size.

``mode=ro`` alone is not enough: ATTACH would make files and one call of ``randomblob`` could take
all memory without being interruptible. So an authorizer allows reading and a list of functions,
limits bound every value, a deadline ends what runs too long, and the process may not grow by more
than ``MEMORY_BYTES`` meanwhile: a thousand columns of a megabyte each are one step of one query.
"""

from __future__ import annotations

import resource
import sqlite3
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from adeye.errors import InputError
from adeye.store.database import Database, errors_in_words
from adeye.store.location import Location, Place, locate
from adeye.store.schema import require_current, require_exists
from adeye.store.sqlite import reading_options

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_FUNCTION_NAMES: Final = """
-> ->> abs acos asin atan atan2 avg ceil ceiling char coalesce cos count cume_dist
current_date current_time current_timestamp date datetime degrees dense_rank exp first_value
floor glob group_concat hex ifnull json json_array json_array_length json_each
json_extract json_group_array json_group_object json_object json_quote json_tree json_type
json_valid julianday lag last_value lead length like ln log log10 log2 lower max min mod
nth_value ntile nullif percent_rank pi pow power quote radians random rank round row_number
sign sin sqrt strftime substr substring sum tan time total trunc typeof unicode upper
"""
FUNCTIONS: Final = frozenset({*_FUNCTION_NAMES.split(), "iif"})  # codespell:ignore iif
"""Functions that finish at once on any value within the limits."""

_ALLOWED_ACTIONS: Final = frozenset(
    {sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ, sqlite3.SQLITE_RECURSIVE}
)
_LIMITS: Final = {
    sqlite3.SQLITE_LIMIT_LENGTH: 1_000_000,
    sqlite3.SQLITE_LIMIT_SQL_LENGTH: 100_000,
    sqlite3.SQLITE_LIMIT_COLUMN: 1_000,
    sqlite3.SQLITE_LIMIT_EXPR_DEPTH: 200,
    sqlite3.SQLITE_LIMIT_COMPOUND_SELECT: 50,
    sqlite3.SQLITE_LIMIT_FUNCTION_ARG: 100,
    sqlite3.SQLITE_LIMIT_ATTACHED: 0,
    sqlite3.SQLITE_LIMIT_LIKE_PATTERN_LENGTH: 100,
    sqlite3.SQLITE_LIMIT_TRIGGER_DEPTH: 1,
    sqlite3.SQLITE_LIMIT_WORKER_THREADS: 0,
}
_PREPARATIONS: Final = (
    "PRAGMA query_only = ON",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
    "PRAGMA temp_store = MEMORY",
    # These two are made on first use, which the authorizer would take for a change.
    "SELECT 1 FROM json_each('[]'), json_tree('[]')",
)
_DEFENSIVE: Final = 1010
"""SQLITE_DBCONFIG_DEFENSIVE of sqlite3.h."""
_STEPS_BETWEEN_CHECKS: Final = 1_000
_BATCH_ROWS: Final = 200

MEMORY_BYTES: Final = 1 << 29
"""By how much the process may grow while a query runs."""

DEFAULT_ROWS: Final = 10_000
DEFAULT_SECONDS: Final = 10.0


@dataclass(frozen=True)
class QueryResult:
    """Rows of a query.

    Attributes:
        columns: Their names.
        rows: At most as many as were asked for.
        is_cut: Whether there were more.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    is_cut: bool


def run_query(
    place: Place,
    sql: str,
    *,
    parameters: Mapping[str, str] | None = None,
    max_rows: int = DEFAULT_ROWS,
    timeout_s: float = DEFAULT_SECONDS,
) -> QueryResult:
    """Run one SELECT on the database without being able to change anything.

    Args:
        place: The database, as everywhere.
        sql: One statement.
        parameters: Values of what it names ``:name``.
        max_rows: Most rows to return.
        timeout_s: Longest time that it may run [s].

    Raises:
        InputError: The statement is wrong, not allowed, ran too long, or takes too much memory.
        PlatformError: The database cannot be read.
    """
    location = locate(place)
    if location.path is None:
        from adeye.store.server_query import run_server_query

        with _little_memory():
            return run_server_query(location, sql, parameters or {}, max_rows, timeout_s)
    with _ours(location):
        with errors_in_words(location):
            connection = sqlite3.connect(
                f"{location.path.resolve().as_uri()}?{urlencode(reading_options(location.path))}",
                uri=True,
                isolation_level=None,
            )
        try:
            guard = _Guard(timeout_s)
            with errors_in_words(location):
                guard.close_in(connection)
            try:
                with _little_memory():
                    return _fetch(connection, sql, parameters or {}, max_rows)
            except (sqlite3.Error, sqlite3.Warning, UnicodeError, MemoryError) as error:
                raise guard.in_words(error) from error
        finally:
            connection.close()


@contextmanager
def _ours(location: Location) -> Iterator[None]:
    """Require a database of this release and keep it open.

    Whoever closes it last removes the files of its log, and who may only read cannot.
    """
    require_exists(location)
    database = Database(location)
    try:
        with database.read() as connection:
            require_current(connection, location)
            yield
    finally:
        database.close()


@contextmanager
def _little_memory() -> Iterator[None]:
    """Let the process grow by so much only; where the system has its own smaller limit, that."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    wanted = pages * resource.getpagesize() + MEMORY_BYTES
    known = [limit for limit in before if limit != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_AS, (min([wanted, *known]), before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def _fetch(
    connection: sqlite3.Connection, sql: str, parameters: Mapping[str, str], max_rows: int
) -> QueryResult:
    cursor = connection.execute(sql, parameters)
    if cursor.description is None:
        raise InputError("query: no statement", remedy="Write one SELECT.")
    rows: list[tuple[Any, ...]] = []
    while len(rows) <= max_rows:
        batch = cursor.fetchmany(min(_BATCH_ROWS, max_rows + 1 - len(rows)))
        if not batch:
            break
        rows += batch
    columns = tuple(str(item[0]) for item in cursor.description)
    return QueryResult(columns, tuple(rows[:max_rows]), is_cut=len(rows) > max_rows)


class _Guard:
    """The authorizer and the clock of one query; remembers what it refused."""

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._deadline = time.monotonic() + timeout_s
        self._refused = ""
        self._is_late = False

    def close_in(self, connection: sqlite3.Connection) -> None:
        for statement in _PREPARATIONS:
            connection.execute(statement)
        # Python 3.12 and later.
        set_config = getattr(connection, "setconfig", None)
        if set_config is not None:
            set_config(_DEFENSIVE, True)  # noqa: FBT003 - its only form
        for limit, value in _LIMITS.items():
            connection.setlimit(limit, value)
        connection.set_progress_handler(self._is_over, _STEPS_BETWEEN_CHECKS)
        connection.set_authorizer(self._authorize)

    def _is_over(self) -> int:
        self._is_late = time.monotonic() > self._deadline
        return int(self._is_late)

    def _authorize(self, action: int, *names: str | None) -> int:
        second = names[1]
        if action in _ALLOWED_ACTIONS:
            return sqlite3.SQLITE_OK
        if action == sqlite3.SQLITE_FUNCTION and (second or "").lower() in FUNCTIONS:
            return sqlite3.SQLITE_OK
        if action == sqlite3.SQLITE_FUNCTION:
            self._refused = f"function {second}() is not allowed"
        else:
            self._refused = "only reading is allowed"
        return sqlite3.SQLITE_DENY

    def in_words(self, error: BaseException) -> InputError:
        if self._refused:
            return InputError(f"query: {self._refused}", remedy="Write one SELECT over the views.")
        if self._is_late:
            return InputError(
                f"query: stopped after {self._timeout_s:g} s",
                remedy="Select a campaign, fewer columns, or an aggregate.",
            )
        if isinstance(error, MemoryError):
            return InputError(
                f"query: took more than {MEMORY_BYTES >> 20} MiB of memory",
                remedy="Select fewer rows or columns; 'adeye export' writes whole campaigns.",
            )
        return InputError(
            f"query: {error}", remedy="The views are listed under 'Views' in the user guide."
        )
