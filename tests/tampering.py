"""A database as somebody has it who holds the file and a shell."""

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager


def unguard(raw: sqlite3.Connection) -> Sequence[str]:
    """Let anything be written: no triggers, no foreign keys, no checks; return the triggers."""
    triggers = raw.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'").fetchall()
    for name, _ in triggers:
        raw.execute(f"DROP TRIGGER {name}")
    raw.execute("PRAGMA foreign_keys = OFF")
    raw.execute("PRAGMA ignore_check_constraints = ON")
    return [statement for _, statement in triggers]


@contextmanager
def unguarded(raw: sqlite3.Connection) -> Iterator[None]:
    """Let anything be written, and leave triggers as they were: no other trace is left."""
    triggers = unguard(raw)
    yield
    for statement in triggers:
        raw.execute(statement)
