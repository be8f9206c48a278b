"""A database as somebody has it who holds the file and a shell."""

import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager


def at_once(raw: sqlite3.Connection, statements: Iterable[str]) -> None:
    """Execute statements in one transaction: the disk is waited for once."""
    is_begun = raw.in_transaction
    for statement in statements if is_begun else ("BEGIN", *statements, "COMMIT"):
        raw.execute(statement)


def unguard(raw: sqlite3.Connection) -> Sequence[str]:
    """Let anything be written: no triggers, no foreign keys, no checks; return the triggers."""
    triggers = raw.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'").fetchall()
    at_once(raw, [f"DROP TRIGGER {name}" for name, _ in triggers])
    raw.execute("PRAGMA foreign_keys = OFF")
    raw.execute("PRAGMA ignore_check_constraints = ON")
    return [statement for _, statement in triggers]


@contextmanager
def unguarded(raw: sqlite3.Connection) -> Iterator[None]:
    """Let anything be written, and leave triggers as they were: no other trace is left."""
    triggers = unguard(raw)
    yield
    at_once(raw, triggers)
