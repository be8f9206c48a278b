"""Run SQL that a person typed: read-only, one statement, bounded in time and size.

``mode=ro`` alone is not enough: ATTACH would make files and one call of ``randomblob`` could take
all memory without being interruptible. So an authorizer allows reading and a list of functions,
limits bound every value, a deadline ends what runs too long, and the process may not grow by more
than ``MEMORY_BYTES`` meanwhile: a thousand columns of a megabyte each are one step of one query.

This is the second line behind the rights of the reading role and the read-only transaction of
``server_query``: a function that only reads can still wait, lock, or change a setting.

A read-only transaction can be left by whoever may send a second statement, and a superuser may read
files of the server in a SELECT. So the statement goes alone (extended protocol), behind a cursor,
in a read-only transaction, as the role ``READER`` that ``grant`` makes; a user who could do more
than read and cannot become that role is refused. ``sql_words`` lets only known functions pass.
"""

from __future__ import annotations

import math
import re
import resource
import sqlite3
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import urlencode

from sqlalchemy import inspect
from sqlalchemy.types import NullType

from adeye.errors import InputError, PlatformError, require_known
from adeye.store.database import errors_in_words
from adeye.store.location import Location, Place, locate
from adeye.store.postgres import SCHEMA, unreadable
from adeye.store.schema import opened
from adeye.store.sqlite import reading_options
from adeye.units import Dimension, si_unit

# --- Run SQL that a person typed: read-only, one statement, bounded in time and size --------------

