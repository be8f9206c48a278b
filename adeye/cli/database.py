"""``db …``: make, check, merge and copy databases; ``manifest …``: hashes of files, signed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli import output as out
from adeye.cli.options import CampaignId, Db, Json, RunId, add, named, named_anew, option
from adeye.errors import UsageError, amount
from adeye.judge.verdict import ExitCode
from adeye.outputs import guarded, is_stream, write_atomically

if TYPE_CHECKING:
    from adeye.store.evidence.roots import RunProof
    from adeye.store.evidence.vouched import Root

# --- ``db metadata``: what datasette needs to show a database: titles, units, saved queries -------


def metadata(
    db: Db = None,
    *,
    output: Annotated[Path | None, option("--output -o FILE", callback=named)] = None,
) -> None:
    """Write the metadata for datasette: what views are, units of columns, saved queries.

    Then 'datasette adeye.db --metadata metadata.json' shows the database in a browser.

    Parameters:
        output: File to write, such as metadata.json; default: standard output.

    Examples:
        adeye db metadata -o metadata.json
    """
    text = json.dumps(document(db), indent=1, ensure_ascii=False)
    if output is None:
        out.emit_document(text)
        return
    write_atomically(f"{text}\n".encode(), output)
    out.wrote(output)


def document(db: str | None) -> dict[str, Any]:
    """Describe a database in the form of datasette's ``metadata.json``.

    Raises:
        InputError: There is no such database, or it is on a server.
        PlatformError: It cannot be read.
    """
    from adeye.store.location import locate
    from adeye.store.read.query import run_query
    from adeye.store.read.saved import SAVED, VIEWS
    from adeye.store.views import PREFIX

    path = locate(db).path
    if path is None:
        raise UsageError(
            "datasette shows files of SQLite, and this database is on a server",
            remedy="Name a file with --db.",
        )
    views = run_query(db, "SELECT name FROM sqlite_master WHERE type = 'view' ORDER BY name").rows
    tables: dict[str, Any] = {}
    for (view,) in views:
        # The name is that of a view of ours, or one that somebody made: it is quoted either way.
        quoted = '"' + view.replace('"', '""') + '"'
        columns = run_query(db, f"SELECT * FROM {quoted} LIMIT 0").columns  # noqa: S608
        text = VIEWS.get(view, "")
        if not text and view.startswith(PREFIX):
            text = "v_runs of one scenario, with one typed column for each parameter"
        if not text and view.startswith("v_check_"):
            text = "findings of one rule of 'adeye check'"
        tables[view] = {"description": text, "columns": _columns(columns)}
    queries = {
        name: {"title": name, "description": item.text, "sql": item.sql}
        for name, item in SAVED.items()
    }
    return {
        "title": "adeye",
        "description": "Results of adeye. Columns are in SI; the views are the stable interface. "
        "The canned queries are about the latest campaign.",
        "databases": {path.stem: {"tables": tables, "queries": queries}},
    }


def _columns(names: tuple[str, ...]) -> dict[str, str]:
    """Say what columns mean and which unit they have, where there is something to say."""
    from adeye.store.read.export import TABLES, metric_columns, unit_of

    known = {item.name: item for table in TABLES.values() for item in table.columns}
    known |= {item.name: item for item in metric_columns()}
    described: dict[str, str] = {}
    for name in names:
        item = known.get(name)
        unit = unit_of(name) if item is None else item.unit
        text = "" if item is None else item.text
        said = " ".join(part for part in (text, f"[{unit}]" if unit else "") if part)
        if said:
            described[name] = said
    return described


# --- ``db upgrade|info|verify|merge|copy|metadata|grant``; ``db prove|withdraw``: runs as
# evidence.

database_app = typer.Typer(
    help="Create, upgrade, describe, verify, merge and copy databases.", no_args_is_help=True
)


def upgrade(db: Db = None, json: Json = False) -> None:
    """Create the database or bring it to the newest schema, wholly or not at all.

    Examples:
        adeye db upgrade
        adeye db upgrade --db my.db
    """
    from adeye.store import schema
    from adeye.store.location import locate

    before = schema.current(db)
    after = schema.upgrade(db)
    if json:
        out.emit_json("db-upgrade", {"path": str(locate(db)), "before": before, "after": after})
    elif before == after:
        out.emit_line(f"{locate(db)}: schema {after} already")
    else:
        out.emit_line(f"{locate(db)}: schema {before or 'none'} → {after}")


_CAMPAIGN: Final = ("number", "id", "odd", "planned", "state", "created_at")


def info(db: Db = None, json: Json = False) -> None:
    """Say what the database holds: schema, size, rows by table, campaigns.

    Rows are those that were written; 'adeye db verify' finds whether they are still there.

    Examples:
        adeye db info
        adeye db info --json
    """
    from adeye.store.read.reader import Reader

    with Reader.open(db) as reader:
        found = reader.info()
        campaigns = reader.campaigns()
        roots = {item.id: reader.evidence.root(item.id) for item in campaigns}
        sessions = {item.id: reader.evidence.sessions(item.id) for item in campaigns}
        withdrawn = reader.evidence.withdrawals()
    if json:
        out.emit_json(
            "db-info",
            {
                "path": found.path,
                "database_schema": found.schema,
                "size_bytes": found.size_bytes,
                "rows": found.rows,
                "campaigns": [
                    {
                        **out.fields_of(item, *_CAMPAIGN),
                        "root": root_of(roots[item.id]),
                        "provenance": item.provenance,
                        "sessions": sessions[item.id],
                    }
                    for item in campaigns
                ],
                "withdrawn": withdrawn,
            },
        )
        return
    out.emit_fields(
        {"Database": found.path, "Schema": found.schema, "Size": f"{found.size_bytes / 1e6:.1f} MB"}
    )
    out.emit_table(("Table", "Rows"), list(found.rows.items()), right=("Rows",))
    rows = [
        [
            *(out.fields_of(item, *_CAMPAIGN) | {"id": item.id[:10]}).values(),
            (root_of(roots[item.id]) or "-")[:16],
        ]
        for item in campaigns
    ]
    headers = ("Number", "Campaign", "ODD", "Test cases", "State", "First planned", "Root")
    out.emit_table(headers, rows, right=("Number", "Test cases"))
    if withdrawn:
        taken = [[item.result_digest[:12], item.at, item.author, item.reason] for item in withdrawn]
        out.emit_table(("Withdrawn", "At", "By", "Reason"), taken)


def root_of(root: Root | None) -> str | None:
    """Give the root in hex, if there is one."""
    return None if root is None else root.root


def verify(db: Db = None, json: Json = False) -> None:
    """Check that every stored row and every kept trace is as it was written, and name all others.

    Also what is gone is named, what was never written by adeye, and a campaign whose Merkle root is
    not the one that it had when it was complete.

    Exit codes: 0 intact, 3 there is no campaign, 4 something was altered, is missing or does not
    belong.

    Examples:
        adeye db verify
    """
    from adeye.campaign.traces import altered_files, left_files
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        findings = (*repository.verify(), *altered_files(repository))
        left = left_files(repository)
        rows = sum(repository.info().rows.values())
        is_empty = repository.latest_campaign() is None
    if json:
        out.emit_json("db-verify", {"rows": rows, "findings": findings})
    else:
        for finding in findings:
            out.emit_line(finding)
        if is_empty and not findings:
            out.emit("Nothing to verify: the database has no campaign.")
        elif not findings:
            intact = amount(rows, "row is as it was", "rows are as they were")
            out.emit(f"Intact: {intact} written.")
    if left:
        out.talk(
            out.clean(
                f"{len(left)} files of traces belong to no run of this database, as an interrupted "
                "block leaves them, or belong to one that was copied or renamed; nothing is wrong "
                f"with it: {left[0]}"
            )
        )
    if findings:
        out.talk(
            f"IntegrityError: {amount(len(findings), 'finding')} in {amount(rows, 'row')}. "
            "Restore it from a copy."
        )
        raise typer.Exit(ExitCode.INTEGRITY)
    if is_empty:
        raise typer.Exit(ExitCode.INCOMPLETE)


def prove(
    run: RunId,
    campaign: Annotated[str | None, option("CAMPAIGN")] = None,
    db: Db = None,
    json: Json = False,
) -> None:
    """Prove that a run is evidence of a campaign, by its leaf and path in the Merkle tree.

    Whoever knows the campaign's root can check it without the database (RFC 6962, section 2.1).

    Exit codes: 0 proven, 2 no such run or campaign, 4 run or campaign are not as they were written.

    Parameters:
        campaign: Number or digest; default: latest.

    Examples:
        adeye db prove 3f9c2a
        adeye db prove 3f9c2a --json
    """
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        chosen = repository.find_campaign(campaign)
        repository.require_sound(chosen.id)
        # As everywhere, digits are the beginning of a digest, and no ordinal.
        named = repository.find_run(run).result_digest if run.isdigit() else run
        proof = repository.evidence.prove(named, chosen.id)
    out.emit_found("db-prove", proof, _print_proof, json=json)


def _print_proof(proof: RunProof) -> None:
    out.emit_fields(
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
    author: Annotated[str, option("NAME")],
    reason: Annotated[str, option("TEXT")],
    db: Db = None,
    json: Json = False,
) -> None:
    """Let a result count as evidence no more; it stays as it is, with author and reason beside it.

    Its verdicts count as NOT_RUN in every campaign, so that no gate is green with it. Another
    version of an engine executes its test case anew, which gives another result.

    Parameters:
        author: Who says so.
        reason: Why.

    Examples:
        adeye db withdraw 3f9c2a --author 'J. Doe' --reason 'wrong map version'
    """
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        found = repository.find_run(run)
        is_new = repository.evidence.withdraw(found.result_digest, author=author, reason=reason)
    if json:
        out.emit_json("db-withdraw", {"run": found.result_digest, "is_new": is_new})
    elif is_new:
        out.emit_line(f"{found.result_digest[:12]}: withdrawn by {author}: {reason}")
    else:
        out.emit(f"{found.result_digest[:12]}: withdrawn already")


def merge(
    into: Annotated[str, typer.Argument(metavar="INTO")],
    sources: Annotated[list[str], typer.Argument(metavar="FROM...")],
    json: Json = False,
) -> None:
    """Bring the results of other databases into one, such as those of the shards of a campaign.

    Each source is verified, and goes in as a whole or not at all; merging it again adds nothing.
    Kept traces stay beside their database.

    Exit codes: 0 merged, 2 no such database, 4 a source was altered or contradicts what is there,
    5 database or disk.

    Parameters:
        into: Database that grows.
        sources: Databases that are only read.

    Examples:
        adeye db merge all.db shard1.db shard2.db shard3.db
        adeye db merge all.db shard1.db --json
    """
    from adeye.store.evidence.roots import folder_of
    from adeye.store.location import locate
    from adeye.store.repository import Repository
    from adeye.store.write.merge import origin_of, require_source

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
            out.emit_line(
                f"{found.source}: campaigns {len(found.campaigns):,}, new runs "
                f"{found.runs:,}, blocks done by it {found.blocks:,}"
            )
        if found.traces:
            out.talk(
                out.clean(
                    f"note: {found.source}: the kept traces of {found.traces:,} runs stay in "
                    f"{folder_of(origin.place.beside)}; 'adeye db copy' would take them along"
                )
            )
    if json:
        out.emit_json("db-merge", {"into": str(place), "sources": merged})


def copy(
    campaigns: Annotated[list[str], option("--campaign CAMPAIGN", env="CAMPAIGNS")],
    to: Annotated[str, option("NEW", env="DB_TO")],
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

    Parameters:
        campaigns: Number or digest of one to copy; may be given several times.
        to: Database that is made for them.

    Examples:
        adeye db copy --campaign 3 --to keep.db
        adeye db copy --campaign 3f9c2a --campaign 7 --to release.db --db team.db
    """
    from adeye.campaign.traces import copy_campaigns
    from adeye.store.location import locate
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        found = copy_campaigns(repository, campaigns, to)
    place = str(locate(to))
    if json:
        out.emit_json("db-copy", {"to": place, **out.plain(found)})
    else:
        out.emit_line(f"{place}: campaigns {len(found.campaigns):,}, runs {found.runs:,}")


