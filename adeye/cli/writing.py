"""Files that verbs write: how they may be called, and that none of them is what a verb reads."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

PAGES: Final = (".html", ".htm")


def named(path: Path | None) -> Path | None:
    """Refuse a name that is rather an option whose file was forgotten; a callback of options.

    Raises:
        UsageError: The name begins with a dash.
    """
    if path is not None and str(path).startswith("-"):
        raise UsageError(
            f"{str(path)!r} stands where the name of a file is expected",
            remedy=f"Name the file first; for a file of this name write ./{path}.",
        )
    return path


def named_page(path: Path | None) -> Path | None:
    """Refuse a name that promises another form than HTML; a callback of options.

    Raises:
        UsageError: The name begins with a dash, or ends neither in .html nor in .htm.
    """
    if named(path) is not None and path is not None and path.suffix.lower() not in PAGES:
        raise UsageError(
            f"{str(path)!r} does not end in {' or '.join(PAGES)}, and a page of HTML is written",
            remedy="Give it that ending; a browser prints the page as PDF.",
        )
    return path


def keep_apart(output: Path, *inputs: Path | None) -> None:
    """Refuse to write over what is read, also by another path or a link to it.

    Raises:
        UsageError: The file to write is one of the files to read.
    """
    for path in inputs:
        if path is not None and output.exists() and path.exists() and output.samefile(path):
            raise UsageError(
                f"{str(output)!r} is what is read, and would be overwritten",
                remedy="Name another file to write.",
            )


def write_rows(header: Sequence[str], rows: Iterable[Sequence[Any]], path: Path) -> None:
    """Write a CSV file as a whole or not at all; missing folders are made.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    from adeye.report.files import write_atomically

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    write_atomically(text.getvalue().encode(), path)
