"""Write the statements of the newest migration from what the code describes.

``python -m tests.store.migration`` compares the database of the schema before it with the tables,
triggers and views of the code, and writes what is new or differs. A table that changed needs a
migration written by hand.
"""

from __future__ import annotations

import hashlib
import sqlite3
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sqlalchemy.dialects import postgresql
from sqlalchemy.dialects import sqlite as sqlite_dialect
from sqlalchemy.schema import CreateIndex, CreateTable

from adeye.store import postgres, repository, schema
from adeye.store.tables import metadata
from adeye.store.triggers import trigger_ddl
from adeye.store.views import view_ddl

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Dialect

FOLDER: Final = Path(schema.__file__).parent / "migrations" / "versions"
ASSETS: Final = Path(__file__).parents[1] / "db_assets"
SEPARATOR: Final = "\n\n--\n\n"
NAMES: Final = {"sqlite": "SQLite", "postgresql": "PostgreSQL"}

assert repository.__name__  # imports every module that describes a table


def normal(statement: str) -> str:
    return " ".join(statement.split())


def described(dialect: Dialect) -> Iterator[tuple[str, str]]:
    """Give name and statement of all that a database has, in the order of dependencies."""
    if dialect.name == "postgresql":
        yield from postgres.FUNCTIONS.items()
    for table in metadata.sorted_tables:
        yield table.name, str(CreateTable(table).compile(dialect=dialect)).strip()
        for index in sorted(table.indexes, key=lambda item: str(item.name)):
            yield str(index.name), str(CreateIndex(index).compile(dialect=dialect)).strip()
    for statement in trigger_ddl(dialect.name):
        yield statement.split(maxsplit=3)[2], statement
    yield from view_ddl().items()


def stored(asset: Path) -> dict[str, tuple[str, str]]:
    connection = sqlite3.connect(asset)
    found = connection.execute("SELECT name, type, sql FROM sqlite_master WHERE sql IS NOT NULL")
    rows = {name: (kind, sql) for name, kind, sql in found}
    connection.close()
    return rows


def statements(dialect: str) -> list[str]:
    """List the statements of the newest migration."""
    former = f"{int(schema.head()) - 1:04}"
    if dialect == "postgresql":
        made = dict(described(postgresql.dialect()))  # type: ignore[no-untyped-call]
        return [*_dropped(made, _written(former)), *_added(made, _written(former))]
    before = stored(ASSETS / f"v{former}.db")
    wanted = dict(described(sqlite_dialect.dialect()))
    changed = [
        name
        for name, statement in wanted.items()
        if name in before and normal(before[name][1]) != normal(statement)
    ]
    for name in changed:
        if before[name][0] != "view":
            sys.exit(f"{before[name][0]} {name} changed: write that part by hand")
    # Every view goes, because those that stay may name one that does not.
    dropped = [f"DROP VIEW {name}" for name in reversed(list(wanted)) if name in changed]
    added = [
        statement for name, statement in wanted.items() if name in changed or name not in before
    ]
    return [*dropped, *added]


def _written(head: str) -> frozenset[str]:
    """Read what the migrations of a server have made so far, up to one of them."""
    files = sorted(FOLDER.glob("*.postgresql.sql"))
    return frozenset(
        normal(statement)
        for file in files
        if file.name[:4] <= head
        for statement in file.read_text("utf-8").split(SEPARATOR)
    )


def _changed(made: dict[str, str], before: frozenset[str]) -> list[str]:
    """Name what is not as it was; with a view, every one that names it, which hinders its drop."""
    changed: list[str] = []
    for name, statement in made.items():
        is_view = statement.startswith("CREATE VIEW")
        if normal(statement) not in before or (
            is_view and any(f"{other}" in statement.split() for other in changed)
        ):
            changed.append(name)
    return changed


def _dropped(made: dict[str, str], before: frozenset[str]) -> list[str]:
    known = {words.split()[2] for words in before if words.startswith("CREATE VIEW")}
    return [f"DROP VIEW {name}" for name in reversed(_changed(made, before)) if name in known]


def _added(made: dict[str, str], before: frozenset[str]) -> list[str]:
    return [
        f"{made[name]}{SEPARATOR}COMMENT ON VIEW {name} IS "
        f"'{hashlib.sha256(made[name].encode()).hexdigest()}'"
        if made[name].startswith("CREATE VIEW")
        else made[name]
        for name in _changed(made, before)
    ]


def script(dialect: str) -> str:
    """Write the file of the newest migration."""
    head = f"-- Schema {schema.head()} for {NAMES[dialect]}. A line of two dashes stands between"
    return SEPARATOR.join([f"{head} statements.", *statements(dialect)]) + "\n"


def path(dialect: str) -> Path:
    """Name the file of the newest migration."""
    (module,) = FOLDER.glob(f"{schema.head()}_*.py")
    return FOLDER / f"{module.stem}.{dialect}.sql"


if __name__ == "__main__":
    for dialect in NAMES:
        path(dialect).write_text(script(dialect), "utf-8")
