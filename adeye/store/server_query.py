"""Run SQL that a person typed on a PostgreSQL server: as a role that only reads, within limits.

A read-only transaction can be left by whoever may send a second statement, and a superuser may read
files of the server in a SELECT. So the statement goes alone (extended protocol), behind a cursor,
in a read-only transaction, as the role ``READER`` that ``grant`` makes; a user who could do more
than read and cannot become that role is refused. ``sql_words`` lets only known functions pass.
"""

from __future__ import annotations

import re
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import InputError, PlatformError
from adeye.store.database import Database, errors_in_words
from adeye.store.postgres import SCHEMA, unreadable
from adeye.store.query import QueryResult
from adeye.store.schema import require_current
from adeye.store.sql_words import Token, checked

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from adeye.store.location import Location

READER: Final = "adeye_reader"
"""Role without login that may read and nothing else; users are made members of it."""

_ROLE: Final = re.compile(r"[a-z_][a-z0-9_]{0,62}")
_ADMIN: Final = f" (from PostgreSQL 16 on also 'GRANT {READER} TO {{user}} WITH ADMIN OPTION')"
_BATCH_ROWS: Final = 200
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


def run_server_query(
    location: Location,
    sql: str,
    parameters: Mapping[str, str],
    max_rows: int,
    timeout_s: float,
) -> QueryResult:
    """Run one SELECT; see ``query.run_query``.

    Args:
        location: A database of a server.
        sql: One statement.
        parameters: Values of what it names ``:name``.
        max_rows: Most rows to return.
        timeout_s: Longest time that it may run [s].

    Raises:
        InputError: The statement is wrong, not allowed, or ran too long; or the user may do more
            than read.
        PlatformError: The database cannot be read.
    """
    if len(sql) > _MOST_SQL:
        raise InputError("query: the statement is too long", remedy="Write less than 100 kB.")
    command = _for_driver(sql, checked(sql), parameters)
    with _reading(location) as connection:
        _require_ours(location)
        return _fetch(connection, command, parameters, max_rows, timeout_s)


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


def _require_ours(location: Location) -> None:
    database = Database(location)
    try:
        with database.read() as connection:
            require_current(connection, location)
    finally:
        database.close()


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


def _fetch(
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
        return InputError(
            "query: only reading is allowed", remedy="Write one SELECT over the views."
        )
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
        InputError: The name of the role is not a plain one.
        PlatformError: The server refused.
    """
    if role is not None and _ROLE.fullmatch(role) is None:
        raise InputError(
            f"role {role!r} is not a plain name",
            remedy="Use lower-case letters, digits and underscores.",
        )
    _require_ours(location)
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
    """Say which right is missing if the server lets nobody make roles who only owns a database."""
    import psycopg

    try:
        yield
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
