"""Runs for other people's viewers and tools, in the forms that those read.

Nothing is simulated here, no verdict is made, and no database is read. Begin with ``view``: a run
as others see it, from which all forms are written.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from adeye.errors import InputError, UsageError

if TYPE_CHECKING:
    import re
    from collections.abc import Callable, Iterator
    from pathlib import Path

_FOREIGN: Final = frozenset({"foxglove", "google", "mcap", "mcap_protobuf", "osi3", "rosbags"})
"""Packages that forms need and a plain installation lacks."""


@contextmanager
def needing(form: str, extra: str) -> Iterator[None]:
    """Say which extra is missing where the import of a form fails within.

    Args:
        form: What is to be written.
        extra: Of the package, which brings the libraries for it.

    Raises:
        InputError: One of them is not installed.
    """
    try:
        yield
    except ImportError as error:
        if (error.name or "").partition(".")[0] not in _FOREIGN:
            raise
        raise InputError(
            f"{form} needs adeye[{extra}]", remedy=f"pip install 'adeye[{extra}]'."
        ) from error


def require_place(
    folder: Path, names: re.Pattern[str], what: str, is_own: Callable[[Path], bool]
) -> None:
    """Refuse a folder that holds something else than what adeye has written there.

    Args:
        folder: Which is replaced.
        names: Of the files that are written there.
        what: They are, in words.
        is_own: Tells whether adeye has written a file that has such a name.

    Raises:
        UsageError: It does.
    """
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    remedy = "Name another folder; what is written takes the place of the former one only."
    if any(names.fullmatch(item.name) is None for item in files):
        raise UsageError(f"folder {str(folder)!r} holds something else than {what}", remedy=remedy)
    if not all(item.is_file() and is_own(item) for item in files):
        raise UsageError(
            f"folder {str(folder)!r} holds {what} that adeye has not written", remedy=remedy
        )
