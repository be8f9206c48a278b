"""A database as SQL shows it, and as somebody leaves it who has the file."""

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from tests.tampering import unguarded


def rows(db: Path, sql: str, *arguments: object) -> list[tuple[Any, ...]]:
    """Give what a query finds."""
    with closing(sqlite3.connect(db)) as connection:
        return connection.execute(sql, arguments).fetchall()


def alter(db: Path, *statements: str) -> None:
    """Write what no trigger would let pass, and leave the triggers as they were."""
    with closing(sqlite3.connect(db, isolation_level=None)) as raw, unguarded(raw):
        for statement in statements:
            raw.execute(statement)