_SQLITE_FUNCTION_NAMES: Final = """
-> ->> abs acos asin atan atan2 avg ceil ceiling char coalesce cos count cume_dist
current_date current_time current_timestamp date datetime degrees dense_rank exp first_value
floor glob group_concat hex ifnull json json_array json_array_length json_each
json_extract json_group_array json_group_object json_object json_quote json_tree json_type
json_valid julianday lag last_value lead length like ln log log10 log2 lower max min mod
nth_value ntile nullif percent_rank pi pow power quote radians random rank round row_number
sign sin sqrt strftime substr substring sum tan time total trunc typeof unicode upper
"""
SQLITE_FUNCTIONS: Final = frozenset({*_SQLITE_FUNCTION_NAMES.split(), "iif"})
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
        InputError: The statement is wrong, not allowed, ran too long, or takes too much memory; or
            the user of a server may do more than read; or there is no end to the time.
        PlatformError: The database cannot be read.
    """
    if not 0.0 < timeout_s < math.inf:
        raise InputError(
            f"query: timeout_s is {timeout_s!r}", remedy="Give a number of seconds above 0."
        )
    try:
        return _run(place, sql, parameters or {}, max_rows, timeout_s)
    except InputError as error:
        if remedy := _near(place, sql, str(error)):
            raise InputError(error.message, remedy=remedy) from error
        raise


def _run(
    place: Place, sql: str, values: Mapping[str, str], max_rows: int, timeout_s: float
) -> QueryResult:
    location = locate(place)
    if location.path is None:
        with _little_memory():
            if len(sql) > _MOST_SQL:
                raise InputError(
                    "query: the statement is too long", remedy="Write less than 100 kB."
                )
            command = _for_driver(sql, checked(sql), values)
            with _reading(location) as server:
                with opened(location):
                    pass
                return _fetch_from_server(server, command, values, max_rows, timeout_s)
    # Whoever closes it last removes the files of its log, and who may only read cannot.
    with opened(location):
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
                    return _fetch(connection, sql, values, max_rows)
            except (sqlite3.Error, sqlite3.Warning, UnicodeError, MemoryError) as error:
                raise guard.in_words(error) from error
        finally:
            connection.close()


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
        if action == sqlite3.SQLITE_FUNCTION and (second or "").lower() in SQLITE_FUNCTIONS:
            return sqlite3.SQLITE_OK
        pragma = (names[0] or "").lower() if action == sqlite3.SQLITE_PRAGMA else ""
        if pragma in _PRAGMAS and (second is None or pragma not in _SETTING):
            return sqlite3.SQLITE_OK
        if action == sqlite3.SQLITE_FUNCTION:
            self._refused = f"function {second}() is not allowed"
        else:
            self._refused = "only reading is allowed"
        return sqlite3.SQLITE_DENY

    def in_words(self, error: BaseException) -> InputError:
        if self._refused:
            return _refusal(self._refused)
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


# --- What there is to ask about: views and tables, their columns, what a wrong name may mean ------

_PRAGMAS: Final = frozenset(
    {"table_info", "table_xinfo", "table_list", "index_list", "index_info", "index_xinfo"}
    | {"foreign_key_list", "user_version", "schema_version", "compile_options", "function_list"}
)
"""Pragmas that only tell; with a value, the versions would set it."""
_SETTING: Final = frozenset({"user_version", "schema_version"})
_ABSENT: Final = re.compile(
    r"no such (?P<kind>column|table): (?:\w+\.)*(?P<name>\w+)"
    r'|(?P<server>column|relation) "?(?:\w+\.)*(?P<named>\w+)"? does not exist'
)
_MOST_SUGGESTED: Final = 3


@dataclass(frozen=True, slots=True)
class ColumnInfo:
    """A column of a view or table.

    Attributes:
        name: As SQL calls it.
        type: As the database declares it; empty for what a view computes.
        unit: In which its numbers are; empty for a text, a count, and where that is not known.
    """

    name: str
    type: str
    unit: str


def columns_of(place: Place, name: str) -> tuple[ColumnInfo, ...]:
    """List the columns of a view or table.

    Raises:
        UsageError: There is none of this name.
        PlatformError: The database cannot be read.
    """
    with opened(place) as connection:
        asked = inspect(connection)
        known = sorted({*asked.get_view_names(), *asked.get_table_names()})
        require_known((name,), known, lambda name: f"there is no view or table {name!r}")
        return tuple(
            ColumnInfo(
                item["name"],
                "" if isinstance(item["type"], NullType) else str(item["type"]),
                _unit_of(item["name"]),
            )
            for item in asked.get_columns(name)
        )


def _unit_of(column: str) -> str:
    """Return the unit that the end of a column's name tells."""
    suffix = column.rpartition("_")[2] if "_" in column else ""
    found = (item.exponents for item in Dimension if item.suffix and item.suffix == suffix)
    return next(map(si_unit, found), "")


def _near(place: Place, sql: str, message: str) -> str:
    """Say which names a wrong one may mean; empty if the message is about something else."""
    found = _ABSENT.search(message)
    if found is None:
        return ""
    name = found["name"] or found["named"]
    with opened(place) as connection:
        asked = inspect(connection)
        known = [*asked.get_view_names(), *asked.get_table_names()]
        if "column" in (found["kind"], found["server"]):
            views = [item for item in known if re.search(rf"\b{re.escape(item)}\b", sql)]
            known = [column["name"] for view in views for column in asked.get_columns(view)]
            where = f"'adeye query --columns {views[0]}' lists them." if views else ""
        else:
            where = "'adeye query --columns v_runs' lists the columns of one."
    near = get_close_matches(name, sorted(set(known)), n=_MOST_SUGGESTED, cutoff=0.6)
    meant = f"Did you mean {' or '.join(map(repr, near))}? " if near else ""
    return f"{meant}{where}".strip()


# --- Look at SQL that a person typed before a server sees it: which words, which functions --------

