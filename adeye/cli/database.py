"""``db upgrade|info|verify|merge|copy|metadata|grant``; ``db prove|withdraw``: runs as evidence."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.datasette import metadata
from adeye.cli.options import Db, Json, RunId, add
from adeye.cli.output import clean, emit, emit_fields, emit_json, emit_table, talk

if TYPE_CHECKING:
    from adeye.store.roots import Root

_INTEGRITY = 4

database_app = typer.Typer(
    help="Create, upgrade, describe, verify, merge and copy databases.", no_args_is_help=True
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
        roots = {item.id: repository.evidence.root(item.id) for item in campaigns}
        sessions = {item.id: repository.evidence.sessions(item.id) for item in campaigns}
        withdrawn = repository.evidence.withdrawals()
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
                        "root": root_of(roots[item.id]),
                        "provenance": dict(item.provenance),
                        "sessions": [asdict(one) for one in sessions[item.id]],
                    }
                    for item in campaigns
                ],
                "withdrawn": [asdict(item) for item in withdrawn],
            },
        )
        return
    emit_fields(
        {"Database": found.path, "Schema": found.schema, "Size": f"{found.size_bytes / 1e6:.1f} MB"}
    )
    emit_table(("Table", "Rows"), list(found.rows.items()), right=("Rows",))
    rows = [
        [
            *(item.number, item.id[:10], item.odd, item.planned, item.state, item.created_at),
            (root_of(roots[item.id]) or "-")[:16],
        ]
        for item in campaigns
    ]
    headers = ("Number", "Campaign", "ODD", "Test cases", "State", "First planned", "Root")
    emit_table(headers, rows, right=("Number", "Test cases"))
    if withdrawn:
        taken = [[item.result_digest[:12], item.at, item.author, item.reason] for item in withdrawn]
        emit_table(("Withdrawn", "At", "By", "Reason"), taken)


def root_of(root: Root | None) -> str | None:
    """Give the root in hex, if there is one."""
    return None if root is None else root.root


def verify(db: Db = None, json: Json = False) -> None:
    """Check that every stored row and every kept trace is as it was written, and name all others.

    Also what is gone is named, what was never written by adeye, and a campaign whose Merkle root is
    not the one that it had when it was complete.

    Exit codes: 0 intact, 4 something was altered, is missing or does not belong.
    """
    from adeye.campaign.artefacts import altered_files, left_files
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        findings = (*repository.verify(), *altered_files(repository))
        left = left_files(repository)
        rows = sum(repository.info().rows.values())
    if json:
        emit_json("db-verify", {"rows": rows, "findings": findings})
    else:
        for finding in findings:
            emit(clean(finding))
        if not findings:
            emit(f"Intact: {rows} rows are as they were written.")
    if left:
        talk(
            clean(
                f"{len(left)} files of traces belong to no run of this database, as an interrupted "
                "block leaves them, or belong to one that was copied or renamed; nothing is wrong "
                f"with it: {left[0]}"
            )
        )
    if findings:
        talk(f"IntegrityError: {len(findings)} findings in {rows} rows. Restore it from a copy.")
        raise typer.Exit(_INTEGRITY)


def prove(
    run: RunId,
    campaign: Annotated[
        str | None,
        typer.Option(
            "--campaign",
            metavar="CAMPAIGN",
            envvar="ADEYE_CAMPAIGN",
            help="Number or digest; default: latest.",
        ),
    ] = None,
    db: Db = None,
    json: Json = False,
) -> None:
    """Prove that a run is evidence of a campaign, by its leaf and path in the Merkle tree.

    Whoever knows the campaign's root can check it without the database (RFC 6962, section 2.1).
    """
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        chosen = repository.find_campaign(campaign)
        proof = repository.evidence.prove(run, chosen.id)
    if json:
        emit_json("db-prove", asdict(proof))
        return
    emit_fields(
        {
            "Campaign": proof.campaign,
            "Run": proof.result_digest,
            "Place": f"{proof.ordinal} of {proof.leaves}",
            "Leaf": proof.leaf,
            "Path": " ".join(proof.path),
            "Root": proof.root,
        }
    )


def withdraw(
    run: RunId,
    author: Annotated[
        str, typer.Option("--author", metavar="NAME", envvar="ADEYE_AUTHOR", help="Who says so.")
    ],
    reason: Annotated[
        str, typer.Option("--reason", metavar="TEXT", envvar="ADEYE_REASON", help="Why.")
    ],
    db: Db = None,
    json: Json = False,
) -> None:
    """Let a result count as evidence no more; it stays as it is, with author and reason beside it.

    Its verdicts count as NOT_RUN in every campaign, so that no gate is green with it. Another
    version of an engine executes its test case anew, which gives another result.
    """
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        found = repository.find_run(run)
        is_new = repository.evidence.withdraw(found.result_digest, author=author, reason=reason)
    if json:
        emit_json("db-withdraw", {"run": found.result_digest, "is_new": is_new})
    elif is_new:
        emit(clean(f"{found.result_digest[:12]}: withdrawn by {author}: {reason}"))
    else:
        emit(f"{found.result_digest[:12]}: withdrawn already")


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
    from adeye.store.kept_files import folder_of
    from adeye.store.location import locate
    from adeye.store.merging import origin_of, require_source
    from adeye.store.repository import Repository

    merged = []
    place = locate(into)
    for source in sources:
        require_source(source)
    for source in sources:
        # Verified before the other one is opened, which would make it.
        with origin_of(source) as origin, Repository.open(place) as repository:
            found = repository.merge(origin)
        merged.append(found)
        if not json:
            emit(
                clean(
                    f"{found.source}: campaigns {len(found.campaigns):,}, new runs "
                    f"{found.runs:,}, blocks done by it {found.blocks:,}"
                )
            )
        if found.traces:
            talk(
                clean(
                    f"note: {found.source}: the kept traces of {found.traces:,} runs stay in "
                    f"{folder_of(origin.place.beside)}; 'adeye db copy' would take them along"
                )
            )
    if json:
        emit_json("db-merge", {"into": str(place), "sources": [asdict(item) for item in merged]})


def copy(
    campaigns: Annotated[
        list[str],
        typer.Option(
            "--campaign",
            metavar="CAMPAIGN",
            envvar="ADEYE_CAMPAIGNS",
            help="Number or digest of one to copy; may be given several times.",
        ),
    ],
    to: Annotated[
        str,
        typer.Option(
            "--to", metavar="NEW", envvar="ADEYE_DB_TO", help="Database that is made for them."
        ),
    ],
    *,
    db: Db = None,
    json: Json = False,
) -> None:
    """Copy campaigns into a database of their own, with all that they refer to and kept traces.

    Results, verdicts, forks, roots, certificates, withdrawals and sessions go over as they are.
    Both databases are verified, and nothing of the first one is changed: delete it yourself once
    what you keep is elsewhere.

    Exit codes: 0 copied, 2 no such campaign, or the new database has some already, 4 something was
    altered or is missing, 5 database or disk.
    """
    from adeye.campaign.artefacts import copy_campaigns
    from adeye.store.location import locate
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        found = copy_campaigns(repository, campaigns, to)
    place = str(locate(to))
    if json:
        emit_json("db-copy", {"to": place, **asdict(found)})
    else:
        emit(clean(f"{place}: campaigns {len(found.campaigns):,}, runs {found.runs:,}"))


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


add(database_app, upgrade, "adeye db upgrade", "adeye db upgrade --db my.db")
add(database_app, info, "adeye db info", "adeye db info --json")
add(database_app, verify, "adeye db verify")
add(database_app, prove, "adeye db prove 3f9c2a", "adeye db prove 3f9c2a --json")
add(
    database_app,
    withdraw,
    "adeye db withdraw 3f9c2a --author 'J. Doe' --reason 'wrong map version'",
)
add(database_app, metadata, "adeye db metadata -o metadata.json")
add(database_app, grant, "adeye db grant alice --db postgresql://admin@db.example/adeye")
add(
    database_app,
    merge,
    "adeye db merge all.db shard1.db shard2.db shard3.db",
    "adeye db merge all.db shard1.db --json",
)
add(
    database_app,
    copy,
    "adeye db copy --campaign 3 --to keep.db",
    "adeye db copy --campaign 3f9c2a --campaign 7 --to release.db --db team.db",
)
