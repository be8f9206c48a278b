"""Write a file so that a reader sees the old content or the new one, never a part."""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING

from adeye.errors import PlatformError

if TYPE_CHECKING:
    from pathlib import Path


def write_atomically(content: bytes, path: Path) -> None:
    """Write a file beside its place and move it there; missing folders are made.

    Args:
        content: Everything that the file holds.
        path: Where to.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    # One process writes one report at a time, so its number is enough to keep writers apart.
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        msg = f"cannot write {path}: {error.strerror or error}. Check the folder and its rights."
        raise PlatformError(msg) from error