def grant(
    role: Annotated[str | None, typer.Argument(metavar="[ROLE]")] = None,
    *,
    db: Db = None,
) -> None:
    """Let a user of a PostgreSQL server read the database and do nothing else.

    Makes the role adeye_reader, as which 'adeye query' runs what people type; without it, 'adeye
    query' refuses users who may do more on the server. Takes the right to make temporary tables
    from everybody. To be run by the owner of the database.

    Parameters:
        role: User of the server who shall be able to read.

    Examples:
        adeye db grant alice --db postgresql://admin@db.example/adeye
    """
    from adeye.store.location import locate
    from adeye.store.read.query import READER
    from adeye.store.read.query import grant as grant_reading

    location = locate(db)
    if not location.is_server:
        raise UsageError(
            "rights are those of a server, and this database is a file",
            remedy="Give readers the right to read the file, or --db postgresql://….",
        )
    for note in grant_reading(location, role):
        out.talk(f"note: {out.clean(note)}")
    out.emit(f"{READER} may read" + (f", and {out.clean(role)} is a member of it" if role else ""))


for verb in (upgrade, info, verify, prove, withdraw, metadata, grant, merge, copy):
    add(database_app, verb)


# --- ``manifest write|verify|keygen``: what a report rests on, with hashes and a signature --------

