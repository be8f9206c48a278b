"""A database as someone opens it who goes around the repository."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Sequence
from typing import Any, Final, Protocol

import pytest

from adeye.store.postgres import SCHEMA, translated
from adeye.store.repository import Repository
from adeye.store.schema import trigger_ddl
from adeye.store.tables import metadata
from tests.tampering import at_once, unguard

on_sqlite = pytest.mark.parametrize("place", ["sqlite"], indirect=True)
"""Marks a test of what only a file can have."""


class Raw(Protocol):
    """What both drivers have in common."""

    def execute(self, statement: str, values: Sequence[Any] = (), /) -> Any:
        """Execute a statement and commit it."""

    def close(self) -> None:
        """Close the connection."""


_DROP: Final = re.compile(r"^(DROP TRIGGER )((\w+)_no_(?:update|delete))$")


class _Row(tuple[Any, ...]):
    """A row whose values have names, too."""

    names: tuple[str, ...] = ()

    def __getitem__(self, key: Any) -> Any:
        return super().__getitem__(self.names.index(key) if isinstance(key, str) else key)

    def keys(self) -> tuple[str, ...]:
        return self.names


def _named(cursor: Any) -> Any:
    return type("Named", (_Row,), {"names": tuple(c.name for c in cursor.description or ())})


class _Server:
    """A connection to PostgreSQL that takes the statements of SQLite and errs as it does."""

    row_factory: Any = None

    def __init__(self, repository: Repository) -> None:
        import psycopg

        url = repository.location.url.set(drivername="postgresql")
        dsn = url.render_as_string(hide_password=False)
        self._connection = psycopg.connect(dsn, autocommit=True, row_factory=_named)
        self._connection.execute(f"SET search_path TO {SCHEMA}")
        self._rules: list[str] = []

    def execute(self, statement: str, values: Sequence[Any] = (), /) -> Any:
        import psycopg

        statement = _DROP.sub(r"\1\2 ON \3", statement)
        try:
            return self._connection.execute(translated(statement).encode(), values)
        except psycopg.Error as error:
            is_refused = (error.sqlstate or "").startswith(("23", "P0001"))
            kind = sqlite3.IntegrityError if is_refused else sqlite3.OperationalError
            raise kind(str(error)) from error

    def commit(self) -> None:
        """Every statement is a transaction."""

    def close(self) -> None:
        self._connection.close()

    def unguarded(self) -> None:
        """Let rows be changed in any way that the types of columns allow."""
        self.execute("SET session_replication_role = replica")
        for table, name, rule in self.execute(
            "SELECT conrelid::regclass::text, conname, pg_get_constraintdef(oid, true) "  # noqa: S608 - own names
            f"FROM pg_constraint WHERE contype = 'c' AND connamespace = '{SCHEMA}'::regnamespace"
        ).fetchall():
            self.execute(f"ALTER TABLE {table} DROP CONSTRAINT {name}")
            self._rules.append(f"ALTER TABLE {table} ADD CONSTRAINT {name} {rule} NOT VALID")

    def guarded(self) -> None:
        """Put back what ``unguarded`` took away; what is there by now is not checked."""
        self.execute("SET session_replication_role = origin")
        while self._rules:
            self._connection.execute(self._rules.pop().encode())


def unguarded(raw: Any) -> None:
    """Give somebody a database and a shell: no triggers, no foreign keys, no checks."""
    if isinstance(raw, _Server):
        raw.unguarded()
        return
    unguard(raw)


def guarded(raw: Any) -> None:
    """Put back what ``unguarded`` took away."""
    if isinstance(raw, _Server):
        raw.guarded()
        return
    at_once(raw, trigger_ddl())


def raw_connection(repository: Repository) -> Raw:
    """Open the database of a repository."""
    path = repository.location.path
    if path is None:
        return _Server(repository)
    return sqlite3.connect(path, isolation_level=None)


def rows(raw: Raw) -> dict[str, list[Any]]:
    """Read every row of every table, in one order for both databases."""
    return {
        name: sorted(raw.execute(f"SELECT * FROM {name}").fetchall(), key=repr)  # noqa: S608 - own names
        for name in metadata.tables
    }
