"""PostgreSQL: its connections, its transactions, bulk inserts, and its errors in words.

The SQL of this package is written once, in the words that SQLite has; ``translated`` gives what
PostgreSQL calls the few things that have another name there. Everything lies in a schema of its
own, ``adeye``, whose function ``json_each`` does what SQLite's does.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import BigInteger, Boolean, Float, Integer, create_engine, event
from sqlalchemy.exc import DBAPIError

from adeye.errors import (
    AdeyeError,
    InputError,
    IntegrityError,
    LostConnection,
    PlatformError,
    needing,
)
from adeye.store.sql import statement
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sqlalchemy import Connection, Engine, Table

    from adeye.store.location import Location

SCHEMA: Final = "adeye"
STALL_S: Final = 120
"""Longest time that a writer may keep all others waiting with one statement, or without any [s]."""
_LOCK: Final = 0x6164657965
"""Key of the advisory lock that lets one transaction write at a time."""
_CONNECT_S: Final = 10
_COPIED: Final = 64
"""Rows from which on a copy is faster than inserts."""

_TEXT: Final = re.compile(r"('(?:[^']|'')*')")
_WORDS: Final = (
    ("date('now')", "to_char(now() AT TIME ZONE 'UTC', 'YYYY-MM-DD')"),
    ("group_concat(", "string_agg("),
    ("CROSS JOIN", "JOIN"),
    # Not trim(): of two long texts it takes minutes in one step, so that no query may call it.
    ("NOT GLOB '*[^ ]*'", "!~ '[^ ]'"),
    ("NOT GLOB '*[^ ?.!-]*'", "!~ '[^ ?.!-]'"),
    ("json_each(?)", "json_each(CAST(? AS TEXT))"),
)

FUNCTIONS: Final = {name: statement(name) for name in ("json_each", "insert_only")}
"""Statements that create what views and triggers call."""

_LOST: Final = ("08", "57P01", "57P02", "57P03", "57P05", "25P03", "40P01")
_CAUSES: Final = (
    ("28", "does not let this user in", "Check user and password, or PGPASSFILE."),
    ("3D000", "does not exist", "Create it with 'createdb', or name another with --db."),
    (
        "42501",
        "does not allow that to this user",
        "Who runs campaigns logs in as its owner; who reads needs that the owner ran "
        "'adeye db grant USER'.",
    ),
    ("53100", "cannot grow: the disk of the server is full", "Free some space and run again."),
    ("53", "has no resources left", "Wait for others to finish, or raise the server's limits."),
    ("55P03", "is locked by another process", "Wait for it to finish, or end it."),
    ("57014", "took too long and was cancelled", "Run again; see what else the server does."),
    ("25006", "is read-only", "Name the primary server, or give this user write access."),
)


_REFUSALS: Final = (
    ("authentication failed", "28P01"),
    ("no pg_hba", "28000"),
    ("password supplied", "28P01"),
    ('role "', "28000"),
    ("does not exist", "3D000"),
)


def make_engine(location: Location, writes_option: str) -> Engine:
    """Prepare connections.

    Args:
        location: A database of a server.
        writes_option: Execution option of a connection whose transaction writes: ``alone`` or
            ``shared``.

    Raises:
        InputError: Its address has an option that the driver does not know.
        MissingExtra: The driver is not installed.
    """
    with needing("a PostgreSQL database", "postgres"):
        import psycopg
    known = {item.keyword.decode() for item in psycopg.pq.Conninfo.get_defaults()}
    if unknown := sorted(set(location.url.query) - known):
        # Its value may be a password under a name that is misspelt.
        raise InputError(
            f"database {location}: {shown(unknown[0])} is no option of an address",
            remedy="Name one of PostgreSQL, such as sslmode, or leave it out.",
        )
    engine = create_engine(
        location.url,
        pool_pre_ping=True,
        connect_args={
            "connect_timeout": _CONNECT_S,
            "application_name": "adeye",
            "client_encoding": "utf8",
        },
    )

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _record: object) -> None:
        connection.adapters.register_loader("numeric", _number_loader(psycopg))
        with connection.cursor() as cursor:
            cursor.execute(f"SET search_path TO {SCHEMA}")
            # Whatever the server is set to, numbers, times and what made a view arrive as stored.
            for setting in (
                "timezone TO 'UTC'",
                "datestyle TO 'ISO'",
                "client_encoding TO 'UTF8'",
                "extra_float_digits TO 1",
                "quote_all_identifiers TO off",
            ):
                cursor.execute(f"SET {setting}")
            # A writer that was stopped, or a machine that is gone, must not stop everybody.
            cursor.execute(f"SET idle_in_transaction_session_timeout TO '{STALL_S}s'")
        connection.commit()

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get(writes_option)
        if writes is None:
            connection.exec_driver_sql("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ")
            return
        connection.exec_driver_sql(f"SET LOCAL statement_timeout TO '{STALL_S}s'")
        if writes == "alone":
            connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_LOCK})")

    @event.listens_for(engine, "before_cursor_execute", retval=True)
    def _translate(
        _connection: object,
        _cursor: object,
        statement: str,
        parameters: Any,
        context: Any,
        _executemany: object,
    ) -> tuple[str, Any]:
        is_ours = context is None or context.compiled is None
        return (translated(statement) if is_ours else statement), parameters

    return engine


def _number_loader(psycopg: Any) -> Any:
    class Number(psycopg.adapt.Loader):  # type: ignore[misc]
        """Reads sums of whole numbers as what they are."""

        def load(self, data: Any) -> int | float:
            text = bytes(data).decode()
            return int(text) if text.lstrip("-").isdigit() else float(text)

    return Number


@cache
def translated(statement: str) -> str:
    """Write a statement of this package as PostgreSQL and its driver take it."""
    for here, there in _WORDS:
        statement = statement.replace(here, there)
    parts = _TEXT.split(statement.replace("%", "%%"))
    parts[::2] = [part.replace("?", "%s") for part in parts[::2]]
    return "".join(parts)


@contextmanager
def errors_in_words(location: Location) -> Iterator[None]:
    """Translate what the driver raises; see ``database.errors_in_words``."""
    import psycopg

    try:
        yield
    except (DBAPIError, psycopg.Error) as error:
        raise _in_words(getattr(error, "orig", None) or error, location) from None


def _in_words(error: BaseException, location: Location) -> AdeyeError:
    text = str(error).partition("\n")[0]
    state = getattr(error, "sqlstate", None)
    # If a server answered but does not let in, the driver gives none.
    state = state or next((known for words, known in _REFUSALS if words in text), "")
    text = location.without_secrets(text)
    if state.startswith("23") or state == "P0001":
        return IntegrityError(
            f"database {location} refused a change: {text}. "
            "Run 'adeye db verify'; rows of results are never changed or deleted."
        )
    if state.startswith("XX"):
        return IntegrityError(f"database {location} is damaged: {text}. Restore it from a copy.")
    if not state and re.search(r"\binvalid \S+ value\b", text):
        # The driver has not asked anybody yet.
        remedy = "Correct the option of the address, or leave it out."
        return InputError(f"database {location}: {text}", remedy=remedy)
    if not state or state.startswith(_LOST):
        return LostConnection(
            f"database {location} cannot be reached ({text}). Check server and network, run again."
        )
    for prefix, cause, remedy in _CAUSES:
        if state.startswith(prefix):
            return PlatformError(f"database {location} {cause} ({text}). {remedy}")
    return PlatformError(f"database {location}: {text}. Run 'adeye db verify'.")


def unreadable(location: Location, user: str) -> PlatformError:
    """Make what a user is told who may log in, but was not given the right to read."""
    return PlatformError(
        f"database {location} does not let user {user} read. Its owner, or a superuser of the "
        f"server, runs 'adeye db grant {user}'; then {user} may read, and nothing else."
    )


def require_readable(connection: Connection, location: Location) -> None:
    """Refuse a user who lacks the right to the schema: its tables are there, but not for this one.

    Raises:
        PlatformError: This user does, or the database cannot hold every text.
    """
    user, may_read, encoding = connection.exec_driver_sql(
        f"SELECT current_user, has_schema_privilege(to_regnamespace('{SCHEMA}'), 'USAGE'), "
        "current_setting('server_encoding')"
    ).one()
    if encoding != "UTF8":
        raise PlatformError(
            f"database {location} has the encoding {encoding}, which does not hold every text. "
            "Make one by 'createdb --encoding=UTF8 --template=template0'"
        )
    if may_read is False:
        raise unreadable(location, user)


def insert_rows(connection: Connection, table: Table, rows: Sequence[tuple[Any, ...]]) -> int:
    """Insert rows that have a value for every column, in order, and count those that were taken."""
    columns = ", ".join(column.name for column in table.columns)
    if len(rows) < _COPIED:
        places = ", ".join("?" for _ in table.columns)
        return connection.exec_driver_sql(
            f"INSERT INTO {table.name} ({columns}) VALUES ({places})",  # noqa: S608 - own names
            list(rows),
        ).rowcount
    cursor: Any = connection.connection.cursor()
    with cursor.copy(f"COPY {table.name} ({columns}) FROM STDIN (FORMAT BINARY)") as copy:
        copy.set_types(_types(table))
        for row in rows:
            copy.write_row(row)
    return int(cursor.rowcount)


@cache
def _types(table: Table) -> list[str]:
    return [
        "int2"
        if isinstance(column.type, Boolean)
        else "int8"
        if isinstance(column.type, BigInteger)
        else "int4"
        if isinstance(column.type, Integer)
        else "float8"
        if isinstance(column.type, Float)
        else "text"
        for column in table.columns
    ]