SIGNATURE = ".sig"

manifest_app = typer.Typer(
    help="Sign the evidence of a campaign, and check what was signed.", no_args_is_help=True
)


def write(
    campaign: CampaignId = None,
    output: Annotated[
        Path, option("--output -o FILE", env="MANIFEST_OUTPUT", callback=named_anew)
    ] = Path("manifest.json"),
    file: Annotated[list[Path] | None, option("FILE", env="MANIFEST_FILE")] = None,
    sign: Annotated[Path | None, option("KEYFILE", env="SIGNING_KEY")] = None,
    db: Db = None,
    json: Json = False,
) -> None:
    """Write the manifest of a complete campaign: its Merkle root, and hashes of rows and files.

    Parameters:
        output: The manifest.
        file: Report or other file to name; may be repeated.
        sign: Private Ed25519 key in PEM; signs into FILE.sig.

    Examples:
        adeye manifest write --file report.html
        adeye manifest write -o out/manifest.json --file out/report.html --sign signing.pem
    """
    from adeye.report.formats.manifest import fingerprint, make_manifest
    from adeye.report.formats.manifest import sign as signed
    from adeye.store.repository import Repository

    if sign is not None and is_stream(output):
        raise UsageError(
            f"--sign puts the signature beside the manifest, and {str(output)!r} is no file",
            remedy="Name a file with --output.",
        )
    signature_path = output.with_name(output.name + SIGNATURE)
    name = f"{SIGNATURE} of --output"
    with guarded({name: None if sign is None else signature_path}, renewed=name):
        with Repository.open(db, create=False) as repository:
            chosen = repository.find_campaign(campaign)
            content = make_manifest(repository, chosen, file or (), output.parent)
            doubt = repository.uncertified(chosen.id)
        # Signed first: a key that cannot be used leaves nothing behind.
        signature = None if sign is None else signed(content, sign)
        write_atomically(content, output)
        if signature is not None:
            write_atomically(signature, signature_path)
    if doubt:
        out.talk(f"note: the manifest says that {doubt}")
    if json:
        told = None if signature is None else str(signature_path)
        shown = {"campaign": chosen.id, "manifest": str(output), "signature": told}
        out.emit_json("manifest-write", {**shown, "sha256": fingerprint(content)})
        return
    out.emit_line(f"{output}: sha256 {fingerprint(content)}")
    if signature is not None:
        out.emit_line(f"{signature_path}: signed")


