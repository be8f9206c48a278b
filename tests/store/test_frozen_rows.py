"""The rows that a small campaign leaves in each table, pinned but for digests and blocks."""

from contextlib import closing
from sqlite3 import connect
from typing import Any

from tests.frozen import assert_frozen, masked
from tests.project import Executed

MANY = 60
"""Of a longer table about so many rows."""


def cell(value: Any) -> str:
    if isinstance(value, bytes):
        return "bytes"
    text = f"{value:.9g}" if isinstance(value, float) else str(value)
    return text if len(text) < 200 else f"{text[:60]} and more"


def test_rows_of_each_table_are_frozen(mini: Executed) -> None:
    lines = []
    with closing(connect(f"file:{mini.db}?mode=ro", uri=True)) as connection:
        names = connection.execute(
            "SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name"
        ).fetchall()
        for (name,) in names:
            # What executed it, and since when, is this machine's.
            if name in {"session", "work", "ledger", "seal", "campaign"} or name.startswith(
                ("sqlite", "alembic")
            ):
                continue
            columns = [row[1] for row in connection.execute(f"PRAGMA table_info({name})")]
            kept = [column for column in columns if not column.endswith(("_hash", "_by", "_at"))]
            found = connection.execute(f"SELECT {', '.join(kept)} FROM {name}").fetchall()  # noqa: S608 - of the schema
            told = sorted(" | ".join(masked(cell(item)).strip() for item in row) for row in found)
            lines += [f"{name}: {len(found)} rows of {', '.join(kept)}"]
            lines += [f"  {line}" for line in told[:: -(-len(told) // MANY) or 1]]
    assert_frozen("rows.txt", masked("\n".join(lines), mini.project.folder))
