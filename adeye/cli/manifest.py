"""``manifest write|verify|keygen``: what a report rests on, with hashes and a signature."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from adeye.cli.options import CampaignId, Db, Json, add
from adeye.cli.output import clean, emit, emit_json, talk
from adeye.cli.writing import named, named_anew

_INTEGRITY = 4
SIGNATURE = ".sig"

manifest_app = typer.Typer(
    help="Sign the evidence of a campaign, and check what was signed.", no_args_is_help=True
)

_Files = Annotated[
    list[Path] | None,
    typer.Option(
        "--file",
        metavar="FILE",
        envvar="ADEYE_MANIFEST_FILE",
        help="Report or other file to name; may be repeated.",
    ),
]
_Manifest = Annotated[Path, typer.Argument(metavar="MANIFEST", help="File of the manifest.")]


def write(
    campaign: CampaignId = None,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            envvar="ADEYE_MANIFEST_OUTPUT",
            callback=named_anew,
            help="The manifest.",
        ),
    ] = Path("manifest.json"),
    file: _Files = None,
    sign: Annotated[
        Path | None,
        typer.Option(
            "--sign",
            metavar="KEYFILE",
            envvar="ADEYE_SIGNING_KEY",
            help="Private Ed25519 key in PEM; signs into FILE.sig.",
        ),
    ] = None,
    db: Db = None,
    json: Json = False,
) -> None:
    """Write the manifest of a complete campaign: its Merkle root, and hashes of rows and files."""
    from adeye.outputs import guarded, write_atomically
    from adeye.report.manifest import fingerprint, make_manifest
    from adeye.report.signing import sign as signed
    from adeye.store.repository import Repository

    signature_path = output.with_name(output.name + SIGNATURE)
    name = f"{SIGNATURE} of --output"
    with guarded({name: None if sign is None else signature_path}, renewed=name):
        with Repository.open(db, create=False) as repository:
            chosen = repository.find_campaign(campaign)
            content = make_manifest(repository, chosen, file or (), output.parent)
        # Signed first: a key that cannot be used leaves nothing behind.
        signature = None if sign is None else signed(content, sign)
        write_atomically(content, output)
        if signature is not None:
            write_atomically(signature, signature_path)
    if json:
        told = None if signature is None else str(signature_path)
        shown = {"campaign": chosen.id, "manifest": str(output), "signature": told}
        emit_json("manifest-write", {**shown, "sha256": fingerprint(content)})
        return
    emit(clean(f"{output}: sha256 {fingerprint(content)}"))
    if signature is not None:
        emit(clean(f"{signature_path}: signed"))


def verify(
    manifest: _Manifest,
    key: Annotated[
        Path | None,
        typer.Option(
            "--key",
            metavar="KEYFILE",
            envvar="ADEYE_PUBLIC_KEY",
            help="Public Ed25519 key of the signer, in PEM.",
        ),
    ] = None,
    unsigned: Annotated[
        bool,
        typer.Option(
            "--unsigned", envvar="ADEYE_UNSIGNED", help="Check the hashes without a signature."
        ),
    ] = False,
    files_only: Annotated[
        bool,
        typer.Option(
            "--files-only",
            envvar="ADEYE_FILES_ONLY",
            help="Look at the named files, not at a database.",
        ),
    ] = False,
    db: Db = None,
    json: Json = False,
) -> None:
    """Check that manifest, files, rows and traces are those that were signed.

    Exit codes: 0 they are, 4 something differs or the signature is not that of the key.
    """
    from contextlib import ExitStack

    from adeye.errors import UsageError
    from adeye.report.manifest import differing, fingerprint, read_manifest
    from adeye.report.signing import require_signed
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
        emit_json("manifest-verify", {**told, "sha256": fingerprint(content), "findings": found})
    else:
        for line in found:
            emit(clean(line))
        if not found:
            by = "unsigned" if signer is None else f"signed with key {signer[:16]}"
            emit(clean(f"{manifest}: everything is as it says, {by}."))
    if found:
        talk(f"IntegrityError: {len(found)} findings. Ask its author for the original.")
        raise typer.Exit(_INTEGRITY)


def keygen(
    private: Annotated[
        Path,
        typer.Option(
            "--private",
            metavar="FILE",
            envvar="ADEYE_KEYGEN_PRIVATE",
            callback=named,
            help="Private key.",
        ),
    ] = Path("adeye-signing.pem"),
    public: Annotated[
        Path,
        typer.Option(
            "--public",
            metavar="FILE",
            envvar="ADEYE_KEYGEN_PUBLIC",
            callback=named,
            help="Public key.",
        ),
    ] = Path("adeye-signing.pub.pem"),
) -> None:
    """Make a pair of Ed25519 keys in PEM; keep the private one away from the repository."""
    from adeye.report.signing import write_keys

    emit(clean(f"key {write_keys(private, public)[:16]}: {private} (secret), {public}"))


add(
    manifest_app,
    write,
    "adeye manifest write --file report.html",
    "adeye manifest write -o out/manifest.json --file out/report.html --sign signing.pem",
)
add(
    manifest_app,
    verify,
    "adeye manifest verify manifest.json --key signing.pub.pem",
    "adeye manifest verify manifest.json --unsigned --files-only",
)
add(manifest_app, keygen, "adeye manifest keygen --private signing.pem --public signing.pub.pem")
