"""Files of kept traces: where they are, and their names, which are hashes of their content."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

from adeye.errors import IntegrityError, PlatformError
from adeye.outputs import KEPT_FOLDER

if TYPE_CHECKING:
    from collections.abc import Sequence

SUFFIX: Final = ".npz"
_NAME: Final = re.compile("[0-9a-f]{64}")


def folder_of(database: Path) -> Path:
    """Name the folder that the traces of a database are written to.

    It has the whole name of the file, so that no two databases share one, and is beside the file
    itself where that is reached through a link.

    >>> from pathlib import Path
    >>> folder_of(Path(".adeye/adeye.db")).as_posix()
    '.adeye/adeye.db.traces'
    """
    real = database.resolve() if database.is_symlink() else database
    return real.with_name(f"{real.name}{KEPT_FOLDER}")


def folders_of(database: Path) -> tuple[Path, ...]:
    """List the folders that traces of a database may be in, its own first.

    A file is named after its content, so that it is the right one wherever it is found: in the
    folder without the ending of the database, as the first releases called it, and in those of
    other databases beside it, where it was renamed, copied or merged since.
    """
    own = folder_of(database)
    beside = (own.parent, database.parent)
    others = (path for folder in beside for path in sorted(folder.glob(f"*{KEPT_FOLDER}")))
    return tuple(dict.fromkeys((own, *others)))


def find_kept(folders: Sequence[Path], name: str) -> Path | None:
    """Find a kept file in the first folder that has it, see ``kept_path``."""
    found = (kept_path(folder, name) for folder in folders)
    return next((path for path in found if path is not None), None)


def kept_path(folder: Path, name: str) -> Path | None:
    """Find a kept file by the name that a database gives it.

    A name is a hash in hex and nothing else, so that no database leads to another place.

    Returns:
        None if the name is none, or no file of its own has it.
    """
    if _NAME.fullmatch(name) is None:
        return None
    path = folder / f"{name}{SUFFIX}"
    return path if path.is_file() and not path.is_symlink() else None


def copy_kept(name: str, folders: Sequence[Path], into: Path) -> Path | None:
    """Copy a kept file into the folder of another database, whole or not at all.

    Args:
        name: As a database gives it.
        folders: Where it may be.
        into: The other folder, which is made.

    Returns:
        The new file; None if it is there already.

    Raises:
        IntegrityError: It is nowhere, or the copy is not the same.
        PlatformError: It cannot be read or written.
    """
    found = find_kept(folders, name)
    if found is None:
        raise IntegrityError(f"the kept trace {name[:12]}{SUFFIX} is gone. Run 'adeye db verify'.")
    try:
        content = content_name(found)
        into.mkdir(parents=True, exist_ok=True)
        here = kept_path(into, name)
        if here is not None and content_name(here) == content:
            return None
        descriptor, temporary = tempfile.mkstemp(suffix=".tmp", dir=into)
        os.close(descriptor)
        try:
            shutil.copyfile(found, temporary)
            if content_name(Path(temporary)) != content:
                raise IntegrityError(f"the copy of {name[:12]}{SUFFIX} is not the same. Try again.")
            return Path(temporary).replace(into / f"{name}{SUFFIX}")
        finally:
            Path(temporary).unlink(missing_ok=True)
    except OSError as error:
        raise PlatformError(
            f"traces cannot be copied to {into}: {error.strerror}. Free space, or allow it."
        ) from error


def content_name(path: Path) -> str:
    """Name a file after its content: sha256 in hex.

    Raises:
        OSError: It cannot be read.
    """
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
