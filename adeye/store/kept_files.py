"""Files of kept traces: where they are, and their names, which are hashes of their content."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from pathlib import Path

SUFFIX: Final = ".npz"


def folder_of(database: Path) -> Path:
    """Name the folder of the traces of a database.

    >>> from pathlib import Path
    >>> folder_of(Path(".adeye/adeye.db")).as_posix()
    '.adeye/adeye.traces'
    """
    return database.with_suffix(".traces")


def content_name(path: Path) -> str:
    """Name a file after its content: sha256 in hex.

    Raises:
        OSError: It cannot be read.
    """
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
