"""Files of kept traces: where they are, and their names, which are hashes of their content."""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from pathlib import Path

SUFFIX: Final = ".npz"
_NAME: Final = re.compile("[0-9a-f]{64}")


def folder_of(database: Path) -> Path:
    """Name the folder of the traces of a database.

    >>> from pathlib import Path
    >>> folder_of(Path(".adeye/adeye.db")).as_posix()
    '.adeye/adeye.traces'
    """
    return database.with_suffix(".traces")


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


def content_name(path: Path) -> str:
    """Name a file after its content: sha256 in hex.

    Raises:
        OSError: It cannot be read.
    """
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