def verify_manifest(
    manifest: Annotated[Path, typer.Argument(metavar="MANIFEST")],
    key: Annotated[Path | None, option("KEYFILE", env="PUBLIC_KEY")] = None,
    unsigned: bool = False,
    files_only: bool = False,
    db: Db = None,
    json: Json = False,
) -> None:
    """Check that manifest, files, rows and traces are those that were signed.

    Exit codes: 0 they are, 4 something differs or the signature is not that of the key.

    Parameters:
        manifest: File of the manifest.
        key: Public Ed25519 key of the signer, in PEM.
        unsigned: Check the hashes without a signature.
        files_only: Look at the named files alone, not at root, rows and traces in a database.

    Examples:
        adeye manifest verify manifest.json --key signing.pub.pem
        adeye manifest verify manifest.json --unsigned --files-only
    """
    from contextlib import ExitStack

    from adeye.report.formats.manifest import differing, fingerprint, read_manifest, require_signed
    from adeye.store.repository import Repository

    if (key is None) != unsigned:
        raise UsageError(
            "manifest verify: needs either --key or --unsigned",
            remedy="Name the public key of the signer.",
        )
    content, document = read_manifest(manifest)
    signature = manifest.with_name(manifest.name + SIGNATURE)
    signer = None if key is None else require_signed(content, signature, key)
    with ExitStack() as opened:
        repository = None
        if not files_only:
            repository = opened.enter_context(Repository.open(db, create=False))
        found = tuple(differing(document, manifest.parent, repository))
    if json:
        told = {"campaign": document["campaign"], "root": document["root"], "signer": signer}
        checked = ("files",) if files_only else ("files", "root", "rows", "traces")
        told |= {"sha256": fingerprint(content), "checked": checked, "findings": found}
        out.emit_json("manifest-verify", told)
    else:
        for line in found:
            out.emit_line(line)
        if not found:
            by = "unsigned" if signer is None else f"signed with key {signer[:16]}"
            count = len(document["files"])
            what = "everything is"
            if files_only:
                what = amount(count, "named file is", "named files are")
            unseen = "; root, rows and traces were not looked at" if files_only else ""
            out.emit_line(f"{manifest}: {what} as it says, {by}{unseen}.")
    if found:
        out.talk(
            f"IntegrityError: {amount(len(found), 'finding')}. Ask its author for the original."
        )
        raise typer.Exit(ExitCode.INTEGRITY)


def keygen(
    private: Annotated[Path, option("FILE", env="KEYGEN_PRIVATE", callback=named)] = Path(
        "adeye-signing.pem"
    ),
    public: Annotated[Path, option("FILE", env="KEYGEN_PUBLIC", callback=named)] = Path(
        "adeye-signing.pub.pem"
    ),
) -> None:
    """Make a pair of Ed25519 keys in PEM; keep the private one away from the repository.

    Parameters:
        private: Private key.
        public: Public key.

    Examples:
        adeye manifest keygen --private signing.pem --public signing.pub.pem
    """
    from adeye.report.formats.manifest import write_keys

    out.emit_line(f"key {write_keys(private, public)[:16]}: {private} (secret), {public}")


add(manifest_app, write)
add(manifest_app, verify_manifest, name="verify")
add(manifest_app, keygen)