_SERVER_FUNCTION_NAMES: Final = """
abs acos asin atan atan2 avg bool_and bool_or cbrt ceil ceiling char_length coalesce concat
concat_ws corr cos count covar_pop covar_samp cume_dist date_part date_trunc degrees dense_rank
div exp extract first_value floor greatest initcap json_array_length json_each json_typeof lag
last_value lead least left length ln log log10 lower ltrim max min mod nth_value ntile nullif
percent_rank percentile_cont percentile_disc pi position pow power radians rank regr_intercept
regr_r2 regr_slope right round row_number rtrim sign sin sqrt starts_with stddev stddev_pop
stddev_samp string_agg strpos substr substring sum tan to_char trim trunc upper var_pop var_samp
variance width_bucket
"""
_KEYWORDS: Final = """
all and any as between by case cast char decimal distinct else end except exists filter float
from full group having in inner intersect into interval is join lateral left like limit
materialized not numeric offset on or order outer over partition precision recursive right
select some then time timestamp union using values varchar when where window with within
"""
SERVER_FUNCTIONS: Final = frozenset(_SERVER_FUNCTION_NAMES.split())
"""Functions that neither wait nor change anything nor make much of little."""

_BEFORE_BRACKETS: Final = frozenset(_KEYWORDS.split())
_FIRST: Final = frozenset({"select", "with", "values", "table", "explain"})
_BODIES: Final = frozenset({"select", "with", "values", "table", "("})
_SCHEMAS: Final = frozenset({"adeye", "pg_catalog"})

_TOKEN: Final = re.compile(
    r"""
    (?P<blank>\s+|--[^\n]*)
    |(?P<text>'(?:[^']|'')*')
    |(?P<quoted>"(?:[^"]|"")+")
    |(?P<parameter>(?<!:):[A-Za-z_]\w*)
    |(?P<word>[^\W\d][\w$]*)
    |(?P<number>(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)
    |(?P<sign>::|[-+*/<>=~!@\#%^&|`?.,;:()\[\]])
    """,
    re.VERBOSE,
)


class Token(NamedTuple):
    """A piece of a statement and where it begins."""

    kind: str
    text: str
    start: int


def tokens_of(sql: str) -> list[Token]:
    """Split a statement.

    Raises:
        InputError: It has what is not read here: a NUL, a comment with ``/*``, texts with
            backslashes, texts between dollars, names with escapes.
    """
    found: list[Token] = []
    place = 0
    while place < len(sql):
        match = _TOKEN.match(sql, place)
        if match is None:
            raise _refusal(f"{sql[place]!r} cannot be read here")
        kind, text = str(match.lastgroup), match.group()
        place = match.end()
        before = found[-1] if found else None
        if text == "/" and sql[place : place + 1] == "*":
            raise _refusal("comments begin with --")
        if kind in ("text", "quoted") and _is_prefixed(before, sql, match.start()):
            raise _refusal(f"the form {before.text if before else ''}{text[:1]} is not allowed")
        if kind != "blank":
            found.append(Token(kind, text, match.start()))
    return found


def _is_prefixed(before: Token | None, sql: str, start: int) -> bool:
    """Tell whether a word stands at a text, which then is of another form: E'', U&"", B''."""
    if before is None or sql[start - 1].isspace():
        return False
    return before.kind == "word" or before.text == "&"


def checked(sql: str) -> list[Token]:
    """Split one statement that only reads, with nothing but allowed functions.

    Raises:
        InputError: It is another statement, several, or calls another function.
    """
    tokens = tokens_of(sql)
    while tokens and tokens[-1].text == ";":
        tokens.pop()
    if not tokens:
        raise InputError("query: no statement", remedy="Write one SELECT.")
    if any(token.text == ";" for token in tokens):
        raise _refusal("you can only execute one statement")
    first = next((token.text.lower() for token in tokens if token.text != "("), "")
    if first not in _FIRST:
        raise _refusal("only reading is allowed")
    _require_closed(tokens)
    for place, token in enumerate(tokens):
        if token.text == "(" and place and tokens[place - 1].kind in ("word", "quoted"):
            _require_call(tokens, place - 1)
    return tokens


def _require_closed(tokens: list[Token]) -> None:
    """Refuse brackets that do not match: a statement may be put between others."""
    depth = 0
    for token in tokens:
        depth += {"(": 1, ")": -1}.get(token.text, 0)
        if depth < 0:
            break
    if depth:
        raise _refusal("its brackets do not match")


