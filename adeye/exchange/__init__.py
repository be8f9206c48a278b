"""Runs for other people's viewers and tools, in the forms that those read.

Nothing is simulated here, no verdict is made, and no database is read. Begin with ``view``: a run
as others see it, from which all forms are written.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.errors import UsageError

if TYPE_CHECKING:
    import re
    from collections.abc import Callable
    from pathlib import Path


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
