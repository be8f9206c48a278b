"""The manifest of a campaign's evidence: hashes of its report, rows and traces, to be signed.

Whoever has the manifest and the key of its signer can tell whether report, database and traces are
those that were signed.

Source:
    Dead Simple Signing Envelope 1.0.2, protocol: what is signed is the type and the content with
    their lengths before them ("pre-authentication encoding"). RFC 8032 for Ed25519.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

from adeye.errors import InputError, IntegrityError, PlatformError, UsageError, needing
from adeye.identity import digest_bytes, file_digest, unique_keys
from adeye.outputs import require_plain
from adeye.store.evidence.roots import SUFFIX, find_kept, folders_of
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository
from adeye.units import shown
from adeye.version import __version__

# --- The manifest of a campaign's evidence: hashes of its report, rows and traces, to be signed ---

SCHEMA: Final = "adeye/manifest@1"
MAX_BYTES: Final = 64_000_000
"""Largest manifest that is read: each kept file of traces takes a line."""
_KEYS: Final = {
    "schema": str,
    "campaign": str,
    "odd": str,
    "root": str,
    "leaves": int,
    "tool": str,
    "tables": dict,
    "withdrawn": list,
    "not_certified": list,
    "files": list,
    "traces": list,
}


def make_manifest(
    repository: Repository, campaign: CampaignInfo, files: Sequence[Path], folder: Path
) -> bytes:
    """Write the manifest of a complete campaign as JSON; equal evidence gives equal bytes.

    Args:
        repository: The database.
        campaign: The campaign.
        files: Reports and other files to be named by their hash.
        folder: Where the manifest will be; the files have to be in or below it.

    Raises:
        InputError: The campaign is not complete, or a file is elsewhere or cannot be read.
        IntegrityError: The rows are not as they were written, or have not the root that they had.
    """
    if campaign.state != "complete":
        raise InputError(
            f"campaign {campaign.id[:10]} is {campaign.state}, so there is no evidence to sign",
            remedy="Run it to its end first.",
        )
    repository.require_sound(campaign.id)
    evidence = repository.evidence
    evidence.record_root(campaign.id)
    root = evidence.computed_root(campaign.id)
    evidence.require_root(root)
    traces = folders_of(repository.location.beside)
    document = {
        "schema": SCHEMA,
        "campaign": campaign.id,
        "odd": campaign.odd,
        "root": root.root,
        "leaves": root.leaves,
        "tool": f"adeye {__version__}",
        "tables": _tables(repository, campaign.id),
        "withdrawn": [item.result_digest for item in evidence.withdrawals(campaign.id)],
        "not_certified": list(repository.contested(campaign.id)),
        "files": [_file(path, folder) for path in files],
        "traces": [
            {"name": f"{name}{SUFFIX}", "sha256": _sha256_of_traces(traces, name)}
            for name in evidence.kept_files(campaign.id)
        ],
    }
    text = json.dumps(document, ensure_ascii=False, indent=2, sort_keys=True, allow_nan=False)
    return f"{text}\n".encode()


def _tables(repository: Repository, campaign: str) -> dict[str, dict[str, Any]]:
    sums = repository.evidence.sums(campaign)
    return {name: {"rows": rows, "sum": total} for name, (rows, total) in sums.items()}


def _file(path: Path, folder: Path) -> dict[str, Any]:
    found, root = _sha256(path), folder.resolve()
    # A link is named as such: whoever verifies looks at what it leads to then.
    named = path.parent.resolve() / path.name
    if not (named.is_relative_to(root) and path.resolve().is_relative_to(root)):
        raise InputError(
            f"{path} is not in or below {folder}, where the manifest is written",
            remedy="Write the manifest beside the files that it names.",
        )
    name = named.relative_to(root).as_posix()
    return {"name": name, "sha256": found, "bytes": path.stat().st_size}


def _sha256(path: Path) -> str:
    try:
        require_plain(path)
        return file_digest(path)
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}", remedy="Restore it from a copy."
        ) from error


def _sha256_of_traces(folders: Sequence[Path], name: str) -> str:
    path = find_kept(folders, name)
    if path is None:
        raise InputError(
            f"{shown(name)} in {folders[0]} is no file of traces", remedy="Restore it from a copy."
        )
    return _sha256(path)


def read_manifest(path: Path) -> tuple[bytes, dict[str, Any]]:
    """Read a manifest.

    Returns:
        Its bytes, which are signed, and what they say.

    Raises:
        InputError: It cannot be read or is no manifest.
    """
    try:
        require_plain(path, MAX_BYTES)
        content = path.read_bytes()
        document = json.loads(content, object_pairs_hook=unique_keys)
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}", remedy="Name the manifest."
        ) from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not JSON ({error})", remedy="Name a manifest.") from error
    is_one = isinstance(document, dict) and document.get("schema") == SCHEMA
    kinds = {name: type(value) for name, value in document.items()} if is_one else {}
    # What is beside its own keys nobody compares with anything.
    if kinds != _KEYS:
        raise InputError(
            f"{path}: is not a manifest of schema {SCHEMA}",
            remedy="Write one with 'adeye manifest write'.",
        )
    return content, document


def differing(
    document: Mapping[str, Any], folder: Path, repository: Repository | None
) -> Iterator[str]:
    """Return what is not as a manifest says, or not as it was written.

    Args:
        document: The manifest.
        folder: Where it is.
        repository: The database; None to look at the files alone.

    Raises:
        UsageError: There is nothing to look at.
    """
    if repository is None and not document["files"]:
        raise UsageError(
            "the manifest names no files, so nothing would be compared",
            remedy="Leave out --files-only, and name the database.",
        )
    for item in document["files"]:
        problem = _differs(item, folder)
        if problem:
            yield f"file {_word(item, 'name')}: {problem}"
    if repository is not None:
        yield from _rows_differing(document, repository)


def _word(item: Any, key: str) -> str:
    return str(item.get(key)) if isinstance(item, dict) else str(item)


def _differs(item: Any, folder: Path) -> str:
    name = Path(_word(item, "name"))
    if name.is_absolute() or ".." in name.parts or "\0" in str(name):
        return "is not below the manifest, so it is not read"
    path = folder / name
    try:
        if not path.resolve().is_relative_to(folder.resolve()) or not path.is_file():
            return "is missing"
        return "" if file_digest(path) == _word(item, "sha256") else "is altered"
    except OSError as error:
        return f"cannot be read ({error.strerror})"


def _rows_differing(document: Mapping[str, Any], repository: Repository) -> Iterator[str]:
    campaign, evidence = document["campaign"], repository.evidence
    found = next((item for item in repository.campaigns() if item.id == campaign), None)
    if found is None:
        yield f"campaign {campaign}: is not in the database"
        return
    if found.odd != document["odd"]:
        yield f"campaign {campaign}: is of the ODD {found.odd}, not of {document['odd']}"
    # The hashes below are those of the rows, which have to be those of their values.
    yield from map(str, repository.verify())
    root = evidence.computed_root(campaign)
    if (root.root, root.leaves) != (document["root"], document["leaves"]):
        yield f"campaign {campaign}: the evidence has root {root.root} over {root.leaves} cases"
    tables = _tables(repository, campaign)
    for name in sorted({*tables, *document["tables"]}):
        if tables.get(name) != document["tables"].get(name):
            yield f"table {name}: its rows of the campaign are not those that were signed"
    yield from _doubts_differing(document, repository)
    folders = folders_of(repository.location.beside)
    kept = {f"{name}{SUFFIX}" for name in evidence.kept_files(campaign)}
    for item in document["traces"]:
        name = _word(item, "name")
        kept.discard(name)
        path = find_kept(folders, name.removesuffix(SUFFIX))
        problem = _differs(item, folders[0] if path is None else path.parent)
        if problem:
            yield f"trace {name}: {problem}"
    for name in sorted(kept):
        yield f"trace {name}: is not in the manifest"


def _doubts_differing(document: Mapping[str, Any], repository: Repository) -> Iterator[str]:
    """Return which results are withdrawn, or came out otherwise, as the manifest does not say."""
    campaign = document["campaign"]
    now = {item.result_digest for item in repository.evidence.withdrawals(campaign)}
    for digest in sorted(now ^ {str(item) for item in document["withdrawn"]}):
        since = "was withdrawn since" if digest in now else "is not withdrawn any more"
        yield f"run {digest}: {since}"
    told = set(repository.contested(campaign))
    for digest in sorted(told ^ {str(item) for item in document["not_certified"]}):
        here = "came out otherwise for a certificate since"
        gone = "came out otherwise for a certificate that is not in the database"
        yield f"run {digest}: {here if digest in told else gone}"


def fingerprint(content: bytes) -> str:
    """Return the fingerprint of a manifest: sha256 in hex."""
    return digest_bytes(content)


# --- Detached signatures: Ed25519 over an envelope in the manner of DSSE --------------------------

PAYLOAD_TYPE: Final = "application/vnd.adeye.manifest+json"
_MAX_BYTES: Final = 100_000
_KEYS_HELP: Final = (
    "Make a pair with 'adeye manifest keygen' or 'openssl genpkey -algorithm ed25519'."
)


def encoded(content: bytes) -> bytes:
    """Return what is signed of a content.

    >>> encoded(b"{}")
    b'DSSEv1 35 application/vnd.adeye.manifest+json 2 {}'
    """
    kind = PAYLOAD_TYPE.encode()
    return b" ".join([b"DSSEv1", b"%d" % len(kind), kind, b"%d" % len(content), content])


def sign(content: bytes, key: Path) -> bytes:
    """Sign a content.

    Args:
        content: What is signed; it is not in the signature.
        key: PEM file of a private Ed25519 key without a password.

    Returns:
        The signature as JSON.

    Raises:
        InputError: The file is not such a key.
        MissingExtra: The extra is not installed.
    """
    _, files, ed25519 = _library()
    private = _loaded(key, lambda text: files.load_pem_private_key(text, password=None))
    if not isinstance(private, ed25519.Ed25519PrivateKey):
        raise InputError(f"{key}: is no private Ed25519 key", remedy=_KEYS_HELP)
    envelope = {
        "payloadType": PAYLOAD_TYPE,
        "payloadSha256": hashlib.sha256(content).hexdigest(),
        "signatures": [
            {
                "keyid": _key_id(private.public_key()),
                "sig": base64.b64encode(private.sign(encoded(content))).decode(),
            }
        ],
    }
    return f"{json.dumps(envelope, indent=2, sort_keys=True)}\n".encode()


def require_signed(content: bytes, signature: Path, key: Path) -> str:
    """Check a signature.

    Args:
        content: What should have been signed.
        signature: File of the signature.
        key: PEM file of the public Ed25519 key.

    Returns:
        Id of the key: sha256 of its 32 bytes in hex.

    Raises:
        InputError: A file is missing or is not what it should be.
        IntegrityError: The content is not what was signed, or another key signed it.
        MissingExtra: The extra is not installed.
    """
    (wrong, _), files, ed25519 = _library()
    public = _loaded(key, files.load_pem_public_key)
    if not isinstance(public, ed25519.Ed25519PublicKey):
        raise InputError(f"{key}: is no public Ed25519 key", remedy=_KEYS_HELP)
    key_id = _key_id(public)
    for signed in _signatures(signature):
        try:
            public.verify(signed, encoded(content))
        except wrong:
            continue
        return key_id
    raise IntegrityError(
        f"{signature}: the manifest is not what was signed with key {key_id[:16]}, or another "
        "key signed it. Do not rely on it; ask its author for the original."
    )


def _signatures(path: Path) -> list[bytes]:
    try:
        document = json.loads(_read(path))
        if document["payloadType"] != PAYLOAD_TYPE:
            raise InputError(
                f"{path}: signs {document['payloadType']!r}, not {PAYLOAD_TYPE}",
                remedy="Name the signature of a manifest.",
            )
        return [base64.b64decode(item["sig"], validate=True) for item in document["signatures"]]
    except (ValueError, KeyError, TypeError, binascii.Error, RecursionError) as error:
        raise InputError(
            f"{path}: is no signature of a manifest", remedy="Name the .sig file beside it."
        ) from error


def write_keys(private: Path, public: Path) -> str:
    """Make a pair of keys; the private one is readable by its owner only.

    Returns:
        Id of the key.

    Raises:
        InputError: A file is there already.
        PlatformError: They cannot be written.
        MissingExtra: The extra is not installed.
    """
    _, files, ed25519 = _library()
    made = ed25519.Ed25519PrivateKey.generate()
    secret = made.private_bytes(files.Encoding.PEM, files.PrivateFormat.PKCS8, files.NoEncryption())
    open_part = made.public_key().public_bytes(
        files.Encoding.PEM, files.PublicFormat.SubjectPublicKeyInfo
    )
    with ExitStack() as undo:
        for path, content, mode in ((private, secret, 0o600), (public, open_part, 0o644)):
            try:
                descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
                undo.callback(path.unlink)
                with os.fdopen(descriptor, "wb") as stream:
                    stream.write(content)
            except FileExistsError as error:
                raise InputError(
                    f"{path} is there already",
                    remedy="Name another file; keys are not overwritten.",
                ) from error
            except OSError as error:
                raise PlatformError(
                    f"{path} cannot be written: {error.strerror}. Choose another place."
                ) from error
        undo.pop_all()
    return _key_id(made.public_key())


def _key_id(public: Any) -> str:
    return hashlib.sha256(public.public_bytes_raw()).hexdigest()


def _loaded(path: Path, load: Any) -> Any:
    try:
        return load(_read(path))
    except (ValueError, TypeError, _library()[0][1]) as error:
        # The message of the library may quote the key.
        raise InputError(
            f"{path}: is no key in PEM, or has a password", remedy=_KEYS_HELP
        ) from error


def _read(path: Path) -> bytes:
    try:
        require_plain(path, _MAX_BYTES)
        return path.read_bytes()
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}", remedy="Name another file."
        ) from error


def _library() -> tuple[Any, Any, Any]:
    """Return what is used of ``cryptography``: its exceptions, keys in files, and Ed25519."""
    with needing("a signature", "sign"):
        from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
        from cryptography.hazmat.primitives import serialization
        from cryptography.hazmat.primitives.asymmetric import ed25519
    return (InvalidSignature, UnsupportedAlgorithm), serialization, ed25519