def _require_call(tokens: list[Token], place: int) -> None:
    """Refuse a call of what is not allowed."""
    token = tokens[place]
    name = _name(token)
    before = tokens[place - 1].text if place else ""
    if before == ".":
        if _name(tokens[place - 2]) not in _SCHEMAS or name not in SERVER_FUNCTIONS:
            raise _refusal(f"function {name}() is not allowed")
        return
    if token.kind == "word" and name in _BEFORE_BRACKETS:
        return
    if before.lower() == "as" or name in SERVER_FUNCTIONS or _is_common_table(tokens, place):
        return
    raise _refusal(f"function {name}() is not allowed")


def _is_common_table(tokens: list[Token], place: int) -> bool:
    """Tell whether a name with columns is that of a query after WITH: its body follows."""
    depth, end = 0, place + 1
    while end < len(tokens):
        depth += {"(": 1, ")": -1}.get(tokens[end].text, 0)
        end += 1
        if depth == 0:
            break
    rest = [token.text.lower() for token in tokens[end : end + 5]]
    words = [word for word in rest if word not in ("not", "materialized")]
    return words[:2] == ["as", "("] and len(words) > 2 and words[2] in _BODIES


def _name(token: Token) -> str:
    if token.kind == "quoted":
        return token.text[1:-1].replace('""', '"')
    return token.text.lower()


def _refusal(message: str) -> InputError:
    return InputError(f"query: {message}", remedy="Write one SELECT over the views.")


# --- Run SQL that a person typed on a PostgreSQL server: as a role that only reads, within limits -

READER: Final = "adeye_reader"
"""Role without login that may read and nothing else; users are made members of it."""

_ROLE: Final = re.compile(r"[a-z_][a-z0-9_]{0,62}")
_ADMIN: Final = f" (from PostgreSQL 16 on also 'GRANT {READER} TO {{user}} WITH ADMIN OPTION')"
_TEMP_FILES: Final = "1GB"
_MOST_SQL: Final = 100_000

_RIGHTS: Final = (
    "SELECT rolsuper OR pg_has_role(current_user, 'pg_read_server_files', 'MEMBER') "  # noqa: S608
    "OR pg_has_role(current_user, 'pg_write_server_files', 'MEMBER') "
    "OR pg_has_role(current_user, 'pg_execute_server_program', 'MEMBER'), "
    "COALESCE((SELECT pg_has_role(current_user, r.oid, 'MEMBER') FROM pg_roles r "
    f"WHERE r.rolname = '{READER}' AND has_schema_privilege(r.oid, '{SCHEMA}', 'USAGE')), FALSE), "
    f"has_schema_privilege(current_user, to_regnamespace('{SCHEMA}'), 'USAGE') "
    "FROM pg_roles WHERE rolname = current_user"
)
_BEGIN: Final = (
    "BEGIN TRANSACTION ISOLATION LEVEL REPEATABLE READ READ ONLY",
    f"SET LOCAL search_path TO pg_catalog, {SCHEMA}, pg_temp",
    "SET LOCAL lock_timeout TO '5s'",
    "SET LOCAL standard_conforming_strings TO on",
    # A cursor is planned for a tenth of its rows otherwise; how many are read is said to it.
    "SET LOCAL cursor_tuple_fraction TO 1",
)


def _for_driver(sql: str, tokens: list[Token], parameters: Mapping[str, str]) -> str:
    """Write a statement as the driver takes it: values apart from it."""
    parts, place = [], tokens[0].start
    for token in tokens:
        if token.kind == "parameter":
            name = token.text[1:]
            if name not in parameters:
                raise InputError(f"query: nothing is given for :{name}", remedy="See --campaign.")
            parts += [sql[place : token.start].replace("%", "%%"), f"CAST(%({name})s AS text)"]
            place = token.start + len(token.text)
    end = tokens[-1].start + len(tokens[-1].text)
    return "".join([*parts, sql[place:end].replace("%", "%%")])


