"""``db upgrade|info|verify|metadata|grant``: the database file itself."""

from __future__ import annotations

from typing import Annotated

import typer

from adeye.cli.datasette import metadata
from adeye.cli.options import Db, Json, add
from adeye.cli.output import clean, emit, emit_fields, emit_json, emit_table, talk

_INTEGRITY = 4

database_app = typer.Typer(
    help="Create, upgrade, describe and verify the database.", no_args_is_help=True
)


def upgrade(db: Db = None, json: Json = False) -> None:
    """Create the database or bring it to the newest schema, wholly or not at all."""
    from adeye.store import schema
    from adeye.store.location import locate

    before = schema.current(db)
    after = schema.upgrade(db)
    if json:
        emit_json("db-upgrade", {"path": str(locate(db)), "before": before, "after": after})
    elif before == after:
        emit(clean(f"{locate(db)}: schema {after} already"))
    else:
        emit(clean(f"{locate(db)}: schema {before or 'none'} → {after}"))


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


add(database_app, upgrade, "adeye db upgrade", "adeye db upgrade --db my.db")
add(database_app, info, "adeye db info", "adeye db info --json")
add(database_app, verify, "adeye db verify")


def grant(
    role: Annotated[
        str | None,
        typer.Argument(metavar="[ROLE]", help="User of the server who shall be able to read."),
    ] = None,
    *,
    db: Db = None,
) -> None:
    """Let a user of a PostgreSQL server read the database and do nothing else.

    Makes the role adeye_reader, as which 'adeye query' runs what people type; without it, 'adeye
    query' refuses users who may do more on the server. Takes the right to make temporary tables
    from everybody. To be run by the owner of the database.
    """
    from adeye.errors import UsageError
    from adeye.store.location import locate
    from adeye.store.server_query import READER
    from adeye.store.server_query import grant as grant_reading

    location = locate(db)
    if not location.is_server:
        raise UsageError(
            "rights are those of a server, and this database is a file",
            remedy="Give readers the right to read the file, or --db postgresql://….",
        )
    for note in grant_reading(location, role):
        talk(f"note: {clean(note)}")
    emit(f"{READER} may read" + (f", and {clean(role)} is a member of it" if role else ""))


add(database_app, metadata, "adeye db metadata -o metadata.json")
add(database_app, grant, "adeye db grant alice --db postgresql://admin@db.example/adeye")
