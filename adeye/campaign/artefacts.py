"""The files beside a database: kept traces that are altered, gone, or of no run; and their copy."""

from __future__ import annotations

import hashlib
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING

from adeye.campaign.keeping import read_kept
from adeye.errors import IntegrityError
from adeye.outputs import BESIDE_DATABASE
from adeye.store.kept_files import (
    SUFFIX,
    content_name,
    copy_kept,
    find_kept,
    folder_of,
    folders_of,
    kept_path,
)
from adeye.store.location import locate
from adeye.store.repository import Repository
from adeye.store.stored import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from adeye.store.location import Place
    from adeye.store.merging import Copied

_PLACE = "trace"


def altered_files(repository: Repository) -> Iterator[Finding]:
    """Name kept traces that are gone, altered, or not what adeye writes there.

    A file is named after its content. One of no run that has its name is left over from a block
    that was interrupted, see ``left_files``.
    """
    folders = folders_of(repository.location.beside)
    known = repository.evidence.kept_files()
    present = _present(folders[0])
    missing = f"is missing (bring it to {folders[0]} from where the database was, or from a copy)"
    for name, runs in known.items():
        path = present.pop(f"{name}{SUFFIX}", None) or find_kept(folders[1:], name)
        problem = missing if path is None else _problem(path, name)
        if path is not None and problem and _is_named_after_traces(path, runs):
            problem = ""
        if problem:
            more = f" and {len(runs) - 1} more" if len(runs) > 1 else ""
            of_runs = f"which has the traces of run {runs[0][0][:12]}{more}"
            yield Finding(_PLACE, f"{name}{SUFFIX}", f"{problem}, {of_runs}")
    for own_name, path in sorted(present.items()):
        if not _is_left(path):
            yield Finding(_PLACE, own_name, "was not written by adeye, or is altered")


def copy_campaigns(source: Repository, names: Sequence[str], to: Place) -> Copied:
    """Copy campaigns with all that they refer to, kept traces too, into a database of their own.

    The other database is only read. What was begun is removed where anything fails.

    Args:
        source: The database that has them.
        names: Their ids, the beginnings of them, or their numbers.
        to: A new database, or an empty one of a server.

    Raises:
        InputError: There is no such campaign, or the new database has campaigns already.
        IntegrityError: What is to be copied is not as it was written.
        PlatformError: A database or the disk refuses.
    """
    chosen = tuple(dict.fromkeys(source.find_campaign(name).id for name in names))
    place = locate(to)
    folders, folder = folders_of(source.location.beside), folder_of(place.beside)
    names_of = [source.evidence.kept_files(item) for item in chosen]
    kept = dict.fromkeys(name for item in names_of for name in item)
    for wrong in altered_files(source):
        if wrong.row.removesuffix(SUFFIX) in kept:
            raise IntegrityError(f"{wrong}. Nothing was copied; see 'adeye db verify'.")
    with ExitStack() as undoing:
        undoing.callback(_remove_empty, folder)
        if place.path is not None and not place.path.exists():
            real = place.path.resolve()
            for end in ("", *BESIDE_DATABASE):
                undoing.callback(real.with_name(real.name + end).unlink, missing_ok=True)
        with Repository.open(place) as into:
            # Before the rows that name them are there; without those, files are only left over.
            for name in kept:
                if (file := copy_kept(name, folders, folder)) is not None:
                    undoing.callback(file.unlink, missing_ok=True)
            copied = into.copy(source.location, chosen)
        undoing.pop_all()
    return copied


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def left_files(repository: Repository) -> tuple[str, ...]:
    """Name whole files of traces that no run of the database refers to.

    A run of another one may, which was copied from it or had its name before.
    """
    folder = folder_of(repository.location.beside)
    known = repository.evidence.kept_files()
    return tuple(
        sorted(
            name
            for name, path in _present(folder).items()
            if path.stem not in known and _is_left(path)
        )
    )


def _present(folder: Path) -> dict[str, Path]:
    return {path.name: path for path in folder.iterdir()} if folder.is_dir() else {}


def _problem(path: Path, name: str) -> str:
    try:
        return "" if kept_path(path.parent, name) and content_name(path) == name else "is altered"
    except OSError as error:
        return f"cannot be read ({error.strerror})"


def _is_named_after_traces(path: Path, runs: Sequence[tuple[str, str]]) -> bool:
    """Tell whether a file has the name that the first releases gave, and can be read.

    Its traces are compared with their digests when they are judged.
    """
    traces = " ".join(trace for _, trace in runs)
    is_named_so = hashlib.sha256(traces.encode()).hexdigest() == path.stem
    return is_named_so and read_kept(path.parent, path.stem) is not None


def _is_left(path: Path) -> bool:
    """Tell whether a file is what an interrupted block leaves: whole, or not finished."""
    if path.suffix == ".tmp":
        return path.is_file() and not path.is_symlink()
    return path.suffix == SUFFIX and not _problem(path, path.stem)