def _connect(location: Location) -> Any:
    import psycopg

    own = {"connect_timeout": 10, "application_name": "adeye query"}
    return psycopg.connect(**{**location.driver_arguments(), **own}, autocommit=True)


@contextmanager
def _reading(location: Location) -> Iterator[Any]:
    """Give a connection in a transaction that only reads, as a role that may do nothing else."""
    with errors_in_words(location):
        connection = _connect(location)
    try:
        with errors_in_words(location):
            is_mighty, is_member, may_read = connection.execute(_RIGHTS).fetchone()
            if may_read is False and not is_member:
                raise unreadable(location, connection.info.user)
            if is_mighty and not is_member:
                raise InputError(
                    "query: this user may do more on the server than read, and could do harm",
                    remedy="Run 'adeye db grant' once, which makes a role that only reads.",
                )
            for statement in _BEGIN:
                connection.execute(statement)
            if is_mighty:
                # Others have the limit that ``grant`` gave them.
                connection.execute(f"SET LOCAL temp_file_limit TO '{_TEMP_FILES}'")
            if is_member:
                connection.execute(f"SET LOCAL ROLE {READER}")
        yield connection
    finally:
        connection.close()


def _fetch_from_server(
    connection: Any, command: str, parameters: Mapping[str, str], max_rows: int, timeout_s: float
) -> QueryResult:
    import psycopg

    deadline = time.monotonic() + timeout_s
    rows: list[tuple[Any, ...]] = []
    try:
        is_plan = command.lower().startswith("explain")
        text = command if is_plan else _declared(command, max_rows + 1)
        _limit(connection, deadline)
        # Prepared, a text of several statements is an error.
        cursor = connection.execute(text.encode(), dict(parameters), prepare=True)
        while len(rows) <= max_rows:
            if not is_plan:
                _limit(connection, deadline)
                wanted = min(_BATCH_ROWS, max_rows + 1 - len(rows))
                cursor = connection.execute(f"FETCH {wanted} FROM query")
            batch = cursor.fetchall()
            rows += batch
            if not batch or is_plan:
                break
        columns = tuple(item.name for item in cursor.description or ())
    except (psycopg.Error, MemoryError, UnicodeError) as error:
        raise _in_words(error, timeout_s) from None
    kept = tuple(tuple(map(_plain, row)) for row in rows[:max_rows])
    return QueryResult(columns, kept, is_cut=len(rows) > max_rows)


def _declared(command: str, most: int) -> str:
    """Declare a cursor over the first rows of a statement, planned for no more than these."""
    asked = f"SELECT * FROM ({command}\n) AS asked LIMIT {most}"  # noqa: S608 - a role that only reads
    return f"DECLARE query NO SCROLL CURSOR FOR {asked}"


def _limit(connection: Any, deadline: float) -> None:
    """Let the next statement run as long as there is time."""
    left_ms = max(1, round(1000.0 * (deadline - time.monotonic())))
    connection.execute(f"SET LOCAL statement_timeout TO {left_ms}")


def _plain(value: Any) -> Any:
    """Turn what only this server has into numbers and text."""
    if isinstance(value, bool):
        return int(value)
    if value is None or isinstance(value, int | float | str | bytes):
        return value
    try:
        number = float(value)
    except (TypeError, ValueError):
        return str(value)
    return int(value) if number.is_integer() and abs(number) < 2**53 else number


