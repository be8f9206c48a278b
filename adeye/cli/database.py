"""``db upgrade|info|verify|merge|metadata``: the database file itself."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from adeye.cli.datasette import metadata
from adeye.cli.options import Db, Json, add
from adeye.cli.output import clean, emit, emit_fields, emit_json, emit_table, talk

_INTEGRITY = 4

database_app = typer.Typer(
    help="Create, upgrade, describe, verify and merge databases.", no_args_is_help=True
)


def upgrade(db: Db = None, json: Json = False) -> None:
    """Create the database or bring it to the newest schema, wholly or not at all."""
    from adeye.store import schema
    from adeye.store.database import database_path

    before = schema.current(db)
    after = schema.upgrade(db)
    if json:
        emit_json("db-upgrade", {"path": database_path(db), "before": before, "after": after})
    elif before == after:
        emit(clean(f"{database_path(db)}: schema {after} already"))
    else:
        emit(clean(f"{database_path(db)}: schema {before or 'none'} → {after}"))


def info(db: Db = None, json: Json = False) -> None:
    """Say what the database holds: schema, size, rows by table, campaigns."""
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        found = repository.info()
        campaigns = repository.campaigns()
    if json:
        emit_json(
            "db-info",
            {
                "path": found.path,
                "database_schema": found.schema,
                "size_bytes": found.size_bytes,
                "rows": found.rows,
                "campaigns": [
                    {
                        "number": item.number,
                        "id": item.id,
                        "odd": item.odd,
                        "planned": item.planned,
                        "state": item.state,
                        "created_at": item.created_at,
                    }
                    for item in campaigns
                ],
            },
        )
        return
    emit_fields(
        {"Database": found.path, "Schema": found.schema, "Size": f"{found.size_bytes / 1e6:.1f} MB"}
    )
    emit_table(("Table", "Rows"), list(found.rows.items()), right=("Rows",))
    rows = [
        [item.number, item.id[:10], item.odd, item.planned, item.state, item.created_at]
        for item in campaigns
    ]
    headers = ("Number", "Campaign", "ODD", "Test cases", "State", "First planned")
    emit_table(headers, rows, right=("Number", "Test cases"))


def verify(db: Db = None, json: Json = False) -> None:
    """Check that every stored row is as it was written, and name each that is not.

    Exit codes: 0 intact, 4 something was altered, is missing or does not belong.
    """
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        findings = repository.verify()
        rows = sum(repository.info().rows.values())
    if json:
        emit_json("db-verify", {"rows": rows, "findings": findings})
    else:
        for finding in findings:
            emit(clean(finding))
        if not findings:
            emit(f"Intact: {rows} rows are as they were written.")
    if findings:
        talk(f"IntegrityError: {len(findings)} findings in {rows} rows. Restore it from a copy.")
        raise typer.Exit(_INTEGRITY)


def merge(
    into: Annotated[str, typer.Argument(metavar="INTO", help="Database that grows.")],
    sources: Annotated[
        list[str], typer.Argument(metavar="FROM...", help="Databases that are only read.")
    ],
    json: Json = False,
) -> None:
    """Bring the results of other databases into one, such as those of the shards of a campaign.

    Each source is verified, and goes in as a whole or not at all; merging it again adds nothing.
    Kept traces stay beside their database.

    Exit codes: 0 merged, 2 no such database, 4 a source was altered or contradicts what is there,
    5 database or disk.
    """
    from adeye.store.repository import Repository

    merged = []
    with Repository.open(into) as repository:
        for source in sources:
            found = repository.queue.merge(source)
            merged.append(found)
            if not json:
                emit(
                    clean(
                        f"{found.source}: campaigns {len(found.campaigns):,}, new runs "
                        f"{found.runs:,}, blocks done by it {found.blocks:,}"
                    )
                )
    if json:
        emit_json("db-merge", {"into": into, "sources": [asdict(item) for item in merged]})


add(database_app, upgrade, "adeye db upgrade", "adeye db upgrade --db my.db")
add(database_app, info, "adeye db info", "adeye db info --json")
add(database_app, verify, "adeye db verify")
add(
    database_app,
    merge,
    "adeye db merge all.db shard1.db shard2.db shard3.db",
    "adeye db merge all.db shard1.db --json",
)
add(database_app, metadata, "adeye db metadata -o metadata.json")
