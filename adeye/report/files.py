"""Write a file so that a reader sees the old content or the new one, never a part."""

from __future__ import annotations

import contextlib
import os
import shutil
from typing import TYPE_CHECKING

from adeye.errors import PlatformError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


def write_atomically(content: bytes, path: Path) -> None:
    """Write a file beside its place and move it there; missing folders are made.

    Args:
        content: Everything that the file holds.
        path: Where to.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(content)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a place beside a file to write to; what stands there at the end becomes the file.

    Args:
        path: Of the file; missing folders are made.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    temporary = _beside(path)
    try:
        with _refusals_in_words(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            yield temporary
            _sync(temporary)
            temporary.replace(path)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Give an empty folder beside a folder; with what it holds at the end it takes its place.

    Args:
        path: Of the folder; missing ones above it are made.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    temporary, former = _beside(path), _beside(path, "former")
    try:
        with _refusals_in_words(path):
            temporary.mkdir(parents=True)
            yield temporary
            for file in sorted(temporary.iterdir()):
                _sync(file)
            if path.exists():
                path.replace(former)
            try:
                temporary.replace(path)
            except OSError:
                if former.exists():
                    former.replace(path)
                raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        # If it could neither be replaced nor put back, it is all that there is.
        if path.exists():
            shutil.rmtree(former, ignore_errors=True)


def _beside(path: Path, end: str = "part") -> Path:
    # One process writes one file of a name at a time, so its number keeps writers apart.
    return path.with_name(f".{path.name}.{os.getpid()}.{end}")


def _sync(path: Path) -> None:
    """Wait until the disk has a file."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


@contextlib.contextmanager
def _refusals_in_words(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        msg = f"cannot write {path}: {error.strerror or error}. Check the folder and its rights."
        raise PlatformError(msg) from error