def _in_words(error: BaseException, timeout_s: float) -> InputError | PlatformError:
    state = getattr(error, "sqlstate", None)
    if state in ("57014", "55P03"):
        return InputError(
            f"query: stopped after {timeout_s:g} s",
            remedy="Select a campaign, fewer columns, or an aggregate.",
        )
    if state in ("25006", "42501"):
        return _refusal("only reading is allowed")
    if isinstance(error, MemoryError) or state in ("53200", "53400", "54000"):
        return InputError(
            "query: took too much memory",
            remedy="Select fewer rows or columns; 'adeye export' writes whole campaigns.",
        )
    if state is None and not isinstance(error, UnicodeError):
        return PlatformError("query: the server ended the connection. Run again.")
    text = str(error).partition("\n")[0]
    return InputError(f"query: {text}", remedy="The views are listed in the user guide.")


def grant(location: Location, role: str | None) -> list[str]:
    """Make the role that only reads, give it what it needs, and a user its rights.

    Args:
        location: A database of a server; its owner or a superuser is needed.
        role: A user of the server who shall be able to read; None for none.

    Returns:
        What could not be limited, and why; empty if everything is.

    Raises:
        InputError: The name of the role is not a plain one, or the server has no such user.
        PlatformError: The server refused.
    """
    if role is not None and _ROLE.fullmatch(role) is None:
        raise InputError(
            f"role {role!r} is not a plain name",
            remedy="Use lower-case letters, digits and underscores.",
        )
    with opened(location):
        pass
    notes: list[str] = []
    with errors_in_words(location):
        connection = _connect(location)
        try:
            with connection.transaction():
                _make_reader(connection)
            if role is not None:
                with _makes_roles(connection):
                    connection.execute(f"GRANT {READER} TO {role}")
                notes += _limit_files(connection, role)
        finally:
            connection.close()
    return notes


@contextmanager
def _makes_roles(connection: Any) -> Iterator[None]:
    """Say who or which right is missing: who only owns a database may not make roles everywhere."""
    import psycopg

    try:
        yield
    except psycopg.errors.UndefinedObject as error:
        text = str(error).partition("\n")[0]
        raise InputError(
            f"the server has no such user ({text})",
            remedy="Make it first, with CREATE ROLE … LOGIN, or name one that is there.",
        ) from None
    except psycopg.errors.InsufficientPrivilege as error:
        user, text = connection.info.user, str(error).partition("\n")[0]
        raise PlatformError(
            f"user {user} may not make roles or members of {READER} ({text}). Run 'adeye db grant' "
            f"as a superuser of the server, or let one run 'ALTER ROLE {user} CREATEROLE'"
            f"{_ADMIN.format(user=user)} first."
        ) from None


def _make_reader(connection: Any) -> None:
    known = connection.execute("SELECT 1 FROM pg_roles WHERE rolname = %s", (READER,)).fetchone()
    if known is None:
        with _makes_roles(connection):
            connection.execute(f"CREATE ROLE {READER} NOLOGIN NOINHERIT NOCREATEDB NOCREATEROLE")
    connection.execute(f"GRANT USAGE ON SCHEMA {SCHEMA} TO {READER}")
    connection.execute(f"GRANT SELECT ON ALL TABLES IN SCHEMA {SCHEMA} TO {READER}")
    # Views of scenarios and tables of plug-ins come later.
    connection.execute(
        f"ALTER DEFAULT PRIVILEGES IN SCHEMA {SCHEMA} GRANT SELECT ON TABLES TO {READER}"
    )
    (database,) = connection.execute("SELECT quote_ident(current_database())").fetchone()
    # Where not everybody may connect, who reads must.
    connection.execute(f"GRANT CONNECT ON DATABASE {database} TO {READER}")
    # Everybody may make temporary tables unless told otherwise.
    connection.execute(f"REVOKE TEMPORARY ON DATABASE {database} FROM PUBLIC")


def _limit_files(connection: Any, role: str) -> list[str]:
    """Bound what a query may write while it sorts, where the server lets this user say so."""
    import psycopg

    try:
        connection.execute(f"ALTER ROLE {role} SET temp_file_limit TO '{_TEMP_FILES}'")
    except psycopg.Error as error:
        text = str(error).partition("\n")[0]
        return [f"temporary files of {role} are not limited: {text}"]
    return []
