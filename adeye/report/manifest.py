"""The manifest of a campaign's evidence: hashes of its report, rows and traces, to be signed.

Whoever has the manifest and the key of its signer can tell whether report, database and traces are
those that were signed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import InputError
from adeye.identity import digest_bytes
from adeye.outputs import reads
from adeye.store.kept_files import SUFFIX, content_name, find_kept, folders_of
from adeye.units import shown
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from adeye.store.repository import Repository
    from adeye.store.stored import CampaignInfo

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
        IntegrityError: The rows have not the root that they had when the campaign was complete.
    """
    if campaign.state != "complete":
        raise InputError(
            f"campaign {campaign.id[:10]} is {campaign.state}, so there is no evidence to sign",
            remedy="Run it to its end first.",
        )
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
    try:
        name = path.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError as error:
        raise InputError(
            f"{path} is not in or below {folder}, where the manifest is written",
            remedy="Write the manifest beside the files that it names.",
        ) from error
    return {"name": name, "sha256": _sha256(path), "bytes": path.stat().st_size}


def _sha256(path: Path) -> str:
    reads(path)
    try:
        return content_name(path)
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
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: more than {MAX_BYTES:,} bytes", remedy="Name a manifest.")
        content = path.read_bytes()
        document = json.loads(content)
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}", remedy="Name the manifest."
        ) from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not JSON ({error})", remedy="Name a manifest.") from error
    is_one = isinstance(document, dict) and document.get("schema") == SCHEMA
    if not is_one or any(type(document.get(name)) is not kind for name, kind in _KEYS.items()):
        raise InputError(
            f"{path}: is not a manifest of schema {SCHEMA}",
            remedy="Write one with 'adeye manifest write'.",
        )
    return content, document


def differing(
    document: Mapping[str, Any], folder: Path, repository: Repository | None
) -> Iterator[str]:
    """Say what is not as a manifest says, or not as it was written.

    Args:
        document: The manifest.
        folder: Where it is.
        repository: The database; None to look at the files alone.
    """
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
        return "" if content_name(path) == _word(item, "sha256") else "is altered"
    except OSError as error:
        return f"cannot be read ({error.strerror})"


def _rows_differing(document: Mapping[str, Any], repository: Repository) -> Iterator[str]:
    campaign, evidence = document["campaign"], repository.evidence
    if all(item.id != campaign for item in repository.campaigns()):
        yield f"campaign {campaign}: is not in the database"
        return
    # The hashes below are those of the rows, which have to be those of their values.
    yield from map(str, repository.verify())
    root = evidence.computed_root(campaign)
    if (root.root, root.leaves) != (document["root"], document["leaves"]):
        yield f"campaign {campaign}: the evidence has root {root.root} over {root.leaves} cases"
    tables = _tables(repository, campaign)
    for name in sorted({*tables, *document["tables"]}):
        if tables.get(name) != document["tables"].get(name):
            yield f"table {name}: its rows of the campaign are not those that were signed"
    now = {item.result_digest for item in evidence.withdrawals(campaign)}
    for digest in sorted(now ^ {str(item) for item in document["withdrawn"]}):
        since = "was withdrawn since" if digest in now else "is not withdrawn any more"
        yield f"run {digest}: {since}"
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


def fingerprint(content: bytes) -> str:
    """Give the fingerprint of a manifest: sha256 in hex."""
    return digest_bytes(content)
